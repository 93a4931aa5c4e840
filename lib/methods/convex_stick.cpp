// Impulses of convex that stop all contacts of an island at rest.
//
// Problem: r with J v + w = 0 in all rows (in the normal one alone where mu = 0), next to zero in the norm of G^-1:
//   min 1/2 r.W r + r.q + 1/2 |r - r_k|^2 / G,   G = 1 / (proximal w), friction times its share
// Source: proximal point iteration; each step divides what is left by 1e8 where W is not nearly singular.
// Differences: the first r has the least norm; where that is outside the cones friction is shared in the ratio of the
// normal impulses found, once.
// Fails where that is outside as well (the island slips), and where light bodies under heavy ones keep the iteration
// from rounding.

#include "methods/convex_stick.h"

#include <algorithm>
#include <cmath>

#include "cone/rows.h"

namespace cb {

namespace {

/// -: velocities as a fraction of the motion that count as zero, and of the impulses; that no step makes smaller; and
/// that are still there after three steps where the iteration does not come to rounding.
constexpr double of_motion = 1e-13, of_impulses = 1e-15, tiny = 1e-16, hopeless = 1e-6;
/// Steps that serve but for heavy bodies on light ones, and steps in a row that do not halve what is left.
constexpr int usual_steps = 3, patience = 2;

class Stick {
 public:
  Stick(const ConvexIsland& island, const ConeProgram& program, const ConeOptions& options, StickScratch& scratch)
      : island_(island), program_(program), options_(options), s_(scratch) {}

  // Factors for the present shares. False where a pivot fails.
  bool factor() {
    const int nc = island_.nc();
    s_.G.assign(9 * nc, 0.0);
    for (int c = 0; c < nc; ++c) {
      const double stiff = 1 / (options_.proximal * island_.weight[c]);
      s_.G[9 * c] = stiff;
      s_.G[9 * c + 4] = s_.G[9 * c + 8] = island_.mu[c] > 0 ? stiff * s_.share[c] : 0;
    }
    return s_.system.factor(s_.G, {});
  }

  // Impulses that stop all contacts, to rounding; into s_.r. There each step takes away some digits only where heavy
  // bodies are on light ones, and at the end large impulses round at random, so that the best counts.
  bool iterate() {
    std::fill(s_.r.begin(), s_.r.end(), 0.0);
    double least = HUGE_VAL, rounding = 0;
    for (int k = 0, stalled = 0;; ++k) {
      const double residual = find_velocities(rounding);
      stalled = residual < 0.5 * least ? 0 : stalled + 1;
      if (residual < least) {
        least = residual;
        s_.best = s_.r;
      }
      const bool goes_on = stalled < patience && residual > of_motion * island_.size && k < options_.polish_limit;
      if (residual <= tiny * island_.size || (k >= usual_steps && !goes_on)) break;
      if (k == usual_steps - 1 && residual > hopeless * island_.size && stalled > 0) return false;
      step();
    }
    s_.r = s_.best;
    return least <= rounding;
  }

  bool inside_cones() const {
    for (int c = 0; c < island_.nc(); ++c)
      if (!in_cone(&s_.r[3 * c], island_.mu[c])) return false;
    return true;
  }

  // False where a contact pulls.
  bool share_by_load() {
    const int nc = island_.nc();
    double mean = 0;
    for (int c = 0; c < nc; ++c) mean += s_.r[3 * c] / nc;
    for (int c = 0; c < nc; ++c) {
      if (!(s_.r[3 * c] > 0)) return false;
      s_.share[c] = s_.r[3 * c] / mean;
    }
    return true;
  }

 private:
  // The largest velocity left that is to stop, scaled, and what of it is rounding.
  double find_velocities(double& rounding) {
    s_.velocities.evaluate(program_, s_.r, {});
    double residual = 0, impulses = 0;
    for (int c = 0; c < island_.nc(); ++c) {
      const int rows = island_.mu[c] > 0 ? 3 : 1;
      for (int i = 0; i < 3; ++i) {
        if (i < rows)
          residual = std::max(residual, std::abs(s_.velocities.u[3 * c + i]) / std::sqrt(island_.weight[c]));
        s_.step[3 * c + i] = -s_.G[9 * c + 4 * i] * s_.velocities.u[3 * c + i];
      }
      impulses += island_.weight[c] * vec3(&s_.r[3 * c]).squaredNorm();
    }
    rounding = std::max(of_motion * island_.size, of_impulses * std::sqrt(impulses));
    return residual;
  }

  void step() {
    std::fill(s_.h.begin(), s_.h.end(), 0.0);
    multiply_transposed_add(island_.J, island_.M, s_.step, s_.h);
    s_.system.solve_in_place(s_.h);
    multiply(island_.J, island_.M, s_.h, s_.u_step);
    for (int i = 0; i < 3 * island_.nc(); ++i) s_.r[i] += s_.step[i] - s_.G[9 * (i / 3) + 4 * (i % 3)] * s_.u_step[i];
  }

  const ConvexIsland& island_;
  const ConeProgram& program_;
  const ConeOptions& options_;
  StickScratch& s_;
};

}  // namespace

bool stick_contacts(const ConvexIsland& island, const ConeProgram& program, const ConeOptions& options, StickScratch& s,
                    ConeSolution& x) {
  const int nc = island.nc();
  s.system.prepare(island.M, island.J, options.least_block);
  s.step.resize(3 * nc);
  s.h.resize(island.nv());
  s.u_step.resize(3 * nc);
  s.r.resize(3 * nc);
  s.share.assign(nc, 1.0);
  Stick stick(island, program, options, s);
  for (int round = 0; round < 2; ++round) {
    if (!stick.factor()) return false;
    ++x.iterations;
    if (!stick.iterate()) return false;
    if (stick.inside_cones()) {
      x.r = s.r;
      x.eta.assign(nc, 0.0);
      x.status = ConeStatus::solved;
      return true;
    }
    if (!stick.share_by_load()) return false;
  }
  return false;
}

}  // namespace cb
