"""Methods that are wrong on purpose (test/wrong_methods) are found: by their error against the step, and by the referee."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from contactbench import precision
from contactbench.runs import Runs

ROOT = Path(__file__).resolve().parents[2]

SWEEP = """
record_every = 0
epsilon = "1e-12"
step = ["1e-2", "5e-3", "2.5e-3", "1.25e-3"]
methods = ["convex", "strong-friction", "boastful"]
[[runs]]
scene = "sliding_box"
"""
PROGRAM = os.environ.get("WRONG_PROGRAM")


@unittest.skipUnless(PROGRAM, "WRONG_PROGRAM is not set: ctest names the program")
class WrongMethods(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        made = Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, made)
        for name in ("orders", precision.SWEEP):
            (made / f"{name}.toml").write_text(SWEEP)
        subprocess.run([sys.executable, "-B", ROOT / "scripts/sweep.py", made / "orders.toml", made / f"{precision.SWEEP}.toml",
                        "--program", PROGRAM, "--runs", made / "runs", "--out", made], check=True, stdout=subprocess.DEVNULL)
        cls.results = Runs(made, made / "runs")
        cls.orders = {r["cells"][0]["method"]: r for r in precision.orders(cls.results)}
        cls.points = precision.points(cls.results, "sliding_box", "")

    def test_friction_one_percent_too_strong_shows_in_the_error_that_does_not_fall_with_the_step(self):
        right, wrong = self.orders["convex"], self.orders["strong-friction"]
        self.assertAlmostEqual(right["order"], 1.0, delta=0.1)
        self.assertLess(max(map(abs, wrong["halvings"])), 0.1)
        # The push exceeds friction by 2 %: half of that is gone, and with it half of 0.16 m.
        for error in wrong["errors"]:
            self.assertAlmostEqual(error, 0.08, delta=0.01)

    def test_no_wrong_method_is_on_the_front_where_it_counts_or_recommended(self):
        front = [p["cell"]["method"] for p in precision.pareto(self.points) if p["error"] < 0.01]
        self.assertEqual(set(front), {"convex"})
        best, _, _ = precision.choose(self.points, 0.01)
        self.assertEqual(best["cell"]["method"], "convex")

    def test_a_false_word_of_success_shows_in_the_column_of_claims(self):
        truth = precision.truthfulness(self.results)
        self.assertEqual(truth["convex, epsilon 1e-12 J"]["false_claims"], 0)
        boaster = truth["boastful ipm, epsilon 1e-12 J"]
        self.assertGreater(boaster["false_claims"], 0.1 * boaster["solves"])
        self.assertEqual(boaster["ok"], 0)

    def test_friction_too_strong_on_a_light_box_is_found_beside_a_heavy_one_at_every_speed(self):
        scene = ROOT / "test/data/scenes/hidden_island.xml"
        for fast in (0, 1, 1e2, 1e4, 1e6):
            for method, refuted in (("convex", 0), ("strong-friction", 100)):
                with self.subTest(fast=fast, method=method), tempfile.TemporaryDirectory() as out:
                    subprocess.run([PROGRAM, "run", scene, "--method", method, "--set", f"fast={fast}", "--duration", "0.1",
                                    "--out", out, "--quiet"], check=True)
                    residuals = json.loads((Path(out) / "summary.json").read_text())["residuals"]
                    self.assertEqual(residuals["false_claims"], refuted)

    def test_a_run_that_is_stopped_keeps_its_worst_problem_and_does_not_solve_it_again(self):
        kept = []
        for limits in (["--duration", "2"], ["--duration", "1e5", "--time-limit", "0.5"]):
            with tempfile.TemporaryDirectory() as out:
                subprocess.run([PROGRAM, "run", ROOT / "scenarios/sliding_box.xml", "--method", "boastful", "--record-every", "0", "--out", out,
                                "--quiet", *limits], stderr=subprocess.DEVNULL)
                kept.append(json.loads((Path(out) / "summary.json").read_text()))
        whole, stopped = kept
        if whole["hard_problem"] is None:
            self.skipTest("no HDF5 in this build: problems are not kept")
        self.assertIsNotNone(whole["hard_problem_command"])
        self.assertEqual(stopped["status"], "time_limit")
        self.assertIsNotNone(stopped["hard_problem"])
        self.assertIsNone(stopped["hard_problem_command"])


if __name__ == "__main__":
    unittest.main()
