#pragma once

#include <array>
#include <vector>

#include "contact/islands.h"
#include "contact/problem.h"

namespace cb {

/// Poisson's restitution without a gain of energy, for methods of two phases: of the impulses r of compression each
/// contact gets theta e r_n back; on islands where that is asked for theta <= 1 is the largest by which the island
/// gains no energy, whatever the second phase does (restitution.cpp).
class Restitution {
 public:
  /// -: gain of energy over the sum of its terms that counts as rounding.
  static constexpr double energy_rounding = 1e-14;

  /// Adds theta e r_n to `impulse` (3 nc, N s; r on entry) and returns the least theta. `bounded`: per island;
  /// elsewhere theta = 1, as published. `factor` must hold M's factor.
  double give_back(const ContactProblem& problem, const BlockCholesky& factor, const Islands& islands,
                   const std::vector<char>& bounded, std::vector<double>& impulse);
  /// nc, N s: theta e r_n.
  const std::vector<double>& given() const { return given_; }
  /// v- + M^-1 J^T of the impulses then, nv; and J v + w, 3 nc, m/s.
  const std::vector<double>& v() const { return v_; }
  const std::vector<double>& u() const { return u_; }

 private:
  double scale(const std::array<double, 3>& energy) const;

  std::vector<double> given_, v_, u_, u_minus_, asked_, change_v_, change_u_, theta_;
  std::vector<std::array<double, 3>> energy_;  // per island, J: what is gained, as a polynomial in theta
};

}  // namespace cb
