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
LONGEST = 0.02  # s: a solve that takes longer is left out,
HARDEST = 0.3  # s, but for the problems that coulomb by newton finds the hardest: only they take all its ways


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
            if said.get("time_min_s", 1) < (HARDEST if "/hardest/" in flags and "--solver newton" in flags else LONGEST):
                rows.writerow([flags, *words(said, SAID)])


# How scenes go: random ones, by a seed of their own, every second one with capsules, hulls and cylinders, and those that are here.
MOTIONS = ROOT / "test/data/motions.csv"
SEED, SCENES = 20261129, 52
WAYS = ("--method ap --solver lemke", "--method convex --prune on", "--method convex --stepping steps",
        "--method newton --variant uncapped", "--method soft --variant sap --stepping steps")
PLACES = ("scenarios", "scenarios/stress", "scenarios/preflight", "test/data/accuracy", "test/data/scenes")
MORE_WAYS = ("--method ap --solver path --k 8 --restitution 0.3", "--method mirtich --gyroscopic explicit",
             "--method convex --accuracy 1e-3", "--method convex --accuracy 1e-5 --record-interval 0.02",
             "--method convex --compression-bound on --perturb 1e-3 --seed 2 --record-every 3",
             "--method coulomb --solver newton --stepping steps --joint-forces implicit --conditioning",
             "--method coulomb --solver nsgs --warm-start on --prune rest",
             "--method coulomb --solver nsgs --sweeps 3 --accuracy 1e-3",
             "--method newton --prune off --shuffle-contacts 3 --joint-forces explicit",
             "--method soft --variant mujoco --stepping steps --friction 0.4")
MOVED = ("status", "reason", "steps", "events", "iterations_total", "energy")
OF_ITS_TIME = ("file", "time", "peak_memory_mb", "versions", "machine")  # of a summary: not of its scene


def without_times(path):
    """A file of a run, without the columns of a table that are times on the clock."""
    if path.name != "steps.csv":
        return path.read_bytes()
    with open(path, newline="") as file:
        rows = [[word for name, word in row.items() if not name.endswith("_s")] for row in csv.DictReader(file)]
    return json.dumps(rows).encode()


def motion(scene, flags, limit=60):
    """The summary of a run, with a digest of each file that it wrote. A number is a random scene."""
    with tempfile.TemporaryDirectory() as folder:
        path = scenes.write(scenes.make(SEED, int(scene), int(scene) % 2 == 1), Path(folder)) if scene.isdigit() else ROOT / scene
        out = Path(folder) / "out"
        program.call(PROGRAM, "run", path, *flags.split(), "--duration", "0.2" if scene.isdigit() else "0.1", "--record-contacts",
                     "--time-limit", limit, "--quiet", "--out", out)
        said = program.read_json(out / "summary.json") or {"options": {}}
        said["options"].pop("time_limit_s", None)
        contents = {file.name: without_times(file) for file in sorted(out.glob("*"))}
        text = json.dumps({key: value for key, value in said.items() if key not in OF_ITS_TIME})
        contents["summary.json"] = text.replace(folder, "").replace(str(ROOT), "").encode()
    return said | {"files": {name: hashlib.sha256(content).hexdigest()[:8] for name, content in contents.items()}}


def make_motions():
    cells = [(str(number), flags, 1) for number in range(SCENES) for flags in WAYS]
    here = [path.relative_to(ROOT) for place in PLACES for path in sorted((ROOT / place).glob("*.xml"))]
    cells += [(str(path), flags, 1) for path in here for flags in MORE_WAYS]
    with open(MOTIONS, "w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["scene", "flags", *MOVED, "files"])
        for (scene, flags, _), said in zip(cells, on_all_cores(motion, cells)):
            if said.get("status") != "time_limit" and said.get("time", {}).get("total_s", 1) < 5 * LONGEST:
                rows.writerow([scene, flags, *words(said, (*MOVED, "files"))])


@unittest.skipUnless(PROGRAM, "PROGRAM is not set: ctest names the program")
class Answers(unittest.TestCase):
    def setUp(self):
        if "-march=x86-64-v3" not in re.findall(r"-march=\S+", program.call(PROGRAM, "--version").stdout):
            self.skipTest("the numbers are of another instruction set")

    def same(self, task, cells, wanted, names):
        found = on_all_cores(task, cells)
        different = [
            f"{' '.join(map(str, cell))}: {name} is {now}, was {then}" for cell, then_said, said in zip(cells, wanted, found)
            for name, now, then in zip(names, words(said, names), then_said) if now != then]
        self.assertFalse(different, "\n".join([f"{len(different)} numbers of {len(cells)} answers, the first:", *different[:20]]))

    def test_the_compiler_fuses_no_product_with_a_sum(self):
        # Kernels and Eigen fuse by name, never these: what g++ makes of both by itself depends on its version and tuning.
        fused = re.findall(r"\bvfn?m\w+", program.call("objdump", "-d", PROGRAM).stdout)
        self.assertTrue(fused, "no instruction is read")
        self.assertFalse([word for word in fused if "addsub" in word or "subadd" in word])

    def test_stored_problems_have_the_answers_that_they_had(self):
        with open(TABLE, newline="") as file:
            table = list(csv.reader(file))[1:]
        self.assertGreater(len(table), 1000)
        self.same(answer, [(row[0], ) for row in table], [row[1:] for row in table], SAID)

    def test_scenes_have_the_motions_that_they_had(self):
        with open(MOTIONS, newline="") as file:
            table = list(csv.reader(file))[1:]
        self.assertGreater(len(table), 500)
        self.same(motion, [(scene, flags) for scene, flags, *_ in table], [row[2:] for row in table], (*MOVED, "files"))


if __name__ == "__main__":
    if sys.argv[1:] == ["make"]:
        make_answers()
        make_motions()
    else:
        unittest.main()
