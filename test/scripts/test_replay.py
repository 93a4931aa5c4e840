"""scripts/replay.py with the real program: every solver gets the same problems of one run, and the referee judges all of them."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from contactbench import solve_all
from contactbench.runs import Runs

ROOT = Path(__file__).resolve().parents[2]

PROGRAM = os.environ.get("PROGRAM")


@unittest.skipUnless(PROGRAM, "PROGRAM is not set: ctest names the program")
class Replay(unittest.TestCase):
    def test_all_get_the_same_problems_and_exact_friction_is_told_from_a_polygon(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, "-B", ROOT / "scripts/replay.py", "--program", PROGRAM, "--only", "circular", "--out",
                            Path(folder) / "replay"], check=True, stdout=subprocess.DEVNULL)
            (Path(folder) / "runs.csv").write_text("run\n")
            counts = {name: c for (_, name), c in solve_all.summary(solve_all.streams(Runs(folder, folder))["circular sliding"]).items()}
        self.assertEqual({c["problems"] for c in counts.values()}, {8})
        self.assertEqual({c["false_claims"] for c in counts.values()}, {0})
        self.assertLess(counts["convex ipm bound on"]["law_residual"], 1e-12)
        # The box slides round: a polygon's friction is off its direction, the less the finer it is.
        polygon = [counts[f"ap lemke k = {k}"] for k in (4, 8)]
        self.assertTrue(all(c["residual"] < 1e-12 for c in polygon))
        self.assertGreater(polygon[0]["law_residual"], polygon[1]["law_residual"])
        self.assertGreater(polygon[1]["law_residual"], 1e-6)


if __name__ == "__main__":
    unittest.main()
