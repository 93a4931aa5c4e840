// How many of N random contact problems a method solves: seeded; one to eight bodies whose masses differ by up to 1e8,
// friction coefficients of 0 and from 1e-6 to 1e6, contacts that are listed twice, coplanar patches, bodies held from
// both sides. Every answer is judged by the referee on the problem's own data, whatever was asked of the method: solved
// is a model residual (convex: gap over the event's energy, and infeasibility) of at most 1e-8. What fails is printed
// with its seed, and what misses the asked epsilon.
//
//   bench_random_problems [METHOD[/SOLVER] [COUNT [FIRST SEED [DIRECTORY]]]]      default: convex 500 0, then ap (k =
//   4)
//
// A failing problem is written into the directory (FCLIB), where one is given and HDF5 is in the build.

#include <fmt/format.h>

#include <Eigen/Dense>
#include <chrono>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "methods/registry.h"

namespace {

using namespace cb;
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct RandomProblem {
  ContactProblem problem;
  double mass_ratio = 1, mu_least = HUGE_VAL, mu_most = 0;
};

class Generator {
 public:
  explicit Generator(unsigned seed) : random_(seed) {}

  RandomProblem make() {
    RandomProblem out;
    ContactProblem& p = out.problem;
    const int bodies = 1 + whole(8);
    const double mass_decades = 8 * uniform(), mu_middle = -6 + 12 * uniform();
    const bool one_mu = uniform() < 0.5;
    double lightest = HUGE_VAL, heaviest = 0;
    for (int b = 0; b < bodies; ++b) {
      const double mass = std::pow(10, mass_decades * (uniform() - 0.5)), radius = std::pow(10, 2 * uniform() - 1);
      lightest = std::min(lightest, mass);
      heaviest = std::max(heaviest, mass);
      p.M.add_block(6);
      p.M.block(b).topLeftCorner<3, 3>() = mass * Matrix3d::Identity();
      const Matrix3d R = rotation();
      const Vector3d inertia = mass * radius * radius * Vector3d(0.1 + uniform(), 0.1 + uniform(), 0.1 + uniform());
      p.M.block(b).bottomRightCorner<3, 3>() = R * inertia.asDiagonal() * R.transpose();
      p.M.block(b) = (0.5 * (p.M.block(b) + p.M.block(b).transpose())).eval();
      radius_.push_back(radius);
    }
    out.mass_ratio = heaviest / lightest;
    const auto mu = [&] {
      const double m = one_mu ? mu_middle : -6 + 12 * uniform();
      const double value = uniform() < 0.1 ? 0 : std::pow(10, m);
      out.mu_least = std::min(out.mu_least, value);
      out.mu_most = std::max(out.mu_most, value);
      return value;
    };
    const int groups = 1 + whole(2 * bodies + 1);
    for (int g = 0; g < groups; ++g) {
      const int a = whole(bodies), other = whole(bodies + 1);
      const int b = other == a ? bodies : other;  // `bodies`: the ground
      const Matrix3d axes = rotation();
      const Vector3d at_a = radius_[a] * direction(),
                     at_b = b < bodies ? Vector3d(radius_[b] * direction()) : Vector3d();
      const double m = mu(), kind = uniform();
      if (kind < 0.3) {  // a patch of coplanar points, more than rank can hold
        const int points = 3 + whole(6);
        for (int i = 0; i < points; ++i) {
          const double size = 0.5 * radius_[a], x = size * (2 * uniform() - 1), y = size * (2 * uniform() - 1);
          const Vector3d shift = x * axes.col(1) + y * axes.col(2);
          contact(p, a, b, at_a + shift, at_b + shift, axes, m);
        }
      } else if (kind < 0.45) {  // the same contact twice or more
        const int times = 2 + whole(4);
        for (int i = 0; i < times; ++i) contact(p, a, b, at_a, at_b, axes, m);
      } else if (kind < 0.6) {  // held from both sides
        contact(p, a, b, at_a, at_b, axes, m);
        Matrix3d against = axes;
        against.col(0) = -axes.col(0);
        against.col(1) = -axes.col(1);
        contact(p, a, bodies, uniform() < 0.5 ? at_a : Vector3d(-at_a), at_b, against, mu());
      } else {
        contact(p, a, b, at_a, at_b, axes, m);
      }
    }
    const double speed = std::pow(10, 4 * uniform() - 2);
    for (int i = 0; i < p.M.order(); ++i) p.v_minus.push_back(speed * normal());
    return out;
  }

 private:
  double uniform() { return std::ldexp(static_cast<double>(random_() >> 11), -53); }
  int whole(int below) { return static_cast<int>(below * uniform()); }
  // Sum of twelve: the same on every machine.
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  Vector3d direction() { return Vector3d(normal(), normal(), normal()).normalized(); }
  Matrix3d rotation() {
    Matrix3d R;
    R.col(0) = direction();
    R.col(1) = R.col(0).cross(direction()).normalized();
    R.col(2) = R.col(0).cross(R.col(1));
    return R;
  }
  void contact(ContactProblem& p, int a, int b, const Vector3d& at_a, const Vector3d& at_b, const Matrix3d& axes,
               double mu) {
    p.J.add_band();
    const int bodies = p.M.blocks();
    const auto entry = [&](int body, const Vector3d& arm, double sign) {
      const int e = p.J.add_entry(body, 6);
      for (int k = 0; k < 3; ++k) {
        p.J.entry(e).row(k).head<3>() = sign * axes.col(k);
        p.J.entry(e).row(k).tail<3>() = sign * arm.cross(Vector3d(axes.col(k)));
      }
    };
    if (b < a) entry(b, at_b, -1);
    entry(a, at_a, 1);
    if (b > a && b < bodies) entry(b, at_b, -1);
    p.mu.push_back(mu);
    p.restitution.push_back(0);
    p.offset.insert(p.offset.end(), 3, 0.0);
  }

  std::mt19937_64 random_;
  std::vector<double> radius_;
};

int run(const std::string& way, unsigned count, unsigned first, const std::string& directory) {
  const std::string name = way.substr(0, way.find('/'));
  const MethodRow* row = find_method(name);
  if (!row) {
    fmt::print("no method {}\n", name);
    return 2;
  }
  MethodOptions options;
  if (!row->solvers.empty()) options.solver = row->solvers.front().name;
  if (name != way) options.solver = way.substr(name.size() + 1);
  // The least that may be asked for: the heavy bodies that bring most of the kinetic energy may hardly take part in the
  // event, so that a looser fraction of it could be more than 1e-8 of what the event is about.
  options.epsilon_relative = 1e-14;
  options.answered_by = std::make_shared<AnsweredBy>();
  const ContactMethod method = row->make(options);
  Referee referee;
  ContactSolution solution;
  std::vector<double> v_plus;
  std::map<std::string, int> endings;
  constexpr double tolerance = 1e-8;
  unsigned solved = 0, untrue = 0;
  double worst = 0, seconds = 0;
  for (unsigned seed = first; seed < first + count; ++seed) {
    const RandomProblem random = Generator(seed).make();
    const auto start = std::chrono::steady_clock::now();
    method(random.problem, solution);
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    seconds += took;
    const Residuals residuals = referee.check(random.problem, solution, row->law, v_plus);
    ++endings[std::string(cb::name(solution.status))];
    const bool good = residuals.finite && residuals.model <= tolerance;
    if (good) {
      ++solved;
      worst = std::max(worst, residuals.model);
    }
    if (solution.status == Status::ok && !good) ++untrue;
    if (good && solution.status == Status::ok && took < 1) continue;
    fmt::print(
        "seed {:>6} {:<13} checked {:.1e}{} bodies {} contacts {:>2} mass ratio {:.0e} mu {:.0e}..{:.0e} {:.3f} s\n",
        seed, cb::name(solution.status), residuals.model,
        residuals.gap ? fmt::format(" gap {:.1e} J, infeasible {:.1e}", *residuals.gap,
                                    residuals.infeasibility.value_or(HUGE_VAL))
                      : "",
        random.problem.M.blocks(), random.problem.nc(), random.mass_ratio, random.mu_least, random.mu_most, took);
    if (!good && !directory.empty() && fclib_available())
      write_contact_problem(fmt::format("{}/{}_{}.hdf5", directory, name, seed), random.problem,
                            fmt::format("random problem {}", seed));
  }
  fmt::print("{}: {} of {} solved to a checked {:.0e} (worst of them {:.1e}), `ok` but worse: {}, {:.2f} s; ", way,
             solved, count, tolerance, worst, untrue, seconds);
  if (row->law == convex_law()) fmt::print("asked for {:.0e} of the kinetic energy; ", *options.epsilon_relative);
  fmt::print("endings:");
  for (const auto& [ending, times] : endings) fmt::print(" {} {}", ending, times);
  fmt::print("\n");
  if (!options.answered_by->counts.empty()) fmt::print("answered by:");
  for (const auto& [who, times] : options.answered_by->counts) fmt::print("  {} {}", who, times);
  if (!options.answered_by->counts.empty()) fmt::print("\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    const int ending = run("convex", 500, 0, "");
    return ending != 0 ? ending : run("ap", 500, 0, "");
  }
  return run(argv[1], argc > 2 ? static_cast<unsigned>(std::stoul(argv[2])) : 500,
             argc > 3 ? static_cast<unsigned>(std::stoul(argv[3])) : 0, argc > 4 ? argv[4] : "");
}
