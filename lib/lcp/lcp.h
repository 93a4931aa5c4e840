#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cb {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

/// Pairs that are about one thing (a contact). Where a problem has groups its answers are judged group by group too
/// (judge.h), and what is heavy or fast hides nothing that is light or slow.
struct LcpGroups {
  std::vector<int> of_pair;  ///< n: number of the group; empty: there are none
  Eigen::VectorXd size;      ///< groups: what each is about whatever the answer, unit sqrt(z w)
  Eigen::VectorXd root;      ///< n: s_i, so that z_i s_i and w_i / s_i of a group's pairs can be compared, sqrt(z w)
  /// n: is w_i in a unit that such rows share (m/s)? Of an island their z determine each other, and so does the
  /// rounding of what their w are the sums of.
  std::vector<char> shares;
  /// n: does z_i act on its own group alone (a slip bound)? However large, it is no other's rounding.
  std::vector<char> own;
  std::vector<int> island;  ///< groups
  int islands = 0;
  /// The first so many pairs are rates of distances: w_i < 0 is an error of its own there, held against this alone
  /// (sqrt(z w)), however large the z that carry. Empty: none.
  Eigen::VectorXd before;
  /// Sets n: the sum of the terms that q_i is made of, by absolute value, in its unit. A wheel at 20 rad/s that rolls
  /// may have q of 1e-12 m/s, give or take 1e-16 m/s. Few answers ask for it. Empty: |q_i|.
  std::function<void(Eigen::VectorXd& terms)> terms;
};

/// Linear complementarity problem: find z >= 0 with w = M z + q >= 0 and z.w = 0. Two forms:
///   dense     w = M z + q
///   expanded  0 = A x + B z + a,   w = C x + D z + q,   x free, A invertible
/// that is M = D - C A^-1 B and q_dense = q - C A^-1 a. The expanded form keeps what is sparse sparse.
struct LcpProblem {
  bool expanded = false;
  Eigen::MatrixXd M;        ///< n x n, dense form
  Eigen::VectorXd q;        ///< n
  SparseMatrix A, B, C, D;  ///< nx x nx, nx x n, n x nx, n x n
  Eigen::VectorXd a;        ///< nx
  /// What the problem is about, unit sqrt(z w); residuals are fractions of it or of max |q_i| / sqrt(rho_i), whichever
  /// is larger (natural_residual). Known where loads that q does not show must be carried: a heavy body on a light one.
  double size = 0;
  LcpGroups groups;

  int n() const { return static_cast<int>(q.size()); }
  int nx() const { return expanded ? static_cast<int>(a.size()) : 0; }
};

enum class LcpStatus {
  solved,        ///< the solver believes that z solves the problem
  inaccurate,    ///< an answer is returned, but the check on the original data is worse than the tolerance
  ray,           ///< Lemke's secondary ray, checked on the original data
  nonconverged,  ///< limit of pivots or iterations reached
  cycling,       ///< a basis came back
  singular,      ///< no usable factorisation of a basis
  not_finite,    ///< NaN or infinity in the data or on the way
  memory_limit,
  unavailable  ///< the solver is not installed here
};
std::string_view name(LcpStatus status);

struct LcpSolution {
  LcpStatus status = LcpStatus::nonconverged;
  std::string reason;  ///< one line where status is not solved; every rung of a recovery ladder that was used
  Eigen::VectorXd z;   ///< n
  Eigen::VectorXd x;   ///< nx, the free unknowns (expanded form)
  int pivots = 0;      ///< pivots or iterations, summed over restarts
  int factorisations = 0;
  /// Natural residual (below) as the solver finds it; by groups, where the problem has them and that is more. Where
  /// these say what their terms are, without what the last bits of the data leave open (judge.h).
  double residual = std::numeric_limits<double>::infinity();
  double peak_memory_mb = 0;  ///< of the solver's own tables, where it measures them (ynl)
};

/// What every LCP solver understands; a solver ignores what it has no use for.
struct LcpOptions {
  double tolerance = 1e-10;       ///< accepted natural residual, -; looser: more answers are believed
  int pivot_limit = 0;            ///< 0: 50 (n + nx) + 1000
  double memory_limit_mb = 1024;  ///< tables of a search; beyond: memory_limit
  /// Largest n at which the dense kernel serves an expanded problem too (measured: bench/lcp).
  int dense_limit = 100;
};

/// Natural residual of z on the original data, scaled row by row without letting a huge z hide an error:
///   max_i | min(z_i s_i, w_i / s_i) | / max(size, max_i |q_i| / s_i),   s_i = sqrt(rho_i), rho_i = |M_ii| or, where
///   that is zero,
/// from the coupling (lcp/scaling.h). Dimensionless, unchanged by a change of units; see lcp.cpp.
double natural_residual(const LcpProblem& problem, const Eigen::VectorXd& z);

/// The dense form of an expanded problem; `dense` keeps its storage. False where A is singular.
bool condense(const LcpProblem& problem, LcpProblem& dense);
/// x = -A^-1 (B z + a), refined once. False where A is singular.
bool recover_free(const LcpProblem& problem, const Eigen::VectorXd& z, Eigen::VectorXd& x);

/// A solver that owns its scratch; throws nothing but Stopped (linalg/stop.h) and bad_alloc.
using LcpSolver = std::function<void(const LcpProblem& problem, LcpSolution& solution)>;

struct LcpSolverRow {
  std::string_view name;
  std::string_view summary;
  std::string_view source;
  std::string_view unavailable;  ///< why it cannot be used here; empty where it can
  LcpSolver (*make)(const LcpOptions& options);
};

/// All LCP solvers: the one table that `ap`, `solve`, `list` and the tests read.
std::span<const LcpSolverRow> lcp_solvers();
const LcpSolverRow* find_lcp_solver(std::string_view name);

/// Rows, one a file (lcp/lemke.cpp, ...).
LcpSolverRow lemke_row();
LcpSolverRow path_row();
LcpSolverRow path_library_row();
LcpSolverRow pgs_row();
LcpSolverRow ynl_row();

}  // namespace cb
