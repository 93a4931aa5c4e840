#include "cone/cone_workspace.h"

#include <cmath>

namespace cb {

namespace {

void find_scales(const ConeProgram& p, const std::vector<double>& q, ConeScales<double>& scales) {
  const int nc = p.nc();
  double speed = 0, weight = 0;
  for (int c = 0; c < nc; ++c) {
    const double* q_c = &q[3 * c];
    const double along = (*p.mu)[c] > 0 ? q_c[1] * q_c[1] + q_c[2] * q_c[2] : 0;  // else nothing depends on it
    speed += (q_c[0] * q_c[0] + along) / (*p.weight)[c];
    weight += std::log((*p.weight)[c]);
  }
  speed = std::sqrt(speed);
  scales.mean_weight = nc > 0 ? std::exp(weight / nc) : 1;
  const double impulse = p.impulse_size * std::sqrt(scales.mean_weight);
  const double ratio = impulse > 0 && impulse < speed ? impulse / speed : 1;
  scales.size = speed * std::sqrt(ratio);
  scales.mean_weight /= ratio;
  scales.w_r.resize(nc);
  scales.w_eta.resize(nc);
  for (int c = 0; c < nc; ++c) {
    scales.w_r[c] = (*p.weight)[c] / ratio;
    scales.w_eta[c] = (*p.weight)[c] * ratio;
  }
  scales.ratio = ratio;
}

}  // namespace

void ConeWorkspace::prepare(const ConeProgram& p, const ConeOptions& options) {
  newton.prepare(p, options.least_block);
  q.resize(3 * p.nc());
  multiply(*p.J, *p.M, *p.v0, q);
  for (int i = 0; i < 3 * p.nc(); ++i) q[i] += (*p.offset)[i];
  find_scales(p, q, scales);
}

Certificate check(const ConeProgram& p, const ConeOptions& options, ConeWorkspace& w, ConeSolution& x,
                  bool at_rounding) {
  w.velocities.evaluate(p, x.r, eta_of(p, x));
  Certificate certificate = certify(p, x.r, x.eta, w.velocities, w.q);
  const double exact = exact_gap * w.scales.size * w.scales.size;
  if (certificate.infeasibility > options.feasibility || (!at_rounding && std::abs(certificate.gap) > exact)) {
    w.velocities.bound_rounding(p, x.r, {});
    certificate = certify(p, x.r, x.eta, w.velocities, w.q, options.rounding_units);
  }
  x.gap = certificate.gap;
  x.infeasibility = certificate.infeasibility;
  return certificate;
}

}  // namespace cb
