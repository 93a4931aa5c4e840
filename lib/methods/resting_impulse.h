#pragma once

#include <span>
#include <vector>

#include "cone/kkt_system.h"
#include "contact/problem.h"

namespace cb {

/// What a contact event is made of, of a whole problem or of an island of it. Views only.
struct ContactView {
  const BlockDiagonalMatrix& M;
  const BlockCholesky& factor;  ///< of M
  const BandMatrix& J;
  std::span<const double> v0, offset, mu, weight;  ///< as in ContactProblem; weight: 1/kg, nc
};

/// Impulses under which nothing slips or lifts, found from those of the event before: a start for bodies at rest. Every
/// contact keeps its velocity at zero in its normal row and, with friction, in its tangential rows. As a rule the
/// previous impulses do so to rounding, and one product with J tells; else proximal steps correct them. v+ is unique.
class RestingImpulse {
 public:
  /// `rows`: 3, or 1 for normal impulses alone.
  explicit RestingImpulse(int rows) : rows_(rows) {}

  /// Remembers r (3 nc, N s) if it keeps all velocities at zero within `resting` of `size` (sqrt(J)), and forgets what
  /// it knew otherwise. `least_norm`: that such impulses are, but not r itself; those next to zero are found then,
  /// which lie inside the cones where a pivoting method's lie on their edges, and rounding pushes them out.
  void remember(const ContactView& event, std::span<const double> r, double size, bool least_norm = false);
  void forget() { r_.clear(); }
  /// Finds the impulses of `event` from those remembered: false where there are none of this size, or where they do
  /// not come to rounding. Cones are not looked at.
  bool find(const ContactView& event, double size);

  const std::vector<double>& r() const { return r_; }  ///< 3 nc, N s
  const std::vector<double>& u() const { return u_; }  ///< 3 nc, m/s: velocities after r
  double residual() const { return residual_; }        ///< -, of the rows kept at zero, over the size of the motion

  /// -: velocities (scaled as the residual) that count as zero: without correction, after it, and when remembering.
  static constexpr double rounding = 5e-14, corrected = 1e-13, resting = 1e-11;

 private:
  double slip(const ContactView& event, std::span<const double> r, double size);
  bool correct(const ContactView& event, double size);
  void share_friction(int nc);

  int rows_;
  bool from_zero_ = false;
  std::vector<double> r_, u_, v_, share_;  // share_: nc, -, of friction
  double residual_ = 0;
  KktSystem system_;
  std::vector<double> G_, step_, u_step_, h_;
};

}  // namespace cb
