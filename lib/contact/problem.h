#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// The law that an answer claims to satisfy: what the referee holds it against.
enum class Law { newton, mirtich, anitescu_potra, convex };

/// What a method claims. All vectors are sized by the method; fields that a law does not use stay empty.
struct ContactSolution {
  Status status = Status::ok;   ///< what the solver says of itself
  std::string reason;           ///< one line where status is not ok
  int iterations = 0;           ///< pivots, interior point iterations, sweeps: summed over the solves of the event
  int size = 0;                 ///< unknowns of the problem handed to the solver
  double claimed_residual = 0;  ///< in the measure of the law, as the solver believes it

  std::vector<double> impulse;  ///< 3 nc, r in N s (n, t1, t2 per contact)

  // anitescu_potra: z = (c_n [nc], c_t [k nc, contact by contact], lam [nc]); direction i of a contact is
  // cos(2 pi i / k) t1 + sin(2 pi i / k) t2.
  int k = 0;
  double regularisation = 0;  ///< added to the diagonal of the LCP by --regularise
  std::vector<double> z;

  // mirtich: works at each contact over all its micro-impacts. Claimed: restitution_work = -e^2 compression_work >= 0,
  // friction_work <= 0, and all three sum to the change of kinetic energy r.u- + 1/2 r.W r.
  std::vector<double> compression_work;  ///< nc, <= 0, J: of the normal impulse while the contact approached
  std::vector<double> restitution_work;  ///< nc, >= 0, J: of the normal impulse while it separated
  std::vector<double> friction_work;     ///< nc, <= 0, J

  // convex: multipliers of N v+ >= 0, and the bound with its certificate.
  bool bounded = false;              ///< is the sum of normal impulses bounded per island?
  std::vector<double> eta;           ///< nc, >= 0, in m/s-dual units (N s)
  std::vector<double> frictionless;  ///< nc, f >= 0: normal impulses of the frictionless problem with least sum
  std::vector<double> kappa_dual;    ///< nv, z: proves the least sum: N z <= 1 on touching contacts, f.(1 - N z) = 0
  double epsilon = 0;                ///< J, the suboptimality that the solver was allowed for this event
  double restitution_scale = 1;      ///< -: least theta <= 1 of its islands that keeps restitution from gaining energy

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
/// The Delassus matrix W = J M^-1 J^T, dense 3 nc x 3 nc (symmetric, positive semidefinite).
void delassus(const ContactProblem& problem, const BlockCholesky& factor, Eigen::MatrixXd& W);

}  // namespace cb
