"""scripts/stress.py: verdicts of cells, which are compared and folded, and what it measures with: bisections, the arch's statics.
Without the program; its runs, solves and files are in test_stress_runs.py and test_stress_solves.py."""
import io
import json
import math
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

from contactbench import limits, measures, problems, program, stress

ROOT = Path(__file__).resolve().parents[2]


class InPlace(unittest.TestCase):
    def test_rows_of_some_columns_take_their_places_and_all_others_stay_as_they_were(self):
        def row(method, error, **more):
            return stress.BLANK | {"id": "M1", "scene": "stack", "row": "", "method": method, "verdict": "right", "status": "ok", "error": error,
                                   "bound": 1e-3, "share": None, "residual": 1.25e-13, "expect": "stands"} | more

        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            manifest = {"git": "old", "cpu": "a", "made": "then", "runs": 3}
            stress.write_tables([row("mirtich", 1e-9, row="n=2"), row("mirtich", 0.1 + 0.2), row("convex", None, verdict="typed", status="ray")], out, manifest)
            before = (out / "stress.csv").read_text().splitlines()
            for error in (5e-4, 7e-4):
                made = {"columns": ["mirtich"], "git": str(error), "cpu": "b", "made": "now"}
                rows, said = stress.in_place([row("mirtich", error)], out, made)
                stress.write_tables(rows, out, said)
                after = (out / "stress.csv").read_text().splitlines()
                self.assertEqual(after[:2] + after[3:], before[:2] + before[3:])
                self.assertEqual(after[2], before[2].replace(repr(0.1 + 0.2), repr(error)))
                self.assertEqual(json.loads((out / "manifest.json").read_text()), manifest | {"columns_of_others": [made]})
                self.assertIn(f"3 runs. mirtich: program {error} on b, now.", (out / "stress.md").read_text())
            # Of other columns, what made those stays said.
            later = {"columns": ["convex"], "git": "late", "cpu": "c", "made": "later"}
            _, said = stress.in_place([row("convex", None, verdict="typed", status="ray")], out, later)
            self.assertEqual(said["columns_of_others"], [made, later])
            with self.assertRaisesRegex(program.ProgramError, "no row M1 stack  other"):
                stress.in_place([row("other", 1)], out, made)


class Bisection(unittest.TestCase):
    def test_it_finds_the_value_from_which_on_it_stands(self):
        found = limits.bisect(lambda x: ("ok", 1e-12, x >= math.sqrt(2)), 1, 2, 1e-6)
        self.assertAlmostEqual(found.value, math.sqrt(2), delta=2e-6)
        self.assertEqual((found.status, found.residual), ("ok", 1e-12))

    def test_it_is_found_to_a_fraction_of_itself_however_small_it_is(self):
        for edge in (3e-7, 0.4, 5e4):
            found = limits.bisect(lambda x, edge=edge: ("ok", 0, x >= edge), 0, 4 * edge, 1e-3)
            self.assertAlmostEqual(found.value / edge, 1, delta=1e-3)

    def test_what_falls_or_stands_at_either_end_has_no_such_value(self):
        self.assertEqual(limits.bisect(lambda x: ("ok", 0, False), 1, 2, 1e-6).note, "falls at either end")
        self.assertEqual(limits.bisect(lambda x: ("ok", 0, True), 1, 2, 1e-6).note, "stands at either end")
        self.assertEqual(limits.bisect(lambda x: ("ok", 0, x < 1.5), 1, 2, 1e-6).note, "falls at either end")  # the wrong way round

    def test_the_largest_stable_step_is_found_however_short_it_is(self):
        for largest in (3e-6, 0.2):
            with tempfile.TemporaryDirectory() as folder:
                def run(_, *arguments, folder=folder, largest=largest):
                    step = float(arguments[arguments.index("--step") + 1])
                    summary = {"status": "ok" if step <= largest else "energy_blowup", "control": {"largest_stable_step": 7}}
                    (Path(folder) / "summary.json").write_text(json.dumps(summary))

                with mock.patch.object(limits.program, "call", run):
                    found, estimate = limits.stable_step("program", "robot.xml", [], folder)
            self.assertAlmostEqual(found / largest, 1, delta=limits.NEARNESS)
            self.assertEqual(estimate, 7)

    def test_a_trial_that_fails_ends_it_with_its_status(self):
        found = limits.bisect(lambda x: ("ray", None, False) if 1.2 < x < 1.9 else ("ok", 0, x > 1.5), 1, 2, 1e-6)
        self.assertEqual((found.status, found.value), ("ray", None))


class Names(unittest.TestCase):
    def test_a_method_that_is_not_there_ends_with_2_and_runs_nothing(self):
        listed = {"methods": [], "engines": [], "solvers": [], "statuses": []}
        with mock.patch("sys.stderr", io.StringIO()) as said, mock.patch("contactbench.program.listed", lambda _: listed):
            for words in (["--only", "A1"], ["--random", "1"]):
                with mock.patch("sys.argv", ["stress.py", "--method", "ap/lemk", *words]):
                    with self.assertRaises(SystemExit) as ended:
                        stress.main()
                self.assertEqual(ended.exception.code, 2)
        self.assertIn("--method ap/lemk: no such; there are ap/lemke, ", said.getvalue())


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
    good = {"status": "ok", "hung": False, "nan": False, "residual": 1e-12, "false_claims": 0, "error": 0.0, "engine": False,
            "wanted": 0.0, "estimate": 0.0}

    def judge(self, method="ap/lemke", **changed):
        return stress.judge({**self.good, **changed}, self.case, method)

    def test_every_verdict(self):
        self.assertEqual(self.judge(), "right")
        self.assertEqual(self.judge(error=1.0), "wrong")
        self.assertEqual(self.judge("convex/bound-off", error=1.0), "model")
        self.assertEqual(self.judge(status="ray"), "typed")
        self.assertEqual(self.judge(residual=1e-3), "silent")
        self.assertEqual(self.judge(status="inaccurate", residual=1e-3), "typed")
        # An answer that the run itself calls inaccurate is right, explained or a typed failure, however small its residual.
        self.assertEqual(self.judge(status="inaccurate"), "right")
        self.assertEqual(self.judge("convex/bound-off", status="inaccurate", error=1.0), "model")
        self.assertEqual(self.judge(status="inaccurate", error=1.0), "typed")
        self.assertEqual(self.judge(false_claims=1), "silent")
        for fault in ({"status": "crash"}, {"hung": True}, {"nan": True}):
            self.assertEqual(self.judge(**fault), "defect")

    def test_a_wanted_accuracy_is_reached_or_said_to_be_missed(self):
        self.assertEqual(self.judge(error=9e-6, wanted=1e-6), "right")
        self.assertEqual(self.judge(error=1e-3, wanted=1e-6), "wrong")
        self.assertEqual(self.judge(error=1e-3, wanted=1e-6, estimate=5e-4), "typed")
        self.assertEqual(stress.with_accuracy(["--method", "ap", "--step", "1e-3", "--prune", "off"], 1e-6),
                         ["--method", "ap", "--prune", "off", "--accuracy", "1e-06", "--record-interval", "1e-3"])
        self.assertEqual(stress.with_accuracy(["--step", "1e-3"], 0), ["--step", "1e-3"])
        # As much, in a scene whose metre is a thousandth.
        self.assertIn("--accuracy 1e-09", " ".join(stress.with_accuracy(["--set", "second=1/3600", "--set", "metre=0.001"], 1e-6)))

    def test_ways_of_a_step_have_the_limit_of_none(self):
        v, a, h = 0.5, 4.9, 1e-3
        self.assertAlmostEqual(measures.slowed(v, a, 10, h), sum(h * (v - a * h * k) for k in range(1, 11)), delta=1e-15)
        self.assertAlmostEqual(measures.slowed(v, a, 10**9, 1e-9), v * v / (2 * a), delta=1e-9)
        self.assertEqual(measures.slowed(v, 0, 10, h), 10 * h * v)
        v, h = 0.5, 0.02  # stands still from the sixth step on
        self.assertAlmostEqual(measures.slowed(v, a, 50, h), sum(h * max(v - a * h * k, 0) for k in range(1, 51)), delta=1e-15)

    @staticmethod
    def run_that_moved(moved, steps, h, **parameters):
        return SimpleNamespace(parameters=parameters, h=h, steps=lambda: steps, moved=lambda body: moved)

    def test_a_ball_that_slips_and_then_rolls_goes_as_step_after_step_says(self):
        for v, mu, steps in ((2.0, 0.3, 500), (2.0, 0.3, 60), (0.5, 0.0, 100), (0.5, 0.5, 1)):
            h, x, speed, slip = 1e-3, 0.0, v, v
            for _ in range(steps):
                less = min(mu * measures.G * h, slip / 3.5)
                speed, slip = speed - less, slip - 3.5 * less
                x += h * speed
            run = self.run_that_moved([x, 0, 0], steps, h, v=v, mu=mu)
            self.assertLess(measures.rolls(run, {"arguments": {"v": "v", "body": "ball"}})[0], 1e-13, (v, mu, steps))

    def test_a_ball_in_a_groove_rolls_at_five_sevenths_where_the_groove_is_flat(self):
        # And as fast as its weight and inertia say where it is not: its middle is sin(half_angle) of r over the line that it turns about.
        h, n, t = 1e-3, 1000, 0.3
        for half, share in ((math.pi / 2, 5 / 7), (math.pi / 6, 0.25 / 0.65)):
            x = share * measures.G * math.sin(t) * h * h * n * (n + 1) / 2
            error, way = measures.groove(self.run_that_moved([0, 0, x], n, h, half_angle=half, slope=t, mu=0.9), {})
            self.assertEqual(way, "rolls")
            self.assertLess(error, 1e-12)
        # On little friction it slips: each side bears 1 / (2 sin half_angle) of the weight across the slope.
        for mu in (0.0, 0.05):
            x = measures.G * (math.sin(t) - mu * math.cos(t) / 0.5) * h * h * n * (n + 1) / 2
            error, way = measures.groove(self.run_that_moved([0, 0, x], n, h, half_angle=math.pi / 6, slope=t, mu=mu), {})
            self.assertEqual(way, "slips")
            self.assertLess(error, 1e-12)

    def test_an_engine_that_is_off_is_no_fault_of_the_program(self):
        self.assertEqual(self.judge("ode/quick", engine=True, residual=None), "right")
        self.assertEqual(self.judge("ode/quick", engine=True, residual=None, error=1.0), "engine")
        for end in ({"status": "crash"}, {"status": "not_finite"}, {"status": "time_limit", "hung": True}, {"nan": True}):
            self.assertEqual(self.judge("ode/quick", engine=True, error=None, **end), "engine")
        for status in ("unsupported", "time_limit"):
            self.assertEqual(self.judge("ode/quick", engine=True, status=status, error=None), "typed")
        self.assertNotIn("engine", measures.BAD)


    def test_an_engine_whose_answer_cannot_be_measured_has_no_cell(self):
        self.assertIsNone(self.judge("ode/quick", engine=True, error=None))
        jobs = [{"case": 0, "row": "", "method": name, "first": True, "drawn": None} for name in ("ode/quick", "dart/dantzig")]
        cells = [{**stress.BLANK, "engine": True, "status": "ok", "error": error} for error in (None, 0.0)]
        cases = {"case": [{**self.case, "id": "A", "scene": "box", "expect": ""}]}
        stress.compare(jobs, cells, cases)
        self.assertEqual([(r["method"], r["verdict"]) for r in stress.table_of(jobs, cells, cases)], [("dart/dantzig", "right")])

    def test_an_engine_without_what_it_has_in_other_rows_is_off(self):
        # Bullet in single precision takes steps of 1e-7 s for none: nothing moves, and no impact is measured.
        jobs = [{"case": 0, "row": row, "method": name, "first": False, "drawn": None} for name in ("bullet", "dart") for row in "ab"]
        cells = [{**stress.BLANK, "engine": True, "status": "ok", "error": error} for error in (None, 0.0, None, None)]
        stress.compare(jobs, cells, {"case": [{**self.case, "id": "A", "scene": "ball", "expect": ""}]})
        self.assertEqual([cell["verdict"] for cell in cells], ["engine", "right", None, None])

    def test_an_engine_that_dies_is_shown_by_its_end(self):
        self.assertEqual(stress.shown({"verdict": "engine", "error": None, "status": "not_finite"}), "**engine** not_finite")


class Engines(unittest.TestCase):
    listed = {"engines": [{"name": "ode", "unavailable": None, "variants": [{"name": "quick"}, {"name": "world"}]},
                          {"name": "dart", "unavailable": "not installed"}]}

    def test_each_that_is_here_is_a_column_of_rows_whose_flags_it_has(self):
        columns = [("ap/lemke", ["--method", "ap"]), *stress.engines_of(self.listed)]
        self.assertEqual(columns[1:], [("ode/quick", ["--engine", "ode", "--variant", "quick"])])
        cases = {"case": [{"id": "A", "rows": [{"n": 1}, {"n": 1, "--prune": "off"}, {"--step": 1e-3}]},
                          {"id": "B", "methods": ["ap/lemke"], "rows": [{}]}]}
        options = mock.Mock(quick=False, only=[], other_program=None, member=1, program="", accuracy=0.0)
        jobs = stress.plan(cases, columns, options)
        self.assertEqual([(j["case"], j["row"]) for j in jobs if j["method"] == "ode/quick"], [(0, "n=1"), (0, "--step 0.001")])
        self.assertEqual(sum(j["method"] == "ap/lemke" for j in jobs), 4)
        self.assertTrue(all("--shuffle-contacts" not in j["flags"] for j in jobs if j["method"] == "ode/quick"))

    def test_a_case_by_the_other_program_has_its_first_row_by_that_one_too(self):
        cases = {"case": [{"id": "A", "rows": [{"--step": 1e-3}, {"--step": 1e-4}], "other_program": True}]}
        options = mock.Mock(quick=False, only=[], other_program="older", member=0, program="newer", accuracy=0.0)
        jobs = stress.plan(cases, [("ap/lemke", ["--method", "ap"])], options)
        self.assertEqual([(j["program"], j["row"], j["first"]) for j in jobs],
                         [("older", "by the other program", False), ("newer", "--step 0.001", True), ("newer", "--step 0.0001", False)])
        self.assertEqual(jobs[0]["flags"], ["--method", "ap", "--step", "0.001"])

    def test_a_gain_of_energy_in_events_that_are_not_seen_is_no_zero(self):
        run = mock.Mock(summary={"energy": {"max_gain_relative": None}, "engine": {"name": "ode"}})
        self.assertIsNone(measures.event_gain(run, {})[0])


class Ensembles(unittest.TestCase):
    def cell(self, verdict, **more):
        return {"verdict": verdict, "error": None, "residual": None, "energy_gain": None, "penetration": None, "solve_s": None,
                "iterations": None, "note": verdict, **more}

    def test_an_ensemble_is_as_good_as_its_worst_member_and_says_how_many_are_right(self):
        folded = stress.fold([self.cell("right", error=1e-12, residual=1e-13), self.cell("silent", error=1.0, residual=1e-3),
                              self.cell("right", error=1e-10), self.cell("model", error=0.5)])
        self.assertEqual((folded["verdict"], folded["share"], folded["error"], folded["residual"]), ("silent", 0.5, 1.0, 1e-3))
        self.assertEqual(folded["note"], "2 of 4 within the bound; silent")
        self.assertIsNone(folded["penetration"])


class StoredProblems(unittest.TestCase):
    def test_a_case_names_its_files_and_every_method_gets_each(self):
        cases = {"problem": [{"id": "X1", "folder": "scenarios/stress/problems", "kind": "contact", "files": ["a.hdf5", "b.hdf5"], "ends": ["solved"]},
                             {"id": "X2", "kind": "lcp", "files": ["c"], "ends": ["ray"]}]}
        listed = {"solvers": [{"name": "lemke", "method": "ap", "unavailable": None}, {"name": "path", "method": "ap", "unavailable": "why"},
                              {"name": "ipm", "method": "convex", "unavailable": None}]}
        jobs = stress.problem_jobs(cases, [("ap", ["--method", "ap"]), ("convex", ["--method", "convex"])], listed, [], "/tmp")
        folder = ROOT / "scenarios" / "stress" / "problems"
        self.assertEqual([(j["id"], j["method"], j["arguments"][0]) for j in jobs[:4]],
                         [("X1", method, str(folder / file)) for file in ("a.hdf5", "b.hdf5") for method in ("ap", "convex")])
        self.assertEqual([j["method"] for j in jobs[4:]], ["ap/lemke"])
        self.assertEqual([j["id"] for j in stress.problem_jobs(cases, [], listed, ["X2"], "/tmp")], ["X2"])


class CardHouses(unittest.TestCase):
    def house(self, mu_less, moved):
        lean = 0.3
        critical_mu = (math.tan(lean) - 0.01) / 2
        run = mock.Mock(parameters={"lean": lean, "mu": critical_mu - mu_less})
        with mock.patch.object(measures, "displacement", return_value=(moved, "")):
            return measures.card_house(run, {})

    def test_it_stands_from_the_critical_friction_on(self):
        self.assertEqual(self.house(0, 1e-9), (1e-9, "stands"))
        self.assertEqual(self.house(-0.1, 1e-3), (1e-3, "moves"))

    def test_below_it_must_fall_and_a_hundredth_of_a_millimetre_is_a_fall(self):
        self.assertEqual(self.house(1e-3, 2e-5), (0.0, "falls"))
        self.assertEqual(self.house(1e-3, 0.5e-5), (1.0, "stands"))


class Tables(unittest.TestCase):
    def test_each_cell_is_in_both_files_and_verdicts_are_counted_by_method(self):
        rows = [{**dict.fromkeys(stress.COLUMNS), "id": "A1", "scene": "box", "row": "as it is", "expect": "rests", "method": method, "verdict": verdict,
                 "status": "ok", "error": error, "bound": 1e-9} for method, verdict, error in
                (("ap", "right", 1e-12), ("convex", "wrong", 0.25), ("newton", "typed", None))]
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            stress.write_tables(rows, out, {"git": "abc", "cpu": "some", "made": "today", "runs": 3})
            page, table = (out / "stress.md").read_text(), (out / "stress.csv").read_text()
            self.assertEqual(json.loads((out / "manifest.json").read_text())["runs"], 3)
        self.assertIn("| right | 1 | 0 | 0 | 1 |", page)
        self.assertIn("| wrong | 0 | 1 | 0 | 1 |", page)
        self.assertIn("**wrong** 0.25", page)
        self.assertEqual(table.count("\n"), 4)


class Limits(unittest.TestCase):
    case = {"bound": 1e-9, "departs": {"convex/bound-off": "a lift", "ap": "a polygon"}}
    good = stress.BLANK | {"status": "ok", "residual": 1e-12, "error": 0.0}

    def judge(self, method="coulomb", **changed):
        return stress.judge(self.good | changed, self.case, method)

    def test_a_bound_is_reached_up_to_itself_and_a_residual_too(self):
        self.assertEqual([self.judge(error=e) for e in (1e-9, 1.01e-9)], ["right", "wrong"])
        self.assertEqual([self.judge(residual=r) for r in (None, 1e-6, 1.01e-6)], ["right", "right", "silent"])
        # Ten times of what was wanted is reached, where that is more than the bound.
        self.assertEqual([self.judge(error=e, wanted=1e-7) for e in (1e-6, 1.01e-6)], ["right", "wrong"])
        self.assertEqual([self.judge(error=1.0, wanted=1e-7, estimate=e) for e in (1e-7, 1.01e-7)], ["wrong", "typed"])
        self.assertEqual(self.judge(error=1.0, status="inaccurate", wanted=1e-7, estimate=1.0), "typed")

    def test_an_answer_that_cannot_be_measured_is_a_defect_and_a_refuted_claim_is_none_of_what_says_inaccurate(self):
        self.assertEqual(self.judge(error=None), "defect")
        self.assertEqual(self.judge(status="inaccurate", false_claims=1), "right")
        self.assertEqual(self.judge(status="ray", nan=True), "defect")

    def test_a_reason_is_that_of_the_case_before_the_general_one_and_of_whole_names(self):
        with mock.patch.object(stress, "DEPARTS", {"ap": "in general", "mirtich": "one by one"}):
            reasons = {
                method: stress.reason_of(self.case, method)
                for method in ("ap", "ap/lemke", "apx/lemke", "convex/bound-off", "convex/bound-on", "mirtich", "coulomb")}
        self.assertEqual(
            reasons, {
                "ap": "a polygon", "ap/lemke": "a polygon", "apx/lemke": "", "convex/bound-off": "a lift", "convex/bound-on": "",
                "mirtich": "one by one", "coulomb": ""})

    def test_the_reason_of_a_departure_is_said_after_what_is_noted(self):
        for note, said in (("", "a polygon"), ("slides", "slides; a polygon")):
            cell = self.good | {"error": 1.0, "note": note}
            stress.judged(cell, self.case, "ap/lemke")
            self.assertEqual((cell["verdict"], cell["note"]), ("model", said))
        cell = self.good | {"error": 1.0, "note": "slides"}
        stress.judged(cell, self.case, "coulomb")
        self.assertEqual((cell["verdict"], cell["note"]), ("wrong", "slides"))


class Comparing(unittest.TestCase):
    def job(self, method="ap", first=False, row="", case=0, drawn=None):
        return {"case": case, "method": method, "first": first, "row": row, "drawn": drawn}

    def cell(self, **more):
        return stress.BLANK | {"status": "ok", "residual": 0.0} | more

    def test_places_are_compared_with_the_first_row_of_the_same_column(self):
        case = {"id": "T2", "scene": "units", "expect": "", "bound": 1e-10}
        # The first row need not come first.
        jobs = [
            self.job(row="b"),
            self.job("convex", row="b"),
            self.job(first=True, row="a"),
            self.job("convex", True, "a"),
            self.job("lost", row="b")]
        cells = [
            self.cell(place=place) for place in ([1.0, 2.5, -3.25], [4.0, 5.0, 6.0], [1.0, 2.0, -3.0], [4.0, 5.0, 6.0], [7.0])]
        stress.compare(jobs, cells, {"case": [case]})
        self.assertEqual([(c["error"], c["verdict"]) for c in cells[:4]], [(0.5, "wrong"), (0.0, "right"), (0.0, "right"),
                                                                           (0.0, "right")])
        self.assertEqual(
            {k: cells[4][k] for k in ("error", "note", "status", "verdict")},
            {"error": None, "note": "the first row has no answer to compare with", "status": "unsupported", "verdict": "typed"})

    def test_memory_may_grow_over_that_of_the_first_row_by_so_much(self):
        cases = {"case": [{"id": "A", "scene": "s", "expect": "", "bound": 1e-3, "memory_growth_mb": 10}]}
        jobs = [self.job(first=True), self.job(), self.job(), self.job("convex", True)]
        cells = [self.cell(error=1e-4, memory=memory) for memory in (50.0, 60.0, 60.5, 300.0)]
        stress.compare(jobs, cells, cases)
        self.assertEqual([(c["verdict"], c["error"]) for c in cells], [("right", 1e-4), ("right", 1e-4), ("wrong", math.inf),
                                                                       ("right", 1e-4)])
        self.assertEqual([c["note"] for c in cells[1:3]],
                         [f"creep 0.0001 m, memory {more} MB from the first row's" for more in ("+10.0", "+10.5")])

    def test_an_ensemble_is_a_row_of_its_size_and_others_are_rows_by_themselves(self):
        cases = {"case": [{"id": f"A{n}", "scene": f"s{n}", "bound": n, "expect": f"e{n}"} for n in range(2)]}
        jobs = [
            self.job(row="x", drawn=(1e-9, 1)),
            self.job(row="x", drawn=(1e-9, 2)),
            self.job(row="x", drawn=(1e-3, 1)),
            self.job("convex", row="x", drawn=(1e-9, 1)),
            self.job(case=1, row="x"),
            self.job(case=1, row="y", drawn=(0, 1))]
        verdicts = ("right", "wrong", "right", "right", "typed", "right")
        cells = [self.cell(verdict=v, error=n / 10, note="n") for n, v in enumerate(verdicts)]
        rows = stress.table_of(jobs, cells, cases)
        self.assertEqual([
            (r["id"], r["scene"], r["bound"], r["expect"], r["row"], r["method"], r["verdict"], r["error"], r["share"])
            for r in rows], [("A0", "s0", 0, "e0", "x perturbed by 1e-09 m", "ap", "wrong", 0.1, 0.5),
                             ("A0", "s0", 0, "e0", "x perturbed by 0.001 m", "ap", "right", 0.2, None),
                             ("A0", "s0", 0, "e0", "x perturbed by 1e-09 m", "convex", "right", 0.3, None),
                             ("A1", "s1", 1, "e1", "x", "ap", "typed", 0.4, None),
                             ("A1", "s1", 1, "e1", "y", "ap", "right", 0.5, None)])

    def test_of_two_verdicts_the_worse_one_is_that_of_both(self):
        order = ["right", "model", "typed", "engine", "wrong", "silent", "defect"]
        for better, worse in zip(order, order[1:]):
            for pair in ((better, worse), (worse, better)):
                self.assertEqual(stress.fold([self.cell(verdict=v, note="") for v in pair])["verdict"], worse)
        self.assertEqual(measures.BAD, ("wrong", "silent", "defect"))

    def test_an_ensemble_has_the_largest_of_each_number(self):
        cells = [
            self.cell(verdict="right", note="n", error=1, residual=5, energy_gain=-2, penetration=7, solve_s=0.1, iterations=3),
            self.cell(verdict="typed", note="n", error=None, residual=4, energy_gain=-1, penetration=8, solve_s=0.3,
                      iterations=2)]
        folded = stress.fold(cells)
        self.assertEqual({key: folded[key] for key in ("error", *stress.MEASURED)},
                         {"error": 1, "residual": 5, "energy_gain": -1, "penetration": 8, "solve_s": 0.3, "iterations": 3})


if __name__ == "__main__":
    unittest.main()
