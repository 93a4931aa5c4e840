#!/usr/bin/env bash
# Installs what is missing, builds, runs the paper's scenes with every method that is built, and draws the figures.
# A run that fails is a row with its status and stops nothing; what is finished is not done again.
#   scripts/reproduce.sh                   minutes on two cores
#   scripts/reproduce.sh --profile paper   three repeats, limits of an hour a run
#   scripts/reproduce.sh --out DIR         where figures and tables go (default: results)
#   scripts/reproduce.sh --keep            keep finished runs although the program is newer than they are
#   scripts/reproduce.sh --no-setup        without looking for missing packages
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

profile=quick out=$root/results keep=() setup=yes
while [ $# -gt 0 ]; do
  case "$1" in
    --profile) profile=${2:-} ; shift 2 || shift ;;
    --out) out=${2:-}; shift 2 || shift ;;
    --keep) keep=(--keep); shift ;;
    --no-setup) setup=no; shift ;;
    *) sed -n '2,8p' "$0" | sed 's/^# \{0,1\}//'; exit 2 ;;
  esac
done
case "$profile" in quick | paper) ;; *) echo "reproduce: --profile is quick or paper, not '$profile'" >&2; exit 2 ;; esac
[ -n "$out" ] || { echo "reproduce: --out needs a folder" >&2; exit 2; }
mkdir -p "$out"
out=$(cd "$out" && pwd)

[ "$setup" = no ] || "$root/scripts/setup.sh"
python=$(find_python)
build_preset release contactbench

runs=$out/runs/$profile
mkdir -p "$runs"
"$python" "$root/scripts/run_all.py" --program "$root/build/bin/contactbench" --out "$runs" --profile "$profile" "${keep[@]}"
"$python" "$root/scripts/table.py" --runs "$runs" --out "$out" --profile "$profile"
for figure in "$root"/scripts/plots/figure*.py; do
  "$python" "$figure" --results "$out" --runs "$runs"
done
echo "figures: $out/figures    tables: $out/timings.md, $out/runs.csv    runs: $runs"
