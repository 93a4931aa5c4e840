#include "simulation/stepping/extrapolation.h"

#include <algorithm>
#include <cmath>

#include "dynamics/kinematics.h"

namespace cb {

namespace {

/// The rotation vector of a unit quaternion, exact near zero, up to half a turn.
Vec3 rotation_vector(const Quat& q) {
  const double sine = q.vec().norm();
  if (sine == 0) return Vec3::Zero();
  const double sign = q.w() < 0 ? -1 : 1;
  return sign * 2 * std::atan2(sine, std::abs(q.w())) / sine * q.vec();
}

bool has_pose(const Model& model, std::size_t body) {
  const int tree = model.bodies[body].tree;
  if (tree < 0) return true;
  for (const Joint& joint : model.trees[static_cast<std::size_t>(tree)].joints)
    if (joint.body == static_cast<int>(body)) return joint.kind == JointKind::free;
  return false;
}

}  // namespace

void to_vector(const Model& model, const State& start, const State& state, std::vector<double>& x) {
  x.clear();
  for (std::size_t b = 0; b < model.bodies.size(); ++b) {
    if (!has_pose(model, b)) continue;
    const Vec3 p = state.pose[b].p - start.pose[b].p;
    const Vec3 turn = rotation_vector(state.pose[b].q * start.pose[b].q.conjugate());
    x.insert(x.end(), {p[0], p[1], p[2], turn[0], turn[1], turn[2]});
    x.insert(x.end(), state.v.begin() + 6 * static_cast<std::ptrdiff_t>(b),
             state.v.begin() + 6 * static_cast<std::ptrdiff_t>(b) + 6);
  }
  for (std::size_t i = 0; i < state.q.size(); ++i) x.push_back(state.q[i] - start.q[i]);
  x.insert(x.end(), state.qd.begin(), state.qd.end());
}

void from_vector(const Model& model, const State& start, const std::vector<double>& x, State& state) {
  const double* at = x.data();
  for (std::size_t b = 0; b < model.bodies.size(); ++b) {
    if (!has_pose(model, b)) continue;
    state.pose[b] = advance(start.pose[b], Vec3(at), Vec3(at + 3), 1);
    std::copy_n(at + 6, 6, state.v.begin() + 6 * static_cast<std::ptrdiff_t>(b));
    at += 12;
  }
  for (std::size_t i = 0; i < state.q.size(); ++i) state.q[i] = start.q[i] + *at++;
  for (double& rate : state.qd) rate = *at++;
  for (const Tree& tree : model.trees) {
    forward_kinematics(model, tree, state);
  }
}

void extrapolate(const std::vector<std::vector<double>>& results, const std::vector<int>& n, std::vector<double>& best,
                 std::vector<double>& neighbour, std::vector<double>& before) {
  // Row j of the table from row j - 1, column by column: T_j,k+1 = T_jk + (T_jk - T_j-1,k) / (n_j / n_j-k - 1).
  std::vector<std::vector<double>> row, above;
  for (std::size_t j = 0; j < results.size(); ++j) {
    row.assign(1, results[j]);
    for (std::size_t k = 1; k <= j; ++k) {
      const double factor = 1 / (static_cast<double>(n[j]) / n[j - k] - 1);
      row.push_back(row[k - 1]);
      for (std::size_t i = 0; i < row[k].size(); ++i) row[k][i] += factor * (row[k - 1][i] - above[k - 1][i]);
    }
    above = row;
  }
  const auto from_last = [&](std::size_t back) { return above[above.size() > back ? above.size() - 1 - back : 0]; };
  best = from_last(0);
  neighbour = from_last(1);
  before = from_last(2);
}

double distance(const std::vector<double>& radius, const State& a, const State& b) {
  double largest = 0;
  for (std::size_t i = 0; i < radius.size(); ++i)
    largest = std::max(largest, (a.pose[i].p - b.pose[i].p).norm() +
                                    radius[i] * 2 * (a.pose[i].q.conjugate() * b.pose[i].q).vec().norm());
  return largest;
}

double speed_difference(const std::vector<double>& radius, const State& a, const State& b) {
  double largest = 0;
  for (std::size_t i = 0; i < radius.size(); ++i)
    largest = std::max(largest, (Vec3(&a.v[6 * i]) - Vec3(&b.v[6 * i])).norm() +
                                    radius[i] * (Vec3(&a.v[6 * i + 3]) - Vec3(&b.v[6 * i + 3])).norm());
  return largest;
}

}  // namespace cb
