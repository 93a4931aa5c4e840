"""Answers to the stored problems that the tests have come out again to the last digit, as many iterations as before: what changes
an answer without making it wrong is seen here, in whatever room it was changed.

Where a change is meant to move them: PROGRAM=build/bin/contactbench python3 -B test/scripts/test_answers.py make"""
import csv
import json
import os
import re
import sys
import unittest
from pathlib import Path

from contactbench import program, solve_all

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "test/data/answers.csv"
FOLDERS = ("test/data/contact", "test/data/events", "test/data/hardest", "test/data/problems", "test/data/robots",
           "test/data/siconos", "test/data/stacks", "scenarios/stress/problems")
PROGRAM = os.environ.get("PROGRAM")
SAID = ("status", "solver_status", "reason", "iterations", "claimed_residual", "residual", "law_residual", "gap", "infeasibility",
        "energy_change_j", "false_claim", "rank")
# What another optimisation rounds in other ways: a solver that ends elsewhere within its tolerance, problems that are given by W and
# factored as they are read.
ROUNDED = ("--method coulomb --solver newton", "data/problems/fc3d_", "siconos/friction_", "data/stacks/")
LONGEST = 0.02  # s: a solve that takes longer is left out


def answer(flags, limit=60):
    """What the program says of a problem; the flags name files from the root of the project."""
    words = [str(ROOT / word) if word.startswith(FOLDERS) else word for word in flags.split()]
    return solve_all.ask(PROGRAM, [*words, "--repeat", "1"], limit)


def words(said):
    return [json.dumps(said.get(name)) for name in SAID]


def answers(cells):
    """Of each cell, the arguments of `answer`, on all cores."""
    with program.workers(os.cpu_count()) as pool:
        return [future.result() for future in [pool.submit(answer, *cell) for cell in cells]]


def make():
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
        for (flags, _), said in zip(cells, answers(cells)):
            if said.get("time_min_s", 1) < LONGEST:
                rows.writerow([flags, *words(said)])


@unittest.skipUnless(PROGRAM, "PROGRAM is not set: ctest names the program")
class Answers(unittest.TestCase):
    def test_stored_problems_have_the_answers_that_they_had(self):
        version = program.call(PROGRAM, "--version").stdout
        if "-march=x86-64-v3" not in re.findall(r"-march=\S+", version):
            self.skipTest("the answers are of another instruction set")
        with open(TABLE, newline="") as file:
            table = [(flags, said) for flags, *said in csv.reader(file)][1:]
        if "-O3" not in version:
            table = [row for row in table if not any(words in row[0] for words in ROUNDED)]
        self.assertGreater(len(table), 1000)
        found = answers([(flags, ) for flags, _ in table])
        different = [
            f"{flags}: {name} is {now}, was {then}" for (flags, wanted), said in zip(table, found)
            for name, now, then in zip(SAID, words(said), wanted) if now != then]
        self.assertFalse(different, "\n".join([f"{len(different)} of {len(table)} answers, the first:", *different[:20]]))


if __name__ == "__main__":
    make() if sys.argv[1:] == ["make"] else unittest.main()
