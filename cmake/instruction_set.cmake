# One program for all machines of a kind: the instruction set is named, and is not that of the machine that builds, so
# that two machines run the same instructions and round alike (docs/performance.md, "The same numbers on every machine").
# Sets `instruction_set`, what -march= is given, empty for the compiler's own; and `instruction_level`, the x86-64 level
# that the program asks of a processor before it starts (app/processor.cpp), 0 where it asks none.
set(CONTACTBENCH_ISA "" CACHE STRING
    "Instruction set, as for -march=. Empty: x86-64-v3 or the level below that this machine has, armv8-a; native: this machine's; any: the compiler's own")

set(instruction_level 0)
if(CONTACTBENCH_ISA STREQUAL "any")
  set(instruction_set "")
elseif(NOT CONTACTBENCH_ISA STREQUAL "")
  set(instruction_set ${CONTACTBENCH_ISA})
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|amd64|AMD64)$")
  # Cross-compiled, it is for the third level: nobody can be asked.
  set(instruction_set x86-64-v3)
  if(NOT CMAKE_CROSSCOMPILING)
    include(CheckCXXSourceRuns)
    file(READ ${PROJECT_SOURCE_DIR}/app/processor.h levels)
    foreach(level 3 2)
      check_cxx_source_runs("${levels}\nint main() { return has_level(${level}) ? 0 : 1; }" PROCESSOR_HAS_X86_64_V${level})
      if(PROCESSOR_HAS_X86_64_V${level})
        set(instruction_set x86-64-v${level})
        break()
      endif()
      set(instruction_set x86-64)
    endforeach()
  endif()
  if(NOT instruction_set STREQUAL "x86-64-v3")
    message(STATUS "This processor has less than x86-64-v3: built for ${instruction_set}; numbers differ in the last digits "
                   "from those of x86-64-v3")
  endif()
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
  set(instruction_set armv8-a)
endif()
if(instruction_set MATCHES "^x86-64-v([23])$")
  set(instruction_level ${CMAKE_MATCH_1})
endif()
