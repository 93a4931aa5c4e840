"""All methods on one scene: runs them over a few steps, says what came of each, and writes the report of it.

  scripts/compare.py my.xml                         folder my/: report.html, motion.html, runs.csv
  scripts/compare.py stack --set boxes=4 --duration 1 --out four

What is there already is not done again. Exit codes: 0 written; 1 nothing could be run; 2 wrong flags or input.
"""
import math
import shlex
import sys
from pathlib import Path

from . import program, recommend, report, scenery


def rows_of(results):
    """What the error is ("moves" without a reference), and the settings, those that ended by time."""
    tables = [scenery.table(results, *scene) for scene in scenery.scenes(results)]
    rows = sorted((row for table in tables for row in table["rows"]), key=lambda row:
                  (math.isnan(row["time"]), row["time"]))
    return "error, m" if any(table["measure"] for table in tables) else "moves, m", rows


def show(results):
    error, rows = rows_of(results)
    wide = max((len(row["method"]) for row in rows), default=6)
    print(f"{'method':{wide}}  {'step, s':>9}  {error:>9}  {'s a simulated s':>15}  {'gain':>9}  ended")
    for row in rows:
        numbers = row["error"], row["time"], float(row["gain"] or "nan")
        moves, time, gain = ("" if math.isnan(number) else f"{number:.3g}" for number in numbers)
        # A run that ended without a summary does not say its step.
        step = f"{float(row['step']):.3g}" if row["step"] else ""
        print(f"{row['method']:{wide}}  {step:>9}  {moves:>9}  {time:>15}  {gain:>9}  {row['ended']}")
    if error != "error, m":
        print("moves: how far a motion is from that of its method's finest step, and that one from the next")
    print("gain: the most energy that an event gains, of what it had")


def main():
    parser = program.flags(__doc__)
    parser.add_argument("scene", help="a scene's file, or the name of one that comes with the program")
    parser.add_argument("--set", action="append", default=[], type=program.setting, metavar="NAME=VALUE",
                        help="a parameter of the scene")
    parser.add_argument("--duration", type=program.positive, help="simulated time, s [the scene's]")
    parser.add_argument("--limit", type=program.positive, default=20, help="seconds for one run [20]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, help="folder of all that is written [the scene's name]")
    options = parser.parse_args()
    options.out = options.out or Path(Path(options.scene).stem)
    try:
        results = recommend.sweep_of(options, contacts=True)
    except recommend.WrongInput as error:
        print(f"compare: {error}", file=sys.stderr)
        return 2
    show(results)
    report.draw(results)
    report.write(results)
    same = ["scripts/recommend.py", options.scene, *program.settings(options.set)]
    same += [] if options.duration is None else ["--duration", f"{options.duration:.12g}"]
    same += ["--error", "E", "--out", str(options.out)]
    print(f"report: {options.out / 'report.html'}    motion: {options.out / 'motion.html'}    "
          f"which to use: {shlex.join(same)}")
    return 0
