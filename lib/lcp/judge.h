#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "lcp/basis.h"
#include "lcp/scaling.h"

namespace cb {

/// How good an answer is, -. The error of a group is the root of the sum of squares of min(z_i s_i, w_i / s_i) over its
/// pairs, as a fraction of the largest z_i s_i of them, or its size; without groups, that of each pair over all that
/// the problem is about. What may not be negative beside other things (LcpGroups::before) counts beside these. Where
/// that is in doubt (below), w_i may be a small sum of large terms, t_i = |q_i| + sum_j |M_ij| z_j.
struct Judgement {
  /// Is it an answer? Natural residual (lcp.h), or the worst error of a group where that is more. What the last bits of
  /// the data leave open is no error: `term_rounding` t_i, of a group that of any row of its island in the same unit,
  /// where t_i holds LcpGroups::terms in place of |q_i| and nothing that acts on its own group alone (LcpGroups::own).
  /// A group is about t_i / s_i too, with |q_i|.
  double residual = HUGE_VAL;
  /// Could it be better? The worst error of a group, `round_off` t_i of it no error. A solver that is content with
  /// less leaves what adds up over a run: a stack of 16 boxes begins to creep after 600 steps.
  double beyond_rounding = HUGE_VAL;
};
/// Is `a` the better one? Among answers that which could be improved least: what rounding excuses is alike for them.
bool better(const Judgement& a, const Judgement& b, double tolerance);
inline constexpr double beyond_doubt = 1e-12;  ///< of groups, -
/// Of the natural residual, -. Smaller: a second look at many good answers (a third of a sliding box's time).
inline constexpr double natural_doubt = 1e-11;
/// -: as many roundings of each term a sum may be off by, whose terms are sums themselves. Larger: errors pass for
/// rounding; smaller: paths are followed to find what is not there.
inline constexpr double term_rounding = 128 * std::numeric_limits<double>::epsilon();

/// Vertices and rays of a basis, judged on the original data.
struct PathJudge {
  double refined = 1e-16;       ///< refinement stops below this residual of the equalities, -
  int refinements = 3;          ///< steps of iterative refinement at most
  double ray_tolerance = 1e-9;  ///< a ray may violate its equations by this much of its largest entry, -

  /// The vertex of the present basis for the load, refined on the original data, then clipped: z, and how good it is;
  /// no good where the basis cannot be factorised.
  Judgement vertex(Basis& basis, const ScaledLoad& load, Eigen::VectorXd& z);

  /// Is the direction along which nothing blocks `variable` a ray of w = M z + q + c z_0?
  /// With d the change per unit of the variable: M dz + c dz_0 = dw, all of it >= 0, dz.dw = 0 by the basis.
  bool ray_holds(Basis& basis, const ScaledLoad& load, const Eigen::VectorXd& cover, int variable);

 private:
  Judgement judge(Basis& basis, const ScaledLoad& load, const Eigen::VectorXd& z);
  Judgement first_look(const ScaledLoad& load, const Eigen::VectorXd& z);
  void second_look(const ScaledLoad& load, const Eigen::VectorXd& z, Judgement& found);
  double natural(const ScaledLoad& load, const Eigen::VectorXd& z) const;
  double worst_of_groups(const ScaledLoad& load);
  double overlap(const LcpGroups& groups, bool excused) const;
  void find_shared(Basis& basis, const ScaledLoad& load, const Eigen::VectorXd& z);

  // product_: t, |M| z + |q|; terms_: that without what acts on its own group alone; open_: that with what q itself is
  // made of in place of q. All n.
  Eigen::VectorXd scratch_, w_, z_, product_, terms_, open_;
  Eigen::VectorXd error_, size_, squares_, excused_;  // n; groups
  std::vector<double> shared_;                        // islands: the largest term in the unit that rows share
  std::vector<int> active_;
};

/// A covering vector under which the basic values of a complementary basis grow as p with z_0: c = p_w - M p_z, where
/// p_z is p for `active`, whose z are basic, p_w for the others, zero elsewhere. `p_z` is scratch; all n.
void set_own_cover(Basis& basis, const ScaledLoad& load, const std::vector<int>& active, const Eigen::VectorXd& p,
                   Eigen::VectorXd& p_z, Eigen::VectorXd& cover);

}  // namespace cb
