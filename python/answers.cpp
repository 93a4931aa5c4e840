// solve() and judge(): methods of ours and Python functions on one problem, and the referee on what they say.
#include "answers.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "../app/commands.h"
#include "interrupt.h"
#include "linalg/finite.h"
#include "linalg/stop.h"
#include "methods/outside.h"
#include "scenario/near_name.h"
#include "simulation/options.h"

namespace cb::python {

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// What was raised, in one line, with its place: "ValueError: no answer (mine.py:12)".
std::string in_one_line(const py::error_already_set& error) {
  std::string line = py::str(error.type().attr("__name__")).cast<std::string>();
  const std::string said = py::str(error.value()).cast<std::string>();
  if (!said.empty()) line += ": " + said.substr(0, said.find('\n'));
  py::object at = error.trace() ? py::reinterpret_borrow<py::object>(error.trace()) : py::none();
  while (!at.is_none() && !at.attr("tb_next").is_none()) at = at.attr("tb_next");
  if (at.is_none()) return line;
  const auto file = at.attr("tb_frame").attr("f_code").attr("co_filename").cast<std::string>();
  return line + fmt::format(" ({}:{})", file.substr(file.rfind('/') + 1), at.attr("tb_lineno").cast<long>());
}

/// A Python function that is handed problems. What it raises is its end, but for Ctrl-C, which is ours.
OutsideSolver solver_of(const py::object& function) {
  return [function](const ContactProblem& problem, ContactSolution& solution) {
    auto handed = std::make_unique<Problem>();
    handed->stored.problem = problem;
    try {
      const py::object answer = function(std::move(handed));
      try {
        solution.impulse = impulses_of(answer, problem.nc());
      } catch (const ArgumentError& error) {
        solution.status = Status::input_error;
        solution.reason = fmt::format("the function's {}", error.what());
      }
    } catch (const py::error_already_set& error) {
      if (Interruptible::is_time(error)) throw Stopped();
      if (!error.matches(PyExc_Exception)) throw;
      solution.status = Status::crash;
      solution.reason = "the function raised " + in_one_line(error);
    }
  };
}

std::string text_of_option(const std::string& name, const py::handle& value) {
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  try {
    const bool of_numpy = py::hasattr(value, "dtype") && py::str(value.attr("dtype")).cast<std::string>() == "bool";
    if (py::isinstance<py::bool_>(value) || of_numpy)
      return py::bool_(py::reinterpret_borrow<py::object>(value)) ? "on" : "off";
    if (py::isinstance<py::int_>(value) || py::hasattr(value, "__index__"))
      return py::str(py::int_(py::reinterpret_borrow<py::object>(value))).cast<std::string>();
    const double x = PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() != nullptr) throw py::error_already_set();
    return py::repr(py::float_(x)).cast<std::string>();  // NumPy 2 writes its own numbers as np.float64(1.0)
  } catch (const py::error_already_set&) {
    throw ArgumentError(fmt::format("{}: must be a number, a word, True or False", name));
  }
}

/// Names that method_options() knows, of every method.
std::vector<std::string> known_flags() {
  std::vector<std::string> names;
  const auto add = [&](const MethodRow& row) {
    for (const OptionRow& option : row.options) {
      std::string name(option.flag);
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(std::move(name));
    }
  };
  for (const MethodRow& row : methods()) add(row);
  add(external_row(laws().front()));
  return names;
}

MethodFlags flags_of(const py::dict& options, const std::vector<std::string>& taken) {
  static const std::vector<std::string> known = known_flags();
  MethodFlags flags;
  for (const auto& [key, value] : options) {
    std::string name = key.cast<std::string>();
    if (value.is_none() || std::find(taken.begin(), taken.end(), name) != taken.end()) continue;
    std::string flag = name;
    std::replace(flag.begin(), flag.end(), '_', '-');
    const std::string text = text_of_option(name, value);
    if (flag == "solver")
      flags.solver = text;
    else if (flag == "variant")
      flags.variant = text;
    else if (std::find(known.begin(), known.end(), flag) != known.end())
      flags.own[flag] = text;
    else {
      std::vector<std::string> names = {"solver", "variant"};
      names.insert(names.end(), taken.begin(), taken.end());
      for (std::string other : known) {
        std::replace(other.begin(), other.end(), '-', '_');
        names.push_back(other);
      }
      throw ArgumentError(fmt::format("{}: no such option; {}", name, suggest(name, names, "there are")));
    }
  }
  return flags;
}

}  // namespace

double number_option(const char* name, const py::handle& value) {
  try {
    const double x = value.cast<double>();
    if (std::isfinite(x)) return x;
  } catch (const py::cast_error&) {
  }
  throw ArgumentError(fmt::format("{}: must be a finite number", name));
}

double positive_option(const char* name, const py::handle& value) {
  const double x = number_option(name, value);
  if (!(x > 0)) throw ArgumentError(fmt::format("{}: must be positive", name));
  return x;
}

Chosen choose(const py::object& method, const py::object& law, const py::dict& options,
              const std::vector<std::string>& taken, std::optional<int> k, std::optional<bool> bound) {
  MethodFlags flags = flags_of(options, taken);
  Chosen chosen;
  const bool by_name = py::isinstance<py::str>(method);
  if (!by_name && !PyCallable_Check(method.ptr()))
    throw ArgumentError("method: must be a method's name, or a function problem -> impulses (nc, 3)");
  const std::string name = by_name ? method.cast<std::string>() : "python";
  const bool outside = !by_name || name == "external";
  if (!law.is_none() && !outside) throw ArgumentError(fmt::format("law: {} has its own; leave it out", name));
  if (!law.is_none()) flags.own["law"] = law.cast<std::string>();
  if (by_name) {
    chosen.row = method_flag(name, flags);
    chosen.options = method_options(flags, *chosen.row, k, bound);
    chosen.unavailable = unavailable_reason(*chosen.row, chosen.options);
  } else {
    const Law& claimed = law_flag(flags);
    chosen.row = std::make_shared<MethodRow>(outside_row("python", "a Python function", claimed,
                                                         [method](const MethodOptions&) { return solver_of(method); }));
    flags.own.erase("law");
    chosen.options = method_options(flags, *chosen.row, k, bound);
  }
  return chosen;
}

namespace {

void check(const Problem& problem, const Law& law, double tolerance, Answer& answer) {
  const ContactProblem& p = problem.get();
  const Clock::time_point start = Clock::now();
  std::vector<double> v_plus;
  answer.residuals = Referee().check(p, answer.solution, law, v_plus);
  answer.checked = answer.residuals.finite;
  answer.holds = Referee::holds(answer.residuals, tolerance);
  if (answer.checked) {
    contact_velocity(p, v_plus, answer.u_plus);
    answer.v_plus = given_order(problem, v_plus);
  }
  answer.check_seconds = since(start);
}

Answer solve(const Problem& problem, const py::object& method, const py::object& law, const py::object& tolerance,
             const py::object& time_limit, const py::kwargs& options) {
  const ContactProblem& p = problem.get();
  const Chosen chosen = choose(method, law, options, {"law", "tolerance", "time_limit"}, {}, {});
  const double accepted =
      tolerance.is_none() ? SimulationOptions().accepted_residual : positive_option("tolerance", tolerance);
  std::optional<double> limit;
  if (!time_limit.is_none()) limit = positive_option("time_limit", time_limit);
  Answer answer;
  answer.nc = p.nc();
  answer.solved = true;
  ContactSolution& solution = answer.solution;
  if (!chosen.unavailable.empty()) {
    answer.status = solution.status = Status::unavailable;
    answer.reason = solution.reason = chosen.unavailable;
    return answer;
  }
  Interruptible interruptible(limit);
  try {
    const ContactMethod solver = chosen.row->make(chosen.options);
    const Clock::time_point start = Clock::now();
    solver(p, solution);
    answer.seconds = since(start);
    if (solution.impulse.size() == 3 * static_cast<std::size_t>(p.nc()))
      check(problem, chosen.row->law, accepted, answer);
  } catch (const Stopped&) {
    solution = {};
    solution.status = interruptible.stopped();
    solution.reason = interruptible.reason();
  }
  answer.status = answer.holds ? Status::ok : solution.status;
  if (!answer.holds) answer.reason = solution.reason;
  if (!answer.holds && answer.status == Status::ok) {
    answer.status = answer.residuals.finite ? Status::inaccurate : Status::not_finite;
    answer.reason = Referee::refusal(answer.residuals, accepted);
  }
  return answer;
}

Answer judge(const Problem& problem, const py::object& impulses, const std::string& law, const py::object& tolerance,
             const py::kwargs& options) {
  MethodFlags flags = flags_of(options, {"tolerance"});
  flags.own["law"] = law;
  const double accepted =
      tolerance.is_none() ? SimulationOptions().accepted_residual : positive_option("tolerance", tolerance);
  Answer answer;
  answer.nc = problem.get().nc();
  answer.solution.impulse = impulses_of(impulses, answer.nc);
  std::string why;
  const Law& claimed = law_flag(flags);
  const MethodOptions asked = law_options(flags, claimed);
  if (all_finite(answer.solution.impulse)) why = WitnessFinder(claimed, asked)(problem.get(), answer.solution);
  if (why.empty()) check(problem, claimed, accepted, answer);
  answer.status = answer.holds ? Status::ok : !why.empty() ? Status::unsupported : Status::inaccurate;
  if (why.empty() && !answer.residuals.finite) answer.status = Status::not_finite;
  if (!answer.holds) answer.reason = why.empty() ? Referee::refusal(answer.residuals, accepted) : why;
  return answer;
}

py::object number(const std::optional<double>& x) { return x ? py::object(py::float_(*x)) : py::none(); }

std::string shown(const Answer& a) {
  return fmt::format("<contactbench.Answer: {}{}{}>", name(a.status), a.reason.empty() ? "" : ": ", a.reason);
}

}  // namespace

void add_answers(py::module_& module) {
  const auto of_check = [](auto field) {
    return
        [field](const Answer& a) { return a.checked ? number(std::optional<double>(a.residuals.*field)) : py::none(); };
  };
  py::class_<Answer>(
      module, "Answer",
      R"(An answer, and what the referee finds of it (docs/judging.md). Where it holds, so says bool(answer).
What was not measured, or what the law does not have, is None.)")
      .def("__bool__", [](const Answer& a) { return a.holds; })
      .def_property_readonly(
          "status", [](const Answer& a) { return std::string(name(a.status)); },
          "'ok' where the check confirms it, else how it failed (`contactbench list statuses`)")
      .def_readonly("reason", &Answer::reason, "one line where it does not hold")
      .def_readonly("holds", &Answer::holds, "does the check confirm it?")
      .def_property_readonly(
          "impulses", [](const Answer& a) { return rows_of_three(a.solution.impulse); }, "(nc, 3) n, t1, t2, N s")
      .def_property_readonly(
          "velocities", [](const Answer& a) { return rows_of_three(a.u_plus); }, "(nc, 3) u after the impulses, m/s")
      .def_property_readonly(
          "v", [](const Answer& a) { return array_of(a.v_plus); }, "(nv,) v after, m/s (rad/s)")
      .def_property_readonly("residual", of_check(&Residuals::model), "of the law, -")
      .def_property_readonly("law_residual", of_check(&Residuals::law), "against exact Coulomb friction, -; e = 0 only")
      .def_property_readonly("gap", of_check(&Residuals::gap), "convex: checked duality gap, J")
      .def_property_readonly("infeasibility", of_check(&Residuals::infeasibility), "convex: -")
      .def_property_readonly("energy_change", of_check(&Residuals::energy_gain), "kinetic energy after less before, J")
      .def_property_readonly("energy_before", of_check(&Residuals::energy_before), "J")
      .def_property_readonly(
          "worst_contact",
          [](const Answer& a) {
            return a.residuals.worst_contact < 0 ? py::none() : py::object(py::int_(a.residuals.worst_contact));
          },
          "where the residual is, from 0; None: at none in particular")
      .def_property_readonly(
          "solver_status",
          [](const Answer& a) {
            return a.solved ? py::object(py::str(std::string(name(a.solution.status)))) : py::none();
          },
          "what the method says of itself")
      .def_property_readonly("solver_reason", [](const Answer& a) { return a.solution.reason; })
      .def_property_readonly(
          "claimed_residual", [](const Answer& a) { return a.solution.claimed_residual; },
          "in the method's own measure")
      .def_property_readonly("iterations", [](const Answer& a) { return a.solution.iterations; })
      .def_readonly("seconds", &Answer::seconds, "s, of the method alone")
      .def_readonly("check_seconds", &Answer::check_seconds, "s, of the check")
      .def("__repr__", &shown);
  module.def("solve", &solve, py::arg("problem"), py::arg("method"), py::kw_only(), py::arg("law") = py::none(),
             py::arg("tolerance") = py::none(), py::arg("time_limit") = py::none(),
             R"(One problem, answered and checked.

method      a method's name (`contactbench list methods`), "external" with command=..., or a function
            problem -> impulses, (nc, 3) or (3 nc,) in N s, with law=... that it claims to solve
tolerance   residual up to which the answer holds [1e-9]
time_limit  s; a function that has not answered by then ends as 'time_limit'
options     solver, variant, and the method's own: k=8, epsilon=1e-10, ...

Returns an Answer. A function that raises is 'crash', NaN 'not_finite', another shape 'input_error'.)");
  module.def(
      "judge", &judge, py::arg("problem"), py::arg("impulses"), py::arg("law"), py::kw_only(),
      py::arg("tolerance") = py::none(),
      R"(The referee on impulses (nc, 3) or (3 nc,), N s, under a law (`contactbench list laws`). Nothing is solved, but
for the proof of the bound under law 'convex' (compression_bound=False needs none).
options: what the law is asked with: k, epsilon, compression_bound.
Returns an Answer.)");
}

}  // namespace cb::python
