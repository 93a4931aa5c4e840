#include "methods/outside.h"

#include <algorithm>

#include "linalg/finite.h"

namespace cb {

const Law* find_law(std::string_view name) {
  for (const Law& law : laws())
    if (law.name == name) return &law;
  for (const MethodRow& row : methods())
    if (row.name == name)
      for (const Law& law : laws())
        if (law == row.law) return &law;
  return nullptr;
}

const MethodRow* method_of_law(const Law& law) {
  for (const MethodRow& row : methods())
    if (row.law == law) return &row;
  return nullptr;
}

std::vector<OptionRow> options_of_law(const Law& law) {
  std::vector<OptionRow> options;
  if (const MethodRow* row = method_of_law(law))
    for (const OptionRow& option : row->options)
      if (option.of_law) options.push_back(option);
  return options;
}

WitnessFinder::WitnessFinder(const Law& law, const MethodOptions& options) : law_(law) {
  const MethodRow* row = method_of_law(law);
  if (!row) return;
  MethodOptions own = options;
  own.solver = row->solvers.empty() ? "" : std::string(row->solvers.front().name);
  const bool known = std::find(row->variants.begin(), row->variants.end(), own.variant) != row->variants.end();
  if (!known) own.variant = row->variants.empty() ? "" : std::string(row->variants.front());
  terms_ = row->terms(own);
  lender_ = row->make(own);
}

std::string WitnessFinder::operator()(const ContactProblem& problem, ContactSolution& solution) {
  if (!law_.rest) {
    solution.as<NoWitness>();
    return {};
  }
  if (!law_.prove) return lend(problem, solution, "its witness is known only from solving the problem");
  if (!factor_.factor(problem.M)) return "the mass matrix is not positive definite";
  find_islands(problem, islands_);
  contact_velocity(problem, problem.v_minus, u_minus_);
  apply_impulse(problem, factor_, solution.impulse, v_);
  contact_velocity(problem, v_, u_plus_);
  const std::string_view why = law_.prove({problem, islands_, terms_, u_minus_, u_plus_}, solution);
  return why.empty() ? std::string() : lend(problem, solution, why);
}

// What proves an answer that solves the problem proves every one that does.
std::string WitnessFinder::lend(const ContactProblem& problem, ContactSolution& solution, std::string_view why) {
  if (!lender_ || !law_.lends) return std::string(law_.name) + ": " + std::string(why);
  lender_(problem, lent_);
  if (lent_.status != Status::ok)
    return std::string(law_.name) + ": " + std::string(why) + ", and our own method does not solve it: " + lent_.reason;
  solution.witness = lent_.witness;
  return {};
}

namespace {

class Outside {
 public:
  Outside(const Law& law, OutsideSolver solver, const MethodOptions& options)
      : solver_(std::move(solver)), witness_(law, options) {}

  void operator()(const ContactProblem& problem, ContactSolution& solution) {
    const std::size_t size = 3 * static_cast<std::size_t>(problem.nc());
    solution.clear();
    solution.impulse.assign(size, 0.0);
    solution.size = static_cast<int>(size);
    if (size == 0) return;
    solver_(problem, solution);
    if (solution.impulse.size() != size)
      refuse(Status::input_error,
             "the answer holds " + std::to_string(solution.impulse.size()) + " impulses; " +
                 std::to_string(problem.nc()) + " contacts need " + std::to_string(size) + " (n, t1, t2 of each)",
             size, solution);
    else if (!all_finite(solution.impulse))
      refuse(Status::not_finite, "the answer holds NaN or infinity", size, solution);
    else if (std::string why = witness_(problem, solution); !why.empty() && !gave_up(solution))
      refuse(Status::unsupported, std::move(why), size, solution);
  }

 private:
  /// An answer that its solver doubts is one.
  static bool gave_up(const ContactSolution& solution) { return solution.status > Status::inaccurate; }
  static void refuse(Status status, std::string reason, std::size_t size, ContactSolution& solution) {
    solution.impulse.assign(size, 0.0);
    if (gave_up(solution)) return;  // it said itself what went wrong
    solution.status = status;
    solution.reason = std::move(reason);
  }

  OutsideSolver solver_;
  WitnessFinder witness_;
};

}  // namespace

MethodRow outside_row(std::string_view name, std::string_view summary, const Law& law,
                      std::function<OutsideSolver(const MethodOptions& options)> make) {
  MethodRow row;
  row.name = name;
  row.summary = summary;
  row.law = law;
  row.options = options_of_law(law);
  row.make = [law, make = std::move(make)](const MethodOptions& options) -> ContactMethod {
    auto outside = std::make_shared<Outside>(law, make(options), options);
    return [outside](const ContactProblem& problem, ContactSolution& solution) { (*outside)(problem, solution); };
  };
  const MethodRow* inside = method_of_law(law);
  if (!inside) return row;
  row.terms = inside->terms;
  const auto of_variant = [](const OptionRow& option) { return !option.variant.empty(); };
  if (std::any_of(row.options.begin(), row.options.end(), of_variant)) row.variants = inside->variants;
  return row;
}

}  // namespace cb
