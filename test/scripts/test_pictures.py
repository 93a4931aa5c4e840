"""A first picture of a scene (picture.py) and how a script begins (start.py), without the program."""
import contextlib
import io
import os
import sys
import unittest
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import matplotlib.pyplot as plt
from contactbench import picture, program, references, replay, solve_all, start, stress
from folder import Folder
from made import csv_of, trajectory


class Picture(Folder):
    def setUp(self):
        super().setUp()
        self.addCleanup(plt.close, "all")

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

    def test_times_that_are_not_positive_are_refused_by_every_command(self):
        for module, words in ((picture, ["box"]), (references, []), (replay, []), (solve_all, []), (stress, [])):
            for value in ("0", "-1", "inf", "nan", "long"):
                flag = "--time-limit" if module is stress else "--limit"
                with mock.patch.object(sys, "argv", ["x", *words, flag, value]), \
                        contextlib.redirect_stderr(io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
                    module.main()
                self.assertEqual(ended.exception.code, 2, (module, value))
                self.assertIn(f"argument {flag}: ", said.getvalue())

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


if __name__ == "__main__":
    unittest.main()
