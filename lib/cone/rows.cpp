#include "cone/rows.h"

namespace cb {

void add_normals(const ConeProgram& p, std::span<const double> x, std::span<double> y) {
  const BandMatrix& J = *p.J;
  for (int c = 0; c < J.bands(); ++c) {
    if (x[c] == 0) continue;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* values = J.values.data() + J.offset[e];
      double* out = y.data() + p.M->first[J.block[e]];
      const int cols = (J.offset[e + 1] - J.offset[e]) / 3;
      for (int j = 0; j < cols; ++j) out[j] += values[3 * j] * x[c];
    }
  }
}

void normals(const ConeProgram& p, std::span<const double> v, std::span<double> x) {
  const BandMatrix& J = *p.J;
  for (int c = 0; c < J.bands(); ++c) {
    double sum = 0;
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* values = J.values.data() + J.offset[e];
      const double* in = v.data() + p.M->first[J.block[e]];
      const int cols = (J.offset[e + 1] - J.offset[e]) / 3;
      for (int j = 0; j < cols; ++j) sum += values[3 * j] * in[j];
    }
    x[c] = sum;
  }
}

double sum_of_shares(const ConeProgram& p, std::span<const double> r) {
  double sum = 0;
  for (int c = 0; c < p.nc(); ++c) sum += p.share_of(c) * r[3 * c];
  return sum;
}

}  // namespace cb
