"""What findings of engines measure, what a bisection asks, and the contact problems that the suite makes: by hand."""
import contextlib
import io
import json
import math
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
from contactbench import findings, limits, problems, program

HEAD = "t,body,px,py,pz\n"
MUJOCO = {"engines": [{"name": "mujoco", "unavailable": None}]}


def says(words):
    return next(f for f in findings.FINDINGS if words in f.says)


class Measured(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)

    def motion(self, *rows):
        (self.top / "trajectory.csv").write_text(HEAD + "".join(",".join(map(str, row)) + "\n" for row in rows))

    def test_a_way_is_from_the_first_place_to_the_last_and_the_furthest_is_that_of_any_body_at_any_time(self):
        self.motion((0, "b", 1, 2, 3), (1, "b", 90, 0, 0), (2, "b", 3, 5, 9))
        self.assertEqual(findings.way({}, self.top), 7)  # 2, 3, 6
        # Each from its own start; the last moment has lost a body.
        self.motion((0, "a", 5, 0, 0), (0, "b", 0, 9, 0), (1, "a", 5, 0, 1), (1, "b", 2, 12, 6), (2, "a", 5, 0, 0),
                    (2, "b", 0, 9, 0), (3, "a", 99, 0, 0))
        self.assertEqual((findings.furthest(self.top), findings.moved({}, self.top)), (7, 7))
        self.motion()
        self.assertTrue(math.isnan(findings.furthest(self.top)))
        self.assertEqual(findings.error("b")({"errors": {"a": 1, "b": 2}}, self.top), 2)
        self.assertTrue(math.isnan(findings.error("c")({"errors": {"c": None}}, self.top)))

    def test_each_finding_asks_the_engine_for_what_it_speaks_of(self):
        asked = {f.says: [" ".join(c.words) for c in f.cases] for f in findings.FINDINGS}
        pushed = "sliding_box --engine {} --step 1e-3 --set push_angle={}"
        for who, flags in (("dart (dantzig)", "dart --variant dantzig"), ("ode (quick)", "ode --variant quick"),
                           ("ode (world)", "ode --variant world")):
            along, across = asked[f"the friction pyramid of {who} holds a box that is pushed at 45 degrees"]
            self.assertEqual(along, pushed.format(flags, "0"))
            self.assertEqual(across.rpartition("=")[0], pushed.format(flags, "x").rpartition("=")[0])
            self.assertEqual(float(across.rpartition("=")[2]), math.pi / 4)
        creep = "sticking_box --engine mujoco --variant newton-elliptic --step {} --duration 2"
        self.assertEqual(asked["that creep does not depend on the step"], [creep.format(h) for h in ("1e-2", "1e-3", "1e-4")])
        self.assertEqual(asked["MuJoCo at its defaults creeps by 3.8e-3 to 4e-3 m in 2 s"],
                         [creep.format(h) for h in ("1e-3", "1e-4")])
        self.assertEqual(asked["MuJoCo rebounds at e = 0 in a sliding impact"],
                         ["impacting_sphere --engine mujoco --variant newton-elliptic --step 1e-3"])
        self.assertEqual(
            asked["ODE's direct solver loses stacks from 4 to 8 boxes on"],
            [f"stack --engine ode --variant world --step 1e-3 --duration 1 --set boxes={n}" for n in (1, 2, 4, 8, 16)])
        self.assertEqual([(Path(words.split()[0]).name, *words.split()[1:])
                          for words in asked["sequential impulses break at mass ratios of 1e2 to 1e4"]],
                         [("mass_ratio.xml", *f"--engine bullet --variant si10 --step 1e-3 --set ratio={r}".split())
                          for r in ("1", "100", "1000", "10000", "1e+06")])
        self.assertEqual(
            {f.says: f.unit for f in findings.FINDINGS if f.unit != "m"},
            {"that creep does not depend on the step": "m/s", "MuJoCo rebounds at e = 0 in a sliding impact": "m/s"})

    def test_a_finding_comes_out_up_to_its_bounds(self):
        for words, again, otherwise in (("of ode (quick)", [(1.0, 0.0099)], [(1.0, 0.0101), (0.0, 1.0)]), ("creeps by", [
            (3.76e-3, 4.04e-3), (4.04e-3, 3.76e-3)], [
                (3.74e-3, 3.9e-3), (3.9e-3, 3.74e-3), (3.9e-3, 4.06e-3)]), ("that creep", [(1, 1.0009, 1)], [
                    (1, 1.0011, 1), (1.0011, 1, 1)]), ("rebounds", [(0.11, )], [(0.09, )]), ("ODE's direct", [
                        (0.9e-3, 0.9e-3, 9, 0.11, 0.11),
                        (0, 0, 0, math.inf, math.inf)], [(1.1e-3, 0, 0, 1, 1), (0, 1.1e-3, 0, 1, 1), (0, 0, 1, 0.09, 1),
                                                         (0, 0, 1, 1, 0.09)]), ("sequential", [(0.9e-3, 9, 9, 0.11, 0.11)], [
                                                             (1.1e-3, 9, 9, 1, 1), (0, 9, 9, 0.09, 1), (0, 9, 9, 1, 0.09)])):
            for numbers, answer in [(of, True) for of in again] + [(of, False) for of in otherwise]:
                self.assertIs(bool(says(words).comes_out(*numbers)), answer, (words, numbers))

    def test_a_row_has_the_number_of_each_run_in_the_order_of_the_cases(self):
        called = []

        def run(path, *words, timeout):
            called.append((path, *words[:2], words[words.index("--time-limit") + 1], timeout))
            step = words[words.index("--step") + 1]
            (Path(words[words.index("--out") + 1]) / "trajectory.csv").write_text(HEAD)
            summary = {
                "finished": True, "status": "inaccurate", "errors": {
                    "creep_rate_m_per_s": 2 + float(step), "position_linf_m": 9}}
            return mock.Mock(stdout=json.dumps(summary))

        with mock.patch.object(program, "call", run):
            row = findings.outcome("there", says("that creep"), MUJOCO, limit=7)
        self.assertEqual(called, [("there", "run", "sticking_box", 7, 41)] * 3)
        self.assertEqual(
            row, {
                "says": "that creep does not depend on the step", "engine": "mujoco", "unit": "m/s", "comes_out": False,
                "unavailable": None, "runs": [{"name": f"h = {h} s", "number": 2 + float(h), "status": "inaccurate"}
                                              for h in ("1e-2", "1e-3", "1e-4")]})
        self.assertEqual(
            findings.said(row),
            "contradicted: that creep does not depend on the step (h = 1e-2 s: 2.01 m/s; h = 1e-3 s: 2 m/s; "
            "h = 1e-4 s: 2 m/s)")
        row["runs"][1]["number"] = None
        self.assertIn("; h = 1e-3 s: inaccurate; ", findings.said(row | {"comes_out": True}))
        self.assertEqual([
            findings.verdict({"unavailable": no, "comes_out": out})
            for no, out in (("x", None), (None, True), (None, False), (None, None))],
                         ["not measured (x)", "comes out again", "contradicted", "not measured (a run has no number)"])
        self.assertEqual(findings.outcome("", says("that creep"), {"engines": []})["unavailable"], "no such engine")

    def test_findings_are_written_with_a_line_each(self):
        with mock.patch.object(findings, "outcome",
                               lambda path, f, listed: {"says": f.says, "unavailable": path, "runs": [], "comes_out": None}):
            with contextlib.redirect_stdout(io.StringIO()) as out:
                findings.write("why", {}, self.top / "new")
        rows = json.loads((self.top / "new/findings.json").read_text())
        self.assertEqual([r["says"] for r in rows], [f.says for f in findings.FINDINGS])
        self.assertEqual(out.getvalue().splitlines(), [f"not measured (why): {f.says}" for f in findings.FINDINGS])


class Bisected(unittest.TestCase):
    def test_an_answer_that_is_inaccurate_is_one_and_is_said_with_the_largest_residual(self):
        asked = []

        def trial(x):
            asked.append(x)
            return ("inaccurate", 0.5, True) if x == 6 else ("ok", None if x == 4 else x / 100, x >= 5)

        found = limits.bisect(trial, 4, 8, 0.2)
        # 6 stands, 5 stands: between 4 and 5, of which 0.2 times the upper end is enough.
        self.assertEqual((asked, found), ([4, 8, 6, 5], limits.Found("inaccurate", 0.5, 4.5, "stands from 4.5 on")))

    def test_an_end_that_fails_or_is_the_wrong_way_round_says_so(self):
        self.assertEqual(limits.bisect(lambda x: ("ok", 0, x < 1.5), 1, 2, 0.1).note,
                         "falls at either end")  # it stands where it should fall
        for bad in (1, 2):
            found = limits.bisect(lambda x, bad=bad: ("crash" if x == bad else "ok", 1e-3, x > 1.5), 1, 2, 0.1)
            self.assertEqual((found.status, found.value, found.note, found.residual), ("crash", None, "a trial failed", 1e-3))

    def test_a_step_is_tried_for_two_thousand_steps_without_contacts(self):
        asked = []
        with tempfile.TemporaryDirectory() as folder:

            def run(*words):
                step = float(words[words.index("--step") + 1])
                asked.append((words[0], *words[2:6], round(
                    float(words[words.index("--duration") + 1]) / step), words[words.index("--out") + 1]))
                summary = {"status": "crash" if step > 50 else "ok", "control": {"largest_stable_step": step}}
                (Path(folder) / "summary.json").write_text(json.dumps(summary))

            with mock.patch.object(limits.program, "call", run), self.assertRaisesRegex(ValueError, "crash at a step of "):
                limits.stable_step("program", "robot.xml", ["--set", "a=1"], folder)
        self.assertEqual(set(asked), {("program", "robot.xml", "--method", "newton", "--set", 2000, folder)})


class Problems(unittest.TestCase):
    made = {name: (text, ends, speed) for name, text, ends, speed in problems.made()}

    def read(self, text):
        lines = text.split("\n")
        n = int(lines[3])
        self.assertEqual(lines[:6], ["3", str(n // 3), "0", str(n), str(n), f"{n} {n}"])
        W = np.array([[float(x) for x in line.split()] for line in lines[6:6 + n]]).T if n else np.zeros(
            (0, 0))  # a line a column
        q, mu = ([float(x) for x in line.split()] for line in lines[6 + n:8 + n])
        self.assertEqual((len(q), len(mu), lines[8 + n:]), (n, n // 3, [""]))
        return W, np.array(q), mu

    def test_a_matrix_is_written_column_by_column_before_q_and_mu(self):
        W, q, mu = self.read(problems.text([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]], [0.1, 0.2, 0.3], [0.5]))
        np.testing.assert_array_equal(W, [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
        self.assertEqual((q.tolist(), mu), ([0.1, 0.2, 0.3], [0.5]))

    def test_a_body_s_contact_moves_and_yields_as_its_mass_inertia_and_arm_say(self):
        # v + w x p = (1, 2, 3) + (3, -6, 3); 1 / m + (|p|^2 - p p^T) / I with |p|^2 = 14; rows y, x, -z.
        W, q = problems.body([(1.0, 2.0, 3.0)], [1, 2, 3, 4, 5, 6], mass=2.0, inertia=4.0)
        np.testing.assert_allclose(q, [-4, 4, -6])
        np.testing.assert_allclose(W, [[3, -0.5, 1.5], [-0.5, 3.75, 0.75], [1.5, 0.75, 1.75]])
        # Two contacts of one body: 1 / m + (p . p') / I across, where the arms and the direction are at right angles.
        W, _ = problems.body([(0, -0.5, 0), (0, -0.25, 0)], [0] * 6)
        np.testing.assert_allclose(np.array(W)[1, [1, 4]], [1 + 6 * 0.25, 1 + 6 * 0.125])
        np.testing.assert_allclose(np.array(W)[0, [0, 3]], [1, 1])

    def test_what_is_made_has_its_contacts_its_friction_its_ends_and_its_speed(self):
        names = [
            "one_contact", "one_contact_mu_0", "one_contact_mu_1e6", "no_contact", "nan", "1e300", "both_sides_fixed",
            "repeated_2", "repeated_16", "repeated_100", "patch_of_0.001_m", "patch_of_1e-06_m", "patch_of_1e-09_m",
            *(f"patch_of_{n * n}_contacts"
              for n in (2, 4, 8, 16)), "driven_into_a_wall", "triangle_29.99_Nm", "triangle_30.01_Nm"]
        self.assertEqual(list(self.made), names)
        W, q, mu = self.read(self.made["one_contact"][0])
        np.testing.assert_allclose(W, np.diag([1, 2.5, 2.5]), atol=1e-15)  # 1 kg, a cube's 1/6, half a metre above the ground
        np.testing.assert_allclose(q, [-0.098, 0.1, 0], atol=1e-15)
        frictions = {name: self.read(self.made[name][0])[2] for name in names if name != "nan"}
        self.assertEqual([
            frictions[name]
            for name in ("one_contact", "one_contact_mu_0", "one_contact_mu_1e6", "driven_into_a_wall", "no_contact")],
                         [[0.5], [0.0], [1e6], [0.3, 0.3], []])
        self.assertEqual(
            {name: len(mu) for name, mu in frictions.items() if "repeated" in name or "_contacts" in name or "_m" in name[-2:]},
            {
                "repeated_2": 2, "repeated_16": 16, "repeated_100": 100, "patch_of_0.001_m": 4, "patch_of_1e-06_m": 4,
                "patch_of_1e-09_m": 4, "patch_of_4_contacts": 4, "patch_of_16_contacts": 16, "patch_of_64_contacts": 64,
                "patch_of_256_contacts": 256})
        speeds = {name: speed for name, (_, _, speed) in self.made.items() if speed is not None}
        self.assertEqual(
            {name: s for name, s in speeds.items() if s == 0},
            dict.fromkeys(["one_contact_mu_1e6", *(f"patch_of_{n * n}_contacts" for n in (2, 4, 8, 16)), "triangle_29.99_Nm"],
                          0.0))
        self.assertEqual(speeds["one_contact_mu_0"], 0.1)
        ends = {name: ends for name, (_, ends, _) in self.made.items() if ends != ["solved"]}
        self.assertEqual(list(ends), ["no_contact", "nan", "1e300", "both_sides_fixed", "driven_into_a_wall"])
        self.assertEqual((ends["nan"], ends["both_sides_fixed"]), (["input_error"], ["input_error"]))
        self.assertFalse({"solved"} & set(ends["driven_into_a_wall"]))
        self.assertTrue(math.isnan(self.read(self.made["nan"][0])[1][0]))
        self.assertEqual(self.read(self.made["1e300"][0])[1].tolist()[0], -1e300)

    def test_a_patch_lies_under_its_body_and_walls_close_in_from_both_sides(self):
        W, q, _ = self.read(self.made["patch_of_4_contacts"][0])
        # At the corners of a cube: 1 + 6 x (1/4 + 1/4) against the normal, 1 across the diagonal less 3.
        np.testing.assert_allclose([W[0, 0], W[0, 9]], [4, -2], atol=1e-14)
        np.testing.assert_allclose(q.reshape(-1, 3), [[-0.098, 0, 0]] * 4)
        W, q, _ = self.read(self.made["patch_of_0.001_m"][0])
        self.assertAlmostEqual(W[0, 0], 1 + 6 * 2e-6, 14)
        self.assertAlmostEqual(W[0, 9], 1 - 6 * 2e-6, 14)
        W, q, _ = self.read(self.made["driven_into_a_wall"][0])
        np.testing.assert_array_equal(W, np.block([[np.eye(3), -np.eye(3)], [-np.eye(3), np.eye(3)]]))
        np.testing.assert_array_equal(q, [-1, 0, 0, -1, 0, 0])
        W, q, _ = self.read(self.made["both_sides_fixed"][0])
        np.testing.assert_array_equal(W, np.zeros((3, 3)))

    def test_three_legs_turn_by_the_torque_of_a_step(self):
        inertia = 3.0 * 1.5**2 / 2
        self.assertAlmostEqual(self.made["triangle_30.01_Nm"][2], 0.01 * 1e-3 / inertia * 1.5, 18)  # what 30 N m do not hold
        for torque in (29.99, 30.01):
            W, q, mu = self.read(self.made[f"triangle_{torque:g}_Nm"][0])
            self.assertEqual(mu, [2 / 3] * 3)
            of = q.reshape(3, 3)
            np.testing.assert_allclose(of[:, 0], -1e-2)
            np.testing.assert_allclose(np.hypot(of[:, 1], of[:, 2]), torque * 1e-3 / inertia * 1.5)
            np.testing.assert_allclose(of.sum(axis=0)[1:], 0, atol=1e-15)  # evenly around the middle
            self.assertAlmostEqual(W[0, 0], 1 / 3.0 + 1.5**2 / inertia)  # the legs are level with the middle

    def test_a_voussoir_of_the_arch_has_the_mass_and_inertia_of_its_piece_of_the_ring(self):
        # Summed over small pieces; a metre deep and of density 1.
        ratio, radius, count = 0.15, 10.0, 27
        half = math.pi / (2 * count)
        r, angle = np.meshgrid(radius * (1 + ratio * (np.arange(400) + 0.5 - 200) / 400),
                               half * (np.arange(200) + 0.5) / 100, indexing="ij")
        piece = r * (radius * ratio / 400) * (half / 100)
        x, y = r * np.cos(angle), r * np.sin(angle)
        mass = piece.sum()
        middle = (piece * x).sum() / mass, (piece * y).sum() / mass
        inertia = (piece * ((x - middle[0])**2 + (y - middle[1])**2)).sum()
        W, _, mu = self.read(problems.arch(ratio, mu=0.25))
        self.assertEqual(mu, [0.25] * 56)
        # On the ground, at the inner and the outer edge: normal up, t1 outwards, t2 to the side.
        arms = [(edge - middle[0], -middle[1]) for edge in (radius * (1 - ratio / 2), radius * (1 + ratio / 2))]
        for contact, (a, b) in enumerate(arms):
            block = W[3 * contact:3 * contact + 3, 3 * contact:3 * contact + 3]
            np.testing.assert_allclose(block, [[1 / mass + a * a / inertia, -a * b / inertia, 0],
                                               [-a * b / inertia, 1 / mass + b * b / inertia, 0], [0, 0, 1 / mass]], rtol=1e-4,
                                       atol=1e-12)
        (a, _), (c, _) = arms
        np.testing.assert_allclose(W[0, 3], 1 / mass + a * c / inertia, rtol=1e-4)
        # A joint between two has both of them, and those beyond a neighbour have nothing of each other.
        np.testing.assert_allclose(W[8, 8], 2 / mass, rtol=1e-4)
        np.testing.assert_allclose(W[2, 8], -1 / mass, rtol=1e-4)
        self.assertEqual(abs(W[:6, 12:]).max(), 0)
        self.assertTrue((np.linalg.eigvalsh(W) > -1e-12).all())


if __name__ == "__main__":
    unittest.main()
