// kappa of convex: the least sum of normal impulses among the frictionless answers, with its proof.
//
// Problem:  f >= 0,  u_n = N (v- + M^-1 N^T f) + w_n >= 0,  f.u_n = 0;   kappa = min 1.f over these
// proved by z with N z <= 1 where f touches, = 1 where f > 0 (duality of linear programming).
// Source: proposals, each of which counts only if the conditions above hold for it, cheapest first:
//   f: active sets, direct, for robots (convex_stop.h); Newton's method from all contacts closed (polish.h); the
//   interior
//      point method
//   z: the even lift of all contacts (convex_lift.h); of those that touch; a linear program, dense (least_sum.h), which
//      finds another f with it
// Fails where no f or no z comes to 9e-10 of the island; the best f there is remains.

#include "methods/convex_bound.h"

#include <algorithm>
#include <cmath>

#include "linalg/finite.h"

namespace cb {

namespace {

/// -: of the island's motion, the normal impulses that Newton's method starts from.
constexpr double first_guess = 1e-3;

}  // namespace

bool ConvexBoundFinder::find(const ConvexIsland& island, ConvexBound& b, int& iterations) {
  normal_ = island.normal_program(t_.bounded);
  b.shape = ConvexShape::general;
  const bool solved = frictionless(island, b, iterations);
  if (!t_.bounded) return true;
  const bool proven = prove(island, solved, b);
  b.kappa = island.sum_of_shares(b.f);
  b.shape = find_shape(island, t_, set_, lift_, b);
  return proven;
}

bool ConvexBoundFinder::frictionless(const ConvexIsland& island, ConvexBound& b, int& iterations) {
  bool solved = false;
  for (const auto way : {&ConvexBoundFinder::stops, &ConvexBoundFinder::closes, &ConvexBoundFinder::minimises}) {
    x_.iterations = 0;
    solved = (this->*way)(island);
    iterations += x_.iterations;
    if (solved) break;
  }
  if (!all_finite(x_.r)) {
    x_.r.assign(3 * island.nc(), 0.0);
    solved = false;
  }
  b.f.resize(island.nc());
  for (int c = 0; c < island.nc(); ++c) b.f[c] = std::max(0.0, x_.r[3 * c]);
  take(island, b);
  return solved && complementary(island, b);
}

bool ConvexBoundFinder::stops(const ConvexIsland& island) {
  return island.size > 0 && island.has_robot() && stop_normals(island, normal_, stop_, x_);
}

// First guess: all contacts that do not clearly part are closed.
bool ConvexBoundFinder::closes(const ConvexIsland& island) {
  x_.r.assign(3 * island.nc(), 0.0);
  x_.eta.assign(island.nc(), 0.0);
  x_.s = 0;
  for (int c = 0; c < island.nc(); ++c) x_.r[3 * c] = first_guess * island.size / std::sqrt(island.weight[c]);
  return island.size > 0 && solver_.polish(normal_, x_, PolishRules::bold(t_.cone, t_.cone.guess_patience));
}

bool ConvexBoundFinder::minimises(const ConvexIsland&) {
  solver_.solve(normal_, x_);
  return x_.status == ConeStatus::solved;
}

// Does f solve the frictionless problem?
bool ConvexBoundFinder::complementary(const ConvexIsland& island, const ConvexBound& b) {
  bool bounded_rounding = false;
  for (int c = 0; c < island.nc(); ++c) {
    const double root_w = std::sqrt(island.weight[c]), u_n = b.u_f[3 * c] / root_w;
    const double wrong = std::max(-u_n, std::min(b.f[c] * root_w, u_n));
    if (wrong <= t_.backward * island.scale()) continue;
    if (!bounded_rounding) velocities_.bound_rounding(normal_, b.impulse, {});
    bounded_rounding = true;
    if (wrong > t_.cone.rounding_units * velocities_.rounding[c]) return false;
  }
  return true;
}

// What belongs to f.
void ConvexBoundFinder::take(const ConvexIsland& island, ConvexBound& b) {
  b.impulse.assign(3 * island.nc(), 0.0);
  for (int c = 0; c < island.nc(); ++c) b.impulse[3 * c] = b.f[c];
  velocities_.evaluate(normal_, b.impulse, {});
  b.u_f = velocities_.u;
}

// Without a frictionless answer only the last way, which finds one, is of use: where it can, with a proof about all
// that the referee may hold to touch.
bool ConvexBoundFinder::prove(const ConvexIsland& island, bool solved, ConvexBound& b) {
  b.miss = HUGE_VAL;
  set_.assign(island.nc(), 1);
  if (solved && (lifts_all(island, b) || lifts_touching(island, b))) {
    // A contact that parts by no more than rounding may touch: then another proves a lesser sum.
    const double slowest = slowest_parted(island, b), open = slowest < HUGE_VAL ? open_by_rounding(island, b.f) : 0;
    if (slowest > open) return true;
    const ConvexBound first = b;
    const std::vector<char> first_set = set_;
    if (lifts_densely(island, open, b)) return true;
    b = first;
    set_ = first_set;
    return true;
  }
  return lifts_densely(island, open_by_rounding(island, b.f), b) || lifts_densely(island, own_rounding(b), b);
}

// Where N z = 1 can be solved on the contacts that touch every f has the same sum, z.M (v_f - v-).
bool ConvexBoundFinder::lifts_all(const ConvexIsland& island, ConvexBound& b) {
  lift(island, t_, set_, lift_, b);
  return proves_least_sum(island, t_, b);
}

bool ConvexBoundFinder::lifts_touching(const ConvexIsland& island, ConvexBound& b) {
  for (int c = 0; c < island.nc(); ++c)
    set_[c] = b.u_f[3 * c] <= t_.surely_touching * island.scale() * std::sqrt(island.weight[c]) ? 1 : 0;
  lift(island, t_, set_, lift_, b);
  return proves_least_sum(island, t_, b);
}

// Of the contacts that the proof counts on to part, the slowest one's velocity, sqrt(J); infinite where there is none.
double ConvexBoundFinder::slowest_parted(const ConvexIsland& island, const ConvexBound& b) const {
  double slowest = HUGE_VAL;
  for (int c = 0; c < island.nc(); ++c)
    if (b.J_z[3 * c] - island.share[c] > t_.backward)
      slowest = std::min(slowest, b.u_f[3 * c] / std::sqrt(island.weight[c]));
  return slowest;
}

// What rounding makes of a normal velocity at most, sqrt(J).
double ConvexBoundFinder::own_rounding(const ConvexBound& b) {
  velocities_.bound_rounding(normal_, b.impulse, {});
  return t_.cone.rounding_units * *std::max_element(velocities_.rounding.begin(), velocities_.rounding.end());
}

// Where contacts depend on each other up to rounding the lift of all that touch cannot be even, and an active set
// cannot be named.
bool ConvexBoundFinder::lifts_densely(const ConvexIsland& island, double open, ConvexBound& b) {
  first_f_ = b.f;
  b.z.assign(island.nv(), 0.0);
  if (!dense_.solve(island.M, island.J, island.factor, island.weight, island.q, island.share,
                    std::max(open, t_.touching * island.size), b.f, b.z)) {
    b.f = first_f_;
    return false;
  }
  take(island, b);
  b.J_z.resize(3 * island.nc());
  multiply(island.J, island.M, b.z, b.J_z);
  b.lambda.assign(island.nc(), 0.0);
  b.miss = HUGE_VAL;
  if (complementary(island, b) && proves_least_sum(island, t_, b)) return true;
  if (lets_go(island, b)) return true;
  b.f = first_f_;
  take(island, b);
  return false;
}

// Where a contact neither carries nor parts clearly, f ends at a hair that z does not allow: the others take it over,
// but for those that would have to pull.
bool ConvexBoundFinder::lets_go(const ConvexIsland& island, ConvexBound& b) {
  constexpr int rounds = 5;
  for (int c = 0; c < island.nc(); ++c) set_[c] = b.f[c] > 0 && island.share[c] - b.J_z[3 * c] <= t_.backward ? 1 : 0;
  bool pulls = true;
  for (int round = 0; round < rounds && pulls; ++round) {
    if (!stopping_.prepare(island.M, island.J, island.factor, island.weight, set_, 1)) return false;
    for (int c = 0; c < island.nc(); ++c)
      if (!set_[c]) b.f[c] = 0;
    take(island, b);
    stopping_.correct(b.u_f, b.impulse);
    pulls = false;
    for (int c = 0; c < island.nc(); ++c) {
      b.f[c] = b.impulse[3 * c];
      if (b.f[c] >= 0) continue;
      set_[c] = 0;
      pulls = true;
    }
  }
  take(island, b);
  return !pulls && complementary(island, b) && proves_least_sum(island, t_, b);
}

}  // namespace cb
