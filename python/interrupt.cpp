// How a stop reaches Python: our handler of a signal sets the flag that our loops look at, and tells Python of the
// signal (PyErr_SetInterruptEx may be called in a handler), whose own handler then raises in the function that runs: a
// time limit an exception that no `except Exception` takes, Ctrl-C KeyboardInterrupt.
#include "interrupt.h"

#include <fmt/format.h>
#include <sys/time.h>

#include <algorithm>
#include <cmath>

#include "linalg/stop.h"

namespace cb::python {

namespace {

volatile std::sig_atomic_t cause = 0;
PyObject* time_is_up = nullptr;  // the exception

void ask_stop(int signal) {
  cause = signal;
  stop_asked.store(true, std::memory_order_relaxed);
  PyErr_SetInterruptEx(signal);
}

void set_timer(double seconds) {
  itimerval timer = {};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec = static_cast<suseconds_t>(std::fmod(seconds, 1) * 1e6);
  setitimer(ITIMER_REAL, &timer, nullptr);
}

/// Python's own handler of the alarm. One that comes when all is over raises nothing.
void on_alarm(const py::args&) {
  if (!stop_asked.load(std::memory_order_relaxed)) return;
  PyErr_SetString(time_is_up, "the time limit was reached");
  throw py::error_already_set();
}

}  // namespace

Interruptible::Interruptible(std::optional<double> time_limit_s) : time_limit_s_(time_limit_s) {
  cause = 0;
  stop_asked = false;
  if (time_limit_s_) {
    try {
      alarm_handler_before_ = py::module_::import("signal").attr("signal")(SIGALRM, py::cpp_function(on_alarm));
      timed_ = true;
    } catch (py::error_already_set& error) {  // not the main thread
      if (!error.matches(PyExc_ValueError)) throw;
    }
  }
  struct sigaction action = {};
  action.sa_handler = ask_stop;
  // Where Python does not hear Ctrl-C, neither do we.
  sigaction(SIGINT, nullptr, &int_before_);
  if (int_before_.sa_handler != SIG_IGN && int_before_.sa_handler != SIG_DFL) sigaction(SIGINT, &action, nullptr);
  if (!timed_) return;
  sigaction(SIGALRM, &action, &alarm_before_);
  constexpr double longest = 1e9, shortest = 1e-6;  // s
  set_timer(std::clamp(*time_limit_s_, shortest, longest));
}

Interruptible::~Interruptible() {
  if (timed_) set_timer(0);
  sigaction(SIGINT, &int_before_, nullptr);
  stop_asked = false;
  if (!timed_) return;
  sigaction(SIGALRM, &alarm_before_, nullptr);
  try {
    PyErr_CheckSignals();  // one that came meanwhile raises nothing now
    py::module_::import("signal").attr("signal")(
        SIGALRM, alarm_handler_before_.is_none() ? py::int_(0).cast<py::object>() : alarm_handler_before_);
  } catch (py::error_already_set& error) {
    error.discard_as_unraisable("contactbench");
  }
}

Status Interruptible::stopped() {
  const int why = cause;
  stop_asked = false;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (why == SIGINT) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
    throw py::error_already_set();
  }
  return Status::time_limit;
}

std::string Interruptible::reason() const {
  return fmt::format("the time limit of {:g} s was reached", time_limit_s_.value_or(0));
}

bool Interruptible::is_time(const py::error_already_set& error) { return error.matches(time_is_up); }

void add_interrupt(py::module_& module) {
  time_is_up = PyErr_NewException("contactbench.TimeIsUp", PyExc_BaseException, nullptr);
  module.add_object("_TimeIsUp", py::handle(time_is_up));
}

}  // namespace cb::python
