"""What scripts/stress.py measures with: bisection, the arch's statics, verdicts of cells. Without the program."""
import math
import sys
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import stress  # noqa: E402
from stressing import critical, problems  # noqa: E402


class Bisection(unittest.TestCase):
    def test_it_finds_the_value_from_which_on_it_stands(self):
        found = critical.bisect(lambda x: ("ok", 1e-12, x >= math.sqrt(2)), 1, 2, 1e-6)
        self.assertAlmostEqual(found.value, math.sqrt(2), delta=2e-6)
        self.assertEqual((found.status, found.residual), ("ok", 1e-12))

    def test_what_falls_or_stands_at_either_end_has_no_such_value(self):
        self.assertEqual(critical.bisect(lambda x: ("ok", 0, False), 1, 2, 1e-6).note, "falls at either end")
        self.assertEqual(critical.bisect(lambda x: ("ok", 0, True), 1, 2, 1e-6).note, "stands at either end")

    def test_a_trial_that_fails_ends_it_with_its_status(self):
        found = critical.bisect(lambda x: ("ray", None, False) if 1.2 < x < 1.9 else ("ok", 0, x > 1.5), 1, 2, 1e-6)
        self.assertEqual((found.status, found.value), ("ray", None))


class Arch(unittest.TestCase):
    def read(self, ratio):
        lines = problems.arch(ratio).split("\n")
        n = 3 * int(lines[1])
        return n, [[float(x) for x in line.split()] for line in lines[6:6 + n]], [float(x) for x in lines[6 + n].split()]

    def test_every_joint_has_two_contacts_and_their_matrix_is_symmetric(self):
        n, W, q = self.read(0.15)
        self.assertEqual(n, 3 * 2 * 28)
        self.assertEqual(len(q), n)
        worst = max(abs(W[i][j] - W[j][i]) for i in range(n) for j in range(n))
        self.assertLess(worst, 1e-12 * max(map(max, W)))

    def test_at_first_it_falls_onto_the_ground_as_fast_as_everything_falls_and_nowhere_else(self):
        _, _, q = self.read(0.15)
        for contact in (0, 1, 54, 55):
            self.assertAlmostEqual(q[3 * contact], -problems.FALL, delta=1e-15)
        self.assertLess(max(map(abs, q[6:-6])), 1e-15)


class Verdicts(unittest.TestCase):
    case = {"bound": 1e-9, "departs": {"convex/bound-off": "a reason"}}
    good = {"status": "ok", "hung": False, "nan": False, "residual": 1e-12, "false_claims": 0, "error": 0.0}

    def judge(self, method="ap/lemke", **changed):
        return stress.judge({**self.good, **changed}, self.case, method)

    def test_every_verdict(self):
        self.assertEqual(self.judge(), "right")
        self.assertEqual(self.judge(error=1.0), "wrong")
        self.assertEqual(self.judge("convex/bound-off", error=1.0), "model")
        self.assertEqual(self.judge(status="ray"), "typed")
        self.assertEqual(self.judge(residual=1e-3), "silent")
        self.assertEqual(self.judge(status="inaccurate", residual=1e-3), "typed")
        self.assertEqual(self.judge(status="inaccurate", error=1.0), "wrong")
        self.assertEqual(self.judge(false_claims=1), "silent")
        for fault in ({"status": "crash"}, {"hung": True}, {"nan": True}):
            self.assertEqual(self.judge(**fault), "defect")


if __name__ == "__main__":
    unittest.main()
