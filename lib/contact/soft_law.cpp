// soft: contacts that give way. Impulses r minimise 1/2 r.(W + R) r + r.q over the friction cones, that is
//   r in K,   y = u + R r in K*,   r.y = 0
// with R = diag(R_n, R_t, R_t) a contact, which follows from the problem and the terms (softness.h). The check is the
// natural map of these conditions, contact by contact. W + R is definite: the answer is unique, impulses too. Of an
// island with restitution (Poisson) the answer is that of two phases: what is left is y_n >= 0, r in K, and that no
// energy comes from nowhere.
//
// A contact alone, W = diag(W_n, w, w): r_n = -u_n / (W_n + R_n), r_t = -u_t / (w + R_t) where that lies in the cone,
// else with slip s = |u_t|
//   r_n = (mu s - u_n) / (W_n + R_n + mu^2 (w + R_t)),   r_t = -mu r_n u_t / s.
// Corners do not stand for a patch: each contact gives way, so that more of them are stiffer.

#include <algorithm>
#include <cmath>

#include "contact/evidence.h"
#include "contact/friction_cone.h"
#include "contact/laws.h"
#include "contact/softness.h"

namespace cb {

namespace {

using Eigen::Vector3d;
using ConstVec3 = Eigen::Map<const Vector3d>;

class SoftCheck {
 public:
  void operator()(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out) {
    diagonal_blocks(problem, at.factor, W_);
    const Softness& softness = solution.as<SoftWitness>().softness;
    Worst worst;
    if (at.elastic) see_gains(solution.impulse, 0, at, Which::elastic, sum_, worst);
    for (int c = 0; c < problem.nc(); ++c) {
      const double w = at.weight[c], mu = problem.mu[c], size = std::sqrt(at.size2[c]), root_w = std::sqrt(w);
      const Regularisation R = regularisation(W_[c], is_limit(problem, c), softness);
      const ConstVec3 r(&solution.impulse[3 * c]);
      const Vector3d y = ConstVec3(&at.u_plus[3 * c]) + Vector3d(R.n, R.t, R.t).cwiseProduct(r);
      if (at.is_elastic(c)) {
        at.see(worst, -y[0] / root_w, size, c);
        at.see(worst, -r[0] * root_w, size, c);
        at.see(worst, (tangential(solution.impulse, c) - mu * r[0]) * root_w, size, c);
      } else {
        at.see(worst, (root_w * (r - project_on_cone(r - y / w, mu))).norm(), size, c);
      }
    }
    worst.report(out);
  }

 private:
  std::vector<Eigen::Matrix3d> W_;
  std::vector<double> sum_;  // per island
};

void rest(const ContactProblem&, const Witness& terms, ContactSolution& solution) {
  solution.as<SoftWitness>() = std::get<SoftWitness>(terms);
}

/// The terms are all that an answer needs.
std::string_view prove(const ImpulsesAlone& answer, ContactSolution& solution) {
  rest(answer.problem, answer.terms, solution);
  return {};
}

class SoftAlone {
 public:
  explicit SoftAlone(const Witness& terms) : terms_(terms) {}
  void operator()(const LoneContact& contact, ContactSolution& answer) const {
    rest(contact.problem, terms_, answer);
    const Eigen::Matrix3d W = Vector3d(contact.W_n, contact.w, contact.w).asDiagonal();
    const Regularisation R = regularisation(W, false, answer.as<SoftWitness>().softness);
    const double mu = contact.problem.mu[0], slip = std::hypot(contact.u[1], contact.u[2]);
    const double normal = contact.W_n + R.n, along = contact.w + R.t;
    double r_n = -contact.u[0] / normal, r_t = slip / along;
    if (r_t > mu * r_n) {
      r_n = (mu * slip - contact.u[0]) / (normal + mu * mu * along);
      r_t = mu * r_n;
    }
    answer.impulse = {r_n, 0, 0};
    for (int i = 1; i < 3 && slip > 0; ++i) answer.impulse[i] = -r_t * contact.u[i] / slip;
    answer.size = 3;
  }

 private:
  Witness terms_;
};

LeaveOut leave_out(const Witness& terms) { return {.closed_form = SoftAlone(terms)}; }

}  // namespace

Law soft_law() {
  return {.name = "soft",
          .check = []() -> LawCheck { return SoftCheck(); },
          .leave_out = leave_out,
          .rest = rest,
          .prove = prove,
          .no_expansion =
              "what slides is lifted and lands again, so that its error has no expansion in the step that "
              "could be extrapolated"};
}

}  // namespace cb
