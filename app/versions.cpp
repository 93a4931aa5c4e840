#include "versions.h"

#include <fmt/format.h>

#include <Eigen/Core>

#include "version_stamp.h"

namespace cb {

Versions versions() {
  return {CONTACTBENCH_VERSION,
          CONTACTBENCH_GIT,
          CONTACTBENCH_COMPILER,
          CONTACTBENCH_FLAGS,
          fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION),
          CONTACTBENCH_SUITESPARSE};
}

std::string version_line() {
  const Versions here = versions();
  return fmt::format("contactbench {} (git {}; {} {}; Eigen {}, SuiteSparse {})", here.contactbench, here.git,
                     here.compiler, here.flags, here.eigen, here.suitesparse);
}

}  // namespace cb
