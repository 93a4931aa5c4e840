// Two contact models that are wrong on purpose, to see whether the benchmark finds them:
// test/scripts/test_wrong_methods.py. They are in the table of the program contactbench_wrong, which the tests build,
// and in no release.

#include <memory>

#include "methods/registry.h"

namespace cb {
namespace {

/// `convex` on a problem whose friction is 1 % stronger than the one that was asked.
ContactMethod make_strong_friction(const MethodOptions& options) {
  return [right = drumwright_shell_row().make(options), stronger = std::make_shared<ContactProblem>()](
             const ContactProblem& problem, ContactSolution& solution) {
    *stronger = problem;
    for (double& mu : stronger->mu) mu *= 1.01;
    right(*stronger, solution);
  };
}

/// `convex` stopped at 1e-2 J, whatever was asked, that says it had been exact.
ContactMethod make_boastful(const MethodOptions& options) {
  MethodOptions lazy = options;
  lazy.epsilon = 1e-2;
  lazy.epsilon_relative.reset();
  return [right = drumwright_shell_row().make(lazy), asked = options.epsilon](const ContactProblem& problem,
                                                                              ContactSolution& solution) {
    right(problem, solution);
    solution.status = Status::ok;
    solution.claimed_residual = 0;
    solution.as<ConvexWitness>().epsilon = asked;
  };
}

MethodRow wrong_row(std::string_view name, std::string_view summary, ContactMethod (*make)(const MethodOptions&)) {
  MethodRow row = drumwright_shell_row();
  row.name = name;
  row.summary = summary;
  row.source = "wrong on purpose";
  row.make = make;
  return row;
}

}  // namespace

// Declared in lib/methods/registry.cpp where CONTACTBENCH_TEST_WRONG_METHODS is defined.
MethodRow strong_friction_row();
MethodRow boastful_row();

MethodRow strong_friction_row() {
  return wrong_row("strong-friction", "convex with friction 1 % too strong", make_strong_friction);
}

MethodRow boastful_row() { return wrong_row("boastful", "convex that stops early and says otherwise", make_boastful); }

}  // namespace cb
