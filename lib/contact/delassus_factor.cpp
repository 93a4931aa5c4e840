// What: W = J J^T for a Delassus matrix that comes without its bodies, so that files with W and q only can be solved by
//   the methods that want M and J (M = 1, unknowns sqrt(kg) m/s).
// Problem: W is 3 nc x 3 nc (1/kg), symmetric, positive semidefinite, usually singular; q is 3 nc (m/s).
// Method: contacts with the same neighbours form a group (an interface of a stack). Groups are eliminated one by one in
//   a minimum-degree order: block Cholesky, where the pivot block of a group is split by its eigendecomposition, which
//   shows its rank. A group's columns of J then touch only the group and the neighbours it has left, so a chain of
//   bodies gives J the sparsity that its true Jacobian has. Everything is done on W scaled to w_i = trace(W_ii)/3 = 1,
//   and checked: where W - J J^T is not at rounding, the connected part is factored again by its full
//   eigendecomposition, which is slower, dense, and as exact as W allows.
// v_minus: the v of least norm with J v = q, by Tikhonov steps (J^T J + d) dv = J^T (q - J v), with the smallest d that
//   keeps its kinetic energy within a bound: parts of q that only directions of nearly no mobility could explain (data
//   with few digits) stay in the offset, where they are exact. v_minus matters to nobody's impulses; it gives the
//   energy before the event, to which tolerances refer, its size.
// Source: our own; block elimination after any textbook.
// Fails (returns a message): W_ii without mobility, an eigenvalue that is clearly negative, a part too large for the
//   eigendecomposition where that is needed.
#include "contact/delassus_factor.h"

#include <Eigen/Eigenvalues>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "linalg/stop.h"

namespace cb {

namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double tikhonov_first = 1e-8;  // d above, against a scaled J^T J
constexpr double tikhonov_growth = 100;  // from one d to the next
constexpr double tikhonov_last = 1;
constexpr int tikhonov_steps = 6;
constexpr double energy_bound = 100;  // kinetic energy of v_minus over that of the contacts one by one, sum q^2 / (2 w)

// One block of columns of J: dense rows of some contacts.
struct Columns {
  int rank = 0;
  std::vector<std::pair<int, MatrixXd>> rows;  // contact, 3 x rank
};

// The neighbours of each contact in W, itself among them, ascending.
std::vector<std::vector<int>> neighbours(const Sparse& W, int nc) {
  std::vector<std::vector<int>> out(nc);
  for (int j = 0; j < W.outerSize(); ++j)
    for (Sparse::InnerIterator it(W, j); it; ++it)
      if (it.value() != 0) out[j / 3].push_back(static_cast<int>(it.row()) / 3);
  for (auto& list : out) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return out;
}

// Connected parts: index of each contact's part, numbered by first contact.
std::vector<int> parts(const std::vector<std::vector<int>>& next, int& count) {
  std::vector<int> part(next.size(), -1), stack;
  count = 0;
  for (int c = 0; c < static_cast<int>(next.size()); ++c) {
    if (part[c] >= 0) continue;
    stack.assign(1, c);
    part[c] = count;
    while (!stack.empty()) {
      const int at = stack.back();
      stack.pop_back();
      for (const int to : next[at])
        if (part[to] < 0) {
          part[to] = count;
          stack.push_back(to);
        }
    }
    ++count;
  }
  return part;
}

// Splits S = V L V^T into kept directions (eigenvalue above `tolerance`); false where one is below -tolerance.
bool split(const MatrixXd& S, double tolerance, MatrixXd& V, VectorXd& lambda) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(S);
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()[0] < -tolerance) return false;
  const auto n = S.rows();
  Eigen::Index drop = 0;
  while (drop < n && eigen.eigenvalues()[drop] <= tolerance) ++drop;
  V = eigen.eigenvectors().rightCols(n - drop);
  lambda = eigen.eigenvalues().tail(n - drop);
  return true;
}

// Sparse elimination of all parts at once; the result per group is filed under the part it belongs to.
// `failed` marks parts whose pivot was clearly negative.
void eliminate(const Sparse& W, const std::vector<std::vector<int>>& next, const std::vector<int>& part,
               const DelassusFactorOptions& options, std::vector<std::vector<Columns>>& out,
               std::vector<bool>& failed) {
  const int nc = static_cast<int>(next.size());
  std::map<std::vector<int>, int> known;
  std::vector<int> group(nc);
  std::vector<std::vector<int>> member;
  for (int c = 0; c < nc; ++c) {
    const auto [at, fresh] = known.try_emplace(next[c], static_cast<int>(member.size()));
    if (fresh) member.emplace_back();
    group[c] = at->second;
    member[at->second].push_back(c);
  }
  const int groups = static_cast<int>(member.size());
  std::vector<int> place(nc);  // of a contact within its group
  for (const auto& list : member)
    for (int i = 0; i < static_cast<int>(list.size()); ++i) place[list[i]] = i;

  // Schur complement by rows of groups: full pattern, so that a row lists all its neighbours.
  std::vector<std::map<int, MatrixXd>> S(groups);
  for (int j = 0; j < W.outerSize(); ++j)
    for (Sparse::InnerIterator it(W, j); it; ++it) {
      if (it.value() == 0) continue;
      const int ci = static_cast<int>(it.row()) / 3, cj = j / 3;
      auto& block = S[group[ci]][group[cj]];
      if (block.size() == 0)
        block.setZero(3 * static_cast<Eigen::Index>(member[group[ci]].size()),
                      3 * static_cast<Eigen::Index>(member[group[cj]].size()));
      block(3 * place[ci] + it.row() % 3, 3 * place[cj] + j % 3) = it.value();
    }

  std::vector<Eigen::Triplet<double>> pattern;
  for (int g = 0; g < groups; ++g)
    for (const auto& [h, block] : S[g]) pattern.emplace_back(g, h, 1.0);
  Sparse graph(groups, groups);
  graph.setFromTriplets(pattern.begin(), pattern.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(graph, order);

  MatrixXd V;
  VectorXd lambda;
  for (int step = 0; step < groups; ++step) {
    poll_stop();
    const int g = order.indices()[step];
    const int owner = part[member[g][0]];
    if (failed[owner]) continue;
    const auto own = S[g].find(g);
    if (own == S[g].end()) continue;
    if (!split(own->second, options.rank_tolerance, V, lambda)) {
      failed[owner] = true;
      continue;
    }
    const MatrixXd root = V * lambda.cwiseSqrt().asDiagonal();
    const MatrixXd inverse_root = V * lambda.cwiseSqrt().cwiseInverse().asDiagonal();
    Columns columns;
    columns.rank = static_cast<int>(lambda.size());
    std::vector<std::pair<int, MatrixXd>> below;
    for (const auto& [h, block] : S[g])
      if (h != g) below.emplace_back(h, S[h][g] * inverse_root);
    const auto file_rows = [&](int h, const MatrixXd& rows) {
      for (int i = 0; i < static_cast<int>(member[h].size()); ++i)
        columns.rows.emplace_back(member[h][i], rows.middleRows(3 * i, 3));
    };
    file_rows(g, root);
    for (const auto& [h, rows] : below) file_rows(h, rows);
    for (const auto& [h, rows_h] : below)
      for (const auto& [k, rows_k] : below) {
        auto& block = S[h][k];
        if (block.size() == 0) block.setZero(rows_h.rows(), rows_k.rows());
        block.noalias() -= rows_h * rows_k.transpose();
      }
    for (const auto& [h, rows] : below) S[h].erase(g);
    S[g].clear();
    if (columns.rank > 0) out[owner].push_back(std::move(columns));
  }
}

// W - J J^T of one part, largest entry.
double error_of(const Sparse& W, const std::vector<int>& part, int p, const std::vector<Columns>& columns) {
  std::map<std::pair<int, int>, Eigen::Matrix3d> rest;
  const auto at = [&](int i, int j) -> Eigen::Matrix3d& {
    return rest.try_emplace({i, j}, Eigen::Matrix3d::Zero()).first->second;
  };
  for (int j = 0; j < W.outerSize(); ++j)
    if (part[j / 3] == p)
      for (Sparse::InnerIterator it(W, j); it; ++it)
        at(static_cast<int>(it.row()) / 3, j / 3)(it.row() % 3, j % 3) += it.value();
  for (const Columns& block : columns)
    for (const auto& [i, rows_i] : block.rows)
      for (const auto& [j, rows_j] : block.rows) at(i, j).noalias() -= rows_i * rows_j.transpose();
  double worst = 0;
  for (const auto& [where, block] : rest) worst = std::max(worst, block.cwiseAbs().maxCoeff());
  return worst;
}

std::string shown(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

// The part's full eigendecomposition; negative eigenvalues down to the tolerance are set to zero.
std::string decompose(const Sparse& W, const std::vector<int>& contacts, const DelassusFactorOptions& options,
                      std::vector<Columns>& columns, DelassusFactorReport& report, double& error) {
  const auto n = 3 * static_cast<Eigen::Index>(contacts.size());
  if (n > options.dense_rows)
    return "W couples " + std::to_string(n) + " rows and is not positive semidefinite to rounding; a part of at most " +
           std::to_string(options.dense_rows) + " rows can be repaired";
  std::map<int, int> place;
  for (int i = 0; i < static_cast<int>(contacts.size()); ++i) place[contacts[i]] = i;
  MatrixXd dense = MatrixXd::Zero(n, n);
  for (const int c : contacts)
    for (int j = 3 * c; j < 3 * c + 3; ++j)
      for (Sparse::InnerIterator it(W, j); it; ++it)
        dense(3 * place[static_cast<int>(it.row()) / 3] + it.row() % 3, 3 * place[c] + j % 3) = it.value();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(dense);
  if (eigen.info() != Eigen::Success) return "the eigenvalues of W cannot be computed";
  const VectorXd& lambda = eigen.eigenvalues();
  const double largest = lambda[n - 1];
  const double negative = std::max(0.0, -lambda[0]) / largest;
  report.most_negative = std::max(report.most_negative, negative);
  if (!(negative <= options.negative_tolerance))
    return "W is not positive semidefinite: its smallest eigenvalue is -" + shown(negative) + " of its largest";
  const double rounding = 4e-16 * static_cast<double>(n) * largest;
  Eigen::Index drop = 0;
  while (drop < n && lambda[drop] <= rounding) ++drop;
  const MatrixXd root = eigen.eigenvectors().rightCols(n - drop) * lambda.tail(n - drop).cwiseSqrt().asDiagonal();
  error = (dense - root * root.transpose()).cwiseAbs().maxCoeff();
  columns.assign(1, Columns{});
  columns[0].rank = static_cast<int>(n - drop);
  for (int i = 0; i < static_cast<int>(contacts.size()); ++i)
    columns[0].rows.emplace_back(contacts[i], root.middleRows(3 * i, 3));
  report.dense = true;
  return "";
}

// v_minus of least norm with J v = q as far as J explains it, and the offset that completes it.
void split_velocity(std::span<const double> q, const VectorXd& scale, ContactProblem& problem) {
  const int nv = problem.nv(), rows = 3 * problem.nc();
  std::vector<Eigen::Triplet<double>> triplets;
  for (int c = 0; c < problem.nc(); ++c)
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const auto entry = problem.J.entry(e);
      const int first = problem.M.first[problem.J.block[e]];
      for (int j = 0; j < entry.cols(); ++j)
        for (int i = 0; i < 3; ++i) triplets.emplace_back(3 * c + i, first + j, entry(i, j) / scale[c]);
    }
  Sparse J(rows, nv);
  J.setFromTriplets(triplets.begin(), triplets.end());
  VectorXd rest(rows), v = VectorXd::Zero(nv);
  for (int i = 0; i < rows; ++i) rest[i] = q[i] / scale[i / 3];
  const VectorXd target = rest;
  const Sparse normal = J.transpose() * J;
  Sparse unit(nv, nv);
  unit.setIdentity();
  for (double d = tikhonov_first; d <= tikhonov_last; d *= tikhonov_growth) {
    const Eigen::SimplicialLDLT<Sparse> factor(normal + d * unit);
    v.setZero();
    rest = target;
    for (int step = 0; step < tikhonov_steps && factor.info() == Eigen::Success; ++step) {
      v += factor.solve(J.transpose() * rest);
      rest = target - J * v;
    }
    if (v.squaredNorm() <= energy_bound * target.squaredNorm()) break;
  }
  if (!v.allFinite()) v.setZero();
  problem.v_minus.assign(v.data(), v.data() + nv);
  problem.offset.resize(rows);
  multiply(problem.J, problem.M, problem.v_minus, problem.offset);
  for (int i = 0; i < rows; ++i) problem.offset[i] = q[i] - problem.offset[i];
}

}  // namespace

std::string factor_delassus(const Sparse& W, std::span<const double> q, const DelassusFactorOptions& options,
                            ContactProblem& problem, DelassusFactorReport& report) {
  const int nc = static_cast<int>(W.rows()) / 3;
  report = {};

  // Scale to unit contacts.
  VectorXd scale(nc);
  for (int c = 0; c < nc; ++c) {
    const double w = (W.coeff(3 * c, 3 * c) + W.coeff(3 * c + 1, 3 * c + 1) + W.coeff(3 * c + 2, 3 * c + 2)) / 3;
    if (!(w > 0))
      return "contact " + std::to_string(c) + " has no mobility (the diagonal block of W has trace " + shown(3 * w) +
             "); both its sides are fixed";
    scale[c] = std::sqrt(w);
  }
  Sparse scaled = W;  // NOLINT(performance-unnecessary-copy-initialization): valueRef() changes it
  for (int j = 0; j < scaled.outerSize(); ++j)
    for (Sparse::InnerIterator it(scaled, j); it; ++it) it.valueRef() /= scale[it.row() / 3] * scale[j / 3];

  // Factor sparse, check, and repair the parts where that was not good enough.
  const auto next = neighbours(scaled, nc);
  int count = 0;
  const std::vector<int> part = parts(next, count);
  std::vector<std::vector<Columns>> columns(count);
  std::vector<bool> failed(count, false);
  eliminate(scaled, next, part, options, columns, failed);
  for (int p = 0; p < count; ++p) {
    double error = failed[p] ? 1 : error_of(scaled, part, p, columns[p]);
    if (!(error <= options.sparse_error)) {
      std::vector<int> contacts;
      for (int c = 0; c < nc; ++c)
        if (part[c] == p) contacts.push_back(c);
      const std::string reason = decompose(scaled, contacts, options, columns[p], report, error);
      if (!reason.empty()) return reason;
    }
    report.error = std::max(report.error, error);
  }

  // M = 1, J = scale * columns, band by band with ascending blocks.
  problem.M.clear();
  problem.J.clear();
  std::vector<std::vector<std::pair<int, const MatrixXd*>>> rows_of(nc);
  for (const auto& list : columns)
    for (const Columns& block : list) {
      const int b = problem.M.add_block(block.rank);
      problem.M.block(b).setIdentity();
      report.rank += block.rank;
      for (const auto& [c, rows] : block.rows) rows_of[c].emplace_back(b, &rows);
    }
  for (int c = 0; c < nc; ++c) {
    problem.J.add_band();
    for (const auto& [b, rows] : rows_of[c]) {
      const int e = problem.J.add_entry(b, static_cast<int>(rows->cols()));
      problem.J.entry(e) = scale[c] * *rows;
    }
  }
  split_velocity(q, scale, problem);
  return "";
}

}  // namespace cb
