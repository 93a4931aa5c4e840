#include "contact/parting.h"

#include <algorithm>
#include <cmath>

namespace cb {

double normal_terms(const ContactProblem& problem, int c) {
  const BandMatrix& J = problem.J;
  double sum = std::abs(problem.offset[3 * c]);
  for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
    const double* row = J.values.data() + J.offset[e];
    const int first = problem.M.first[J.block[e]], size = problem.M.block_size(J.block[e]);
    for (int i = 0; i < size; ++i) sum += std::abs(row[3 * i] * problem.v_minus[first + i]);
  }
  return sum;
}

bool any_parts(const ContactProblem& problem) {
  const BandMatrix& J = problem.J;
  for (int c = 0; c < problem.nc(); ++c) {
    double u_n = problem.offset[3 * c];
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* row = J.values.data() + J.offset[e];
      const int first = problem.M.first[J.block[e]], size = problem.M.block_size(J.block[e]);
      for (int i = 0; i < size; ++i) u_n += row[3 * i] * problem.v_minus[first + i];
    }
    if (!(u_n <= 0)) return true;
  }
  return false;
}

void island_speeds(const Islands& islands, const std::vector<double>& u, std::vector<double>& speed) {
  speed.assign(islands.count, 0.0);
  for (std::size_t i = 0; i < u.size(); ++i) {
    double& largest = speed[islands.of_contact[i / 3]];
    largest = std::max(largest, std::abs(u[i]));
  }
}

}  // namespace cb
