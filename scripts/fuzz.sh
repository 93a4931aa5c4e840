#!/usr/bin/env bash
# Fuzzes the readers under the address and undefined-behaviour sanitizers (libFuzzer; needs clang and its run-time library).
#   scripts/fuzz.sh [SECONDS]    scenes and robots, then stored problems, SECONDS each (default 1800)
# What it keeps, reduced, goes to test/data/fuzz/, which the test `fuzz` replays in any build. A finding ends the run, and
# its input is left in build-fuzz/findings/.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$root"

case "${1:-}" in
  -*) sed -n '2,5p' "$0" | sed 's/^# \{0,1\}//'; exit 2 ;;
esac
seconds=${1:-1800} largest=6000   # bytes of an input

build_preset fuzz fuzz_scene fuzz_problem
found=build-fuzz/findings kept=test/data/fuzz
mkdir -p "$found"

fuzz() {  # TARGET SEED_FOLDER
  local corpus=build-fuzz/corpus/$1
  mkdir -p "$corpus" "$kept/$1"
  "build-fuzz/bin/fuzz_$1" -max_total_time="$seconds" -timeout=30 -rss_limit_mb=3000 -max_len="$largest" \
    -print_final_stats=1 -artifact_prefix="$found/$1_" "$corpus" "$kept/$1" "$2"
  # Of all that was kept, what reaches something that shorter inputs do not.
  rm -rf "$corpus.reduced"
  mkdir "$corpus.reduced"
  "build-fuzz/bin/fuzz_$1" -merge=1 -max_len=900 "$corpus.reduced" "$kept/$1" "$corpus"
  rm -rf "$kept/$1"
  mv "$corpus.reduced" "$kept/$1"
}

seeds=$(mktemp -d)
trap 'rm -rf "$seeds"' EXIT
mkdir "$seeds/scene" "$seeds/problem"
# Two files may have one name (pile.xml), which cp refuses but for numbered copies.
find scenarios test/data/broken test/data/scenes \( -name '*.xml' -o -name '*.urdf' \) -exec cp --backup=numbered -t "$seeds/scene" {} +
find test/data/siconos test/data/contact test/data/problems scenarios/stress/problems -type f -size -12k \
  ! -name '*.json' ! -name '*.md' -exec cp --backup=numbered -t "$seeds/problem" {} +
fuzz scene "$seeds/scene"
fuzz problem "$seeds/problem"
