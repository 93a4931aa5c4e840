#include "methods/convex_island.h"

#include <cmath>

namespace cb {

namespace {

// sqrt(J), of J v- + w at these contacts.
double size_before(const ContactProblem& problem, std::span<const double> weight, std::span<const int> contacts) {
  double size = 0;
  for (const int c : contacts) {
    Eigen::Vector3d u = Eigen::Map<const Eigen::Vector3d>(&problem.offset[3 * c]);
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const auto entry = problem.J.entry(e);
      const double* v = &problem.v_minus[problem.M.first[problem.J.block[e]]];
      for (int j = 0; j < entry.cols(); ++j) u += entry.col(j) * v[j];
    }
    size += u.squaredNorm() / weight[c];
  }
  return std::sqrt(size);
}

}  // namespace

void extract(const ContactProblem& problem, std::span<const double> v0, std::span<const double> weight,
             std::span<const int> contacts, std::span<const int> blocks, std::vector<int>& block_in_island,
             ConvexIsland& out) {
  out.M.clear();
  out.J.clear();
  for (auto* x : {&out.v0, &out.offset, &out.mu, &out.share, &out.weight}) x->clear();
  out.contacts = contacts;
  out.blocks = blocks;
  block_in_island.resize(problem.M.blocks());
  for (const int b : blocks) {
    const int size = problem.M.block_size(b);
    block_in_island[b] = out.M.add_block(size);
    out.M.block(block_in_island[b]) = problem.M.block(b);
    out.v0.insert(out.v0.end(), v0.begin() + problem.M.first[b], v0.begin() + problem.M.first[b + 1]);
  }
  for (const int c : contacts) {
    out.J.add_band();
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const int k = out.J.add_entry(block_in_island[problem.J.block[e]], problem.M.block_size(problem.J.block[e]));
      out.J.entry(k) = problem.J.entry(e);
    }
    out.mu.push_back(problem.mu[c]);
    out.share.push_back(is_limit(problem, c) ? 0 : 1);
    out.weight.push_back(weight[c]);
    out.offset.insert(out.offset.end(), problem.offset.begin() + 3 * c, problem.offset.begin() + 3 * c + 3);
  }
  out.factor.factor(out.M);
  const int nc = out.nc();
  out.no_friction.assign(nc, 0.0);
  out.q.resize(3 * nc);
  multiply(out.J, out.M, out.v0, out.q);
  out.size = 0;
  for (int c = 0; c < nc; ++c) {
    double* q = &out.q[3 * c];
    for (int i = 0; i < 3; ++i) q[i] += out.offset[3 * c + i];
    out.size += (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) / out.weight[c];
  }
  out.size = std::sqrt(out.size);
  out.before = v0.data() == problem.v_minus.data() ? out.size : size_before(problem, weight, contacts);
}

ConeProgram ConvexIsland::program(bool bounded) const {
  ConeProgram out{&M, &factor, &J, &v0, &offset, &mu, &weight};
  out.before = before;
  if (bounded) out.share = &share;
  return out;
}

ConeProgram ConvexIsland::normal_program(bool bounded) const {
  ConeProgram out = program(bounded);
  out.mu = &no_friction;
  return out;
}

double ConvexIsland::sum_of_shares(std::span<const double> x) const {
  double sum = 0;
  for (std::size_t c = 0; c < x.size(); ++c) sum += share[c] * x[c];
  return sum;
}

bool ConvexIsland::has_robot() const {
  for (int b = 0; b < M.blocks(); ++b)
    if (M.block_size(b) != 6) return true;
  return false;
}

}  // namespace cb
