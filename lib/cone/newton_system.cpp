// With g = J^T G d the rows are
//   (M + N^T D N) dv - M dw = N^T c_eta,    M dv + J^T G J dw + g ds = J^T c_r
//   d.dr = rhs + diagonal ds  <=>  g.dw + (d.G d + diagonal) ds = d.c_r - rhs

#include "cone/newton_system.h"

#include <algorithm>

#include "cone/rows.h"

namespace cb {

using Eigen::Vector3d;

void NewtonSystem::prepare(const ConeProgram& p, double least_block) {
  const int nc = p.nc(), nv = p.nv();
  program_ = &p;
  kkt_.prepare(*p.M, *p.J, least_block);
  d.assign(3 * nc, 0.0);
  for (int c = 0; c < nc; ++c) d[3 * c] = p.share_of(c);
  G.resize(9 * nc);
  c_r.resize(3 * nc);
  D.resize(p.has_eta() ? nc : 0);
  c_eta.resize(p.has_eta() ? nc : 0);
  dr.resize(3 * nc);
  deta.assign(nc, 0.0);
  J_dw.resize(3 * nc);
  N_dv.resize(nc);
  for (auto* x : {&h1_, &h2_, &g1_, &g2_, &M_g_}) x->resize(nv);
  t_.resize(3 * nc);
}

bool NewtonSystem::factor() {
  border_ready_ = false;
  return kkt_.factor(G, D);
}

void NewtonSystem::solve(double ds_known) {
  ds = ds_known;
  if (ds == 0)
    dr = c_r;
  else
    for (int c = 0; c < program_->nc(); ++c)
      vec3(&dr[3 * c]) = vec3(&c_r[3 * c]) - ds * (mat3(&G[9 * c]) * vec3(&d[3 * c]));
  solve_velocities();
  for (int c = 0; c < program_->nc(); ++c) {
    Vector3d dy = vec3(&J_dw[3 * c]);
    if (ds != 0) dy += ds * vec3(&d[3 * c]);
    vec3(&dr[3 * c]) = vec3(&c_r[3 * c]) - mat3(&G[9 * c]) * dy;
  }
  find_deta();
}

bool NewtonSystem::solve_bordered(double diagonal, double border_rhs) {
  const int nc = program_->nc();
  dr = c_r;
  solve_velocities();
  if (!border_ready_) factor_border();
  const double pivot = diagonal + border_pivot_;
  if (!(pivot > 0)) return false;
  double rhs = -border_rhs;
  for (int c = 0; c < nc; ++c) {
    vec3(&dr[3 * c]) = vec3(&c_r[3 * c]) - mat3(&G[9 * c]) * vec3(&J_dw[3 * c]);
    rhs += vec3(&d[3 * c]).dot(vec3(&dr[3 * c]));
  }
  ds = 0;
  for (int refinement = 0; refinement < 2; ++refinement) {
    const double more = rhs / pivot;
    ds += more;
    rhs = -border_rhs - diagonal * ds;
    for (int c = 0; c < nc; ++c) {
      auto dr_c = vec3(&dr[3 * c]);
      dr_c.noalias() -= more * (mat3(&G[9 * c]) * vec3(&t_[3 * c]));
      rhs += vec3(&d[3 * c]).dot(dr_c);
    }
  }
  for (std::size_t i = 0; i < h2_.size(); ++i) h2_[i] -= ds * g2_[i];
  if (two())
    for (std::size_t i = 0; i < h1_.size(); ++i) h1_[i] -= ds * g1_[i];
  for (int i = 0; i < 3 * nc; ++i) J_dw[i] += ds * (t_[i] - d[i]);
  find_deta();
  return true;
}

// Of the rows without the border, for J^T dr; into h1_, h2_ and J_dw.
void NewtonSystem::solve_velocities() {
  const ConeProgram& p = *program_;
  std::fill(h2_.begin(), h2_.end(), 0.0);
  multiply_transposed_add(*p.J, *p.M, dr, h2_);
  if (two()) {
    std::fill(h1_.begin(), h1_.end(), 0.0);
    add_normals(p, c_eta, h1_);
    kkt_.solve_in_place(h1_, h2_);
  } else {
    kkt_.solve_in_place(h2_);
  }
  multiply(*p.J, *p.M, h2_, J_dw);
}

// With t = d - J g2 the Schur complement is t.G t + g2.(M A^-1 M) g2: a sum of squares, no cancellation.
void NewtonSystem::factor_border() {
  const ConeProgram& p = *program_;
  std::fill(g1_.begin(), g1_.end(), 0.0);
  std::fill(g2_.begin(), g2_.end(), 0.0);
  for (int c = 0; c < p.nc(); ++c) vec3(&dr[3 * c]) = mat3(&G[9 * c]) * vec3(&d[3 * c]);
  multiply_transposed_add(*p.J, *p.M, dr, g2_);
  if (two())
    kkt_.solve_in_place(g1_, g2_);
  else
    kkt_.solve_in_place(g2_);
  multiply(*p.J, *p.M, g2_, t_);
  multiply(*p.M, two() ? g1_ : g2_, M_g_);
  border_pivot_ = 0;
  for (std::size_t i = 0; i < g2_.size(); ++i) border_pivot_ += g2_[i] * M_g_[i];
  for (int c = 0; c < p.nc(); ++c) {
    auto t = vec3(&t_[3 * c]);
    t = vec3(&d[3 * c]) - t;
    const Vector3d Gt = mat3(&G[9 * c]) * t;
    border_pivot_ += t.dot(Gt);
  }
  border_ready_ = true;
}

void NewtonSystem::find_deta() {
  if (!two()) return;
  normals(*program_, h1_, N_dv);
  for (int c = 0; c < program_->nc(); ++c) deta[c] = c_eta[c] - D[c] * N_dv[c];
}

}  // namespace cb
