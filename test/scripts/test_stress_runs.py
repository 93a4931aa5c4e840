"""scripts/stress.py: what it runs, what it takes from a run, and what it writes and ends with. On runs that are made up, each
field another number."""
import contextlib
import csv
import io
import math
import types
import unittest
from pathlib import Path
from unittest import mock

from contactbench import heatmap, measures, program, stress
from contactbench.stress import ROOT
from folder import Folder

LISTED = {
    "methods": [{"name": "newton", "solvers": [], "variants": ["uncapped", "stick-tested"], "options": []},
                {"name": "ap", "solvers": ["lemke", "path", "pgs"], "variants": [], "options": [{"flag": "k"}]},
                {"name": "convex", "solvers": ["ipm"], "variants": [],
                 "options": [{"flag": "epsilon-relative"}, {"flag": "compression-bound"}]}],
    "solvers": [{"method": method, "name": name, "unavailable": None}
                for method, name in (("ap", "lemke"), ("ap", "path"), (None, "bare"), ("convex", "ipm"))],
    "engines": [], "scenarios": [], "statuses": [{"name": "ok"}, {"name": "ray"}]}


def options(**more):
    usual = {
        "quick": False, "only": [], "method": [], "other_program": None, "member": 0, "program": "prog", "accuracy": 0.0,
        "time_limit": 7, "engines": False, "jobs": 1, "statuses": ["ok", "ray"], "scratch": None}
    return types.SimpleNamespace(**usual | more)


def ended(stdout="", stderr="", code=0):
    return types.SimpleNamespace(returncode=code, stdout=stdout, stderr=stderr)


class Plans(unittest.TestCase):
    def test_a_column_is_a_method_with_all_that_tells_it_from_others(self):
        self.assertEqual(list(stress.methods_of(LISTED)), [
            ("newton/uncapped", ["--method", "newton", "--variant", "uncapped"]),
            ("newton/stick-tested", ["--method", "newton", "--variant", "stick-tested"]),
            ("ap/lemke", ["--method", "ap", "--solver", "lemke"]), ("ap/path", ["--method", "ap", "--solver", "path"]),
            *((f"convex/bound-{on}", ["--method", "convex", "--compression-bound", on, "--epsilon-relative", "1e-14"])
              for on in ("on", "off"))])

    def test_a_row_s_parameters_and_flags_of_the_run_are_told_apart(self):
        row = {"boxes": 4, "--step": 1e-3, "mu": "1/2"}
        self.assertEqual(stress.row_text(row), "boxes=4 --step 0.001 mu=1/2")
        self.assertEqual(stress.row_flags(row), ["--set", "boxes=4", "--step", "0.001", "--set", "mu=1/2"])
        self.assertEqual(stress.row_text({}), "as it is")

    def test_a_scene_of_these_cases_comes_before_one_of_the_project(self):
        self.assertEqual(stress.scene_file("chain"), ROOT / "scenarios/stress/chain.xml")
        self.assertEqual(stress.scene_file("stack"), ROOT / "scenarios/stack.xml")

    def plan(self, *cases, columns=(("ap", ["--method", "ap"]), ("convex", ["--method", "convex"])), **of):
        return stress.plan({"case": list(cases)}, list(columns), options(**of))

    def test_an_ensemble_is_every_size_with_every_seed_and_quick_the_first_of_each(self):
        case = {"id": "W1", "rows": [{"a": 1}, {"a": 2}], "ensemble": 2, "perturb": [1e-9, 1e-3], "methods": ["ap"]}
        jobs = self.plan(case)
        self.assertEqual([(j["row"], j["first"], j["drawn"]) for j in jobs], [
            (row, row == "a=1", drawn) for row in ("a=1", "a=2") for drawn in ((1e-9, 1), (1e-9, 2), (1e-3, 1), (1e-3, 2))])
        self.assertEqual(jobs[3]["flags"], ["--method", "ap", "--set", "a=1", "--perturb", "0.001", "--seed", "2"])
        self.assertEqual([(j["row"], j["drawn"]) for j in self.plan(case, quick=True)], [("a=1", (1e-9, 1)), ("a=1", (1e-3, 1))])

    def test_quick_is_the_first_row_of_each_or_two_where_rows_are_compared(self):
        cases = [{"id": "A", "rows": [{"a": 1}, {"a": 2}, {"a": 3}]}, {
            "id": "B", "rows": [{"b": 1}, {"b": 2}, {"b": 3}], "measure": "same_as_first"}, {
                "id": "C", "rows": [{"c": 1}], "long": True}]
        of = lambda jobs: [(j["case"], j["row"]) for j in jobs if j["method"] == "ap"]
        self.assertEqual(of(self.plan(*cases, quick=True)), [(0, "a=1"), (1, "b=1"), (1, "b=2")])
        self.assertEqual(len(of(self.plan(*cases))), 7)
        self.assertEqual(of(self.plan(*cases, only=["B"])), [(1, "b=1"), (1, "b=2"), (1, "b=3")])

    def test_by_an_accuracy_no_run_has_a_step_and_what_is_about_steps_is_left_out(self):
        cases = [{"id": "A", "rows": [{"--step": 1e-3, "metre": 10.0}], "measure": "displacement", "other_program": True}, {
            "id": "B", "rows": [{}], "measure": "painleve"}, {"id": "C", "rows": [{}], "measure": "scene_error"}]
        jobs = self.plan(*cases, accuracy=1e-6, other_program="older")
        self.assertEqual([(j["case"], j["program"]) for j in jobs], [(0, "prog")] * 2)
        self.assertEqual(jobs[1]["flags"],
                         ["--method", "convex", "--set", "metre=10.0", "--accuracy", "1e-05", "--record-interval", "1e-3"])
        # No engine has the flag: that it is refused is no answer of the engine.
        columns = [("ode/quick", ["--engine", "ode", "--variant", "quick"]), ("ap", ["--method", "ap"])]
        case = {"id": "A", "rows": [{}], "measure": "displacement"}
        self.assertEqual([j["method"] for j in self.plan(case, columns=columns, accuracy=1e-6)], ["ap"])
        self.assertEqual([j["method"] for j in self.plan(case, columns=columns)], ["ode/quick", "ap"])

    def test_a_member_of_the_ensemble_starts_with_its_own_last_bits_where_a_row_has_none(self):
        cases = [{"id": "A", "rows": [{}, {"--shuffle-contacts": 5}]}, {
            "id": "B", "rows": [{}], "ensemble": 1, "perturb": [1e-3]}]
        flags = [j["flags"][2:] for j in self.plan(*cases, member=3) if j["method"] == "ap"]
        self.assertEqual(flags, [["--perturb", "1e-15", "--seed", "3", "--shuffle-contacts", "3"],
                                 ["--shuffle-contacts", "5", "--perturb", "1e-15", "--seed", "3"],
                                 ["--perturb", "0.001", "--seed", "1", "--shuffle-contacts", "3"]])


class Runs(Folder):
    case = {"scene": "chain", "measure": "displacement", "bound": 1e-9}
    summary = {
        "residuals": {"max": 1e-13, "false_claims": 2}, "energy": {"max_gain_relative": 3e-12}, "max_penetration": 4e-11,
        "time": {"solve_s": 0.5, "total_s": 9}, "iterations_total": 6, "peak_memory_mb": 70.0, "parameters": {}, "options": {
            "step": 1e-3}, "accuracy": {"estimated_error_m": 8e-6}}

    def run_one(self, status="ok", note="", hung=False, summary=None, x=3.0, of=None, case=None, **more):
        """The cell of a run of a body that moves by x m, and what the program was asked."""
        asked = []

        def watched(*words):
            asked.append(words)
            (Path(words[3]) / "trajectory.csv").write_text(f"t,body,px,py,pz\n0,box,0,0,0\n1,box,{x},4,0\n")
            return status, note, hung, self.summary if summary is None else summary

        job = {"flags": ["--method", "ap", "--set", "a=1"], "program": "older"} | (of or {})
        with mock.patch.object(program, "watched", watched):
            return stress.do_run(job, self.case | (case or {}), options(scratch=self.top, **more)), asked[0]

    def test_each_number_of_a_run_is_in_its_cell(self):
        cell, asked = self.run_one(accuracy=1e-6)
        self.assertEqual({key: value for key, value in cell.items() if value not in (None, False, "")}, {
            "status": "ok", "residual": 1e-13, "false_claims": 2, "energy_gain": 3e-12, "penetration": 4e-11, "solve_s": 0.5,
            "iterations": 6, "memory": 70.0, "wanted": 1e-6, "estimate": 8e-6, "error": 5.0,
            "command": "contactbench run scenarios/stress/chain.xml --method ap --set a=1"})
        self.assertEqual((*asked[:3], *asked[4:]), ("older", ROOT / "scenarios/stress/chain.xml", [
            "--method", "ap", "--set", "a=1", "--time-limit", "7"], ["ok", "ray"], 41, 4000))
        self.assertEqual(list(self.top.iterdir()), [])

    def test_a_case_may_have_a_limit_of_time_of_its_own(self):
        _, asked = self.run_one(case={"time_limit_s": 0.5})
        self.assertEqual((asked[2][-2:], asked[5]), (["--time-limit", "0.5"], 21.5))

    def test_an_estimate_is_in_metres_whatever_the_unit(self):
        cell, _ = self.run_one(summary=self.summary | {"parameters": {"metre": "1e3"}})
        self.assertAlmostEqual(cell["estimate"], 8e-9, delta=1e-20)
        self.assertEqual(self.run_one(summary={k: v for k, v in self.summary.items() if k != "accuracy"})[0]["estimate"], 0)

    def test_an_error_is_measured_where_a_run_ended_with_numbers(self):
        self.assertEqual(self.run_one("inaccurate", "why")[0]["note"], "why")
        self.assertEqual(self.run_one("inaccurate", "why")[0]["error"], 5.0)
        self.assertEqual(self.run_one("ok", "why")[0]["note"], "")
        self.assertEqual({k: self.run_one("ray", "why")[0][k] for k in ("error", "note", "residual")},
                         {"error": None, "note": "why", "residual": 1e-13})
        cell, _ = self.run_one(x="nan")
        self.assertEqual((cell["error"], cell["nan"]), (None, True))
        cell, _ = self.run_one("crash", "SIGSEGV", True, summary={})
        self.assertEqual((cell["status"], cell["note"], cell["hung"], cell["residual"]), ("crash", "SIGSEGV", True, None))
        self.assertFalse(cell["engine"])
        self.assertTrue(self.run_one(of={"flags": ["--engine", "ode"]})[0]["engine"])

    def test_a_place_is_no_error_before_it_is_compared(self):
        with mock.patch.object(measures, "displacement", lambda run, case: ([1.0, 2.0], "said")):
            cell, _ = self.run_one("inaccurate", "why")
        self.assertEqual((cell["place"], cell["error"], cell["note"]), ([1.0, 2.0], None, "said"))


class Table(Folder):
    def test_a_cell_of_the_page_says_its_verdict_and_by_how_much(self):
        cell = {"verdict": "right", "status": "ok", "error": 1.0, "share": None}
        self.assertEqual([
            stress.shown(c)
            for c in (None, cell, cell | {"share": 0.8}, cell | {"verdict": "typed", "status": "ray"},
                      cell | {"verdict": "model", "error": 0.012345}, cell | {"verdict": "wrong", "error": None, "status": "x"},
                      cell | {"verdict": "silent", "error": math.inf})],
                         ["", "right", "right, 80 %", "*ray*", "**model** 0.0123", "**wrong** x", "**silent** inf"])
        self.assertEqual([stress.number(x) for x in (None, 0.0012345, 7, "x")], ["", "0.00123", "7", "x"])

    def test_a_method_without_a_cell_of_a_row_leaves_it_empty(self):
        row = dict.fromkeys(stress.COLUMNS) | {"scene": "box", "expect": "rests", "verdict": "right", "status": "ok"}
        rows = [row | {"id": "A", "row": "a=1", "method": "ap"}, row | {"id": "A", "row": "a=2", "method": "convex"}]
        stress.write_tables(rows, self.top, {"git": "abc", "cpu": "some", "made": "today", "runs": 9})
        page = (self.top / "stress.md").read_text()
        self.assertIn("| A | box | a=1 | rests | right |  |\n", page)
        self.assertIn("| A | box | a=2 | rests |  | right |\n", page)
        self.assertIn("Program abc on some, today; 9 runs.", page)

    def test_the_manifest_says_what_made_it(self):
        file = self.top / "program"
        file.write_text("the program")
        with mock.patch.object(program, "call", lambda *_: ended("contactbench 1 (git 1234abc; x)")), \
                mock.patch.object(program, "cpu", lambda: "a CPU"), \
                mock.patch.object(stress.os, "getloadavg", lambda: (0.5, 1.5, 2.5)):
            made = stress.manifest_of(options(program=str(file), quick=True), 17)
        self.assertRegex(made.pop("made"), r"^\d{4}-\d\d-\d\d$")
        self.assertEqual(
            made, {
                "git": "1234abc", "program": program.digest(file), "cpu": "a CPU", "runs": 17, "quick": True, "time_limit_s": 7,
                "load_average": 0.5})


class Whole(Folder):
    cases = {
        "case": [{
            "id": "A", "scene": "chain", "rows": [{"a": 1}, {"a": 2}], "bound": 1e-9, "expect": "rests",
            "measure": "displacement"}], "problem": [{"id": "P", "kind": "lcp", "files": ["c"], "ends": ["solved", "ray"]}],
        "limit": [{"id": "L", "scene": "chain", "rows": [{"l": 1}, {"l": 2}], "expect": "x", "bound": 1}], "critical": [{
            "id": "S", "scene": "arch", "expect": "x", "bound": 1}], "departs": {"newton": "one by one"}}

    def all(self, **of):
        """Rows of made-up cells: error n of the nth run; of others who made them."""
        number = iter(range(99))

        def do_run(job, case, _):
            return stress.BLANK | {
                "status": "ok", "residual": 0.0, "error": next(number) * 1e-10, "note": f"{job['method']} {job['row']}"}

        def do_problem(job, _):
            return stress.BLANK | {"verdict": "typed", "note": job["method"]}

        with mock.patch.object(program, "listed", lambda _: LISTED), mock.patch.object(stress, "do_run", do_run), \
                mock.patch.object(stress, "do_problem", do_problem), \
                mock.patch.object(stress, "do_limit", lambda row, case, _: {"id": "L", "row": stress.row_text(row)}), \
                mock.patch.object(stress, "do_critical", lambda case, column, _: {"id": "S", "method": column[0]}):
            return stress.run_all(self.cases, options(**of))

    def test_all_runs_solves_and_searches_are_rows_of_their_own(self):
        columns = [name for name, _ in stress.methods_of(LISTED)]
        rows, count = self.all()
        self.assertEqual(count, 12 + 3)
        self.assertEqual([(r["note"], r["row"], r["method"]) for r in rows[:12]],
                         [(f"{c} {row}", row, c) for row in ("a=1", "a=2") for c in columns])
        self.assertEqual([r["verdict"] for r in rows[9:12]], ["right", "right", "wrong"])  # of 9e-10, 10e-10 and 11e-10 m
        self.assertEqual([{k: r[k] for k in ("id", "scene", "row", "method", "expect", "note", "verdict")} for r in rows[12:15]],
                         [{
                             "id": "P", "scene": "c", "row": "stored problem", "method": f"ap/{s}", "expect": "ends: solved, ray",
                             "note": f"ap/{s}", "verdict": "typed"} for s in ("lemke", "path", "bare")])
        self.assertEqual(rows[15:],
                         [{"id": "L", "row": "l=1"}, {"id": "L", "row": "l=2"}, *({"id": "S", "method": c} for c in columns)])

    def test_methods_and_cases_run_alone_and_quick_ones_where_they_are_asked_for(self):
        of = lambda rows: [(r["id"], r.get("method", r["row"] if "row" in r else "")) for r in rows]
        rows, count = self.all(method=["ap/path"])
        self.assertEqual((of(rows), count), ([("A", "ap/path")] * 2 + [("P", "ap/path"), ("L", "l=1"), ("L", "l=2"),
                                                                       ("S", "ap/path")], 3))
        self.assertEqual({r["id"] for r in self.all(only=["P", "L"])[0]}, {"P", "L"})
        rows, _ = self.all(quick=True, method=["ap/path"])
        self.assertEqual(of(rows), [("A", "ap/path"), ("P", "ap/path"), ("L", "l=1")])
        self.assertEqual({r["id"] for r in self.all(accuracy=1e-6)[0]}, {"A"})

    def main(self, verdicts, *words):
        """What it prints and ends with where cells come to these verdicts."""
        rows = [
            stress.BLANK | {
                "id": "A", "scene": "box", "row": "a=1", "method": f"m{n}", "verdict": v, "status": "ok", "error": 0.5,
                "bound": 1e-9, "residual": 2e-12, "note": "why"} for n, v in enumerate(verdicts)]
        with mock.patch("sys.argv", ["stress.py", "--program", "prog", "--out", str(self.top / "out"), *words]), \
                mock.patch.object(stress, "run_all", lambda *_: (rows, 42)), mock.patch.object(heatmap, "draw") as draw, \
                mock.patch.object(stress, "manifest_of", lambda *_: {"git": "", "cpu": "", "made": "", "runs": 42}), \
                mock.patch.dict(stress.DEPARTS), contextlib.redirect_stdout(io.StringIO()) as said:
            code = stress.main()
        return code, said.getvalue().splitlines(), draw.called

    def test_settings_are_those_that_are_given_and_else_the_usual_ones(self):
        asked = []

        def run_all(cases, options):
            asked.append((cases, options))
            return [], 0

        for words in ([], [
                "--jobs", "3", "--engines", "--time-limit", "2.5", "--member", "4", "--accuracy", "1e-6", "--quick", "--only",
                "A", "--method", "m", "--method", "n", "--other-program", "x"]):
            with mock.patch("sys.argv", ["stress.py", "--program", "prog", "--only", "B", *words]), \
                    mock.patch.object(stress, "run_all", run_all), \
                    mock.patch.dict(stress.DEPARTS), contextlib.redirect_stdout(io.StringIO()):
                stress.main()
                self.assertEqual(stress.DEPARTS, asked[0][0]["departs"])
        names = ("jobs", "engines", "time_limit", "member", "accuracy", "quick", "only", "method", "seed", "first", "program",
                 "other_program")
        here = Path.cwd().resolve()
        self.assertEqual([[getattr(options, name) for name in names] for _, options in asked], [[
            1, False, 15, 0, 0.0, False, ["B"], [], 1, 0, str(here / "prog"), None
        ], [3, True, 2.5, 4, 1e-6, True, ["B", "A"], ["m", "n"], 1, 0,
            str(here / "prog"), str(here / "x")]])
        self.assertEqual(asked[0][0]["case"][0]["id"], "M1")  # of scenarios/stress/cases.toml

    def test_engines_run_beside_the_methods_where_they_are_asked_for(self):
        ode = {"name": "ode", "unavailable": None, "variants": [{"name": "quick"}]}
        with mock.patch.dict(LISTED, engines=[ode]):
            self.assertNotIn("ode/quick", {row["method"] for row in self.all()[0] if "method" in row})
            rows, _ = self.all(engines=True, method=["ode/quick"])
        self.assertEqual([(row["id"], row["method"]) for row in rows if "method" in row], [("A", "ode/quick")] * 2)

    def test_how_long_the_rest_takes_is_said_every_fifty_runs(self):
        with program.workers(1) as pool, mock.patch.object(stress.time, "monotonic", side_effect=[10.0, 20.0, 35.0]), \
                contextlib.redirect_stderr(io.StringIO()) as said:
            self.assertEqual(stress.results([pool.submit(lambda n=n: n) for n in range(120)]), list(range(120)))
        self.assertEqual(said.getvalue(), "50 of 120, 14 s left\n100 of 120, 5 s left\n")

    def test_the_end_is_bad_where_a_cell_is_and_only_such_cells_are_printed(self):
        code, said, _ = self.main(["right", "model", "typed", "engine"])
        self.assertEqual((code, len(said)), (0, 1))
        self.assertRegex(said[0],
                         r"^4 cells: 1 right, 1 model, 1 typed, 1 engine, 0 wrong, 0 silent, 0 defect; 42 runs in \d+ s$")
        for bad in ("wrong", "silent", "defect"):
            code, said, _ = self.main(["right", bad])
            self.assertEqual(code, 3)
            self.assertEqual(said[0], f"{bad:6} A    box [a=1] m1: ok, error 0.5 (bound 1e-09), residual 2e-12; why")
        self.assertEqual(len(self.main(["right", "typed"], "--only", "A")[1]), 3)

    def test_rows_of_a_method_take_their_places_in_a_table_that_is_there(self):
        for words, why in ((["--method", "m0"], "has no stress.csv"), ([], "--in-place goes with --method"),
                           *((["--method", "m0", *more], "and without --only, --accuracy and --random")
                             for more in (["--only", "A"], ["--accuracy", "1e-6"], ["--random", "1"]))):
            with contextlib.redirect_stderr(io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
                self.main(["right"], "--in-place", *words)
            self.assertEqual(ended.exception.code, 2)
            self.assertIn(why, said.getvalue())
        self.main(["right", "typed", "wrong"])
        # The end is that of the whole table.
        code, said, drawn = self.main(["model"], "--in-place", "--method", "m0")
        self.assertEqual((code, drawn, said[-1].partition(":")[0]), (3, True, "1 cells"))
        with open(self.top / "out/stress.csv", newline="") as file:
            self.assertEqual([(r["method"], r["verdict"]) for r in csv.DictReader(file)], [("m0", "model"), ("m1", "typed"),
                                                                                           ("m2", "wrong")])

    def test_a_table_is_written_of_all_and_of_nothing_less(self):
        for words in (["--only", "A"], ["--method", "m0"], ["--accuracy", "1e-6"]):
            self.assertFalse(self.main(["right"], *words)[2])
            self.assertFalse((self.top / "out").exists(), words)
        self.assertFalse(self.main(["right"], "--member", "2")[2])
        self.assertTrue((self.top / "out/stress.md").exists())
        self.assertTrue(self.main(["right", "typed"])[2])
        with open(self.top / "out/stress.csv", newline="") as file:
            self.assertEqual([(r["method"], r["verdict"]) for r in csv.DictReader(file)], [("m0", "right"), ("m1", "typed")])


if __name__ == "__main__":
    unittest.main()
