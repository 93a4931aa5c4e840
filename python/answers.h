#pragma once

#include <optional>
#include <string>

#include "../app/method_flags.h"
#include "contact/referee.h"
#include "problem.h"

namespace cb::python {

/// An answer and what the referee finds of it.
struct Answer {
  int nc = 0;
  ContactSolution solution;
  Residuals residuals;
  std::vector<double> u_plus, v_plus;  ///< m/s: 3 nc; nv in the problem's given order
  Status status = Status::ok;
  std::string reason;
  bool checked = false, holds = false, solved = false;  ///< solved: by a method, rather than given
  double seconds = 0, check_seconds = 0;
};

/// A method by its name, or a Python function that answers under `law`, with its options.
struct Chosen {
  std::shared_ptr<const MethodRow> row;
  MethodOptions options;
  std::string unavailable;  ///< why it cannot be used here
};
/// `taken`: names in `options` that are the caller's own. Throws ArgumentError, UsageError.
Chosen choose(const py::object& method, const py::object& law, const py::dict& options,
              const std::vector<std::string>& taken, std::optional<int> k, std::optional<bool> bound);
/// A finite number, and one that is more than 0. Throw ArgumentError.
double number_option(const char* name, const py::handle& value);
double positive_option(const char* name, const py::handle& value);

void add_answers(py::module_& module);

}  // namespace cb::python
