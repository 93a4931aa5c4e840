#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test. The exit code is 0 only if all of it went well.
#   scripts/test.sh              the program as it is released
#   scripts/test.sh --sanitize   the same tests under the address and undefined-behaviour sanitizers (build-sanitize/)
#   scripts/test.sh --long       besides, the tests marked [.long], the scenes against their exact answers, error against
#                                run time, the reproduction, sweeps by Slurm and Dask under kills
#   scripts/test.sh --tidy       besides, clang-tidy over the sources (needs clang-tidy)
#   scripts/test.sh --mutants    instead, one planted fault at a time in a copy: do the tests notice? (test/mutation/campaign.py; hours)
#   scripts/test.sh --no-setup   without looking for missing packages
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$root"

folder=build long=no tidy=no mutants=no build=(--tests)
for flag in "$@"; do
  case "$flag" in
    --sanitize) folder=build-sanitize build+=(--sanitize) ;;
    --long) long=yes ;;
    --tidy) tidy=yes ;;
    --mutants) mutants=yes ;;
    --no-setup) build+=(--no-setup) ;;
    *) sed -n '2,9p' "$0" | sed 's/^# \{0,1\}//'; exit 2 ;;
  esac
done

if [ "$mutants" = yes ]; then
  exec python3 -B test/mutation/campaign.py --jobs "$(jobs)"
fi

scripts/build.sh "${build[@]}"

# Leaks are looked for too; a report of undefined behaviour comes with its stack.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=1:strict_string_checks=1}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1}

failed=0
if [ "$tidy" = yes ]; then
  sources=$(find app lib -name '*.cpp' | sort)
  # shellcheck disable=SC2086
  printf '%s\n' $sources | xargs -P "$(jobs)" -n 4 clang-tidy --quiet -p "$folder" || { echo "clang-tidy: see above"; failed=1; }
fi
if [ "$long" = yes ]; then
  for program in "$folder"/bin/test_*; do
    [ -x "$program" ] || continue
    echo "$(basename "$program") [long]"
    "$program" "[long]" || failed=1
  done
  python3 test/acceptance/scenes.py "$folder/bin/contactbench" --jobs "$(jobs)" || failed=1
  "$(find_python)" test/acceptance/precision.py "$folder/bin/contactbench" || failed=1
  python3 test/acceptance/pruning.py "$folder/bin/contactbench" --jobs "$(jobs)" || failed=1
  python3 test/acceptance/same_bytes.py "$folder/bin/contactbench" || failed=1
  python3 test/acceptance/any_scene.py "$folder/bin/contactbench" --jobs "$(jobs)" || failed=1
  "$(find_python)" test/acceptance/reproduction.py "$folder/bin/contactbench" || failed=1
  "$(find_python)" test/acceptance/other_machines.py "$folder/bin/contactbench" || failed=1
fi
ctest --test-dir "$folder" --output-on-failure --parallel "$(jobs)" || failed=1
exit "$failed"
