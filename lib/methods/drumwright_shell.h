#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cone/interior_point.h"
#include "contact/islands.h"
#include "methods/least_sum.h"
#include "methods/registry.h"
#include "methods/resting_impulse.h"
#include "methods/restitution.h"
#include "methods/stopping_impulse.h"

namespace cb {

/// The convex contact model of Drumwright and Shell, island by island (drumwright_shell.cpp says what is solved).
/// Owns its scratch: a simulation does not allocate after its first events.
class DrumwrightShell {
 public:
  struct Tolerances {
    double epsilon = 1e-12;                   ///< J, suboptimality at which the solver may stop
    std::optional<double> epsilon_relative;   ///< the same as a fraction of the kinetic energy before the event, -
    bool bounded = true;                      ///< bound the sum of normal impulses of each island?
    bool warm_start = false;                  ///< start from the previous event's answer?
    std::shared_ptr<long> warm_starts;        ///< counts such starts that were accepted, where it is given
    std::shared_ptr<AnsweredBy> answered_by;  ///< counts whose answers were taken, an island each, where it is given
    /// -: scaled infeasibility up to which an answer that keeps the bounds is accepted, and one that may miss them:
    /// below the referee's 1e-9, whose sums round otherwise.
    double infeasibility = 1e-10, backward = 9e-10;
    /// -: residual of N z = 1 (z: proof of the least sum) and of T z = 0 below which they count as solvable.
    double solvable = 1e-10;
    /// -: error of W_(:,n) lambda = 1_n up to which a scene counts as flat: the certificate multiplies it.
    double flat = 1e-11;
    /// -: lambda w up to which a contact counts as one that lambda does not need.
    double carrying = 1e-7;
    /// -: normal velocity, as a fraction of the event's, up to which a contact counts as touching after the
    /// frictionless solution.
    double touching = 9e-10;
    /// -: gap as a fraction of the event's energy up to which an answer that misses epsilon is `inaccurate` and not
    /// `nonconverged`.
    double inaccurate = 1e-8;
    /// Contacts of an island up to which an answer that is still far off is looked for densely, in DoubleDouble;
    /// larger: an event may take seconds.
    int dense_limit = 200;
    /// -: ConeOptions::proximal and careful_proximal of the Newton steps that finish its answers.
    double finish_proximal = 1e-12, finish_first_proximal = 1e-8;
    /// -: gap of restitution's second phase as a fraction of the island's energy: what the event may gain by it.
    double gain = 1e-10;
    /// Restitution scaled so that no island gains energy? Without: as published.
    bool bounded_restitution = true;
    ConeOptions cone;
  };
  explicit DrumwrightShell(const Tolerances& tolerances);
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  /// One island as a problem of its own.
  struct Island {
    BlockDiagonalMatrix M;
    BandMatrix J;
    BlockCholesky factor;
    std::vector<double> v0, offset, mu, weight;
    std::vector<double> share;  // 1 where the normal impulse counts in the bound: at contacts, not at limits of joints
    std::span<const int> contacts, blocks;  // of the problem
  };
  /// Which program an island comes down to: (1) or (3).
  enum class Shape { general, flat };
  /// What an island of the previous event knows of the next one.
  struct Previous {
    RestingImpulse impulse{3}, frictionless{1};  ///< of an island at rest
    std::vector<double> z;                       ///< proof of its least sum
    // Where Newton's method ended.
    int nv = 0;
    bool by_newton = false;  ///< and not by one of the first tries, which are cheaper than it
    ConeSolution answer;
  };
  /// One phase (restitution has two): from `v0` to impulses `r` with certificate.
  bool solve(const ContactProblem& problem, const std::vector<double>& v0, double epsilon, ContactSolution& solution);
  bool approaches_again();
  bool weigh(const ContactProblem& problem, ContactSolution& solution);
  void extract(const ContactProblem& problem, const std::vector<double>& v0, int island);
  ConeStatus solve_island(double epsilon, ContactSolution& solution, Previous* previous);
  void begin_island(double epsilon, ContactSolution& solution);
  bool find_bound();
  bool slides_freely();
  bool stays_at_rest(Previous& previous);
  void remember(Previous& previous);

  /// How far an answer may miss the bounds: not beyond rounding, or as far as the referee accepts.
  enum class Allowed { exact, backward };
  /// Fills answer_; false where there is nothing to propose.
  struct Proposer {
    const char* name;
    bool (DrumwrightShell::*propose)();
    Allowed allowed;
    bool starts_next;  ///< may Newton's method start from it in the next event?
  };
  static const std::array<Proposer, 7> proposers;
  ConeStatus propose(Previous* previous);
  bool from_previous();
  bool all_stop();
  bool all_stick();
  bool from_guess();
  bool interior();
  bool dense();
  bool dense_relaxed();
  void solve_densely(const ConeProgram& program);
  bool offer(const Proposer& proposer);
  void certify_unreduced(const ConeSolution& x);
  ConeProgram reduced() const;
  ConeProgram relaxed_program();
  double limit_of(Allowed allowed) const;
  bool excused(const Certificate& certificate) const;

  ContactView view() const;
  bool start_at_rest(Previous& previous);
  bool frictionless();
  void equalities(const std::vector<char>& in_set, std::vector<double>& x, std::vector<double>& velocity);
  bool proves_least_sum() const;
  bool complementary();
  bool least_sum(bool solved);
  bool least_sum_densely();
  void take_frictionless();
  void lift();
  Shape shape();
  bool lifts_evenly();
  bool carries_lift(int contact) const;
  bool supports() const;
  bool has_robot() const;
  double stop_set(const ConeProgram& program, std::span<const double> weight, int rows);
  bool stop_normals();
  Certificate judge(std::span<const double> r, std::span<const double> eta);
  bool good(const Certificate& certificate, double infeasibility) const;
  double sum_of_shares(std::span<const double> x) const;
  double gap_at_own_sum(std::span<const double> r);

  Tolerances tolerances_;
  BlockCholesky factor_;
  Islands islands_;
  Groups contacts_of_, blocks_of_;  // per island
  std::vector<double> weight_;
  Island island_;
  std::vector<int> block_in_island_;

  // Of the island at work.
  ConeProgram program_, normal_program_;
  InteriorPoint friction_solver_, normal_solver_, finisher_;
  KktSystem sticking_, normals_;
  StoppingImpulse stopping_;
  LeastSum dense_sum_;
  ConeVelocities velocities_;
  std::vector<double> zero_mu_, q_, f_, v_f_, u_f_, z_, lambda_;
  std::vector<double> r_, eta_, G_, step_, h_, u_step_, x_, least_x_, f_shifted_, velocity_, Jz_;
  std::vector<double> touch_, proof_;
  std::vector<char> set_, fixed_;
  std::vector<double> slack_, multiplier_;
  double epsilon_ = 0;                   // J, the island's share
  Certificate best_;                     // of r_, eta_
  const ConeSolution* start_ = nullptr;  // the previous event's answer, where it may be started from
  double kappa_ = 0, size_ = 0, miss_ = 0;
  Shape shape_ = Shape::general;
  bool inaccurate_ = false, second_phase_ = false;
  std::string_view answered_by_;  // whose answer r_, eta_ are
  double excess_ = 0;             // J, of the gaps of all islands, beyond rounding
  ConeSolution answer_, trial_, finished_;
  std::vector<Previous> previous_;  // per island
  int iterations_ = 0;

  // Of the second phase of restitution.
  Restitution restitution_;
  std::vector<char> bounded_;  // per island
  std::vector<double> first_impulse_;
};

}  // namespace cb
