#pragma once

#include <vector>

#include "ncp/ncp.h"
#include "ncp/velocity_system.h"

namespace cb {

/// Newton's method on Alart and Curnier's map, in impulses: what takes a good guess to the last bits (finish.cpp).
/// Owns its scratch.
class AlartCurnierNewton {
 public:
  struct Options {
    double tolerance = 1e-12;  ///< natural residual at which it stops, -
    int limit = 30;            ///< steps
    int patience = 2;          ///< steps in a row without a residual of half the best, before it goes back to that,
    int returns = 3;           ///< and how often it does so, with a larger proximal term each time
    double enough = 0;         ///< natural residual from which it does not, -
    /// -: proximal term of a step, as a fraction of w: where r is not unique it picks the answer next to the iterate,
    /// and perturbs none. Larger: slower; smaller: steps leave where the map is nearly singular.
    double proximal = 1e-8, least = 1e-9;
    /// m/s: contacts that part more slowly are closed in the first step, and stick where they slip more slowly: what
    /// rests, carries.
    double touching = 0;
    /// -: t of a term t w (r - r0) that velocities have, r0 where it begins: the answer is then a proximal point.
    double anchor = 0;
    bool cut = false;                 ///< do steps end where the first contact opens or slips?
    double falls = 0.1, grows = 100;  ///< of it, after a step that went well, and one that did not
    /// -: natural residual from which a step that came to the tolerance left the map's slopes as they were.
    double chord_from = 1e-3;
    double fast = 1e-2;   ///< -: residual over the one before below which it stays as it is
    bool sharper = true;  ///< does it go on beyond the tolerance?
  };
  /// Of this problem, which must stay alive; `system` is prepared for it.
  void begin(const NcpProblem& problem, VelocitySystem& system, NcpMeasure& measure);
  /// From r (3 nc): replaced by the best that was met, u (3 nc) with it, the anchor's term in u as well. Returns its
  /// natural residual; `steps` is counted up.
  double solve(const Options& options, std::vector<double>& r, std::vector<double>& u, int& steps);

 private:
  double share_before_change() const;
  bool drifts() const;
  enum class Piece : char { open, frictionless, sticks, slips };
  bool step(double proximal, double touching, bool cut, bool chord);
  bool linearise(double proximal, double touching);
  void find_velocities();

  const NcpProblem* problem_ = nullptr;
  NcpMeasure* measure_ = nullptr;
  VelocitySystem* system_ = nullptr;
  std::vector<Piece> piece_;  // nc, of the map where it was linearised last; empty: not yet
  double proximal_ = 0;       // of that
  double anchor_ = 0;
  std::vector<double> r0_;
  std::vector<double> r_, u_, v_, G_, c_, du_, h_, change_, last_;
};

}  // namespace cb
