// A warm start of Anitescu and Potra's LCP from the active set of the event before.
//
// Problem: the LCP of anitescu_potra.cpp, of as many unknowns as the last. While contacts keep their ways (sticking,
// slipping along one direction, open) the same unknowns are positive; then one linear system has the answer.
//
// Source: none; the active-set warm start of quadratic programming, as textbooks have it.
//
// Fails (false, and the solver starts cold) where the set is singular or its answer is not one of the present problem
// to rounding, judged as natural_residual() judges (lcp/lcp.cpp) on the original data, and contact by contact.

#include "methods/active_set_start.h"

#include <algorithm>
#include <cmath>

namespace cb {

namespace {

/// -: natural residual up to which a warm start is accepted: rounding. Larger: answers that a cold start would better.
constexpr double warm_tolerance = 1e-12;
/// -: errors of a contact up to which it is, over what the contact is about: half of what the referee accepts. Beside
/// something heavy and fast the residual alone does not see what is light.
constexpr double contact_tolerance = 5e-10;
/// -: impulses below this fraction of the largest, and slip bounds of the fastest contact, are not active.
constexpr double rounding = 1e-13;

/// The denominator of the residual is data: the load with v+ eliminated, and the size of the event.
double size_of(const LcpProblem& problem, const PolygonUnknowns& at, const double* u, const Eigen::VectorXd& rho) {
  double size = problem.size;
  const auto about = [&](int i, double q) { size = std::max(size, std::abs(q) / std::sqrt(rho[i])); };
  for (int c = 0; c < at.nc; ++c) about(c, u[3 * c]);
  for (int f = 0; f < at.rough_count(); ++f) {
    const double* along = &u[3 * at.rough[f]];
    for (int a = 0; a < at.k; ++a) about(at.first_direction(f) + a, at.cosine[a] * along[1] + at.sine[a] * along[2]);
  }
  return size;
}

}  // namespace

bool ActiveSetStart::find(const LcpProblem& problem, const PolygonUnknowns& at, std::span<const double> u,
                          LcpSolution& answer) {
  const int n = problem.n();
  if (previous_ != n) return false;
  pair_scales(problem, scales_);
  Basis& basis = kernels_.of(problem);
  basis.start(problem, scales_);
  auto& z = answer.z;
  double worst = 2 * basis.solve_at(active_, z, w_);  // rows are within sqrt(2) of 1 / sqrt(rho)
  if (!(worst < HUGE_VAL)) return false;
  const double size = size_of(problem, at, u.data(), scales_.rho);
  for (int i = 0; i < n; ++i) {
    const double root = std::sqrt(scales_.rho[i]), e = std::abs(std::min(w_[i] / root, z[i] * root));
    if (!std::isfinite(e)) return false;  // a singular set
    worst = std::max(worst, e);
  }
  if (!(size > 0) || !(worst <= warm_tolerance * size) || !holds_by_contact(problem.groups, z)) return false;
  z = z.cwiseMax(0.0);
  answer.status = LcpStatus::solved;
  answer.reason.clear();
  answer.pivots = 0;
  answer.residual = worst / size;
  return true;
}

// What a contact is about: its impulses, or what PolygonLcp::group_by_contact() says, which is its own island's.
bool ActiveSetStart::holds_by_contact(const LcpGroups& groups, const Eigen::VectorXd& z) {
  errors_.setZero(groups.size.size());
  sizes_ = groups.size.cwiseAbs2();
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const int c = groups.of_pair[i];
    const double root = groups.root[i], of_z = z[i] * root, e = std::min(w_[i] / root, of_z);
    errors_[c] += e * e;
    if (!groups.own[i]) sizes_[c] = std::max(sizes_[c], of_z * of_z);
  }
  return (errors_.array() <= contact_tolerance * contact_tolerance * sizes_.array()).all();
}

void ActiveSetStart::remember(const ContactProblem& problem, const BlockCholesky& factor, const PolygonUnknowns& at,
                              std::span<const double> u, std::span<const double> impulse, const LcpSolution& answer) {
  previous_ = -1;
  if (answer.status != LcpStatus::solved) return;
  const auto& z = answer.z;
  double speed = 0;
  for (const double one : u) speed = std::max(speed, std::abs(one));
  const double least_impulse = rounding * z.head(at.slip_bound(0)).maxCoeff(), least_slip = rounding * speed;
  apply_impulse(problem, factor, impulse, v_);
  contact_velocity(problem, v_, u_);
  active_.clear();
  for (int c = 0; c < at.nc; ++c)
    if (z[c] > least_impulse) active_.push_back(c);
  list_friction(at, z, least_impulse, least_slip);
  list_bounds(problem, at, z, least_impulse, least_slip);
  previous_ = static_cast<int>(z.size());
}

// A contact that slips without an impulse has a slip bound that no equation of the set knows: the direction that runs
// straight against its slip joins, with impulse zero.
void ActiveSetStart::list_friction(const PolygonUnknowns& at, const Eigen::VectorXd& z, double least_impulse,
                                   double least_slip) {
  for (int f = 0; f < at.rough_count(); ++f) {
    const int first = at.first_direction(f);
    const double* u = &u_[3 * at.rough[f]];
    bool carries = false;
    for (int a = 0; a < at.k; ++a) carries = carries || z[first + a] > least_impulse;
    int against = -1;
    double least = HUGE_VAL;
    for (int a = 0; a < at.k && !carries && z[at.slip_bound(f)] > least_slip; ++a) {
      const double along = at.cosine[a] * u[1] + at.sine[a] * u[2];
      if (along < least) {
        least = along;
        against = a;
      }
    }
    for (int a = 0; a < at.k; ++a)
      if (z[first + a] > least_impulse || a == against) active_.push_back(first + a);
  }
}

// Of friction that sticks at the bound the equations without it would leave a part undetermined.
void ActiveSetStart::list_bounds(const ContactProblem& problem, const PolygonUnknowns& at, const Eigen::VectorXd& z,
                                 double least_impulse, double least_slip) {
  for (int f = 0; f < at.rough_count(); ++f) {
    double left = problem.mu[at.rough[f]] * z[at.rough[f]], friction = 0;
    for (int a = 0; a < at.k; ++a) friction += z[at.first_direction(f) + a];
    left -= friction;
    if (z[at.slip_bound(f)] > least_slip || (friction > least_impulse && left <= least_impulse))
      active_.push_back(at.slip_bound(f));
  }
}

}  // namespace cb
