// The matrices and vectors of Anitescu and Potra's LCP.
//
// Problem: that of anitescu_potra.cpp, of a contact problem with nc contacts, in the two forms that LCP solvers take
// (lcp/lcp.h): dense, with v+ eliminated by W = J M^-1 J^T; expanded, with what the impulses add to the velocity,
// x = v+ - v-, as free unknowns. With x = v+ the load of an island at rest or rolling, u- of 1e-16 on v- of 1, would
// have to be found as their difference.
// Source: Anitescu and Potra (1997); the forms are this program's own.
// Does not fail: what is no number or singular goes on to the LCP solver, which refuses it.

#include "methods/polygon_lcp.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

using ConstVec3 = Eigen::Map<const Eigen::Vector3d>;

/// -: an entry of W below this fraction of what its two contacts have in other directions is rounding.
constexpr double entry_rounding = 1e-15;

// T = -B^T, in the memory that T has.
void negate_transposed(const SparseMatrix& B, SparseMatrix& T) {
  T.resize(B.cols(), B.rows());
  T.resizeNonZeros(B.nonZeros());
  int* start = T.outerIndexPtr();
  std::fill_n(start, B.rows() + 1, 0);
  for (Eigen::Index e = 0; e < B.nonZeros(); ++e) ++start[B.innerIndexPtr()[e] + 1];
  for (Eigen::Index i = 0; i < B.rows(); ++i) start[i + 1] += start[i];
  // Each start moves to its end while its column fills, and is the next one's start then.
  for (int j = 0; j < B.cols(); ++j)
    for (SparseMatrix::InnerIterator it(B, j); it; ++it) {
      const int at = start[it.row()]++;
      T.innerIndexPtr()[at] = j;
      T.valuePtr()[at] = -it.value();
    }
  for (Eigen::Index i = B.rows(); i > 0; --i) start[i] = start[i - 1];
  start[0] = 0;
}

void copy_blocks(const BlockDiagonalMatrix& M, SparseMatrix& A) {
  A.resize(M.first.back(), M.first.back());
  A.setZero();
  for (int b = 0; b < M.blocks(); ++b)
    for (int j = 0; j < M.block_size(b); ++j) {
      const int first = M.first[b];
      A.startVec(first + j);
      for (int i = 0; i < M.block_size(b); ++i) A.insertBack(first + i, first + j) = M.block(b)(i, j);
    }
  A.finalize();
}

// What an event with contact velocities u is about, sqrt(J): the fastest, were all of it the heaviest body's. A heavy
// body that rests on a light one shows in the impulses, but not in the vectors of the LCP. Adding up sqrt(kinetic
// energies) instead would not be the same in a moving frame.
double size_of(const ContactProblem& problem, std::span<const double> u) {
  const BandMatrix& J = problem.J;
  double lightest = HUGE_VAL;  // 1/kg: least inverse inertia along a normal, of one side of a contact
  for (int e = 0; e < J.band.back(); ++e) {
    const auto entry = J.entry(e);
    const auto M = problem.M.block(J.block[e]);
    double inverse = 0;
    for (int i = 0; i < entry.cols(); ++i) inverse += entry(0, i) * entry(0, i) / M(i, i);
    if (inverse > 0) lightest = std::min(lightest, inverse);
  }
  double fastest = 0;
  for (const double x : u) fastest = std::max(fastest, std::abs(x));
  return fastest / std::sqrt(lightest);
}

}  // namespace

void PolygonLcp::begin(const ContactProblem& problem, bool all) {
  nc_ = problem.nc();
  rough_.clear();
  for (int c = 0; c < nc_; ++c)
    if (all || problem.mu[c] != 0) rough_.push_back(c);
}

// Where a robot's joints do not let a contact move along a direction, W has 1e-17 of what its other directions have.
// Scaled up as a pair of its own, such a row would be noise that bases are made of.
void PolygonLcp::drop_rounding() {
  row_scale_.resize(3 * nc_);
  for (int c = 0; c < nc_; ++c) row_scale_.segment<3>(3 * c).setConstant(W_.diagonal().segment<3>(3 * c).sum());
  row_scale_ = row_scale_.sqrt();
  for (int j = 0; j < 3 * nc_; ++j) {
    const double scale = entry_rounding * row_scale_[j];
    auto column = W_.col(j).array();
    column = (column.abs() <= scale * row_scale_).select(0.0, column);
  }
}

void PolygonLcp::build_dense(const ContactProblem& problem, const BlockCholesky& factor) {
  const PolygonUnknowns at = this->at();
  const int nc = nc_, k = at.k, n = at.count();
  delassus(problem, factor, W_);
  drop_rounding();
  weight_.resize(nc);
  for (int c = 0; c < nc; ++c) {
    const double normal = W_(3 * c, 3 * c), tangential = W_(3 * c + 1, 3 * c + 1) + W_(3 * c + 2, 3 * c + 2);
    weight_[c] = tangential > 0 ? (normal + tangential) / 3 : normal;
  }
  lcp_.expanded = false;
  lcp_.M.resize(n, n);
  lcp_.M.setZero();
  auto& M = lcp_.M;
  // What an impulse at contact j makes of all contacts: along its normal (b < 0), or its direction b.
  const auto fill = [&](int column, int j, int b) {
    double* m = M.data() + std::size_t(column) * n;
    const double* Wn = W_.data() + std::size_t(3 * j) * (3 * nc);
    const double *W1 = Wn + 3 * nc, *W2 = W1 + 3 * nc;
    const double c = b < 0 ? 0 : at.cosine[b], s = b < 0 ? 0 : at.sine[b];
    const auto u = [&](int row) { return b < 0 ? Wn[row] : c * W1[row] + s * W2[row]; };
    for (int i = 0; i < nc; ++i) m[i] = u(3 * i);
    for (int f = 0; f < at.rough_count(); ++f) {
      const double u1 = u(3 * rough_[f] + 1), u2 = u(3 * rough_[f] + 2);
      for (int a = 0; a < k; ++a) m[at.first_direction(f) + a] = at.cosine[a] * u1 + at.sine[a] * u2;
    }
  };
  for (int j = 0; j < nc; ++j) fill(j, j, -1);
  for (int f = 0; f < at.rough_count(); ++f) {
    M(at.slip_bound(f), rough_[f]) = problem.mu[rough_[f]];
    for (int b = 0; b < k; ++b) {
      fill(at.first_direction(f) + b, rough_[f], b);
      M(at.slip_bound(f), at.first_direction(f) + b) = -1;
      M(at.first_direction(f) + b, at.slip_bound(f)) = 1;
    }
  }
  if (regularise_ != 0) M.diagonal().array() += regularise_;
}

void PolygonLcp::build_expanded(const ContactProblem& problem, const BlockCholesky& factor) {
  const int n = at().count();
  contact_weights(problem, factor, weight_);
  lcp_.expanded = true;
  copy_blocks(problem.M, lcp_.A);
  lcp_.B.resize(problem.nv(), n);
  lcp_.B.setZero();
  lcp_.D.resize(n, n);
  lcp_.D.setZero();
  add_normal_columns(problem);
  add_friction_columns(problem);
  lcp_.B.finalize();
  lcp_.D.finalize();
  negate_transposed(lcp_.B, lcp_.C);
}

// A column of B: minus what an impulse at contact c along `direction` (n, t1, t2) does to the momentum.
void PolygonLcp::band(const ContactProblem& problem, int c, int column, const Eigen::Vector3d& direction) {
  lcp_.B.startVec(column);
  for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
    const auto entry = problem.J.entry(e);
    const int first = problem.M.first[problem.J.block[e]];
    for (int i = 0; i < entry.cols(); ++i)
      lcp_.B.insertBack(first + i, column) =
          -(direction[0] * entry(0, i) + direction[1] * entry(1, i) + direction[2] * entry(2, i));
  }
}

void PolygonLcp::diagonal(int row) {
  if (regularise_ != 0) lcp_.D.insertBack(row, row) = regularise_;
}

void PolygonLcp::add_normal_columns(const ContactProblem& problem) {
  const PolygonUnknowns at = this->at();
  for (int c = 0, f = 0; c < nc_; ++c) {
    band(problem, c, c, {1, 0, 0});
    lcp_.D.startVec(c);
    diagonal(c);
    if (f < at.rough_count() && rough_[f] == c) lcp_.D.insertBack(at.slip_bound(f++), c) = problem.mu[c];
  }
}

void PolygonLcp::add_friction_columns(const ContactProblem& problem) {
  const PolygonUnknowns at = this->at();
  for (int f = 0; f < at.rough_count(); ++f)
    for (int b = 0; b < at.k; ++b) {
      const int column = at.first_direction(f) + b;
      band(problem, rough_[f], column, {0, at.cosine[b], at.sine[b]});
      lcp_.D.startVec(column);
      diagonal(column);
      lcp_.D.insertBack(at.slip_bound(f), column) = -1;
    }
  for (int f = 0; f < at.rough_count(); ++f) {
    const int column = at.slip_bound(f);
    lcp_.B.startVec(column);
    lcp_.D.startVec(column);
    for (int a = 0; a < at.k; ++a) lcp_.D.insertBack(at.first_direction(f) + a, column) = 1;
    diagonal(column);
  }
}

void PolygonLcp::set_load(const ContactProblem& problem, std::span<const double> u, std::span<const double> bound) {
  const PolygonUnknowns at = this->at();
  lcp_.q.resize(at.count());
  lcp_.size = problem.M.blocks() > 1 ? size_of(problem, u) : 0;
  if (lcp_.expanded) lcp_.a.setZero(problem.nv());
  for (int c = 0; c < nc_; ++c) lcp_.q[c] = u[3 * c];
  for (int f = 0; f < at.rough_count(); ++f) {
    const double* along = &u[3 * rough_[f]];
    for (int a = 0; a < at.k; ++a) lcp_.q[at.first_direction(f) + a] = at.cosine[a] * along[1] + at.sine[a] * along[2];
    lcp_.q[at.slip_bound(f)] = bound[rough_[f]];
  }
}

// Whatever the answer, a contact is about the velocities of all contacts of its island before the event: the fastest
// were it this one's, but no more than all of them together (contact/referee.cpp).
void PolygonLcp::group_by_contact(const ContactProblem& problem, const BlockCholesky& factor,
                                  std::span<const double> u) {
  const PolygonUnknowns at = this->at();
  LcpGroups& groups = lcp_.groups;
  groups.of_pair.resize(at.count());
  groups.root.resize(at.count());
  groups.shares.assign(at.count(), 0);
  groups.own.assign(at.count(), 0);
  groups.size.resize(nc_);
  groups.before.resize(nc_);
  find_islands(problem, islands_);
  groups.island = islands_.of_contact;
  groups.islands = islands_.count;
  of_island_.assign(islands_.count, {0, 0});
  bool limits = false;
  for (int c = 0; c < nc_; ++c) {
    const bool limit = is_limit(problem, c);  // its velocity may be in rad/s
    const double u2 = ConstVec3(&u[3 * c]).squaredNorm();
    auto& [all, fastest] = of_island_[islands_.of_contact[c]];
    if (!limit) fastest = std::max(fastest, u2);
    all += u2 / weight_[c];
    groups.of_pair[c] = c;
    groups.root[c] = std::sqrt(weight_[c]);
    groups.shares[c] = !limit;
    limits = limits || limit;
  }
  if (limits) find_stops(problem, factor, u);
  for (int c = 0; c < nc_; ++c) {
    const auto [all, fastest] = of_island_[islands_.of_contact[c]];
    const double own = groups.shares[c] ? fastest : stopping2(problem, c);
    groups.before[c] = std::sqrt(all);
    groups.size[c] = std::sqrt(std::min(all, std::max(own, ConstVec3(&u[3 * c]).squaredNorm()) / weight_[c]));
  }
  groups.terms = [this, &problem](Eigen::VectorXd& terms) { find_terms(problem, terms); };
  for (int f = 0; f < at.rough_count(); ++f) {
    const int c = rough_[f], first = at.first_direction(f);
    std::fill_n(&groups.of_pair[first], at.k, c);
    std::fill_n(&groups.root[first], at.k, groups.root[c]);
    std::fill_n(&groups.shares[first], at.k, groups.shares[c]);
    groups.of_pair[at.slip_bound(f)] = c;
    groups.own[at.slip_bound(f)] = 1;
    groups.root[at.slip_bound(f)] = 1 / groups.root[c];
  }
}

// |J| |v-| + |w|, along the directions that rows have. What compression added before the second phase is not counted:
// less is excused there.
void PolygonLcp::find_terms(const ContactProblem& problem, Eigen::VectorXd& of_row) {
  const PolygonUnknowns at = this->at();
  const BandMatrix& J = problem.J;
  of_contact_.resize(3, nc_);
  for (int c = 0; c < nc_; ++c) {
    Eigen::Vector3d terms = ConstVec3(&problem.offset[3 * c]).cwiseAbs();
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const auto entry = J.entry(e);
      terms +=
          entry.cwiseAbs() *
          Eigen::Map<const Eigen::VectorXd>(&problem.v_minus[problem.M.first[J.block[e]]], entry.cols()).cwiseAbs();
    }
    of_contact_.col(c) = terms;
  }
  of_row.setZero(at.count());
  of_row.head(nc_) = of_contact_.row(0);
  for (int f = 0; f < at.rough_count(); ++f) {
    const double t1 = of_contact_(1, rough_[f]), t2 = of_contact_(2, rough_[f]);
    for (int a = 0; a < at.k; ++a)
      of_row[at.first_direction(f) + a] = std::abs(at.cosine[a]) * t1 + std::abs(at.sine[a]) * t2;
  }
}

// |M^-1 J^T| |u| / w: what stopping all contacts may change.
void PolygonLcp::find_stops(const ContactProblem& problem, const BlockCholesky& factor, std::span<const double> u) {
  const BandMatrix& J = problem.J;
  stops_.assign(problem.nv(), 0.0);
  for (int c = 0; c < nc_; ++c)
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const int b = J.block[e], n = problem.M.block_size(b);
      columns_ = J.entry(e).transpose();
      factor.solve_block_in_place(b, columns_.data(), 3);
      Eigen::Map<Eigen::VectorXd>(&stops_[problem.M.first[b]], n) +=
          columns_.cwiseAbs() * (ConstVec3(&u[3 * c]).cwiseAbs() / weight_[c]);
    }
}

// Square of what that makes of a limit's own velocity.
double PolygonLcp::stopping2(const ContactProblem& problem, int limit) const {
  const BandMatrix& J = problem.J;
  double velocity = 0;
  for (int e = J.band[limit]; e < J.band[limit + 1]; ++e)
    for (int j = 0; j < J.entry(e).cols(); ++j)
      velocity += std::abs(J.entry(e)(0, j)) * stops_[problem.M.first[J.block[e]] + j];
  return velocity * velocity;
}

}  // namespace cb
