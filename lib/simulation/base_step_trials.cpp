// What stepping to an accuracy needs of the base step besides its verbs: checkpoints, and how what touches moves.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dynamics/kinematics.h"
#include "simulation/base_step.h"

namespace cb {

namespace {

constexpr double noise = 1e-9;       // -: of the sizes of the terms of a velocity; what solvers leave is below it
constexpr double same_point = 1e-3;  // -: of the smaller shape's size

}  // namespace

void BaseStep::restore(const Checkpoint& from) {
  energy_input_ = from.energy_input;
  spinning_ = from.spinning;
  set_state(from.state);
}

void BaseStep::set_state(const State& state) {
  state_ = state;
  contacts_known_ = false;
  pairs_ = nullptr;
  for (Lent& lent : lent_) lent = {};
  bounces_.clear();
}

void BaseStep::choose_forces_at(double t) {
  for (std::size_t i = 0; i < force_on_.size(); ++i)
    force_on_[i] = scenario_.forces[i].from <= t && t < scenario_.forces[i].to ? 1 : 0;
}

void BaseStep::set_trial(bool trial) {
  trial_ = trial;
  if (!trial) return;
  before_trial_ = record_;
  reason_before_trial_ = reason_;
}

// What answers were worth goes with the try; what they cost stays, and false claims do.
void BaseStep::forgive() {
  const StepRecord& before = before_trial_;
  record_.claimed_residual = before.claimed_residual;
  record_.residual = before.residual;
  record_.law_residual = before.law_residual;
  record_.gap = before.gap;
  record_.infeasibility = before.infeasibility;
  record_.event_energy_gain_relative = before.event_energy_gain_relative;
  record_.penetration_displacement = before.penetration_displacement;
  record_.bounces_left_out = before.bounces_left_out;
  record_.bounce_speed = before.bounce_speed;
  record_.bounce_distance = before.bounce_distance;
  record_.status = before.status;
  record_.unsolved = before.unsolved;
  reason_ = reason_before_trial_;
  if (on_forgive) on_forgive();
}

// partings_: e times what each contact approaches with. Beside an impact what rests keeps its restitution, too: it
// passes the shock on.
void BaseStep::leave_out_restitution() {
  double fastest = 0;
  for (const double speed : partings_) fastest = std::max(fastest, speed);
  if (fastest > rest_speed_) return;
  for (std::size_t c = 0; c < partings_.size(); ++c) {
    const double speed = partings_[c];
    restitution_[c] = 0;
    if (trial_ || !(speed > 0)) continue;
    ++record_.bounces_left_out;
    record_.bounce_speed = std::max(record_.bounce_speed, speed);
    record_.bounce_distance = std::max(record_.bounce_distance, speed * step_);
  }
}

BaseStep::Relative BaseStep::relative_velocity(const ContactPoint& contact) const {
  Relative out{Vec3::Zero(), 0};
  for (const auto& [shape, sign] : {std::pair(contact.shape_a, 1.0), std::pair(contact.shape_b, -1.0)}) {
    const int body = scenario_.shapes[shape].body;
    if (body < 0) continue;
    const Vec3 v(&state_.v[6 * static_cast<std::size_t>(body)]), w(&state_.v[6 * static_cast<std::size_t>(body) + 3]);
    const Vec3 turning = w.cross(contact.position - state_.pose[body].p);
    out.u += sign * (v + turning);
    out.terms += v.norm() + turning.norm();
  }
  return out;
}

double BaseStep::approach_speed() {
  if (!scenario_.model.trees.empty()) drive();  // what comes from another rate strikes
  double fastest = 0;
  for (const ContactPoint& contact : contacts_)
    fastest = std::max(fastest, -contact.normal.dot(relative_velocity(contact).u));
  if (scenario_.model.trees.empty()) return fastest;
  approaches_.clear();
  find_limits();
  for (const LimitContact& limit : limits_) {
    const Joint& joint = scenario_.model.trees[limit.tree].joints[limit.joint];
    fastest = std::max(fastest, -limit.sign * (state_.qd[joint.v] - joint.limit_rate));
  }
  return fastest;
}

// m/s: below it a velocity is none.
double BaseStep::still(const Relative& relative) const { return noise * (gravity_speed_ + relative.terms); }

bool BaseStep::parts(const ContactPoint& contact) const {
  const Relative relative = relative_velocity(contact);
  return contact.normal.dot(relative.u) > still(relative);
}

void BaseStep::read_held(std::vector<ContactPoint>& held) const {
  const auto released = [&](const ContactPoint& contact) {
    return std::ranges::any_of(released_, [&](const ContactPoint& r) {
      const double size = std::min(scenario_.shapes[r.shape_a].size(), scenario_.shapes[r.shape_b].size());
      return std::minmax(r.shape_a, r.shape_b) == std::minmax(contact.shape_a, contact.shape_b) &&
             (r.position - contact.position).norm() <= same_point * size;
    });
  };
  held.clear();
  for (const ContactPoint& contact : contacts_)
    if (!parts(contact) && !released(contact)) held.push_back(contact);
}

void BaseStep::read_modes(std::vector<Mode>& modes) const {
  constexpr double on_edge = 1e-12;  // rad: solvers that pivot put a slip on an edge to rounding
  const double pi = std::numbers::pi;
  const int edges = law_.polygon_edges ? law_.polygon_edges(solution_) : 0;
  modes.clear();
  for (const ContactPoint& contact : contacts_) {
    const Relative relative = relative_velocity(contact);
    const double none = still(relative), u_n = contact.normal.dot(relative.u);
    if (u_n > none) continue;
    if (scenario_.pairs.find(contact.shape_a, contact.shape_b)->mu == 0) {  // nothing depends on its slip
      modes.push_back({contact.shape_a, contact.shape_b, 0, Vec3::Zero()});
      continue;
    }
    const Vec3 slip = relative.u - u_n * contact.normal;
    int facet = slip.norm() <= none ? -1 : 0;
    if (facet == 0 && edges > 0) {
      // Friction is a corner of the polygon while the slip's direction is between the normals of two edges.
      Vec3 t1, t2;
      contact_tangents(contact, scenario_.rotate_cone, t1, t2);
      const double sector = std::atan2(slip.dot(t2), slip.dot(t1)) * edges / (2 * pi);
      const double from_edge = (0.5 - std::abs(sector - std::round(sector))) * 2 * pi / edges;
      const int corner = static_cast<int>(std::lround(sector) + edges) % edges;
      const int edge = static_cast<int>(std::floor(sector) + edges) % edges;
      facet = from_edge <= on_edge ? 2 * edge + 1 : 2 * corner;
    }
    modes.push_back({contact.shape_a, contact.shape_b, facet, slip});
  }
  if (scenario_.model.trees.empty()) return;
  for (const LimitContact& limit : limits_) {
    const Joint& joint = scenario_.model.trees[limit.tree].joints[limit.joint];
    const double rate = state_.qd[joint.v], speed = limit_speed(joint);
    if (limit.sign * (rate - joint.limit_rate) <= noise * speed)
      modes.push_back({-1 - limit.tree, limit.joint, limit.sign > 0 ? 1 : 2, Vec3::Zero()});
  }
  for (const Tree& tree : scenario_.model.trees)
    for (const Joint& joint : tree.joints)
      if (joint.nv() == 1 && std::abs(torque_[joint.v]) >= joint.torque_limit)
        modes.push_back({-1000000 - joint.v, 0, torque_[joint.v] > 0 ? 1 : 2, Vec3::Zero()});
}

void BaseStep::close_gaps(const std::vector<ContactPoint>& touching, const State& before, double reach) {
  if (touching.empty()) return;
  motions_before_.resize(motions_.size());
  for (std::size_t i = 0; i < motions_.size(); ++i) shape_motion(scenario_.shapes[i], before, motions_before_[i]);
  update_motions();
  find_pairs(0, margin_ + reach);
  drift_.close(scenario_, motions_before_, motions_, touching, tolerance_, options_.closed_gap, *pairs_, driven_, reach,
               state_);
  contacts_known_ = false;
}

}  // namespace cb
