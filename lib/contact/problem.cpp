#include "contact/problem.h"

#include <algorithm>
#include <array>

namespace cb {

namespace {

struct StatusText {
  std::string_view name, explanation;
};

constexpr std::array<StatusText, status_count> status_texts{{
    {"ok", "finished, every answer passed the referee"},
    {"inaccurate", "an answer was returned whose checked residual is larger than accepted; the run went on"},
    {"nonconverged", "the limit of sweeps, pivots or iterations was reached without an answer"},
    {"ray", "Lemke's method ended on a secondary ray: it found no solution"},
    {"cycling", "a pivoting method met a basis again"},
    {"singular", "no usable factorisation of a matrix that had to be solved"},
    {"not_finite", "NaN or infinity in the data or on the way"},
    {"energy_blowup", "kinetic energy beyond all that was put in: the step is too large for the scene"},
    {"penetration", "bodies interpenetrate beyond the limit"},
    {"interrupted", "stopped by the user or by a signal"},
    {"write_failed", "a file could not be written (a full disk, most often)"},
    {"event_stall", "two shapes come together too often within one step"},
    {"time_limit", "the time limit was reached"},
    {"memory_limit", "the memory limit was reached"},
    {"crash", "the program failed"},
    {"unavailable", "this solver is not installed here"},
    {"unsupported", "this method cannot do this scene"},
    {"input_error", "the input is wrong"},
}};

}  // namespace

std::string_view name(Status status) { return status_texts[static_cast<std::size_t>(status)].name; }
std::string_view explanation(Status status) { return status_texts[static_cast<std::size_t>(status)].explanation; }

void ContactProblem::clear() {
  M.clear();
  J.clear();
  v_minus.clear();
  offset.clear();
  mu.clear();
  restitution.clear();
}

void WorkWitness::clear() {
  compression.clear();
  restitution.clear();
  friction.clear();
}

void PolygonWitness::clear() {
  k = 0;
  regularisation = 0;
  z.clear();
}

void ConvexWitness::clear() {
  bounded = false;
  epsilon = 0;
  epsilon_relative.reset();
  eta.clear();
  frictionless.clear();
  kappa_dual.clear();
}

void ContactSolution::clear() {
  status = Status::ok;
  reason.clear();
  iterations = size = 0;
  claimed_residual = 0;
  restitution_scale = 1;
  impulse.clear();
  std::visit([](auto& held) { held.clear(); }, witness);
}

void ContactSolution::fail(Status how, std::string why) {
  if (how <= status) return;
  status = how;
  reason = std::move(why);
}

bool is_elastic(const ContactProblem& problem) {
  return std::any_of(problem.restitution.begin(), problem.restitution.end(), [](double e) { return e != 0; });
}

double energy_before(const ContactProblem& problem) {
  double in_offset = 0;
  const bool moved = std::any_of(problem.offset.begin(), problem.offset.end(), [](double w) { return w != 0; });
  if (BlockCholesky factor; moved && factor.factor(problem.M)) {
    std::vector<double> weight;
    contact_weights(problem, factor, weight);
    for (std::size_t i = 0; i < problem.offset.size(); ++i)
      if (weight[i / 3] > 0)
        in_offset = std::max(in_offset, 0.5 * problem.offset[i] * problem.offset[i] / weight[i / 3]);
  }
  return 0.5 * quadratic_form(problem.M, problem.v_minus) + in_offset;
}

void apply_impulse(const ContactProblem& problem, const BlockCholesky& factor, std::span<const double> impulse,
                   std::vector<double>& v_plus) {
  v_plus.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, impulse, v_plus);
  factor.solve_in_place(v_plus);
  for (int i = 0; i < problem.nv(); ++i) v_plus[i] += problem.v_minus[i];
}

void contact_velocity(const ContactProblem& problem, std::span<const double> v, std::vector<double>& u) {
  u.resize(3 * problem.nc());
  multiply(problem.J, problem.M, v, u);
  for (int i = 0; i < 3 * problem.nc(); ++i) u[i] += problem.offset[i];
}

void diagonal_blocks(const ContactProblem& problem, const BlockCholesky& factor, std::vector<Eigen::Matrix3d>& W) {
  const BandMatrix& J = problem.J;
  W.resize(problem.nc());
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, 64, 3> large;
  Eigen::Matrix<double, 6, 3> small;
  for (int c = 0; c < problem.nc(); ++c) {
    W[c].setZero();
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const auto entry = J.entry(e);
      if (entry.cols() == 6) {
        small = entry.transpose();
        factor.solve_block_in_place(J.block[e], small.data(), 3);
        W[c].noalias() += Eigen::Map<const Eigen::Matrix<double, 3, 6>>(entry.data()) * small;
      } else if (entry.cols() <= 64) {
        large = entry.transpose();
        factor.solve_block_in_place(J.block[e], large.data(), 3);
        W[c].noalias() += entry * large;
      } else {
        Eigen::MatrixXd huge = entry.transpose();
        factor.solve_block_in_place(J.block[e], huge.data(), 3);
        W[c].noalias() += entry * huge;
      }
    }
  }
}

void contact_weights(const ContactProblem& problem, const BlockCholesky& factor, std::vector<double>& weight) {
  const BandMatrix& J = problem.J;
  weight.resize(problem.nc());
  for (int c = 0; c < problem.nc(); ++c) {
    double W[3] = {};
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) factor.add_row_norms(J.block[e], J.values.data() + J.offset[e], W);
    const double tangential = W[1] + W[2];
    weight[c] = tangential > 0 ? (W[0] + tangential) / 3 : W[0];
  }
}

bool is_limit(const ContactProblem& problem, int contact) {
  if (problem.mu[contact] != 0) return false;
  const BandMatrix& J = problem.J;
  for (int e = J.band[contact]; e < J.band[contact + 1]; ++e) {
    const auto entry = J.entry(e);
    for (int i = 0; i < entry.cols(); ++i)
      if (entry(1, i) != 0 || entry(2, i) != 0) return false;
  }
  return true;
}

void delassus(const ContactProblem& problem, const BlockCholesky& factor, Eigen::MatrixXd& W) {
  const BandMatrix& J = problem.J;
  const int nc = problem.nc();
  W.setZero(3 * nc, 3 * nc);
  Eigen::Matrix<double, 6, 3> small;  // M_b^-1 J_e^T of a free body
  Eigen::MatrixXd large;              // the same of any other block
  for (int j = 0; j < nc; ++j)
    for (int ej = J.band[j]; ej < J.band[j + 1]; ++ej) {
      const int b = J.block[ej];
      const bool free_body = J.entry(ej).cols() == 6;
      if (free_body) {
        small = J.entry(ej).transpose();
        factor.solve_block_in_place(b, small.data(), 3);
      } else {
        large = J.entry(ej).transpose();
        factor.solve_block_in_place(b, large.data(), 3);
      }
      for (int i = j; i < nc; ++i)
        for (int ei = J.band[i]; ei < J.band[i + 1]; ++ei) {
          if (J.block[ei] != b) continue;
          if (free_body)
            W.block<3, 3>(3 * i, 3 * j).noalias() +=
                Eigen::Map<const Eigen::Matrix<double, 3, 6>>(J.entry(ei).data()) * small;
          else
            W.block<3, 3>(3 * i, 3 * j).noalias() += J.entry(ei) * large;
        }
    }
  W.triangularView<Eigen::StrictlyUpper>() = W.transpose();
}

}  // namespace cb
