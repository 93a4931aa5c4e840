// An engine's own contact problem and answer: written as a stored problem, and judged as every answer is.
#include "own_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "contact/problem_files.h"
#include "contact/referee.h"

namespace cb {

namespace {

using Json = nlohmann::json;
using Eigen::Vector3d;

double law_residual(const ContactProblem& problem, const std::vector<double>& impulse) {
  ContactSolution answer;
  answer.impulse = impulse;
  std::vector<double> v_plus;
  // Distance from Coulomb's law is the same whatever law is claimed.
  const Residuals residuals = Referee().check(problem, answer, newton_law(), v_plus);
  return residuals.finite ? residuals.law.value_or(NAN) : NAN;
}

/// Projection on the friction cone |r_t| <= mu r_n.
Vector3d project(const Vector3d& r, double mu) {
  const double t = std::hypot(r[1], r[2]);
  if (t <= mu * r[0]) return r;
  if (mu * t <= -r[0]) return Vector3d::Zero();
  const double n = (r[0] + mu * t) / (1 + mu * mu);
  return {n, mu * n * r[1] / t, mu * n * r[2] / t};
}

double worst_momentum(const OwnProblem& own) {
  const ContactProblem& problem = own.problem;
  std::vector<double> change(own.v_plus), left(change.size());
  for (std::size_t i = 0; i < change.size(); ++i) change[i] -= problem.v_minus[i];
  multiply(problem.M, change, left);
  std::vector<double> right(left.size(), 0.0);
  multiply_transposed_add(problem.J, problem.M, own.impulse, right);
  // Of what the impulses are made of: those on a stack cancel in each body.
  ContactProblem sizes = problem;
  for (double& x : sizes.J.values) x = std::abs(x);
  std::vector<double> impulse(own.impulse), size(left.size(), 0.0);
  for (double& x : impulse) x = std::abs(x);
  multiply_transposed_add(sizes.J, sizes.M, impulse, size);
  double worst = 0;
  for (int b = 0; b < problem.M.blocks(); ++b) {
    double error = 0, of = 0;
    for (int i = problem.M.first[b]; i < problem.M.first[b + 1]; ++i) {
      error = std::max(error, std::abs(left[i] - right[i]));
      of = std::max({of, std::abs(left[i]), size[i]});
    }
    if (error > 0) worst = std::max(worst, error / of);
  }
  return worst;
}

/// Natural map of the engine's regularised convex program over friction cones, of the size of impulses and velocities.
double own_residual(const OwnProblem& own, const BlockCholesky& factor) {
  const ContactProblem& problem = own.problem;
  std::vector<double> v_plus, u, u_minus, weight;
  apply_impulse(problem, factor, own.impulse, v_plus);
  contact_velocity(problem, v_plus, u);
  contact_velocity(problem, problem.v_minus, u_minus);
  contact_weights(problem, factor, weight);
  double error = 0, impulses = 0, after = 0, before = 0;
  for (int c = 0; c < problem.nc(); ++c) {
    const Vector3d r(&own.impulse[3 * c]), R(&own.compliance[3 * c]), uc(&u[3 * c]);
    const double w = weight[c];
    error += w * (r - project(r - (uc + R.cwiseProduct(r)) / w, problem.mu[c])).squaredNorm();
    impulses += w * r.squaredNorm();
    after += uc.squaredNorm() / w;
    before += Vector3d(&u_minus[3 * c]).squaredNorm() / w;
  }
  const double size = std::max({impulses, after, before});
  return size > 0 ? std::sqrt(error / size) : 0;
}

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(); }

}  // namespace

OwnMeasures measure(const OwnProblem& own) {
  OwnMeasures out;
  BlockCholesky factor;
  factor.factor(own.problem.M);
  std::vector<double> v_plus;
  apply_impulse(own.problem, factor, own.impulse, v_plus);
  for (std::size_t i = 0; i < v_plus.size(); ++i)
    out.velocity = std::max(out.velocity, std::abs(v_plus[i] - own.v_plus[i]));
  out.momentum = worst_momentum(own);
  out.law = law_residual(own.problem, own.impulse);
  ContactProblem bare = own.problem;
  bare.offset.assign(bare.offset.size(), 0.0);
  out.law_bare = law_residual(bare, own.impulse);
  out.own = own.compliance.empty() || own.law.find("pyramid") != std::string::npos ? NAN : own_residual(own, factor);
  return out;
}

namespace {

void write(const std::string& folder, long step, double t, const OwnProblem& own, const Engine& engine,
           const EngineSetting& setting) {
  const std::string stem = fmt::format("{}/step_{:09}", folder, step);
  StoredAnswer answer;
  answer.impulse = own.impulse;
  answer.v_plus = own.v_plus;
  contact_velocity(own.problem, own.v_plus, answer.u_plus);
  write_contact_problem(stem + ".hdf5", own.problem, fmt::format("{} {}, step {}", engine.name, setting.variant, step),
                        {}, &answer);
  const OwnMeasures measures = measure(own);
  double deepest = 0;
  for (const double R : own.compliance) deepest = std::max(deepest, R);
  const Json json = {{"engine", engine.name},
                     {"version", engine.version},
                     {"variant", setting.variant},
                     {"knobs", setting.knobs},
                     {"step_s", setting.step},
                     {"step", step},
                     {"t", t},
                     {"contacts", own.problem.nc()},
                     {"velocities", own.problem.nv()},
                     {"law", own.law},
                     {"offset", own.offset_means},
                     {"compliance_per_kg", own.compliance},
                     {"largest_compliance_per_kg", deepest},
                     {"momentum_error", number(measures.momentum)},
                     {"velocity_error", number(measures.velocity)},
                     {"law_residual", number(measures.law)},
                     {"law_residual_without_offset", number(measures.law_bare)},
                     {"own_residual", number(measures.own)}};
  std::ofstream file(stem + ".json");
  file << json.dump(1) << '\n';
  if (!file) throw FileError(stem + ".json: could not be written");
}

}  // namespace

OwnProblems::OwnProblems(const Engine& engine, const EngineSetting& setting, std::string folder, long every)
    : engine_(engine), setting_(setting), folder_(std::move(folder)), every_(every) {}

void OwnProblems::keep(const EngineWorld& world, long step, double t) {
  if (folder_.empty()) return;
  if (!world.problem)
    throw Unsupported("--save-problems: " + engine_.name + " does not give its contact problems away");
  if (world.problem(own_) && met_++ % every_ == 0) write(folder_, step, t, own_, engine_, setting_);
}

}  // namespace cb
