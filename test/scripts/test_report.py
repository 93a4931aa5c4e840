"""Tables, claims, figures and the report, on the runs of a stand-in for the program whose answers are known."""
import csv
import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import browser
import pandas as pd
import standin
import matplotlib.pyplot as plt
import numpy as np
from contactbench import claims, figures, precision, robots, sections, solve_all, stepping
from contactbench import found as found_out
from contactbench.runs import Cell, Runs

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "scripts"
SWEEPS = [ROOT / "scenarios/sweeps" / f"{name}.toml" for name in ("paper", "robots", "claims", "error_time", "orders", "polygons")]


def script(*words, fakes=None):
    ended = subprocess.run([sys.executable, "-B", *map(str, words)], capture_output=True, text=True, timeout=600,
                           env=standin.environment(FAKE=json.dumps(fakes or {})))
    if ended.returncode != 0:
        raise AssertionError(ended.stdout + ended.stderr)
    return ended.stdout + ended.stderr


def setUpModule():
    """The runs of all sweep files, their table and the report, once for all tests; the sticking box crashes."""
    global MADE, SAID
    MADE = Path(tempfile.mkdtemp())
    unittest.addModuleCleanup(shutil.rmtree, MADE, ignore_errors=True)
    program = standin.write(MADE / "program")
    script(SCRIPTS / "sweep.py", *SWEEPS, "--profile", "quick", "--program", program, "--runs", MADE / "runs", "--out", MADE,
           "--jobs", "0", fakes={"sticking_box": "crash"})
    SAID = script(SCRIPTS / "report.py", "--results", MADE, "--runs", MADE / "runs")


class FakeCell(dict):
    """A cell of known numbers."""

    def __init__(self, error=math.nan, seconds=1.0, finished=True, errors=None, **columns):
        super().__init__({"scene": "s", "parameters": "", "method": "ap", "solver": "lemke", "variant": "", "k": "8", "epsilon": "",
                          "knobs": "", "step": "0.01", "status": "ok", "run": "r", "duration": "1.0", "steps": "100",
                          "false_claims": "0"} | columns)
        self.errors, self.seconds, self.finished = {"position_linf_m": error, **(errors or {})}, seconds, finished
        self.members, self.times, self.busy, self.name = [], [seconds], False, columns.get("name", "A-P Lemke")
        self.key, self.label = (self["method"], self["solver"]), self.name
        self.how_it_ended, self.cut = "" if finished else "ray at 0.1 s", ""

    def error(self, name):
        return self.errors.get(name, math.nan)


class FakeResults:
    def __init__(self, cells):
        self.all = cells

    def cells(self, *_, **__):
        return self.all

    def missing(self, _):
        return "not here"


class Exact(unittest.TestCase):
    def test_the_sliding_box_stops_where_the_closed_form_says(self):
        # 1 N on 1 kg against mu g = 0.98 from 1 s to 5 s, then friction alone.
        push, friction, seconds = 1.0, 0.1 * 9.8, 4.0
        speed = (push - friction) * seconds
        self.assertAlmostEqual(claims.EXACT_X, speed * seconds / 2 + speed**2 / (2 * friction), 14)


class Bounds(unittest.TestCase):
    def test_what_drives_and_what_holds_is_judged_by_the_claim_and_by_what_was_found_alike(self):
        path = {"cross_track_rms_m": 0.2, "no_slip_cross_track_rms_m": 0.1}
        self.assertTrue(claims.drives(FakeCell(errors=path)))
        self.assertFalse(claims.drives(FakeCell(errors=path | {"cross_track_rms_m": 0.21})))
        self.assertFalse(claims.drives(FakeCell(errors=path, finished=False)))
        self.assertTrue(claims.holds(FakeCell(errors={"creep_linf_m": 5e-3})))
        for errors in ({"creep_linf_m": 6e-3}, {"creep_linf_m": 1e-3, "dropped_s": 0.5}):
            self.assertFalse(claims.holds(FakeCell(errors=errors)))
        self.assertEqual((found_out.drives, found_out.holds), (claims.drives, claims.holds))

    def test_a_rise_of_energy_counts_from_a_billionth_on(self):
        for rise, newtons, others in ((2e-9, claims.YES, claims.NO), (5e-10, claims.NO, claims.YES)):
            cells = [FakeCell(method=method, variant=variant, name=method, errors={"energy_rise_relative": rise})
                     for method, variant in [("newton", v) for v in claims.VARIANTS] + [("ap", "")]]
            parts = claims.asked("C1", FakeResults(cells)).parts
            self.assertEqual([p.verdict for p in parts], [newtons] * len(claims.VARIANTS) + [others])

    def test_the_circle_of_mirtich_s_model_is_that_of_the_last_turn(self):
        t = np.linspace(0, 4 * math.pi, 401)
        for settles, verdict in ((True, claims.YES), (False, claims.NO)):
            turning = t - t[-1] + 2 * math.pi if settles else 2 * math.pi - t  # from the middle on, or up to there
            radius = np.where(turning > -1e-9, 0.4, 0.4 + 0.3 * np.abs(turning))
            cell = FakeCell(method="mirtich", solver="", errors={"position_linf_m": 1})
            cell.series = lambda *_, r=radius: np.array([t, r * np.cos(t), r * np.sin(t)])
            parts = claims.asked("C4", FakeResults([cell])).parts
            self.assertEqual([part.verdict for part in parts if part.numbers and "radius, m" in part.numbers], [verdict])

    def test_files_are_read_from_the_repeat_of_median_time_of_two_the_quicker(self):
        def cell(*times):
            return Cell([{"method": "ap", "solver": "lemke", "variant": "", "run": f"r{time}", "processing_s": time} for time in times], "")

        self.assertEqual(cell("3", "1", "2")["run"], "r2")
        self.assertEqual(cell("4", "1", "3", "2")["run"], "r2")
        self.assertEqual(cell("2", "")["run"], "r2")

    def test_the_close_look_at_the_impact_is_about_the_step_in_which_energy_falls(self):
        cell = FakeCell()
        cell.series = lambda *_: np.array([[0, 0.1, 0.2, 0.3, 0.4], [5, 5, 5, 1, 1]])
        table = unittest.mock.MagicMock()
        table.__iter__.return_value = iter([(0, cell, {})])
        figure, axes = plt.subplots(1, 2)
        figures.figure01(table, axes)
        self.assertAlmostEqual(sum(axes[1].get_xlim()) / 2, 0.3)
        np.testing.assert_allclose(table.draw.call_args.args[2], [0.3])  # what is within 0.05 s of it
        plt.close(figure)

    def test_a_run_of_one_row_has_no_impact_to_look_at(self):
        cell = FakeCell()
        cell.series = lambda *_: np.array([[0.0], [5.0]])
        table = unittest.mock.MagicMock()
        table.__iter__.return_value = iter([(0, cell, {})])
        figure, axes = plt.subplots(1, 2)
        figures.figure01(table, axes)
        self.assertEqual(table.draw.call_count, 1)  # of the whole run
        plt.close(figure)

    def test_the_exact_way_of_the_pushed_box(self):
        # 1 N on 1 kg from 1 to 5 s against mu g = 0.98: 0.02 m/s^2, then 0.08 m/s against 0.98 m/s^2.
        slides, stops = 0.02 * 4**2 / 2, 0.08**2 / (2 * 0.98)
        np.testing.assert_allclose(figures.pushed(np.array([0, 1, 3, 5, 8])), [0, 0, 0.04, slides, slides + stops], atol=1e-12)

    def test_a_quaternion_turns_and_turns_back(self):
        quarter, x = np.array([[0.5**0.5], [0], [0], [0.5**0.5]]), np.array([[1.0], [0], [0]])  # about z
        np.testing.assert_allclose(robots.turned(quarter, x), [[0], [1], [0]], atol=1e-15)
        np.testing.assert_allclose(robots.turned_back(quarter, x), [[0], [-1], [0]], atol=1e-15)

    def test_the_robot_is_drawn_with_its_base_behind_the_axle_whatever_its_heading(self):
        # Facing -z, as the scene begins: base 0.055 m behind the axle, drawn twice as large; then turned to face -x.
        for heading, behind in ((0.0, (0, 1)), (np.pi / 2, (1, 0))):
            base, wheels, nose = robots.outline(3.0, 5.0, heading)
            np.testing.assert_allclose(wheels.mean(axis=(0, 1)), [3, 5], atol=1e-12)
            np.testing.assert_allclose(base.mean(axis=0) - [3, 5], 2 * 0.055 * np.array(behind), atol=1e-12)
            np.testing.assert_allclose(nose[0], base.mean(axis=0), atol=1e-12)
            self.assertLess((nose[1] - nose[0]) @ np.array(behind), 0)


class Fits(unittest.TestCase):
    def test_a_power_and_a_circle_are_found(self):
        self.assertAlmostEqual(precision.slope([1, 10, 100], [7, 0.7, 0.07]), -1.0, 14)
        # Half a turn of radius 2 about (3, -1), every other point 0.01 outside, the others as far inside.
        turn = [(2 + 0.01 * (-1)**i, math.pi * i / 99) for i in range(100)]
        points = [(3 + r * math.cos(a), -1 + r * math.sin(a)) for r, a in turn]
        radius, deviation = precision.circle(points)
        self.assertAlmostEqual(radius, 2, 3)
        self.assertAlmostEqual(deviation, 0.005, 4)
        self.assertEqual(precision.circle(points[::-1]), (radius, deviation), "sums are exact, whatever their order")

    def test_a_line_is_no_circle(self):
        self.assertTrue(all(map(math.isnan, precision.circle([(0, 1), (0, 2), (0, 4)]))))


class Precision(unittest.TestCase):
    def test_the_front_holds_what_none_beats_in_both(self):
        points = [{"time": t, "error": e, "worst": e} for t, e in ((1, 1e-2), (2, 1e-3), (3, 5e-3), (4, 1e-3), (5, None), (6, 1e-14), (7, 1e-15))]
        self.assertEqual([p["time"] for p in precision.pareto(points)], [1, 2, 6])

    def test_an_order_is_claimed_where_the_halvings_agree(self):
        steps = ["1e-2", "5e-3", "2.5e-3", "1.25e-3"]
        second = FakeResults([FakeCell(3 * float(h)**2, step=h) for h in steps])
        self.assertAlmostEqual(precision.orders(second)[0]["order"], 2.0)
        ragged = FakeResults([FakeCell(e, step=h) for e, h in zip((1e-2, 9e-3, 1e-3, 9e-4), steps)])
        self.assertIsNone(precision.orders(ragged)[0]["order"])
        exact = FakeResults([FakeCell(0.0, step=h) for h in steps])
        self.assertIsNone(precision.orders(exact)[0]["order"])

    def test_the_polygon_loss_is_followed_with_slope_one(self):
        cells = [FakeCell(2 * (1 - math.cos(math.pi / k)), k=str(k), errors={"polygon_position_linf_m": 1e-9}) for k in (4, 8, 16, 32)]
        self.assertAlmostEqual(precision.polygons(FakeResults(cells))[0]["slope"], 1.0)

    def test_an_error_is_split_into_solver_model_and_step(self):
        # Where one body is at the end: exact friction; the polygon solved tightly, 1e-3 m from it; and loosely, 1e-5 m further.
        places = {"exact": 1.0, "polygon": 1.0 + 1e-3, "loose": 1.0 + 1e-3 + 1e-5, "alone": 1.0 + 7e-3}

        def cell(run, error, method, solver="", **more):
            made = FakeCell(error, run=run, method=method, solver=solver, step="1e-3", law_residual_max="0", **more)
            made.folder = run
            return made

        cells = [
            cell("exact", 2e-4, "coulomb", "newton"),
            cell("polygon", 1e-3, "ap", "lemke", errors={"polygon_position_linf_m": 3e-4}),
            cell("loose", 1e-3, "ap", "path", errors={"polygon_position_linf_m": 4e-4}),
            cell("alone", 7e-3, "mirtich")]
        moments = lambda folder: {0.0: [(0, 0, 0)], 1.0: [(places[folder], 0, 0)]}
        with unittest.mock.patch.object(precision, "moments", moments):
            rows = {row["cell"]["run"]: row for row in precision.parts_of_error(FakeResults(cells), "", "")}
        for run, solver, model, step, dominates in (("exact", 0, 0, 2e-4, "step"), ("polygon", 0, 1e-3, 3e-4, "model"), ("loose", 1e-5, 1e-3, 3e-4, "model"),
                                                    ("alone", math.nan, 7e-3, 2e-4, "model")):
            with self.subTest(run):
                np.testing.assert_allclose([rows[run][part] for part in ("solver", "model", "step_error")], [solver, model, step], rtol=1e-9)
                self.assertEqual(rows[run]["dominates"], dominates)

    def test_the_solves_for_a_micron_are_where_the_line_of_an_order_reaches_it(self):
        # Errors 0.1 n^-p of n solves: 1e-6 m at 1e5^(1 / p).
        def cell(order, solves):
            made = FakeCell(0.1 * solves**-float(order), accuracy="1e-6")
            made.knob = {"accuracy": "1e-6", "order": str(order)}.get
            made.row = {"solves": str(solves)}
            return made

        cells = [cell(order, solves) for order in (2, 4) for solves in (10, 20, 40)]
        rows = {row["order"]: row for row in stepping.cost(FakeResults(cells))}
        self.assertEqual(sorted(rows), [2, 4])
        for order, row in rows.items():
            self.assertAlmostEqual(row["slope"], order)
            self.assertAlmostEqual(row["solves_for_1e-6_m"] / 1e5**(1 / order), 1)

    def test_a_failure_is_slower_than_everything(self):
        fast = FakeCell(1e-3, 1.0, name="fast")
        slow = FakeCell(1e-4, 4.0, name="slow", solver="path")
        dead = FakeCell(math.nan, 0.1, False, name="dead", solver="ynl", status="ray")
        ended, right = precision.profiles(FakeResults([fast, slow, dead]))
        self.assertEqual(ended, {"fast": [1.0], "slow": [4.0], "dead": [math.inf]})
        # Ten times the least error is no right answer.
        self.assertEqual(right, {"fast": [math.inf], "slow": [1.0], "dead": [math.inf]})
        # A problem that one of them was not run on is none of the profile.
        more = [FakeCell(1e-3, time, name=name, knobs="step=1e-3") for time, name in ((1.0, "fast"), (2.0, "slow"))]
        self.assertEqual(precision.profiles(FakeResults([fast, slow, dead, *more]))[0], ended)

    def test_an_order_needs_three_halvings(self):
        two = FakeResults([FakeCell(float(h), step=h) for h in ("1e-2", "5e-3", "2.5e-3")])
        self.assertIsNone(precision.orders(two)[0]["order"])

    def test_a_choice_counts_the_uncertainty_of_the_reference_and_the_claims(self):
        def point(time, error, status="ok", refuted="0", name="a", unsure=0.0):
            return {"time": time, "error": error, "worst": error, "uncertainty": unsure, "status": status, "time_per_step": time, "least": 0.9 * time,
                    "most": 1.1 * time, "repeats": 2, "cell": FakeCell(solver=name, false_claims=refuted)}
        points = [point(1, 0.9e-3, unsure=0.2e-3), point(2, 1e-9, "inaccurate"), point(3, 1e-9, refuted="1"), point(4, 1e-3),
                  point(4.1, 1e-4), point(9, 1e-9, name="b"), point(5, None) | {"time": None}]
        best, second, cheaper = precision.choose(points, 1e-3)
        self.assertEqual((best["time"], second["time"], [p["time"] for p in cheaper]), (4, 9, [1, 2, 3]))
        self.assertEqual((precision.told_apart(best, points[4]), precision.told_apart(best, second)), (False, True))
        self.assertIsNone(precision.told_apart(best, second | {"repeats": 1}))
        self.assertEqual(precision.choose(points, 1e-12), (None, None, []))
        self.assertEqual(precision.nearest(points)["time"], 9)

    def test_what_the_bound_forbids_is_said_to_whom_convex_is_advised(self):
        ap, convex = ({"cell": FakeCell(method=method)} for method in ("ap", "convex"))
        self.assertIn("a box that should tip slides", sections.forbidden([ap, convex]))
        self.assertEqual(sections.forbidden([ap]), "")

    def test_a_replayed_stream_is_counted_by_solver(self):
        with tempfile.TemporaryDirectory() as folder:
            table = Path(folder) / "replay/stack__boxes-4/solve_all.csv"
            table.parent.mkdir(parents=True)
            table.write_text("kind,method,solver,variant,k,compression_bound,status,false_claim,residual,law_residual,time_median_s,busy\n"
                             "contact,ap,lemke,,4,,ok,False,1e-16,1e-3,1e-5,True\ncontact,ap,lemke,,4,,ok,False,1e-15,3e-3,3e-5,False\n"
                             "contact,ap,lemke,,4,,ray,False,,,1e-5,\ncontact,ap,path-lib,,4,,unavailable,,,,,\n")
            (Path(folder) / "runs.csv").write_text("run\n")
            counts = {scene: solve_all.summary(rows) for scene, rows in solve_all.streams(Runs(folder, folder)).items()}
        self.assertEqual(counts, {"stack boxes=4": {("contact", "ap lemke k = 4"): {
            "problems": 3, "ok": 2, "false_claims": 0, "busy": 1, "residual": 1e-15, "law_residual": 2e-3, "time": 2e-5}}})


class Report(unittest.TestCase):
    def setUp(self):
        self.made = MADE
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)

    def results(self):
        return Runs(self.made, self.made / "runs")

    def rows(self, name):
        with open(self.made / name, newline="") as file:
            return list(csv.DictReader(file))

    def test_every_method_runs_on_every_scene_of_the_paper_that_is_there(self):
        paper = [r for r in self.rows("runs.csv") if "paper" in r["sweeps"].split()]
        # 9 scenes: newton twice, mirtich, ap, convex twice; and ap once more with k = 16 on the sticking box.
        self.assertEqual(len(paper), 9 * 6 + 1)
        self.assertEqual([r["k"] for r in paper if r["scene"] == "sticking_box" and r["method"] == "ap"], ["8", "16"])
        missing = json.loads((self.made / "manifest.json").read_text())["missing"]
        self.assertEqual(set(missing), {"ap/path-lib", "mobile_robot", "mobile_robot_caster", "grasp"})

    def test_processing_time_is_the_sum_of_the_parts_and_missing_is_empty(self):
        rows = self.rows("runs.csv")
        self.assertEqual({r["processing_s"] for r in rows}, {"0.5", ""})
        self.assertEqual({r["scene"] for r in rows if not r["processing_s"]}, {"sticking_box"})
        self.assertEqual({r["residual_max"] for r in rows}, {""})

    def test_no_path_of_the_machine_is_published(self):
        for file in ("runs.csv", "manifest.json", "report.json", "report.html", "table1.csv", "table1.md", "table1.tex"):
            self.assertNotIn(str(self.made), (self.made / file).read_text(), file)

    def test_table_one_has_a_status_and_the_time_reached_in_place_of_dnf(self):
        cells = {(r["scene"], r["parameters"], r["method"], r["epsilon"]): r for r in self.rows("table1.csv")}
        self.assertEqual(cells["stack", "boxes=16", "ap", ""]["status"], "ray")
        self.assertEqual(cells["stack", "boxes=16", "ap", ""]["median_s"], "")
        markdown = (self.made / "table1.md").read_text()
        self.assertIn("ray at 0.25 s / 4025.48 (51)", markdown)
        self.assertIn("crash at 10 s", markdown)
        self.assertNotIn("DNF |", markdown.replace("/ DNF", ""))
        self.assertIn(r"\toprule", (self.made / "table1.tex").read_text())

    def test_ratios_stay_inside_a_column_and_the_papers_stand_beside_ours(self):
        cells = {(r["scene"], r["method"], r["solver"], r["epsilon"]): r for r in self.rows("table1.csv") if r["variant"] in ("", "uncapped")}
        ours = cells["sliding_box", "ap", "lemke", ""]
        self.assertEqual(float(ours["ratio"]), 1.0)  # the stand-in takes the same time for everything
        self.assertAlmostEqual(float(ours["paper_ratio"]), 5.18 / 15.01)
        self.assertEqual(cells["sliding_box", "convex", "ipm", "1e-2"]["paper_s"], "13.05")
        self.assertEqual(cells["sticking_box", "ap", "lemke", ""]["ratio"], "")  # it crashed
        self.assertEqual(cells["circular_sliding", "ap", "lemke", ""]["paper_certain"], "no")

    def test_every_claim_has_an_answer_and_what_is_missing_cannot_be_told(self):
        answers = {name: claims.answered(name, self.results()) for name in claims.ALL}
        self.assertEqual(list(answers), [f"C{n}" for n in range(1, 11)])
        self.assertEqual(set(answers["C6"].answers.values()) | set(answers["C7"].answers.values()), {claims.UNKNOWN})
        for name in ("C1", "C2", "C3", "C4", "C5", "C6", "C7"):
            self.assertEqual(set(answers[name].answers), {"Newton uncapped", "Newton stick-tested"}, name)
        # The stand-in's stack of 16 ends every run of ap early.
        self.assertIn("did not finish", script(SCRIPTS / "claims.py", "--results", self.made, "--runs", self.made / "runs", "C10"))

    def test_claims_follow_the_numbers(self):
        results = self.results()
        table = results.table
        table["error_energy_rise_relative"] = ["0.16" if variant == "uncapped" else "0.0" for variant in table["variant"]]
        self.assertEqual(claims.asked("C1", results.seen(table)).answers, {"Newton uncapped": claims.YES, "Newton stick-tested": claims.NO})
        table.loc[table["method"] == "mirtich", "error_energy_rise_relative"] = "1e-8"
        self.assertEqual(set(claims.asked("C1", results.seen(table)).answers.values()), {claims.NO})
        table["error_energy_rise_relative"] = ""
        self.assertEqual(set(claims.asked("C1", results.seen(table)).answers.values()), {claims.UNKNOWN})

    def test_of_memory_that_nobody_knows_a_claim_cannot_be_told(self):
        def told(memory):
            results = self.results()
            lemke = results.table[results.table["solver"] == "lemke"]
            results.table = pd.concat([results.table, lemke.assign(solver="ynl", peak_memory_mb=memory)])
            return claims.asked("C8", results).parts[1].verdict

        self.assertEqual(told("12.0"), claims.NO)
        self.assertEqual(told("1200.0"), claims.YES)
        self.assertEqual(told(""), claims.UNKNOWN)

    def test_the_fastest_is_faster_than_every_other_and_not_than_some(self):
        for lemke, answer in ((0.5, claims.YES), (2.0, claims.NO)):
            results = self.results()
            table = results.table
            sphere = table["scene"] == "impacting_sphere"
            table.loc[sphere, "processing_s"] = "3.0"
            table.loc[sphere & (table["method"] == "mirtich"), "processing_s"] = "1.0"
            table.loc[sphere & (table["solver"] == "lemke"), "processing_s"] = str(lemke)
            self.assertEqual(claims.asked("C9", results).parts[0].verdict, answer, lemke)

    def test_a_claim_names_the_commands_that_repeat_its_numbers(self):
        said = script(SCRIPTS / "claims.py", "--results", self.made, "--runs", self.made / "runs", "C5")
        self.assertIn("contactbench run stack.xml --method convex --solver ipm --epsilon 1e-12 --set boxes=16", said)

    def test_the_same_runs_make_the_same_report_and_pictures(self):
        again = self.top / "again"
        again.mkdir()
        for file in ("runs.csv", "ensemble.csv", "manifest.json"):
            shutil.copy(self.made / file, again)
        script(SCRIPTS / "report.py", "--results", again, "--runs", self.made / "runs")
        names = {str(p.relative_to(self.made)) for p in self.made.rglob("*") if p.is_file() and "runs" not in p.relative_to(self.made).parts}
        self.assertGreater(len(names), 20)
        for name in names - {"program"}:
            self.assertEqual((self.made / name).read_bytes(), (again / name).read_bytes(), name)

    def on_another_machine(self, name, slower):
        """The report made of the same runs where all took longer, and a limit of time cut one of them earlier."""
        folder = self.top / name
        folder.mkdir()
        for file in ("manifest.json", "ensemble.csv"):
            shutil.copy(self.made / file, folder)
        with open(folder / "runs.csv", "w", newline="") as file:
            rows = self.rows("runs.csv")
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            for number, row in enumerate(rows):
                for column in ("processing_s", "wall_s", "peak_memory_mb", "other_cores"):
                    row[column] = row[column] and str(float(row[column]) * (1 + slower * (0.5 + number % 7)))
                if row["run"].startswith("circular_sliding__convex"):
                    row.update(status="time_limit", finished="false", t_reached=str(3 / slower))
                writer.writerow(row)
        script(SCRIPTS / "report.py", "--results", folder, "--runs", self.made / "runs", "--no-draw")
        return json.loads((folder / "report.json").read_text())

    def test_times_of_the_report_stand_apart_from_what_does_not_change(self):
        reports = [self.on_another_machine("slow", 1), self.on_another_machine("slower", 2)]
        self.assertNotEqual(*reports)
        for part in reports:
            self.assertIn("time_limit", json.dumps(part["sections"]["claim_table"]["data"]["C10"]))
            for section in part["sections"].values():
                del section["timing"], section["worth_of_timing"]
        self.assertEqual(*reports)

    def test_every_figure_says_what_the_papers_shows_and_what_made_it(self):
        figures = json.loads((self.made / "report.json").read_text())["sections"]["figures"]["data"]
        for number in range(1, 8):
            figure = figures[f"figure{number:02}"]
            self.assertIn("paper", figure["says"], number)
            self.assertTrue(any(c.startswith("contactbench run") for c in figure["commands"]), number)

    def test_a_figure_that_cannot_be_drawn_is_said_and_stops_nothing(self):
        # A trajectory full of garbage.
        broken = self.top / "broken"
        shutil.copytree(self.made, broken)
        for file in broken.glob("runs/circular_sliding__*/trajectory.csv"):
            file.write_text("t,body,px,py,pz\nzero,box,one,two,three\n")
        said = script(SCRIPTS / "report.py", "--results", broken, "--runs", broken / "runs")
        self.assertIn("figure05.py could not draw", said)
        self.assertIn("figure05 could not be drawn", (broken / "report.html").read_text())

    def test_figures_are_drawn_where_no_run_is_there(self):
        with open(self.made / "runs.csv") as file:
            (self.top / "runs.csv").write_text(file.readline())
        for plot in sorted((SCRIPTS / "plots").glob("*.py")):
            script(plot, "--results", self.top, "--runs", self.made / "runs")
            self.assertTrue((self.top / "figures" / f"{plot.stem}.png").exists(), plot.stem)

    def test_the_report_needs_no_network(self):
        text = (self.made / "report.html").read_text()
        self.assertEqual(re.findall(r"""(?:src|href)=["'](?!data:|#|motion.html#)[^"']*""", text), [])
        self.assertNotIn("@import", text)
        self.assertNotIn("url(", text)


# The report in a frame of a given width, and what the browser makes of it.
PROBE = """<!DOCTYPE html><html><body style="margin:0"><pre id="found">nothing</pre>
<iframe id="frame" style="border:0;width:%dpx;height:900px"></iframe><script>
const faults = [], frame = document.getElementById("frame");
frame.srcdoc = %s;
frame.onload = () => {
  const page = frame.contentDocument, root = page.documentElement, images = [...page.images];
  document.getElementById("found").textContent = JSON.stringify({
    images: images.length, shown: images.filter(i => i.complete && i.naturalWidth > 0 && i.clientWidth > 0).length,
    widest: Math.max(...images.map(i => i.getBoundingClientRect().right)), overflow: root.scrollWidth - root.clientWidth,
    headings: page.querySelectorAll("h2").length, smallest: Math.min(...[...page.querySelectorAll("p, li")].map(
      e => parseFloat(frame.contentWindow.getComputedStyle(e).fontSize)))});
};
</script></body></html>"""


@unittest.skipUnless(browser.CHROMIUM, browser.WHY_NOT)
class Browser(unittest.TestCase):
    def setUp(self):
        self.made = MADE

    def look(self, width):
        page = self.made / "runs" / f"probe{width}.html"
        report = json.dumps((self.made / "report.html").read_text()).replace("</", "<\\/")
        page.write_text(PROBE % (width, report))
        dom = browser.browse(page, "--dump-dom", "--virtual-time-budget=20000").stdout
        return json.loads(re.search(r'<pre id="found">(.*?)</pre>', dom, re.S).group(1))

    def test_it_loads_without_errors_and_all_pictures_show(self):
        self.assertEqual(browser.faults(browser.browse(self.made / "report.html", "--dump-dom")), [])
        found = self.look(1200)
        self.assertGreaterEqual(found["images"], 8)
        self.assertEqual(found["shown"], found["images"])
        self.assertLessEqual(found["overflow"], 0)
        self.assertGreaterEqual(found["headings"], 6)

    def test_it_reads_on_a_phone(self):
        found = self.look(390)
        # The page itself does not scroll sideways (wide tables do, in a frame of their own), and text is not shrunk.
        self.assertLessEqual(found["overflow"], 0)
        self.assertLessEqual(found["widest"], 390)
        self.assertGreaterEqual(found["smallest"], 14)

    def test_it_prints(self):
        pdf = self.made / "runs/report.pdf"
        browser.browse(self.made / "report.html", f"--print-to-pdf={pdf}", "--no-pdf-header-footer")
        data = pdf.read_bytes()
        self.assertTrue(data.startswith(b"%PDF"))
        self.assertGreater(len(data), 100_000)


if __name__ == "__main__":
    unittest.main()
