"""scripts/contactbench/engines.py and what sweeps know of engines: rows asked for, knobs searched, lines that fail."""
import contextlib
import csv
import dataclasses
import io
import math
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from contactbench import engines, findings, isolated, plan, program, replay  # noqa: E402
from contactbench.runs import write_table  # noqa: E402

LISTED = {
    "methods": [{"name": "ap", "solvers": ["lemke"], "variants": [], "options": [{"flag": "k"}]}],
    "solvers": [{"method": "ap", "name": "lemke", "unavailable": None}], "scenarios": [{
        "name": "stack.xml", "file": "stack.xml", "parameters": {}}], "statuses": [], "engines": [
            {"name": "ode", "unavailable": None, "variants": [{"name": "quick"}, {"name": "world"}]},
            {"name": "dart", "unavailable": "not installed"}]}


def planned(text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "some.toml"
        path.write_text(text)
        return plan.plan([path], "", LISTED)[0]


class Sweeps(unittest.TestCase):
    def test_engines_run_where_they_are_asked_for_and_nowhere_else(self):
        self.assertEqual({r.method for r in planned('[[runs]]\nscene = "stack"\n')}, {"ap"})
        runs = planned('setting = ["default", "tuned"]\nk = 4\n[[runs]]\nscene = "stack"\nengines = ["all"]\n')
        asked = {" ".join(r.flags()) for r in runs}
        self.assertEqual(
            asked, {
                "--method ap --solver lemke --k 4", "--engine ode --variant quick --setting default",
                "--engine ode --variant quick --setting tuned", "--engine ode --variant world --setting default",
                "--engine ode --variant world --setting tuned", "--engine dart"})
        one = planned('[[runs]]\nscene = "stack"\nmethods = ["ap"]\nengines = ["ode/world"]\n')
        self.assertEqual([r.variant for r in one if r.engine], ["world"])

    def test_a_row_of_the_table_gives_its_run_back(self):
        for run in planned('[[runs]]\nscene = "stack"\nengines = ["ode"]\nstep = "1e-3"\n'):
            again = plan.Run.of({k: str(v) for k, v in run.asked().items()})
            self.assertEqual(again.flags(), run.flags())
            self.assertEqual(dataclasses.replace(run, repeat=2).cell, again.cell)


class Search(unittest.TestCase):
    def test_finds_the_best_of_separable_knobs_and_keeps_its_tries(self):
        def errors(path, engine, variant, knobs, of):
            return [abs(knobs.get("a", 0) - 2) + abs(knobs.get("b", 5) - 1)]

        of = {"tries": 20, "ode": {"a": [0, 1, 2, 3], "b": [5, 1], "none": [7]}}
        with mock.patch.object(engines, "errors_of", errors):
            found = engines.search("", "ode", "quick", {"a": 0, "b": 5}, of)
            self.assertEqual((found["knobs"], found["score"], found["default_score"]), ({"a": 2.0, "b": 1.0}, 0, 6))
            few = engines.search("", "ode", "quick", {"a": 0, "b": 5}, of | {"tries": 3})
        self.assertEqual((few["tries"], few["knobs"]), (3, {"a": 2.0}))

    def test_every_knob_that_is_searched_has_the_default_among_its_values(self):
        listed = program.listed(program.DEFAULT) if Path(program.DEFAULT).exists() else {"engines": []}
        with open(engines.HERE / "tuning.toml", "rb") as file:
            of = engines.tomllib.load(file)
        for engine in engines.available({"engines": listed.get("engines", [])}):
            knobs = {k["name"]: k["default"] for k in engine["knobs"]}
            for name, some in of.get(engine["name"], {}).items():
                self.assertIn(name, knobs)
                self.assertIn(knobs[name], some)


class Findings(unittest.TestCase):
    def of(self, says):
        return next(f for f in findings.FINDINGS if f.says.startswith(says))

    def test_each_comes_out_by_its_numbers_and_is_contradicted_by_others(self):
        some = [("the friction pyramid of ode (quick)", (1.0, 0.0), (1.0, 0.7)), ("MuJoCo at its defaults", (3.86e-3, 3.82e-3), (9.5e-3, 9.5e-3)),
                ("that creep", (1.9e-3, 1.9e-3, 1.9e-3), (4e-3, 2e-3, 1e-3)), ("MuJoCo rebounds", (0.39, ), (1e-9, )),
                ("ODE's direct", (1e-9, 1e-5, 0.02, 3.0, math.inf), (1e-9, 1e-5, 1e-4, 1e-4, 1e-4)),
                ("sequential", (1e-5, 3e-4, 0.05, 0.2, 3.0), (1e-5, ) * 5)]
        for says, again, otherwise in some:
            finding = self.of(says)
            self.assertEqual(len(again), len(finding.cases))
            self.assertTrue(finding.comes_out(*again), says)
            self.assertFalse(finding.comes_out(*otherwise), says)

    def test_an_engine_that_is_not_here_is_said_to_be_so(self):
        row = findings.outcome("", self.of("the friction pyramid of dart"), LISTED)
        self.assertEqual((row["comes_out"], row["unavailable"]), (None, "not installed"))
        self.assertIn("not measured", findings.said(row))

    def test_a_run_that_does_not_finish_has_no_number(self):
        ended = mock.Mock(stdout='{"finished": false, "status": "crash"}', stderr="")
        finding = self.of("ODE's direct")
        with mock.patch.object(program, "call", return_value=ended):
            row = findings.outcome("", finding, LISTED)
        self.assertEqual({(r["number"], r["status"]) for r in row["runs"]}, {(None, "crash")})
        self.assertFalse(row["comes_out"])

    def test_runs_that_crash_or_hang_confirm_nothing_but_what_says_that_they_do(self):
        crash = mock.Mock(stdout="", stderr="", returncode=-11)
        hang = program.Late("contactbench", 1)
        for end, said in ((crash, "exit code -11"), (hang, "did not come back")):
            for finding in findings.FINDINGS:
                with mock.patch.object(program, "call", side_effect=[end] * len(finding.cases)):
                    row = findings.outcome("", finding, {"engines": [{"name": finding.engine, "unavailable": None}]})
                self.assertEqual({r["status"] for r in row["runs"]}, {said})
                self.assertIs(row["comes_out"], False if finding.lost else None, finding.says)
                self.assertIn("contradicted" if finding.lost else "not measured (a run has no number)", findings.said(row))
        self.assertEqual([f.engine for f in findings.FINDINGS if f.lost], ["ode", "bullet"])
        # A run to the end whose number is missing is none either.
        ended = mock.Mock(stdout='{"finished": true, "status": "ok", "errors": {}}', stderr="")
        with mock.patch.object(program, "call", return_value=ended):
            row = findings.outcome("", self.of("that creep"), {"engines": [{"name": "mujoco", "unavailable": None}]})
        self.assertIsNone(row["comes_out"])


class Faults(unittest.TestCase):
    """A program that dies or hangs is a row or a message, and ends no command."""

    ends = (mock.Mock(stdout="", stderr="abort\n", returncode=-6), program.Late("contactbench", 1))

    def test_a_preflight_that_does_not_end_is_a_fault_of_each_variant(self):
        for end, fault in zip(self.ends, ("abort", "did not come back")):
            with mock.patch.object(program, "call", side_effect=[end, end]), mock.patch.object(engines, "tuned", dict):
                rows = engines.preflight("", {"engines": [LISTED["engines"][0] | {"version": "1", "precision": "double"}]})
            self.assertEqual([(r["variant"], r["setting"], engines.failing(r)) for r in rows],
                             [("quick", "default", [fault]), ("world", "default", [fault])])

    def test_an_engine_without_a_problem_is_left_out(self):
        for end, fault in zip(self.ends, ("abort", "did not come back")):
            with tempfile.TemporaryDirectory() as folder, mock.patch.object(program, "call", side_effect=[end]), \
                    contextlib.redirect_stderr(io.StringIO()) as said:
                self.assertIsNone(isolated.own_problem("", "stack", [], 0.5, "dart", "dantzig", Path(folder)))
            self.assertIn(fault, said.getvalue())

    def test_a_stream_whose_run_does_not_finish_is_left_out_with_what_an_earlier_one_left(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("sliding_box", "grasp"):
                (Path(folder) / name).mkdir()
            with mock.patch.object(sys, "argv", ["replay.py", "--out", folder, "--only", "sliding_box"]), \
                    mock.patch.object(program, "call", return_value=self.ends[0]), \
                    contextlib.redirect_stderr(io.StringIO()) as said:
                self.assertFalse(replay.main())
            self.assertEqual([path.name for path in Path(folder).iterdir()], ["grasp"])
        self.assertIn("sliding_box is left out: abort", said.getvalue())

    def test_the_table_of_what_is_left_out_is_of_this_program_or_not_there(self):
        lines = (program.ROOT / "scripts/reproduce.sh").read_text().splitlines()
        self.assertLess(lines.index('rm -f "$out/left_out.csv"'), next(n for n, line in enumerate(lines) if "bench_prune >" in line))


class Report(unittest.TestCase):
    def test_lines_that_fail_are_named_with_their_numbers(self):
        lines = [{"name": "gravity", "passed": True, "measured": 9.8, "expected": 9.8, "note": ""},
                 {"name": "restitution of 0", "passed": False, "measured": 0.149196, "expected": 0.0, "note": ""},
                 {"name": "restitution of 0.5", "passed": False, "unsupported": True, "measured": None, "note": "none"}]
        self.assertEqual(
            engines.failing({"fault": None, "lines": lines}),
            ["restitution of 0: 0.149196, not 0", "restitution of 0.5: none"])
        self.assertEqual(engines.failing({"fault": "crash: signal 11", "lines": []}), ["crash: signal 11"])
        lines = [{"name": "spin kept", "passed": False, "measured": 1 + 2.5e-9, "expected": 1.0, "note": ""}]
        self.assertEqual(engines.failing({"fault": None, "lines": lines}), ["spin kept: 1 but for 2.5e-09"])

    def test_an_engine_s_answer_stands_beside_those_of_our_methods_on_its_problem(self):
        def row(by, residual, status="ok", **more):
            return dict.fromkeys(isolated.COLUMNS, "") | {"file": "a.hdf5", "by": by, "law_residual": residual, "status": status} | more

        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(isolated.own_answers(folder), [])
            write_table([row("siconos", 1e-6, "", contacts=4, momentum_error=1e-16), row("mirtich", 0.3), row("coulomb newton", 1e-15),
                         row("ap lemke", 0.5, "inaccurate"), row("siconos", 2e-6, "", file="b.hdf5")],
                        isolated.COLUMNS, Path(folder) / "own_problems.csv")
            first, second = isolated.own_answers(folder)
        self.assertEqual((first["contacts"], first["law_residual"], first["momentum_error"], first["own_residual"]), ("4", 1e-6, 1e-16, None))
        ours = dict(zip(isolated.BESIDE, first["ours"]))
        self.assertEqual((ours["mirtich"], ours["coulomb newton"], ours["ap lemke"], ours["soft sap"]), (0.3, 1e-15, None, None))
        self.assertEqual((second["law_residual"], set(second["ours"])), (2e-6, {None}))

    def test_the_table_of_an_engine_s_own_problems_has_each_number_under_its_head(self):
        row = dict.fromkeys(isolated.COLUMNS, "") | {
            "file": "a.hdf5", "by": "ode quick", "t": "0.5", "contacts": "4", "largest_compliance_per_kg": "7e-7", "law_residual": "1e-1",
            "law_residual_without_offset": "2e-2", "own_residual": "3e-3", "momentum_error": "4e-4", "velocity_error": "5e-5",
            "time_min_s": "6e-6", "status": "ok"}
        *_, heads, _, cells, _ = isolated.own_markdown([row]).split("\n")
        found = dict(zip(*([x.strip() for x in line.strip("|").split("|")] for line in (heads, cells))))
        self.assertEqual(found, {"by": "ode quick", "Coulomb": "1.0e-01", "without offset": "2.0e-02", "its own model": "3.0e-03",
                                 "momentum": "4.0e-04", "velocity, m/s": "5.0e-05", "time, us": "6.0", "status": "ok"})
        self.assertIn("4 contacts, t = 0.5 s, largest compliance 7.0e-07 1/kg", isolated.own_markdown([row]))

    def test_a_cheap_wrong_answer_is_on_no_front(self):
        def row(who, error, time, engine="ode"):
            return {"scene": "stack", "parameters": "", "who": who, "engine": engine, "error": error, "worst": error, "time": time}

        front = engines.fronts([row("lost", 50.0, 1), row("quick", 1e-3, 2), row("ours", 1e-9, 3, ""), row("slow", 1e-3, 4),
                                row("died", None, None)])
        self.assertEqual([r["who"] for r in front["stack", ""]], ["quick", "ours"])

    def test_a_step_of_an_engine_is_timed_in_microseconds(self):
        def cell(finished, steps="2000"):
            keys = ("engine", "variant", "setting", "precision", "knobs", "step", "status", "reason")
            return mock.MagicMock(finished=finished, seconds=0.5, unrepeated="run", busy=False, error=lambda _: 1e-3,
                                  __getitem__=lambda _, key: steps if key == "steps" else "x" if key in keys else "")

        results = mock.Mock(cells=lambda scene="", sweep="", **_: [cell(True), cell(False), cell(True, "0")] if scene and sweep
                            else [{"scene": "stack", "parameters": ""}])
        with mock.patch.object(engines.precision, "measure", return_value="position_linf_m"):
            made = engines.rows(results)
        self.assertEqual([row["us_a_step"] for row in made], [250, None, None])
        self.assertEqual([row["time"] for row in made], [0.5, None, 0.5])
        self.assertEqual([row["error"] for row in made], [1e-3, None, 1e-3])

    def test_drift_is_the_furthest_way_of_any_body(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(Path(folder) / "trajectory.csv", "w", newline="") as file:
                table = csv.writer(file)
                table.writerow("t,body,px,py,pz".split(","))
                table.writerows([(0, "a", 0, 0, 0), (0, "b", 1, 0, 0), (1, "a", 0, 3, 4), (1, "b", 1, 0, 1)])

            class Cell:
                pass

            cell = Cell()
            cell.folder = Path(folder)
            self.assertEqual(engines.drift(cell), 5)


if __name__ == "__main__":
    unittest.main()
