#pragma once

#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "linalg/block_matrix.h"

namespace cb {

/// Contact with exact Coulomb friction, a nonlinear complementarity problem over friction cones, contact by contact
/// (rows n, t1, t2 of J):
///   v = v0 + M^-1 J^T r,     u = J v + w,     u~ = u + mu |u_t| e_n                    (De Saxce and Feng, 1998)
///   r in K = { |r_t| <= mu r_n },    u~ in K* = { mu |x_t| <= x_n },    r.u~ = 0                             (1)
/// that is 0 <= r_n _|_ u_n >= 0; |r_t| <= mu r_n; and where u_t != 0 friction is mu r_n against it. mu = 0 leaves a
/// scalar row: r_t = 0, u_t free (a joint at its limit has zero tangential rows besides). What restitution asks of u_n
/// is in w. Every problem whose contacts may all be held apart has an answer; r is not unique as a rule, and v+ may not
/// be. Views only: the caller keeps the data alive.
struct NcpProblem {
  const BlockDiagonalMatrix* M = nullptr;  ///< nv x nv, symmetric positive definite
  const BlockCholesky* factor = nullptr;   ///< of M
  const BandMatrix* J = nullptr;           ///< 3 nc x nv
  std::span<const double> v0;              ///< nv, velocity before
  std::span<const double> offset;          ///< 3 nc, w in m/s
  std::span<const double> mu;              ///< nc, >= 0
  std::span<const double> weight;          ///< nc, 1/kg, > 0: a typical diagonal entry of W_ii; scales, and no more
  std::span<const double> start;           ///< 3 nc, N s: impulses to begin with (of the event before); empty: none

  int nc() const { return J->bands(); }
  int nv() const { return M->order(); }
};

enum class NcpStatus {
  solved,        ///< natural residual within the tolerance, or at rounding
  inaccurate,    ///< an answer to go on with, beyond the tolerance: the sweeps that were asked for are done
  nonconverged,  ///< limit of iterations, or no progress; r is the best that was met
  singular,      ///< a system could not be factored, from no start
  not_finite     ///< NaN or infinity in the data, or on the way
};
std::string_view name(NcpStatus status);

struct NcpSolution {
  NcpStatus status = NcpStatus::nonconverged;
  std::string reason;     ///< one line where status is not solved
  std::vector<double> r;  ///< 3 nc, N s; always written, and finite
  std::vector<double> u;  ///< 3 nc, m/s, after r
  int iterations = 0;     ///< factorisations, sweeps: whatever takes the solver's time
  double residual = 0;    ///< -, natural residual of r as the solver finds it (NcpMeasure)
  std::string_view who;   ///< which of several attempts answered, of a name that stays; empty where there is one
  void clear();           ///< memory is kept
};

/// What every solver understands; a solver ignores what it has no use for.
struct NcpOptions {
  double tolerance = 1e-12;  ///< natural residual at which a solver may stop, -; looser: answers are less sharp
  /// -: natural residual, beside rounding, up to which the best answer counts as solved. The referee accepts 1e-9.
  double accepted = 1e-10;
  int sweeps = 0;         ///< nsgs: sweeps after which it ends as it is; 0: until the tolerance
  double relaxation = 1;  ///< nsgs: r <- r + relaxation (answer of the contact - r), in (0, 2)
};

/// The natural map of one contact, r - P_K(r - u~ / w), in N s; zero where (1) holds. P_K: projection on K.
void natural_map(const double* r, const double* u, double mu, double weight, double* out);
/// Projection of x on K.
void project_on_friction_cone(const double* x, double mu, double* out);

/// Natural residual on the problem's own data, contact by contact (docs/judging.md, law `coulomb`):
///   max_c sqrt(w) |natural map| / S_c,    S_c = max(sqrt(w) |r|, |u| / sqrt(w), |q| / sqrt(w)),   q = J v0 + w
/// and, since impulses may grow without end where there is no answer, -u_n / sqrt(w) over sqrt(sum |q|^2 / w). Neither
/// is less than rounding of J v0 + w by itself makes a size of, where the residual is not at rounding without.
/// Owns its scratch.
class NcpMeasure {
 public:
  /// q of this problem, which must stay alive.
  void begin(const NcpProblem& problem);
  /// u = J (v0 + M^-1 J^T r) + w, afresh.
  void velocities(std::span<const double> r, std::vector<double>& v, std::vector<double>& u);
  double residual(std::span<const double> r, std::span<const double> u);
  /// The same with the sizes of the referee's second look: what velocities are small sums of counts, and what the
  /// last bits of the data leave open is no error.
  double residual_beside_rounding(std::span<const double> r, std::span<const double> u);
  const std::vector<double>& q() const { return q_; }    ///< 3 nc, m/s
  double size_before() const { return std::sqrt(q2_); }  ///< sqrt(J), of q

 private:
  void find_changes(std::span<const double> r, std::span<const double> u);
  void find_floors();
  double worst_of(std::span<const double> r, std::span<const double> u) const;

  const NcpProblem* problem_ = nullptr;
  double q2_ = 0;               // J, sum |q|^2 / w
  std::vector<double> floor2_;  // nc, J: what rounding of the data makes of a contact's size; empty: not asked for yet
  std::vector<double> q_, changes_, stops_, columns_, open_, terms_;
  std::vector<double> limit2_;  // nc, (m/s)^2 or (rad/s)^2: what stopping all would make of a limit's u; -1: no limit
};

/// A solver that owns its scratch; throws nothing but Stopped (linalg/stop.h) and bad_alloc. It writes the whole of
/// `solution`, and calls solved what NcpMeasure confirms.
using NcpSolver = std::function<void(const NcpProblem& problem, NcpSolution& solution)>;

struct NcpSolverRow {
  std::string_view name;
  std::string_view summary;
  std::string_view source;
  NcpSolver (*make)(const NcpOptions& options);
};

/// All solvers: the one table that `coulomb`, `list` and the tests read. The first is the default.
std::span<const NcpSolverRow> ncp_solvers();
const NcpSolverRow* find_ncp_solver(std::string_view name);

/// Rows, one a file (ncp/nsgs.cpp, ...).
NcpSolverRow newton_ncp_row();
NcpSolverRow nsgs_row();
NcpSolverRow bisection_row();
NcpSolverRow admm_row();
NcpSolverRow cascade_row();

}  // namespace cb
