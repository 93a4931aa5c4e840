#pragma once

#include <optional>
#include <string>
#include <vector>

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
  double allowed_gap = 0;               ///< and that: its share of epsilon and what its data's last bits leave open, J
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

/// Recomputes every measure; owns its scratch, so that a run does not allocate after its first events.
class Referee {
 public:
  /// -: error over size up to which an answer is one; also what an error of the size of rounding counts as.
  static constexpr double accepted = 1e-9;

  /// Checks `solution` under `law`. `v_plus` is set to v- + M^-1 J^T r, computed here and used by the caller:
  /// what is simulated is what was checked.
  Residuals check(const ContactProblem& problem, const ContactSolution& solution, Law law, std::vector<double>& v_plus);
  /// The impulses as an unambiguous verdict: does the claim hold to `tolerance`?
  /// anitescu_potra, newton, mirtich, convex with restitution: model <= tolerance, where at every contact
  ///   model = error / max(size, terms, rounding / accepted), all in sqrt(J) (referee.cpp).
  /// convex without: |gap| <= epsilon / islands that carry impulses + rounding (J) on every island, infeasibility <=
  /// accepted.
  static bool holds(const Residuals& residuals, const ContactSolution& solution, Law law, double tolerance);
  /// Why it does not, in one line.
  static std::string refusal(const Residuals& residuals, double tolerance);

 private:
  struct Worst {
    double ratio = 0;
    int contact = -1, island = -1;
  };
  void gains(const ContactProblem& problem, const ContactSolution& solution, Worst& worst);
  void see(Worst& worst, double error, double size, int contact) const;
  double open_work(const Eigen::Vector3d& r, const Eigen::Vector3d& u, const Eigen::Vector3d& q, int contact) const;
  static void see_island(Worst& worst, double error, double size, int island);
  void find_same_islands(const ContactProblem& problem);
  void look_at_terms(const ContactProblem& problem, const ContactSolution& solution);
  void add_changes(const ContactProblem& problem, const ContactSolution& solution);
  void observe(const ContactProblem& problem, std::span<const double> r, bool elastic, Residuals& out);
  void balance(const ContactProblem& problem, std::span<const double> v_plus, Residuals& out);
  void judge(const ContactProblem& problem, const ContactSolution& solution, Law law, bool elastic, Residuals& out);
  Worst anitescu_potra(const ContactProblem& problem, const ContactSolution& solution, bool elastic);
  void restitution(const ContactProblem& problem, const ContactSolution& solution, Worst& worst);
  void convex(const ContactProblem& problem, const ContactSolution& solution, Residuals& out);
  void least_sum(const ContactProblem& problem, const ContactSolution& solution, Worst& worst);
  void gaps(const ContactProblem& problem, const ContactSolution& solution, Residuals& out);
  template <class Size>
  Worst feasible(const ContactProblem& problem, const ContactSolution& solution, Size size_of) const;
  Worst impact(const ContactProblem& problem, const ContactSolution& solution) const;
  Worst newton(const ContactProblem& problem, const ContactSolution& solution) const;
  Worst mirtich(const ContactProblem& problem, const ContactSolution& solution);

  /// m/s: what rounding leaves open of a contact's velocity; 0 while nobody had to ask.
  double open(int contact) const { return rounding_.empty() ? 0 : rounding_[contact]; }

  BlockCholesky factor_;
  Islands islands_;
  std::vector<int> joined_band_, joined_block_;  // what islands_ were found from
  std::vector<double> size2_;                    // nc, J: square of what a contact is about
  std::vector<double> island_size_;              // per island, sqrt(J): what it is about,
  std::vector<double> island_size_q_;            // and what there is before any impulse
  std::vector<double> rounding_;  // nc, m/s: what the last bits of the data leave open of u; empty: not asked for yet
  std::vector<double> weight_;    // nc, w_i
  std::vector<double> u_plus_, u_minus_, y_, u_dual_, scratch_v_, scratch_u_, difference_, momentum_, columns_,
      changes_;
  std::vector<double> cosine_, sine_, given_back_, phase_, between_,
      error_;  // anitescu_potra: k, k, nc, 3 nc, 3 nc, nc
  std::vector<double> slack_, slack_rounding_, sum_, kappa_, kappa_scale_, kappa_miss_, gap_,
      gap_rounding_;  // per island
};

}  // namespace cb
