// Problem: min d.M d / 2 with N d >= wanted (m), many points. By duality d = M^-1 N^T r with 0 <= r _|_ N d - wanted >=
// 0, contact without friction in displacements. With a spring of hardness 1 / R at each point it has no constraints:
//   min d.M d / 2 + sum max(0, wanted - N d)^2 / (2 R),     R = ridge N M^-1 N^T                                  (1)
// and the hardest springs that come to an answer leave of `wanted` what the next linearisation takes away.
// How: Newton on M d = N^T r and r = max(0, r - (N d - wanted + R r) / w), w = N M^-1 N^T, d and r each in their own
// right as in methods/soft.cpp: one factorisation by bodies a step, whatever the number of points and however redundant
// they are. Steps are whole where they halve the least error so far, else as far as (1) is near its least. Soft springs
// come first: they tell which points hold in ten steps; hard ones alone exchange single points. Sets of points that are
// exchanged whole (overlap.cpp) need ever more exchanges on such islands, or cycle.
// Source: M. Hintermueller, K. Ito, K. Kunisch, The primal-dual active set strategy as a semismooth Newton method, SIAM
// J. Optim. 13 (2003).
// Bodies that are wedged in come to rest where the springs balance. When it fails: Newton's method comes to a stand
// whatever the springs, and nothing is moved.
#include "simulation/least_displacement.h"

#include <algorithm>
#include <cmath>

#include "linalg/convex_search.h"
#include "linalg/stop.h"

namespace cb {

namespace {

constexpr double ridges[] = {1e-2, 1e-5, 1e-8};  // -: of springs, in turn
constexpr double of_limits = 1e-2;               // -: of that, of what is to hold where it contradicts the others
constexpr int limit = 50;                        // steps, of each
constexpr double whole = 0.5;                    // -: of the least error so far, up to which a whole step is taken
constexpr double astray = 0.25;                  // -: length of a step from which on r goes along
constexpr double sharp = 1e-6;                   // -: error at which it stops
constexpr double accepted = 1e-2;                // -: up to which the springs' answer is one
constexpr double least_block = 3;                // mean size of a block of M from which on it is factored by blocks

}  // namespace

void LeastDisplacement::extract(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
                                std::span<const double> wanted, std::span<const double> scale) {
  M_.clear();
  J_.clear();
  wanted_.clear();
  w_.clear();
  is_limit_.clear();
  place_.resize(problem.M.blocks());
  for (const int b : blocks) {
    place_[b] = M_.add_block(problem.M.block_size(b));
    M_.block(place_[b]) = problem.M.block(b);
  }
  for (const int c : points) {
    if (scale[c] == 0) continue;
    J_.add_band();
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const int k = J_.add_entry(place_[problem.J.block[e]], problem.M.block_size(problem.J.block[e]));
      J_.entry(k) = problem.J.entry(e);
    }
    wanted_.push_back(wanted[c]);
    w_.push_back(1 / (scale[c] * scale[c]));
    is_limit_.push_back(is_limit(problem, c) ? 1 : 0);
  }
  R_.resize(w_.size());
}

// r of the springs at d.
void LeastDisplacement::take_springs() {
  for (std::size_t c = 0; c < w_.size(); ++c) r_[3 * c] = std::max(0.0, wanted_[c] - opened_[3 * c]) / R_[c];
}

// -: how far r, where it pushes, is from its own conditions, beside what is wanted.
double LeastDisplacement::look() {
  for (std::size_t i = 0; i < r_.size(); i += 3) given_[i] = std::max(0.0, r_[i]);
  moved_.assign(M_.order(), 0.0);
  multiply_transposed_add(J_, M_, given_, moved_);
  factor_.solve_in_place(moved_);
  multiply(J_, M_, moved_, opening_);
  double error = 0, size = 0;
  for (std::size_t c = 0; c < w_.size(); ++c) {
    const double r = given_[3 * c], y = opening_[3 * c] - wanted_[c] + R_[c] * r;
    const double off = r - std::max(0.0, r - y / w_[c]);
    error += w_[c] * off * off;
    size += wanted_[c] * wanted_[c] / w_[c];
  }
  return std::sqrt(error / size);
}

// M (d + dd) = N^T (r + dr), with r + dr = (wanted - N (d + dd)) / R where a point holds, else 0.
bool LeastDisplacement::find_step() {
  multiply(M_, d_, dd_);
  for (double& x : dd_) x = -x;
  for (std::size_t c = 0; c < w_.size(); ++c) {
    const double missing = wanted_[c] - opened_[3 * c], r = r_[3 * c];
    const bool holds = r + (missing - R_[c] * r) / w_[c] > 0;
    G_[9 * c] = holds ? 1 / R_[c] : 0;
    dr_[3 * c] = holds ? missing / R_[c] : 0;
  }
  multiply_transposed_add(J_, M_, dr_, dd_);
  if (!system_.factor(G_, {})) return false;
  system_.solve_in_place(dd_);
  multiply(J_, M_, dd_, opening_);
  for (std::size_t c = 0; c < w_.size(); ++c) dr_[3 * c] -= G_[9 * c] * opening_[3 * c] + r_[3 * c];
  return true;
}

double LeastDisplacement::length_of_step() {
  multiply(M_, dd_, moment_);
  double square = 0, linear = 0;
  for (std::size_t i = 0; i < dd_.size(); ++i) {
    square += dd_[i] * moment_[i];
    linear += d_[i] * moment_[i];
  }
  return convex_search({}, [&](double alpha) {
    Along at{linear + alpha * square, square};
    for (std::size_t c = 0; c < w_.size(); ++c) {
      const double opening = opening_[3 * c], missing = wanted_[c] - opened_[3 * c] - alpha * opening;
      if (missing <= 0) continue;
      at.slope -= missing / R_[c] * opening;
      at.curvature += opening * opening / R_[c];
    }
    return at;
  });
}

void LeastDisplacement::take_step(double length) {
  for (std::size_t i = 0; i < d_.size(); ++i) d_[i] += length * dd_[i];
  multiply(J_, M_, d_, opened_);
  if (length < astray) return take_springs();
  for (std::size_t i = 0; i < r_.size(); i += 3) r_[i] += length * dr_[i];
}

// Newton's method for one R_, from d_ and r_; returns the error of best_.
double LeastDisplacement::relax() {
  double least = HUGE_VAL, error = look();
  for (int k = 0; k < limit; ++k) {
    poll_stop();
    if (error < least) {
      least = error;
      best_ = given_;
    }
    if (least <= sharp || !find_step()) break;
    d_was_ = d_;
    r_was_ = r_;
    take_step(1);
    error = look();
    if (error <= whole * least) continue;
    d_ = d_was_;
    r_ = r_was_;
    multiply(J_, M_, d_, opened_);
    multiply(J_, M_, dd_, opening_);
    double length = length_of_step();
    if (length == 0) {  // r has gone another way than d
      take_springs();
      if (!find_step()) break;
      length = length_of_step();
    }
    if (length == 0) break;
    take_step(length);
    error = look();
  }
  return least;
}

bool LeastDisplacement::solve(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
                              std::span<const double> wanted, std::span<const double> scale, Eigen::VectorXd& d) {
  extract(problem, points, blocks, wanted, scale);
  if (!factor_.factor(M_)) return false;
  system_.prepare(M_, J_, least_block);
  for (std::vector<double>* x : {&r_, &dr_, &given_, &opened_, &opening_}) x->assign(3 * w_.size(), 0.0);
  for (std::vector<double>* x : {&d_, &dd_, &moment_}) x->assign(M_.order(), 0.0);
  G_.assign(9 * w_.size(), 0.0);
  bool found = false;
  for (const double ridge : ridges) {
    for (std::size_t c = 0; c < w_.size(); ++c) R_[c] = ridge * (is_limit_[c] ? of_limits : 1) * w_[c];
    if (!(relax() <= accepted)) continue;
    found = true;
    hardest_ = best_;
  }
  if (!found) return false;
  moved_.assign(M_.order(), 0.0);
  multiply_transposed_add(J_, M_, hardest_, moved_);
  factor_.solve_in_place(moved_);
  for (const int b : blocks)
    for (int i = 0; i < problem.M.block_size(b); ++i) d[problem.M.first[b] + i] = moved_[M_.first[place_[b]] + i];
  return true;
}

}  // namespace cb
