#include "methods/impact_state.h"

#include <algorithm>
#include <cmath>

#include "linalg/finite.h"

namespace cb {

namespace {

using Eigen::Map;
using Eigen::Matrix;
using Eigen::Vector3d;

}  // namespace

Status ImpactState::start(const ContactProblem& problem, const Tolerances& tolerances, std::string& reason) {
  problem_ = &problem;
  has_neighbours_ = false;
  const BandMatrix& J = problem.J;
  const int contacts = problem.nc();
  v_ = problem.v_minus;
  K_.resize(contacts);
  if (!all_finite(problem.M.values) || !all_finite(J.values) || !all_finite(v_) || !all_finite(problem.offset) ||
      !all_finite(problem.mu) || !all_finite(problem.restitution)) {
    reason = "the problem's data hold NaN or infinity";
    return Status::not_finite;
  }
  if (!factor_.factor(problem.M)) {
    reason = "the mass matrix is not positive definite";
    return Status::singular;
  }

  // J^T, M^-1 J^T and K, contact by contact.
  band_.assign(1, 0);
  entry_.clear();
  jt_.resize(J.values.size());
  mjt_.resize(J.values.size());
  int values = 0;
  for (int c = 0; c < contacts; ++c) {
    Eigen::Matrix3d& K = K_[c];
    K.setZero();
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const auto source = J.entry(e);
      const int size = static_cast<int>(source.cols());
      entry_.push_back({problem.M.first[J.block[e]], size, values});
      double* jt = jt_.data() + values;
      double* mjt = mjt_.data() + values;
      if (size == 6) {
        Map<Matrix<double, 6, 3>> transposed(jt), X(mjt);
        transposed = Map<const Matrix<double, 3, 6>>(source.data()).transpose();
        X = transposed;
        factor_.solve_block_in_place(J.block[e], mjt, 3);
        K.noalias() += Map<const Matrix<double, 3, 6>>(source.data()) * X;
      } else {
        Map<Matrix<double, Eigen::Dynamic, 3>> transposed(jt, size, 3);
        transposed = source.transpose();
        std::copy_n(jt, 3 * size, mjt);
        factor_.solve_block_in_place(J.block[e], mjt, 3);
        K.noalias() += source.lazyProduct(Map<const Matrix<double, Eigen::Dynamic, 3>>(mjt, size, 3));
      }
      values += 3 * size;
    }
    K = (0.5 * (K + K.transpose())).eval();
    band_.push_back(static_cast<int>(entry_.size()));
  }
  measure(tolerances);

  for (int c = 0; c < contacts; ++c)
    if (!(K_[c](0, 0) > 0) && normal_velocity(c) < -approach_tolerance(c)) {
      reason = "an approaching contact has no body that an impulse can move";
      return Status::singular;
    }
  return Status::ok;
}

double ImpactState::weight(int c) const { return is_limit(c) ? std::max(K_[c](0, 0), 0.0) : K_[c].trace() / 3; }

void ImpactState::measure(const Tolerances& tolerances) {
  constexpr std::size_t fields = 4;
  find_islands(*problem_, islands_);
  of_island_.assign(fields * static_cast<std::size_t>(islands_.count), 0.0);
  const auto of_island = [&](int c) { return &of_island_[fields * static_cast<std::size_t>(islands_.of_contact[c])]; };
  approach_ = tolerances.approach;
  for (std::vector<double>* x : {&before_, &most_, &rounding_, &stopping_, &given_}) x->assign(K_.size(), 0.0);
  for (int c = 0; c < nc(); ++c) {
    double size[3] = {std::abs(problem_->offset[3 * c]), std::abs(problem_->offset[3 * c + 1]),
                      std::abs(problem_->offset[3 * c + 2])};
    double u_n = problem_->offset[3 * c];
    for (int e = band_[c]; e < band_[c + 1]; ++e) {
      const Entry& entry = entry_[e];
      const double* v = v_.data() + entry.first;
      const double* j = jt_.data() + entry.values;
      for (int i = 0; i < entry.size; ++i) u_n += j[i] * v[i];
      for (int row = 0; row < 3; ++row, j += entry.size)
        for (int i = 0; i < entry.size; ++i) size[row] += std::abs(j[i] * v[i]);
    }
    double* island = of_island(c);
    before_[c] = std::max(0.0, -u_n);
    rounding_[c] = tolerances.rounding * std::max({size[0], size[1], size[2]});
    if (weight(c) > 0) island[1] = std::max(island[1], before_[c] / std::sqrt(weight(c)));
    if (is_limit(c)) {
      island[3] = 1;
      continue;
    }
    island[0] = std::max(island[0], before_[c]);
    island[2] = std::max(island[2], rounding_[c]);
  }
  for (int c = 0; c < nc(); ++c) {
    const double* island = of_island(c);
    most_[c] = std::sqrt(weight(c)) * island[1];
    stopping_[c] = weight(c) * island[3];
    if (is_limit(c)) continue;
    before_[c] = island[0];
    rounding_[c] = island[2];
  }
}

double ImpactState::approach_left() const {
  double fastest = 0, before = 0, worst = 0;
  for (int c = 0; c < nc(); ++c) {
    const double left = std::max(0.0, -normal_velocity(c));
    if (!is_limit(c)) {
      fastest = std::max(fastest, left);
      before = std::max({before, before_[c], stopping_[c] * given_[c]});
    } else if (left > 0) {
      const double own = std::max(before_[c], stopping_[c] * given_[c]);
      worst = std::max(worst, own > 0 ? left / own : 1.0);
    }
  }
  return fastest > 0 ? std::max(worst, before > 0 ? fastest / before : 1.0) : worst;
}

void ImpactState::restart(const std::vector<double>& r) {
  v_ = problem_->v_minus;
  given_.assign(K_.size(), 0.0);
  for (int c = 0; c < nc(); ++c) apply(c, Map<const Vector3d>(r.data() + 3 * c));
}

double ImpactState::normal_velocity(int c) const {
  double u_n = problem_->offset[3 * c];
  for (int e = band_[c]; e < band_[c + 1]; ++e) {
    const Entry& entry = entry_[e];
    const double* j = jt_.data() + entry.values;
    const double* v = v_.data() + entry.first;
    if (entry.size == 6)
      u_n += Map<const Matrix<double, 6, 1>>(j).dot(Map<const Matrix<double, 6, 1>>(v));
    else
      u_n += Map<const Eigen::VectorXd>(j, entry.size).dot(Map<const Eigen::VectorXd>(v, entry.size));
  }
  return u_n;
}

Vector3d ImpactState::velocity(int c) const {
  Vector3d u = Map<const Vector3d>(problem_->offset.data() + 3 * c);
  for (int e = band_[c]; e < band_[c + 1]; ++e) {
    const Entry& entry = entry_[e];
    const double* j = jt_.data() + entry.values;
    const double* v = v_.data() + entry.first;
    if (entry.size == 6)
      u.noalias() += Map<const Matrix<double, 6, 3>>(j).transpose() * Map<const Matrix<double, 6, 1>>(v);
    else
      for (int row = 0; row < 3; ++row, j += entry.size)
        u[row] += Map<const Eigen::VectorXd>(j, entry.size).dot(Map<const Eigen::VectorXd>(v, entry.size));
  }
  return u;
}

void ImpactState::apply(int c, const Vector3d& r) {
  given_[c] += r[0];
  for (int e = band_[c]; e < band_[c + 1]; ++e) {
    const Entry& entry = entry_[e];
    const double* b = mjt_.data() + entry.values;
    double* v = v_.data() + entry.first;
    if (entry.size == 6)
      Map<Matrix<double, 6, 1>>(v).noalias() += Map<const Matrix<double, 6, 3>>(b) * r;
    else
      Map<Eigen::VectorXd>(v, entry.size) +=
          Map<const Matrix<double, Eigen::Dynamic, 3>>(b, entry.size, 3).lazyProduct(r);
  }
}

bool ImpactState::finite() const { return all_finite(v_); }

std::span<const int> ImpactState::neighbours(int c) {
  if (!has_neighbours_) {
    // Contacts of each block, then the union over the blocks of each contact.
    const BandMatrix& J = problem_->J;
    const int blocks = problem_->M.blocks();
    of_block_first_.assign(blocks + 1, 0);
    for (int b : J.block) ++of_block_first_[b + 1];
    for (int b = 0; b < blocks; ++b) of_block_first_[b + 1] += of_block_first_[b];
    of_block_.resize(J.block.size());
    mark_.assign(of_block_first_.begin(), of_block_first_.end());
    for (int i = 0; i < nc(); ++i)
      for (int e = J.band[i]; e < J.band[i + 1]; ++e) of_block_[mark_[J.block[e]]++] = i;
    mark_.assign(nc(), -1);
    neighbour_first_.assign(1, 0);
    neighbour_.clear();
    for (int i = 0; i < nc(); ++i) {
      for (int e = J.band[i]; e < J.band[i + 1]; ++e)
        for (int k = of_block_first_[J.block[e]]; k < of_block_first_[J.block[e] + 1]; ++k)
          if (mark_[of_block_[k]] != i) {
            mark_[of_block_[k]] = i;
            neighbour_.push_back(of_block_[k]);
          }
      neighbour_first_.push_back(static_cast<int>(neighbour_.size()));
    }
    has_neighbours_ = true;
  }
  return {neighbour_.data() + neighbour_first_[c],
          static_cast<std::size_t>(neighbour_first_[c + 1] - neighbour_first_[c])};
}

}  // namespace cb
