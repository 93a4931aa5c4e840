// CPU time of Lemke's method: the twenty stored stack problems (condensed matrices), and whole calls of `ap` on stacks
// at rest and perturbed. `pivots` and `n` stand beside each time; `residual` is the checked natural residual.

#include "lcp/lcp.h"

#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <fstream>
#include <memory>
#include <random>
#include <string>

#include "lcp/lcp_files.h"
#include "methods/registry.h"

namespace {

using namespace cb;

/// n unit cubes of 1 kg on each other, four corner contacts an interface, velocity of one step of gravity plus noise.
ContactProblem stack(int n, double noise) {
  ContactProblem p;
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-noise, noise);
  for (int b = 0; b < n; ++b) {
    p.M.block(p.M.add_block(6)).diagonal() << 1, 1, 1, 1.0 / 6, 1.0 / 6, 1.0 / 6;
    for (int i = 0; i < 6; ++i) p.v_minus.push_back((i == 1 ? -0.00981 : 0) + (noise > 0 ? uniform(generator) : 0));
  }
  Eigen::Matrix3d axes;
  axes << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const auto add = [&](int body, const Eigen::Vector3d& arm, double sign) {
    auto J = p.J.entry(p.J.add_entry(body, 6));
    for (int row = 0; row < 3; ++row) {
      const Eigen::Vector3d d = axes.row(row);
      J.row(row).head<3>() = sign * d;
      J.row(row).tail<3>() = sign * arm.cross(d);
    }
  };
  for (int b = 0; b < n; ++b)
    for (const double x : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5}) {
        p.J.add_band();
        if (b > 0) add(b - 1, {x, 0.5, z}, -1);
        add(b, {x, -0.5, z}, 1);
        p.mu.push_back(0.5);
        p.restitution.push_back(0);
        p.offset.insert(p.offset.end(), 3, 0.0);
      }
  return p;
}

void stored(benchmark::State& state, const std::string& problem_name) {
  const std::string stem = std::string(SOURCE_ROOT) + "/test/data/stacks/" + problem_name;
  const std::string twin = std::string(SOURCE_ROOT) + "/test/data/stacks/stack_rest_n16_k8";
  const bool own_matrix = std::ifstream(stem + ".M.mtx").good();
  LcpProblem problem;
  try {
    problem = read_lcp_matrix_market((own_matrix ? stem : twin) + ".M.mtx", stem + ".q.mtx");
  } catch (const FileError& error) {
    state.SkipWithError(error.what());
    return;
  }
  const LcpSolver solver = find_lcp_solver("lemke")->make({});
  LcpSolution solution;
  for (auto _ : state) solver(problem, solution);
  state.counters["n"] = problem.n();
  state.counters["pivots"] = solution.pivots;
  state.counters["residual"] = natural_residual(problem, solution.z);
  if (solution.status != LcpStatus::solved) state.SkipWithError(std::string(name(solution.status)).c_str());
}

void method(benchmark::State& state, int boxes, int k, double noise) {
  MethodOptions options;
  options.k = k;
  const ContactMethod ap = find_method("ap")->make(options);
  const ContactProblem problem = stack(boxes, noise);
  ContactSolution solution;
  for (auto _ : state) ap(problem, solution);
  state.counters["n"] = solution.size;
  state.counters["pivots"] = solution.iterations;
  state.counters["residual"] = solution.claimed_residual;
  if (solution.status != Status::ok) state.SkipWithError(std::string(name(solution.status)).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  for (const std::string kind : {"rest", "rnd"})
    for (const int k : {4, 8})
      for (const int boxes : {1, 2, 4, 8, 16}) {
        const std::string name = "stack_" + kind + "_n" + std::to_string(boxes) + "_k" + std::to_string(k);
        benchmark::RegisterBenchmark(("lemke/" + name).c_str(), [name](benchmark::State& s) {
          stored(s, name);
        })->Unit(benchmark::kMicrosecond);
      }
  for (const bool perturbed : {false, true})
    for (const int k : {4, 8})
      for (const int boxes : {1, 2, 4, 8, 16, 32, 64}) {
        const std::string name = std::string("ap/") + (perturbed ? "perturbed" : "rest") +
                                 "/boxes:" + std::to_string(boxes) + "/k:" + std::to_string(k);
        benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& s) {
          method(s, boxes, k, perturbed ? 0.1 : 0.0);
        })->Unit(benchmark::kMicrosecond);
      }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
