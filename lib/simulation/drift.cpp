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
// Times what arcs can have done to it that a shape may be moved: up to 4 in scenes with robots; hundreds where points
// that part are asked to close.
constexpr double arcs = 10;
constexpr double ridge = 1e-11;  // of the largest diagonal: G is singular where points share a face; a round more
                                 // takes away what it leaves

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
                   const std::vector<std::pair<int, int>>& pairs, double dt, State& state) {
  if (pairs.empty()) return;

  // Linear opening speed of the pairs in touch; infinite for those that are not.
  delta_.assign(pairs.size(), HUGE_VAL);
  for (const ContactPoint& contact : touching) {
    const auto pair = std::pair(std::min(contact.shape_a, contact.shape_b), std::max(contact.shape_a, contact.shape_b));
    const auto at = std::lower_bound(pairs.begin(), pairs.end(), pair);
    if (at == pairs.end() || *at != pair) continue;
    const Motion &a = motions[contact.shape_a], &b = motions[contact.shape_b];
    const Vec3 v_a = a.v + a.w.cross(contact.position - a.pose.p), v_b = b.v + b.w.cross(contact.position - b.pose.p);
    double& speed = delta_[static_cast<std::size_t>(at - pairs.begin())];
    speed = std::min(speed, contact.normal.dot(v_a - v_b));
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
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [i, j] = pairs[k];
    const double reach = (scenario.shapes[i].body < 0 ? 0 : radius[i]) + (scenario.shapes[j].body < 0 ? 0 : radius[j]);
    const double spin2 = motions[i].w.squaredNorm() + motions[j].w.squaredNorm();
    const double delta = arc_[i] + arc_[j] + dt * dt * spin2 * reach + std::min(tolerance[i], tolerance[j]);
    delta_[k] = delta_[k] * dt <= delta ? delta : -delta;
  }
  bring_to_zero(scenario, motions, tolerance, limit_tolerance, pairs, state);
}

void Drift::close(const Scenario& scenario, std::vector<Motion>& motions, const std::vector<ContactPoint>& touching,
                  const std::vector<double>& tolerance, double limit_tolerance,
                  const std::vector<std::pair<int, int>>& pairs, double reach, State& state) {
  delta_.assign(pairs.size(), 0.0);  // no point of such a pair is looked for
  for (const ContactPoint& contact : touching) {
    const auto pair = std::pair(std::min(contact.shape_a, contact.shape_b), std::max(contact.shape_a, contact.shape_b));
    const auto at = std::lower_bound(pairs.begin(), pairs.end(), pair);
    if (at == pairs.end() || *at != pair) continue;
    delta_[static_cast<std::size_t>(at - pairs.begin())] =
        std::max(reach, std::min(tolerance[contact.shape_a], tolerance[contact.shape_b]));
  }
  bring_to_zero(scenario, motions, tolerance, limit_tolerance, pairs, state);
}

void Drift::bring_to_zero(const Scenario& scenario, std::vector<Motion>& motions, const std::vector<double>& tolerance,
                          double limit_tolerance, const std::vector<std::pair<int, int>>& pairs, State& state) {
  for (int round = 0; round < rounds; ++round) {
    poll_stop();
    find_points(scenario, motions, tolerance, pairs);
    const bool last = worst_ <= good_gap;
    if (last && (!exact_ || rounding_)) return;
    assemble(scenario, state);
    find_reach(scenario);
    state_was_ = state;
    was_ = motions;
    for (bool again = true; again;) {
      do {
        if (!find_displacement()) return;
      } while (hold_limits(limit_tolerance));
      move_poses(scenario.model, owners_, problem_.M.first, d_, state);
      for (std::size_t i = 0; i < motions.size(); ++i) shape_motion(scenario.shapes[i], state, motions[i]);
      again = moves_too_far(scenario, motions);
      if (!again) break;
      state = state_was_;
      motions = was_;
      if (!leave_parting(tolerance)) return;
    }
    if (last) return;  // what is left is the square of what was good
  }
}

// The points whose gap is to be 0.
void Drift::find_points(const Scenario& scenario, const std::vector<Motion>& motions,
                        const std::vector<double>& tolerance, const std::vector<std::pair<int, int>>& pairs) {
  constexpr double ulps = 8;  // of the coordinates: what gaps are rounded to
  points_.clear();
  may_move_.clear();
  worst_ = 0;
  rounding_ = true;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [i, j] = pairs[k];
    const double closed = std::min(tolerance[i], tolerance[j]), delta = std::abs(delta_[k]);
    if (delta == 0) continue;
    found_.clear();
    contact_points(scenario.shapes[i], motions[i].pose, i, scenario.shapes[j], motions[j].pose, j,
                   delta_[k] > 0 ? delta : closed, found_);
    for (const ContactPoint& point : found_) {
      if (point.gap < -delta || (delta_[k] < 0 && point.gap > -closed)) continue;
      points_.push_back(point);
      may_move_.push_back(delta);
      worst_ = std::max(worst_, std::abs(point.gap) / closed);
      rounding_ = rounding_ && std::abs(point.gap) <=
                                   ulps * std::numeric_limits<double>::epsilon() * point.position.cwiseAbs().maxCoeff();
    }
  }
}

int owner_of(const Scenario& scenario, int shape) {
  const int body = scenario.shapes[shape].body;
  if (body < 0) return -1;
  const int tree = scenario.model.bodies[body].tree, trees = static_cast<int>(scenario.model.trees.size());
  return tree >= 0 ? tree : trees + body;
}

// What was moved moves what it touches.
void Drift::find_reach(const Scenario& scenario) {
  reach_.assign(scenario.model.trees.size() + scenario.model.bodies.size(), 0.0);
  for (bool more = true; more;) {
    more = false;
    for (std::size_t c = 0; c < points_.size(); ++c) {
      const int a = owner_of(scenario, points_[c].shape_a), b = owner_of(scenario, points_[c].shape_b);
      const double reach = std::max({may_move_[c], a < 0 ? 0 : reach_[a], b < 0 ? 0 : reach_[b]});
      for (const int owner : {a, b}) {
        if (owner < 0 || reach_[owner] >= reach) continue;
        reach_[owner] = reach;
        more = true;
      }
    }
  }
}

// Beyond what arcs can have done to it, from was_?
bool Drift::moves_too_far(const Scenario& scenario, const std::vector<Motion>& motions) const {
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const int owner = owner_of(scenario, static_cast<int>(i));
    if (owner < 0) continue;
    const Pose &now = motions[i].pose, &before = was_[i].pose;
    const double far = (now.p - before.p).norm() +
                       2 * (before.q.conjugate() * now.q).vec().norm() * scenario.shapes[i].bounding_radius();
    if (!(far <= arcs * reach_[owner])) return true;
  }
  return false;
}

// Lets go of the points that are open the widest. False where none is open.
bool Drift::leave_parting(const std::vector<double>& tolerance) {
  held_.resize(held_points_);
  in_.assign(limits_.size(), 0);
  double widest = 0;
  for (const int c : held_) {
    const double closed = std::min(tolerance[points_[c].shape_a], tolerance[points_[c].shape_b]);
    if (points_[c].gap > good_gap * closed) widest = std::max(widest, points_[c].gap);
  }
  if (widest == 0) return false;
  std::erase_if(held_, [&](int c) { return points_[c].gap > widest / 2; });
  held_points_ = static_cast<Eigen::Index>(held_.size());
  wanted_.clear();
  for (const int c : held_) wanted_.push_back(-points_[c].gap);
  return held_points_ > 0;
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
  if (factor_.factor(problem_.M)) {
    for (int c = 0; c < nc; ++c) factor_.solve_in_place({MNT_.col(c).data(), static_cast<std::size_t>(nv)});
  } else {
    MNT_.setConstant(NAN);  // find_displacement says so
  }
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
  G_.noalias() = NT_(Eigen::all, held_).transpose() * MNT_(Eigen::all, held_);
  G_.diagonal().head(points).array() += ridge * G_.diagonal().head(points).maxCoeff();
  lambda_ = Eigen::Map<const Eigen::VectorXd>(wanted_.data(), n);
  llt_.compute(G_);
  if (llt_.info() != Eigen::Success) return false;
  llt_.solveInPlace(lambda_);
  d_.noalias() = MNT_(Eigen::all, held_) * lambda_;
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
