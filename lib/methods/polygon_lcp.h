#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "contact/islands.h"
#include "contact/polygon.h"
#include "contact/problem.h"
#include "lcp/lcp.h"

namespace cb {

/// Where the unknowns of A-P's LCP stand (anitescu_potra.cpp): c_n of all contacts, then c_t and lam of those with
/// friction unknowns. A view.
struct PolygonUnknowns {
  int nc, k;
  const std::vector<int>& rough;         ///< contacts whose friction has unknowns
  std::span<const double> cosine, sine;  ///< k: the directions
  int rough_count() const { return static_cast<int>(rough.size()); }
  int first_direction(int f) const { return nc + k * f; }             ///< c_t of the f-th contact of `rough`
  int slip_bound(int f) const { return nc + k * rough_count() + f; }  ///< and its lam
  int count() const { return nc + (k + 1) * rough_count(); }          ///< of all unknowns
};

/// The matrices and vectors of A-P's LCP from a contact problem (the equations: anitescu_potra.cpp), in kept memory.
class PolygonLcp {
 public:
  /// `regularise`: added to the diagonal, in the unit of each row.
  PolygonLcp(FrictionPolygon polygon, double regularise) : polygon_(std::move(polygon)), regularise_(regularise) {}

  /// Which unknowns there are; `all`: contacts without friction have those of friction, too.
  void begin(const ContactProblem& problem, bool all);
  PolygonUnknowns at() const { return {nc_, polygon_.k(), rough_, polygon_.cosine, polygon_.sine}; }

  /// The matrix with v+ eliminated, from W = J M^-1 J^T; sets weight().
  void build_dense(const ContactProblem& problem, const BlockCholesky& factor);
  /// The matrix with x = v+ - v- as free unknowns: A = M, B = -[N^T D^T 0], C = [N; D; 0], a = 0; sets weight().
  void build_expanded(const ContactProblem& problem, const BlockCholesky& factor);
  /// The vectors for contact velocities u (3 nc, m/s) before the phase; `bound`: the slack of each friction bound (nc,
  /// N s).
  void set_load(const ContactProblem& problem, std::span<const double> u, std::span<const double> bound);
  /// How answers are judged: contact by contact, as the referee does, each about the velocities u before the event.
  void group_by_contact(const ContactProblem& problem, const BlockCholesky& factor, std::span<const double> u);

  const FrictionPolygon& polygon() const { return polygon_; }
  const LcpProblem& lcp() const { return lcp_; }
  Eigen::VectorXd& sizes() { return lcp_.groups.size; }  ///< nc: what each contact is about, sqrt(J)
  std::vector<double>& weight() { return weight_; }      ///< nc, 1/kg

 private:
  void drop_rounding();
  void find_stops(const ContactProblem& problem, const BlockCholesky& factor, std::span<const double> u);
  double stopping2(const ContactProblem& problem, int limit) const;
  void find_terms(const ContactProblem& problem, Eigen::VectorXd& of_row);
  void band(const ContactProblem& problem, int c, int column, const Eigen::Vector3d& direction);
  void diagonal(int row);
  void add_normal_columns(const ContactProblem& problem);
  void add_friction_columns(const ContactProblem& problem);

  FrictionPolygon polygon_;
  double regularise_;
  int nc_ = 0;
  std::vector<int> rough_;  // contacts whose friction has unknowns
  LcpProblem lcp_;
  Eigen::MatrixXd W_;
  std::vector<double> weight_;
  Eigen::ArrayXd row_scale_;  // 3 nc
  Islands islands_;
  std::vector<std::array<double, 2>> of_island_;  // sum of u^2 / w, J; largest u^2, but for limits
  std::vector<double> stops_;                     // nv
  Eigen::Matrix3Xd of_contact_;                   // nc: terms of the velocities before, m/s
  Eigen::MatrixX3d columns_;
};

}  // namespace cb
