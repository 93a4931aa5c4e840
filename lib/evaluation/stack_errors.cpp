// Errors of a stack at rest: nothing moves, and the normal impulses at an interface carry what is above it. Steps to an
// accuracy, which are extrapolated, have no impulses of their own.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "evaluation/references.h"

namespace cb {

namespace {

class StackErrors : public Measure {
 public:
  StackErrors(const Scenario& scenario, const SimulationOptions& options);
  void observe_start(const State& state) override { start_pose_ = state.pose; }
  void observe_event(const EventRecord& event) override;
  void observe_step(const State& state, const StepRecord& record) override;
  void report(Values& out) const override;

 private:
  double duration_, step_;
  std::vector<int> level_;  // per body: 0 is the lowest
  std::vector<int> body_of_shape_;
  std::vector<double> carried_;  // per interface (below the body of that level): m g h of all above, N s
  double total_ = 0;
  bool at_rest_ = true;      // have the interface sums a closed form?
  std::vector<double> sum_;  // of this step
  bool neighbours_ = true;   // do all contacts join neighbouring levels?
  std::vector<Pose> start_pose_;
  double displacement_ = 0, displacement_now_ = 0, tilt_ = 0, penetration_ = 0, sum_error_ = 0, total_error_ = 0;
  double t_ = 0;
  bool events_ = false;
};

StackErrors::StackErrors(const Scenario& scenario, const SimulationOptions& options)
    : duration_(options.duration), step_(options.step) {
  const std::size_t n = scenario.model.bodies.size();
  const Vec3& g = scenario.gravity.constant;
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return g.dot(scenario.initial.pose[a].p) > g.dot(scenario.initial.pose[b].p); });
  level_.resize(n);
  carried_.resize(n);
  sum_.resize(n);
  double weight = 0;
  for (std::size_t i = n; i-- > 0;) {
    level_[order[i]] = static_cast<int>(i);
    weight += scenario.model.bodies[order[i]].mass * g.norm() * step_;
    carried_[i] = weight;
    total_ += weight;
  }
  for (const Shape& shape : scenario.shapes) body_of_shape_.push_back(shape.body);
  at_rest_ = options.stepping != Stepping::accuracy && !scenario.gravity.varies() && scenario.forces.empty() &&
             weight > 0 &&
             std::all_of(scenario.initial.v.begin(), scenario.initial.v.end(), [](double x) { return x == 0; });
  for (const PairLaw& law : scenario.pairs.laws) at_rest_ &= law.restitution == 0;
}

void StackErrors::observe_event(const EventRecord& event) {
  if (!at_rest_) return;
  events_ = true;
  for (std::size_t c = 0; c < event.contacts.size(); ++c) {
    const int a = body_of_shape_[event.contacts[c].shape_a], b = body_of_shape_[event.contacts[c].shape_b];
    const int level_a = a < 0 ? -1 : level_[a], level_b = b < 0 ? -1 : level_[b];
    neighbours_ &= std::abs(level_a - level_b) == 1;
    sum_[std::max(level_a, level_b)] += event.solution.impulse[3 * c];
  }
}

void StackErrors::observe_step(const State& state, const StepRecord& record) {
  t_ = state.t;
  penetration_ = std::max(penetration_, record.max_penetration);
  displacement_now_ = 0;
  for (std::size_t b = 0; b < start_pose_.size(); ++b) {
    displacement_now_ = std::max(displacement_now_, (state.pose[b].p - start_pose_[b].p).squaredNorm());
    tilt_ = std::max(tilt_, turned(start_pose_[b].q, state.pose[b].q));
  }
  displacement_now_ = std::sqrt(displacement_now_);
  displacement_ = std::max(displacement_, displacement_now_);
  if (!at_rest_) return;
  double all = 0;
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    sum_error_ = std::max(sum_error_, std::abs(sum_[i] - carried_[i]) / carried_[i]);
    all += sum_[i];
    sum_[i] = 0;
  }
  total_error_ = std::max(total_error_, std::abs(all - total_) / total_);
}

void StackErrors::report(Values& out) const {
  out.emplace_back("displacement_linf_m", displacement_);
  if (t_ >= duration_ - step_ / 2) out.emplace_back("displacement_final_m", displacement_now_);
  out.emplace_back("tilt_linf_rad", tilt_);
  if (at_rest_ && neighbours_ && events_) {
    out.emplace_back("interface_sum_relative", sum_error_);
    out.emplace_back("interface_total_relative", total_error_);
  }
  out.emplace_back("penetration_linf_m", penetration_);
}

std::unique_ptr<Measure> make(const Scenario& scenario, const SimulationOptions& options, int /*k*/) {
  return scenario.model.bodies.empty() ? nullptr : std::make_unique<StackErrors>(scenario, options);
}

}  // namespace

ReferenceRow stack_row() {
  return {"stack",
          "a stack at rest: nothing moves, and the normal impulses at an interface carry what is above it",
          {{"displacement_linf_m", "m; largest displacement of a body's centre"},
           {"displacement_final_m", "m; the same at the end"},
           {"tilt_linf_rad", "rad; largest angle turned by a body"},
           {"interface_sum_relative",
            "-; sum of normal impulses of a step at an interface against m g h of all above "
            "it; worst of all steps and interfaces"},
           {"interface_total_relative", "-; the same for the sum over all interfaces, worst of all steps"},
           {"penetration_linf_m", "m; deepest penetration"}},
          make};
}

}  // namespace cb
