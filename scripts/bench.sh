#!/usr/bin/env bash
# Builds and runs the programs of bench/ one after the other, prints their figures with the machine named, and keeps them
# in results/bench.md. Let nothing else run meanwhile.
#   scripts/bench.sh               all of them
#   scripts/bench.sh lemke steps   those whose name contains one of the words
#   scripts/bench.sh --out FILE    where the figures are kept
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

out=$root/results/bench.md words=()
while [ $# -gt 0 ]; do
  case "$1" in
    --out) out=${2:-}; shift 2 || shift ;;
    -*) sed -n '2,6p' "$0" | sed 's/^# \{0,1\}//'; exit 2 ;;
    *) words+=("$1"); shift ;;
  esac
done
[ -n "$out" ] || { echo "bench: --out needs a file" >&2; exit 2; }

"$root/scripts/setup.sh"
build_preset release
mkdir -p "$(dirname "$out")"
out=$(cd "$(dirname "$out")" && pwd)/$(basename "$out")  # where one stands, not where the scenes are

# For the programs that use Google Benchmark; the others do not read these.
export BENCHMARK_REPETITIONS=${BENCHMARK_REPETITIONS:-5} BENCHMARK_REPORT_AGGREGATES_ONLY=true
# The scenes are found from the project's folder.
cd "$root"

wanted() {
  local word
  [ ${#words[@]} -eq 0 ] && return 0
  for word in "${words[@]}"; do case "$1" in *"$word"*) return 0 ;; esac; done
  return 1
}

{
  failed=0
  echo "# Figures of bench/"
  echo
  echo "Made by \`scripts/bench.sh\` on one machine at one time; compare ratios rather than microseconds."
  echo
  echo "* processor: $(awk -F': *' '/^model name/ { print $2; exit }' /proc/cpuinfo), $(nproc) cores"
  echo "* system: $(. /etc/os-release && echo "$PRETTY_NAME"), kernel $(uname -r)"
  echo "* compiler: $("${CXX:-c++}" --version | head -n 1)"
  echo "* program: $(git rev-parse --short HEAD 2>/dev/null || echo "no git metadata")$([ -z "$(git status --porcelain -- app lib bench 2>/dev/null)" ] || echo ", with changes")"
  for program in build/bin/bench_*; do
    name=${program##*/bench_}
    [ -x "$program" ] && wanted "$name" || continue
    printf '\n## %s\n\n```\n' "$name"
    # Its messages (where it ran, when) go to the terminal only.
    "$program" || { echo "ended with exit code $?"; failed=1; }
    printf '```\n'
  done
  exit "$failed"
} | tee "$out"
