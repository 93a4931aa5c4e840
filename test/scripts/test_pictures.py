"""A first picture of a scene (picture.py), how a script begins (start.py), and the still picture of a motion (still.py), without
the program."""
import io
import os
import re
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import matplotlib.pyplot as plt
import numpy as np
from contactbench import picture, program, start, still
from made import csv_of, trajectory


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(plt.close, "all")
        self.top = Path(folder.name)


class Picture(Folder):
    def test_the_displacement_is_that_of_the_body_that_is_farthest_from_where_it_began(self):
        places = {"a": [(1, 1, 1), (1, 1, 3), (1, 1, 2)], "b": [(5, 0, 0), (5, 1, 0), (8, 4, 12)]}
        (self.top / "trajectory.csv").write_text(
            trajectory([(0.5 * n, body, of[n]) for n in range(3) for body, of in places.items()]))
        self.assertEqual(picture.displacement(self.top), ([0, 0.5, 1], [0, 2, 13]))

    def test_a_run_has_the_flags_that_were_asked_and_its_end_is_judged(self):
        options = SimpleNamespace(program="prog", scene="my.xml", limit=2.5, set=["mu=1", "n=2"], duration=0.25)
        (self.top / "summary.json").write_text('{"status": "ray"}')
        for code, duration in ((0, 0.25), (3, None)):
            options.duration = duration
            with mock.patch.object(program, "call", return_value=SimpleNamespace(returncode=code)) as call, mock.patch(
                    "sys.stdout", io.StringIO()) as said:
                self.assertEqual(picture.run(options, "ap", self.top), {"status": "ray"})
            words = [
                "prog", "run", "my.xml", "--method", "ap", "--time-limit", "2.5", "--set", "mu=1", "--set", "n=2",
                *(["--duration", "0.25"] if duration else []), "--out",
                str(self.top), "--quiet"]
            self.assertEqual((list(call.call_args.args), said.getvalue().strip()), (words, " ".join(words)))
        for ended, why in (({"return_value": SimpleNamespace(returncode=2, stderr=" no such scene\n")}, "^no such scene$"), ({
                "side_effect": OSError(2, "No such file")}, "prog: No such file; scripts/build.sh builds it")):
            with mock.patch.object(program, "call", **ended), mock.patch("sys.stdout"), self.assertRaisesRegex(
                    program.ProgramError, why):
                picture.run(options, "ap", self.top)

    def test_displacement_energy_and_time_are_drawn_below_each_other_for_each_method(self):
        def run(_, method, out):
            out.mkdir()
            n = {"ap": 1, "convex": 2, "other": 3}[method]
            (out / "trajectory.csv").write_text(trajectory([(t, "b", (0, n * t, 0)) for t in (0, 1, 2)]))
            (out / "steps.csv").write_text(
                csv_of("t,residual,kinetic_energy,dynamics_s,check_s,collision_s,assembly_s,solve_s",
                       [(t, 9, 100 * n + t, n, 1000, 2, 4, 8 * t) for t in (1, 2)]))
            return {"scenario": "my", "title": "A title", "status": "ray" if method == "convex" else "ok"}

        options = SimpleNamespace(scene="my.xml", method=["ap", "convex", "other"], out=self.top / "out.svg")
        with mock.patch.object(picture, "run", run):
            picture.draw(options, self.top)
        figure = plt.gcf()
        for panel, label, curves in zip(
                figure.axes, ("farthest from its start, m", "kinetic energy, J", "processing time so far, s"),
            ([[[0, 0], [1, n], [2, 2 * n]] for n in (1, 2, 3)], [[[1, 100 * n + 1], [2, 100 * n + 2]]
                                                                 for n in (1, 2, 3)], [[[1, 14 + n], [2, 36 + 2 * n]]
                                                                                       for n in (1, 2, 3)]), strict=True):
            self.assertEqual(panel.get_ylabel(), label)
            self.assertEqual([line.get_xydata().tolist() for line in panel.lines], curves)
            self.assertEqual([line.get_label() for line in panel.lines], ["A-P, Lemke", "convex (ray)", "other"])
            self.assertEqual([line.get_color() for line in panel.lines[:2]], ["#0072B2", "#000000"])
        self.assertEqual((figure.axes[0].get_title(loc="left"), figure.axes[2].get_xlabel()),
                         ("my: A title", "simulated time, s"))
        self.assertEqual([text.get_text() for text in figure.legends[0].get_texts()], ["A-P, Lemke", "convex (ray)", "other"])
        self.assertIn("<svg", (self.top / "out.svg").read_text())

    def test_what_is_not_asked_is_four_methods_and_ten_seconds_each(self):
        words = "my --duration 3 --set a=1 --set b=2 --method ap --method x --limit 7 --program p --out o.pdf".split()
        for given, wanted in ((["my.xml"], ("my.xml", [
                "newton", "mirtich", "ap", "convex"], [], None, 10, program.DEFAULT, Path("picture.png"))), (words, ("my.xml", [
                    "ap", "x"], ["a=1", "b=2"], 3, 7, "p", Path("o.pdf")))):
            with mock.patch("sys.argv", ["picture.py", *given]), mock.patch("sys.stdout",
                                                                            io.StringIO()) as said, mock.patch.object(
                                                                                picture, "draw") as draw:
                picture.main()
            options = draw.call_args.args[0]
            self.assertEqual(
                (options.scene, options.method, options.set, options.duration, options.limit, options.program, options.out),
                wanted)
            self.assertEqual(said.getvalue().strip(), str(wanted[-1]))


class Start(unittest.TestCase):
    def need(self, modules, asked, there):
        """What need() does: starts the script again, ends, or goes on."""
        said, words = io.StringIO(), ["scripts/sweep.py", "--flag"]
        with mock.patch.dict(os.environ, {start.ASKED: asked} if asked else {}), mock.patch("sys.stderr", said), \
                mock.patch.object(start, "CANDIDATES", ("", "/one", "/two")), \
                mock.patch("os.access", lambda path, _: path in there), \
                mock.patch("os.execv", side_effect=SystemExit) as started, \
                mock.patch("sys.orig_argv", ["python3", "-B", *words]), mock.patch("sys.argv", words):
            try:
                start.need(modules)
                return "goes on", os.environ.get(start.ASKED)
            except SystemExit as ended:
                return (started.call_args.args, os.environ[start.ASKED]) if started.called else (ended.code, said.getvalue())

    def test_the_next_python_is_asked_where_modules_lack_and_none_twice(self):
        lacking = ("json", "no_such_module", "nor_this")
        again = ["-B", "scripts/sweep.py", "--flag"]
        self.assertEqual(self.need(("json", "math"), "2", ("/one", "/two")), ("goes on", None))
        self.assertEqual(self.need(lacking, "", ("/one", "/two")), (("/one", ["/one", *again]), "2"))
        self.assertEqual(self.need(lacking, "", ("/two", )), (("/two", ["/two", *again]), "3"))
        self.assertEqual(self.need(lacking, "2", ("/one", "/two")), (("/two", ["/two", *again]), "3"))
        code, said = self.need(lacking, "3", ("/one", "/two"))
        self.assertEqual(code, 1)
        self.assertIn(
            "sweep.py: no python3 here has no_such_module, nor_this: scripts/setup.sh --tests installs Debian's "
            "(python3-no_such_module, "
            "python3-nor_this); PYTHON=/path/to/python3", said)

    def test_a_command_ends_with_the_code_of_its_module_and_says_what_went_wrong(self):
        for main, code, words in ((mock.Mock(return_value=3), 3, ""), (mock.Mock(return_value=None), None, ""),
                                  (mock.Mock(side_effect=program.ProgramError("no such run")), "view: no such run",
                                   ""), (mock.Mock(side_effect=KeyboardInterrupt), 130, "view: interrupted")):
            with mock.patch("contactbench.view.main",
                            main), mock.patch("sys.stderr", io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
                start.command("view")
            self.assertEqual((ended.exception.code, said.getvalue().strip()), (code, words))


def motion(*shapes, bodies=(), poses=(), summary=()):
    """`poses`: of each moment, of each body, x y z and a quaternion that ends with w."""
    keys = ("kind", "body", "px", "py", "pz", "radius", "hx", "hy", "hz")
    rows = [dict(zip(keys, shape)) | {"qx": 0, "qy": 0, "qz": 0, "qw": 1} for shape in shapes]
    poses = np.array(poses, float).reshape(max(len(poses), 1), len(bodies), 7)
    return SimpleNamespace(bodies=list(bodies), poses=poses, t=range(len(poses)), surfaces=lambda: rows, summary=dict(summary))


class Still(unittest.TestCase):
    def numbers(self, text, *names):
        return [
            tuple(float(re.search(rf'\b{name}="([^"]*)"', part).group(1)) for name in names)
            for part in re.findall("<circle[^>]*>", text)]

    def test_it_is_seen_from_the_front_the_right_and_above(self):
        np.testing.assert_allclose(np.cross(still.RIGHT, still.UP), still.BEHIND, atol=1e-12)
        self.assertAlmostEqual(np.linalg.norm(still.RIGHT), 1)
        self.assertGreater(min(still.UP[1], still.RIGHT[0], still.BEHIND.min()), 0)
        self.assertEqual(still.RIGHT[1], 0)

    def test_balls_are_drawn_pale_where_they_begin_and_where_they_end_by_the_same_scale(self):
        # It goes up by 3 and has radius 0.5: the picture is 4 radii of it and the way high, in 280, with 10 around.
        ball = ("sphere", "b", 0, 0, 0, 0.5, 0, 0, 0)
        made = motion(ball, bodies=["b"], poses=[[[7, 8, 9, 0, 0, 0, 1]], [[99, 99, 99, 0, 0, 0, 1]], [[7, 11, 9, 0, 0, 0, 1]]],
                      summary={"scenario": "balls"})
        text, way = still.svg(made), 3 * still.UP[1]
        scale = 280 / (way + 1)
        np.testing.assert_allclose(self.numbers(
            text, "cx", "cy",
            "r"), [[10 + 0.5 * scale, 10 + (0.5 + way) * scale, 0.5 * scale], [10 + 0.5 * scale, 10 + 0.5 * scale, 0.5 * scale]],
                                   atol=0.06)
        self.assertEqual([' opacity=".25"' in part for part in re.findall("<circle[^>]*>", text)], [True, False])
        self.assertIn(f'viewBox="0 0 {scale + 20:.0f} 300"', text)
        self.assertIn('aria-label="balls"', text)
        self.assertEqual(still.svg(motion(("half_space", "", 0, 0, 0, 0, 0, 0, 0))), "")

    def test_what_is_near_covers_what_is_far_and_bodies_have_their_own_tones(self):
        balls = [("sphere", name, 0, 0, 0, radius, 0, 0, 0) for name, radius in (("a", 1), ("b", 2), ("", 3))]
        far, near = [-5 * still.BEHIND[k] for k in range(3)], [5 * still.BEHIND[k] for k in range(3)]
        turn = [0, 0, 0, 1]
        for a, b, order in ((far, near, (1, 3, 2)), (near, far, (2, 3, 1))):
            text = still.svg(motion(*balls, bodies=["a", "b"], poses=[[[*a, *turn], [*b, *turn]]]))
            radii = np.array([r for r, in self.numbers(text, "r")])
            np.testing.assert_allclose(radii / radii.max() * 3, 2 * order, atol=0.01)
        self.assertEqual([still.tone(n, 1.0) for n in (-1, 0, 1, len(still.TONES))],
                         ["#9a9a96", still.TONES[0], still.TONES[1], still.TONES[0]])
        self.assertEqual(still.tone(0, 0.5),
                         "#" + "".join(f"{round(int(still.TONES[0][k:k + 2], 16) / 2):02x}" for k in (1, 3, 5)))

    def test_faces_of_every_shape_are_as_large_as_it_is(self):
        for kind, sizes, half, count in (("box", (0, 1, 2, 3), (1, 2, 3), 6), ("cylinder", (0.5, 0, 2, 0), (0.5, 2, 0.5), 22),
                                         ("capsule", (0.5, 0, 2, 0), (0.5, 2 + 0.5 * np.sin(np.pi / 3), 0.5), 2 * 41 + 20)):
            faces = still.faces_of({"kind": kind, **dict(zip(("radius", "hx", "hy", "hz"), sizes))})
            points = np.vstack(faces)
            np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [np.negative(half), half], atol=1e-12)
            self.assertEqual(len(faces), count)
            for face in faces[:6] if kind == "box" else ():
                self.assertEqual(len({tuple(p) for p in face}), 4)
                self.assertEqual(sorted(np.ptp(face, axis=0) > 0), [False, True, True])

    def test_faces_to_the_light_are_bright_and_those_behind_are_not_drawn(self):
        box = motion(("box", "b", 0, 0, 0, 0, 1, 1, 1), bodies=["b"], poses=[[[0, 0, 0, 0, 0, 0, 1]]])
        found = {}
        for depth, flat, radius, bright, number in still.faces_at(box, 0):
            self.assertEqual((len(flat), radius, number), (4, 0, 0))
            found[round(depth, 9)] = bright
        # The three sides towards the eye, as far out as their normals point to it.
        wanted = {round(float(still.BEHIND[k]), 9): 0.62 + 0.38 * still.LIGHT[k] for k in range(3)}
        self.assertEqual({key: round(value, 9) for key, value in found.items()},
                         {key: round(float(value), 9) for key, value in wanted.items()})
        self.assertGreater(still.LIGHT[1], max(still.LIGHT[0], still.LIGHT[2]))  # from above


if __name__ == "__main__":
    unittest.main()
