"""The Python module from outside: each number where it belongs, against what is done by hand and what the program writes."""
import csv
import json
import os
import resource
import subprocess
import tempfile
import time
import unittest

import numpy as np

import contactbench as cb

PROGRAM = os.environ.get("PROGRAM")
# Two contacts that know nothing of each other. With RIGHT the first sticks, the second slips on with (0, 0, -1.625) m/s.
W, Q, MU = np.diag([2, 4, 4, 1, 0.5, 0.5]), [-2, 1, 0, -3, 0, -2], [0.5, 0.25]
RIGHT = [[1, -0.25, 0], [3, 0, 0.75]]

YARD = """<scenario title="A crate that tumbles, a ball that bounces and an arm">
  <simulation step="2e-3" duration="0.1"/><reference kind="missing"/><gravity constant="0.5 -9 0.25"/>
  <bodies>
    <half_space name="ground" point="0 0 0" normal="0 1 0"/>
    <box name="crate" size="0.5 1 1.5" mass="2" position="0 2 0" velocity="1 2 3" angular_velocity="4 5 6"/>
    <sphere name="ball" radius="0.25" mass="3" position="3 0.26 0" velocity="2 -1 0.5"/>
    <box name="slab" size="1 0.2 1" mass="5" position="-3 0.1 0" velocity="1 0 0.5"/>
    <robot name="arm"><link name="bar" mass="4" position="5 5 0" inertia="1 2 3"/>
      <joint name="hinge" kind="revolute" parent="world" child="bar" anchor="4.5 5 0" axis="0 1 0" velocity="2"/>
      <link name="tip" mass="1" position="6 5 0" inertia="1 2 3"/>
      <joint name="slide" kind="prismatic" parent="bar" child="tip" axis="1 0 0" velocity="0.5"/></robot>
  </bodies>
  <contacts><pair a="crate" b="ground" mu="0.5"/><pair a="slab" b="ground" mu="0.375"/>
    <pair a="ball" b="ground" mu="0.25" restitution="0.75"/></contacts>
</scenario>"""


def columns_of(path):
    """Columns of a CSV file by their names: numbers, an empty cell being none, or words."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {}
    for name in rows[0]:
        cells = [row[name] for row in rows]
        words = name in ("body", "joint", "status")
        columns[name] = np.array(cells if words else [float(cell) if cell else np.nan for cell in cells])
    return columns


def two():
    return cb.Problem(W=W, q=Q, mu=MU)


class Written(float):
    """A number that writes itself as those of NumPy 2 do."""
    def __repr__(self):
        return f"np.float64({float(self)})"


class ByHand(unittest.TestCase):

    def test_the_referee_says_what_is_done_by_hand(self):
        a = cb.judge(two(), RIGHT, "coulomb")
        self.assertEqual((bool(a), a.holds, a.status, a.reason), (True, True, "ok", ""))
        np.testing.assert_array_equal(a.impulses, RIGHT)
        np.testing.assert_allclose(a.velocities, [[0, 0, 0], [0, 0, -1.625]], atol=1e-12)
        self.assertAlmostEqual(a.energy_change, -6.984375, places=12)  # sum of r.(u- + u+) / 2
        self.assertAlmostEqual(a.energy_before, 9.625, places=12)  # u-.W^-1 u- / 2
        self.assertLess(a.residual, 1e-12)
        self.assertLess(a.law_residual, 1e-12)
        self.assertEqual((a.gap, a.infeasibility, a.solver_status, a.iterations, a.seconds), (None, None, None, 0, 0))
        self.assertGreater(a.check_seconds, 0)

    def test_an_error_is_that_of_its_contact(self):
        a = cb.judge(two(), [RIGHT[0], [2.5, 0, 1]], "coulomb")
        self.assertEqual((bool(a), a.status, a.worst_contact), (False, "inaccurate", 1))
        self.assertIn("at contact 1 of island 1", a.reason)
        np.testing.assert_allclose(a.velocities[1], [-0.5, 0, -1.5], atol=1e-12)
        # r - P(r - u~ / w): P of (2.6875, 0, 3.25) is (1, 0, 0.25) times 3.5 / 1.0625; of |u-|^2 / w, w = 2/3.
        along = 3.5 / 1.0625
        self.assertAlmostEqual(a.law_residual, np.hypot(2.5 - along, 1 - along / 4) * 2 / 3 / np.sqrt(13), places=7)
        self.assertEqual(cb.judge(two(), [[1, -0.125, 0], RIGHT[1]], "coulomb").worst_contact, 0)

    def test_a_tolerance_decides_what_holds_whoever_answers(self):
        off = np.array(RIGHT) + [[0, 0, 0], [0, 0, 1e-7]]
        for tolerance, holds in ((1e-6, True), (1e-10, False)):
            judged = cb.judge(two(), off, "coulomb", tolerance=tolerance)
            solved = cb.solve(two(), lambda p: off, law="coulomb", tolerance=tolerance)
            for a in (judged, solved):
                self.assertEqual((a.holds, a.status), (holds, "ok" if holds else "inaccurate"))
                self.assertEqual("beyond 1e-10" in a.reason, not holds)
            # What the referee finds is nothing that the solver said.
            self.assertEqual((judged.solver_status, solved.solver_status, solved.solver_reason), (None, "ok", ""))

    def test_a_polygon_has_the_edges_that_are_asked_for_whoever_answers(self):
        # It slides with (1, 0.5): friction 0.2 is at the corner nearest to that, of four or of eight.
        p, diagonal = cb.Problem(W=np.eye(3), q=[-2, 1, 0.5], mu=0.1), 0.2 * np.sqrt(0.5)
        for k, right in ((4, [2, -0.2, 0]), (8, [2, -diagonal, -diagonal])):
            for asked in (4, 8):
                judged = cb.judge(p, right, "anitescu_potra", k=asked)
                solved = cb.solve(p, lambda problem, answer=right: answer, law="anitescu_potra", k=asked)
                self.assertEqual((judged.holds, solved.holds), (k == asked, k == asked), (k, asked))

    def test_a_method_finds_it_and_says_of_itself_what_it_knows(self):
        a = cb.solve(two(), "coulomb")
        np.testing.assert_allclose(a.impulses, RIGHT, atol=1e-7)
        self.assertEqual((a.status, a.solver_status, a.solver_reason), ("ok", "ok", ""))
        self.assertGreater(a.check_seconds, 0)
        convex = cb.solve(two(), "convex")
        self.assertLessEqual(abs(convex.gap), 1e-12)
        self.assertLessEqual(convex.infeasibility, 1e-9)
        p = two()
        np.testing.assert_allclose(p.velocity(np.ravel(RIGHT)), a.velocities, atol=1e-7)
        np.testing.assert_allclose(p.velocity([[1, 0, 0], [0, 0, 2]]), [[0, 1, 0], [-3, 0, -1]], atol=1e-12)

    def test_a_body_of_its_own_mass_moves_as_its_impulse_says(self):
        # 2 kg and 4 kg m^2 about x: the contact's normal pushes along y, half a metre to the side.
        J = np.zeros((3, 6))
        J[0, [1, 3]], J[1, 0], J[2, 2] = [1, 0.5], 1, 1
        p = cb.Problem(M=np.diag([2, 2, 2, 4, 5, 6]), J=J, v=[3, -1, 0.5, 0, 0, 0], mu=0.25, e=[0.5], offset=[0.25, 0, -0.5])
        np.testing.assert_allclose(p.q, [-0.75, 3, 0])
        np.testing.assert_allclose(np.diag(p.W), [1 / 2 + 0.25 / 4, 1 / 2, 1 / 2])
        a = cb.judge(p, [[1, -0.25, 0]], "newton")
        np.testing.assert_allclose(a.v, [3 - 0.125, -0.5, 0.5, 0.125, 0, 0])
        np.testing.assert_allclose(a.velocities, [[-0.5 + 0.0625 + 0.25, 2.875, 0]])
        self.assertEqual((p.nc, p.nv, p.e[0], p.mu[0]), (1, 6, 0.5, 0.25))

    def test_one_number_stands_for_all_contacts(self):
        p = cb.Problem(W=W, q=Q, mu=0.5, e=0.25)
        np.testing.assert_array_equal([p.mu, p.e], [[0.5, 0.5], [0.25, 0.25]])
        p = cb.Problem(M=np.eye(6), J=np.eye(6), v=np.arange(6), mu=0.5, offset=0.125)
        np.testing.assert_allclose(p.q, np.arange(6) + 0.125, rtol=1e-14)

    def test_an_unsymmetric_W_is_taken_for_its_symmetric_part_where_that_is_asked_for(self):
        skew = [[4, 1, 0], [0, 2, 0], [0, 0, 3]]
        with self.assertRaises(cb.Error):
            cb.Problem(W=skew, q=[-1, 0, 0], mu=0.5)
        p = cb.Problem(W=skew, q=[-1, 0, 0], mu=0.5, symmetrise=True)
        np.testing.assert_allclose(p.W, [[4, 0.5, 0], [0.5, 2, 0], [0, 0, 3]], atol=1e-12)
        self.assertEqual(len(p.notes), 1)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "skew.dat")
            with open(path, "w") as file:
                file.write("3 1 0 3 3 3 3\n4 1 0  0 2 0  0 0 3\n-1 0 0\n0.5\n")
            with self.assertRaises(cb.Error):
                cb.Problem.read(path)
            np.testing.assert_allclose(cb.Problem.read(path, symmetrise=True).W, p.W, atol=1e-12)

    def test_problems_answers_and_runs_say_in_a_line_what_they_are(self):
        self.assertEqual(repr(two()), "<contactbench.Problem: 2 contacts, 6 velocities>")
        self.assertEqual(repr(cb.judge(two(), RIGHT, "coulomb")), "<contactbench.Answer: ok>")
        self.assertTrue(repr(cb.judge(two(), [[0, 0, 0]] * 2, "newton")).startswith("<contactbench.Answer: inaccurate: checked"))
        r = cb.run("sticking_box", "ap", duration=0.002)
        self.assertEqual(repr(r), "<contactbench.Run: sticking_box, ap, 3 times, ok>")


class Runs(unittest.TestCase):

    @unittest.skipUnless(PROGRAM, "no program to compare with")
    def test_each_array_is_the_column_of_its_name(self):
        with tempfile.TemporaryDirectory() as folder:
            scene, out = os.path.join(folder, "yard.xml"), os.path.join(folder, "out")
            with open(scene, "w") as file:
                file.write(YARD)
            flags = {"step": 1e-3, "duration": 0.02, "friction": 0.125, "restitution": 0.5, "record_every": 3}
            subprocess.run([PROGRAM, "run", scene, "--method", "ap", "--out", out, "--quiet", "--k", "6", "--stepping", "steps",
                            *(f"--{key.replace('_', '-')}={value}" for key, value in flags.items())], check=True)
            tables = {name: columns_of(os.path.join(out, name + ".csv")) for name in ("trajectory", "steps", "joints")}
            with open(os.path.join(out, "summary.json")) as file:
                theirs = json.load(file)
            r = cb.run(scene, "ap", k=6, stepping="steps", **flags)
        rows = tables["trajectory"]
        self.assertEqual(r.bodies, ["crate", "ball", "slab", "bar", "tip"])
        self.assertEqual(r.position.shape, (7, 5, 3))
        np.testing.assert_array_equal(np.repeat(r.t, 5), rows["t"])
        self.assertEqual(list(rows["body"]), 7 * r.bodies)
        for name, columns in (("position", ("px", "py", "pz")), ("orientation", ("qw", "qx", "qy", "qz")),
                              ("velocity", ("vx", "vy", "vz")), ("angular_velocity", ("wx", "wy", "wz"))):
            np.testing.assert_array_equal(getattr(r, name).reshape(35, -1), np.stack([rows[c] for c in columns], axis=1), name)
        self.assertEqual(r.joints, ["hinge", "slide"])
        self.assertEqual(list(tables["joints"]["joint"]), 7 * r.joints)
        np.testing.assert_array_equal(r.q.ravel(), tables["joints"]["q"])
        steps = tables["steps"]
        self.assertTrue(steps["events"].any() and np.isfinite(steps["residual"]).any() and (steps["potential_energy"] > 0).all())
        names = ("t", "events", "contacts", "iterations", "residual", "law_residual", "event_energy_gain", "max_penetration",
                 "kinetic_energy", "potential_energy")
        self.assertEqual(set(r.steps), {*names, "status", "solve_s", "step_s"})
        for name in names:
            np.testing.assert_array_equal(r.steps[name], steps[name], name)
        self.assertEqual(list(r.steps["status"]), list(steps["status"]))
        self.assertTrue((r.steps["solve_s"] <= r.steps["step_s"]).all() and (r.steps["step_s"] > 0).all())
        for both in (r.summary, theirs):
            for key in ("time", "peak_memory_mb", "machine"):
                del both[key]
        theirs["requested"]["solver"] = r.summary["requested"]["solver"]  # the program's is what was said
        self.assertEqual(r.summary, theirs)
        self.assertEqual((r.summary["options"]["friction"], r.summary["options"]["restitution"]), (0.125, 0.5))

    def test_a_run_ends_as_its_last_step_did(self):
        sunk = YARD.replace('position="0 2 0"', 'position="0 0.2 0"').replace('angular_velocity="4 5 6"', "")
        with tempfile.TemporaryDirectory() as folder:
            scene = os.path.join(folder, "yard.xml")
            with open(scene, "w") as file:
                file.write(sunk)
            r = cb.run(scene, "ap")
        self.assertEqual((r.status, r.finished, bool(r), len(r.t), list(r.steps["status"])),
                         ("penetration", False, False, 1, ["penetration"]))
        self.assertIn("interpenetrate", r.reason)

    def test_answers_that_do_not_hold_are_counted_and_the_first_is_named(self):
        r = cb.run("stack.xml", "coulomb", solver="nsgs", sweeps=3, set={"boxes": 4}, duration=0.02)
        late = r.steps["residual"] > 1e-9
        self.assertEqual((r.status, r.finished, bool(r)), ("inaccurate", True, True))
        self.assertEqual([status == "inaccurate" for status in r.steps["status"]], list(late))
        self.assertTrue(r.reason.startswith(f"{late.sum()} of 20 events beyond what is accepted; the first: checked residual"),
                        r.reason)
        first = np.flatnonzero(late)[0]
        self.assertAlmostEqual(float(r.reason.rsplit("t = ", 1)[1].split()[0]), first * 1e-3, places=12)
        self.assertEqual(r.summary["residuals"]["inaccurate_events"], late.sum())
        self.assertEqual(r.summary["residuals"]["max"], r.steps["residual"].max())

    def test_steps_without_an_event_have_no_residual(self):
        r = cb.run("impacting_sphere.xml", "ap", duration=0.003)
        self.assertTrue((r.steps["events"] == 0).all())
        self.assertTrue(np.isnan(r.steps["residual"]).all() and np.isnan(r.steps["law_residual"]).all())

    def test_a_limit_of_time_ends_a_run_of_ours_and_is_named(self):
        r = cb.run("sticking_box.xml", "ap", duration=1e5, record_every=10**6, time_limit=0.2)
        self.assertEqual((r.status, r.reason, r.finished), ("time_limit", "the time limit of 0.2 s was reached", False))
        self.assertEqual(r.summary["options"]["time_limit_s"], 0.2)
        self.assertGreater(r.summary["steps"], 0)

    def test_what_a_scene_asks_of_its_method_is_in_force_unless_something_else_is_said(self):
        for options, k in (({}, 8), ({"k": 4}, 4)):
            self.assertEqual(cb.run("sticking_box.xml", "ap", duration=0.002, **options).summary["options"]["k"], k)
        self.assertEqual(cb.run("sticking_box.xml", "ap", duration=0.002, k=np.int64(6)).summary["options"]["k"], 6)
        self.assertEqual(cb.run("impacting_sphere.xml", "ap", duration=0.002, restitution=1).summary["options"]["restitution"], 1)
        for epsilon in (1e-9, Written(1e-9)):
            summary = cb.run("sticking_box.xml", "convex", duration=0.002, epsilon=epsilon).summary
            self.assertEqual(summary["options"]["epsilon"], 1e-9)
        for options, bound in (({}, "off"), ({"compression_bound": True}, "on"), ({"compression_bound": np.bool_(True)}, "on")):
            self.assertEqual(cb.run("grasp.xml", "convex", duration=0.002, **options).summary["options"]["compression_bound"],
                             bound)

    def test_options_that_are_none_are_as_if_they_were_left_out(self):
        names = ("law", "set", "step", "friction", "prune", "stepping", "restitution", "record_every", "time_limit", "k", "solver",
                 "variant")
        none, out = (cb.run("sticking_box.xml", "ap", duration=0.002, **options) for options in (dict.fromkeys(names), {}))
        self.assertEqual(none.summary["options"], out.summary["options"])
        np.testing.assert_array_equal(none.position, out.position)

    def test_a_variant_is_the_one_that_is_asked_for(self):
        for method, variant in (("newton", "stick-tested"), ("soft", "mujoco")):
            self.assertEqual(cb.run("sticking_box.xml", method, duration=0.002, variant=variant).summary["used"]["variant"], variant)
            self.assertNotEqual(cb.run("sticking_box.xml", method, duration=0.002).summary["used"]["variant"], variant)

    def test_times_of_a_run_are_the_sums_of_its_steps_and_part_of_all_that_it_took(self):
        start = time.monotonic()
        r = cb.run("sticking_box.xml", "ap", duration=0.05)
        spent, times = time.monotonic() - start, r.summary["time"]
        for name, column in (("total_s", "step_s"), ("solve_s", "solve_s")):
            np.testing.assert_allclose(times[name], r.steps[column].sum(), rtol=1e-6)
        self.assertLessEqual(times["total_s"], times["wall_s"])
        self.assertLessEqual(times["wall_s"], spent)
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # MB, of this process
        self.assertTrue(most / 4 < r.summary["peak_memory_mb"] < 1.1 * most, most)

    def test_problems_of_one_step_come_in_their_order_each_at_its_time(self):
        ball = '<sphere name="{0}" radius="0.5" mass="1" position="{1} {2} 0" velocity="0 -1 0"/>'
        with tempfile.TemporaryDirectory() as folder:
            scene = os.path.join(folder, "balls.xml")
            with open(scene, "w") as file:
                file.write('<scenario title="Two balls hit the ground"><simulation step="0.01" duration="0.01"/>'
                           '<reference kind="missing"/><gravity constant="0 0 0"/><bodies>'
                           '<half_space name="ground" point="0 0 0" normal="0 1 0"/>' + ball.format("late", 0, 0.507) +
                           ball.format("early", 3, 0.502) + '</bodies><contacts>'
                           '<pair a="*" b="ground" mu="0" restitution="1"/></contacts></scenario>')
            times = [p.t for p in cb.problems(scene, "newton")]
        np.testing.assert_allclose(times, [0.002, 0.007], atol=1e-6)

    def test_what_is_not_pruned_is_not_left_out(self):
        on, off = (cb.run("sticking_box.xml", "convex", duration=0.01, prune=prune).summary for prune in (True, False))
        self.assertTrue(on["left_out"])
        self.assertEqual(off["left_out"], [])
        self.assertEqual(sum(on["answered_by"].values()), on["solves"])

    def test_problems_of_a_run_are_those_of_the_scene_at_their_times(self):
        events = list(cb.problems("stack.xml", "ap", set={"boxes": 2}, duration=0.005, step=1e-3, friction=0.375, restitution=0))
        self.assertEqual(len(events), 5)
        np.testing.assert_allclose([p.t for p in events], np.arange(5) * 1e-3, atol=1e-15)
        for p in events:
            self.assertEqual((p.nc, p.nv), (8, 12))
            np.testing.assert_array_equal(p.mu, [0.375] * 8)
            np.testing.assert_array_equal(p.e, [0] * 8)
            np.testing.assert_allclose(p.v[[1, 7]], [-9.8e-3, -9.8e-3], atol=1e-9)
        self.assertIn("t = 0.004 s", repr(events[4]))


class Tables(unittest.TestCase):

    def test_methods_and_laws_are_those_of_the_program(self):
        self.assertEqual(set(cb.methods), {"newton", "mirtich", "ap", "convex", "coulomb", "soft"})
        self.assertEqual(set(cb.laws), {"newton", "mirtich", "anitescu_potra", "convex", "coulomb", "soft"})
        self.assertTrue(cb.version_line.startswith(f"contactbench {cb.__version__} (git "))
        if PROGRAM:
            out = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout
            self.assertIn(f"contactbench {cb.__version__} ", out)


if __name__ == "__main__":
    unittest.main()
