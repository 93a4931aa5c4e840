#pragma once

// Stored contact problems with references of the convex model, and a judge of it that uses no code of the solver.

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "contact/problem.h"

namespace cb::test {

struct Reference {
  bool given = false;
  double dKE = 0;         // J
  std::vector<double> u;  // 3 nc, m/s
};

struct StoredProblem {
  ContactProblem problem;
  Reference bounded, unbounded;
  double kappa = 0;
};

inline StoredProblem load_stored(const std::string& file) {
  StoredProblem out;
  ContactProblem& p = out.problem;
  std::ifstream in(file);
  std::string word;
  int blocks = 0, nc = 0;
  in >> word >> blocks;
  for (int b = 0; b < blocks; ++b) {
    int size = 0;
    in >> size;
    p.M.add_block(size);
  }
  in >> word;
  for (double& x : p.M.values) in >> x;
  in >> word >> nc;
  for (int c = 0; c < nc; ++c) {
    int entries = 0;
    in >> entries;
    p.J.add_band();
    for (int e = 0; e < entries; ++e) {
      int block = 0;
      in >> block;
      const int k = p.J.add_entry(block, p.M.block_size(block));
      for (int i = 0; i < 3 * p.M.block_size(block); ++i) in >> p.J.values[p.J.offset[k] + i];
    }
  }
  const auto read = [&](std::vector<double>& x, int size) {
    in >> word;
    x.resize(size);
    for (double& value : x) in >> value;
  };
  read(p.v_minus, p.nv());
  read(p.offset, 3 * nc);
  read(p.mu, nc);
  p.restitution.assign(nc, 0.0);
  for (Reference* r : {&out.bounded, &out.unbounded}) {
    int given = 0;
    in >> word >> given;
    r->given = given != 0;
    if (!r->given) continue;
    in >> r->dKE;
    r->u.resize(3 * nc);
    for (double& x : r->u) in >> x;
  }
  in >> word >> out.kappa;
  return out;
}

inline Eigen::MatrixXd dense_mass(const ContactProblem& p) {
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(p.nv(), p.nv());
  for (int b = 0; b < p.M.blocks(); ++b)
    M.block(p.M.first[b], p.M.first[b], p.M.block_size(b), p.M.block_size(b)) = p.M.block(b);
  return M;
}
inline Eigen::MatrixXd dense_jacobian(const ContactProblem& p) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3 * p.nc(), p.nv());
  for (int c = 0; c < p.nc(); ++c)
    for (int e = p.J.band[c]; e < p.J.band[c + 1]; ++e)
      J.block(3 * c, p.M.first[p.J.block[e]], 3, p.M.block_size(p.J.block[e])) += p.J.entry(e);
  return J;
}
inline Eigen::VectorXd vector(const std::vector<double>& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<int>(x.size()));
}

/// What an answer of the convex model is worth, from dense matrices and the definitions alone.
struct Verdict {
  double gap = 0;            ///< J
  double infeasibility = 0;  ///< of impulses and normal velocities, scaled by sqrt(energy)
  double least_sum = 0;      ///< how far the claim of the least frictionless sum is from proven, -
  double dKE = 0;            ///< r.q + r.W r / 2, J
  double size = 0;           ///< J
  double KE_before = 0, KE_after = 0;
  Eigen::VectorXd v, u;
};

inline Verdict judge_convex(const ContactProblem& p, const ContactSolution& s) {
  Verdict out;
  const int nc = p.nc();
  const Eigen::MatrixXd M = dense_mass(p), J = dense_jacobian(p);
  const Eigen::LLT<Eigen::MatrixXd> llt(M);
  const ConvexWitness& proof = s.as<ConvexWitness>();
  const Eigen::VectorXd v0 = vector(p.v_minus), w = vector(p.offset), r = vector(s.impulse), eta = vector(proof.eta);
  const Eigen::VectorXd q = J * v0 + w;
  out.v = v0 + llt.solve(J.transpose() * r);
  out.u = J * out.v + w;
  out.dKE = r.dot(q) + 0.5 * r.dot(J * llt.solve(J.transpose() * r));
  out.KE_before = 0.5 * v0.dot(M * v0);
  out.KE_after = 0.5 * out.v.dot(M * out.v);
  Eigen::VectorXd weight(nc), normal_eta = Eigen::VectorXd::Zero(3 * nc);
  const Eigen::MatrixXd W = J * llt.solve(J.transpose());
  for (int c = 0; c < nc; ++c) {
    const double t = W(3 * c + 1, 3 * c + 1) + W(3 * c + 2, 3 * c + 2);
    weight[c] = t > 0 ? (W(3 * c, 3 * c) + t) / 3 : W(3 * c, 3 * c);
    normal_eta[3 * c] = eta[c];
    out.size += q.segment(3 * c, 3).squaredNorm() / weight[c];
  }
  const double size = std::sqrt(out.size);
  const Eigen::VectorXd y = out.u - W * normal_eta;

  // Islands: contacts that share a block, spread until nothing changes.
  std::vector<int> island(nc);
  for (int c = 0; c < nc; ++c) island[c] = c;
  for (bool changed = true; changed;) {
    changed = false;
    for (int i = 0; i < nc; ++i)
      for (int j = 0; j < nc; ++j)
        for (int e = p.J.band[i]; e < p.J.band[i + 1]; ++e)
          for (int f = p.J.band[j]; f < p.J.band[j + 1]; ++f)
            if (p.J.block[e] == p.J.block[f] && island[i] != island[j]) {
              island[i] = island[j] = std::min(island[i], island[j]);
              changed = true;
            }
  }
  const auto violated = [&](double x) { out.infeasibility = std::max(out.infeasibility, x / size); };
  for (int g = 0; g < nc; ++g) {
    double slack = 0, sum = 0, kappa = 0;
    for (int c = 0; c < nc; ++c) {
      if (island[c] != g) continue;
      const double missing = p.mu[c] * y.segment(3 * c + 1, 2).norm() - y[3 * c];
      if (proof.bounded)
        slack = std::max(slack, missing);
      else
        violated(missing / std::sqrt(weight[c]));
      sum += r[3 * c];
      if (proof.bounded) kappa += proof.frictionless[c];
    }
    for (int c = 0; c < nc; ++c) {
      if (island[c] != g) continue;
      const double root = std::sqrt(weight[c]);
      out.gap += eta[c] * out.u[3 * c] + r.segment(3 * c, 3).dot(y.segment(3 * c, 3)) + slack * r[3 * c];
      violated(-out.u[3 * c] / root);
      violated(-r[3 * c] * root);
      violated(-eta[c] * root);
      violated((r.segment(3 * c + 1, 2).norm() - p.mu[c] * r[3 * c]) * root);
      if (proof.bounded) violated((sum - kappa) * root);
    }
    if (proof.bounded) out.gap += slack * (kappa - sum);
  }
  if (proof.bounded) {
    Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * nc);
    for (int c = 0; c < nc; ++c) f[3 * c] = proof.frictionless[c];
    const Eigen::VectorXd u = W * f + q, Nz = J * vector(proof.kappa_dual);
    const auto unproven = [&](double x) { out.least_sum = std::max(out.least_sum, x); };
    for (int c = 0; c < nc; ++c) {
      const double root = std::sqrt(weight[c]), fc = f[3 * c] * root / size, uc = u[3 * c] / root / size;
      unproven(-fc);
      unproven(-uc);
      unproven(std::min(fc, uc));
      if (uc <= 1e-9) unproven(Nz[3 * c] - 1);
      if (fc > 1e-9) unproven(std::abs(Nz[3 * c] - 1));
    }
  }
  return out;
}

}  // namespace cb::test
