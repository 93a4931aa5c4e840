// Errors of the two robot scenes (scenarios/mobile_robot.xml, scenarios/grasp.xml), gathered step by step.
//
// Slip of a wheel is the velocity of its lowest point, whether it is loaded or not; along is the robot's heading,
// across the level direction at right angles to it. Its load is the sum of the normal impulses of its contacts in a
// step; steps to an accuracy, which are extrapolated, have none. Creep of what is grasped is the root sum of squares of
// its displacement in both fingers' frames since the start. It counts as dropped once its centre is further than half
// its size from where it began, in both fingers' frames.
#include "evaluation/robot_errors.h"

#include <algorithm>
#include <cmath>

#include "evaluation/references.h"

namespace cb {

namespace {

constexpr double started = 5;          // s: after that the cross-track error counts
constexpr double unloaded = 1e-6;      // fraction of both wheels' load below which one has none
constexpr double drop_fraction = 0.5;  // of the object's size

}  // namespace

void DriveErrors::Mean::add(double x) {
  sum2 += x * x;
  largest = std::max(largest, std::abs(x));
  ++samples;
}

double DriveErrors::Mean::rms() const { return samples > 0 ? std::sqrt(sum2 / static_cast<double>(samples)) : 0; }

DriveErrors::DriveErrors(const Scenario& scenario, const SimulationOptions& options, const WheeledRobot& robot)
    : robot_(robot),
      no_slip_(robot, robot.state_of(scenario.initial)),
      track_(robot.law),
      no_slip_track_(robot.law),
      duration_(options.duration),
      step_(options.step),
      loads_known_(options.stepping != Stepping::accuracy) {
  for (const Shape& shape : scenario.shapes) body_of_shape_.push_back(shape.body);
}

void DriveErrors::observe_event(const EventRecord& event) {
  for (std::size_t c = 0; c < event.contacts.size(); ++c) {
    const int a = body_of_shape_[event.contacts[c].shape_a], b = body_of_shape_[event.contacts[c].shape_b];
    if (a == robot_.left_wheel || b == robot_.left_wheel) load_[0] += event.solution.impulse[3 * c];
    if (a == robot_.right_wheel || b == robot_.right_wheel) load_[1] += event.solution.impulse[3 * c];
  }
}

void DriveErrors::observe_step(const State& state, const StepRecord& /*record*/) {
  t_ = state.t;
  const WheeledRobot::State now = robot_.state_of(state);
  const WheeledRobot::State& exact = no_slip_.at(t_);
  const double cross = track_.distance(t_, now.x, now.z), exact_cross = no_slip_track_.distance(t_, exact.x, exact.z);
  if (t_ >= started) {
    cross_.add(cross);
    no_slip_cross_.add(exact_cross);
  }
  last_distance_ = std::hypot(now.x - exact.x, now.z - exact.z);
  from_no_slip_.add(last_distance_);

  const Vec3 forward(-std::sin(now.heading), 0, -std::cos(now.heading)), aside(forward.z(), 0, -forward.x());
  for (int side = 0; side < 2; ++side) {
    const int wheel = side == 0 ? robot_.left_wheel : robot_.right_wheel;
    const Pose& pose = state.pose[wheel];
    const double* v = &state.v[6 * static_cast<std::size_t>(wheel)];
    const Vec3 hub = pose * (side == 0 ? robot_.left_hub : robot_.right_hub);
    const Vec3 lowest = hub - robot_.radius * Vec3(0, 1, 0);
    const Vec3 slip = Vec3(v) + Vec3(v + 3).cross(lowest - pose.p);
    along_[side].add(forward.dot(slip));
    across_[side].add(aside.dot(slip));
  }

  ++steps_;
  const double both = load_[0] + load_[1];
  if (both > 0) {
    const double asymmetry = std::abs(load_[0] - load_[1]) / both;
    asymmetry_sum_ += asymmetry;
    asymmetry_largest_ = std::max(asymmetry_largest_, asymmetry);
    ++loaded_steps_;
  }
  for (int side = 0; side < 2; ++side) {
    if (!(load_[side] > unloaded * both)) ++unloaded_[side];
    load_[side] = 0;
  }
}

void DriveErrors::report(Values& out) const {
  if (cross_.samples > 0) {
    out.emplace_back("cross_track_rms_m", cross_.rms());
    out.emplace_back("cross_track_linf_m", cross_.largest);
    out.emplace_back("no_slip_cross_track_rms_m", no_slip_cross_.rms());
    out.emplace_back("no_slip_cross_track_linf_m", no_slip_cross_.largest);
    out.emplace_back("cross_track_rms_difference_m", std::abs(cross_.rms() - no_slip_cross_.rms()));
  }
  if (t_ >= duration_ - step_ / 2) out.emplace_back("position_final_m", last_distance_);
  out.emplace_back("position_linf_m", from_no_slip_.largest);
  out.emplace_back("position_l2_m", from_no_slip_.rms());
  const char* sides[] = {"left", "right"};
  for (int side = 0; side < 2; ++side) {
    const std::string slip = std::string("slip_") + sides[side];
    out.emplace_back(slip + "_along_rms_m_per_s", along_[side].rms());
    out.emplace_back(slip + "_along_linf_m_per_s", along_[side].largest);
    out.emplace_back(slip + "_across_rms_m_per_s", across_[side].rms());
    out.emplace_back(slip + "_across_linf_m_per_s", across_[side].largest);
  }
  if (!loads_known_) return;
  if (loaded_steps_ > 0) {
    out.emplace_back("load_asymmetry_mean_relative", asymmetry_sum_ / static_cast<double>(loaded_steps_));
    out.emplace_back("load_asymmetry_linf_relative", asymmetry_largest_);
  }
  for (int side = 0; side < 2; ++side)
    out.emplace_back(std::string("unloaded_") + sides[side] + "_relative",
                     static_cast<double>(unloaded_[side]) / static_cast<double>(steps_));
}

std::optional<GraspErrors> GraspErrors::of(const Scenario& scenario, const SimulationOptions& options) {
  GraspErrors out;
  int fingers = 0;
  for (const ControllerSpec& spec : scenario.controllers) {
    if (spec.row->name != "computed_torque") continue;
    const Tree& tree = scenario.model.trees[spec.tree];
    for (const ControllerSpec::ControlledJoint& part : spec.joints) {
      const Joint& joint = tree.joints[part.joint];
      if (spec.row->roles[part.role].name == "close") {
        if (fingers == 2) return std::nullopt;
        out.finger_[fingers++] = joint.body;
        continue;
      }
      const auto gain = [&](std::string_view name) {
        const auto& rows = spec.row->roles[part.role].gains;
        const auto at = std::find_if(rows.begin(), rows.end(), [&](const GainRow& row) { return row.name == name; });
        return at == rows.end() ? 0.0 : part.gains[static_cast<std::size_t>(at - rows.begin())];
      };
      if (gain("amplitude") != 0 && out.tracked_.size() < 2)
        out.tracked_.push_back({gain("offset"), gain("amplitude"), gain("frequency"), gain("phase"), joint.q});
    }
  }
  for (std::size_t b = 0; b < scenario.model.bodies.size(); ++b) {
    if (scenario.model.bodies[b].tree >= 0) continue;
    if (out.object_ >= 0) return std::nullopt;
    out.object_ = static_cast<int>(b);
  }
  if (fingers != 2 || out.object_ < 0) return std::nullopt;
  for (const Shape& shape : scenario.shapes)
    if (shape.body == out.object_) out.size_ = std::max(out.size_, shape.size());
  out.duration_ = options.duration;
  out.step_ = options.step;
  out.halfway_ = Halfway(options);
  for (int i = 0; i < 2; ++i) out.start_[i] = out.now_[i] = out.in_finger(scenario.initial, i);
  return out;
}

GraspErrors::InFinger GraspErrors::in_finger(const State& state, int finger) const {
  const Pose &f = state.pose[finger_[finger]], &o = state.pose[object_];
  return {f.q.conjugate() * (o.p - f.p), f.q.conjugate() * o.q};
}

void GraspErrors::observe_step(const State& state, const StepRecord& /*record*/) {
  t_ = state.t;
  ++steps_;
  double sum2 = 0, least = size_;
  const std::optional<double> share = halfway_.reached(t_);
  for (int i = 0; i < 2; ++i) {
    const Vec3 before = now_[i].p;
    now_[i] = in_finger(state, i);
    const double moved = (now_[i].p - start_[i].p).norm();
    sum2 += moved * moved;
    least = std::min(least, moved);
    rotation_ = std::max(rotation_, turned(start_[i].q, now_[i].q));
    if (share) half_[i] = Vec3(now_[i].p - (1 - *share) * (now_[i].p - before));
  }
  creep_ = std::sqrt(sum2);
  creep_largest_ = std::max(creep_largest_, creep_);
  if (!dropped_ && least > drop_fraction * size_) dropped_ = t_;
  for (Tracked& joint : tracked_) {
    const double wanted = joint.offset + joint.amplitude * std::sin(joint.frequency * t_ + joint.phase);
    const double error = state.q[joint.q] - wanted;
    joint.sum2 += error * error;
    joint.largest = std::max(joint.largest, std::abs(error));
  }
}

void GraspErrors::report(Values& out) const {
  const bool ended = t_ >= duration_ - step_ / 2;
  if (ended) out.emplace_back("creep_final_m", creep_);
  out.emplace_back("creep_linf_m", creep_largest_);
  if (ended && half_[0] && half_[1])
    out.emplace_back("creep_rate_m_per_s",
                     std::hypot((now_[0].p - *half_[0]).norm(), (now_[1].p - *half_[1]).norm()) / (duration_ / 2));
  out.emplace_back("rotation_linf_rad", rotation_);
  if (dropped_) out.emplace_back("dropped_s", *dropped_);
  const char* names[] = {"shoulder1", "shoulder2"};
  for (std::size_t i = 0; i < tracked_.size(); ++i) {
    const std::string name = std::string("tracking_") + names[i];
    out.emplace_back(name + "_rms_rad", std::sqrt(tracked_[i].sum2 / static_cast<double>(std::max(1L, steps_))));
    out.emplace_back(name + "_linf_rad", tracked_[i].largest);
  }
}

ReferenceRow mobile_robot_row() {
  return {
      "mobile_robot",
      "a robot on two wheels that never slip, with the same mass, motors and law: rolling in the plane, integrated by "
      "Runge and Kutta's method to 1e-12 m",
      {{"cross_track_rms_m", "m; distance from the figure eight, root mean square from 5 s on"},
       {"cross_track_linf_m", "m; the same, largest"},
       {"no_slip_cross_track_rms_m", "m; cross_track_rms_m of the robot that never slips"},
       {"no_slip_cross_track_linf_m", "m; cross_track_linf_m of the robot that never slips"},
       {"cross_track_rms_difference_m", "m; |cross_track_rms_m - no_slip_cross_track_rms_m|"},
       {"position_final_m", "m; distance of the axle's middle from that of the robot that never slips, at the end"},
       {"position_linf_m", "m; the same, largest over time"},
       {"position_l2_m", "m; the same, root mean square over time"},
       {"slip_left_along_rms_m_per_s",
        "m/s; speed of the left wheel's lowest point along the heading, root mean "
        "square over time, loaded or not"},
       {"slip_left_along_linf_m_per_s", "m/s; the same, largest"},
       {"slip_left_across_rms_m_per_s", "m/s; level, across the heading, root mean square"},
       {"slip_left_across_linf_m_per_s", "m/s; the same, largest"},
       {"slip_right_along_rms_m_per_s", "m/s; the right wheel's"},
       {"slip_right_along_linf_m_per_s", "m/s; the right wheel's"},
       {"slip_right_across_rms_m_per_s", "m/s; the right wheel's"},
       {"slip_right_across_linf_m_per_s", "m/s; the right wheel's"},
       {"load_asymmetry_mean_relative",
        "-; |N_L - N_R| / (N_L + N_R) of the wheels' normal impulses of a step, mean over "
        "the steps with a load"},
       {"load_asymmetry_linf_relative", "-; the same, largest"},
       {"unloaded_left_relative",
        "-; share of steps in which the left wheel has less than 1e-6 of the load, or "
        "neither has any"},
       {"unloaded_right_relative", "-; the same of the right wheel"}},
      [](const Scenario& scenario, const SimulationOptions& options, int) -> std::unique_ptr<Measure> {
        const auto robot = wheeled_robot(scenario);
        return robot ? std::make_unique<DriveErrors>(scenario, options, *robot) : nullptr;
      }};
}

ReferenceRow grasp_row() {
  return {"grasp",
          "what two fingers hold does not move in their frames; joints are where their wanted sinusoids are",
          {{"creep_final_m",
            "m; root sum of squares of the held body's displacement in both fingers' frames, at the "
            "end"},
           {"creep_linf_m", "m; the same, largest over time"},
           {"creep_rate_m_per_s", "m/s; the same from T/2 to T, over T/2"},
           {"rotation_linf_rad", "rad; largest angle turned in a finger's frame"},
           {"dropped_s",
            "s; first time at which the body is more than half its size from its start in both fingers' "
            "frames"},
           {"tracking_shoulder1_rms_rad", "rad; first joint on a sinusoid against it, root mean square over time"},
           {"tracking_shoulder1_linf_rad", "rad; the same, largest"},
           {"tracking_shoulder2_rms_rad", "rad; second joint on a sinusoid"},
           {"tracking_shoulder2_linf_rad", "rad; the same, largest"}},
          [](const Scenario& scenario, const SimulationOptions& options, int) -> std::unique_ptr<Measure> {
            auto grasp = GraspErrors::of(scenario, options);
            return grasp ? std::make_unique<GraspErrors>(std::move(*grasp)) : nullptr;
          }};
}

}  // namespace cb
