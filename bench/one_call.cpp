// One stored problem, answered and checked by a method that is made for it: what a call from Python is held against
// (bench/overhead.py).

#include <benchmark/benchmark.h>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "methods/registry.h"

namespace {

using namespace cb;

void call(benchmark::State& state, const char* problem_name, const char* method_name) {
  const StoredProblem stored =
      read_contact_problem(std::string(SOURCE_ROOT "/test/data/problems/") + problem_name + ".hdf5", {});
  const MethodRow& row = *find_method(method_name);
  for ([[maybe_unused]] auto _ : state) {
    MethodOptions options;
    if (!row.solvers.empty()) options.solver = row.solvers.front().name;
    if (!row.variants.empty()) options.variant = row.variants.front();
    const ContactMethod method = row.make(options);
    ContactSolution solution;
    std::vector<double> v_plus;
    method(stored.problem, solution);
    benchmark::DoNotOptimize(Referee().check(stored.problem, solution, row.law, v_plus));
  }
}

}  // namespace

int main(int argc, char** argv) {
  for (const char* problem :
       {"gen_free_b2_c1_s1", "gen_boxplane_b1_c4_s2", "gen_stack_b4_c16_s1", "gen_stack_b16_c64_s0"})
    for (const char* method : {"newton", "ap", "convex"})
      benchmark::RegisterBenchmark((std::string(problem) + "/" + method).c_str(), call, problem, method);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
