// Problem: min d.M d / 2 with N d >= wanted (m), many points. By duality d = M^-1 N^T r with 0 <= r _|_ N d - wanted >=
// 0, which is contact without friction in displacements: (1) of ncp/ncp.h with mu = 0, v0 = 0, w_n = -wanted. It is
// convex, and Mehrotra's steps take some tens of factorisations by bodies, whatever the number of points and however
// redundant they are; sets of points that are exchanged whole (overlap.cpp) need ever more exchanges there, or cycle.
// Source: S. Mehrotra, On the implementation of a primal-dual interior point method, SIAM J. Optim. 2 (1992).
// When it fails: no displacement keeps all points apart; the error stays, and nothing is moved.
#include "simulation/least_displacement.h"

#include <cmath>

#include "linalg/stop.h"

namespace cb {

namespace {

constexpr int limit = 100;         // steps
constexpr int patience = 10;       // of them in a row that do not halve the error
constexpr double sharp = 1e-9;     // -: error at which it stops; the next linearisation takes away what it leaves
constexpr double accepted = 1e-4;  // -: error up to which the best is taken

}  // namespace

void LeastDisplacement::extract(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
                                std::span<const double> wanted, std::span<const double> scale) {
  M_.clear();
  J_.clear();
  offset_.clear();
  weight_.clear();
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
    offset_.insert(offset_.end(), {-wanted[c], 0, 0});
    weight_.push_back(1 / (scale[c] * scale[c]));
  }
  mu_.assign(weight_.size(), 0.0);
  v0_.assign(M_.order(), 0.0);
}

bool LeastDisplacement::solve(const ContactProblem& problem, std::span<const int> points, std::span<const int> blocks,
                              std::span<const double> wanted, std::span<const double> scale, Eigen::VectorXd& d) {
  extract(problem, points, blocks, wanted, scale);
  if (!factor_.factor(M_)) return false;
  const NcpProblem island{&M_, &factor_, &J_, v0_, offset_, mu_, weight_, {}};
  measure_.begin(island);
  system_.prepare(M_, J_);
  double size = 0;
  for (std::size_t c = 0; c < weight_.size(); ++c) size += offset_[3 * c] * offset_[3 * c] / weight_[c];
  interior_.begin({}, island, system_, measure_, std::sqrt(size));
  double error = HUGE_VAL, mark = HUGE_VAL;
  for (int k = 0, since = 0; k < limit && since < patience && error > sharp; ++k) {
    poll_stop();
    if (!steps_.step({}, interior_)) break;
    if (interior_.error() < error) {
      error = interior_.error();
      best_ = interior_.r();
    }
    since = error < 0.5 * mark ? 0 : since + 1;
    if (since == 0) mark = error;
  }
  if (!(error <= accepted)) return false;
  measure_.velocities(best_, v_, u_);
  for (const int b : blocks)
    for (int i = 0; i < problem.M.block_size(b); ++i) d[problem.M.first[b] + i] = v_[M_.first[place_[b]] + i];
  return true;
}

}  // namespace cb
