// Poses without overlap, by the least displacement in the norm of M.
//
// Problem: points with gaps g (m) of bodies with inertia M; find d (nv) least in d.M d with N d >= wanted. By duality
// d = M^-1 N^T lambda with 0 <= lambda, N d - wanted >= 0, complementary, island by island.
// Source: the dual of Lawson and Hanson, "Solving least squares problems" (1974), chapter 23, with sets exchanged whole
// as in Judice and Pires, "Basic-set algorithm for a generalized linear complementarity problem" (1992).
// Differences from the source:
//   1. The set of points held begins with those that are too deep, and others enter only where a displacement closes
//      them: G = N M^-1 N^T is formed over that set alone, which is small beside the pile around it.
//   2. Where the set is large, or its exchanges do not end, springs are made ever harder (least_displacement.cpp).
//   3. Points that were held are held on, as points of the material, where the shapes no longer list them: what is
//      lowest on a round rim that lies nearly flat is another point after the least turn, and would never end
//      (cutting planes; Kelley, "The cutting-plane method for solving convex programs", 1960).
//   4. G is scaled to a unit diagonal and raised by a ridge: where points share a face it is singular. What the ridge
//      leaves, the next linearisation takes away. Rows of joint limits have none, so that they hold exactly and points
//      that contradict them give way.
// When it fails: bodies that are wedged in. After `rounds` it returns; the caller looks at what is left.
#include "simulation/overlap.h"

#include <algorithm>
#include <cmath>

#include "geometry/box_box.h"
#include "linalg/stop.h"
#include "simulation/displacement.h"
#include "simulation/drift.h"

namespace cb {

namespace {

constexpr int rounds = 60;             // linearisations; two or three do, more where bodies turn far
constexpr int patience = 10;           // of them in a row that do not halve the depth, where springs are needed
constexpr int exchanges = 60;          // of the set, one linearisation; beyond: springs
constexpr int whole = 20;              // exchanges of all points at once; then one leaves at a time
constexpr int most = 60;               // points held; of more springs are cheaper than a dense factor
constexpr double ridge = 1e-11;        // of G's diagonal
constexpr double missed = 0.1;         // of the closed gap: N d >= wanted - missed * closed
constexpr double reach_of = 4;         // depths: points with gaps up to these are looked at
constexpr double same_normal = 0.999;  // cosine
constexpr double same_point = 1e-3;    // of the smaller shape's size
constexpr double furthest = 0.2;       // rad: a body turns by no more in a round
// -: lambda < -negative * (largest lambda) leaves the set
constexpr double negative = 1e-12;

// Points are listed in the order of these.
template <class Point>
std::pair<int, int> pair_of(const Point& p) {
  return std::minmax(p.shape_a, p.shape_b);
}

// m: points of a pair that are nearer are one.
template <class Point>
double nearness(const Scenario& scenario, const Point& p) {
  return same_point * std::min(scenario.shapes[p.shape_a].size(), scenario.shapes[p.shape_b].size());
}

}  // namespace

double Overlap::remove(const Scenario& scenario, const std::vector<double>& tolerance, double limit_tolerance,
                       const std::vector<double>& radius, double depth, const FindPairs& find_pairs,
                       std::vector<Motion>& motions, State& state) {
  double displacement = 0;
  large_ = false;
  earlier_.clear();
  double mark = HUGE_VAL;
  for (int round = 0, since = 0; round < rounds; ++round) {
    const double reach = reach_of * depth;
    depth = find_points(scenario, motions, tolerance, find_pairs(2 * reach), reach);
    if (depth == 0) break;
    since = depth < 0.5 * mark ? 0 : since + 1;
    if (since == 0) mark = depth;
    if (large_ && since > patience) break;
    poll_stop();
    recall(scenario, motions, tolerance, reach);
    add_limits(scenario, limit_tolerance, state);
    prepare(scenario, state);
    d_.setZero(problem_.nv());
    for (int island = 0; island < islands_.count; ++island) solve(island);
    remember(scenario, motions);
    const double moved = move(scenario, radius, motions, state);
    displacement += moved;
    for (std::size_t i = 0; i < motions.size(); ++i) shape_motion(scenario.shapes[i], state, motions[i]);
    depth = std::max(depth, moved);
  }
  return displacement;
}

// Points within reach, and what each needs. Returns the deepest of those that are deeper than closed, 0 where none is.
double Overlap::find_points(const Scenario& scenario, const std::vector<Motion>& motions,
                            const std::vector<double>& tolerance, const std::vector<std::pair<int, int>>& pairs,
                            double reach) {
  points_.clear();
  wanted_.clear();
  slack_.clear();
  double deepest = 0;
  for (const auto& [i, j] : pairs) {
    const double closed =
        resolved_tolerance(std::min(tolerance[i], tolerance[j]), motions[i].pose.p, motions[j].pose.p);
    const std::size_t first = points_.size();
    contact_points(scenario.shapes[i], motions[i].pose, i, scenario.shapes[j], motions[j].pose, j, closed, points_,
                   false, reach);
    for (std::size_t c = first; c < points_.size(); ++c) {
      const double gap = points_[c].gap;
      wanted_.push_back(wanted_opening(gap, closed));
      slack_.push_back(missed * closed);
      if (gap < -closed) deepest = std::max(deepest, -gap);
    }
  }
  return deepest;
}

// Lists points that were held in earlier rounds, are within reach and not listed. Both are ordered by their pairs.
void Overlap::recall(const Scenario& scenario, const std::vector<Motion>& motions, const std::vector<double>& tolerance,
                     double reach) {
  const std::size_t listed = points_.size();
  std::size_t first = 0, last = 0;
  for (const MaterialPoint& e : earlier_) {
    while (first < listed && pair_of(points_[first]) < pair_of(e)) ++first;
    for (last = std::max(first, last); last < listed && pair_of(points_[last]) == pair_of(e);) ++last;
    const ContactPoint* along = nullptr;
    for (std::size_t c = first; c < last; ++c)
      if (along == nullptr || points_[c].normal.dot(e.normal) > along->normal.dot(e.normal)) along = &points_[c];
    if (along == nullptr || along->normal.dot(e.normal) < same_normal) continue;
    const Vec3 n = along->normal, a = motions[e.shape_a].pose * e.on_a, b = motions[e.shape_b].pose * e.on_b;
    const double gap = n.dot(a - b), near = nearness(scenario, e);
    const auto is_there = [&](const ContactPoint& p) { return (p.position - (a + b) / 2).norm() <= near; };
    if (gap > reach || std::any_of(points_.begin() + first, points_.begin() + last, is_there)) continue;
    const double closed = resolved_tolerance(std::min(tolerance[e.shape_a], tolerance[e.shape_b]),
                                             motions[e.shape_a].pose.p, motions[e.shape_b].pose.p);
    points_.push_back({(a + b) / 2, n, gap, e.shape_a, e.shape_b});
    wanted_.push_back(wanted_opening(gap, closed));
    slack_.push_back(missed * closed);
  }
}

// Keeps in mind what is held, each point of the material once.
void Overlap::remember(const Scenario& scenario, const std::vector<Motion>& motions) {
  const std::size_t before = earlier_.size();
  for (std::size_t c = 0; c < points_.size(); ++c) {
    if (in_[c] == 0) continue;
    const ContactPoint& p = points_[c];
    const Vec3 half = (p.gap / 2) * p.normal;
    const Pose &a = motions[p.shape_a].pose, &b = motions[p.shape_b].pose;
    const MaterialPoint here{p.shape_a, p.shape_b, a.q.conjugate() * (p.position + half - a.p),
                             b.q.conjugate() * (p.position - half - b.p), p.normal};
    const auto [first, last] =
        std::ranges::equal_range(earlier_.begin(), earlier_.begin() + static_cast<std::ptrdiff_t>(before),
                                 pair_of(here), {}, pair_of<MaterialPoint>);
    const double near = nearness(scenario, here);
    if (std::none_of(first, last, [&](const MaterialPoint& e) { return (e.on_a - here.on_a).norm() <= near; }))
      earlier_.push_back(here);
  }
  std::ranges::stable_sort(earlier_, {}, pair_of<MaterialPoint>);
}

void Overlap::add_limits(const Scenario& scenario, double tolerance, const State& state) {
  find_joint_limits(scenario, points_, state, limits_);
  for (const LimitContact& limit : limits_) {
    wanted_.push_back(wanted_opening(limit.gap, tolerance));
    slack_.push_back(missed * tolerance);
  }
}

// N, N M^-1 and the scale of each point.
void Overlap::prepare(const Scenario& scenario, const State& state) {
  zeros_.assign(points_.size(), 0.0);
  assembler_.assemble(scenario.model, state, scenario.shapes, points_, limits_, zeros_, zeros_, 0, problem_, owners_);
  find_islands(problem_, islands_);
  of_island_.assign(islands_.of_contact, islands_.count);
  blocks_of_.assign(islands_.of_block, islands_.count);
  in_.assign(wanted_.size(), 0);
  scale_.assign(wanted_.size(), 0.0);
  row_.clear();
  moved_.clear();
  if (!factor_.factor(problem_.M)) return;
  for (int c = 0; c < problem_.nc(); ++c) {
    double G_cc = 0;
    for (int e = problem_.J.band[c]; e < problem_.J.band[c + 1]; ++e) {
      const auto entry = problem_.J.entry(e);
      const auto at = static_cast<std::ptrdiff_t>(row_.size());
      for (int k = 0; k < entry.cols(); ++k) row_.push_back(entry(0, k));
      moved_.insert(moved_.end(), row_.begin() + at, row_.end());
      factor_.solve_block_in_place(problem_.J.block[e], &moved_[static_cast<std::size_t>(at)], 1);
      for (std::size_t k = static_cast<std::size_t>(at); k < row_.size(); ++k) G_cc += row_[k] * moved_[k];
    }
    scale_[c] = G_cc > 0 ? 1 / std::sqrt(G_cc) : 0;
  }
}

double Overlap::opened(int c) const {
  double sum = 0;
  for (int e = problem_.J.band[c]; e < problem_.J.band[c + 1]; ++e) {
    const int size = problem_.M.block_size(problem_.J.block[e]);
    sum += Eigen::Map<const Eigen::VectorXd>(&row_[problem_.J.offset[e] / 3], size)
               .dot(d_.segment(problem_.M.first[problem_.J.block[e]], size));
  }
  return sum;
}

void Overlap::add_to_displacement(int c, double lambda) {
  for (int e = problem_.J.band[c]; e < problem_.J.band[c + 1]; ++e) {
    const int size = problem_.M.block_size(problem_.J.block[e]);
    d_.segment(problem_.M.first[problem_.J.block[e]], size) +=
        lambda * Eigen::Map<const Eigen::VectorXd>(&moved_[problem_.J.offset[e] / 3], size);
  }
}

// lambda (of scaled rows) with N d = wanted on the working set.
bool Overlap::solve_working_set() {
  const auto n = static_cast<Eigen::Index>(working_.size());
  G_.resize(n, n);
  lambda_.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int c = working_[static_cast<std::size_t>(i)];
    lambda_[i] = scale_[c] * wanted_[c];
    for (Eigen::Index k = 0; k <= i; ++k) {
      const int other = working_[static_cast<std::size_t>(k)];
      double sum = 0;
      for (int e = problem_.J.band[c]; e < problem_.J.band[c + 1]; ++e)
        for (int f = problem_.J.band[other]; f < problem_.J.band[other + 1]; ++f) {
          if (problem_.J.block[e] != problem_.J.block[f]) continue;
          const int size = problem_.M.block_size(problem_.J.block[e]);
          sum += Eigen::Map<const Eigen::VectorXd>(&row_[problem_.J.offset[e] / 3], size)
                     .dot(Eigen::Map<const Eigen::VectorXd>(&moved_[problem_.J.offset[f] / 3], size));
        }
      G_(i, k) = scale_[c] * scale_[other] * sum;
    }
    if (c < static_cast<int>(points_.size())) G_(i, i) += ridge;
  }
  llt_.compute(G_);
  if (llt_.info() != Eigen::Success) return false;
  llt_.solveInPlace(lambda_);
  return lambda_.allFinite();
}

// Adds the least displacement of one island to d_.
void Overlap::solve(int which) {
  if (exchange_sets(of_island_[which])) return;
  large_ = true;
  for (const int b : blocks_of_[which]) d_.segment(problem_.M.first[b], problem_.M.block_size(b)).setZero();
  least_.solve(problem_, of_island_[which], blocks_of_[which], wanted_, scale_, d_);
}

// False where the set came to no end, or is large.
bool Overlap::exchange_sets(std::span<const int> island) {
  working_.clear();
  for (const int c : island)
    if (wanted_[c] > 0 && scale_[c] > 0) {
      in_[c] = 1;
      working_.push_back(c);
    }
  if (working_.empty()) return true;
  for (int exchange = 0; exchange < exchanges; ++exchange) {
    poll_stop();
    if (working_.size() > most) return false;
    // Where all left at once, those that are too deep come back below.
    lambda_.resize(0);
    if (!working_.empty() && !solve_working_set()) return false;
    // Points that pull leave: all, or from some time on the one that pulls most.
    const double worst = working_.empty() ? 0 : lambda_.minCoeff();
    const double kept = working_.empty() ? 0 : -negative * lambda_.cwiseAbs().maxCoeff();
    const bool leaving = worst < kept;
    for (const int c : working_)
      for (int e = problem_.J.band[c]; e < problem_.J.band[c + 1]; ++e)
        d_.segment(problem_.M.first[problem_.J.block[e]], problem_.M.block_size(problem_.J.block[e])).setZero();
    if (leaving) {
      std::size_t left = 0;
      for (std::size_t i = 0; i < working_.size(); ++i) {
        const double pull = lambda_[static_cast<Eigen::Index>(i)];
        if (pull < kept && (exchange < whole || pull == worst))
          in_[working_[i]] = 0;
        else
          working_[left++] = working_[i];
      }
      working_.resize(left);
      continue;
    }
    for (std::size_t i = 0; i < working_.size(); ++i)
      add_to_displacement(working_[i], scale_[working_[i]] * std::max(0.0, lambda_[static_cast<Eigen::Index>(i)]));
    const std::size_t before = working_.size();
    for (const int c : island)
      if (!in_[c] && scale_[c] > 0 && opened(c) < wanted_[c] - slack_[c]) {
        in_[c] = 1;
        working_.push_back(c);
      }
    if (working_.size() == before) return true;
  }
  return false;
}

// Moves the bodies by d_; returns the furthest that a point of one moves. `motions`: before.
double Overlap::move(const Scenario& scenario, const std::vector<double>& radius, const std::vector<Motion>& motions,
                     State& state) {
  constexpr int none = -1, link = -2;
  if (!d_.allFinite()) return 0;
  double turn = 0, furthest_point = 0;
  for (std::size_t b = 0; b < owners_.size(); ++b)
    if (owners_[b].tree < 0) turn = std::max(turn, d_.segment<3>(problem_.M.first[b] + 3).norm());
  if (turn > furthest) d_ *= furthest / turn;
  block_.assign(scenario.model.bodies.size(), none);
  for (std::size_t b = 0; b < owners_.size(); ++b) {
    if (owners_[b].tree < 0) {
      block_[owners_[b].body] = static_cast<int>(b);
      continue;
    }
    const Tree& tree = scenario.model.trees[owners_[b].tree];
    if (d_.segment(problem_.M.first[b], tree.nv).isZero(0)) continue;
    for (const Joint& joint : tree.joints) block_[joint.body] = link;
  }
  displace(scenario.model, owners_, problem_.M.first, d_, state);
  for (std::size_t i = 0; i < scenario.shapes.size(); ++i) {
    const Shape& shape = scenario.shapes[i];
    if (shape.body < 0 || block_[shape.body] == none) continue;
    double far = 0;
    if (block_[shape.body] == link) {
      Motion now;
      shape_motion(shape, state, now);
      const Pose& before = motions[i].pose;
      const double sine = (before.q.conjugate() * now.pose.q).vec().norm();  // of half the turn
      far = (now.pose.p - before.p).norm() + 2 * sine * shape.bounding_radius();
    } else {
      const auto d = d_.segment<6>(problem_.M.first[block_[shape.body]]);
      far = d.head<3>().norm() + radius[i] * d.tail<3>().norm();
    }
    furthest_point = std::max(furthest_point, far);
  }
  return furthest_point;
}

}  // namespace cb
