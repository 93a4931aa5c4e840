// A processor that lacks the instructions which the program was compiled for is told so, in place of a SIGILL somewhere
// later. This file alone is compiled for every machine (app/CMakeLists.txt), runs before all other code of the program,
// and calls none of it.

#include "processor.h"

#include <unistd.h>

namespace {

[[gnu::constructor(101)]] void refuse() {
  if (has_level(CONTACTBENCH_LEVEL)) return;
  constexpr char message[] =
      "contactbench: compiled for " CONTACTBENCH_INSTRUCTIONS
      ", which this processor has not: build it here (scripts/build.sh), or with -DCONTACTBENCH_ISA=any\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, message, sizeof message - 1);
  _exit(1);
}

}  // namespace
