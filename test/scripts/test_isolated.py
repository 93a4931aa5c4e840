"""scripts/contactbench/isolated.py: engines' own contact problems solved again by our methods, and Siconos' solvers beside ours.
On made-up answers, each field another number."""
import contextlib
import csv
import io
import json
import math
import tempfile
import types
import unittest
from pathlib import Path
from unittest import mock

import matplotlib.pyplot as plt
import numpy as np
from contactbench import isolated, looks, program
from folder import Folder

LISTED = {
    "methods": [{"name": "mirtich", "solvers": [], "variants": [], "options": []},
                {"name": "ap", "solvers": ["lemke", "path-lib"], "variants": [], "options": [{"flag": "k"}]},
                {"name": "convex", "solvers": ["ipm"], "variants": [], "options": [{"flag": "compression-bound"}]}],
    "solvers": [{"method": "ap", "name": "path-lib", "unavailable": "why"}],
    "engines": [{"name": "mujoco", "unavailable": None}, {"name": "dart", "unavailable": None},
                {"name": "siconos", "unavailable": "why"}]}

ABOUT = {
    "engine": "mujoco", "variant": "newton-elliptic", "t": 1.999, "contacts": 4, "law_residual": 0.1,
    "law_residual_without_offset": 0.2, "own_residual": 3e-9, "momentum_error": 4e-16, "velocity_error": 5e-15,
    "largest_compliance_per_kg": 6e-7, "something": "else"}


class Problems(Folder):
    def own(self, *of, engine="mujoco", variant="newton-elliptic", steps=(3, 11, 7)):
        """What own_problem returns, and the words of the run."""
        said = []

        def call(*words, timeout=None):
            said.extend(map(str, words))
            (self.top / "problems").mkdir(exist_ok=True)
            for n in steps:
                (self.top / f"problems/step_{n:06}.hdf5").write_text(f"problem {n}")
                (self.top / f"problems/step_{n:06}.json").write_text(json.dumps({"n": n}))
            return types.SimpleNamespace(stderr="first\nlast\n")

        with mock.patch.object(program, "call", call), contextlib.redirect_stderr(io.StringIO()) as errors:
            found = isolated.own_problem("prog", *of, engine, variant, self.top)
        return found, said, errors.getvalue()

    def test_the_last_problem_of_a_run_up_to_a_time_is_kept(self):
        (file, about), words, _ = self.own("stack", ["boxes=4", "mu=0.5"], 0.25)
        self.assertEqual((file.read_text(), about), ("problem 11", {"n": 11}))
        self.assertEqual(words, [
            "prog", "run", "stack", "--engine", "mujoco", "--variant", "newton-elliptic", "--step", "0.001", "--duration", "0.25",
            "--quiet", "--knob", "tolerance=1e-15", "--save-problems",
            str(self.top / "problems"), "--record-every", "0", "--out",
            str(self.top / "run"), "--set", "boxes=4", "--set", "mu=0.5"])

    def test_another_engine_has_no_such_knob_and_a_file_of_the_project_its_place(self):
        _, words, _ = self.own("engines/pile.xml", [], 1.0, engine="dart", variant="dantzig")
        self.assertEqual(words[2], str(program.ROOT / "scenarios/engines/pile.xml"))
        self.assertNotIn("--knob", words)

    def test_a_run_without_contacts_is_said_and_has_no_problem(self):
        found, _, said = self.own("stack", [], 0.25, steps=())
        self.assertIsNone(found)
        self.assertEqual(said, "isolated: mujoco/newton-elliptic on stack: first\nlast\n")

    def test_an_engine_s_row_is_followed_by_one_of_each_of_our_methods_on_its_problem(self):
        asked = []

        def ask(path, flags, limit):
            asked.append((path, flags, limit))
            n = len(asked)
            return {"status": "unavailable"} if "path-lib" in flags else {
                "status": f"s{n}", "law_residual": n / 10, "time_min_s": n / 1e6, "velocity_error": 9, "contacts": 99}

        with mock.patch.object(isolated.solve_all, "ask", ask):
            rows = isolated.rows_of("prog", LISTED, "stack_boxes4", (Path("/p/step_9.hdf5"), ABOUT), Path("/q/kept.hdf5"))
        usual = {
            "scene": "stack_boxes4", "engine": "mujoco", "variant": "newton-elliptic", "t": 1.999, "contacts": 4,
            "file": "kept.hdf5"}
        theirs = {c: v
                  for c, v in ABOUT.items() if c != "something"} | usual | {"by": "mujoco", "status": None, "time_min_s": None}
        self.assertEqual(rows[0], theirs)
        blank = dict.fromkeys(isolated.COLUMNS)
        self.assertEqual(rows[1:], [
            blank | usual | {"by": by, "status": f"s{n}", "law_residual": n / 10, "time_min_s": n / 1e6}
            for n, by in ((1, "mirtich"), (2, "ap lemke"), (4, "convex ipm"))])
        self.assertEqual(asked[1], ("prog", [
            "/p/step_9.hdf5", "--kind", "contact", "--repeat", "5", "--method", "ap", "--solver", "lemke", "--k", "8"], 60))
        # Of the convex method the program without the bound alone, and as far as it goes.
        self.assertEqual(asked[3][1][5:],
                         ["--method", "convex", "--solver", "ipm", "--compression-bound", "off", "--epsilon-relative", "1e-12"])
        self.assertEqual(len(asked), 4)

    def test_of_each_scene_and_engine_that_is_here_a_problem_is_kept_beside_the_table(self):
        (self.top / "step_1.hdf5").write_text("problem")
        (self.top / "step_1.json").write_text("{}")
        wanted = []

        def own_problem(path, scene, parameters, t, engine, variant, folder):
            wanted.append((scene, parameters, t, engine, variant))
            return None if variant == "newton-pyramidal" else (self.top / "step_1.hdf5",
                                                               ABOUT | {"engine": engine, "variant": variant})

        with mock.patch.object(program, "listed", lambda _: LISTED), mock.patch.object(isolated, "own_problem", own_problem), \
                mock.patch.object(isolated.solve_all, "ask", lambda *_: {"status": "unavailable"}), \
                contextlib.redirect_stdout(io.StringIO()) as said:
            isolated.main(["problems", "--program", "prog", "--out", str(self.top / "out")])
        self.assertEqual(
            {
                w[:3] == ("sliding_box", [], 2.0) or w[:3] == ("stack", ["boxes=4"], 0.5)
                or w[:3] == ("engines/pile.xml", [], 1.0) for w in wanted}, {True})
        # They run side by side, and so in any order.
        self.assertCountEqual([w for w in wanted if w[0] == "stack"],
                              [("stack", ["boxes=4"], 0.5, *engine) for engine in isolated.ENGINES[:4]])
        with open(self.top / "out/own_problems.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        names = [
            f"{scene}__{engine}" for scene in ("sliding_box", "stack_boxes4", "pile")
            for engine in ("mujoco__newton-elliptic", "mujoco__newton-elliptic-stiff", "dart__dantzig")]
        self.assertEqual([row["file"] for row in rows], [f"{name}.hdf5" for name in names])
        self.assertEqual([row["scene"] for row in rows[2:5]], ["sliding_box", "stack_boxes4", "stack_boxes4"])
        self.assertEqual({path.name for path in (self.top / "out/own_problems").iterdir()},
                         {f"{n}.{end}" for n in names for end in ("hdf5", "json")})
        self.assertIn("## pile__dart__dantzig.hdf5: 4 contacts, t = 1.999 s", (self.top / "out/own_problems.md").read_text())
        self.assertTrue(said.getvalue().startswith("9 rows: "))
        # Scenes that are named are those alone.
        wanted.clear()
        with mock.patch.object(program, "listed", lambda _: LISTED), mock.patch.object(isolated, "own_problem", own_problem), \
                mock.patch.object(isolated.solve_all, "ask", lambda *_: {"status": "unavailable"}), \
                contextlib.redirect_stdout(io.StringIO()):
            isolated.main(["problems", "box", "stack", "--program", "prog", "--out", str(self.top / "out")])
        self.assertEqual({w[0] for w in wanted}, {"sliding_box", "stack"})

    def test_each_problem_has_a_table_of_its_own(self):
        def row(file, by, **more):
            return dict.fromkeys(isolated.COLUMNS) | {"file": file, "by": by, "contacts": 3, "t": 0.5} | more

        page = isolated.own_markdown([
            row("a.hdf5", "ode", largest_compliance_per_kg=2e-7),
            row("a.hdf5", "mirtich", status="ray"),
            row("b.hdf5", "dart", contacts=5, law_residual=math.nan)]).split("\n")
        heads = [n for n, line in enumerate(page) if line.startswith("## ")]
        self.assertEqual([page[n] for n in heads], [
            "## a.hdf5: 3 contacts, t = 0.5 s, largest compliance 2.0e-07 1/kg",
            "## b.hdf5: 5 contacts, t = 0.5 s, largest compliance - 1/kg"])
        self.assertEqual(page[heads[0] + 4:heads[1] - 1],
                         ["| ode | - | - | - | - | - | - |  |", "| mirtich | - | - | - | - | - | - | ray |"])


# Five problems; ours solve four of them, theirs three, and e nobody.
TIMES = {
    "newton": {"a": 2e-6, "b": 8e-6, "c": 6e-6, "d": None, "e": None}, "nsgs": {
        "a": 4e-6, "b": 2e-6, "c": None, "d": 9e-6, "e": None}, "siconos nsgs": {
            "a": 8e-6, "b": 4e-6, "c": 3e-6, "d": None, "e": None}, "siconos ac": {
                "a": 1e-6, "b": 5e-6, "c": None, "d": None, "e": None}, "siconos none": dict.fromkeys("abcde")}
ENDS = {"siconos none": dict(zip("abcde", ("false claim", "time limit", "killed by 9", "left the program", "wrong")))}


def solves():
    return [{
        "problem": p, "solver": s, "contacts": str(3 * n), "solved": "1" if time else "0", "time_min_s": repr(time or 1e-9),
        "verdict": "right" if time else ENDS.get(s, {}).get(p, "not solved")} for n, p in enumerate("abcde", 1)
            for s, of in TIMES.items() for time in [of[p]]]


class Solvers(unittest.TestCase):
    def test_the_best_of_either_side_is_the_quickest_that_the_referee_accepts(self):
        self.assertEqual(isolated.best(solves(), False),
                         {"a": (2e-6, "newton"), "b": (2e-6, "nsgs"), "c": (6e-6, "newton"), "d": (9e-6, "nsgs")})
        self.assertEqual(isolated.best(solves(), True),
                         {"a": (1e-6, "siconos ac"), "b": (4e-6, "siconos nsgs"), "c": (3e-6, "siconos nsgs")})

    def test_a_profile_is_of_times_over_the_least_of_all(self):
        inf = math.inf
        self.assertEqual({s: [round(r, 9) for r in ratios] for s, ratios in isolated.profiles(solves()).items()}, {
            "newton": [2, 2, 4, inf, inf], "nsgs": [1, 1, 4, inf, inf], "siconos nsgs": [1, 2, 8, inf, inf], "siconos ac": [
                1, 2.5, inf, inf, inf], "siconos none": [inf] * 5})

    def test_the_page_sets_side_beside_side_and_counts_what_each_solver_comes_to(self):
        page = isolated.solvers_markdown(solves()).split("\n")
        at = next(n for n, line in enumerate(page) if line.startswith("| problem "))
        self.assertEqual(page[at + 2:at + 7], [
            "| a | 3 | newton | 2.0 | ac | 1.0 | 2.00 |", "| b | 6 | nsgs | 2.0 | nsgs | 4.0 | 0.50 |",
            "| c | 9 | newton | 6.0 | nsgs | 3.0 | 2.00 |", "| d | 12 | nsgs | 9.0 | none | - | - |",
            "| e | 15 | none | - | none | - | - |"])
        self.assertIn("Ours at least as fast on 1 of the 3 problems that both solve; solved by ours: 4, by Siconos': 3, of 5.",
                      page)
        at = next(n for n, line in enumerate(page) if line.startswith("| solver "))
        self.assertEqual(page[at], "| solver | solved | fastest of all | within 2 times | false claims | no end |")
        self.assertEqual(page[at + 2:at + 7], [
            "| newton | 3 | 0 | 2 | 0 | 0 |", "| nsgs | 3 | 2 | 2 | 0 | 0 |", "| siconos nsgs | 3 | 1 | 2 | 0 | 0 |",
            "| siconos ac | 2 | 1 | 1 | 0 | 0 |", "| siconos none | 0 | 0 | 0 | 1 | 3 |"])

    def test_the_picture_steps_up_by_a_share_of_all_problems_at_each_ratio(self):
        drawn = []
        with mock.patch.object(looks, "save", lambda figure, folder, name: drawn.append((figure, folder, name))):
            isolated.draw(solves(), Path("there"))
        (figure, folder, name), = drawn
        self.addCleanup(plt.close, figure)
        self.assertEqual((folder, name), (Path("there"), "siconos_solvers"))
        panel, = figure.axes
        # To the right of all: half as far again as the largest ratio, 8.
        self.assertEqual((panel.get_xscale(), panel.get_yscale(), panel.get_xlim(), panel.get_ylim()),
                         ("log", "linear", (0.95, 12), (-0.02, 1.03)))
        self.assertEqual((panel.get_xlabel(), panel.get_ylabel()), ("time over that of the fastest", "share of problems"))
        lines = {line.get_label(): line for line in panel.lines}
        self.assertEqual(list(lines), ["newton", "nsgs", "siconos nsgs", "siconos ac"])
        for label, x, y in (("newton", [1, 2, 2, 4, 12], [0, 0.2, 0.4, 0.6, 0.6]), ("nsgs", [1, 1, 1, 4, 12], [
                0, 0.2, 0.4, 0.6, 0.6]), ("siconos ac", [1, 1, 2.5, 12], [0, 0.2, 0.4, 0.4])):
            np.testing.assert_allclose(lines[label].get_xdata(), x, rtol=1e-12)
            np.testing.assert_allclose(lines[label].get_ydata(), y, rtol=1e-12)
            self.assertEqual(lines[label].get_drawstyle(), "steps-post")
        self.assertEqual({lines[label].get_linestyle() for label in ("newton", "nsgs")}, {"-"})
        self.assertEqual(len({line.get_color() for line in lines.values()}), 4)
        self.assertEqual([text.get_text() for text in panel.get_legend().get_texts()], list(lines))

    def test_a_table_is_measured_or_one_that_was_measured_before_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            top, calls = Path(folder), []

            def call(*words):
                calls.append([str(w) for w in words])
                with open(words[2], "w", newline="") as file:
                    table = csv.DictWriter(file, list(solves()[0]))
                    table.writeheader()
                    table.writerows(solves())

            with mock.patch.object(program, "call", call), mock.patch.object(isolated, "draw") as draw, \
                    contextlib.redirect_stdout(io.StringIO()) as said:
                isolated.main([
                    "solvers", "wall", "box", "--bench", "bench", "--out",
                    str(top / "out"), "--limit", "7", "--rounds", "2"])
                self.assertEqual(
                    calls,
                    [["bench", "--csv",
                      str(top / "out/siconos_solvers.csv"), "--limit", "7.0", "--rounds", "2", "wall", "box"]])
                isolated.main(["solvers", "--csv", str(top / "out/siconos_solvers.csv"), "--out", str(top / "again")])
                self.assertEqual(len(calls), 1)
            self.assertEqual(said.getvalue().count("25 solves: "), 2)
            self.assertEqual([of.args[1] for of in draw.call_args_list], [top / "out", top / "again"])
            pages = [(top / where / "siconos_solvers.md").read_text() for where in ("out", "again")]
            self.assertEqual(pages, [isolated.solvers_markdown(solves())] * 2)
            # What measures nothing leaves no table of another time in place of its own.
            why = mock.Mock(stderr="", stdout="a banner\nThe stored problems need HDF5: not built\n")
            with mock.patch.object(program, "call", lambda *_: why):
                with self.assertRaisesRegex(program.ProgramError, "bench: The stored problems need HDF5: not built"):
                    isolated.main(["solvers", "--bench", "bench", "--out", str(top / "out")])
            self.assertFalse((top / "out/siconos_solvers.csv").exists())
            with self.assertRaisesRegex(program.ProgramError, "/nowhere/bench: No such file"):
                isolated.main(["solvers", "--bench", "/nowhere/bench", "--out", str(top / "out")])
            (top / "empty.csv").write_text("problem,solver\n")
            with self.assertRaisesRegex(program.ProgramError, "empty.csv: holds no rows"):
                isolated.main(["solvers", "--csv", str(top / "empty.csv"), "--out", str(top)])


if __name__ == "__main__":
    unittest.main()
