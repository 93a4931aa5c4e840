#!/usr/bin/env python3
"""A first picture of a scene: runs it with each method and draws how far its bodies move, with what energy, and at what cost.

  scripts/picture.py sticking_box                                  picture.png, in some seconds
  scripts/picture.py my.xml --method ap --method convex --out my.png
"""
import argparse
import csv
import json
import math
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts" / "plots"))
import common  # noqa: E402
from common import plt  # noqa: E402


class NoPicture(Exception):
    """Why there is none."""


def run(options, method, out):
    """One run; its summary, whatever it ended with."""
    words = [options.program, "run", options.scene, "--method", method, "--time-limit", f"{options.limit:g}", "--out", str(out), "--quiet"]
    words += [word for pair in options.set for word in ("--set", pair)]
    if options.duration:
        words += ["--duration", f"{options.duration:g}"]
    print(shlex.join(words), flush=True)
    try:
        ended = subprocess.run(words, capture_output=True, text=True)
    except OSError as error:
        raise NoPicture(f"{options.program}: {error.strerror}; scripts/build.sh builds it, --program names another one") from None
    if ended.returncode not in (0, 3):
        raise NoPicture(ended.stderr.strip())
    return json.loads((out / "summary.json").read_text())


def whole(file):
    """The rows of a table but for half a one, which a program that was killed leaves at the end."""
    return (row for row in csv.DictReader(file) if None not in row.values())


def displacement(out):
    """Times (s) and the largest distance (m) of a body from where it began."""
    start, far = {}, {}
    with open(out / "trajectory.csv", newline="") as file:
        for row in whole(file):
            t, place = float(row["t"]), [float(row[c]) for c in ("px", "py", "pz")]
            far[t] = max(far.get(t, 0.0), math.dist(place, start.setdefault(row["body"], place)))
    return list(far), list(far.values())


def energy_and_cost(out):
    """Times (s), kinetic energy (J) and processing time so far (s), at the steps' ends."""
    times, energy, cost, sum_s = [], [], [], 0.0
    with open(out / "steps.csv", newline="") as file:
        for row in whole(file):
            sum_s += sum(float(row[c]) for c in ("dynamics_s", "collision_s", "assembly_s", "solve_s"))
            times.append(float(row["t"]))
            energy.append(float(row["kinetic_energy"]))
            cost.append(sum_s)
    return times, energy, cost


def draw(options, folder):
    figure, panels = plt.subplots(3, 1, figsize=(7, 7), sharex=True)
    looks = {method: (name, colour) for (method, _), (name, colour, _) in reversed(common.LOOKS.items())}
    title = options.scene
    for method in options.method:
        summary = run(options, method, folder / method)
        title = f"{summary['scenario']}: {summary.get('title', '')}"
        name, colour = looks.get(method, (method, None))
        style = {"label": name + ("" if summary["status"] == "ok" else f" ({summary['status']})"), "color": colour}
        panels[0].plot(*displacement(folder / method), **style)
        times, energy, cost = energy_and_cost(folder / method)
        panels[1].plot(times, energy, **style)
        panels[2].plot(times, cost, **style)
    for panel, label in zip(panels, ("farthest from its start, m", "kinetic energy, J", "processing time so far, s")):
        panel.set_ylabel(label)
    panels[0].set_title(title)
    panels[2].set_xlabel("simulated time, s")
    figure.tight_layout()
    common.legend(figure, panels[0].get_lines(), columns=4)
    figure.savefig(options.out, bbox_inches="tight")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="a scene's file, or the name of one that comes with the program")
    parser.add_argument("--method", action="append", default=[], help="may be repeated [newton, mirtich, ap, convex]")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the scene")
    parser.add_argument("--duration", type=float, help="simulated time, s [the scene's]")
    parser.add_argument("--limit", type=float, default=10, help="seconds that a run may take; what is done by then is drawn [10]")
    parser.add_argument("--program", default=str(ROOT / "build/bin/contactbench"))
    parser.add_argument("--out", type=Path, default=Path("picture.png"), help="PNG, SVG or PDF [picture.png]")
    options = parser.parse_args()
    options.method = options.method or ["newton", "mirtich", "ap", "convex"]
    if not options.scene.endswith(".xml"):
        options.scene += ".xml"
    try:
        with tempfile.TemporaryDirectory() as folder:
            draw(options, Path(folder))
    except NoPicture as why:
        sys.exit(f"picture: {why}")
    print(options.out)


if __name__ == "__main__":
    main()
