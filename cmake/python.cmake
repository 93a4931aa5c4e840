# pybind11 and the python3 that the module is for: the first of those that the scripts take (scripts/contactbench/start.py)
# which has numpy and headers.
find_path(PYBIND11_INCLUDE pybind11/pybind11.h)
set(contactbench_python)
if(PYBIND11_INCLUDE)
  foreach(candidate $ENV{PYTHON} python3 /usr/bin/python3 /usr/local/bin/python3)
    execute_process(
      COMMAND ${candidate} -c
              "import numpy, os, sysconfig; p = sysconfig.get_path('include'); assert os.path.exists(os.path.join(p, 'Python.h')); print(p); print(sysconfig.get_config_var('EXT_SUFFIX')); print('%d.%d' % __import__('sys').version_info[:2])"
      RESULT_VARIABLE without OUTPUT_VARIABLE said ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(without STREQUAL "0")
      set(contactbench_python ${candidate})
      string(REPLACE "\n" ";" said "${said}")
      list(GET said 0 contactbench_python_include)
      list(GET said 1 contactbench_python_suffix)
      list(GET said 2 contactbench_python_version)
      break()
    endif()
  endforeach()
endif()
if(NOT contactbench_python)
  message(STATUS "pybind11 (pybind11-dev), or a python3 with numpy and headers (python3-dev), is not installed: "
                 "the Python module is left out")
endif()
