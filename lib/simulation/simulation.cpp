// One step of size h from t = n h (spec: methods.md, "The step"):
//   1. velocities from the forces at the start, explicit Euler
//   2. contacts at the present configuration; if any approaches, one event with all of them
//   3. positions with the new velocity up to the first time of contact of a feature that was open, or the step's end
//   4. at a time of contact: 2 again
// Differences from the paper: times of contact are sought feature by feature, so that a box on one edge finds the
// other.

#include "simulation/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "dynamics/free_bodies.h"

namespace cb {

namespace {

using Clock = std::chrono::steady_clock;

/// Adds the time from one call to the next to the parts of a step in turn.
class Lap {
 public:
  void add_to(double& part) {
    const auto now = Clock::now();
    part += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  Clock::time_point last_ = Clock::now();
};

/// First step that starts at or after time t.
long step_at(double t, double h) { return std::lround(std::ceil(t / h - 1e-9)); }

}  // namespace

Simulation::Simulation(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, Law law)
    : scenario_(scenario), options_(options), method_(std::move(method)), law_(law), state_(scenario.initial) {
  steps_total_ = step_at(options_.duration, options_.step);
  state_.t = 0;
  double smallest = HUGE_VAL;
  for (const Shape& shape : scenario_.shapes) {
    tolerance_.push_back(options_.closed_gap * shape.size());
    radius_.push_back(shape.body >= 0 ? shape.bounding_radius() + shape.local.p.norm() : 0);
    smallest = std::min(smallest, shape.size());
  }
  margin_ = std::isfinite(smallest) ? 1e-6 * smallest : 1e-6;
  motions_.resize(scenario_.shapes.size());
  external_.resize(scenario_.model.bodies.size());
  energy_input_ = kinetic_energy(scenario_.model, state_);
  update_motions();
}

const StepRecord& Simulation::step() {
  const auto start = Clock::now();
  Lap lap;
  record_ = StepRecord{};
  record_.step = step_index_ + 1;

  apply_forces();
  lap.add_to(record_.times.dynamics_s);

  double remaining = options_.step;
  bool moved_on = false;  // has a time of contact split this step?
  while (record_.status == Status::ok || record_.status == Status::inaccurate) {
    update_motions();
    if (!moved_on) find_pairs(remaining);
    const bool event = find_contacts();
    lap.add_to(record_.times.collision_s);
    if (event) {
      if (++record_.events > options_.event_cap) {
        fail(Status::event_stall, fmt::format("more than {} events in one step", options_.event_cap));
        break;
      }
      if (!solve_event()) break;
      lap = Lap();
      update_motions();
      // Velocities changed: the pairs found before may no longer be all, unless hardly anything moves.
      if (displacement_bound(remaining) > 0.5 * margin_) find_pairs(remaining);
    }
    const double dt = first_contact(remaining);
    lap.add_to(record_.times.collision_s);
    advance_positions(dt);
    remaining -= dt;
    lap.add_to(record_.times.dynamics_s);
    if (remaining <= 0) break;
    moved_on = true;
  }

  ++step_index_;
  state_.t = static_cast<double>(step_index_) * options_.step;
  record_.t = state_.t;
  record_.kinetic_energy = kinetic_energy(scenario_.model, state_);
  record_.potential_energy = potential_energy(scenario_.model, state_, scenario_.gravity.at(state_.t));
  if (!std::isfinite(record_.kinetic_energy))
    fail(Status::not_finite, "a velocity is not a finite number");
  else if (record_.kinetic_energy > options_.blowup_factor * energy_input_)
    fail(Status::energy_blowup,
         fmt::format("kinetic energy {:.3g} J, of which {:.3g} J were put in", record_.kinetic_energy, energy_input_));
  record_.times.step_s = std::chrono::duration<double>(Clock::now() - start).count();
  return record_;
}

void Simulation::fail(Status status, std::string reason) {
  if (record_.status != Status::ok && record_.status != Status::inaccurate) return;
  record_.status = status;
  reason_ = std::move(reason);
}

// Velocities from the forces at the start of the step.
void Simulation::apply_forces() {
  const double h = options_.step;
  const Vec3 g = scenario_.gravity.at(state_.t);
  gravity_speed_ = g.norm() * h;
  for (std::size_t b = 0; b < external_.size(); ++b) external_[b] = scenario_.model.bodies[b].mass * g;
  for (const Force& force : scenario_.forces)
    if (step_index_ >= step_at(force.from, h) && step_index_ < step_at(force.to, h))
      external_[force.body] += force.force;
  energy_input_ += accelerate(scenario_.model, external_, h, state_);
}

void Simulation::update_motions() {
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const Shape& shape = scenario_.shapes[i];
    Motion& motion = motions_[i];
    if (shape.body < 0) {
      motion.pose = shape.local;
      continue;
    }
    const Pose& pose = state_.pose[shape.body];
    const double* v = &state_.v[6 * shape.body];
    motion.v = Vec3(v[0], v[1], v[2]);
    motion.w = Vec3(v[3], v[4], v[5]);
    motion.pose = pose;
    if (!shape.local.p.isZero(0)) {
      const Vec3 arm = pose.q * shape.local.p;
      motion.pose.p += arm;
      motion.v += motion.w.cross(arm);
    }
    if (shape.local.q.w() != 1) motion.pose.q = pose.q * shape.local.q;
  }
}

double Simulation::displacement_bound(double horizon) const {
  double bound = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i)
    if (scenario_.shapes[i].body >= 0)
      bound = std::max(bound, motions_[i].v.norm() + motions_[i].w.norm() * radius_[i]);
  return bound * horizon;
}

void Simulation::find_pairs(double horizon) {
  pairs_ = &broad_phase_.pairs(scenario_.shapes, motions_, margin_, horizon,
                               [&](int i, int j) { return scenario_.pairs.find(i, j) != nullptr; });
}

// All closed features at the present configuration. Returns whether any of them approaches.
bool Simulation::find_contacts() {
  contacts_.clear();
  mu_.clear();
  restitution_.clear();
  bool approaching = false;
  for (const auto& [i, j] : *pairs_) {
    const std::size_t first = contacts_.size();
    const double tolerance = std::min(tolerance_[i], tolerance_[j]);
    contact_points(scenario_.shapes[i], motions_[i].pose, i, scenario_.shapes[j], motions_[j].pose, j, tolerance,
                   contacts_);
    if (contacts_.size() == first) continue;
    const PairLaw& law = *scenario_.pairs.find(i, j);
    mu_.resize(contacts_.size(), law.mu);
    restitution_.resize(contacts_.size(), law.restitution);
    for (std::size_t c = first; c < contacts_.size(); ++c) {
      const ContactPoint& contact = contacts_[c];
      const auto velocity = [&](int shape) -> Vec3 {
        const Motion& motion = motions_[shape];
        return motion.v + motion.w.cross(contact.position - motion.pose.p);
      };
      const Vec3 v_a = velocity(contact.shape_a), v_b = velocity(contact.shape_b);
      const double speed = v_a.norm() + v_b.norm() + gravity_speed_;
      if (contact.normal.dot(v_a - v_b) < -options_.approach * speed) approaching = true;
      record_.max_penetration = std::max(record_.max_penetration, -contact.gap);
      if (-contact.gap * options_.closed_gap > options_.penetration_limit * tolerance)
        fail(Status::penetration,
             fmt::format("{} and {} interpenetrate by {:.3g} m at t = {:.9g} s", scenario_.shapes[i].name,
                         scenario_.shapes[j].name, -contact.gap, state_.t));
    }
  }
  return approaching && (record_.status == Status::ok || record_.status == Status::inaccurate);
}

// Hands all closed contacts to the method, has the answer checked, and takes over the checked velocity.
bool Simulation::solve_event() {
  Lap lap;
  assembler_.assemble(scenario_.model, state_, scenario_.shapes, contacts_, mu_, restitution_, scenario_.rotate_cone,
                      problem_, body_of_block_);
  lap.add_to(record_.times.assembly_s);
  solution_.clear();
  method_(problem_, solution_);
  lap.add_to(record_.times.solve_s);
  residuals_ = referee_.check(problem_, solution_, law_, v_plus_);

  record_.contacts += problem_.nc();
  record_.size += solution_.size;
  record_.iterations += solution_.iterations;
  ++record_.solves;
  const auto worst = [](std::optional<double>& a, const std::optional<double>& b) {
    if (b && (!a || std::abs(*b) > std::abs(*a))) a = b;
  };
  record_.claimed_residual = std::max(record_.claimed_residual, solution_.claimed_residual);
  record_.residual = std::max(record_.residual, residuals_.model);
  worst(record_.law_residual, residuals_.law);
  worst(record_.gap, residuals_.gap);
  worst(record_.infeasibility, residuals_.infeasibility);

  const bool holds = Referee::holds(residuals_, solution_, law_, options_.accepted_residual);
  if (solution_.status == Status::ok && !holds) ++record_.false_claims;
  if (!residuals_.finite) {
    fail(Status::not_finite, solution_.reason.empty() ? "the method's impulses are not finite" : solution_.reason);
    return false;
  }
  if (solution_.status != Status::ok && solution_.status != Status::inaccurate) {
    fail(solution_.status, solution_.reason);
    return false;
  }
  if (!holds) {
    record_.status = Status::inaccurate;
    reason_ = fmt::format("checked residual {:.3g} at t = {:.9g} s", residuals_.model, state_.t);
  }
  record_.event_energy_gain += residuals_.energy_gain;
  if (residuals_.energy_before > 0)
    record_.event_energy_gain_relative =
        std::max(record_.event_energy_gain_relative, residuals_.energy_gain / residuals_.energy_before);

  for (std::size_t b = 0; b < body_of_block_.size(); ++b)
    std::copy_n(v_plus_.begin() + 6 * static_cast<long>(b), 6, state_.v.begin() + 6 * body_of_block_[b]);
  if (on_event) on_event(EventRecord{state_.t, problem_, solution_, residuals_, v_plus_, contacts_});
  return true;
}

// The first time of contact of an open feature within `horizon`, or `horizon`.
double Simulation::first_contact(double horizon) const {
  double first = horizon;
  for (const auto& [i, j] : *pairs_)
    first = std::min(first, time_of_contact(scenario_.shapes[i], motions_[i], scenario_.shapes[j], motions_[j],
                                            std::min(tolerance_[i], tolerance_[j]), first));
  return first;
}

void Simulation::advance_positions(double dt) {
  for (std::size_t b = 0; b < state_.pose.size(); ++b) {
    const double* v = &state_.v[6 * b];
    state_.pose[b] = advance(Motion{state_.pose[b], Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5])}, dt);
  }
  state_.t += dt;
}

}  // namespace cb
