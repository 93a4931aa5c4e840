"""Answers to the stored problems that the tests have come out again to the last digit, as many iterations as before, and so do
motions of random scenes: what changes a number without making it wrong is seen here, in whatever room it was changed.

Where a change is meant to move them: PROGRAM=build/bin/contactbench python3 -B test/scripts/test_answers.py make"""
import csv
import hashlib
import json
import os
import re
import sys
import tempfile
import unittest
from pathlib import Path

from contactbench import program, scenes, solve_all

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "test/data/answers.csv"
FOLDERS = ("test/data/contact", "test/data/events", "test/data/hardest", "test/data/problems", "test/data/robots",
           "test/data/siconos", "test/data/stacks", "scenarios/stress/problems")
PROGRAM = os.environ.get("PROGRAM")
SAID = ("status", "solver_status", "reason", "iterations", "claimed_residual", "residual", "law_residual", "gap", "infeasibility",
        "energy_change_j", "false_claim", "rank")
# What another optimisation rounds in other ways: a solver that ends elsewhere within its tolerance, problems that are given by
# W and factored as they are read.
ROUNDED = ("--method coulomb --solver newton", "data/problems/fc3d_", "siconos/friction_", "data/stacks/")
LONGEST = 0.02  # s: a solve that takes longer is left out


def answer(flags, limit=60):
    """What the program says of a problem; the flags name files from the root of the project."""
    placed = [str(ROOT / word) if word.startswith(FOLDERS) else word for word in flags.split()]
    return solve_all.ask(PROGRAM, [*placed, "--repeat", "1"], limit)


def words(said, names):
    return [json.dumps(said.get(name)) for name in names]


def on_all_cores(task, cells):
    """What it returns of each cell, which is its arguments."""
    with program.workers(os.cpu_count()) as pool:
        return [future.result() for future in [pool.submit(task, *cell) for cell in cells]]


def make_answers():
    lcp, contact = solve_all.choices(program.listed(PROGRAM), [8], "1e-12")
    cells = []
    for _, kind, flags, _ in solve_all.problems([ROOT / folder for folder in FOLDERS], ""):
        problem = " ".join(flags).replace(f"{ROOT}/", "")
        for choice in lcp if kind == "lcp" else contact:
            if choice.get("solver") != "path-lib":  # which not everybody has
                more = " ".join(f"--{key} {value}" for key, value in choice.items())
                cells.append((f"{problem} --kind {kind} {more}", 1))
    with open(TABLE, "w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["flags", *SAID])
        for (flags, _), said in zip(cells, on_all_cores(answer, cells)):
            if said.get("time_min_s", 1) < LONGEST:
                rows.writerow([flags, *words(said, SAID)])


# Random scenes: a seed of their own, every second one with capsules, hulls and cylinders.
MOTIONS = ROOT / "test/data/motions.csv"
SEED, SCENES = 20261129, 52
WAYS = ("--method ap --solver lemke", "--method convex --prune on", "--method convex --stepping steps",
        "--method newton --variant uncapped", "--method soft --variant sap --stepping steps")
MOVED = ("status", "steps", "events", "contacts_max", "iterations_total", "max_penetration",
         "t_reached", "residuals", "energy", "penetration", "answered_by", "trajectory")


def motion(number, flags, limit=60):
    """The summary of a run, with the digest of where and how fast all bodies were at its end."""
    with tempfile.TemporaryDirectory() as folder:
        path = scenes.write(scenes.make(SEED, number, number % 2 == 1), Path(folder))
        out = Path(folder) / "out"
        program.call(PROGRAM, "run", path, *flags.split(), "--duration", "0.2", "--record-every", "1000000", "--time-limit",
                     limit, "--quiet", "--out", out)
        said = program.read_json(out / "summary.json") or {}
        rows = (out / "trajectory.csv").read_bytes() if (out / "trajectory.csv").exists() else b""
    return said | {"trajectory": hashlib.sha256(rows).hexdigest()[:16]}


def make_motions():
    cells = [(number, flags, 1) for number in range(SCENES) for flags in WAYS]
    with open(MOTIONS, "w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["number", "flags", *MOVED])
        for (number, flags, _), said in zip(cells, on_all_cores(motion, cells)):
            if said.get("status") != "time_limit" and said.get("time", {}).get("total_s", 1) < 5 * LONGEST:
                rows.writerow([number, flags, *words(said, MOVED)])


@unittest.skipUnless(PROGRAM, "PROGRAM is not set: ctest names the program")
class Answers(unittest.TestCase):
    def setUp(self):
        self.version = program.call(PROGRAM, "--version").stdout
        if "-march=x86-64-v3" not in re.findall(r"-march=\S+", self.version):
            self.skipTest("the numbers are of another instruction set")

    def same(self, task, cells, wanted, names):
        found = on_all_cores(task, cells)
        different = [
            f"{' '.join(map(str, cell))}: {name} is {now}, was {then}" for cell, then_said, said in zip(cells, wanted, found)
            for name, now, then in zip(names, words(said, names), then_said) if now != then]
        self.assertFalse(different, "\n".join([f"{len(different)} numbers of {len(cells)} answers, the first:", *different[:20]]))

    def test_stored_problems_have_the_answers_that_they_had(self):
        with open(TABLE, newline="") as file:
            table = list(csv.reader(file))[1:]
        if "-O3" not in self.version:
            table = [row for row in table if not any(some in row[0] for some in ROUNDED)]
        self.assertGreater(len(table), 1000)
        self.same(answer, [(row[0], ) for row in table], [row[1:] for row in table], SAID)

    def test_random_scenes_have_the_motions_that_they_had(self):
        with open(MOTIONS, newline="") as file:
            table = list(csv.reader(file))[1:]
        if "-O3" not in self.version:  # which rounds capsules, hulls and cylinders in other ways
            table = [row for row in table if int(row[0]) % 2 == 0]
        self.assertGreater(len(table), 90)
        self.same(motion, [(int(number), flags) for number, flags, *_ in table], [row[2:] for row in table], MOVED)


if __name__ == "__main__":
    if sys.argv[1:] == ["make"]:
        make_answers()
        make_motions()
    else:
        unittest.main()
