"""All methods on one scene: runs them over a few steps, says what came of each, and writes the report of it.

  scripts/compare.py my.xml                         folder my/: report.html, motion.html, runs.csv
  scripts/compare.py stack --set boxes=4 --duration 1 --out four

What is there already is not done again. Exit codes: 0 written; 1 nothing could be run; 2 wrong flags or input.
"""
import sys
from pathlib import Path

from . import precision, program, recommend, report


def rows_of(results):
    """The settings at each step, the ended ones by time: (method, step, how it ended, error or None, s a simulated s)."""
    rows = []
    for scene in dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=None)):
        for point in precision.points(results, *scene, name=precision.measure(results, *scene) or "none"):
            cell = point["cell"]
            time = cell.seconds / float(cell["duration"]) if cell.finished and cell.times else None
            rows.append((cell.with_k, point["step"], cell.how_it_ended or "ok", point["error"], time))
    return sorted(rows, key=lambda row: (row[4] is None, row[4] or 0.0))


def show(results):
    rows = rows_of(results)
    wide = max((len(row[0]) for row in rows), default=6)
    print(f"{'method':{wide}}  {'step, s':>9}  {'error, m':>9}  {'s a simulated s':>15}  ended")
    for name, step, ended, error, time in rows:
        print(f"{name:{wide}}  {float(step):>9.3g}  {'' if error is None else f'{error:.3g}':>9}  "
              f"{'' if time is None else f'{time:.3g}':>15}  {ended}")


def main():
    parser = program.flags(__doc__)
    parser.add_argument("scene", help="a scene's file, or the name of one that comes with the program")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the scene")
    parser.add_argument("--duration", type=float, help="simulated time, s [the scene's]")
    parser.add_argument("--limit", type=float, default=20, help="seconds for one run [20]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, help="folder of all that is written [the scene's name]")
    options = parser.parse_args()
    for name in ("duration", "limit"):
        value = getattr(options, name)
        if value is not None and not 0 < value < float("inf"):
            parser.error(f"--{name} must be a positive number")
    options.out = options.out or Path(Path(options.scene).stem)
    try:
        results = recommend.sweep_of(options, contacts=True)
    except recommend.WrongInput as error:
        print(f"compare: {error}", file=sys.stderr)
        return 2
    show(results)
    report.draw(results)
    report.write(results)
    print(f"report: {options.out / 'report.html'}    motion: {options.out / 'motion.html'}    "
          f"which to use: scripts/recommend.py {options.scene} --error E --out {options.out}")
    return 0
