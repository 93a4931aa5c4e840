// Linearly implicit joint forces.
//
// Problem: rates of a tree (tree.nv) after a step of h s whose joint forces are those of its end, to first order:
//   M (qd' - qd) = h (f - D (qd' - qd) - h K qd') + impulses,   f: all forces at the start,
// so that (M + h D + h^2 K) (qd' - qd) = h (f - h K qd) + impulses. The matrix is symmetric and positive definite where
// K and D are symmetric and not negative. Source: Rosenbrock-Wanner methods, Hairer, Wanner, Solving Ordinary
// Differential Equations II, IV.7; Baraff, Witkin, Large Steps in Cloth Simulation (1998), eq. 6. Differences: K and D
// are those of springs, dampers and motors alone, and of motors that know M the part that is symmetric; what they miss
// is explicit, of the same order in h.
#include "dynamics/implicit_joints.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace cb {

ImplicitJoints::ImplicitJoints(JointGains passive, JointGains motors)
    : passive_(std::move(passive)), motors_(std::move(motors)), now_(passive_) {}

void ImplicitJoints::begin(double h) {
  h_ = h;
  for (std::size_t i = 0; i < passive_.stiffness.size(); ++i) {
    now_.stiffness[i] = passive_.stiffness[i] + motors_.stiffness[i];
    now_.damping[i] = passive_.damping[i] + motors_.damping[i];
    now_.stiffness_by_mass[i] = std::sqrt(passive_.stiffness_by_mass[i] + motors_.stiffness_by_mass[i]);
    now_.damping_by_mass[i] = std::sqrt(passive_.damping_by_mass[i] + motors_.damping_by_mass[i]);
  }
}

void ImplicitJoints::saturate(int rate) {
  if (now_.stiffness.empty()) return;  // all explicit
  now_.stiffness[rate] = passive_.stiffness[rate];
  now_.damping[rate] = passive_.damping[rate];
  now_.stiffness_by_mass[rate] = std::sqrt(passive_.stiffness_by_mass[rate]);
  now_.damping_by_mass[rate] = std::sqrt(passive_.damping_by_mass[rate]);
}

void ImplicitJoints::add_to(const Tree& tree, Eigen::Ref<Eigen::MatrixXd> M) const {
  if (h_ == 0) return;
  const Eigen::Index nv = tree.nv;
  const auto part = [&](const std::vector<double>& of) { return Eigen::VectorXd::Map(&of[tree.v], nv); };
  const auto k = part(now_.stiffness_by_mass), d = part(now_.damping_by_mass);
  for (Eigen::Index j = 0; j < nv; ++j)
    for (Eigen::Index i = 0; i < nv; ++i) M(i, j) *= 1 + h_ * d[i] * d[j] + h_ * h_ * k[i] * k[j];
  M.diagonal() += h_ * part(now_.damping) + h_ * h_ * part(now_.stiffness);
}

void ImplicitJoints::accelerations(const Model& model, const Tree& tree, const State& state, std::span<double> qdd) {
  const Eigen::Index nv = tree.nv;
  const auto part = [&](const std::vector<double>& of) { return Eigen::VectorXd::Map(&of[tree.v], nv); };
  const auto k = part(now_.stiffness_by_mass), qd = part(state.qd);
  auto a = Eigen::VectorXd::Map(qdd.data(), nv);
  M_.resize(nv, nv);
  composite_body_.mass_matrix(model, tree, state, M_);
  force_.noalias() = M_ * a;
  a = k.cwiseProduct(qd);  // of K: S M S qd
  force_ -= h_ * (k.cwiseProduct(M_ * a) + part(now_.stiffness).cwiseProduct(qd));
  add_to(tree, M_);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> in_place(M_);
  a = in_place.solve(force_);
}

}  // namespace cb
