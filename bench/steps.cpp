// Cost of a whole simulated step: forces, collision, assembly, solve, referee, positions. Prints one line a case and
// the exponents of time and memory against the number of boxes. Allocations are counted by standing in front of malloc
// and of `new`, whose own lists (linalg/aligned_new.cpp) would hide them; those that SuiteSparse makes are told apart
// through its own hooks.

#include <SuiteSparse_config.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <new>
#include <random>
#include <string>
#include <vector>

#include "simulation/simulation.h"

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
}

namespace {

long own_allocations = 0, library_allocations = 0;
bool in_library = false;

void count() { ++(in_library ? library_allocations : own_allocations); }

template <class F>
void* from_library(const F& allocate) {
  in_library = true;
  void* memory = allocate();
  in_library = false;
  return memory;
}

}  // namespace

extern "C" {
void* malloc(size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(size_t n, size_t size) {
  count();
  return __libc_calloc(n, size);
}
void* realloc(void* old, size_t size) {
  count();
  return __libc_realloc(old, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, size_t alignment, size_t size) {
  count();
  *out = __libc_memalign(alignment, size);
  return *out ? 0 : 12;
}
}

void* operator new(size_t size) {
  count();
  return __libc_memalign(64, size);
}
void* operator new[](size_t size) { return operator new(size); }
void* operator new(size_t size, const std::nothrow_t&) noexcept { return operator new(size); }
void* operator new[](size_t size, const std::nothrow_t&) noexcept { return operator new(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t) noexcept { std::free(memory); }

namespace {

using namespace cb;

struct Case {
  std::string scene;
  Overrides overrides;
  std::string method;
  MethodOptions options;
  int skip;     ///< steps before measuring: first events, caches
  int steps;    ///< steps in a batch
  int batches;  ///< the minimum and the median over these are printed
};

struct Figure {
  double minimum_us = 0, median_us = 0, own = 0, library = 0, memory_mb = 0;
  Status status = Status::ok;
};

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * 4096 / 1e6;
}

Figure measure(const Case& c) {
  Figure figure;
  const double memory_before = resident_mb();
  const Scenario scenario = load_scenario(find_scenario(c.scene), c.overrides);
  const MethodRow* row = find_method(c.method);
  SimulationOptions options;
  options.step = scenario.step;
  options.duration = 1e9 * scenario.step;
  Simulation simulation(scenario, options, row->make(c.options), row->law);
  for (int i = 0; i < c.skip; ++i) simulation.step();

  const long own = own_allocations, library = library_allocations;
  std::vector<double> batch(static_cast<std::size_t>(c.batches));
  for (double& us : batch) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < c.steps; ++i) {
      const StepRecord& record = simulation.step();
      if (record.status != Status::ok) figure.status = record.status;
    }
    us = 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / c.steps;
  }
  const double steps = static_cast<double>(c.steps) * c.batches;
  figure.own = static_cast<double>(own_allocations - own) / steps;
  figure.library = static_cast<double>(library_allocations - library) / steps;
  figure.memory_mb = std::max(0.0, resident_mb() - memory_before);
  std::sort(batch.begin(), batch.end());
  figure.minimum_us = batch.front();
  figure.median_us = batch[batch.size() / 2];
  return figure;
}

/// The first step of a stack whose boxes begin with velocities of all directions, up to 0.5 m/s and rad/s.
Figure measure_first_step(int boxes, const std::string& method, const MethodOptions& options_of_method) {
  Scenario scenario = load_scenario(find_scenario("stack.xml"), {{"boxes", std::to_string(boxes)}});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> speed(-0.5, 0.5);
  for (double& v : scenario.initial.v) v = speed(random);
  const MethodRow* row = find_method(method);
  const ContactMethod solve = row->make(options_of_method);
  SimulationOptions options;
  options.step = scenario.step;
  Figure figure;
  std::vector<double> times(5);
  for (double& us : times) {
    Simulation simulation(scenario, options, solve, row->law);
    const auto start = std::chrono::steady_clock::now();
    figure.status = simulation.step().status;
    us = 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  std::sort(times.begin(), times.end());
  figure.minimum_us = times.front();
  figure.median_us = times[times.size() / 2];
  return figure;
}

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

Case make_case(const std::string& scene, Overrides overrides, const std::string& method, int k, int boxes, int skip) {
  Case c{scene, std::move(overrides), method, {}, skip, 0, 0};
  c.options.k = k;
  c.steps = std::max(5, 400 / boxes);
  c.batches = boxes > 64 ? 5 : 15;
  return c;
}

}  // namespace

int main() {
  SuiteSparse_config.malloc_func = [](size_t n) { return from_library([n] { return std::malloc(n); }); };
  SuiteSparse_config.calloc_func = [](size_t n, size_t s) {
    return from_library([n, s] { return std::calloc(n, s); });
  };
  SuiteSparse_config.realloc_func = [](void* p, size_t n) {
    return from_library([p, n] { return std::realloc(p, n); });
  };

  fmt::print("a simulated step, wall microseconds, one thread; machine: {}\n", cpu_name());
  fmt::print("{:<34}{:<22}{:>10}{:>10}{:>14}{:>14}{:>10}\n", "scene", "method", "min", "median", "own allocs",
             "lib allocs", "status");
  const auto print = [](const std::string& scene, const std::string& method, const Figure& f) {
    fmt::print("{:<34}{:<22}{:>10.2f}{:>10.2f}{:>14.2f}{:>14.2f}{:>10}\n", scene, method, f.minimum_us, f.median_us,
               f.own, f.library, name(f.status));
    std::fflush(stdout);
  };

  for (const std::string scene : {"sticking_box", "sliding_box", "circular_sliding"}) {
    // The sliding box is measured while it is pushed: 1.5 s is 1500 steps in.
    const int skip = scene == "sliding_box" ? 1500 : 200;
    print(scene, "ap lemke k=4", measure(make_case(scene + ".xml", {}, "ap", 4, 1, skip)));
    print(scene, "ap lemke k=8", measure(make_case(scene + ".xml", {}, "ap", 8, 1, skip)));
    print(scene, "convex eps=1e-12", measure(make_case(scene + ".xml", {}, "convex", 4, 1, skip)));
    print(scene, "coulomb newton", measure(make_case(scene + ".xml", {}, "coulomb", 4, 1, skip)));
    for (const std::string method : {"ap", "convex", "coulomb"}) {
      Case warm = make_case(scene + ".xml", {}, method, 4, 1, skip);
      warm.options.warm_start = true;
      print(scene, method + " warm start", measure(warm));
    }
  }
  struct Way {
    std::string label, method, solver;
    int most;  ///< boxes
  };
  for (const Way& way :
       {Way{"ap lemke k=4", "ap", "", 64}, Way{"convex eps=1e-12", "convex", "", 256},
        Way{"coulomb newton", "coulomb", "newton", 1000}, Way{"coulomb admm", "coulomb", "admm", 256}}) {
    double first_us = 0, first_mb = 0, last_us = 0, last_mb = 0, first_perturbed_us = 0, last_perturbed_us = 0;
    int most = 0;
    for (int boxes : {1, 2, 4, 8, 16, 32, 64, 128, 256, 1000}) {
      if (boxes > way.most) break;
      Case at_rest = make_case("stack.xml", {{"boxes", std::to_string(boxes)}}, way.method, 4, boxes, 3);
      at_rest.options.solver = way.solver;
      const Figure f = measure(at_rest);
      print(fmt::format("stack of {}", boxes), way.label, f);
      if (way.method != "ap" && boxes >= 16) {
        const Figure perturbed = measure_first_step(boxes, way.method, at_rest.options);
        print(fmt::format("stack of {}, perturbed", boxes), way.label, perturbed);
        if (boxes == 16) first_perturbed_us = perturbed.minimum_us;
        last_perturbed_us = perturbed.minimum_us;
      }
      if (boxes == 16 || boxes == 64) {
        at_rest.options.warm_start = true;
        print(fmt::format("stack of {}", boxes), way.label + ", warm", measure(at_rest));
      }
      if (boxes == 16) first_us = f.minimum_us, first_mb = f.memory_mb;
      last_us = f.minimum_us, last_mb = f.memory_mb;
      most = boxes;
    }
    const double doublings = std::log2(most / 16.0);
    fmt::print("{}: time grows as boxes^{:.2f} from 16 on; memory of a run {:.2f} MB at 16, {:.2f} MB at the largest\n",
               way.label, std::log2(last_us / first_us) / doublings, first_mb, last_mb);
    if (first_perturbed_us > 0)
      fmt::print("{}: time of a first step, perturbed, grows as boxes^{:.2f} from 16 to {}\n", way.label,
                 std::log2(last_perturbed_us / first_perturbed_us) / doublings, most);
  }
  return 0;
}
