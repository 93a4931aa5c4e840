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

# A python that can draw. Debian's own comes last, because setup.sh gives it matplotlib; a user's own is preferred.
find_python() {
  local candidate
  for candidate in "${PYTHON:-}" python3 /usr/bin/python3 /usr/local/bin/python3; do
    [ -n "$candidate" ] && command -v "$candidate" >/dev/null 2>&1 || continue
    if "$candidate" -c 'import matplotlib, numpy' >/dev/null 2>&1; then
      command -v "$candidate"
      return 0
    fi
  done
  echo "no python3 that can import matplotlib and numpy (scripts/setup.sh installs one)" >&2
  return 1
}

# build_preset NAME [targets...]: configures and builds; the folder is the preset's (CMakePresets.json).
build_preset() {
  local preset=$1 launcher=()
  shift
  command -v ccache >/dev/null 2>&1 && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  (cd "$root" && cmake --preset "$preset" "${launcher[@]}" &&
    cmake --build --preset "$preset" --parallel "$(jobs)" ${1:+--target "$@"})
}
