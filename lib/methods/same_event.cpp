#include "methods/same_event.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace cb {

namespace {

/// -: differences that count as rounding, as fractions of what they are differences of; of velocities.
constexpr double rounding = 1e-15, velocity_rounding = 4e-15;
/// -: change of velocities from event to event, of the fastest, beyond which a third event like these is not awaited.
constexpr double moving = 1e-6;

bool equal(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin());
}

/// Do the numbers differ by at most `rounding` of the largest?
template <int count>
bool near(const double* a, const double* b) {
  using Array = Eigen::Array<double, count, 1>;
  const Eigen::Map<const Array> now(a), then(b);
  return (now - then).abs().maxCoeff() <= rounding * then.abs().maxCoeff();
}

class SameEvent {
 public:
  SameEvent(ContactMethod method, std::shared_ptr<Counter> reused)
      : method_(std::move(method)), reused_(std::move(reused)) {}

  void operator()(const ContactProblem& problem, ContactSolution& solution) {
    if (solved_ && same(problem)) {
      solution = answer_;
      solution.iterations = 0;
      if (reused_) ++*reused_;
      return;
    }
    method_(problem, solution);
    solved_ = solution.status == Status::ok && !moves_on(problem);
    if (!solved_) return;
    problem_ = problem;
    answer_ = solution;
  }

 private:
  bool moves_on(const ContactProblem& now);
  bool same(const ContactProblem& now);
  bool same_matrices(const ContactProblem& now) const;

  ContactMethod method_;
  std::shared_ptr<Counter> reused_;
  bool solved_ = false;
  ContactProblem problem_;                 // the event that was solved,
  ContactSolution answer_;                 // and its answer
  std::vector<double> change_, velocity_;  // velocity_: before the last event that was solved
};

// Does it differ from the last event by so much that the next will hardly be the same? Then it is not kept.
bool SameEvent::moves_on(const ContactProblem& now) {
  bool moves = false;
  if (velocity_.size() == now.v_minus.size()) {
    double change = 0, fastest = 0;
    for (std::size_t i = 0; i < velocity_.size(); ++i) {
      change = std::max(change, std::abs(now.v_minus[i] - velocity_[i]));
      fastest = std::max(fastest, std::abs(velocity_[i]));
    }
    moves = change > moving * fastest;
  }
  velocity_ = now.v_minus;
  return moves;
}

bool SameEvent::same(const ContactProblem& now) {
  const ContactProblem& then = problem_;
  if (now.nc() != then.nc() || now.nv() != then.nv() || now.nc() == 0) return false;
  // Velocities first: where anything moves it is they that differ.
  change_.resize(then.v_minus.size());
  for (std::size_t i = 0; i < change_.size(); ++i) change_[i] = now.v_minus[i] - then.v_minus[i];
  for (int b = 0; b < then.M.blocks(); ++b) {
    if (now.M.block_size(b) != then.M.block_size(b)) return false;
    double moved = 0, motion = 0;
    const double* M = then.M.values.data() + then.M.offset[b];
    const int first = then.M.first[b], n = then.M.block_size(b);
    for (int j = 0; j < n; ++j, M += n) {
      double Mx = 0, Mv = 0;
      for (int i = 0; i < n; ++i) {
        Mx += M[i] * change_[first + i];
        Mv += M[i] * then.v_minus[first + i];
      }
      moved += change_[first + j] * Mx;
      motion += then.v_minus[first + j] * Mv;
    }
    if (!(moved <= velocity_rounding * velocity_rounding * motion)) return false;
  }
  return same_matrices(now) && equal(now.mu, then.mu) && equal(now.restitution, then.restitution) &&
         equal(now.offset, then.offset);
}

bool SameEvent::same_matrices(const ContactProblem& now) const {
  const BandMatrix &J = now.J, &J_then = problem_.J;
  if (J.band != J_then.band || J.block != J_then.block || J.offset != J_then.offset) return false;
  if (!equal(now.M.values, problem_.M.values))
    for (int b = 0; b < now.M.blocks(); ++b) {
      if (now.M.block_size(b) != 6) return false;
      const double *a = now.M.values.data() + now.M.offset[b], *c = problem_.M.values.data() + problem_.M.offset[b];
      if (!near<18>(a, c) || !near<18>(a + 18, c + 18)) return false;  // mass; moments of inertia
    }
  if (!equal(J.values, J_then.values))
    for (std::size_t e = 0; e < J.block.size(); ++e) {
      if (J.entry(static_cast<int>(e)).cols() != 6) return false;
      const double *a = J.values.data() + J.offset[e], *c = J_then.values.data() + J.offset[e];
      if (!near<9>(a, c) || !near<9>(a + 9, c + 9)) return false;  // directions; arms
    }
  return true;
}

}  // namespace

ContactMethod reuse_same_event(ContactMethod method, std::shared_ptr<Counter> reused) {
  auto same = std::make_shared<SameEvent>(std::move(method), std::move(reused));
  return [same](const ContactProblem& problem, ContactSolution& solution) { (*same)(problem, solution); };
}

}  // namespace cb
