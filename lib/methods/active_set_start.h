#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "contact/problem.h"
#include "lcp/front.h"
#include "lcp/lcp.h"
#include "methods/polygon_lcp.h"

namespace cb {

/// A warm start of A-P's LCP: the active set of the last answer, tried on the present problem (active_set_start.cpp).
class ActiveSetStart {
 public:
  void forget() { previous_ = -1; }
  /// The answer with that active set. True where it solves `problem`, which has its groups; u: velocities before the
  /// event (3 nc).
  bool find(const LcpProblem& problem, const PolygonUnknowns& at, std::span<const double> u, LcpSolution& answer);
  /// Notes the active set of an answer; `impulse`: all of the event's (3 nc), u: velocities before it.
  void remember(const ContactProblem& problem, const BlockCholesky& factor, const PolygonUnknowns& at,
                std::span<const double> u, std::span<const double> impulse, const LcpSolution& answer);

 private:
  bool holds_by_contact(const LcpGroups& groups, const Eigen::VectorXd& z);
  void list_friction(const PolygonUnknowns& at, const Eigen::VectorXd& z, double least_impulse, double least_slip);
  void list_bounds(const ContactProblem& problem, const PolygonUnknowns& at, const Eigen::VectorXd& z,
                   double least_impulse, double least_slip);

  int previous_ = -1;               // n of the last answer, -1 where there is none
  std::vector<int> active_;         // its positive unknowns, and what makes their equations regular
  Eigen::VectorXd w_;               // n
  Eigen::VectorXd errors_, sizes_;  // nc, J: squares
  std::vector<double> u_, v_;
  PairScales scales_;
  Kernels kernels_;
};

}  // namespace cb
