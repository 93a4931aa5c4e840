// Poisson's restitution that gains no energy.
//
// Poisson: of a compression's normal impulses r_n restitution gives e r_n back, and a phase that takes energy only
// stops what approaches then. That bounds no energy where friction or coupled contacts let e r_n do work on velocities
// that it did not come from. Here, on each island that is bounded,
//   theta e r_n,  theta <= 1 the largest with  E(theta) = E_0 + theta a + theta^2 b <= 0                    J
//   E_0 = r.(u_c + u-)/2,   a = g.u_c,   b = g.W g/2,   g = e r_n along the normals, u_c after compression
// E is what contacts have gained by then as seen from the stops: driven ones (w != 0) put in -r.w besides. E_0 <= 0,
// since r = 0 is admissible, and b >= 0, so that theta is the larger root, or 1.
//
// Source: the difference of anitescu_potra.cpp and drumwright_shell.cpp from their sources, where theta = 1.
// Cannot fail: without numbers in the data theta = 1, and the answer is refused for what it is.

#include "methods/restitution.h"

#include <algorithm>
#include <cmath>

namespace cb {

double Restitution::give_back(const ContactProblem& problem, const BlockCholesky& factor, const Islands& islands,
                              const std::vector<char>& bounded, std::vector<double>& impulse) {
  const int nc = problem.nc();
  asked_.assign(3 * nc, 0.0);
  for (int c = 0; c < nc; ++c) asked_[3 * c] = problem.restitution[c] * impulse[3 * c];
  theta_.assign(islands.count, 1.0);
  if (std::find(bounded.begin(), bounded.end(), 1) != bounded.end()) {
    contact_velocity(problem, problem.v_minus, u_minus_);
    apply_impulse(problem, factor, impulse, v_);
    contact_velocity(problem, v_, u_);
    change_v_.assign(problem.nv(), 0.0);
    multiply_transposed_add(problem.J, problem.M, asked_, change_v_);
    factor.solve_in_place(change_v_);
    change_u_.resize(3 * nc);
    multiply(problem.J, problem.M, change_v_, change_u_);
    energy_.assign(islands.count, {0, 0, 0});
    for (int i = 0; i < 3 * nc; ++i) {
      auto& [constant, linear, quadratic] = energy_[islands.of_contact[i / 3]];
      constant += 0.5 * impulse[i] * (u_[i] + u_minus_[i]);
      linear += asked_[i] * u_[i];
      quadratic += 0.5 * asked_[i] * change_u_[i];
    }
    for (int g = 0; g < islands.count; ++g)
      if (bounded[g]) theta_[g] = scale(energy_[g]);
  }
  given_.resize(nc);
  for (int c = 0; c < nc; ++c) {
    given_[c] = theta_[islands.of_contact[c]] * asked_[3 * c];
    impulse[3 * c] += given_[c];
  }
  apply_impulse(problem, factor, impulse, v_);
  contact_velocity(problem, v_, u_);
  return islands.count > 0 ? *std::min_element(theta_.begin(), theta_.end()) : 1;
}

// The largest theta in [0, 1] at which the polynomial is not positive.
double Restitution::scale(const std::array<double, 3>& energy) const {
  const auto& [constant, a, b] = energy;
  const double c = std::min(constant, 0.0);  // not so by rounding alone
  if (a + b + c <= energy_rounding * (std::abs(a) + b - c)) return 1;
  const double root = std::sqrt(a * a - 4 * b * c);
  return std::min(1.0, a > 0 ? -2 * c / (a + root) : (root - a) / (2 * b));
}

}  // namespace cb
