// Siconos' answer to a problem (optional: libsiconos-numerics-dev), for contactbench to judge:
//   siconos_answer nsgs|nsn_ac PROBLEM ANSWER      PROBLEM is {text} of docs/external.md
// It is given W = J M^-1 J^T, dense, and q = J v + w; options are its defaults, but for tolerance and iterations.

#include <FrictionContactProblem.h>
#include <Friction_cst.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <NumericsVerbose.h>
#include <SolverOptions.h>

#include <cstdio>
#include <fstream>

#include "problem_text.h"

namespace {

/// W, column by column, and q.
void local_form(const outside::Problem& p, std::vector<double>& W, std::vector<double>& q) {
  const int n = 3 * p.nc;
  W.assign(static_cast<std::size_t>(n) * n, 0.0);
  q = p.w;
  for (const outside::Entry& from : p.entries) {
    const int at = p.first[from.block], size = p.first[from.block + 1] - at;
    for (int j = 0; j < size; ++j)
      for (int row = 0; row < 3; ++row) q[3 * from.contact + row] += from.J[row + 3 * j] * p.v[at + j];
    for (int column = 0; column < 3; ++column) {
      std::vector<double> x(size);
      for (int j = 0; j < size; ++j) x[j] = from.J[column + 3 * j];
      outside::solve_in_place(p.M[from.block], size, x.data());
      for (const outside::Entry& to : p.entries) {
        if (to.block != from.block) continue;
        for (int j = 0; j < size; ++j)
          for (int row = 0; row < 3; ++row)
            W[3 * to.contact + row + static_cast<std::size_t>(n) * (3 * from.contact + column)] +=
                to.J[row + 3 * j] * x[j];
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const bool newton = std::string(argv[1]) == "nsn_ac";
  outside::Problem p;
  std::ifstream in(argv[2], std::ios::binary);
  if (!outside::read(in, false, p)) return 2;
  std::vector<double> W, q, r(3 * p.nc, 0.0), u(3 * p.nc, 0.0);
  local_form(p, W, q);
  numerics_set_verbose(0);
  NumericsMatrix* M = NM_create_from_data(NM_DENSE, 3 * p.nc, 3 * p.nc, W.data());
  FrictionContactProblem* problem = frictionContactProblem_new_with_data(3, p.nc, M, q.data(), p.mu.data());
  SolverOptions* options = solver_options_create(newton ? SICONOS_FRICTION_3D_NSN_AC : SICONOS_FRICTION_3D_NSGS);
  options->dparam[SICONOS_DPARAM_TOL] = 1e-13;
  options->iparam[SICONOS_IPARAM_MAX_ITER] = newton ? 1000 : 1000000;
  const int code = fc3d_driver(problem, r.data(), u.data(), options);
  std::FILE* out = std::fopen(argv[3], "w");
  if (!out) return 2;
  for (const double x : r) std::fprintf(out, "%.17g\n", x);
  std::fclose(out);
  std::fprintf(stderr, "siconos_answer: code %d, residual %g\n", code, options->dparam[SICONOS_DPARAM_RESIDU]);
  return 0;  // whether it is an answer others judge
}
