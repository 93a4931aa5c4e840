// Our solvers beside Siconos Numerics (optional: libsiconos-numerics-dev), in one run, on the stored stack problems:
// unit cubes on each other, four contacts an interface, at rest (`rest`) and with random velocities (`rnd`).
// Turns, times and judgement: contest.h. Reading, W and conversions are not counted.
//   bench_peers [--limit SECONDS] [--rounds N] [WORD]     only the problems whose name contains the word

#include <dlfcn.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "contest.h"
#include "lcp/lcp.h"
#include "lcp/lcp_files.h"
#include "methods/registry.h"

#ifdef HAVE_SICONOS
#include <LinearComplementarityProblem.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <NumericsVerbose.h>
#include <SolverOptions.h>
#include <lcp_cst.h>
#endif

namespace {

using namespace cb;

void print_heading() {
  std::printf("%-18s %-26s %11s %11s %9s  %-26s %9s  %s\n", "problem", "solver", "min us", "median us", "iter.",
              "claims", "residual", "checked");
}

void print_line(const std::string& problem, const Contestant& contestant, const Line& line) {
  std::printf("%-18s %-26s ", problem.c_str(), contestant.name.c_str());
  if (!line.ended) {
    std::printf("%11s %11s %9s  %-26s %9s  %s\n", "-", "-", "-", "-", "-", line.ending.c_str());
    return;
  }
  const Report& report = line.report;
  const bool solves = report.residual <= contestant.accepted;
  std::string verdict = solves ? (report.claims ? "ok" : "ok, not claimed") : report.claims ? "FALSE CLAIM" : "fails";
  if (contestant.target_s > 0) {
    char words[64];
    std::snprintf(words, sizeof words, "; target %g us: %s", 1e6 * contestant.target_s,
                  solves && line.times.front() <= contestant.target_s ? "met" : "MISSED");
    verdict += words;
  }
  std::printf("%11.1f %11.1f %9d  %-26s %9.1e  %s\n", 1e6 * line.times.front(), 1e6 * line.times[line.times.size() / 2],
              report.iterations, report.status, report.residual, verdict.c_str());
}

void compare(const std::string& problem, const std::vector<Contestant>& contestants, const Limits& limits,
             Report* shared) {
  const std::vector<Line> lines = take_turns(contestants, limits, shared);
  for (std::size_t i = 0; i < contestants.size(); ++i) print_line(problem, contestants[i], lines[i]);
  std::printf("\n");
  std::fflush(stdout);
}

Contestant our_lcp(std::string_view solver_name, const LcpProblem& problem, double target_s, const Limits& limits) {
  const auto solve = find_lcp_solver(solver_name)->make({});
  const auto solution = std::make_shared<LcpSolution>();
  return {std::string(solver_name), [=, &problem] { solve(problem, *solution); },
          [=, &problem](Report& report) {
            report.claims = solution->status == LcpStatus::solved;
            set_status(report, std::string(name(solution->status)));
            report.iterations = solution->pivots;
            report.residual = natural_residual(problem, solution->z);
          },
          target_s, limits.solves_lcp};
}

Contestant our_ap(const ContactProblem& problem, int k, double target_s, const Limits& limits) {
  MethodOptions options;
  options.k = k;
  const ContactMethod method = find_method("ap")->make(options);
  const auto solution = std::make_shared<ContactSolution>();
  return {"ap (lemke, assembly too)", [=, &problem] { method(problem, *solution); },
          [=, &problem](Report& report) {
            report.claims = solution->status == Status::ok;
            set_status(report, std::string(name(solution->status)));
            report.iterations = solution->iterations;
            std::vector<double> v_plus;
            report.residual = Referee().check(problem, *solution, anitescu_potra_law(), v_plus).model;
          },
          target_s, limits.solves_lcp};
}

/// The residual is the larger of the checked relative gap and the worst scaled violation of a constraint.
Contestant our_convex(const ContactProblem& problem, double target_s) {
  MethodOptions options;
  options.epsilon_relative = 1e-8;
  const ContactMethod method = find_method("convex")->make(options);
  const auto solution = std::make_shared<ContactSolution>();
  return {"convex (ipm, kappa too)", [=, &problem] { method(problem, *solution); },
          [=, &problem](Report& report) {
            report.claims = solution->status == Status::ok;
            std::vector<double> v_plus;
            const Residuals residuals = Referee().check(problem, *solution, convex_law(), v_plus);
            const double gap = residuals.gap ? std::abs(*residuals.gap) / residuals.energy_before : HUGE_VAL;
            report.residual = std::max(gap, residuals.infeasibility.value_or(HUGE_VAL));
            char words[40];
            std::snprintf(words, sizeof words, "%s (law %.0e)", std::string(name(solution->status)).c_str(),
                          residuals.law.value_or(HUGE_VAL));
            set_status(report, words);
            report.iterations = solution->iterations;
          },
          target_s, 1e-8};
}

#ifdef HAVE_SICONOS
struct PeerSolver {
  int id;
  const char* name;
  double tolerance;
  int iterations;  ///< limit; the time limit stops what is left
};
constexpr PeerSolver peer_lcp_solvers[] = {{SICONOS_LCP_LEMKE, "siconos Lemke (lexico)", 1e-10, 100000},
                                           {SICONOS_LCP_PIVOT, "siconos pivot", 1e-10, 100000},
                                           {SICONOS_LCP_AVI_CAOFERRIS, "siconos AVI Cao-Ferris", 1e-10, 100000},
                                           {SICONOS_LCP_NEWTON_FB_FBLSA, "siconos Newton FB", 1e-10, 1000},
                                           {SICONOS_LCP_NEWTON_MIN_FBLSA, "siconos Newton min", 1e-10, 1000}};

/// Siconos writes into its problems: each contestant has its own copy. Released with the process.
struct PeerData {
  std::vector<double> M, q, mu, z, w;
  int code = 0, iterations = 0;
};

void say(const PeerData& data, Report& report) {
  report.claims = data.code == 0;
  set_status(report, data.code == 0 ? "solved" : "failed, code " + std::to_string(data.code));
  report.iterations = data.iterations;
}

Contestant peer_lcp(const PeerSolver& solver, const LcpProblem& problem, const Limits& limits) {
  const auto data = std::make_shared<PeerData>();
  data->M.assign(problem.M.data(), problem.M.data() + problem.M.size());
  data->q.assign(problem.q.data(), problem.q.data() + problem.n());
  const auto solve = [data, solver, n = problem.n()] {
    data->z.assign(static_cast<std::size_t>(n), 0.0);
    data->w.assign(static_cast<std::size_t>(n), 0.0);
    NumericsMatrix* M = NM_create_from_data(NM_DENSE, n, n, data->M.data());
    LinearComplementarityProblem lcp{n, M, data->q.data()};
    SolverOptions* options = solver_options_create(solver.id);
    options->dparam[SICONOS_DPARAM_TOL] = solver.tolerance;
    options->iparam[SICONOS_IPARAM_MAX_ITER] = solver.iterations;
    data->code = linearComplementarity_driver(&lcp, data->z.data(), data->w.data(), options);
    data->iterations = options->iparam[SICONOS_IPARAM_ITER_DONE];
    solver_options_delete(options);
    M->matrix0 = nullptr;
    NM_free(M);
  };
  return {solver.name, solve,
          [data, &problem](Report& report) {
            say(*data, report);
            report.residual = natural_residual(problem, Eigen::Map<Eigen::VectorXd>(data->z.data(), problem.n()));
          },
          0, limits.solves_lcp};
}
#endif

/// Seconds, as the work order asks; 0 where it asks nothing.
double lemke_target(bool rest, int boxes, int k) {
  if (rest && boxes == 1) return 10e-6;
  if (rest && boxes == 4) return 100e-6;
  if (rest && boxes == 16 && k == 4) return 10e-3;
  if (!rest && boxes == 16) return k == 4 ? 40e-3 : 100e-3;
  return 0;
}
double convex_target(bool rest, int boxes) { return boxes == 16 ? (rest ? 1e-3 : 2e-3) : 0; }

void compare_lcp(const std::string& data, const std::string& word, const Limits& limits, Report* shared) {
  std::printf(
      "Anitescu and Potra's model as an LCP. Residual: natural, scaled (lcp/lcp.h); of `ap`, which starts from the\n"
      "contact problem, the law's (contact/referee.h). Accepted up to %.0e.\n\n",
      limits.solves_lcp);
  print_heading();
  for (const bool rest : {true, false})
    for (const int k : {4, 8})
      for (const int boxes : {1, 2, 4, 8, 16}) {
        const std::string scene = std::string(rest ? "rest" : "rnd") + "_n" + std::to_string(boxes);
        const std::string problem_name = scene + "_k" + std::to_string(k);
        if (problem_name.find(word) == std::string::npos) continue;
        const double target = lemke_target(rest, boxes, k);
        const bool have_contact = fclib_available();
        const auto contact = have_contact ? read_contact_problem(data + "stack_" + scene + ".hdf5") : StoredProblem{};
        std::vector<Contestant> contestants;
        // M depends on the configuration alone: a stack at rest and a perturbed one share it, and may share the file.
        LcpProblem problem;
        std::string matrix = data + "stack_" + problem_name + ".M.mtx";
        if (!std::ifstream(matrix).good())
          matrix = data + "stack_" + (rest ? "rnd" : "rest") + problem_name.substr(scene.find('_')) + ".M.mtx";
        if (std::ifstream(matrix).good()) {
          problem = read_lcp_matrix_market(matrix, data + "stack_" + problem_name + ".q.mtx");
          contestants.push_back(our_lcp("lemke", problem, target, limits));
        } else {
          std::printf("%-18s its matrix is not stored\n", problem_name.c_str());
        }
        if (have_contact) contestants.push_back(our_ap(contact.problem, k, target, limits));
        if (problem.n() > 0) {
          contestants.push_back(our_lcp("path", problem, 0, limits));
          contestants.push_back(our_lcp("ynl", problem, 0, limits));
#ifdef HAVE_SICONOS
          for (const PeerSolver& solver : peer_lcp_solvers) contestants.push_back(peer_lcp(solver, problem, limits));
#endif
        }
        compare(problem_name, contestants, limits, shared);
      }
}

void compare_friction(const std::string& data, const std::string& word, const Limits& limits, Report* shared) {
  std::printf(
      "Friction problems. `convex` solves Drumwright and Shell's program to a relative gap of 1e-8, bound on; "
      "residual:\n"
      "larger of the checked relative gap and infeasibility, accepted up to 1e-8, its distance from Coulomb's law "
      "beside\n"
      "its status. The exact law, beside Siconos' solvers of it: bench_siconos_solvers.\n\n");
  print_heading();
  for (const bool rest : {true, false})
    for (const int boxes : {1, 2, 4, 8, 16}) {
      const std::string scene = std::string(rest ? "rest" : "rnd") + "_n" + std::to_string(boxes);
      if (scene.find(word) == std::string::npos) continue;
      const auto contact = read_contact_problem(data + "stack_" + scene + ".hdf5");
      std::vector<Contestant> contestants{our_convex(contact.problem, convex_target(rest, boxes))};
      compare(scene, contestants, limits, shared);
    }
}

}  // namespace

int main(int argc, char** argv) {
  Limits limits;
  std::string word;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    if (flag == "--limit" && i + 1 < argc) {
      limits.solve_s = std::max(0.1, std::atof(argv[++i]));
    } else if (flag == "--rounds" && i + 1 < argc) {
      limits.rounds = std::max(1, std::atoi(argv[++i]));
    } else if (flag.starts_with("-")) {
      std::fprintf(stderr, "bench_peers [--limit SECONDS] [--rounds N] [WORD]\n");
      return 2;
    } else {
      word = flag;
    }
  }
  // One thread for everybody.
  if (void* set_threads = dlsym(RTLD_DEFAULT, "openblas_set_num_threads"))
    reinterpret_cast<void (*)(int)>(set_threads)(1);
#ifdef HAVE_SICONOS
  numerics_set_verbose(0);
  std::printf("Beside us: Siconos Numerics. Time limit of a solve: %g s of CPU.\n\n", limits.solve_s);
#else
  std::printf("Siconos Numerics is missing (libsiconos-numerics-dev): our solvers alone.\n\n");
#endif
  Report* shared = shared_report();
  if (!shared) {
    std::fprintf(stderr, "bench_peers: no shared memory\n");
    return 1;
  }
  try {
    const std::string data = std::string(SOURCE_ROOT) + "/test/data/stacks/";
    compare_lcp(data, word, limits, shared);
    if (fclib_available())
      compare_friction(data, word, limits, shared);
    else
      std::printf("The friction problems need HDF5: %s\n", std::string(fclib_unavailable_reason()).c_str());
  } catch (const FileError& error) {
    std::fprintf(stderr, "bench_peers: %s\n", error.what());
    return 1;
  }
  return 0;
}
