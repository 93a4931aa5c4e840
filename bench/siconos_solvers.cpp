// Our solvers of exact Coulomb friction beside Siconos' (optional: libsiconos-numerics-dev), in one run, on stored
// contact problems: those of the tests, or files and folders that are named. contest.h has turns and times.
//   bench_siconos_solvers [--limit SECONDS] [--rounds N] [--accepted RESIDUAL] [--csv FILE] [WORD | PATH ...]
// Siconos is given W = J M^-1 J^T and q = J v- + w, which is not counted, in each storage that its documentation names
// for the solver, and with each of its two factorisations (users' guide, "Friction-contact problems"; options other
// than these, tolerance and number of iterations are its defaults); ours are given M, its factor and J, and what they
// form of them is counted. Everybody starts from zero, e = 0. The referee judges all alike: residual of Coulomb's law
// (docs/judging.md), accepted up to 1e-8. Tolerances are in other measures: where the referee doesn't accept an answer
// for 1e-8, 1e-9, ... 1e-13 is asked for instead, and what counts is the time for the first that it accepts.

#include <dlfcn.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "contest.h"
#include "methods/weigh.h"
#include "ncp/ncp.h"

#ifdef HAVE_SICONOS
#include <FrictionContactProblem.h>
#include <Friction_cst.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <NumericsVerbose.h>
#include <SolverOptions.h>
#include <SparseBlockMatrix.h>
#endif

namespace {

using namespace cb;

struct Problem {
  std::string name;
  StoredProblem stored;
  Eigen::MatrixXd W;      ///< 3 nc x 3 nc
  std::vector<double> q;  ///< 3 nc
  BlockCholesky factor;   ///< of M
  std::vector<double> weight;

  const ContactProblem& contact() const { return stored.problem; }
  NcpProblem ncp() const {
    const ContactProblem& p = contact();
    return {&p.M, &factor, &p.J, p.v_minus, p.offset, p.mu, weight, {}};
  }
};

Problem read(const std::string& path) {
  Problem out;
  out.name = std::filesystem::path(path).stem().string();
  out.stored = read_contact_problem(path, {.symmetrise = true});
  ContactProblem& contact = out.stored.problem;
  contact.restitution.assign(contact.restitution.size(), 0.0);
  ContactSolution not_asked;
  if (!weigh(contact, out.factor, out.weight, not_asked)) throw FileError(path + ": " + not_asked.reason);
  if (out.stored.W.rows() > 0) {
    out.W = out.stored.W;
    out.q = out.stored.q;
  } else {
    delassus(contact, out.factor, out.W);
    contact_velocity(contact, contact.v_minus, out.q);
  }
  return out;
}

double law_residual(const ContactProblem& contact, const ContactSolution& solution) {
  if (solution.impulse.size() != 3 * static_cast<std::size_t>(contact.nc())) return HUGE_VAL;
  std::vector<double> v_plus;
  // The measure is the same whatever law is claimed.
  const Residuals residuals = Referee().check(contact, solution, newton_law(), v_plus);
  return residuals.finite ? residuals.law.value_or(HUGE_VAL) : HUGE_VAL;
}

/// A solver of ours, called anew for each tolerance.
struct Own {
  const NcpSolverRow* row = nullptr;
  NcpProblem problem;
  double tolerance = 1e-8;
  NcpSolver solver;
  NcpSolution solution;

  void prepare() {
    if (solver) return;
    NcpOptions options;
    options.tolerance = tolerance;
    options.accepted = std::max(options.accepted, tolerance);
    solver = row->make(options);
  }
};

Contestant ours(const NcpSolverRow& row, const Problem& problem, double accepted) {
  const auto data = std::make_shared<Own>();
  data->row = &row;
  data->problem = problem.ncp();
  return {"coulomb " + std::string(row.name),
          [data] { data->solver(data->problem, data->solution); },
          [data, &contact = problem.contact()](Report& report) {
            report.claims = data->solution.status == NcpStatus::solved;
            set_status(report, std::string(name(data->solution.status)));
            report.asked = data->tolerance;
            report.iterations = data->solution.iterations;
            ContactSolution solution;
            solution.impulse = data->solution.r;
            report.residual = law_residual(contact, solution);
          },
          0,
          accepted,
          [data] { data->prepare(); },
          [data] {
            data->solver = nullptr;
            return (data->tolerance /= 10) > 0.9e-13;
          }};
}

#ifdef HAVE_SICONOS
enum class Storage { dense, sparse, blocks };

struct PeerSolver {
  int id;
  const char* name;
  Storage storage;
  int iterations;                               ///< limit; the time limit stops what is left
  NSM_linear_solver factorisation = NSM_MUMPS;  ///< of sparse matrices; Newton's method takes MUMPS whatever is asked
};
constexpr PeerSolver peer_solvers[] = {
    {SICONOS_FRICTION_3D_NSGS, "NSGS, blocks", Storage::blocks, 10'000'000},
    {SICONOS_FRICTION_3D_NSGS, "NSGS, dense", Storage::dense, 10'000'000},
    {SICONOS_FRICTION_3D_NSN_AC, "NSN_AC, sparse", Storage::sparse, 1'000},
    {SICONOS_FRICTION_3D_NSN_AC, "NSN_AC, dense", Storage::dense, 1'000},
    {SICONOS_FRICTION_3D_PROX, "PROX, sparse", Storage::sparse, 10'000},
    {SICONOS_FRICTION_3D_PROX, "PROX, dense", Storage::dense, 10'000},
    {SICONOS_FRICTION_3D_ADMM, "ADMM, mumps", Storage::sparse, 10'000'000},
    {SICONOS_FRICTION_3D_ADMM, "ADMM, csparse", Storage::sparse, 10'000'000, NSM_CSPARSE},
    {SICONOS_FRICTION_3D_ACLMFP, "ACLMFP, blocks", Storage::blocks, 100'000}};

/// What a solver is called with; Siconos writes into its problems, so that each contestant has its own.
struct Peer {
  PeerSolver solver;
  std::vector<double> W, q, mu, r, u;
  NumericsMatrix* M = nullptr;  ///< made once; released with the process
  SolverOptions* options = nullptr;
  double tolerance = 1e-8;
  int code = 0;

  int contacts() const { return static_cast<int>(mu.size()); }

  NumericsMatrix* make_matrix() {
    const int n = 3 * contacts();
    NumericsMatrix* dense = NM_create_from_data(NM_DENSE, n, n, W.data());
    if (solver.storage == Storage::dense) return dense;
    // An entry of the size of rounding is left out; with a threshold of zero the zeros would be kept.
    double largest = 0;
    for (const double x : W) largest = std::max(largest, std::abs(x));
    NumericsMatrix* sparse = NM_create(NM_SPARSE, n, n);
    NM_copy_to_sparse(dense, sparse, 1e-16 * largest);
    NM_setSparseSolver(sparse, solver.factorisation);
    if (solver.storage == Storage::sparse) return sparse;
    SparseBlockStructuredMatrix* blocks = SBM_new();
    SBM_from_csparse(3, NM_csc(sparse), blocks);
    return NM_create_from_data(NM_SPARSE_BLOCK, n, n, blocks);
  }

  void prepare() {
    if (M == nullptr) M = make_matrix();
    if (options != nullptr) solver_options_delete(options);
    options = solver_options_create(solver.id);
    options->dparam[SICONOS_DPARAM_TOL] = tolerance;
    options->iparam[SICONOS_IPARAM_MAX_ITER] = solver.iterations;
    r.assign(q.size(), 0.0);
    u.assign(q.size(), 0.0);
  }

  void solve() {
    FrictionContactProblem* friction = frictionContactProblem_new_with_data(3, contacts(), M, q.data(), mu.data());
    code = fc3d_driver(friction, r.data(), u.data(), options);
    std::free(friction);  // its arrays are ours
  }
};

Contestant peer(const PeerSolver& solver, const Problem& problem, double accepted) {
  const auto data = std::make_shared<Peer>();
  data->solver = solver;
  data->W.assign(problem.W.data(), problem.W.data() + problem.W.size());
  data->q = problem.q;
  data->mu = problem.contact().mu;
  return {std::string("siconos ") + solver.name,
          [data] { data->solve(); },
          [data, &contact = problem.contact()](Report& report) {
            report.claims = data->code == 0;
            set_status(report, data->code == 0 ? "solved" : "failed, code " + std::to_string(data->code));
            report.asked = data->tolerance;
            report.iterations = data->options->iparam[SICONOS_IPARAM_ITER_DONE];
            ContactSolution solution;
            solution.impulse = data->r;
            report.residual = law_residual(contact, solution);
          },
          0,
          accepted,
          [data] { data->prepare(); },
          [data] { return (data->tolerance /= 10) > 0.9e-13; }};
}
#endif

std::vector<Contestant> contestants_of(const Problem& problem, double accepted) {
  std::vector<Contestant> out;
  for (const NcpSolverRow& row : ncp_solvers()) out.push_back(ours(row, problem, accepted));
#ifdef HAVE_SICONOS
  for (const PeerSolver& solver : peer_solvers) out.push_back(peer(solver, problem, accepted));
#endif
  return out;
}

double least(const Line& line) { return line.times.front(); }
double middle(const Line& line) { return line.times[line.times.size() / 2]; }

/// Solved, by the referee's word.
bool solves(const Contestant& contestant, const Line& line) {
  return line.ended && line.report.residual <= contestant.accepted;
}

void print_line(const Problem& problem, const Contestant& contestant, const Line& line, std::FILE* csv) {
  const Report& report = line.report;
  const bool good = solves(contestant, line);
  std::string verdict = good ? (report.claims ? "ok" : "not claimed") : report.claims ? "false claim" : "fails";
  if (!line.ended) verdict = line.ending;
  const double fastest = line.ended ? least(line) : NAN, median = line.ended ? middle(line) : NAN;
  std::printf("%-36s %-22s %11.1f %11.1f %9d %8.0e %9.1e  %-20s %s\n", problem.name.c_str(), contestant.name.c_str(),
              1e6 * fastest, 1e6 * median, report.iterations, report.asked, report.residual, report.status,
              verdict.c_str());
  if (csv == nullptr) return;
  std::fprintf(csv, "%s,%d,%d,\"%s\",%d,%.6g,%.6g,%d,%.3g,%.6g,\"%s\",\"%s\"\n", problem.name.c_str(),
               problem.contact().nc(), problem.contact().nv(), contestant.name.c_str(), good, fastest, median,
               report.iterations, report.asked, line.ended ? report.residual : NAN, report.status, verdict.c_str());
}

/// Files that are stored problems, in order of their names; a word stands for those of the tests that contain it.
std::vector<std::string> files_of(const std::vector<std::string>& words) {
  namespace fs = std::filesystem;
  std::vector<std::string> out;
  const auto add = [&](const fs::path& folder, const std::string& word) {
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.path().extension() == ".hdf5" && entry.path().filename().string().find(word) != std::string::npos)
        out.push_back(entry.path().string());
  };
  for (const std::string& word : words.empty() ? std::vector<std::string>{""} : words) {
    if (fs::is_directory(word)) {
      add(word, "");
    } else if (fs::exists(word)) {
      out.push_back(word);
    } else {
      for (const char* folder : {"problems", "stacks"}) add(fs::path(SOURCE_ROOT) / "test/data" / folder, word);
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

struct Flags {
  Limits limits{.solve_s = 5, .solves_law = 1e-8};
  std::string csv;
  std::vector<std::string> words;
  bool good = true;
};

Flags read_flags(int argc, char** argv) {
  Flags out;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    const bool value = i + 1 < argc;
    if (flag == "--limit" && value)
      out.limits.solve_s = std::max(0.1, std::atof(argv[++i]));
    else if (flag == "--rounds" && value)
      out.limits.rounds = std::max(1, std::atoi(argv[++i]));
    else if (flag == "--accepted" && value)
      out.limits.solves_law = std::atof(argv[++i]);
    else if (flag == "--csv" && value)
      out.csv = argv[++i];
    else if (flag.starts_with("-"))
      out.good = false;
    else
      out.words.push_back(flag);
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const Flags flags = read_flags(argc, argv);
  if (!flags.good) {
    std::fprintf(stderr,
                 "bench_siconos_solvers [--limit SECONDS] [--rounds N] [--accepted RESIDUAL] [--csv FILE] "
                 "[WORD | PATH ...]\n");
    return 2;
  }
  if (!fclib_available()) {
    std::printf("The stored problems need HDF5: %s\n", std::string(fclib_unavailable_reason()).c_str());
    return 0;
  }
  // One thread for everybody.
  if (void* set_threads = dlsym(RTLD_DEFAULT, "openblas_set_num_threads"))
    reinterpret_cast<void (*)(int)>(set_threads)(1);
#ifdef HAVE_SICONOS
  numerics_set_verbose(0);
#else
  std::printf("Siconos Numerics is missing (libsiconos-numerics-dev): our solvers alone.\n\n");
#endif
  Report* shared = shared_report();
  std::FILE* csv = flags.csv.empty() ? nullptr : std::fopen(flags.csv.c_str(), "w");
  if (shared == nullptr || (!flags.csv.empty() && csv == nullptr)) {
    std::fprintf(stderr, "bench_siconos_solvers: no shared memory, or --csv cannot be written\n");
    return 1;
  }
  if (csv != nullptr)
    std::fprintf(csv,
                 "problem,contacts,velocities,solver,solved,time_min_s,time_median_s,iterations,asked,law_residual,"
                 "status,verdict\n");
  std::printf("%-36s %-22s %11s %11s %9s %8s %9s  %-20s %s\n", "problem", "solver", "min us", "median us", "iter.",
              "asked", "residual", "says", "checked");
  int code = 0;
  for (const std::string& path : files_of(flags.words)) try {
      const Problem problem = read(path);
      const std::vector<Contestant> contestants = contestants_of(problem, flags.limits.solves_law);
      const std::vector<Line> lines = take_turns(contestants, flags.limits, shared);
      for (std::size_t i = 0; i < lines.size(); ++i) print_line(problem, contestants[i], lines[i], csv);
      std::fflush(stdout);
      if (csv != nullptr) std::fflush(csv);
    } catch (const FileError& error) {
      std::fprintf(stderr, "bench_siconos_solvers: %s\n", error.what());
      code = 1;
    }
  if (csv != nullptr) std::fclose(csv);
  return code;
}
