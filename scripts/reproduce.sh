#!/usr/bin/env bash
# Installs what is missing, builds, runs the paper's scenes with every method that is built, and writes the report: Table I,
# figures, claims. A run that fails is a row with its status and stops nothing; what is finished is not done again.
#   scripts/reproduce.sh                   ten minutes on two cores, after the build: one run a cell
#   scripts/reproduce.sh --profile paper   two hours and a half: three repeats, all steps, all stiff cases; again: goes on (docs/sweeps.md)
#   scripts/reproduce.sh --out DIR         where report, figures and tables go (default: results)
#   scripts/reproduce.sh --keep            keep finished runs although program or scenes have changed since
#   scripts/reproduce.sh --jobs N          N runs at a time [one a core]; those whose times count still go alone
#   scripts/reproduce.sh --no-setup        without looking for missing packages
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

profile=quick out=$root/results keep=() build=() jobs=0
while [ $# -gt 0 ]; do
  case "$1" in
    --profile) profile=${2:-} ; shift 2 || shift ;;
    --out) out=${2:-}; shift 2 || shift ;;
    --jobs) jobs=${2:-}; shift 2 || shift ;;
    --keep) keep=(--keep); shift ;;
    --no-setup) build=(--no-setup); shift ;;
    *) sed -n '2,9p' "$0" | sed 's/^# \{0,1\}//'; exit 2 ;;
  esac
done
case "$profile" in quick | paper) ;; *) echo "reproduce: --profile is quick or paper, not '$profile'" >&2; exit 2 ;; esac
[ -n "$out" ] || { echo "reproduce: --out needs a folder" >&2; exit 2; }
mkdir -p "$out"
out=$(cd "$out" && pwd)

"$root/scripts/build.sh" "${build[@]}"
python=$(find_python)

# What two cores have not done by then is a row `time_limit`; the same command goes on with it.
budget=()
[ "$profile" != paper ] || budget=(--budget 1.5)
runs=$out/runs/$profile
"$python" "$root/scripts/references.py" --program "$root/build/bin/contactbench" --out "$out/references"
"$python" "$root/scripts/sweep.py" "$root"/scenarios/sweeps/{motion,paper,robots,claims,error_time,orders,polygons,stepping,today}.toml --profile "$profile" \
  --program "$root/build/bin/contactbench" --runs "$runs" --out "$out" --jobs "$jobs" --timed-alone "${keep[@]}" "${budget[@]}"
# What the quick profile has no time for: more solves of a problem, tuned engines, the pile that takes Siconos half a minute.
solves=() checks=() isolated=()
[ "$profile" != quick ] || { solves=(--k 8 --repeat 2) checks=(--setting default) isolated=(sliding_box stack); }
"$python" "$root/scripts/solve_all.py" --program "$root/build/bin/contactbench" --out "$out/solve_all" "${solves[@]}"
"$python" "$root/scripts/replay.py" --program "$root/build/bin/contactbench" --out "$out/replay"
# What leaving out saves and costs, where bench/ is built; an old table would stand for this program.
rm -f "$out/left_out.csv"
if build_preset release bench_prune >/dev/null 2>&1; then
  (cd "$root" && build/bin/bench_prune "$out/left_out.csv")
else
  echo "reproduce: bench_prune is not built (libbenchmark-dev): the table of what is left out stays empty"
fi
# Engines that are installed beside our methods, everybody in one interleaved sweep; and what each does with the simplest scenes.
"$python" "$root/scripts/engines.py" findings --program "$root/build/bin/contactbench" --out "$out/engines" >/dev/null
"$python" "$root/scripts/isolated.py" problems "${isolated[@]}" --program "$root/build/bin/contactbench" --out "$out/engines"
"$python" "$root/scripts/sweep.py" "$root/scenarios/sweeps/engines.toml" --profile "$profile" --program "$root/build/bin/contactbench" \
  --runs "$out/engines/runs/$profile" --out "$out/engines" --jobs "$jobs" --timed-alone "${keep[@]}" "${budget[@]}"
# A fault that it finds (3) is in the report and stops nothing.
stress() { "$python" "$root/scripts/stress.py" --program "$root/build/bin/contactbench" --jobs 2 "$@" || [ $? -eq 3 ]; }
cases=(--engines)
[ "$profile" != quick ] || cases=(--quick --time-limit 0.5)
# Beside cases whose times do not count: one engine takes one core half a minute.
"$python" "$root/scripts/engines.py" preflight --program "$root/build/bin/contactbench" --out "$out/engines" "${checks[@]}" >/dev/null & preflight=$!
trap 'kill "$preflight" 2>/dev/null || true' EXIT
stress --out "$out/stress" "${cases[@]}"
wait "$preflight"
trap - EXIT
# Streams and stiff cases as a member of the runs' ensembles has them: which of their numbers stay (docs/numbers.md). The quick profile
# makes them once; what stands there of another would be taken for its own.
rm -rf "$out/members"
if [ "$profile" = paper ]; then
  "$python" "$root/scripts/replay.py" --program "$root/build/bin/contactbench" --member 1 --out "$out/members/1/replay"
  stress --out "$out/members/1/stress" --engines --member 1
fi
# Scenes that nobody has tuned for, each family twice tame and twice wild; in the quick profile one of each, by two methods.
random=(--random 52 --time-limit 10)
[ "$profile" != quick ] || random=(--random 13 --method ap/lemke --method convex/bound-on --prune on --time-limit 5)
stress --out "$out/stress" --seed 1 "${random[@]}"
"$python" "$root/scripts/report.py" --results "$out" --runs "$runs"
echo "report: $out/report.html    tables: $out/table1.*, $out/runs.csv, $out/solve_all, $out/stress    figures: $out/figures    runs: $runs"
