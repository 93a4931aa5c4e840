#pragma once

#include <vector>

#include "cone/cone_program.h"
#include "cone/kkt_system.h"

namespace cb {

/// A Newton step of the methods in double: with
///   dr = c_r - G (J dw + d ds),   deta = c_eta - D N dv,   dw = dv - M^-1 N^T deta  (of v_hat)
/// and M dv = J^T dr one sparse system in the velocities dv, dw (kkt_system.h), bordered by the row of the bound.
/// Whoever linearises sets G, D, c_r and c_eta; scratch is kept.
class NewtonSystem {
 public:
  /// Of this program, which must stay alive; the structure of the systems is kept while it stays the same.
  void prepare(const ConeProgram& program, double least_block);

  std::vector<double> G;      ///< 9 nc: 3 x 3 a contact, column-major, kg
  std::vector<double> D;      ///< nc, kg; empty where there is no eta
  std::vector<double> c_r;    ///< 3 nc, N s
  std::vector<double> c_eta;  ///< nc, N s; empty where there is no eta

  /// False where a pivot fails.
  bool factor();
  /// The step for a known ds.
  void solve(double ds_known);
  /// The step with d.dr = rhs + diagonal ds. False where the pivot of that row fails.
  bool solve_bordered(double diagonal, double rhs);

  std::vector<double> d;     ///< 3 nc: row of the bound
  std::vector<double> dr;    ///< 3 nc, N s
  std::vector<double> deta;  ///< nc, N s; zero where there is no eta
  double ds = 0;             ///< m/s
  std::vector<double> J_dw;  ///< 3 nc, m/s
  std::vector<double> N_dv;  ///< nc, m/s, where there is eta

  const KktSystem& kkt() const { return kkt_; }

 private:
  void solve_velocities();
  void factor_border();
  void find_deta();
  bool two() const { return program_->has_eta(); }

  const ConeProgram* program_ = nullptr;
  KktSystem kkt_;
  std::vector<double> h1_, h2_;  // nv: right-hand sides, then dv and dw
  double border_pivot_ = 0;      // of the bound's row but for its diagonal, and
  bool border_ready_ = false;    // are it, g1_, g2_ and t_ those of the present factors?
  std::vector<double> g1_, g2_;  // nv: answers to the border's column
  std::vector<double> t_, M_g_;  // 3 nc: d - J g2_; nv
};

}  // namespace cb
