// Answers of convex by an orthogonal factorisation (stopping_impulse.h), direct: a wheel's spin beside a heavy base
// makes W nearly singular, and proximal iterations need many steps there.
//
// Problem: a set S of contacts and impulses r on S with u = 0 in their normal rows (frictionless), or in all three.
// Source: active sets; one contact enters or leaves S at a time.
// Fails where no set serves in 2 nc + 2 rounds, where sizes are beyond StoppingImpulse::dense_limit, or where friction
// is needed outside the cones: then the island slips.

#include "methods/convex_stop.h"

#include <algorithm>
#include <cmath>

#include "cone/rows.h"

namespace cb {

namespace {

/// -: velocities, as a fraction of the motion, that count as zero.
constexpr double rounding = 1e-13;
/// -: normal impulses, as a fraction of their mean, below which weights do not grow further.
constexpr double least_load = 1e-3;

// Impulses that stop the contacts of the set, 1 or 3 rows each; into scratch.r. Returns the largest velocity left in
// those rows, scaled; negative: too large for this.
double stop_set(const ConvexIsland& island, const ConeProgram& program, std::span<const double> weight, int rows,
                StopScratch& s, ConeSolution& x) {
  const int nc = island.nc();
  if (!s.stopping.prepare(island.M, island.J, island.factor, weight, s.set, rows)) return -1;
  ++x.iterations;
  s.r.assign(3 * nc, 0.0);
  double residual = HUGE_VAL;
  for (int k = 0; k < 3; ++k) {
    s.velocities.evaluate(program, s.r, {});
    residual = 0;
    for (int c = 0; c < nc; ++c)
      for (int i = 0; i < rows && s.set[c]; ++i)
        residual = std::max(residual, std::abs(s.velocities.u[3 * c + i]) / std::sqrt(island.weight[c]));
    if (k < 2) s.stopping.correct(s.velocities.u, s.r);
  }
  return residual;
}

// The contact of the set with the largest pull, and the one outside of it that sinks fastest; negative: none.
int most_pulling(const StopScratch& s) {
  int pulls = -1;
  for (int c = 0; c < static_cast<int>(s.set.size()); ++c)
    if (s.set[c] && s.r[3 * c] < 0 && (pulls < 0 || s.r[3 * c] < s.r[3 * pulls])) pulls = c;
  return pulls;
}
int fastest_sinking(const ConvexIsland& island, const StopScratch& s, double slack) {
  int sinks = -1;
  for (int c = 0; c < island.nc(); ++c) {
    const double u_n = s.velocities.u[3 * c];
    if (!s.set[c] && u_n < -slack * std::sqrt(island.weight[c]) && (sinks < 0 || u_n < s.velocities.u[3 * sinks]))
      sinks = c;
  }
  return sinks;
}

bool inside_cones(const ConvexIsland& island, const StopScratch& s) {
  for (int c = 0; c < island.nc(); ++c)
    if (s.set[c] && !in_cone(&s.r[3 * c], island.mu[c])) return false;
  return true;
}

// Contacts are weighted by their load, so that friction goes where the normal impulses are.
void weight_by_load(const ConvexIsland& island, StopScratch& s) {
  double mean = 0;
  int carry = 0;
  for (int c = 0; c < island.nc(); ++c) {
    if (!s.set[c]) continue;
    mean += s.r[3 * c];
    ++carry;
  }
  for (int c = 0; c < island.nc(); ++c)
    if (s.set[c]) s.weight[c] = island.weight[c] * mean / carry / std::max(s.r[3 * c], least_load * mean / carry);
}

}  // namespace

// Contacts that would pull are let go, one that would sink is taken back.
bool stop_normals(const ConvexIsland& island, const ConeProgram& normal, StopScratch& s, ConeSolution& x) {
  const int nc = island.nc();
  const double slack = rounding * std::max(island.size, std::sqrt(quadratic_form(island.M, island.v0)));
  s.set.assign(nc, 1);
  for (int round = 0; round < 2 * nc + 2; ++round) {
    const double residual = stop_set(island, normal, island.weight, 1, s, x);
    if (!(residual >= 0 && residual <= slack)) return false;
    if (const int pulls = most_pulling(s); pulls >= 0) {
      s.set[pulls] = 0;
    } else if (const int sinks = fastest_sinking(island, s, slack); sinks >= 0) {
      s.set[sinks] = 1;
    } else {
      x.r = s.r;
      return true;
    }
  }
  return false;
}

// Does the least impulse that stops the contacts that carry lie in the cones? If not, does one with friction and normal
// impulses weighted otherwise?
bool stop_contacts(const ConvexIsland& island, const ConeProgram& program, StopScratch& s, ConeSolution& x) {
  const int nc = island.nc();
  s.weight = island.weight;
  s.set.assign(nc, 1);
  bool weighted = false;
  for (int round = 0; round < nc + 2; ++round) {
    if (stop_set(island, program, s.weight, 3, s, x) < 0) return false;
    if (inside_cones(island, s)) {
      x.r = s.r;
      x.eta.assign(nc, 0.0);
      x.status = ConeStatus::solved;
      return true;
    }
    if (const int pulls = most_pulling(s); pulls >= 0) {
      s.set[pulls] = 0;
    } else if (!weighted) {
      weighted = true;
      weight_by_load(island, s);
    } else {
      return false;
    }
  }
  return false;
}

}  // namespace cb
