#!/usr/bin/python3
"""Speed of the small: microseconds a step of the scenes that engines are quick at, before and now, beside the engines, at which
error, and what the kernels alone would take. Everything takes turns in one run; each figure is the least of its turns. `to an
accuracy`: coulomb with --accuracy in place of a step, the quickest that is as exact as the quickest engine; its time, too, over
the steps that a simulation by the scene's own step takes.

    bench/small.py BUILD [--before PROGRAM] [--rounds N] [--only TEXT]

BUILD: folder of a release build, with bench_cone and what engines it has. --before: the program of an older build, run with
the same flags; where it does not know one, its cell says so. Runs that take more than ten seconds are ended.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

WARM = ["--warm-start", "on"]
ACCURACIES = ["1e-2", "1e-3", "1e-4", "1e-5", "1e-6"]  # m
ENGINES = [("bullet", "si10"), ("bullet", "si50"), ("ode", "quick"), ("ode", "quick-slip"), ("mujoco", None), ("dart", None)]
# What, scene and flags, our ways, the error that counts, boxes of the kernel beside it (factored and solved with once), and
# where a time is stated a box.
ROWS = [
    ("circle", ["circular_sliding.xml", "--duration", "2"], ["convex", "coulomb"], "position_l2_m", 1, 1),
    ("sliding box", ["sliding_box.xml", "--duration", "2"], ["ap", "convex", "coulomb"], "position_final_m", 1, 1),
    ("sticking box", ["sticking_box.xml", "--duration", "2"], ["ap", "convex", "coulomb"], "position_final_m", 1, 1),
    ("stack of 16 at rest", ["stack.xml", "--set", "boxes=16", "--duration", "0.5"], ["ap", "convex", "coulomb"], "displacement_linf_m", 16, 1),
    ("stack of 64 at rest", ["stack.xml", "--set", "boxes=64", "--duration", "0.2"], ["ap", "convex", "coulomb"], "displacement_linf_m", 64, 1),
    ("stack of 1,000 at rest, a box", ["stack.xml", "--set", "boxes=1000", "--duration", "0.05"], ["convex", "coulomb"], "displacement_linf_m", 1000, 1000),
]
# Without a warm start: what, scene and flags, ways.
COLD = [
    ("ap cold, 64 boxes", ["stack.xml", "--set", "boxes=64", "--duration", "0.02"], ["ap"]),
    ("16 boxes cold, PATH and convex", ["stack.xml", "--set", "boxes=16", "--duration", "0.05"], ["ap/path", "convex"]),
    ("grasp by YNL", ["grasp.xml", "--duration", "0.5"], ["ap/ynl"]),
]


def run(program, flags):
    """us, steps and errors; None and the reason where the run does not end `ok`."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([program, "run", *flags, "--record-every", "0", "--quiet", "--time-limit", "10", "--out", folder],
                              capture_output=True, text=True, env={**os.environ, "CONTACTBENCH_ENGINES": os.path.dirname(program)})
        try:
            with open(os.path.join(folder, "summary.json")) as file:
                summary = json.load(file)
        except FileNotFoundError:
            return None, None, (done.stderr.strip().splitlines() or ["no word"])[-1]
    if summary["status"] != "ok":
        return None, None, f"{summary['status']}: {summary['reason']}"
    times = summary["time"]
    return 1e6 * (times["total_s"] - times["write_s"]), summary["steps"], summary["errors"]


def way(name):
    method, _, solver = name.partition("/")
    return ["--method", method, *(["--solver", solver] if solver else [])]


class Cell:
    """The least of several runs with the same flags: us a step, of another cell's steps where one is given."""

    def __init__(self, program, flags, name, by=None):
        self.program, self.flags, self.name, self.by, self.us, self.steps, self.said = program, flags, name, by, None, None, None

    def turn(self):
        us, steps, said = run(self.program, self.flags)
        if us is None:
            self.said = self.said or said
            return
        us /= self.by.steps if self.by and self.by.steps else steps
        if self.us is None or us < self.us:
            self.us, self.steps, self.said = us, steps, said

    def text(self, error, share):
        if self.us is None:
            return f"{self.name}: {self.said}"
        off = f" ({self.said[error]:.1e} m)" if error and self.said.get(error) is not None else ""
        return f"{self.name} {self.us / share:.3g}{off}"


def kernel(build, boxes):
    said = subprocess.run([os.path.join(build, "bin", "bench_cone"), f"--benchmark_filter=^factor_and_solve/{boxes}$", "--benchmark_format=json",
                           "--benchmark_min_time=0.05"], check=True, capture_output=True, text=True).stdout
    return json.loads(said)["benchmarks"][0]["cpu_time"] / 1e3


def quickest(cells):
    return sorted((c for c in cells if c.us), key=lambda c: c.us)


def as_exact(cells, engines, error, share):
    """The quickest cell with no more error than the quickest engine."""
    allowed = next((cell.said.get(error) for cell in quickest(engines)), None)
    if allowed is None:
        return "-"
    known = [cell for cell in quickest(cells) if cell.said.get(error) is not None]
    return next((cell.text(error, share) for cell in known if cell.said[error] <= allowed), "none")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--before", help="the program of an older build")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="", help="rows with this in their name")
    asked = parser.parse_args()
    build = os.path.abspath(asked.build)
    now = os.path.join(build, "bin", "contactbench")
    listed = json.loads(subprocess.run([now, "list", "engines", "--json"], check=True, capture_output=True, text=True).stdout)
    here = {engine["name"] for engine in listed if not engine.get("unavailable")}
    print("| scene, us a step (error) | before | now | and what rests left out | to an accuracy | quickest engines | kernel alone |\n"
          "|---|---|---|---|---|---|---|")
    for what, flags, ways, error, boxes, share in [*ROWS, *((*row, None, None, 1) for row in COLD)]:
        if asked.only not in what:
            continue
        warm = WARM if boxes else []
        ours = [Cell(now, [*flags, *way(name), *warm], name) for name in ways]
        rested = [Cell(now, [*cell.flags, "--prune", "rest"], cell.name) for cell in ours if boxes]
        accurate = [Cell(now, [*flags, *way("coulomb"), "--accuracy", a], f"coulomb to {a} m", ours[-1]) for a in ACCURACIES if boxes]
        older = [Cell(os.path.abspath(asked.before), cell.flags, cell.name) for cell in ours] if asked.before else []
        engines = [Cell(now, [*flags, "--engine", name, *(["--variant", variant] if variant else [])], f"{name} {variant or ''}".strip())
                   for name, variant in ENGINES if boxes and name in here]
        floors = []
        for _ in range(asked.rounds):
            for cell in [*ours, *rested, *accurate, *older, *engines]:
                cell.turn()
            if boxes:
                floors.append(kernel(build, boxes))
        print(f"| {what} | {'; '.join(c.text(error, share) for c in older) or '-'} | {'; '.join(c.text(error, share) for c in ours)} | "
              f"{'; '.join(c.text(error, share) for c in rested) or '-'} | "
              f"{as_exact(accurate, engines, error, share)} | "
              f"{'; '.join(c.text(error, share) for c in quickest(engines)[:2]) or '-'} | {f'{min(floors) / share:.3g}' if floors else '-'} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
