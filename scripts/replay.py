#!/usr/bin/env python3
"""A frozen stream of contact problems: what one run of a scene met on its way, solved by every method and solver. Everybody gets the
same numbers, so that what a solver costs and errs is seen apart from where its own answers would have led the simulation.

  scripts/replay.py --out results/replay

One folder a scene, with the tables of scripts/solve_all.py. The run is `convex` at 1e-12 J; its problems are stored evenly over
the simulated time. Needs Python 3 only.
"""
import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STEP = 1e-3  # s
# Scene, its parameters, simulated seconds, and every how many events one is stored: eight a scene.
STREAMS = (("sliding_box", (), 8, 1000), ("circular_sliding", (), 10, 1250), ("stack", ("boxes=4",), 1, 125),
           ("mobile_robot", (), 10, 1250), ("grasp", (), 1, 125))


def store(program, scene, sets, duration, every, folder):
    """Runs the scene and stores its problems in `folder`."""
    command = [program, "run", f"{scene}.xml", "--method", "convex", "--epsilon", "1e-12", "--step", str(STEP), "--duration", str(duration),
               "--prune", "off", "--record-every", "0", "--save-problems", str(folder), "--save-every", str(every), "--out",
               str(folder.with_name("run")), "--quiet", *(word for pair in sets for word in ("--set", pair))]
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode != 0:
        sys.exit(f"replay: {scene}: {ended.stderr.strip() or 'the run did not finish'}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "build/bin/contactbench"))
    parser.add_argument("--out", type=Path, default=ROOT / "results/replay", help="folder of the tables [results/replay]")
    parser.add_argument("--limit", type=float, default=10, help="seconds for one problem and solver, repeats included [10]")
    parser.add_argument("--only", default="", help="scenes whose name contains this")
    options = parser.parse_args()
    for scene, sets, duration, every in STREAMS:
        if options.only not in scene:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            problems = Path(scratch) / "problems"
            store(options.program, scene, sets, duration, every, problems)
            subprocess.run([sys.executable, "-B", ROOT / "scripts/solve_all.py", problems, "--program", options.program, "--limit",
                            str(options.limit), "--out", options.out / "__".join([scene, *sets]).replace("=", "-")], check=True)


if __name__ == "__main__":
    main()
