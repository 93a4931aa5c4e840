"""scripts/contactbench/engines.py and what sweeps know of engines: rows asked for, knobs searched, lines that fail, the page; and
what findings, streams and engines' own problems make of runs that die."""
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

import made
from contactbench import engines, findings, isolated, plan, program, replay
from contactbench.runs import write_table
from folder import Folder

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
        ends = [mock.Mock(stdout="", stderr=text, returncode=-6) for text in ("a banner\nabort\n", "")]
        for end, fault in zip((*ends, self.ends[1]), ("abort", "exit code -6, without a word", "did not come back")):
            with mock.patch.object(program, "call", side_effect=[end, end]), mock.patch.object(engines, "tuned", dict):
                rows = engines.preflight("", {"engines": [LISTED["engines"][0] | {"version": "1", "precision": "double"}]})
            self.assertEqual([(r["variant"], r["setting"], engines.failing(r)) for r in rows],
                             [("quick", "default", [fault]), ("world", "default", [fault])])

    def test_an_engine_without_a_problem_is_left_out(self):
        for end, fault in zip(self.ends, ("abort", "did not come back")):
            with tempfile.TemporaryDirectory() as folder, mock.patch.object(program, "call", side_effect=[end]), \
                    contextlib.redirect_stderr(io.StringIO()) as said:
                if end is self.ends[1]:  # what was kept by then is not the problem at the end
                    made.write_files(Path(folder) / "problems", {"step_000003.hdf5": "", "step_000003.json": "{}"})
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

    def test_a_stream_that_is_left_out_stops_no_other(self):
        faults = iter(["", "why", "", "", ""])
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(sys, "argv", ["replay.py", "--out", folder]), \
                mock.patch.object(replay, "store", lambda *_: next(faults)), \
                mock.patch.object(replay.solve_all, "main") as solved, \
                contextlib.redirect_stderr(io.StringIO()) as said:
            self.assertFalse(replay.main())
        self.assertEqual([Path(call.args[0][-1]).name for call in solved.call_args_list],
                         ["sliding_box", "stack__boxes-4", "mobile_robot", "grasp"])
        self.assertEqual(said.getvalue(), "replay: circular_sliding is left out: why\n")

    def test_a_stream_is_stored_of_a_run_of_the_convex_method_and_solved_into_a_folder_named_by_its_scene(self):
        asked, solved = [], []

        def call(*words):
            asked.append([str(w) for w in words])
            return mock.Mock(returncode=0)

        with tempfile.TemporaryDirectory() as folder, mock.patch.object(program, "call", call), \
                mock.patch.object(replay.solve_all, "main", solved.append):
            words = ["replay.py", "--program", "prog", "--out", folder, "--limit", "3", "--only", "stack", "--member", "2"]
            with mock.patch.object(sys, "argv", words):
                replay.main()
        (command, ), ((problems, *flags), ) = asked, solved
        self.assertEqual(command, [
            "prog", "run", "stack.xml", "--method", "convex", "--epsilon", "1e-12", "--step", "0.001", "--duration", "1", "--prune", "off",
            "--record-every", "0", "--save-problems", problems, "--save-every", "125", "--out", str(Path(problems).with_name("run")),
            "--quiet", "--set", "boxes=4", "--perturb", "1e-15", "--seed", "2", "--shuffle-contacts", "2"])
        self.assertEqual(flags, ["--program", "prog", "--limit", "3.0", "--out", f"{folder}/stack__boxes-4"])
        # Eight problems of each: so many steps of a millisecond over so many between two of them.
        for scene, _, duration, every in replay.STREAMS:
            self.assertEqual(duration / replay.STEP / every, 8, scene)

    def test_a_run_that_fails_without_a_word_is_said_to_be_unfinished(self):
        for stderr, said in (("why\n", "why"), ("", "the run did not finish")):
            with mock.patch.object(program, "call", return_value=mock.Mock(returncode=3, stderr=stderr)):
                self.assertEqual(replay.store("prog", "grasp", (), 1, 125, Path("/nowhere/problems"), 0), said)

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
        self.assertIn("largest compliance 0.0e+00 1/kg", isolated.own_markdown([{**row, "largest_compliance_per_kg": 0.0}]))

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


class Tuning(unittest.TestCase):
    of = {
        "step": 0.002, "time_limit_s": 9, "scenes": [{"scene": "stack", "set": {"boxes": 4, "mu": 0.5}, "duration": 0.75}, {
            "scene": "sliding_box"}]}

    def errors(self, *summaries, knobs=None):
        asked, ends = [], iter(summaries)

        def call(*words):
            asked.append([str(w) for w in words])
            said = next(ends)
            return mock.Mock(stdout=said if isinstance(said, str) else program.json.dumps(said), stderr="no such\n")

        with mock.patch.object(program, "call", call):
            return engines.errors_of("prog", "ode", "quick", knobs or {}, self.of), asked

    def test_each_scene_is_run_with_the_knobs_and_counts_by_the_power_of_ten_of_its_error(self):
        def ran(finished=True, **errors):
            return {"finished": finished, "errors": errors}

        errors, asked = self.errors(ran(position_linf_m=1e-3), ran(displacement_linf_m=1e-5), knobs={"erp": 0.1, "cfm": 1e-9})
        self.assertEqual(errors, [-3, -5])
        usual = ["--engine", "ode", "--variant", "quick", "--step", "0.002", "--json"]
        knobs = [
            "--knob", "erp=0.10000000000000001", "--knob", "cfm=1.0000000000000001e-09", "--time-limit", "9", "--record-every",
            "0"]
        self.assertEqual(
            asked[0][:-1],
            ["prog", "run", "stack", *usual, "--duration", "0.75", *knobs, "--set", "boxes=4", "--set", "mu=0.5", "--out"])
        self.assertEqual(asked[1][:-1], ["prog", "run", "sliding_box", *usual, *knobs, "--out"])
        # The first of the measures that stand for a scene; below a nanometre all is alike, and above a kilometre all is lost.
        self.assertEqual(
            self.errors(ran(creep_linf_m=1e-1, position_linf_m=1e-2), ran(position_linf_m=1e-12))[0], [-2, engines.LEAST])
        self.assertEqual(self.errors(ran(position_linf_m=0.0), ran(position_linf_m=1e7))[0], [engines.LEAST, engines.FAILED])
        self.assertEqual(self.errors(ran(False, position_linf_m=1e-3), ran())[0], [engines.FAILED] * 2)
        with self.assertRaisesRegex(program.ProgramError, "ode/quick: no such"):
            self.errors("")

    def test_a_search_goes_on_from_the_best_until_nothing_is_better_by_more_than_a_thousandth(self):
        tried = []

        def errors(path, engine, variant, knobs, of):
            tried.append((path, engine, variant, knobs))
            # b is worth something only once a is 2; a of 3 is better by less than counts.
            a, b = knobs.get("a", 1), knobs.get("b", 7)
            return [{1: 5, 2: 4, 3: 3.9995}[a] - (b == 8 and a == 2), {1: 5, 2: 4, 3: 3.9995}[a]]

        with mock.patch.object(engines, "errors_of", errors):
            found = engines.search("prog", "ode", "quick", {"b": 7, "a": 1}, {"tries": 99, "ode": {"b": [7, 8], "a": [1, 2, 3]}})
        self.assertEqual(found, {"knobs": {"a": 2.0, "b": 8.0}, "tries": len(tried), "score": 3.5, "default_score": 5})
        self.assertEqual(tried[0], ("prog", "ode", "quick", {}))
        # b alone, both others of a; b beside the a that was found, the first and the last of a; and b once more.
        self.assertEqual([of[3] for of in tried[1:]], [{"b": 8}, {"a": 2}, {"a": 3}, {"a": 2, "b": 8}, {"a": 1, "b": 8}, {
            "a": 3, "b": 8}, {"a": 2, "b": 7}, {"a": 1, "b": 8}, {"a": 3, "b": 8}])

    def test_what_is_found_is_kept_beside_what_is_known_of_others(self):
        listed = {
            "engines": [{
                "name": name, "unavailable": why, "variants": [{"name": v, "knobs": {"a": n}} for n, v in enumerate(variants)]}
                        for name, why, variants in (("ode", None, ("quick", "world")), ("dart", None, ("pgs", )),
                                                    ("mujoco", "not here", ("newton", )), ("none", None, ("x", )))]}
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "tuning.toml").write_text("tries = 3\n[ode]\na = [1]\n[dart]\na = [1]\n[mujoco]\na = [1]\n")
            (Path(folder) / "tuned.json").write_text('{"dart/pgs": "before", "bullet/si": "kept"}')
            search = lambda path, name, variant, knobs, of: [path, name, variant, knobs, of["tries"]]
            for wanted, dart in ((["ode", "mujoco", "none"], "before"), ([], ["prog", "dart", "pgs", {"a": 0}, 3])):
                with mock.patch.object(engines, "HERE", Path(folder)), mock.patch.object(engines, "search", search), \
                        contextlib.redirect_stdout(io.StringIO()):
                    engines.tune("prog", listed, wanted)
                    self.assertEqual(
                        engines.tuned(), {
                            "bullet/si": "kept", "dart/pgs": dart, "ode/quick": ["prog", "ode", "quick", {"a": 0}, 3],
                            "ode/world": ["prog", "ode", "world", {"a": 1}, 3]})
                    self.assertTrue(engines.known("ode", "quick") and not engines.known("ode", "slow"))


class Preflight(unittest.TestCase):
    listed = {
        "engines": [{
            "name": "ode", "unavailable": None, "version": "0.16", "precision": "double", "variants": [{"name": "quick"}, {
                "name": "world"}]}, {"name": "dart", "unavailable": "not installed"}]}

    def test_every_variant_is_checked_as_it_is_and_tuned_where_somebody_searched(self):
        asked = []

        def call(*words, timeout):
            asked.append((words, timeout))
            setting = words[5]
            return mock.Mock(
                stderr="", returncode=0, stdout=program.json.dumps([
                    {"engine": "ode", "variant": v, "setting": setting, "fault": None, "lines": []} for v in ("quick", "world")]))

        with mock.patch.object(program, "call", call), mock.patch.object(engines, "tuned", lambda: {"ode/world": {}}):
            rows = engines.preflight("prog", self.listed)
        self.assertEqual([
            (r["engine"], r["variant"], r.get("setting"), r.get("version"), r.get("precision"), r["fault"]) for r in rows], [
                *(("ode", variant, setting, "0.16", "double", None)
                  for variant, setting in (("quick", "default"), ("world", "default"), ("world", "tuned"))),
                ("dart", "", None, None, None, "unavailable: not installed")])
        self.assertIn((("prog", "check", "--engine", "ode", "--setting", "tuned", "--json"), 900), asked)
        asked.clear()
        with mock.patch.object(program, "call", call), mock.patch.object(engines, "tuned", lambda: {"ode/world": {}}):
            engines.preflight("prog", self.listed, ["default"])
        self.assertEqual([words[5] for words, _ in asked], ["default"])

    def test_a_line_without_a_number_says_so(self):
        line = {"name": "gravity", "passed": False, "measured": None, "expected": 9.8, "note": "x"}
        self.assertEqual(engines.failing({"fault": None, "lines": [line]}), ["gravity: no number"])

    def test_the_command_writes_the_rows_and_says_what_fails(self):
        rows = [{"engine": "ode", "variant": "quick", "setting": "tuned", "fault": None, "lines": []}, {
            "engine": "dart", "variant": "", "fault": "unavailable: x", "lines": []}]
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(program, "listed", lambda _: {}), \
                mock.patch.object(engines, "preflight", return_value=rows) as asked, contextlib.redirect_stdout(io.StringIO()) as said:
            with mock.patch.object(sys, "argv", ["engines.py", "preflight", "--out", f"{folder}/new"]):
                engines.main()
            self.assertEqual(asked.call_args.args[2], engines.SETTINGS)
            self.assertEqual(program.read_json(Path(folder) / "new/preflight.json"), rows)
        self.assertEqual(said.getvalue(), "ode quick tuned: all lines hold\ndart: unavailable: x\n")

    def test_a_search_is_of_the_engines_that_are_named_and_findings_go_where_they_are_told(self):
        with mock.patch.object(program, "listed", lambda _: {"engines": []}), mock.patch.object(engines, "tune") as tune, \
                mock.patch.object(findings, "write") as write, mock.patch.object(engines, "preflight", self.fail):
            for words in (["tune", "--engine", "ode", "--engine", "dart"], ["findings", "--out", "there"]):
                with mock.patch.object(sys, "argv", ["engines.py", *words, "--program", "prog"]):
                    engines.main()
        self.assertEqual((tune.call_args_list, write.call_args_list),
                         ([mock.call("prog", {"engines": []}, ["ode", "dart"])], [mock.call("prog", {"engines": []}, Path("there"))]))


class Page(Folder):
    """What the report says of a sweep of engines."""
    def said(self, *rows, **files):
        usual = {"sweeps": "engines", "scene": "sliding_box", "solver": "", "k": "", "duration": "1", "steps": "100"}
        world = made.results(self.top, [{}])
        self.assertIsNone(engines.said(world))
        made.results(self.top / "engines", [usual | row for row in rows])
        made.write_files(self.top / "engines", {f"{name}.json": program.json.dumps(text) for name, text in files.items()})
        with mock.patch.object(engines, "tuned", lambda: {"ode/quick": {}}):
            return engines.said(world), world

    def test_each_setting_is_a_row_with_its_error_its_time_and_what_it_fails(self):
        ode = {
            "method": "ode", "engine": "ode", "variant": "quick", "setting": "tuned", "precision": "single",
            "knobs": "setting=tuned"}
        line = {"name": "gravity", "passed": False, "measured": 9.7, "expected": 9.8, "note": ""}
        checks = [{"engine": "ode", "variant": "quick", "setting": "tuned", "fault": None, "lines": [line]}, {
            "engine": "ode", "variant": "quick", "setting": "default", "fault": "died", "lines": []}, {
                "engine": "dart", "variant": "", "fault": "unavailable: x", "lines": []}]
        found, world = self.said(
            ode | {"error_position_linf_m": "0.01", "processing_s": "0.5"},
            ode | {"setting": "default", "knobs": "setting=default", "error_position_linf_m": "0.05"},
            {"method": "ap", "solver": "lemke", "error_position_linf_m": "1e-6", "processing_s": "2", "parameters": "mu=1"}, {
                "method": "newton", "variant": "uncapped", "status": "ray", "finished": "false", "reason": "lost",
                "processing_s": "3"},
            {"method": "dart", "engine": "dart", "variant": "pgs", "status": "unavailable", "finished": "false"},
            preflight=checks)
        self.assertTrue(world.lacking)
        self.assertEqual(list(found["scenes"]), ["sliding box", "sliding box mu=1"])
        tuned, default, newton, dart = found["scenes"]["sliding box"]
        wanted = {
            "scene": "sliding_box", "parameters": "", "measure": "position_linf_m", "engine": "ode", "variant": "quick",
            "who": "ODE quick", "setting": "tuned", "precision": "single", "knobs": "setting=tuned", "step": "0.01",
            "status": "ok", "reason": "", "run": "r0", "error": 0.01, "worst": 0.01, "time": 0.5, "us_a_step": 5000.0,
            "busy": False, "front": True, "fails": ["gravity: 9.7, not 9.8"]}
        self.assertEqual(tuned, wanted)
        self.assertEqual((default["fails"], default["front"], default["error"]), (["died"], False, 0.05))
        self.assertEqual(
            {k: newton[k] for k in ("error", "time", "us_a_step", "reason", "precision", "fails", "front", "engine")}, {
                "error": None, "time": None, "us_a_step": None, "reason": "lost", "precision": "double", "fails": [],
                "front": False, "engine": ""})
        self.assertEqual(dart["status"], "unavailable")
        self.assertEqual(found["columns"], [("ode", "quick")])
        # Who is ahead is an engine on the front; of the other scene that is ours.
        self.assertEqual(found["ahead"], {"sliding box": ["ODE quick, tuned"], "sliding box mu=1": []})
        self.assertEqual([c["fails"] for c in found["preflight"]], [["gravity: 9.7, not 9.8"], ["died"], ["unavailable: x"]])
        self.assertEqual((found["tuned"], found["profile"], found["findings"]), ({"ode/quick": {}}, "default", []))

    def test_what_others_found_stands_with_what_it_came_to_here(self):
        rows = [{"says": "x", "unavailable": why, "comes_out": out} for why, out in (
            ("not here", None), (None, None), (None, True), (None, False))]
        found, _ = self.said({"method": "ode", "engine": "ode"}, findings=rows)
        words = ("not measured (not here)", "not measured (a run has no number)", "comes out again", "contradicted")
        self.assertEqual(found["findings"], [row | {"verdict": said} for row, said in zip(rows, words)])

    def test_a_scene_without_a_closed_form_is_judged_by_how_far_its_bodies_went(self):
        ode = {"method": "ode", "engine": "ode", "variant": "quick"}
        way = made.trajectory([(0, "a", (1, 0, 0)), (1, "a", (1, 3, 4))])
        found, _ = self.said(ode | {"scene": "pile", "files": {"trajectory.csv": way}},
                             ode | {"error_position_linf_m": "0.25"})
        errors = {name: [(row["measure"], row["error"]) for row in some] for name, some in found["scenes"].items()}
        self.assertEqual(errors, {"pile": [("drift_m", 5)], "sliding box": [("position_linf_m", 0.25)]})

    def test_a_front_is_of_what_is_off_by_less_than_a_tenth(self):
        rows = [{"method": "ode", "engine": "ode", "knobs": f"n={n}", "error_position_linf_m": error, "processing_s": str(n)}
                for n, error in enumerate(("0.1", "0.09", "0.08"), 1)]
        found, _ = self.said(*rows)
        self.assertEqual([row["front"] for row in found["scenes"]["sliding box"]], [False, True, True])


if __name__ == "__main__":
    unittest.main()
