"""scripts/stress.py: what it takes from a stored problem that was solved, and from a search for a critical value (limits.py), on
answers that are made up, each field another number; and the problems that it makes (problems.py), by hand."""
import json
import math
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
from contactbench import limits, problems, program, stress
from contactbench.stress import ROOT
from folder import Folder
from test_stress_runs import LISTED, ended, options


class Solves(Folder):
    def solve(self, stdout="{}", stderr="", code=0, speeds=(), kind="contact", end=None):
        asked = []

        def call(*words, timeout=None):
            asked.append(([str(w) for w in words], timeout))
            if end:
                raise end
            if speeds and "--velocities" in words:
                words[-1].write_text("%%MatrixMarket\n% by hand\n6 1\n" + "\n".join(map(str, speeds)) + "\n")
            return ended(stdout, stderr, code)

        with mock.patch.object(program, "call", call):
            found = stress.solve(kind, ["a.dat", "--k", "8"], options(scratch=self.top))
        return found, asked[0]

    def test_a_solve_is_its_status_its_last_words_and_the_fastest_contact(self):
        found, (words, timeout) = self.solve('{"status": "ray", "residual": 0.5}', "first\nlast", 3, speeds=(1, 2, -2, -4, 0, 3))
        self.assertEqual(found, ("ray", "last", {"status": "ray", "residual": 0.5}, 5.0, 3))  # of n, t1, t2 of each contact
        self.assertEqual((words[:6], timeout), (["prog", "solve", "a.dat", "--k", "8", "--json"], 41))
        self.assertEqual(words[6:9], ["--time-limit", "7", "--velocities"])
        found, (words, _) = self.solve('{"status": "ok"}', "noise", kind="lcp")
        self.assertEqual((found, words[6:]), (("ok", "", {"status": "ok"}, None, 0), ["--time-limit", "7"]))

    def test_a_solve_that_did_not_end_as_it_should_says_so(self):
        self.assertEqual(self.solve(end=program.Late("p", 1))[0], ("time_limit", "did not come back", {}, None, -9))
        self.assertEqual(self.solve("{", "noise")[0], ("crash", "what it printed is no JSON", {}, None, 1))
        self.assertEqual(self.solve('{"status": "ok"}', "bad\nfile", 2)[0][:2], ("input_error", "file"))
        self.assertEqual(self.solve('{"status": "ok"}', "abort", -6)[0][:2], ("crash", "abort"))
        self.assertEqual(self.solve("", "", 0)[0][:3], ("crash", "", {}))

    def problem(self, status="ok", said="", residual=1e-9, speed=None, code=0, wanted=None, ends=("solved", ), case=None,
                method="ap/lemke", **answer):
        job = {
            "kind": "contact", "arguments": [], "ends": list(ends), "speed": wanted, "case": case or {}, "method": method,
            "text": "the command"}
        answer = {"residual": residual, "time_min_s": 2e-6, "iterations": 5, **answer}
        with mock.patch.object(stress, "solve", lambda *_: (status, said, answer, speed, code)):
            return stress.do_problem(job, options())

    def test_a_stored_problem_comes_to_each_verdict_by_how_it_ends(self):
        verdict = lambda **of: self.problem(**of)["verdict"]
        for of, wanted in (({}, "right"), ({"status": "inaccurate"}, "right"), ({"residual": 1e-6}, "right"), ({
                "residual": 1.1e-6}, "silent"), ({"residual": 1.1e-6, "status": "inaccurate"}, "typed"), ({
                    "status": "ray", "code": 3}, "typed"), ({"status": "ray", "code": 3, "residual": None}, "typed"), ({
                        "residual": None}, "defect"), ({"status": "crash", "code": -6}, "defect"), ({
                            "status": "time_limit", "code": -9}, "defect"), ({"status": "input_error", "code": 2}, "typed"), ({
                                "ends": ["ray"]}, "wrong"), ({"ends": ["ray"], "case": {"gives_way": ["soft"]}}, "wrong"), ({
                                    "ends": ["ray"], "case": {"gives_way": ["soft"]},
                                    "method": "soft/sap"}, "model"), ({"wanted": 0.5, "speed": 0.5004}, "right"), ({
                                        "wanted": 0.5, "speed": 0.5006}, "wrong"), ({"wanted": 0.0, "speed": 0.5e-9}, "right"), ({
                                            "wanted": 0.0, "speed": 1.5e-9}, "wrong"), ({
                                                "wanted": 0.5, "speed": 0.9,
                                                "case": {"departs": {"ap": "a polygon"}}}, "model"), ({"wanted": 0.5}, "right")):
            self.assertEqual(verdict(**of), wanted, of)

    def test_each_number_of_a_solve_is_in_its_cell(self):
        cell = self.problem(reason="why", condition=1.25e8, rank=11, rows=12)
        self.assertEqual({key: value for key, value in cell.items() if value not in (None, False, "", 0)}, {
            "status": "ok", "note": "why; rank 11 of 12 rows, condition 1.2e+08", "residual": 1e-9, "error": 1e-9, "bound": 1e-6,
            "solve_s": 2e-6, "iterations": 5, "command": "the command", "verdict": "right"})
        self.assertEqual(self.problem("ray", "last words", code=3)["note"], "last words")
        self.assertEqual(self.problem(iterations=None, pivots=8)["iterations"], None)
        cell = self.problem(wanted=0.5, speed=0.75, reason="why")
        self.assertEqual((cell["error"], cell["bound"], cell["note"]), (0.25, 1e-9, "moves with 0.75 m/s, not 0.5; why"))
        cell = self.problem(ends=["ray", "cycling"])
        self.assertEqual(cell["note"], "solved, although it must end as one of: ray, cycling")
        cell = self.problem(ends=["ray"], case={"gives_way": ["soft"], "departs": {"soft": "it gives way"}}, method="soft/sap")
        self.assertEqual(cell["note"], "it gives way")

    def test_a_problem_that_is_made_lies_beside_those_that_are_stored(self):
        cases = {
            "problem": [{"id": "X", "kind": "contact", "generated": True, "files": ["a.hdf5"], "ends": ["solved"]}, {
                "id": "Y", "kind": "lcp", "files": ["c"], "ends": ["ray"]}]}
        made = [("one", "text of one", ["solved"], 0.25), ("two", "text of two", ["ray"], None)]
        with mock.patch.object(problems, "made", lambda: made):
            jobs = stress.problem_jobs(cases, [("ap/lemke", ["--method", "ap"])], LISTED, [], self.top)
        self.assertEqual([(j["id"], j["name"], j["ends"], j["speed"], j["method"], j["text"]) for j in jobs[:3]], [
            ("X", name.split(".")[0] if speed else name, ends, speed, "ap/lemke",
             f"contactbench solve {file} --kind contact --method ap")
            for name, ends, speed, file in (("a.hdf5", ["solved"], None, "a.hdf5"), ("one", ["solved"], 0.25, "one.dat"),
                                            ("two", ["ray"], None, "two.dat"))])
        self.assertEqual((self.top / "two.dat").read_text(), "text of two")
        self.assertEqual(jobs[2]["arguments"], [str(self.top / "two.dat"), "--kind", "contact", "--method", "ap"])
        # Bare solvers have linear problems too; those of other methods have not.
        path = ROOT / "test/data/problems/c"
        self.assertEqual([(j["method"], j["arguments"], j["text"]) for j in jobs[3:]],
                         [(f"ap/{s}", ["--kind", "lcp", "--matrix", f"{path}.M.mtx", "--vector", f"{path}.q.mtx", "--solver", s
                                       ], f"contactbench solve --kind lcp --matrix c.M.mtx --vector c.q.mtx --solver {s}")
                          for s in ("lemke", "path", "bare")])


class Searches(Folder):
    def test_a_stable_step_is_right_where_it_is_near_the_measured_one(self):
        case = {"id": "K1", "scene": "stiff_joints", "bound": 0.05, "expect": "near"}
        for estimate, verdict, error in ((0.0208, "right", 0.04), (0.0188, "wrong", 0.06), (0.0212, "wrong", 0.06)):
            with mock.patch.object(limits, "stable_step", return_value=(0.02, estimate)) as asked:
                cell = stress.do_limit({"stiffness": 1e3}, case, options(scratch=self.top))
            self.assertAlmostEqual(cell["error"], error, delta=1e-12)
            self.assertEqual((cell["verdict"], cell["row"], cell["note"]),
                             (verdict, "stiffness=1000.0", f"measured 0.02 s, estimated {estimate:.4g} s"))
        self.assertEqual({k: cell[k] for k in ("id", "scene", "bound", "expect", "method", "status", "command")}, {
            **case, "method": "explicit step", "status": "ok", "command": "contactbench check stiff_joints --set stiffness=1000.0"
        })
        self.assertEqual(asked.call_args.args[:3],
                         ("prog", ROOT / "scenarios/stress/stiff_joints.xml", ["--set", "stiffness=1000.0"]))

    def critical(self, case, call, method="coulomb"):
        case = {"id": "S2", "bound": 1e-3, "expect": "stands", "from": 1.0, "to": 2.0, "critical": 1.5, "parameter": "mu", **case}
        with mock.patch.object(program, "execute", call), mock.patch.object(program, "call", call):
            return stress.do_critical(case, (method, ["--method", method]), options(scratch=self.top))

    def test_a_structure_stands_from_where_nothing_of_it_moves(self):
        commands = []

        def scene(critical, status="ok", residual=1e-9):
            def execute(command, *_):
                commands.append(command)
                folder, value = Path(command[command.index("--out") + 1]), float(
                    command[command.index("--set") + 1].removeprefix("mu="))
                way = 0.9e-9 if value >= critical else 1.1e-9
                (folder / "trajectory.csv").write_text(f"t,body,px,py,pz\n0,a,0,0,0\n1,a,0,{way},0\n")
                (folder / "summary.json").write_text(
                    json.dumps({
                        "status": status, "residuals": {"max": residual * value}, "parameters": {}, "options": {"step": 1}}))

            return execute

        case = {"scene": "card_house", "duration": 0.25}
        cell = self.critical(case, scene(1.5003))
        self.assertEqual((cell["verdict"], cell["row"], cell["method"], cell["status"]),
                         ("right", "critical mu", "coulomb", "ok"))
        self.assertAlmostEqual(cell["error"], 0.0003 / 1.5, delta=1e-4)
        self.assertEqual(cell["residual"], 2e-9)  # the largest of all trials
        self.assertEqual(cell["command"], "scripts/stress.py --only S2 --method coulomb")
        self.assertIn("stands from 1.500", cell["note"])
        self.assertEqual(commands[0][:5], ["prog", "run", str(ROOT / "scenarios/stress/card_house.xml"), "--method", "coulomb"])
        self.assertEqual(commands[0][5:11], ["--set", "mu=1.0", "--duration", "0.25", "--time-limit", "7"])
        self.assertEqual(self.critical(case, scene(1.503))["verdict"], "wrong")
        cell = self.critical(case, scene(9.0))
        self.assertEqual((cell["verdict"], cell["error"], cell["note"]), ("wrong", None, "falls at either end"))
        self.assertEqual(
            self.critical(case | {"departs": {"ap": "more answers"}}, scene(9.0), "ap/lemke")["note"],
            "falls at either end; more answers")
        self.assertEqual(self.critical(case, scene(1.5, "ray"))["verdict"], "typed")
        # A run that leaves nothing is no leftover of the one before.
        left = scene(1.5)
        ended_runs = []

        def dies(command, *_):
            if not ended_runs:
                left(command)
            ended_runs.append(command)

        self.assertEqual(self.critical(case, dies)["verdict"], "defect")

    def test_an_arch_stands_where_no_contact_gets_a_millionth_of_its_fall(self):
        def call(*words, timeout=None):
            ratio = float(Path(words[2]).read_text())
            speed = (0.9e-6 if ratio >= 1.5 else 1.1e-6) * problems.FALL
            words[-1].write_text(f"%%MatrixMarket\n6 1\n0\n0\n0\n0\n{speed}\n0\n")
            return ended(json.dumps({"status": "ok", "residual": ratio * 1e-9}))

        with mock.patch.object(problems, "arch", str):
            cell = self.critical({"scene": "arch", "parameter": "t/R"}, call)
        self.assertEqual((cell["verdict"], cell["row"], cell["residual"]), ("right", "critical t/R", 2e-9))
        self.assertLess(cell["error"], 1e-4)


class Bisection(unittest.TestCase):
    def test_the_worst_of_all_trials_counts_and_the_answer_is_as_near_as_was_asked(self):
        asked = []

        def trial(value):
            asked.append(value)
            return "inaccurate" if value < 1.2 else "ok", 1e-9 / value, value >= 1.4142

        found = limits.bisect(trial, 1.0, 2.0, 0.01)
        self.assertEqual((found.status, found.residual), ("inaccurate", 1e-9))
        self.assertLess(abs(found.value - 1.4142), 0.01 * 1.4142)
        self.assertEqual(found.note, f"stands from {found.value:.6g} on")
        # The ends, and halves from 1 down to a hundredth of what lies there.
        self.assertEqual((asked[:4], len(asked)), ([1.0, 2.0, 1.5, 1.25], 2 + 7))
        # Inaccurate answers count, a residual that is not there is none.
        found = limits.bisect(lambda x: ("ok", None, x > 1.5), 1, 2, 1e-3)
        self.assertEqual((found.status, found.residual), ("ok", 0.0))

    def test_a_trial_that_fails_at_an_end_says_so(self):
        for bad in (1, 2):
            found = limits.bisect(lambda x, bad=bad: ("ray" if x == bad else "ok", 0.5, x == 2), 1, 2, 1e-3)
            self.assertEqual((found.status, found.value, found.note, found.residual), ("ray", None, "a trial failed", 0.5))

    def test_what_a_trial_failed_with_stays_beside_what_the_other_end_is(self):
        for low, high, status in (("crash", "inaccurate", "crash"), ("ray", "inaccurate", "ray"), ("crash", "ray", "crash"),
                                  ("ray", "crash", "crash"), ("inaccurate", "ray", "ray"), ("ray", "time_limit", "time_limit")):
            found = limits.bisect(lambda x, low=low, high=high: (low if x == 1 else high, None, x == 2), 1, 2, 1e-3)
            self.assertEqual((found.status, found.value, found.note), (status, None, "a trial failed"), (low, high))

    def test_a_step_is_tried_over_two_thousand_of_them_and_any_other_end_is_a_fault(self):
        asked = []

        def call(*words, status="ok"):
            asked.append([str(w) for w in words])
            step = float(words[words.index("--step") + 1])
            status = status if step < 1e-3 else "energy_blowup"
            (Path(words[words.index("--out") + 1]) / "summary.json").write_text(
                json.dumps({"status": status, "control": {"largest_stable_step": 1e3 * step}}))

        with tempfile.TemporaryDirectory() as folder:
            with mock.patch.object(program, "call", call):
                step, estimate = limits.stable_step("prog", "scene.xml", ["--set", "k=1"], folder)
            self.assertAlmostEqual(step / 1e-3, 1, delta=limits.NEARNESS)
            self.assertAlmostEqual(estimate, 1e-4, delta=1e-18)  # of the shortest step
            self.assertEqual(asked[0], [
                "prog", "run", "scene.xml", "--method", "newton", "--set", "k=1", "--step", "1e-07", "--duration",
                repr(2000 * 1e-7), "--record-every", "0", "--out", folder, "--quiet"])
            with mock.patch.object(program, "call", lambda *words: call(*words, status="ray")), self.assertRaisesRegex(
                    ValueError, "ray at a step of"):
                limits.stable_step("prog", "scene.xml", [], folder)


class Made(unittest.TestCase):
    """Problems that are made for the suite."""
    def read(self, text):
        """(contacts, W as its columns, q, mu) of Siconos' text."""
        lines = text.split("\n")
        self.assertEqual((lines[0], lines[2], lines[5]), ("3", "0", " ".join([lines[3]] * 2)))
        n = int(lines[3])
        numbers = [[float(x) for x in line.split()] for line in lines[6:]]
        self.assertEqual((int(lines[4]), n), (n, 3 * int(lines[1])))
        return int(lines[1]), numbers[:n], numbers[n], numbers[n + 1]

    def test_a_matrix_is_written_column_by_column(self):
        W = [[10.0 * i + j for j in range(3)] for i in range(3)]
        self.assertEqual(self.read(problems.text(W, [1.0, 2.0, 3.0], [0.5])),
                         (1, [[0, 10, 20], [1, 11, 21], [2, 12, 22]], [1, 2, 3], [0.5]))

    def test_a_body_s_contacts_move_as_a_rigid_body_does(self):
        points, v, w, mass, inertia = [(0.5, -0.25, 2.0), (-1.0, 0.75, 0.125)], [1.0, 2.0, 3.0], [0.3, 0.7, -0.2], 4.0, 0.5
        W, q = problems.body(points, v + w, mass, inertia)
        axes = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])  # up, x, against z
        for i, p in enumerate(points):
            np.testing.assert_allclose(q[3 * i:3 * i + 3], axes @ (v + np.cross(w, p)), atol=1e-14)
            for a, d in enumerate(axes):  # what an impulse there does to all of them
                turned = np.cross(p, d) / inertia
                for j, other in enumerate(points):
                    np.testing.assert_allclose([W[3 * j + b][3 * i + a] for b in range(3)],
                                               axes @ (d / mass + np.cross(turned, other)), atol=1e-13)

    def test_each_has_the_numbers_the_speed_and_the_ends_of_its_name(self):
        body = problems.body  # of hundreds of contacts it takes seconds
        with mock.patch.object(problems, "body", lambda points, *of: body(points if len(points) <= 64 else points[:1], *of)):
            every = list(problems.made())
        made = {name: (self.read(text) if "no_contact" not in name else None, ends, speed) for name, text, ends, speed in every}
        patches = [f"patch_of_{n * n}_contacts" for n in (2, 4, 8, 16)]
        self.assertEqual(list(made), [
            "one_contact", "one_contact_mu_0", "one_contact_mu_1e6", "no_contact", "nan", "1e300", "both_sides_fixed",
            "repeated_2", "repeated_16", "repeated_100", "patch_of_0.001_m", "patch_of_1e-06_m", "patch_of_1e-09_m", *patches,
            "driven_into_a_wall", "triangle_29.99_Nm", "triangle_30.01_Nm"])
        speeds = {name: speed for name, (_, _, speed) in made.items() if speed is not None}
        # What 30 N m do not hold: 0.01 N m for 1 ms, R h dM / I with I = m R^2 / 2.
        self.assertAlmostEqual(speeds.pop("triangle_30.01_Nm"), 0.01 * 1e-3 / 3.375 * 1.5, delta=1e-15)
        self.assertEqual(speeds, {
            "one_contact_mu_0": 0.1, "one_contact_mu_1e6": 0.0, **dict.fromkeys(patches, 0.0), "triangle_29.99_Nm": 0.0})
        self.assertEqual([name for name, (_, ends, _) in made.items() if ends != ["solved"]],
                         ["no_contact", "nan", "1e300", "both_sides_fixed", "driven_into_a_wall"])
        self.assertEqual([made[name][1] for name in ("nan", "both_sides_fixed")], [["input_error"]] * 2)
        self.assertNotIn("solved", made["driven_into_a_wall"][1])
        self.assertTrue(math.isnan(made["nan"][0][2][0]))
        self.assertEqual(made["1e300"][0][2][0], -1e300)
        self.assertEqual(made["both_sides_fixed"][0][1], [[0.0] * 3] * 3)
        self.assertEqual({name: of[0][3] for name, of in made.items() if name.startswith("one_")},
                         {"one_contact": [0.5], "one_contact_mu_0": [0.0], "one_contact_mu_1e6": [1e6]})
        # One slides with 0.1 m/s and falls by a step of gravity; so do all of a patch, which lies level and turns about nothing.
        self.assertEqual(made["one_contact"][0][2], [-0.098, 0.1, 0.0])
        for name, count in (("repeated_16", 16), ("patch_of_64_contacts", 64), ("patch_of_1e-06_m", 4)):
            contacts, _, q, mu = made[name][0]
            self.assertEqual((contacts, mu), (count, [0.5] * count))
            self.assertEqual(set(q[0::3]), {-0.098})
        for name, size in (("patch_of_4_contacts", 1.0), ("patch_of_0.001_m", 2e-3)):
            # A corner's normal impulse turns the body: 1 / m and x^2 + z^2 over 1/6 of a square of such an edge; it lifts the opposite one.
            W = made[name][0][1]
            for n in range(4):
                self.assertAlmostEqual(W[3 * n][3 * n], 1 + 6 * size**2 / 2, delta=1e-12)
            self.assertAlmostEqual(W[0][9], 1 - 6 * size**2 / 2, delta=1e-12)
        # Two walls close in on what is between them: no impulse of theirs changes the sum of the two speeds, which is negative.
        _, W, q, mu = made["driven_into_a_wall"][0]
        np.testing.assert_array_equal(W, np.block([[np.eye(3), -np.eye(3)], [-np.eye(3), np.eye(3)]]))
        self.assertEqual((q, mu), ([-1, 0, 0, -1, 0, 0], [0.3, 0.3]))
        # Three contacts bear 3 kg with g = 10 and turn under 29.99 or 30.01 N m, 1 ms long, of I = m R^2 / 2.
        for torque in (29.99, 30.01):
            contacts, W, q, mu = made[f"triangle_{torque:g}_Nm"][0]
            self.assertEqual((contacts, mu), (3, [2 / 3] * 3))
            self.assertAlmostEqual(W[0][0], 1 / 3 + 1.5**2 / 3.375, delta=1e-14)  # the legs are level with the middle
            for direction in (1, 2):
                self.assertAlmostEqual(sum(q[direction::3]), 0, delta=1e-15)  # evenly around it
            for n in range(3):
                self.assertAlmostEqual(math.hypot(q[3 * n + 1], q[3 * n + 2]), torque * 1e-3 / 3.375 * 1.5, delta=1e-15)
                self.assertAlmostEqual(q[3 * n], -0.01, delta=1e-15)

    def test_voussoirs_weigh_and_turn_as_pieces_of_a_ring_do(self):
        ratio, count, R = 0.15, 27, 10.0
        contacts, W, _, mu = self.read(problems.arch(ratio, 0.7))
        half = math.pi / (2 * count)
        # By rings and rays: mass (of density 1), middle, and inertia about it, of a piece about the x axis.
        r, a = np.meshgrid(R * (1 + ratio * ((np.arange(400) + 0.5) / 400 - 0.5)), half * ((np.arange(400) + 0.5) / 200 - 1))
        weight = r * R * ratio / 400 * half / 200
        mass = weight.sum()
        x = (weight * r * np.cos(a)).sum() / mass
        inertia = (weight * ((r * np.cos(a) - x)**2 + (r * np.sin(a))**2)).sum()
        for joint, pieces in ((0, 1), (5, 2), (27, 1)):
            for edge, at in enumerate((R * (1 - ratio / 2), R * (1 + ratio / 2))):
                row = 3 * (2 * joint + edge)
                # Along the arch an impulse acts at the arm along the joint; across it, at the other one.
                arms = at - x * math.cos(half), x * math.sin(half)
                for d, arm in enumerate(arms):
                    self.assertAlmostEqual(W[row + d][row + d] / (pieces * (1 / mass + arm**2 / inertia)), 1, delta=1e-4)
                self.assertAlmostEqual(W[row + 2][row + 2] / (pieces / mass), 1, delta=1e-4)
        self.assertEqual((contacts, mu), (56, [0.7] * 56))
        # On the ground, at the inner and the outer edge: the normal is up and t1 outwards, and an impulse up moves outwards too.
        arms = [(edge - x * math.cos(half), -x * math.sin(half)) for edge in (R * (1 - ratio / 2), R * (1 + ratio / 2))]
        for contact, (a, b) in enumerate(arms):
            self.assertAlmostEqual(W[3 * contact][3 * contact + 1] / (-a * b / inertia), 1, delta=1e-4)
        self.assertAlmostEqual(W[0][3] / (1 / mass + arms[0][0] * arms[1][0] / inertia), 1, delta=1e-4)
        # Sidewards a piece between two joints goes by its mass alone.
        self.assertAlmostEqual(W[2][8] / (-1 / mass), 1, delta=1e-4)
        # What is between two joints that have no piece in common is nothing.
        self.assertEqual({W[i][j] for i in range(6) for j in range(12, 168)}, {0})


if __name__ == "__main__":
    unittest.main()
