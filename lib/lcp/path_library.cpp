// The PATH library (Ferris, Munson, Dirkse), where a user has it: loaded at run time, never shipped.
//
// Looked for once, when the table of solvers is built: the file that the environment variable PATH50_LIBRARY names,
// else libpath50.so where the system looks for libraries. A licence is the library's own affair (PATH_LICENSE_STRING).
//
// Problem: the dense form, w = M z + q; an expanded problem is condensed. The library's mixed complementarity problem
// has bounds 0 and 1e20. Its own tolerance is left alone; what it returns is judged by our natural residual.
//
// Returns: solved; inaccurate (the library is content and we are not); unavailable (the licence does not cover a
// problem of this size: the library says so before or during the solve); nonconverged with the library's
// ending; not_finite; singular (the free unknowns).
//
// The interface is written after the calls that its Julia wrapper makes; it has not been run against the library itself
// (docs/methods/path.md). Information is passed as a zeroed block larger than the struct, and no more of it is read
// than the two counts that follow its five numbers.

#include <dlfcn.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <mutex>

#include "lcp/front.h"

namespace cb {

namespace {

constexpr double path_infinity = 1e20;
constexpr std::array<std::string_view, 13> endings{
    "",           "solved",         "no progress", "major iteration limit", "minor iteration limit",
    "time limit", "user interrupt", "bound error", "domain error",          "infeasible",
    "error",      "licence error",  "no ending"};
constexpr int ending_solved = 1, ending_licence = 11;

/// What the library writes; silenced.
struct Output {
  void* data;
  void (*print)(void*, int, char*);
  void (*flush)(void*, int);
};

/// How the library asks for a problem. All that is null is optional.
struct Interface {
  void* data;
  void (*size)(void*, int* n, int* nonzeros);
  void (*bounds)(void*, int n, double* z, double* lower, double* upper);
  int (*function)(void*, int n, double* z, double* f);
  int (*jacobian)(void*, int n, double* z, int want_f, double* f, int* nonzeros, int* column, int* length, int* row,
                  double* value);
  std::array<void*, 6> optional;
};

/// A zeroed block in which the library finds its Information.
struct Information {
  std::array<double, 5> numbers;
  int major_iterations, minor_iterations;
  std::array<char, 512> rest;
};

struct Library {
  std::string missing;  ///< why it cannot be used; empty where it can
  void (*set_output)(Output*) = nullptr;
  int (*check_licence)(int n, int nonzeros) = nullptr;
  void* (*create_options)() = nullptr;
  void (*destroy_options)(void*) = nullptr;
  void (*add_options)(void*) = nullptr;
  void (*default_options)(void*) = nullptr;
  void* (*create)(int n, int nonzeros) = nullptr;
  void (*destroy)(void*) = nullptr;
  void (*set_interface)(void*, Interface*) = nullptr;
  int (*solve)(void*, Information*) = nullptr;
  double* (*answer)(void*) = nullptr;
};

Library open_library() {
  Library library;
  const char* named = std::getenv("PATH50_LIBRARY");
  const std::string file = named != nullptr && *named != 0 ? named : "libpath50.so";
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    library.missing = "the PATH library is not installed (" + file + "; PATH50_LIBRARY names another file)";
    return library;
  }
  const auto find = [&](auto& function, const char* symbol) {
    function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(handle, symbol));
    if (function == nullptr && library.missing.empty()) library.missing = file + " has no function " + symbol;
  };
  find(library.set_output, "Output_SetInterface");
  find(library.check_licence, "Path_CheckLicense");
  find(library.create_options, "Options_Create");
  find(library.destroy_options, "Options_Destroy");
  find(library.add_options, "Path_AddOptions");
  find(library.default_options, "Options_Default");
  find(library.create, "MCP_Create");
  find(library.destroy, "MCP_Destroy");
  find(library.set_interface, "MCP_SetInterface");
  find(library.solve, "Path_Solve");
  find(library.answer, "MCP_GetX");
  if (!library.missing.empty()) dlclose(handle);
  return library;
}

/// Loaded at most once, for the life of the program.
const Library& library() {
  static const Library loaded = open_library();
  return loaded;
}

void give_size(void* data, int* n, int* nonzeros) {
  *n = static_cast<const LcpProblem*>(data)->n();
  *nonzeros = *n * *n;
}

void give_bounds(void*, int n, double* z, double* lower, double* upper) {
  std::fill(z, z + n, 0.0);
  std::fill(lower, lower + n, 0.0);
  std::fill(upper, upper + n, path_infinity);
}

int give_function(void* data, int n, double* z, double* f) {
  const auto& problem = *static_cast<const LcpProblem*>(data);
  Eigen::Map<Eigen::VectorXd>(f, n) = problem.M * Eigen::Map<const Eigen::VectorXd>(z, n) + problem.q;
  return 0;
}

// By columns, indices from one.
int give_jacobian(void* data, int n, double* z, int want_f, double* f, int* nonzeros, int* column, int* length,
                  int* row, double* value) {
  const auto& problem = *static_cast<const LcpProblem*>(data);
  if (want_f != 0) give_function(data, n, z, f);
  int count = 0;
  for (int j = 0; j < n; ++j) {
    column[j] = count + 1;
    for (int i = 0; i < n; ++i) {
      if (problem.M(i, j) == 0) continue;
      row[count] = i + 1;
      value[count++] = problem.M(i, j);
    }
    length[j] = count + 1 - column[j];
  }
  *nonzeros = count;
  return 0;
}

/// The library keeps state of its own: one solve at a time.
std::mutex one_at_a_time;

void solve(const LcpOptions& options, const Front& front, LcpSolution& solution) {
  const int n = front.form().n();
  const auto refuse = [&](LcpStatus status, std::string reason) {
    solution.status = status;
    solution.reason = std::move(reason);
  };
  const Library& path = library();
  if (!path.missing.empty()) return refuse(LcpStatus::unavailable, path.missing);

  const std::lock_guard lock(one_at_a_time);
  static Output silence{nullptr, [](void*, int, char*) {}, [](void*, int) {}};
  path.set_output(&silence);
  const int nonzeros = n * n;
  const std::string no_licence = "licence refused by the PATH library: " + std::to_string(n) + " unknowns, " +
                                 std::to_string(nonzeros) + " nonzeros";
  if (path.check_licence(n, nonzeros) == 0) return refuse(LcpStatus::unavailable, no_licence);

  void* settings = path.create_options();
  path.add_options(settings);
  path.default_options(settings);
  void* mcp = path.create(n, nonzeros + 1);
  LcpProblem dense = front.form();  // the library takes what it may write to
  Interface interface {
    &dense, give_size, give_bounds, give_function, give_jacobian, {}
  };
  path.set_interface(mcp, &interface);
  Information information{};
  const int ending = path.solve(mcp, &information);
  const double* z = path.answer(mcp);
  if (z != nullptr) solution.z = Eigen::Map<const Eigen::VectorXd>(z, n).cwiseMax(0.0);
  path.destroy(mcp);
  path.destroy_options(settings);

  solution.pivots = information.minor_iterations;
  solution.residual = natural_residual(front.given(), solution.z);
  if (ending == ending_licence) return refuse(LcpStatus::unavailable, no_licence);
  if (!solution.z.allFinite()) return refuse(LcpStatus::not_finite, "the PATH library returned no finite answer");
  if (ending == ending_solved) {
    solution.status = solution.residual <= options.tolerance ? LcpStatus::solved : LcpStatus::inaccurate;
    if (solution.status == LcpStatus::inaccurate)
      solution.reason = "solved, says the PATH library, by its own tolerance";
    return;
  }
  const auto known = std::size_t(ending) < endings.size() ? std::size_t(ending) : endings.size() - 1;
  refuse(LcpStatus::nonconverged, "the PATH library ends with: " + std::string(endings[known]));
}

struct PathLibrary {
  static constexpr Wants wants = Wants::dense_matrix;
  LcpOptions options;
  explicit PathLibrary(const LcpOptions& o) : options(o) {}
  void solve(const Front& front, LcpSolution& solution) const { cb::solve(options, front, solution); }
};

}  // namespace

LcpSolverRow path_library_row() {
  return {"path-lib", "the PATH library, loaded at run time where a user has it",
          "Dirkse and Ferris 1995; Ferris and Munson, PATH 5", library().missing, behind_front<PathLibrary>};
}

}  // namespace cb
