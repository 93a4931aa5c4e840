#include "simulation/drift.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dynamics/kinematics.h"
#include "linalg/stop.h"
#include "simulation/displacement.h"

namespace cb {

namespace {

constexpr int rounds = 4;         // corrections at most; one or two do, their error is quadratic
constexpr double good_gap = 0.1;  // of the tolerance
// How far a shape may be moved: times what arcs can have done to it, but from its radius times the one to its radius
// times the other. Pads that hold a box close gaps of rounding by 1e-6 to 1e-4 of theirs, and stall where these stay;
// points side by side whose gaps differ ask for up to the radius, as do those of a wheel that turns by radians a step.
constexpr double arcs = 10, unseen = 1e-3, linear = 0.1;
// Of the largest diagonal: G is singular where points share a face; a round more takes away what it leaves. But of a
// heavy body among light ones, which that would hold fast, at most `spread` times as much of its own. Points that no
// displacement opens have a diagonal of rounding, at most `nothing` of the largest.
constexpr double ridge = 1e-11, spread = 1e3, nothing = 1e-20;

}  // namespace

void shape_motion(const Shape& shape, const State& state, Motion& motion) {
  if (shape.body < 0) {
    motion.pose = shape.local;
    return;
  }
  const Pose& pose = state.pose[shape.body];
  const double* v = &state.v[6 * shape.body];
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

void Drift::remove(const Scenario& scenario, std::vector<Motion>& motions, const std::vector<ContactPoint>& touching,
                   const std::vector<double>& tolerance, double limit_tolerance, const std::vector<double>& radius,
                   const std::vector<std::pair<int, int>>& pairs, const std::vector<char>& driven, double dt,
                   State& state) {
  if (pairs.empty()) return;
  take_driven(scenario, driven);

  // Linear opening speed of the pairs in touch; infinite for those that are not. How fast they slip.
  delta_.assign(pairs.size(), HUGE_VAL);
  slip_.assign(pairs.size(), 0.0);
  touched_.clear();
  for (const ContactPoint& contact : touching) {
    const auto pair = std::pair(std::min(contact.shape_a, contact.shape_b), std::max(contact.shape_a, contact.shape_b));
    const auto at = std::lower_bound(pairs.begin(), pairs.end(), pair);
    if (at == pairs.end() || *at != pair) continue;
    const Vec3 u = velocity_at(motions[contact.shape_a], contact.position) -
                   velocity_at(motions[contact.shape_b], contact.position);
    const auto k = static_cast<std::size_t>(at - pairs.begin());
    touched_.push_back(place_of(k, contact, motions));
    delta_[k] = std::min(delta_[k], contact.normal.dot(u));
    slip_[k] = std::max(slip_[k], u.norm());
  }

  // How far each shape ended from where steady motion would have taken it.
  arc_.assign(motions.size(), 0.0);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Shape& shape = scenario.shapes[i];
    if (shape.body < 0) continue;
    const Motion before = motions[i];
    shape_motion(shape, state, motions[i]);
    if (scenario.model.bodies[shape.body].tree < 0) continue;
    const Pose steady = advance(before, dt);
    arc_[i] = (steady.p - motions[i].pose.p).norm() +
              2 * (steady.q.conjugate() * motions[i].pose.q).vec().norm() * shape.bounding_radius();
  }
  // The gap g = n.(x - p) of a point x of one shape over a face of the other, normal n and centre p, has
  // |g''| <= w_x^2 r_x + 2 w_n |x' - p'| + w_n^2 r_n, and x' - p' is the slip and w_n x r_n.
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [i, j] = pairs[k];
    double bend = 0;
    for (const int s : {i, j}) {
      if (scenario.shapes[s].body < 0) continue;
      const double spin = motions[s].w.norm();
      bend += spin * (1.5 * spin * radius[s] + slip_[k]);
    }
    const double delta = arc_[i] + arc_[j] + dt * dt * bend + std::min(tolerance[i], tolerance[j]);
    delta_[k] = delta_[k] * dt <= delta ? delta : -delta;
  }
  bring_to_zero(scenario, motions, tolerance, limit_tolerance, pairs, state);
}

void Drift::close(const Scenario& scenario, const std::vector<Motion>& before, std::vector<Motion>& motions,
                  const std::vector<ContactPoint>& touching, const std::vector<double>& tolerance,
                  double limit_tolerance, const std::vector<std::pair<int, int>>& pairs,
                  const std::vector<char>& driven, double reach, State& state) {
  take_driven(scenario, driven);
  delta_.assign(pairs.size(), 0.0);  // no point of such a pair is looked for
  touched_.clear();
  for (const ContactPoint& contact : touching) {
    const auto pair = std::pair(std::min(contact.shape_a, contact.shape_b), std::max(contact.shape_a, contact.shape_b));
    const auto at = std::lower_bound(pairs.begin(), pairs.end(), pair);
    if (at == pairs.end() || *at != pair) continue;
    const auto k = static_cast<std::size_t>(at - pairs.begin());
    touched_.push_back(place_of(k, contact, before));
    delta_[k] = std::max(reach, std::min(tolerance[contact.shape_a], tolerance[contact.shape_b]));
  }
  bring_to_zero(scenario, motions, tolerance, limit_tolerance, pairs, state);
}

void Drift::bring_to_zero(const Scenario& scenario, std::vector<Motion>& motions, const std::vector<double>& tolerance,
                          double limit_tolerance, const std::vector<std::pair<int, int>>& pairs, State& state) {
  window_.resize(pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    double furthest = 0;  // that a point of one shape may be moved beside the other
    for (const int s : {pairs[k].first, pairs[k].second})
      if (scenario.shapes[s].body >= 0) furthest += linear * scenario.shapes[s].bounding_radius();
    window_[k] = std::min(std::abs(delta_[k]), furthest);
  }
  was_ = motions;
  reach_.assign(scenario.model.trees.size() + scenario.model.bodies.size(), 0.0);
  for (int round = 0; round < rounds; ++round) {
    find_points(scenario, motions, tolerance, pairs);
    const bool last = worst_ <= good_gap;
    if (last && (!exact_ || rounding_)) return;
    assemble(scenario, state);
    find_components(scenario);
    if (!displace_within_reach(scenario, tolerance, limit_tolerance, motions, state)) return;
    if (last) return;  // what is left is the square of what was good
  }
}

// Moves by d, with points let go until nothing moves too far. False where nothing is moved.
bool Drift::displace_within_reach(const Scenario& scenario, const std::vector<double>& tolerance,
                                  double limit_tolerance, std::vector<Motion>& motions, State& state) {
  state_was_ = state;
  while (held_points_ > 0) {
    poll_stop();
    do {
      if (!find_displacement()) return false;
    } while (hold_limits(limit_tolerance));
    move_poses(scenario.model, owners_, problem_.M.first, d_, state);
    for (std::size_t i = 0; i < motions.size(); ++i) shape_motion(scenario.shapes[i], state, motions[i]);
    if (!moves_too_far(scenario, motions)) return true;
    state = state_was_;
    for (std::size_t i = 0; i < motions.size(); ++i) shape_motion(scenario.shapes[i], state, motions[i]);
    if (!let_go(scenario, tolerance)) return false;
  }
  return false;
}

// The points whose gap is to be 0.
void Drift::find_points(const Scenario& scenario, const std::vector<Motion>& motions,
                        const std::vector<double>& tolerance, const std::vector<std::pair<int, int>>& pairs) {
  constexpr double ulps = 8;  // of the coordinates: what gaps are rounded to
  points_.clear();
  pair_of_.clear();
  worst_ = 0;
  rounding_ = true;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [i, j] = pairs[k];
    const double closed = std::min(tolerance[i], tolerance[j]), delta = window_[k];
    if (delta == 0) continue;
    found_.clear();
    contact_points(scenario.shapes[i], motions[i].pose, i, scenario.shapes[j], motions[j].pose, j, closed, found_,
                   false, delta_[k] > 0 ? delta : closed);
    std::erase_if(found_, [&](const ContactPoint& point) {
      return point.gap < -delta || (delta_[k] < 0 && point.gap > -closed);
    });
    if (exact_ && delta_[k] > 0) keep_touched(k, closed, motions);
    for (const ContactPoint& point : found_) {
      points_.push_back(point);
      pair_of_.push_back(static_cast<int>(k));
      worst_ = std::max(worst_, std::abs(point.gap) / closed);
      rounding_ = rounding_ && std::abs(point.gap) <=
                                   ulps * std::numeric_limits<double>::epsilon() * point.position.cwiseAbs().maxCoeff();
    }
  }
}

Drift::Place Drift::place_of(std::size_t pair, const ContactPoint& contact, const std::vector<Motion>& motions) const {
  const auto [first, second] = std::minmax(contact.shape_a, contact.shape_b);
  const auto on = [&](int shape) -> Vec3 {
    return motions[shape].pose.q.conjugate() * (contact.position - motions[shape].pose.p);
  };
  return {pair, on(first), on(second)};
}

// Of found_ what is closed, and of each point that touched the one that is nearest to it on either shape: what only
// comes near closes in its own time.
void Drift::keep_touched(std::size_t pair, double closed, const std::vector<Motion>& motions) {
  kept_.assign(found_.size(), 0);
  for (const Place& was : touched_) {
    if (was.pair != pair || found_.empty()) continue;
    double least = HUGE_VAL;
    std::size_t nearest = 0;
    for (std::size_t c = 0; c < found_.size(); ++c) {
      const Place is = place_of(pair, found_[c], motions);
      const double far = std::min((is.on_first - was.on_first).norm(), (is.on_second - was.on_second).norm());
      if (far >= least) continue;
      least = far;
      nearest = c;
    }
    kept_[nearest] = 1;
  }
  std::size_t kept = 0;
  for (std::size_t c = 0; c < found_.size(); ++c)
    if (kept_[c] != 0 || found_[c].gap <= closed) found_[kept++] = found_[c];
  found_.resize(kept);
}

// The tree or body that carries the shape; -1: none that passes a displacement on.
int Drift::owner(const Scenario& scenario, int shape) const {
  const int body = scenario.shapes[shape].body;
  if (body < 0) return -1;
  const int tree = scenario.model.bodies[body].tree, trees = static_cast<int>(scenario.model.trees.size());
  if (tree < 0) return trees + body;
  return driven_[tree] != 0 ? -1 : tree;
}

void Drift::take_driven(const Scenario& scenario, const std::vector<char>& driven) {
  driven_ = driven;
  driven_.resize(scenario.model.trees.size(), 0);
}

// What touch each other, each with the number of its lowest owner.
void Drift::find_components(const Scenario& scenario) {
  component_.resize(scenario.model.trees.size() + scenario.model.bodies.size());
  std::iota(component_.begin(), component_.end(), 0);
  const auto root = [&](int owner) {
    while (component_[owner] != owner) owner = component_[owner] = component_[component_[owner]];
    return owner;
  };
  for (const ContactPoint& point : points_) {
    const int a = owner(scenario, point.shape_a), b = owner(scenario, point.shape_b);
    if (a < 0 || b < 0) continue;
    const int root_a = root(a), root_b = root(b);
    component_[std::max(root_a, root_b)] = std::min(root_a, root_b);
  }
  for (int owner = 0; owner < static_cast<int>(component_.size()); ++owner) component_[owner] = root(owner);
  of_component_.assign(component_.size(), 0.0);
  for (std::size_t c = 0; c < points_.size(); ++c) {
    double& reach = of_component_[component_of(scenario, points_[c])];
    reach = std::max(reach, std::abs(delta_[pair_of_[c]]));
  }
  for (std::size_t o = 0; o < component_.size(); ++o) reach_[o] = std::max(reach_[o], of_component_[component_[o]]);
}

// Of the point; of one between what passes nothing on, 0, which counts for nothing.
int Drift::component_of(const Scenario& scenario, const ContactPoint& point) const {
  const int a = owner(scenario, point.shape_a), b = owner(scenario, point.shape_b);
  return a >= 0 ? component_[a] : b >= 0 ? component_[b] : 0;
}

// Notes the components of which a shape is now further from was_ than arcs can have brought it.
bool Drift::moves_too_far(const Scenario& scenario, const std::vector<Motion>& motions) {
  too_far_.assign(component_.size(), 0);
  bool any = false;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const int carrier = owner(scenario, static_cast<int>(i));
    if (carrier < 0 || reach_[carrier] == 0) continue;  // what no pair reaches, d moves by rounding at most
    const Pose &now = motions[i].pose, &before = was_[i].pose;
    const double radius = scenario.shapes[i].bounding_radius();
    const double far = (now.p - before.p).norm() + 2 * (before.q.conjugate() * now.q).vec().norm() * radius;
    if (far <= std::clamp(arcs * reach_[carrier], unseen * radius, linear * radius)) continue;
    too_far_[component_[carrier]] = 1;
    any = true;
  }
  return any;
}

// Of components that moved too far, the points that d_ pulls at half as much as at any go, in later rounds too; all
// where it pulls at none. False where there is none to let go.
bool Drift::let_go(const Scenario& scenario, const std::vector<double>& tolerance) {
  pull_.assign(component_.size(), 0.0);
  held_.resize(held_points_);
  for (std::size_t row = 0; row < held_.size(); ++row) {
    double& pull = pull_[component_of(scenario, points_[held_[row]])];
    pull = std::max(pull, -lambda_[static_cast<Eigen::Index>(row)]);
  }
  std::size_t kept = 0;
  for (std::size_t row = 0; row < held_.size(); ++row) {
    const int c = held_[row], component = component_of(scenario, points_[c]);
    const double pull = -lambda_[static_cast<Eigen::Index>(row)];
    const bool goes = too_far_[component] != 0 && (pull_[component] == 0 || pull > pull_[component] / 2);
    if (!goes) {
      held_[kept++] = c;
      continue;
    }
    const double closed = std::min(tolerance[points_[c].shape_a], tolerance[points_[c].shape_b]);
    double& window = window_[pair_of_[c]];
    if (points_[c].gap > 0) window = std::min(window, std::max(closed, 0.9 * points_[c].gap));
  }
  const bool any = kept < held_.size();
  held_.resize(kept);
  held_points_ = static_cast<Eigen::Index>(kept);
  in_.assign(limits_.size(), 0);
  wanted_.clear();
  for (const int c : held_) wanted_.push_back(-points_[c].gap);
  return any;
}

// N and M^-1 N^T of the points and of the joint limits that may come to hold.
void Drift::assemble(const Scenario& scenario, const State& state) {
  find_joint_limits(scenario, points_, state, limits_);
  zeros_.assign(points_.size(), 0.0);
  assembler_.assemble(scenario.model, state, scenario.shapes, points_, limits_, zeros_, zeros_, 0, problem_, owners_);
  const int nc = problem_.nc(), nv = problem_.nv();
  NT_.setZero(nv, nc);
  for (int c = 0; c < nc; ++c)
    for (int e = problem_.J.band[c]; e < problem_.J.band[c + 1]; ++e)
      NT_.col(c).segment(problem_.M.first[problem_.J.block[e]], problem_.J.entry(e).cols()) =
          problem_.J.entry(e).row(0).transpose();
  MNT_ = NT_;
  if (factor_.factor(problem_.M))
    factor_.solve_in_place(MNT_);
  else
    MNT_.setConstant(NAN);  // find_displacement says so
  held_.resize(points_.size());
  std::iota(held_.begin(), held_.end(), 0);
  held_points_ = static_cast<Eigen::Index>(held_.size());
  wanted_.resize(points_.size());
  for (std::size_t c = 0; c < points_.size(); ++c) wanted_[c] = -points_[c].gap;
  in_.assign(limits_.size(), 0);
}

// d = M^-1 N^T (N M^-1 N^T)^-1 wanted over held_. Limits have no ridge: they hold, and points give way.
bool Drift::find_displacement() {
  const auto n = static_cast<Eigen::Index>(held_.size()), points = held_points_;
  held_NT_ = NT_(Eigen::all, held_);
  held_MNT_ = MNT_(Eigen::all, held_);
  G_.noalias() = held_NT_.transpose() * held_MNT_;
  const double largest = G_.diagonal().head(points).maxCoeff();
  for (Eigen::Index i = 0; i < points; ++i)
    G_(i, i) += ridge * (G_(i, i) > nothing * largest ? std::min(spread * G_(i, i), largest) : largest);
  lambda_ = Eigen::Map<const Eigen::VectorXd>(wanted_.data(), n);
  llt_.compute(G_);
  if (llt_.info() != Eigen::Success) return false;
  llt_.solveInPlace(lambda_);
  d_.noalias() = held_MNT_ * lambda_;
  return d_.allFinite();
}

// Joints that d_ takes further beyond a limit are held there from now on. Returns whether there are new ones.
bool Drift::hold_limits(double limit_tolerance) {
  bool more = false;
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(points_.size() + i);
    const double wanted = wanted_opening(limits_[i].gap, limit_tolerance);
    if (in_[i] || NT_.col(row).dot(d_) >= wanted - good_gap * limit_tolerance) continue;
    in_[i] = 1;
    held_.push_back(static_cast<int>(row));
    wanted_.push_back(wanted);
    more = true;
  }
  return more;
}

}  // namespace cb
