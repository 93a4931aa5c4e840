// What a step is made of (docs/architecture.md, "The path of a step"): forces, contacts, events, times of contact,
// moves. Robots: their links take part in collision as free bodies do; velocities come from the articulated-body
// algorithm under the controllers' torques, positions from the joints' coordinates. A joint at its limit is a contact
// of the event. Times of contact take a link's motion as steady from where it is; what its arc leaves behind, drift.h
// takes away. Differences from the paper: times of contact are sought feature by feature, so that a box on one edge
// finds the other.

#include "simulation/base_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "contact/feasibility.h"
#include "geometry/box_box.h"
#include "linalg/stop.h"
#include "simulation/displacement.h"
#include "simulation/explicit_step.h"

namespace cb {

BaseStep::BaseStep(const Scenario& scenario, const SimulationOptions& options, ContactMethod method, const Law& law)
    : scenario_(scenario), options_(options), method_(std::move(method)), law_(law), state_(scenario.initial) {
  state_.t = 0;
  random_.seed(options_.shuffle);
  // Shuffled contacts are no patches any more.
  if (options_.shuffle != 0) options_.prune.corners = Corners::differ;
  if (!scenario_.model.trees.empty() || options_.shuffle != 0 || options_.stepping == Stepping::accuracy)
    options_.prune.repeats = false;
  reach_.assign(scenario_.model.bodies.size(), 0.0);
  for (const Shape& shape : scenario_.shapes) {
    tolerance_.push_back(options_.closed_gap * shape.size());
    radius_.push_back(shape.body >= 0 ? shape.bounding_radius() + shape.local.p.norm() : 0);
    if (shape.body >= 0) reach_[shape.body] = std::max(reach_[shape.body], radius_.back());
    smallest_ = std::min(smallest_, shape.size());
  }
  // What is within a closed gap is among the pairs, also beside what is a thousand times smaller.
  margin_ = std::max(std::isfinite(smallest_) ? 1e-6 * smallest_ : 1e-6, 2 * largest_pair_tolerance());
  motions_.resize(scenario_.shapes.size());
  travel_.assign(scenario_.shapes.size(), 0.0);
  external_.resize(scenario_.model.bodies.size());
  for (const ControllerSpec& spec : scenario_.controllers)
    controllers_.push_back(spec.row->make(scenario_.model, spec));
  torque_.assign(state_.qd.size(), 0.0);
  joint_force_ = qdd_ = torque_;
  lent_.resize(scenario_.model.trees.size());
  implicit_ = options_.joint_forces == JointForces::implicit && !scenario_.model.trees.empty();
  damping_ = step_damping_ = implicit_damping(scenario_);
  if (implicit_) {
    implicit_joints_ = ImplicitJoints(passive_gains(scenario_), motor_gains(scenario_));
    std::fill(damping_.begin(), damping_.end(), 0.0);  // one of the gains
  }
  force_on_.assign(scenario_.forces.size(), 0);
  // What springs hold is there too.
  energy_input_ = kinetic_energy(scenario_.model, state_) + potential_energy(scenario_.model, state_, Vec3::Zero());
  update_motions();
}

// m: of two shapes one of which moves.
double BaseStep::largest_pair_tolerance() const {
  double moving = 0, other = 0;  // the largest of those that move, and of all others
  for (std::size_t i = 0; i < tolerance_.size(); ++i) {
    const double tolerance = tolerance_[i];
    if (scenario_.shapes[i].body >= 0 && tolerance > moving) {
      other = std::max(other, moving);
      moving = tolerance;
    } else {
      other = std::max(other, tolerance);
    }
  }
  return std::min(moving, other);
}

void BaseStep::begin(long step) {
  lap_.begin();
  record_ = StepRecord{};
  record_.step = step;
}

void BaseStep::look(double horizon) {
  if (as_before()) return;
  if (waited_) contacts_known_ = waited_ = false;  // an event may have taken its part of them
  if (contacts_known_) return;
  update_motions();
  find_pairs(horizon, margin_);
  find_contacts();
}

void BaseStep::look_ahead(double h) {
  if (as_before()) return;
  waited_ = false;
  struck_.clear();
  if (!scenario_.model.trees.empty()) {  // what is driven goes as far as its rate takes it, whatever it came with
    find_driven();
    drive();
  }
  update_motions();
  find_pairs_within(displacement_bound(h));
  ahead_ = h;
  find_contacts();
}

bool BaseStep::event(double bounced) {
  ++record_.events;
  if (bounced > 0) observe_bounces(bounced);
  if (repeats_) {
    solution_.iterations = 0;
    ++left_out_.repeats;
  } else {
    solve_event();
    // Solved again, with all points of the patches, or with the limits and points that it sends something to.
    while (corners_fall_short() || limits_fall_short() || points_fall_short()) {
      lap_.leave_out();
      const int told = record_.bounces_left_out;  // of the same contacts
      find_contacts();
      approaching();
      record_.bounces_left_out = told;
      solve_event();
    }
  }
  record_.unsolved = !take_answer();
  lap_.leave_out();  // the referee's check is no part of any of them
  if (!record_.unsolved) left_out_.coplanar_points += points_left_out_;
  return !record_.unsolved;
}

namespace {

constexpr double most_turned_in = 1e-3;  // -: of the smaller shape that touches, in a move

}  // namespace

// Bodies go on lines while links turn about others: to second order off by |w| |v| dt^2 / 2, w and v of the link. And
// what touches and whirls turns into what it touches.
double BaseStep::longest_move() const {
  constexpr double least = 1e-3;  // -: of a step, however fast they are
  const double fastest =
      std::max(bending_of_links() / (most_off_line * smallest_), bending_of_contacts() / most_turned_in);
  return fastest > 0 ? std::max(std::sqrt(2 / fastest), least * step_) : HUGE_VAL;
}

double BaseStep::bending_of_links() const {
  double bending = 0;
  if (scenario_.model.trees.empty()) return bending;
  for (const Body& body : scenario_.model.bodies) {
    if (body.tree < 0) continue;
    const double* v = &state_.v[6 * static_cast<std::size_t>(&body - scenario_.model.bodies.data())];
    bending = std::max(bending, Vec3(v).norm() * Vec3(v + 3).norm());
  }
  return bending;
}

// m: of links, after a move by dt from motions_.
double BaseStep::off_line(double dt) const {
  double furthest = 0;
  if (scenario_.pairs.laws.empty()) return furthest;  // nothing meets
  Motion now;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const Shape& shape = scenario_.shapes[i];
    if (shape.body < 0 || scenario_.model.bodies[shape.body].tree < 0) continue;
    shape_motion(shape, state_, now);
    const Pose line = advance(motions_[i], dt);
    const double sine = (line.q.conjugate() * now.pose.q).vec().norm();  // of half the turn
    furthest = std::max(furthest, (now.pose.p - line.p).norm() + 2 * sine * shape.bounding_radius());
  }
  return furthest;
}

// Of a shape's point, m/s.
Vec3 BaseStep::shape_velocity(int shape, const Vec3& position) const {
  const int body = scenario_.shapes[shape].body;
  return body < 0 ? Vec3(Vec3::Zero()) : velocity_at(state_, body, position);
}

// Of gaps of free bodies that touch, over the smaller one's size, but for what slow turning makes of them: as in
// drift.cpp. A ball turns in itself. A face turns about the middle of what is round that touches it, and into it by no
// more than its own points come down meanwhile.
double BaseStep::bending_of_contacts() const {
  constexpr double slow = 0.02;  // rad a step
  double bending = 0;
  for (const ContactPoint& contact : contacts_)
    for (const int shape : {contact.shape_a, contact.shape_b}) {
      const Shape& of = scenario_.shapes[shape];
      if (of.body < 0 || of.kind == ShapeKind::sphere || scenario_.model.bodies[of.body].tree >= 0) continue;
      const Vec3 w(&state_.v[6 * static_cast<std::size_t>(of.body) + 3]);
      const double spin = w.norm(), across2 = w.cross(contact.normal).squaredNorm();
      if (spin * step_ <= slow) continue;
      const double size = std::min(scenario_.shapes[contact.shape_a].size(), scenario_.shapes[contact.shape_b].size());
      const Vec3 slip =
          shape_velocity(contact.shape_a, contact.position) - shape_velocity(contact.shape_b, contact.position);
      const Shape& other = scenario_.shapes[shape == contact.shape_a ? contact.shape_b : contact.shape_a];
      const double reach = std::min(other.radius, 2 * radius_[shape] * radius_[shape] / (most_turned_in * size));
      bending = std::max(bending, (spin * (1.5 * spin * radius_[shape] + slip.norm()) + across2 * reach) / size);
    }
  return bending;
}

double BaseStep::until_contact(double horizon, bool again, bool solved) {
  update_motions();
  const double reach = displacement_bound(horizon);
  // The pairs found before are all that can meet while velocities stay as they were then, or hardly anything moves.
  const bool far = moved_ + reach > 0.5 * margin_;
  if (again ? solved && far : far || !keeps_pairs())
    find_pairs(horizon, margin_);
  else if (!again)
    ++left_out_.pair_searches;
  const double dt = first_contact(horizon, reach);
  moved_ += reach;
  return dt;
}

void BaseStep::settle() {
  bounces_.clear();  // the next step begins with what is found here
  if (ahead_ > 0) contacts_known_ = false;
  ahead_ = 0;
  // Links go on arcs, out of what was swept.
  if (!contacts_known_) update_motions();
  if (!contacts_known_ || !scenario_.model.trees.empty()) find_pairs(0, margin_);
  find_contacts();
  part();
  record_.max_penetration = depth_;
}

void BaseStep::part() {
  if (overlap_ratio_ > 1) remove_overlap();
}

void BaseStep::finish(double t) {
  state_.t = record_.t = t;
  record_.kinetic_energy = kinetic_energy(scenario_.model, state_);
  record_.potential_energy = potential_energy(scenario_.model, state_, gravity());
  if (!std::isfinite(record_.kinetic_energy))
    fail(Status::not_finite, "a velocity is not a finite number");
  else if (record_.kinetic_energy > options_.blowup_factor * energy_input_)
    fail(Status::energy_blowup,
         fmt::format("kinetic energy {:.3g} J, of which {:.3g} J were put in", record_.kinetic_energy, energy_input_));
  else if (record_.kinetic_energy > options_.blowup_energy)
    fail(Status::energy_blowup, fmt::format("kinetic energy {:.3g} J: a spring's or motor's explicit step is unstable",
                                            record_.kinetic_energy));
  lap_.add_to(record_.times.collision_s);  // the energies are too short to read the clock for
  record_.times.step_s = lap_.total();
}

// The pair of the first time of contact, dt after the one before. False where it has come too often: the cap, and as
// often as its bounces need to be over; elastic ones between bodies of finite mass end, but not soon.
bool BaseStep::arrive(double dt) {
  constexpr double most = 10;  // -: of the cap, what its bounces may add
  const auto [i, j] = arriving_;
  const int times = bounces_.arrive(arriving_);
  int cap = options_.event_cap;
  if (times <= cap) return true;
  const double bounces = i < 0 ? 0 : Bounces::until_over(scenario_.pairs.find(i, j)->restitution);
  cap += static_cast<int>(std::min(bounces, most * cap));
  if (times <= cap) return true;
  const std::string who = i < 0 ? fmt::format("joint {} and its limit", scenario_.model.trees[-1 - i].joints[j].name)
                                : fmt::format("{} and {}", scenario_.shapes[i].name, scenario_.shapes[j].name);
  fail(Status::event_stall,
       fmt::format("{} come together more than {} times in one step: at t = {:.9g} s, {:.3g} s after the time before",
                   who, cap, state_.t, dt));
  return false;
}

// Before an event within the step: is it an impact of the pair that arrived, and is restitution left out in it?
void BaseStep::observe_bounces(double remaining) {
  bool impact = false;
  for (std::size_t c = 0; c < contacts_.size(); ++c) {
    if (!approaches_[c]) continue;
    const ContactPoint& contact = contacts_[c];
    const Bounces::Pair pair = std::minmax(contact.shape_a, contact.shape_b);
    impact = impact || pair == bounces_.last();
    const double e = scenario_.pairs.find(pair.first, pair.second)->restitution;
    if (!bounces_.over(pair, e)) continue;
    ++record_.bounces_left_out;
    const Vec3 u = velocity_at(motions_[contact.shape_a], contact.position) -
                   velocity_at(motions_[contact.shape_b], contact.position);
    const double speed = e * std::abs(contact.normal.dot(u));
    record_.bounce_speed = std::max(record_.bounce_speed, speed);
    record_.bounce_distance = std::max(record_.bounce_distance, speed * remaining);
  }
  if (impact) bounces_.impact(state_.t);
}

void BaseStep::fail(Status status, std::string reason) {
  if (record_.status != Status::ok && record_.status != Status::inaccurate) return;
  record_.status = status;
  reason_ = std::move(reason);
}

// At the time of the state: asked for at the end of a step and at the beginning of the next.
const Vec3& BaseStep::gravity() {
  if (gravity_at_ != state_.t) gravity_ = scenario_.gravity.at(gravity_at_ = state_.t);
  return gravity_;
}

void BaseStep::choose_forces(long index, double h) {
  for (std::size_t i = 0; i < force_on_.size(); ++i)
    force_on_[i] = index >= step_at(scenario_.forces[i].from, h) && index < step_at(scenario_.forces[i].to, h) ? 1 : 0;
}

void BaseStep::kick(double h) {
  step_ = h;
  at_start_ = true;
  const Vec3 g = gravity();
  gravity_speed_ = g.norm() * h;
  for (std::size_t b = 0; b < external_.size(); ++b) external_[b] = scenario_.model.bodies[b].mass * g;
  for (std::size_t i = 0; i < force_on_.size(); ++i)
    if (force_on_[i]) external_[scenario_.forces[i].body] += scenario_.forces[i].force;
  energy_input_ += accelerate(scenario_.model, external_, h, state_, options_.gyroscopic);
  if (!scenario_.model.trees.empty()) {
    for (std::size_t i = 0; i < damping_.size(); ++i) step_damping_[i] = h * damping_[i];
    implicit_joints_.begin(h);
    accelerate_trees(g);
  }
  lap_.add_to(record_.times.dynamics_s);
}

// Motors, joint friction and forces on the links. Energy that may have come in: |power| h of each, and that of the
// change of velocity itself (as in free_bodies.h, the spin's rounded up).
void BaseStep::accelerate_trees(const Vec3& gravity) {
  const Model& model = scenario_.model;
  const double h = step_;
  std::fill(torque_.begin(), torque_.end(), 0.0);
  for (const Controller& controller : controllers_) controller(model, state_, gravity, torque_);
  joint_speed_ = 0;
  for (const Tree& tree : model.trees) {
    for (const Joint& joint : tree.joints) {
      if (joint.nv() != 1) continue;
      double& tau = torque_[joint.v];
      tau = std::clamp(tau, -joint.torque_limit, joint.torque_limit);
      if (std::abs(tau) >= joint.torque_limit) implicit_joints_.saturate(joint.v);
      joint_force_[joint.v] = tau + joint.passive_torque(state_.q[joint.q], state_.qd[joint.v]);
      energy_input_ += std::abs(tau * state_.qd[joint.v]) * h;
    }
    for (const Joint& joint : tree.joints)
      energy_input_ +=
          std::abs(external_[joint.body].dot(Vec3(&state_.v[6 * static_cast<std::size_t>(joint.body)]))) * h;
    twists_ = state_.v;
    kick(tree, lent_[&tree - model.trees.data()]);
    for (const Joint& joint : tree.joints) {
      const Body& body = model.bodies[joint.body];
      const auto b = 6 * static_cast<std::size_t>(joint.body);
      const Vec3 dv = Vec3(&state_.v[b]) - Vec3(&twists_[b]), dw = Vec3(&state_.v[b + 3]) - Vec3(&twists_[b + 3]);
      energy_input_ += 0.5 * body.mass * dv.squaredNorm() + 0.5 * body.inertia.maxCoeff() * dw.squaredNorm();
    }
  }
}

// Rates of a tree from the forces of a step, h M^-1 (tau - bias). Centrifugal, Coriolis and gyroscopic forces do no
// work: what they give the rates, the change of inertia takes back as the tree moves. It is lent until then.
void BaseStep::kick(const Tree& tree, Lent& lent) {
  const Model& model = scenario_.model;
  const auto at = static_cast<std::size_t>(tree.v), nv = static_cast<std::size_t>(tree.nv);
  const std::span<double> qd(&state_.qd[at], nv), qdd(&qdd_[at], nv);
  const std::span<const double> force(&joint_force_[at], nv), damping(&step_damping_[at], nv);
  before_.assign(qd.begin(), qd.end());
  const auto accelerate = [&](bool turning) {
    articulated_body_.accelerations(tree, state_, external_, force, qdd, turning);
    if (implicit_) implicit_joints_.accelerations(model, tree, state_, qdd);
  };
  const auto add = [&] {
    for (std::size_t i = 0; i < nv; ++i) qd[i] = before_[i] + step_ * qdd[i];
  };
  articulated_body_.factor(model, tree, state_, damping);
  accelerate(true);
  after_.assign(qdd.begin(), qdd.end());
  accelerate(false);
  add();
  link_twists(model, tree, state_);
  const double own = tree_energy(model, tree, state_);
  std::copy(after_.begin(), after_.end(), qdd.begin());
  add();
  link_twists(model, tree, state_);
  const double all = tree_energy(model, tree, state_);
  lent = {all - own, all > 0 ? own / all : 1};
  for (const double a : qdd) joint_speed_ = std::max(joint_speed_, step_ * std::abs(a));
}

// Moves everything by dt. A tree keeps its kinetic energy, but for what was lent to it; one that is driven its rates.
void BaseStep::move(double dt) {
  at_start_ = false;
  const std::vector<Tree>& trees = scenario_.model.trees;
  if (trees.empty() && !hold_contacts_) {  // too short to read the clock for: it counts as collision
    advance_positions(dt);
    return update_motions();
  }
  lap_.add_to(record_.times.collision_s);
  if (hold_contacts_) read_held(held_);
  kept_.clear();
  for (std::size_t t = 0; t < trees.size(); ++t) {
    const double has = tree_energy(scenario_.model, trees[t], state_);
    // An event may have stopped it: no more is given back than it had a share in, and no more taken than it has.
    kept_.push_back(std::max(0.0, std::min(has - lent_[t].energy, has * lent_[t].share)));
    lent_[t] = {};
  }
  advance_positions(dt);
  if (trial_) strayed_ = off_line(dt);
  lap_.add_to(record_.times.dynamics_s);
  if (ahead_ > 0)  // gaps that were open are no drift
    std::erase_if(contacts_, [&](const ContactPoint& contact) {
      return contact.gap > std::min(tolerance_[contact.shape_a], tolerance_[contact.shape_b]);
    });
  drift_.remove(scenario_, motions_, hold_contacts_ ? held_ : contacts_, tolerance_, options_.closed_gap, radius_,
                *pairs_, driven_, dt, state_);
  for (std::size_t t = 0; t < trees.size(); ++t)
    if (driven_[t] == 0) set_tree_energy(scenario_.model, trees[t], kept_[t], state_);
  update_motions();
}

void BaseStep::update_motions() {
  for (std::size_t i = 0; i < motions_.size(); ++i) shape_motion(scenario_.shapes[i], state_, motions_[i]);
}

// How far a point of a shape can get within the horizon, m.
double BaseStep::travel_within(std::size_t shape, double horizon) const {
  return (motions_[shape].v.norm() + motions_[shape].w.norm() * radius_[shape]) * horizon;
}

// Of each shape into travel_, and the largest.
double BaseStep::displacement_bound(double horizon) {
  double bound = 0;
  for (std::size_t i = 0; i < motions_.size(); ++i)
    if (scenario_.shapes[i].body >= 0) {
      travel_[i] = travel_within(i, horizon);
      bound = std::max(bound, travel_[i]);
    }
  return bound;
}

// May the pairs of an earlier step serve? Links are moved without a velocity too.
bool BaseStep::keeps_pairs() const {
  return options_.prune.pair_searches && scenario_.model.trees.empty() && pairs_ != nullptr;
}

void BaseStep::find_pairs(double horizon, double margin) {
  moved_ = 0;
  pairs_ = &broad_phase_.pairs(scenario_.shapes, motions_, margin, horizon,
                               [&](int i, int j) { return scenario_.can_touch(i, j); });
}

// By steps: those that can meet where no shape gets further than this (m), whichever way it goes. What is swept along
// the velocities before an event leaves out what it turns round, and along those after it what has just met.
void BaseStep::find_pairs_within(double travel) { find_pairs(0, margin_ + 2 * travel); }

// All closed features at the present configuration.
void BaseStep::find_contacts() {
  contacts_known_ = true;
  contacts_.clear();
  mu_.clear();
  restitution_.clear();
  patches_.clear();
  depth_ = overlap_ratio_ = 0;
  if (!scenario_.model.trees.empty()) find_driven();
  for (const auto& [i, j] : *pairs_) {
    poll_stop();
    const std::size_t first = contacts_.size();
    const double tolerance = std::min(tolerance_[i], tolerance_[j]);
    const PairLaw& law = *scenario_.pairs.find(i, j);
    const bool corners_only =
        options_.prune.corners != Corners::differ && !spinning_ && law.restitution == 0 && ahead_ == 0;
    const double reach = ahead_ > 0 ? tolerance + travel_[i] + travel_[j] : 0;
    const int left_out = contact_points(scenario_.shapes[i], motions_[i].pose, i, scenario_.shapes[j], motions_[j].pose,
                                        j, tolerance, contacts_, corners_only, reach);
    if (contacts_.size() == first) continue;
    double depth = 0;
    for (std::size_t c = first; c < contacts_.size(); ++c) depth = std::max(depth, -contacts_[c].gap);
    if (!moved_by_impulses(i) && !moved_by_impulses(j)) {
      contacts_.resize(first);
    } else {
      if (left_out > 0) patches_.emplace_back(static_cast<int>(first), left_out);
      mu_.resize(contacts_.size(), law.mu);
      const bool over = bounces_.any() && bounces_.over({i, j}, law.restitution);
      restitution_.resize(contacts_.size(), over ? 0 : law.restitution);
    }
    depth_ = std::max(depth_, depth);
    if (depth <= tolerance) continue;
    if (depth * options_.closed_gap > options_.penetration_limit * tolerance) fail_overlap(i, j, depth);
    const double closed = resolved_tolerance(tolerance, motions_[i].pose.p, motions_[j].pose.p);
    if (depth <= overlap_ratio_ * closed) continue;
    overlap_ratio_ = depth / closed;
    deepest_ = {i, j};
    deepest_depth_ = depth;
  }
  if (!trial_) record_.penetration_inside = std::max(record_.penetration_inside, depth_);
}

void BaseStep::fail_overlap(int i, int j, double depth) {
  fail(Status::penetration, fmt::format("{} and {} interpenetrate by {:.3g} m at t = {:.9g} s",
                                        scenario_.shapes[i].name, scenario_.shapes[j].name, depth, state_.t));
}

// Does the event that comes begin as the last one did? All has rested since, and forces are the same.
bool BaseStep::as_before() {
  repeats_ = waited_ && state_.v == before_event_;
  if (options_.prune.repeats && !repeats_) before_event_ = state_.v;
  return repeats_;
}

bool BaseStep::rests() const {
  return options_.prune.repeats && going_on() && overlap_ratio_ <= 1 &&
         std::all_of(state_.v.begin(), state_.v.end(), [](double v) { return v == 0; });
}

void BaseStep::wait() {
  waited_ = true;
  bounces_.clear();
  record_.penetration_inside = std::max(record_.penetration_inside, depth_);
  record_.max_penetration = depth_;
}

bool BaseStep::approaching() {
  const bool any = repeats_ || find_approaching();
  lap_.add_to(record_.times.collision_s);
  return any;
}

bool BaseStep::find_approaching() {
  approaches_.clear();
  partings_.clear();
  if (!scenario_.model.trees.empty()) drive();
  for (const ContactPoint& contact : contacts_) {
    double speed = gravity_speed_;  // before terms cancel: what rolls is at rest where it touches, to their rounding
    const auto velocity = [&](int shape) -> Vec3 {
      const int body = scenario_.shapes[shape].body;
      if (body < 0) return Vec3::Zero();
      const Vec3 v(&state_.v[6 * static_cast<std::size_t>(body)]), w(&state_.v[6 * static_cast<std::size_t>(body) + 3]);
      const Vec3 turning = w.cross(contact.position - state_.pose[body].p);
      speed += v.lpNorm<1>() + turning.lpNorm<1>();
      return v + turning;
    };
    const Vec3 v_a = velocity(contact.shape_a), v_b = velocity(contact.shape_b);
    const double u_n = contact.normal.dot(v_a - v_b);
    if (rest_speed_ > 0) partings_.push_back(restitution_[partings_.size()] * -u_n);
    approaches_.push_back(closing_speed(contact, u_n) < -options_.approach * speed ? 1 : 0);
  }
  if (rest_speed_ > 0) leave_out_restitution();
  if (!scenario_.model.trees.empty()) find_limits();
  if (std::find(approaches_.begin(), approaches_.end(), 1) == approaches_.end()) return false;
  select_islands();
  if (options_.shuffle != 0) shuffle_contacts();  // not together with patches (constructor)
  return going_on();
}

// Of a contact that is looked ahead at: how fast it closes beyond its gap, m/s. With restitution one that closes within
// the step counts as touching.
double BaseStep::closing_speed(const ContactPoint& contact, double u_n) const {
  if (ahead_ == 0 || contact.gap <= std::min(tolerance_[contact.shape_a], tolerance_[contact.shape_b])) return u_n;
  const double beyond = u_n + contact.gap / ahead_;
  return beyond < 0 && scenario_.pairs.find(contact.shape_a, contact.shape_b)->restitution > 0 ? u_n : beyond;
}

// w_n of the open contacts of the event.
void BaseStep::add_gaps() {
  contact_velocity(problem_, problem_.v_minus, u_plus_);
  const std::vector<ContactPoint>& contacts = event_contacts();
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    gap_speed_.push_back(closing_speed(contacts[c], u_plus_[3 * c]) - u_plus_[3 * c]);
    problem_.offset[3 * c] += gap_speed_[c];
  }
  const std::vector<LimitContact>& limits = event_limits();
  for (std::size_t l = 0; l < limits.size(); ++l)
    problem_.offset[3 * (contacts.size() + l)] += std::max(0.0, limits[l].gap) / ahead_;
}

// mu_, restitution_ and patches_ become the event's; contacts_ and limits_ stay what touches.
void BaseStep::select_islands() {
  islands_.find(scenario_.model, scenario_.shapes, contacts_, limits_, driven_, approaches_);
  if (!islands_.all()) {
    std::erase_if(patches_, [&](const auto& patch) { return !islands_.includes(patch.first); });
    event_contacts_.clear();
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      if (!islands_.includes(c)) continue;
      mu_[event_contacts_.size()] = mu_[c];
      restitution_[event_contacts_.size()] = restitution_[c];
      event_contacts_.push_back(contacts_[c]);
    }
    mu_.resize(event_contacts_.size());
    restitution_.resize(event_contacts_.size());
    event_limits_.clear();
    for (std::size_t l = 0; l < limits_.size(); ++l)
      if (islands_.includes(contacts_.size() + l)) event_limits_.push_back(limits_[l]);
  }
  points_left_out_ = 0;
  for (const auto& patch : patches_) points_left_out_ += patch.second;
}

// Ends the step without overlap, or the run where bodies are wedged in.
void BaseStep::remove_overlap() {
  const double displacement = overlap_.remove(
      scenario_, tolerance_, options_.closed_gap, radius_, depth_,
      [this](double margin) -> const std::vector<std::pair<int, int>>& {
        find_pairs(0, std::max(margin, margin_));
        return *pairs_;
      },
      motions_, state_);
  record_.penetration_displacement = std::max(record_.penetration_displacement, displacement);
  find_pairs(0, margin_);
  find_contacts();
  const auto [i, j] = deepest_;
  const double size = std::min(tolerance_[i], tolerance_[j]) / options_.closed_gap;
  if (overlap_ratio_ > 1 && deepest_depth_ > options_.penetration_bound * size) fail_overlap(i, j, deepest_depth_);
}

// Fisher and Yates, in a copy: steps to an accuracy compare what touches one by one (read_modes).
void BaseStep::shuffle_contacts() {
  if (islands_.all()) event_contacts_ = contacts_;
  for (std::size_t i = event_contacts_.size(); i > 1; --i) {
    const std::size_t j = random_() % i;
    std::swap(event_contacts_[i - 1], event_contacts_[j]);
    std::swap(mu_[i - 1], mu_[j]);
    std::swap(restitution_[i - 1], restitution_[j]);
  }
}

// Trees of which stops on both sides leave each joint one rate. No impulse changes how these move, so that they are no
// part of an event: bodies on one belt are joined by it as little as by the ground.
void BaseStep::find_driven() {
  const std::vector<Tree>& trees = scenario_.model.trees;
  driven_.assign(trees.size(), 0);
  for (std::size_t t = 0; t < trees.size(); ++t)
    driven_[t] = std::all_of(trees[t].joints.begin(), trees[t].joints.end(), [&](const Joint& joint) {
      if (joint.nv() == 0) return true;
      // Rounding, and what displacements may miss, take a joint off its stops in the end.
      return joint.q >= 0 && joint.upper - joint.lower <= 2 * options_.closed_gap;
    });
}

// Their joints have these rates, whatever that takes, which counts as energy put in.
void BaseStep::drive() {
  for (std::size_t t = 0; t < driven_.size(); ++t) {
    const Tree& tree = scenario_.model.trees[t];
    const auto has_rate = [&](const Joint& joint) { return joint.nv() == 0 || state_.qd[joint.v] == joint.limit_rate; };
    if (driven_[t] == 0 || std::all_of(tree.joints.begin(), tree.joints.end(), has_rate)) continue;
    const double before = tree_energy(scenario_.model, tree, state_);
    for (const Joint& joint : tree.joints)
      if (joint.nv() != 0) state_.qd[joint.v] = joint.limit_rate;
    link_twists(scenario_.model, tree, state_);
    energy_input_ += std::abs(tree_energy(scenario_.model, tree, state_) - before);
  }
}

bool BaseStep::moved_by_impulses(int shape) const {
  const int body = scenario_.shapes[shape].body;
  if (body < 0) return false;
  const int tree = scenario_.model.bodies[body].tree;
  return tree < 0 || driven_[tree] == 0;
}

namespace {

bool is_among(const std::vector<LimitContact>& limits, int tree, int joint, double sign) {
  return std::any_of(limits.begin(), limits.end(), [&](const LimitContact& limit) {
    return limit.tree == tree && limit.joint == joint && limit.sign == sign;
  });
}

}  // namespace

// By steps: does the answer take a joint beyond a limit that was none of the event's, since nothing has moved the joint
// as fast before? Then the limits found next have it.
bool BaseStep::limits_fall_short() {
  if (ahead_ == 0) return false;
  const std::size_t before = struck_.size();
  for (std::size_t b = 0; b < owners_.size(); ++b) {
    const int t = owners_[b].tree;
    if (t < 0) continue;
    const Tree& tree = scenario_.model.trees[t];
    for (int j = 0; j < static_cast<int>(tree.joints.size()); ++j) {
      const Joint& joint = tree.joints[j];
      if (joint.q < 0 || !joint.limited()) continue;
      const double rate = v_plus_[problem_.M.first[b] + joint.v - tree.v] - joint.limit_rate;
      for (const double sign : {1.0, -1.0}) {
        const double gap = joint.limit_gap(sign, state_.q[joint.q], state_.t);
        if (gap + ahead_ * sign * rate < -options_.closed_gap && !is_among(limits_, t, j, sign))
          struck_.push_back({t, j, sign, gap});
      }
    }
  }
  return struck_.size() > before;
}

// By steps: do impulses send what they strike further than it was looked ahead, through points of other shapes?
bool BaseStep::points_fall_short() {
  if (ahead_ == 0 || !Referee::holds(residuals_, options_.accepted_residual)) return false;
  before_impulses_ = {state_.v, state_.qd};
  set_velocities_after();
  update_motions();
  double furthest = 0;
  bool further = false;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (scenario_.shapes[i].body < 0) continue;
    const double travel = travel_within(i, ahead_);
    further = further || travel > travel_[i] + tolerance_[i];
    travel_[i] = std::max(travel_[i], travel);
    furthest = std::max(furthest, travel_[i]);
  }
  bool any = false;
  if (further) {
    find_pairs_within(furthest);
    any = std::any_of(pairs_->begin(), pairs_->end(),
                      [&](const auto& pair) { return goes_through(pair.first, pair.second); });
  }
  std::tie(state_.v, state_.qd) = before_impulses_;
  update_motions();
  return any;
}

// Does shape i pass a point of shape j that is not looked ahead at, or j one of i?
bool BaseStep::goes_through(int i, int j) {
  if (!moved_by_impulses(i) && !moved_by_impulses(j)) return false;
  const double tolerance = std::min(tolerance_[i], tolerance_[j]);
  passed_.clear();
  contact_points(scenario_.shapes[i], motions_[i].pose, i, scenario_.shapes[j], motions_[j].pose, j, tolerance, passed_,
                 false, tolerance + travel_[i] + travel_[j]);
  const auto through = [&](const ContactPoint& point) {
    return point.gap + ahead_ * point.normal.dot(relative_velocity(point).u) < -tolerance;
  };
  if (std::none_of(passed_.begin(), passed_.end(), through)) return false;
  const auto of_both = [&](const ContactPoint& point) {
    return std::minmax(point.shape_a, point.shape_b) == std::minmax(i, j);
  };
  return std::ssize(passed_) > std::count_if(contacts_.begin(), contacts_.end(), of_both);
}

// Joints at a limit, and which of them go on into it.
void BaseStep::find_limits() {
  limits_.clear();
  for (int t = 0; t < static_cast<int>(scenario_.model.trees.size()); ++t) {
    if (driven_[t] != 0) continue;
    const std::vector<Joint>& joints = scenario_.model.trees[t].joints;
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      const Joint& joint = joints[j];
      if (joint.q < 0 || !joint.limited()) continue;
      const double rate = state_.qd[joint.v], speed = limit_speed(joint);
      for (const double sign : {1.0, -1.0}) {
        const double gap = joint.limit_gap(sign, state_.q[joint.q], state_.t);
        // Looked ahead at: what the rate, or one as fast the other way, can close; and what impulses have.
        const double closes = ahead_ > 0 ? ahead_ * speed : 0;
        const bool struck = is_among(struck_, t, j, sign);
        if (gap > options_.closed_gap + closes && !struck) continue;
        limits_.push_back({t, j, sign, gap});
        const double beyond = ahead_ > 0 ? std::max(0.0, gap) / ahead_ : 0;
        approaches_.push_back(sign * (rate - joint.limit_rate) + beyond < -options_.approach * speed ? 1 : 0);
      }
    }
  }
}

// The first time within `horizon` at which a joint reaches a limit, or `horizon`. Coordinates are linear in time.
double BaseStep::first_limit(double horizon) {
  double first = horizon;
  for (int t = 0; t < static_cast<int>(scenario_.model.trees.size()); ++t) {
    const std::vector<Joint>& joints = scenario_.model.trees[t].joints;
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      const Joint& joint = joints[j];
      if (joint.q < 0 || !joint.limited()) continue;
      const double rate = state_.qd[joint.v] - joint.limit_rate;
      const double gap = joint.limit_gap(rate < 0 ? 1 : -1, state_.q[joint.q], state_.t);
      if (rate == 0 || gap <= options_.closed_gap) continue;
      const double time = (gap - options_.closed_gap / 2) / std::abs(rate);
      if (time >= first) continue;
      first = time;
      arriving_ = {-1 - t, j};
    }
  }
  return first;
}

// Hands the event's contacts to the method and has the answer checked.
void BaseStep::solve_event() {
  const std::vector<ContactPoint>& contacts = event_contacts();
  assembler_.assemble(scenario_.model, state_, scenario_.shapes, contacts, event_limits(), mu_, restitution_,
                      scenario_.rotate_cone, problem_, owners_, driven_,
                      implicit_ && at_start_ ? &implicit_joints_ : nullptr);
  gap_speed_.clear();
  if (ahead_ > 0) add_gaps();
  lap_.add_to(record_.times.assembly_s);
  solution_.clear();
  method_(problem_, solution_);
  lap_.add_to(record_.times.solve_s);
  residuals_ = referee_.check(problem_, solution_, law_, v_plus_);
}

// Takes over the checked velocity. Where the check holds the run goes on, whatever the method says of itself; where it
// does not, a typed failure ends the run.
bool BaseStep::take_answer() {
  record_answer();
  const bool holds = Referee::holds(residuals_, options_.accepted_residual);
  const bool gave_up = solution_.status != Status::ok && solution_.status != Status::inaccurate;
  if (!holds && solution_.status == Status::ok) ++record_.false_claims;
  if (holds && solution_.status != Status::ok) ++record_.doubted;
  if (!holds && gave_up) {
    fail(solution_.status,
         feasible(problem_) ? solution_.reason : "infeasible, no velocity lets nothing approach; " + solution_.reason);
    return false;
  }
  if (!residuals_.finite) {
    fail(Status::not_finite, solution_.reason.empty() ? "the method's impulses are not finite" : solution_.reason);
    return false;
  }
  if (!holds) {
    record_.status = Status::inaccurate;
    reason_ = fmt::format("{}, at t = {:.9g} s", Referee::refusal(residuals_, options_.accepted_residual), state_.t);
  }
  take_over_velocities();
  if (on_event)
    on_event(EventRecord{state_.t, problem_, solution_, residuals_, v_plus_, event_contacts(), event_limits(), trial_,
                         gap_speed_});
  return true;
}

// Its part of the step's row.
void BaseStep::record_answer() {
  record_.contacts += problem_.nc();
  record_.size += solution_.size;
  record_.iterations += solution_.iterations;
  if (!repeats_) ++record_.solves;
  const auto worst = [](std::optional<double>& a, const std::optional<double>& b) {
    if (b && (!a || std::abs(*b) > std::abs(*a))) a = b;
  };
  record_.claimed_residual = std::max(record_.claimed_residual, solution_.claimed_residual);
  record_.residual = std::max(record_.residual, residuals_.model);
  worst(record_.law_residual, residuals_.law);
  worst(record_.gap, residuals_.gap);
  worst(record_.infeasibility, residuals_.infeasibility);
}

void BaseStep::take_over_velocities() {
  if (!scenario_.model.trees.empty())  // what is driven does work
    for (std::size_t row = 0; row < problem_.offset.size(); ++row)
      energy_input_ += std::abs(solution_.impulse[row] * problem_.offset[row]);
  if (!trial_) record_.event_energy_gain += residuals_.energy_gain;
  if (residuals_.energy_before > 0)
    record_.event_energy_gain_relative =
        std::max(record_.event_energy_gain_relative, residuals_.energy_gain / residuals_.energy_before);
  set_velocities_after();
  for (const BlockOwner& owner : owners_) {
    if (owner.tree >= 0)
      stop_at_limits(owner.tree);
    else if (options_.prune.repeats)
      put_at_rest(owner.body);
  }
}

// Those of the answer, of what the event is made of.
void BaseStep::set_velocities_after() {
  for (std::size_t b = 0; b < owners_.size(); ++b) {
    const auto v_plus = v_plus_.begin() + problem_.M.first[b];
    if (owners_[b].tree < 0) {
      std::copy_n(v_plus, 6, state_.v.begin() + 6 * owners_[b].body);
      continue;
    }
    const Tree& tree = scenario_.model.trees[owners_[b].tree];
    std::copy_n(v_plus, tree.nv, state_.qd.begin() + tree.v);
    link_twists(scenario_.model, tree, state_);
  }
}

// Where what is left of its velocity is less than what answers are solved to.
void BaseStep::put_at_rest(int body) {
  constexpr double solved = 1e-12;  // -: of the velocity before
  const auto speed = [&](const std::vector<double>& of) {
    const double* v = &of[6 * static_cast<std::size_t>(body)];
    return Vec3(v).norm() + Vec3(v + 3).norm() * reach_[body];
  };
  if (speed(state_.v) <= solved * speed(before_event_))
    std::fill_n(state_.v.begin() + 6 * static_cast<std::ptrdiff_t>(body), 6, 0.0);
}

// A joint that its limit has stopped has its rate to the last bit: what is left of it would be all that the next event
// is about at that limit.
void BaseStep::stop_at_limits(int tree) {
  if (ahead_ > 0) return;
  bool stopped = false;
  for (const LimitContact& limit : event_limits()) {
    if (limit.tree != tree) continue;
    const Joint& joint = scenario_.model.trees[tree].joints[limit.joint];
    double& rate = state_.qd[joint.v];
    if (std::abs(rate - joint.limit_rate) > options_.approach * limit_speed(joint)) continue;
    rate = joint.limit_rate;
    stopped = true;
  }
  if (stopped) link_twists(scenario_.model, scenario_.model.trees[tree], state_);
}

// What rounding of a joint's rate is a part of.
double BaseStep::limit_speed(const Joint& joint) const {
  return std::abs(state_.qd[joint.v]) + std::abs(joint.limit_rate) + joint_speed_;
}

// Is the answer one of corners where the law asks for all points? Then the points found next are all of them.
bool BaseStep::corners_fall_short() {
  if (options_.prune.corners != Corners::suffice_unless_spin) return false;
  return patch_spins() && !patches_.empty();
}

// Do contacts of one pair slip at different velocities after the event?
bool BaseStep::patch_spins() {
  constexpr double even = 1e-9;  // -: differences, as a fraction of the fastest contact before the event
  if (patches_.empty() && !spinning_) return false;
  contact_velocity(problem_, problem_.v_minus, u_plus_);
  double fastest = 0;
  for (const double u : u_plus_) fastest = std::max(fastest, std::abs(u));
  contact_velocity(problem_, v_plus_, u_plus_);
  spinning_ = false;
  const std::vector<ContactPoint>& contacts = event_contacts();
  for (std::size_t c = 1; c < contacts.size(); ++c) {
    const std::size_t before = c - 1;
    if (contacts[c].shape_a != contacts[before].shape_a || contacts[c].shape_b != contacts[before].shape_b) continue;
    for (std::size_t i = 1; i < 3; ++i)
      spinning_ = spinning_ || std::abs(u_plus_[3 * c + i] - u_plus_[3 * before + i]) > even * fastest;
  }
  return spinning_;
}

// The first time of contact of an open feature within `horizon`, or `horizon`; travel_ and `reach` are
// displacement_bound(horizon)'s.
double BaseStep::first_contact(double horizon, double reach) {
  double first = horizon;
  // A feature that is open has more than this to go before it closes: tolerance less what the search aims at.
  constexpr double still = 0.25;
  const bool skip = options_.prune.contact_times && reach < margin_;
  for (const auto& [i, j] : *pairs_) {
    poll_stop();
    if (skip && travel_[i] + travel_[j] <= still * std::min(tolerance_[i], tolerance_[j])) {
      ++left_out_.contact_times;
      continue;
    }
    const double wait = bounces_.any() ? bounce_wait(i, j, horizon) : 0;
    if (wait >= first) continue;
    const double time = time_of_contact(scenario_.shapes[i], motions_[i], scenario_.shapes[j], motions_[j],
                                        std::min(tolerance_[i], tolerance_[j]), first);
    if (time >= first) continue;
    first = std::max(time, wait);
    arriving_ = {i, j};
  }
  if (!scenario_.model.trees.empty()) first = first_limit(first);
  return first;
}

// s, until which a pair whose bounces pile up is left alone; travel_ as in first_contact.
double BaseStep::bounce_wait(int i, int j, double horizon) const {
  const double size = std::min(tolerance_[i], tolerance_[j]) / options_.closed_gap;
  const double e = scenario_.pairs.find(i, j)->restitution;
  return bounces_.wait({i, j}, e, state_.t, step_, size, (travel_[i] + travel_[j]) / horizon);
}

void BaseStep::advance_positions(double dt) {
  for (std::size_t b = 0; b < state_.pose.size(); ++b) {
    if (scenario_.model.bodies[b].tree >= 0) continue;
    const double* v = &state_.v[6 * b];
    state_.pose[b] = advance(Motion{state_.pose[b], Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5])}, dt);
  }
  for (const Tree& tree : scenario_.model.trees) advance_tree(scenario_.model, tree, dt, state_);
  state_.t += dt;
}

}  // namespace cb
