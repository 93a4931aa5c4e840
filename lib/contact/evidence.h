#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "contact/friction_cone.h"
#include "contact/islands.h"
#include "contact/problem.h"

namespace cb {

/// What is true of an answer, recomputed from the original problem and the claimed impulses alone
/// (docs/judging.md). A claim that this refutes is counted as false. Errors are fractions of the size of the contact,
/// or the island, they are made in (referee.cpp); the worst of them stands here.
struct Residuals {
  double model = 0;                     ///< residual of the law that was solved, -
  std::optional<double> law;            ///< against exact Coulomb friction, -; only where all e = 0
  std::optional<double> gap;            ///< convex: checked duality gap, J: over all islands
  std::optional<double> infeasibility;  ///< convex: worst scaled violation of a constraint, -
  double island_gap = 0;                ///< convex: of the island whose gap is the worst of what it is allowed, J,
  double allowed_gap = 0;               ///< and that: what the others leave of epsilon, and its data's last bits, J
  int worst_contact = -1;               ///< where the model's residual is, or the worst gap; -1: nowhere in particular
  int worst_island = -1;                ///< numbered by first contact (islands.h)
  double approach = 0;                  ///< max(0, -u_n+), m/s
  double cone_violation = 0;            ///< largest distance of an impulse to the circular cone, N s
  double dissipation_gap = 0;           ///< largest mu r_n |u_t| + r_t.u_t, J
  double energy_gain = 0;               ///< kinetic energy after minus before, J
  double energy_before = 0;             ///< kinetic energy before, J
  double momentum = 0;                  ///< |M (v+ - v-) - J^T r| scaled as sqrt(J)
  bool finite = true;                   ///< no NaN or infinity in the claim
};

/// The worst error so far, over the size of what it is made in.
struct Worst {
  double ratio = 0;
  int contact = -1, island = -1;  ///< of it; -1: of none

  void report(Residuals& out) const {
    out.model = ratio;
    out.worst_contact = contact;
    out.worst_island = island;
  }
};

/// What the referee has recomputed of an answer before it asks the law. By contact, where nothing else is said.
struct Evidence {
  bool elastic = false;              ///< has any contact restitution?
  std::vector<char> elastic_island;  ///< per island: has any of its contacts?
  BlockCholesky factor;              ///< of M
  Islands islands;
  std::vector<double> weight;           ///< w_i, 1/kg
  std::vector<double> u_plus, u_minus;  ///< 3 nc, m/s: after the claimed impulses, and before
  std::vector<double> size2;            ///< J: square of what the contact is about
  std::vector<double> island_size;      ///< per island, sqrt(J): what it is about,
  std::vector<double> island_size_q;    ///< and what there is before any impulse
  std::vector<double> rounding;         ///< m/s: what the data's last bits leave open of u; empty: not asked for yet

  bool is_elastic(int contact) const { return elastic_island[islands.of_contact[contact]] != 0; }
  /// m/s: what rounding leaves open of a contact's velocity; 0 while nobody had to ask.
  double open(int contact) const { return rounding.empty() ? 0 : rounding[contact]; }
  /// What rounding leaves open of r.(u + q)/2, J: of the velocities, and by them of the impulses.
  double open_work(const Eigen::Vector3d& r, const Eigen::Vector3d& u, const Eigen::Vector3d& q, int contact) const;
  /// Take note of an error. Without size there is nothing an error could be made of, but in a claim of it; what is
  /// beyond the largest number is an error.
  void see(Worst& worst, double error, double size, int contact) const {
    if (!within(worst, error, size)) worst = {ratio_of(error, size), contact, islands.of_contact[contact]};
  }
  static void see_island(Worst& worst, double error, double size, int island) {
    if (!within(worst, error, size)) worst = {ratio_of(error, size), -1, island};
  }

 private:
  static bool within(const Worst& worst, double error, double size) {
    return error <= worst.ratio * size && size < HUGE_VAL;
  }
  static double ratio_of(double error, double size) {
    return error < HUGE_VAL && size > 0 && size < HUGE_VAL ? error / size : HUGE_VAL;
  }
};

/// Nothing approaches at a contact any more, and its impulse lies in its cone; errors are fractions of `size`.
void see_feasible(const ContactProblem& problem, std::span<const double> r, const Evidence& at, double size,
                  int contact, Worst& worst);
/// So at all contacts, as fractions of what each is about.
Worst feasible(const ContactProblem& problem, std::span<const double> r, const Evidence& at);
/// Where no answer exists impulses may grow until any approach is small beside them. So that nothing approaches is,
/// with every law whose contacts do not give way, a matter of the island's velocities before any impulse, too.
void see_approach(const Evidence& at, Worst& worst);
/// Islands that a check looks at.
enum class Which { all, elastic };
/// No law of restitution with e <= 1 gains energy. `epsilon`: suboptimality that the solver was allowed, J; `scratch`
/// is kept by the caller.
void see_gains(std::span<const double> r, double epsilon, const Evidence& at, Which islands,
               std::vector<double>& scratch, Worst& worst);

/// Error of an impulse in Coulomb's law, r - P(r - u~ / w), N s: P projects on |x_t| <= mu x_n, and u~ is u with mu
/// |u_t| added to the normal component (De Saxce and Feng, 1998).
inline Eigen::Vector3d coulomb_error(const Eigen::Vector3d& r, const Eigen::Vector3d& u, double mu, double weight) {
  const double u_changed = u[0] + mu * std::sqrt(u[1] * u[1] + u[2] * u[2]);
  return r - project_on_cone({r[0] - u_changed / weight, r[1] - u[1] / weight, r[2] - u[2] / weight}, mu);
}

/// |x_t| of contact c, from rows n, t1, t2.
inline double tangential(std::span<const double> x, int c) {
  return std::sqrt(x[3 * c + 1] * x[3 * c + 1] + x[3 * c + 2] * x[3 * c + 2]);
}

}  // namespace cb
