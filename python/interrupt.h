#pragma once

#include <pybind11/pybind11.h>

#include <csignal>
#include <optional>
#include <string>

#include "contact/problem.h"

namespace cb::python {

namespace py = pybind11;

/// While it lives, Ctrl-C and the time limit stop what is computed, ours (linalg/stop.h) and a Python function that we
/// call. In threads other than the main one there is only Ctrl-C for ours.
class Interruptible {
 public:
  explicit Interruptible(std::optional<double> time_limit_s);
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

  /// After Stopped: time_limit; or throws what Python makes of Ctrl-C.
  Status stopped();
  std::string reason() const;
  /// Is this the exception by which the time limit ends a Python function?
  static bool is_time(const py::error_already_set& error);

 private:
  std::optional<double> time_limit_s_;
  struct sigaction int_before_ = {}, alarm_before_ = {};
  py::object alarm_handler_before_;
  bool timed_ = false;
};

void add_interrupt(py::module_& module);

}  // namespace cb::python
