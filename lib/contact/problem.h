#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "contact/witness.h"
#include "linalg/block_matrix.h"

namespace cb {

/// One impulsive contact event: everything that a contact model may know (docs/judging.md, "One event").
///   v+ = v- + M^-1 J^T r        u+ = J v+ + w
/// Plain data; no method sees a body, a shape, a clock or a file.
struct ContactProblem {
  BlockDiagonalMatrix M;            ///< nv x nv, symmetric positive definite, one block a tree of bodies
  BandMatrix J;                     ///< 3 nc x nv; rows n, t1, t2 per contact; u_n < 0 approaches
  std::vector<double> v_minus;      ///< nv, velocity before the event
  std::vector<double> offset;       ///< 3 nc, w in m/s; zero in a simulation but where a stop or body is driven
  std::vector<double> mu;           ///< nc, Coulomb coefficient
  std::vector<double> restitution;  ///< nc, in [0, 1]

  int nc() const { return J.bands(); }
  int nv() const { return M.order(); }
  void clear();
};

/// How an event or a run ended (docs/interface.md, "Statuses"). Order is severity within an event.
enum class Status {
  ok,
  inaccurate,
  nonconverged,
  ray,
  cycling,
  singular,
  not_finite,
  energy_blowup,
  penetration,
  interrupted,
  write_failed,
  event_stall,
  time_limit,
  memory_limit,
  crash,
  unavailable,
  unsupported,
  input_error
};
std::string_view name(Status status);
/// One line that explains a status, as `contactbench list statuses` prints it.
std::string_view explanation(Status status);
inline constexpr int status_count = 18;

/// What a method claims: impulses, how it ended, and the witness of its law. Vectors are sized by the method.
struct ContactSolution {
  Status status = Status::ok;    ///< what the solver says of itself
  std::string reason;            ///< one line where status is not ok
  int iterations = 0;            ///< pivots, interior point iterations, sweeps: summed over the solves of the event
  int size = 0;                  ///< unknowns of the problem handed to the solver
  double claimed_residual = 0;   ///< in the measure of the law, as the solver believes it
  double restitution_scale = 1;  ///< -: least theta <= 1 of its islands that keeps restitution from gaining energy

  std::vector<double> impulse;  ///< 3 nc, r in N s (n, t1, t2 per contact)
  Witness witness;

  /// The witness as that of a law; an empty one where it was another's.
  template <class W>
  W& as() {
    W* held = std::get_if<W>(&witness);
    return held ? *held : witness.emplace<W>();
  }
  template <class W>
  const W& as() const {
    if (const W* held = std::get_if<W>(&witness)) return *held;
    static const W empty{};
    return empty;
  }
  /// Ends so, where nothing worse was said before.
  void fail(Status how, std::string why);
  /// Memory is kept, the witness's too.
  void clear();
};

/// v+ = v- + M^-1 J^T r; v_plus is resized. `factor` must hold M's factor.
void apply_impulse(const ContactProblem& problem, const BlockCholesky& factor, std::span<const double> impulse,
                   std::vector<double>& v_plus);
/// u = J v + w; u is resized to 3 nc.
void contact_velocity(const ContactProblem& problem, std::span<const double> v, std::vector<double>& u);

/// W_ii = J_i M^-1 J_i^T (3 x 3, 1/kg), contact by contact; result is nc matrices, column-major.
void diagonal_blocks(const ContactProblem& problem, const BlockCholesky& factor, std::vector<Eigen::Matrix3d>& W);
/// w_i = trace(W_ii) / 3, or W_nn where a contact has no tangential rows (a joint at its limit): nc, 1/kg. What makes
/// impulses and velocities of different contacts comparable, sqrt(w) r and u / sqrt(w) in sqrt(J).
void contact_weights(const ContactProblem& problem, const BlockCholesky& factor, std::vector<double>& weight);
/// Is this row a joint's at its limit, and no contact: one without tangential rows?
bool is_limit(const ContactProblem& problem, int contact);
/// Has any contact restitution?
bool is_elastic(const ContactProblem& problem);
/// J: the kinetic energy before the event, and the largest w^2 / (2 w_i) of the offsets: where a problem comes as W
/// and q alone all of it is in these.
double energy_before(const ContactProblem& problem);
/// The Delassus matrix W = J M^-1 J^T, dense 3 nc x 3 nc (symmetric, positive semidefinite).
void delassus(const ContactProblem& problem, const BlockCholesky& factor, Eigen::MatrixXd& W);

}  // namespace cb
