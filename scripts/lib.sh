# shellcheck shell=bash
# Shared by the scripts; sourced, not run. Sets `root`, the top folder of the project.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# Parallel jobs for the compiler: one a core, but 1.5 GB of memory each.
jobs() {
  local cores memory
  cores=$(nproc 2>/dev/null || echo 1)
  memory=$(awk '/^MemAvailable:/ { n = int($2 / 1572864); print n < 1 ? 1 : n }' /proc/meminfo 2>/dev/null || echo "$cores")
  [ "${memory:-1}" -lt "$cores" ] && echo "$memory" || echo "$cores"
}

# What tests import (scripts/contactbench); scripts/*.py find it themselves.
export PYTHONPATH="$root/scripts${PYTHONPATH:+:$PYTHONPATH}"

# A python that has what scripts/contactbench needs: the user's own where it has, else Debian's, which setup.sh equips.
find_python() { "${PYTHON:-python3}" -B "$root/scripts/contactbench/start.py"; }

# build_preset NAME [targets...]: configures and builds; the folder is the preset's (CMakePresets.json).
build_preset() {
  local preset=$1 launcher=()
  shift
  command -v ccache >/dev/null 2>&1 && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  (cd "$root" && cmake --preset "$preset" "${launcher[@]}" &&
    cmake --build --preset "$preset" --parallel "$(jobs)" ${1:+--target "$@"})
}
