#pragma once

#include <pybind11/pybind11.h>

namespace cb::python {

/// simulate() and Events: runs of scenes in memory.
void add_run(pybind11::module_& module);

}  // namespace cb::python
