// The velocity that lifts an island evenly: the proof of kappa where there is one, and what makes a scene flat.
//
// Problem: z with N z = 1 on a set of contacts that touch, of least energy, so that M z = N^T lambda. Every
// frictionless f that is zero elsewhere has the sum 1.f = z.M (v_f - v-). Where T z = 0 as well and lambda >= 0 the
// bound says u_n = 0 (drumwright_shell.cpp). Source: proximal point iteration on lambda,  N z - 1 = -(change of lambda)
// / G; each step divides what is left by 1e8. Differences: light bodies between contacts that nearly oppose each other
// make W nearly singular, and the iteration ends early: then z comes from an orthogonal factorisation
// (stopping_impulse.h), without lambda. Fails where the contacts cannot be lifted evenly: `miss` says by how much.

#include "methods/convex_lift.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cone/certificate.h"
#include "cone/rows.h"

namespace cb {

namespace {

/// What a step that is not the last must make of what is left.
constexpr double least_progress = 0.1;

/// -: of N z less the shares (1, or 0), what its last bits are.
constexpr double last_bits = 4 * std::numeric_limits<double>::epsilon();

class Lift {
 public:
  Lift(const ConvexIsland& island, const ConvexTolerances& t, const std::vector<char>& set, LiftScratch& scratch,
       ConvexBound& bound)
      : island_(island), t_(t), set_(set), s_(scratch), b_(bound) {}

  void operator()() {
    b_.lambda.assign(island_.nc(), 0.0);
    b_.z.resize(island_.nv());
    s_.step.resize(3 * island_.nc());
    s_.u_step.resize(3 * island_.nc());
    s_.h.resize(island_.nv());
    if (!factor()) {
      b_.miss = HUGE_VAL;
      std::fill(b_.z.begin(), b_.z.end(), 0.0);
      return;
    }
    double last = HUGE_VAL;
    for (int k = 0;; ++k) {
      find_velocity();
      if (b_.miss <= last_bits) return;
      const bool done = k == t_.cone.polish_limit || b_.miss > least_progress * last;
      last = b_.miss;
      solve();
      if (done) {
        // z need not be an impulse's velocity: light bodies among heavy ones are put right directly.
        for (int i = 0; i < island_.nv(); ++i) b_.z[i] += s_.h[i];
        return;
      }
      step();
    }
  }

 private:
  bool factor() {
    const int nc = island_.nc();
    s_.system.prepare(island_.M, island_.J, t_.cone.least_block);
    s_.G.assign(9 * nc, 0.0);
    for (int c = 0; c < nc; ++c)
      if (set_[c]) s_.G[9 * c] = 1 / (t_.cone.proximal * island_.weight[c]);
    return s_.system.factor(s_.G, {});
  }

  // z = M^-1 N^T lambda, what it misses, and the impulses that answer to that.
  void find_velocity() {
    const int nc = island_.nc();
    s_.step.assign(3 * nc, 0.0);
    for (int c = 0; c < nc; ++c)
      if (set_[c]) s_.step[3 * c] = b_.lambda[c];
    std::fill(b_.z.begin(), b_.z.end(), 0.0);
    multiply_transposed_add(island_.J, island_.M, s_.step, b_.z);
    island_.factor.solve_in_place(b_.z);
    multiply(island_.J, island_.M, b_.z, s_.u_step);
    b_.miss = 0;
    for (int c = 0; c < nc; ++c) {
      const double miss = s_.u_step[3 * c] - island_.share[c];
      s_.step[3 * c] = set_[c] ? -s_.G[9 * c] * miss : 0;
      if (set_[c] && !(std::abs(miss) <= b_.miss)) b_.miss = std::isnan(miss) ? HUGE_VAL : std::abs(miss);
    }
  }

  void solve() {
    std::fill(s_.h.begin(), s_.h.end(), 0.0);
    multiply_transposed_add(island_.J, island_.M, s_.step, s_.h);
    s_.system.solve_in_place(s_.h);
  }

  void step() {
    multiply(island_.J, island_.M, s_.h, s_.u_step);
    for (int c = 0; c < island_.nc(); ++c)
      if (set_[c]) b_.lambda[c] += s_.step[3 * c] - s_.G[9 * c] * s_.u_step[3 * c];
  }

  const ConvexIsland& island_;
  const ConvexTolerances& t_;
  const std::vector<char>& set_;
  LiftScratch& s_;
  ConvexBound& b_;
};

// Is N z = 1 and T z = 0 on all contacts?
bool lifts_evenly(const ConvexIsland& island, const ConvexTolerances& t, const ConvexBound& b) {
  for (int c = 0; c < island.nc(); ++c)
    if (std::abs(b.J_z[3 * c] - island.share[c]) > t.solvable || tangential(&b.J_z[3 * c]) > t.solvable) return false;
  return true;
}

// Does a contact have lambda > 0 and touch?
bool carries_lift(const ConvexIsland& island, const ConvexTolerances& t, const ConvexBound& b, int c) {
  const double root_w = std::sqrt(island.weight[c]);
  return b.lambda[c] * island.weight[c] > t.carrying && b.u_f[3 * c] / root_w / island.scale() <= t.solvable;
}

// Do all contacts of the set, and is there one?
bool supports(const ConvexIsland& island, const ConvexTolerances& t, const std::vector<char>& set,
              const ConvexBound& b) {
  for (int c = 0; c < island.nc(); ++c)
    if (set[c] && !carries_lift(island, t, b, c)) return false;
  return std::find(set.begin(), set.end(), 1) != set.end();
}

}  // namespace

void lift(const ConvexIsland& island, const ConvexTolerances& t, const std::vector<char>& set, LiftScratch& s,
          ConvexBound& b) {
  Lift(island, t, set, s, b)();
  if (b.miss > t.solvable && s.stopping.prepare(island.M, island.J, island.factor, island.weight, set, 1)) {
    s.up.assign(3 * island.nc(), 0.0);
    for (int c = 0; c < island.nc(); ++c) s.up[3 * c] = island.share[c];
    s.stopping.least_velocity(s.up, island.factor, b.z);
  }
  b.J_z.resize(3 * island.nc());
  multiply(island.J, island.M, b.z, b.J_z);
}

double open_by_rounding(const ConvexIsland& island, const std::vector<double>& f) {
  std::vector<double> r(3 * f.size(), 0.0);
  for (std::size_t c = 0; c < f.size(); ++c) r[3 * c] = f[c];
  ConeVelocities velocities;
  velocities.bound_rounding(island.normal_program(true), r, {});
  double open = 0;
  for (int c = 0; c < island.nc(); ++c) open = std::max(open, velocities.rounding[c] * std::sqrt(island.weight[c]));
  return open_units * open / std::sqrt(*std::min_element(island.weight.begin(), island.weight.end()));
}

bool proves_least_sum(const ConvexIsland& island, const ConvexTolerances& t, const ConvexBound& b) {
  for (int c = 0; c < island.nc(); ++c) {
    const double root_w = std::sqrt(island.weight[c]), excess = b.J_z[3 * c] - island.share[c];
    const bool touches = b.u_f[3 * c] / root_w <= t.touching * island.scale();
    if (touches && excess > t.backward) return false;
    if (-excess > t.backward && b.f[c] * root_w > t.backward * island.scale()) return false;
  }
  return true;
}

// lambda is not unique where more contacts touch than carry: those with the wrong sign are left out of it.
ConvexShape find_shape(const ConvexIsland& island, const ConvexTolerances& t, std::vector<char>& set, LiftScratch& s,
                       ConvexBound& b) {
  if (island.nc() == 0 || b.miss > t.flat || !lifts_evenly(island, t, b)) return ConvexShape::general;
  if (!supports(island, t, set, b)) {
    s.proof = b.z;
    for (int round = 0; round < island.nc() && !supports(island, t, set, b); ++round) {
      for (int c = 0; c < island.nc(); ++c)
        if (!carries_lift(island, t, b, c)) set[c] = 0;
      lift(island, t, set, s, b);
    }
    if (b.miss > t.flat || !supports(island, t, set, b) || !lifts_evenly(island, t, b)) {
      b.z = s.proof;
      return ConvexShape::general;
    }
  }
  b.fixed = set;
  return ConvexShape::flat;
}

}  // namespace cb
