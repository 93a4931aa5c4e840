#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <vector>

#include "contact/problem_files.h"

namespace cb::python {

namespace py = pybind11;
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// What is wrong with an argument: one line.
struct ArgumentError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A contact problem as Python sees it: unknowns in the order in which they were given.
struct Problem {
  StoredProblem stored;
  double t = 0;  ///< s: of an event of a run
  const ContactProblem& get() const { return stored.problem; }
};

/// An array of its own with these numbers: (size) or (rows, 3).
py::array_t<double> array_of(const std::vector<double>& x);
py::array_t<double> rows_of_three(const std::vector<double>& x);
/// v in the order in which it was given.
std::vector<double> given_order(const Problem& problem, const std::vector<double>& v);
/// Impulses from (nc, 3) or (3 nc) numbers; throws ArgumentError. NaN passes.
std::vector<double> impulses_of(const py::handle& object, int nc);

void add_problem(py::module_& module);

}  // namespace cb::python
