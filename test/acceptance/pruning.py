#!/usr/bin/env python3
"""What a run leaves out changes nothing: every scene with every method and solver, with and without pruning, what rests and warm start.

usage: pruning.py PROGRAM [--jobs N] [--only TEXT] [--short]

A pair of runs is the same where all positions and velocities agree to 1e-10 (to the last bit where the summary says that
nothing was left out). Where the law has several answers to an event, or one to a tolerance only, the ways may part (MAY_PART
names these): then both runs must end well, no claim of either may be refuted, and the energies where they part must agree to 1e-10.
Answers of `ap` to one event can differ in energy too (SEVERAL_ENERGIES, docs/deviations.md): there both ways must have met that event
in the same state, to rounding, and both answers must solve it. Where a pair does neither, the plain way is asked what it does by
itself when the start is moved by 1e-15 m: that must part from it as early and as far. From where the plain way says that it is inaccurate, nothing is compared.
Exits 1 if a pair does neither, or if another parts.
--short: scripts/test.sh runs that part always, all of it with --long.
"""
import argparse
import csv
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

SAME = 1e-10
ROUNDING = 1e-12  # of states before an event where two answers to it are told from one that is not good,
SOLVED = 1e-10  # and of residuals after it: what coulomb's solvers call solved
ENDS_WELL = ("ok", "inaccurate")
PARTED = ("parts", "energies part")
TWINS, MOVED, AS_FAR = 4, "1e-15", 10  # runs from other starts; moved by so many m; times what these part by, at most

# Scene and method whose ways may part, and why.
MAY_PART = {
    ("urdf_arm", "ap"): "finger and box slip and turn: who carries the friction is open, and with it the box's turn",
    ("grasp", "ap"): "two fingers hold with friction: the forces between them are open, and the joints feel them",
    ("urdf_arm", "coulomb"): "the same",
    ("grasp", "coulomb"): "the same",
    ("mobile_robot", "coulomb"): "which wheel carries the load is open, and one without load runs away",
    ("mobile_robot", "soft"): "answers are known to its tolerance, 1e-13 a contact, and 100 steps add up",
    ("grasp", "soft"): "the same",
    ("mass_ratio", "ap"): "a box of 1e3 kg on one of 1 g: answers within rounding of the load, far apart for the light box",
    ("mass_ratio", "soft"): "the same",
    ("wall", "soft"): "bricks that give way leave each other and come back, a thousand events a step: chaos",
    ("card_house_three", "mirtich"): "impacts one at a time: which of two equally fast ones comes first is up to rounding",
}
# Of these: whose answers may differ in energy.
SEVERAL_ENERGIES = {("urdf_arm", "ap"), ("grasp", "ap"), ("urdf_arm", "coulomb"), ("mobile_robot", "coulomb")}
# Between two rows of the trajectory so much happens that the first difference of energies says nothing.
CHAOS = {("wall", "soft")}
# Who ends typed where the other way meets no such event. Programs of a cascade have no answer where what slips is squeezed.
MAY_END = {("urdf_arm", "coulomb --solver cascade")}
SHORT = ("impacting_sphere", "sticking_box", "contact_grid", "boxes=4", "card_house")

# Scene, parameters and flags: long enough for what happens in it, with steps that make it quick.
SCENES = [
    ("stress/contact_grid", {"n": "6", "vx": "0.5"}, ["--duration", "0.2"]),
    ("impacting_sphere", {}, []), ("sliding_box", {}, ["--step", "1e-2", "--duration", "4"]),
    ("sticking_box", {}, ["--duration", "0.1"]), ("circular_sliding", {}, ["--step", "1e-2", "--duration", "2"]),
    ("circular_sliding", {"start": "rest"}, ["--step", "1e-2", "--duration", "2"]),
    ("stack", {"boxes": "1"}, ["--duration", "0.05"]), ("stack", {"boxes": "4"}, ["--duration", "0.05"]),
    ("mobile_robot", {}, ["--duration", "0.1"]), ("mobile_robot_caster", {}, ["--duration", "0.1"]),
    ("grasp", {}, ["--duration", "0.05"]), ("urdf_arm", {}, ["--duration", "0.6"]),
    ("stress/card_house_three", {}, ["--duration", "0.01"]),
]
STRESS = ["alternating_stack", "bouncing_ball", "bullet", "card_house", "chain", "contact_grid", "cradle", "driven_ram", "far_away",
          "friction_contrast", "groove", "mass_ratio", "painleve", "repeated_contact", "rocking_block", "slender", "squeeze",
          "stiff_joints", "units", "wall"]


def method_flags(program):
    """Every method, variant and solver that this build can use."""
    listed = json.loads(subprocess.run([program, "list", "--json"], check=True, capture_output=True, text=True).stdout)
    unavailable = {row["name"] for row in listed.get("solvers", []) if row.get("unavailable")}
    for row in listed["methods"]:
        warm = any(option["flag"] == "warm-start" for option in row["options"])
        for solver in row["solvers"] or [None]:
            for variant in row["variants"] or [None]:
                if solver in unavailable or solver in ("pgs", "bisection"):
                    # pgs: an example, which ends well nowhere; bisection: answers hang on where its sweeps began
                    continue
                yield (["--method", row["name"], *(["--solver", solver] if solver else []),
                        *(["--variant", variant] if variant else [])], warm)


def run(command, out):
    done = subprocess.run([*command, "--quiet", "--out", str(out)], capture_output=True, text=True)
    path = Path(out) / "summary.json"
    if not path.exists():
        return {"status": "none", "reason": done.stderr.strip()[-200:], "left_out": []}, [], []
    rows = {}
    for name in ("trajectory", "steps"):
        file = Path(out) / f"{name}.csv"
        rows[name] = list(csv.reader(file.open()))[1:] if file.exists() else []
    return json.loads(path.read_text()), rows["trajectory"], rows["steps"]


def numbers(row):
    return [float(x) for x in row[2:]]


def parting(a, b, same=SAME):
    """Index of the row at which two trajectories are no longer the same, and the largest difference; in m, m/s, rad/s, or
    as a fraction of the scene's largest where that is more than 1."""
    size = max([1.0, *(abs(x) for row in a for x in numbers(row)[:3])])
    speed = max([1.0, *(abs(x) for row in a for x in numbers(row)[7:])])
    first, worst = None, 0.0
    for i, (row_a, row_b) in enumerate(zip(a, b)):
        difference = [abs(x - y) for x, y in zip(numbers(row_a), numbers(row_b))]
        found = max(max(difference[:3]) / size, max(difference[3:7]), max(difference[7:]) / speed)
        worst = max(worst, found)
        if first is None and not found <= same:
            first = i
    return first, worst


def energy_gap(steps_a, steps_b, t):
    """Difference of the energies at time t, over the most that the run had."""
    def energies(steps):
        return {row[1]: float(row[14]) + float(row[15]) for row in steps}
    a, b = energies(steps_a), energies(steps_b)
    scale = max([1e-300, *(abs(float(row[14])) + abs(float(row[15])) for row in steps_a)])
    return abs(a[t] - b[t]) / scale if t in a and t in b else 0.0


def two_answers(a, b, steps_a, steps_b, t):
    """Did two runs give the event at time t, which they met in the same state, two answers that both solve it?"""
    first, _ = parting(a, b, ROUNDING)
    residuals = [float(row[8]) for steps in (steps_a, steps_b) for row in steps if row[1] == t]
    return a[first][0] == t and len(residuals) == 2 and max(residuals) <= SOLVED


def by_itself(plain, less, twins):
    """Does the plain way part from runs that began beside it no later than from `less`, and as far? None: how it does."""
    rows = plain[1]
    first, worst = parting(rows, less[1])
    others = [parting(rows, twin[1]) for twin in twins if twin[0]["status"] in ENDS_WELL]
    began = [i for i, _ in others if i is not None]
    if began and min(began) <= first and worst <= AS_FAR * max(w for _, w in others):
        return f"runs from a start beside it part at t = {rows[min(began)][0]} s, up to {max(w for _, w in others):.1e}"
    return None


def judge(name, plain, less):
    """What is wrong with a pair of runs (empty: nothing), and how they compare."""
    (summary_a, rows_a, steps_a), (summary_b, rows_b, steps_b) = plain, less

    def among(cases):
        return any(f"{scene}.xml" in name and f"--method {method} " in name + " " for scene, method in cases)

    if summary_a["status"] not in ENDS_WELL:
        return "", f"does not end the plain way: {summary_a['status']}"
    if summary_b["status"] not in ENDS_WELL:
        how = f"ends {summary_b['status']}: {summary_b['reason']}"
        return ("", how) if among(MAY_END) else (how, "")
    if not summary_b["left_out"] and rows_a != rows_b:
        return "nothing left out, yet not the same to the last bit", ""
    first, worst = parting(rows_a, rows_b)
    if first is None and len(rows_a) == len(rows_b):
        return "", "bit for bit" if rows_a == rows_b else f"same to {worst:.1e}"
    claims = [summary["residuals"]["false_claims"] for summary in (summary_a, summary_b)]
    if first is None:
        return "one run ends before the other", ""
    t = rows_a[first][0]
    gap = energy_gap(steps_a, steps_b, t)
    how = f"part at t = {t} s, up to {worst:.1e}, energies there by {gap:.1e}"
    if any(claims):
        return f"false claims {claims}", how
    # An answer that the plain way calls inaccurate is nothing to hold the other to.
    loose = [row[1] for row in steps_a if row[6] == "inaccurate" and float(row[1]) <= float(t)]
    if loose:
        return "", f"{how}: the plain way is inaccurate at t = {loose[0]} s"
    if not among(MAY_PART):
        return PARTED[0], how
    if gap <= SAME or among(CHAOS):
        return "", how
    if not among(SEVERAL_ENERGIES) or not two_answers(rows_a, rows_b, steps_a, steps_b, t):
        return PARTED[1], how
    return "", f"{how}: two answers to one event"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="")
    parser.add_argument("--short", action="store_true")
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    scenes = [(f"{name}.xml", sets, flags) for name, sets, flags in SCENES]
    scenes += [(f"stress/{name}.xml", {}, ["--duration", "0.1"]) for name in STRESS]
    pairs = []
    for file, sets, flags in scenes:
        for method, warm in method_flags(program):
            base = [program, "run", str(Path(__file__).resolve().parents[2] / "scenarios" / file), *method, *flags,
                    "--time-limit", "60", *(x for key, value in sets.items() for x in ("--set", f"{key}={value}"))]
            name = " ".join([file, *(f"{key}={value}" for key, value in sets.items()), *method])
            pairs.append((name, base, warm))
    pairs = [pair for pair in pairs if arguments.only in pair[0]
             and (not arguments.short or any(part in pair[0] for part in SHORT))]

    def do(pair):
        name, base, warm = pair
        with tempfile.TemporaryDirectory() as scratch:
            plain = run([*base, "--prune", "off"], f"{scratch}/plain")
            less = run([*base, "--prune", "on"], f"{scratch}/less")
            rested = run([*base, "--prune", "rest"], f"{scratch}/rested")
            pairs = [("prune", plain, less, ["--prune", "off"]), ("rest", less, rested, ["--prune", "on"])]
            if warm:
                started = run([*base, "--prune", "on", "--warm-start", "on"], f"{scratch}/warm")
                pairs.append(("warm", less, started, ["--prune", "on"]))
            results = []
            for what, one, other, flags in pairs:
                wrong, kind = judge(name, one, other)
                if wrong in PARTED:
                    twins = [run([*base, *flags, "--perturb", MOVED, "--seed", str(i)], f"{scratch}/{what}{i}") for i in range(TWINS)]
                    if how := by_itself(one, other, twins):
                        wrong, kind = "", f"{kind}: {how}"
                results.append((what, (wrong, kind), other[0]))
            return name, results

    failed = 0
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for name, results in pool.map(do, pairs):
            for what, (wrong, kind), summary in results:
                failed += bool(wrong)
                print("FAIL" if wrong else "ok  ", what, name, kind, wrong,
                      {row["what"]: row["count"] for row in summary["left_out"]}, sep="  ", flush=True)
    print(f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
