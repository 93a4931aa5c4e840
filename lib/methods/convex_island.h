#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "cone/certificate.h"
#include "contact/problem.h"
#include "methods/resting_impulse.h"

namespace cb {

/// What the convex method asks of an answer, and how it looks for one.
struct ConvexTolerances {
  double epsilon = 1e-12;                  ///< J, suboptimality at which the solver may stop
  std::optional<double> epsilon_relative;  ///< the same as a fraction of the kinetic energy before the event, -
  bool bounded = true;                     ///< bound the sum of normal impulses of each island?
  bool warm_start = false;                 ///< start from the previous event's answer?
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
  /// frictionless solution: for the proof of its sum; and, sharper, where the proof is first looked for.
  double touching = 9e-10, surely_touching = 1e-11;
  /// -: gap as a fraction of the event's energy up to which an answer that misses epsilon is `inaccurate` and not
  /// `nonconverged`.
  double inaccurate = 1e-8;
  /// Contacts of an island up to which an answer that is still far off is looked for densely, in DoubleDouble;
  /// larger: an event may take seconds.
  int dense_limit = 200;
  /// -: ConeOptions::step_fraction of the last attempt at that.
  double short_step = 0.5;
  /// -: ConeOptions::proximal and careful_proximal of the Newton steps that finish its answers.
  double finish_proximal = 1e-12, finish_first_proximal = 1e-8;
  /// -: gap of restitution's second phase as a fraction of the island's energy: what the event may gain by it.
  double gain = 1e-10;
  /// Restitution scaled so that no island gains energy? Without: as published.
  bool bounded_restitution = true;
  ConeOptions cone;
};

/// One island as a problem of its own, and what is the same for every answer to it.
struct ConvexIsland {
  BlockDiagonalMatrix M;
  BandMatrix J;
  BlockCholesky factor;  ///< of M
  std::vector<double> v0, offset, mu, weight;
  std::vector<double> share;  ///< 1 where the normal impulse counts in the bound: at contacts, not at limits of joints
  std::span<const int> contacts, blocks;  ///< of the problem
  std::vector<double> q;                  ///< 3 nc, m/s: J v0 + w
  double size = 0;                        ///< sqrt(J), of q
  double before = 0;                      ///< sqrt(J), of q as it was before the event's first phase
  double epsilon = 0;                     ///< J, the island's share of what is asked for
  std::vector<double> no_friction;        ///< nc, zeros

  int nc() const { return static_cast<int>(contacts.size()); }
  int nv() const { return M.order(); }
  /// Size to divide by.
  double scale() const { return size > 0 ? size : 1; }
  /// (1) without its bounds; and without friction.
  ConeProgram program(bool bounded) const;
  ConeProgram normal_program(bool bounded) const;
  ContactView view() const { return {M, factor, J, v0, offset, mu, weight}; }
  /// 1.x over the contacts that count in the bound.
  double sum_of_shares(std::span<const double> x) const;
  /// Are there blocks other than free bodies'?
  bool has_robot() const;
};

/// `v0`: the velocity before, nv of the problem; `weight`: of its contacts; `contacts` and `blocks` stay alive.
void extract(const ContactProblem& problem, std::span<const double> v0, std::span<const double> weight,
             std::span<const int> contacts, std::span<const int> blocks, std::vector<int>& scratch, ConvexIsland& out);

/// Which program an island comes down to: (1) or (3) of drumwright_shell.cpp.
enum class ConvexShape { general, flat };

/// The frictionless answer of an island, and the bound of (1) with its proof.
struct ConvexBound {
  std::vector<double> f;        ///< nc, N s, >= 0
  std::vector<double> impulse;  ///< 3 nc, N s: f as impulses
  std::vector<double> u_f;      ///< 3 nc, m/s: velocities after it
  std::vector<double> z;        ///< nv, proof of the least sum, and
  std::vector<double> J_z;      ///< 3 nc
  std::vector<double> lambda;   ///< nc, s.t. M z = N^T lambda where `miss` is small
  double miss = HUGE_VAL;       ///< -, of N z = 1 for that z
  double kappa = 0;             ///< N s
  ConvexShape shape = ConvexShape::general;
  std::vector<char> fixed;  ///< nc, contacts of (3) whose u_n = 0
};

}  // namespace cb
