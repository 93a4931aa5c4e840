// Cost of the convex method (kappa's frictionless solve included) on stacks of unit cubes with four contacts an
// interface: at rest, perturbed (random velocity of 0.05 m/s), and a single box that slides; and of its parts.
// Times are CPU times. Complexity is fitted over 16 to 256 boxes.

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "cone/kkt_system.h"
#include "methods/drumwright_shell.h"

namespace {

using namespace cb;

ContactProblem stack(int boxes, double mu) {
  ContactProblem p;
  for (int i = 0; i < boxes; ++i) {
    const int b = p.M.add_block(6);
    for (int k = 0; k < 3; ++k) {
      p.M.block(b)(k, k) = 1;
      p.M.block(b)(3 + k, 3 + k) = 1.0 / 6;
    }
  }
  // Rows n = y, t1 = x, t2 = z; velocity of the corner r: v + omega x r.
  const auto entry = [&](int body, double x, double y, double z, double sign) {
    const int e = p.J.add_entry(body, 6);
    const double rows[3][6] = {{0, 1, 0, -z, 0, x}, {1, 0, 0, 0, z, -y}, {0, 0, 1, y, -x, 0}};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 6; ++j) p.J.entry(e)(i, j) = sign * rows[i][j];
  };
  for (int i = 0; i < boxes; ++i)
    for (int corner = 0; corner < 4; ++corner) {
      const double x = corner & 1 ? 0.5 : -0.5, z = corner & 2 ? 0.5 : -0.5;
      p.J.add_band();
      if (i > 0) entry(i - 1, x, 0.5, z, -1);
      entry(i, x, -0.5, z, 1);
      p.mu.push_back(mu);
      p.restitution.push_back(0);
      p.offset.insert(p.offset.end(), 3, 0.0);
    }
  p.v_minus.assign(6 * boxes, 0.0);
  for (int i = 0; i < boxes; ++i) p.v_minus[6 * i + 1] = -0.0098;
  return p;
}

void run(benchmark::State& state, const ContactProblem& problem, const DrumwrightShell::Tolerances& tolerances) {
  DrumwrightShell method(tolerances);
  ContactSolution solution;
  for (auto _ : state) {
    method(problem, solution);
    benchmark::DoNotOptimize(solution.impulse.data());
  }
  state.counters["factorisations"] = solution.iterations;
  state.counters["status"] = static_cast<double>(solution.status);
  state.SetComplexityN(static_cast<std::int64_t>(problem.v_minus.size() / 6));
}

void stack_at_rest(benchmark::State& state) { run(state, stack(static_cast<int>(state.range(0)), 0.5), {}); }
void stack_perturbed(benchmark::State& state) {
  ContactProblem problem = stack(static_cast<int>(state.range(0)), 0.5);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (double& v : problem.v_minus) v += 0.05 * normal(random);
  run(state, problem, {});
}
/// The interior point method by itself: no bound, cold, one factorisation an iteration.
void interior_point(benchmark::State& state) {
  ContactProblem problem = stack(static_cast<int>(state.range(0)), 0.5);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (double& v : problem.v_minus) v += 0.05 * normal(random);
  BlockCholesky factor;
  factor.factor(problem.M);
  const std::vector<double> weight(problem.nc(), 2.0);
  ConeProgram program{&problem.M, &factor, &problem.J, &problem.v_minus, &problem.offset, &problem.mu, &weight};
  InteriorPoint solver;
  ConeSolution solution;
  for (auto _ : state) {
    solver.solve(program, solution);
    benchmark::DoNotOptimize(solution.r.data());
  }
  state.counters["factorisations"] = solution.iterations;
  state.counters["entries"] = static_cast<double>(solver.system().factor_entries());
  state.SetComplexityN(state.range(0));
}
/// What no step can be without: M + J^T D J factored, and solved with once.
void factor_and_solve(benchmark::State& state) {
  const ContactProblem problem = stack(static_cast<int>(state.range(0)), 0.5);
  KktSystem system;
  system.prepare(problem.M, problem.J, 3);
  std::vector<double> G(9 * static_cast<std::size_t>(problem.nc()), 0.0), h(problem.v_minus.size());
  for (std::size_t i = 0; i < G.size(); ++i) G[i] = i % 9 % 4 == 0 ? 1.0 : 0.0;
  for (auto _ : state) {
    system.factor(G, {});
    h.assign(h.size(), 1.0);
    system.solve_in_place(h);
    benchmark::DoNotOptimize(h.data());
  }
}
void box_sliding(benchmark::State& state) {
  ContactProblem problem = stack(1, 0.1);
  problem.v_minus[0] = 0.05;
  run(state, problem, {});
}
void box_sticking_on_a_ramp(benchmark::State& state) {
  ContactProblem problem = stack(1, 0.7);
  problem.v_minus[0] = 0.0049;
  problem.v_minus[1] = -0.0085;
  run(state, problem, {});
}

BENCHMARK(factor_and_solve)->Arg(1)->Arg(16)->Arg(64)->Arg(1000);
BENCHMARK(box_sliding);
BENCHMARK(box_sticking_on_a_ramp);
BENCHMARK(stack_at_rest)->Arg(1)->Arg(4);
BENCHMARK(stack_at_rest)->RangeMultiplier(4)->Range(16, 256)->Complexity();
BENCHMARK(stack_perturbed)->Arg(1)->Arg(4);
BENCHMARK(stack_perturbed)->RangeMultiplier(4)->Range(16, 256)->Complexity();
BENCHMARK(interior_point)->RangeMultiplier(4)->Range(1, 4);
BENCHMARK(interior_point)->RangeMultiplier(4)->Range(16, 256)->Complexity();

}  // namespace

BENCHMARK_MAIN();
