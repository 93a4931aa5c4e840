"""Sections of the report and what their pages show, on tables made by hand in which every field is another word or number."""
import contextlib
import hashlib
import io
import json
import math
import unittest
from concurrent.futures import BrokenExecutor
from unittest import mock

import made
from contactbench import figures, isolated, report, sections, solve_all, templates, worth
from folder import Folder


class Figures(Folder):
    def test_a_figure_has_its_title_its_words_the_runs_of_its_scene_and_its_picture(self):
        rows = [made.row(scene="sliding_box", repeat=n, processing_s=n)
                for n in (1, 2)] + [made.row(scene="sliding_box", k="16", sweeps="orders")]
        rows += [made.row(scene="stack", busy="true")]
        results = made.results(self.top, rows, profile="quick")
        shown, about, digest = sections.figure(results, "figure03")
        self.assertEqual(
            shown, {
                "name": "figure03", "title": "Figure 3", "rest": shown["rest"], "scene": "sliding_box", "missing": "",
                "image": None, "busy": False, "made": [
                    "scripts/sweep.py scenarios/sweeps/paper.toml --profile quick",
                    "scripts/plots/figure03.py --results results --runs results/runs/quick"], "runs": [
                        "contactbench run sliding_box.xml --method ap --solver lemke --k 8"]})
        self.assertTrue(shown["rest"].startswith("Displacement of the sliding box (top)"))
        self.assertEqual(about,
                         {"says": figures.SAYS["figure03"], "scene": "sliding_box", "commands": shown["made"] + shown["runs"]})
        self.assertIsNone(digest)
        (self.top / "figures").mkdir()
        (self.top / "figures/figure03.png").write_bytes(b"a picture")
        shown, _, digest = sections.figure(results, "figure03")
        self.assertEqual((shown["image"].name, digest), ("figure03.png", hashlib.sha256(b"a picture").hexdigest()))
        # Of all runs of a sweep where a figure has no scene; times of a command's own are none of these runs.
        self.assertEqual([
            sections.figure(results, "performance", *of)[0]["busy"]
            for of in (("paper", ), ("orders", ), ("paper", "scripts/sweep.py"))], [True, False, False])
        self.assertEqual(sections.figure(results, "performance", "orders", "scripts/sweep.py")[0]["made"][0], "scripts/sweep.py")
        self.assertEqual(sections.figure(results, "figure10")[0]["missing"], "no run of it is in this profile")

    def test_commands_are_those_of_the_results_that_are_shown(self):
        results = made.results(self.top, [made.row(sweeps="error_time")])
        self.assertEqual(sections.figure(results, "error_time", "error_time")[0]["made"], [
            "scripts/sweep.py scenarios/sweeps/error_time.toml", "scripts/plots/error_time.py --results results --runs results/runs"])
        (self.top / "error_time.toml").write_text("")  # a small sweep's own
        here = self.top.name
        self.assertEqual(sections.figure(results, "error_time", "error_time")[0]["made"], [
            f"scripts/sweep.py {here}/error_time.toml --runs {here}/runs --out {here}",
            f"scripts/plots/error_time.py --results {here} --runs {here}/runs"])
        # As a shell takes them, whatever the folder is called.
        results = made.results(self.top / "two boxes", [made.row(sweeps="error_time")])
        (results.folder / "error_time.toml").write_text("")
        self.assertEqual(sections.figure(results, "error_time", "error_time")[0]["made"], [
            "scripts/sweep.py 'two boxes/error_time.toml' --runs 'two boxes/runs' --out 'two boxes'",
            "scripts/plots/error_time.py --results 'two boxes' --runs 'two boxes/runs'"])

    def test_the_paper_s_come_first_and_those_of_other_sections_stand_there(self):
        section = sections.figures(made.results(self.top, [made.row()]))
        names = [shown["name"] for shown in section.shown["figures"]]
        self.assertEqual(names, [f"figure{n:02}" for n in range(1, 12)] + ["grasp_picture", "robot_picture"])
        self.assertEqual((list(section.data), section.timing["figure07"]), (names, {"sha256": None}))


class Beside(Folder):
    """Tables that other scripts write beside the runs."""
    def solved(self, folder, *rows):
        blank = dict.fromkeys(solve_all.COLUMNS, "")
        made.write_rows(self.top / folder / "solve_all.csv", [
            blank | {
                "kind": "contact", "method": "ap", "solver": "lemke", "k": "4", "status": "ok", "false_claim": "False",
                "busy": "False"} | row for row in rows])

    def test_solves_are_counted_by_solver_and_kind_with_times_in_microseconds(self):
        self.solved("solve_all", {"residual": "1e-9", "law_residual": "2e-3", "time_median_s": "3e-6", "false_claim": "True"},
                    {"residual": "4e-9", "law_residual": "8e-3", "time_median_s": "5e-6", "busy": "True"},
                    {"residual": "2e-9", "law_residual": "4e-3", "time_median_s": "9e-6"},
                    {"status": "ray", "residual": "7", "law_residual": "7", "time_median_s": "7"},
                    {"method": "convex", "solver": "ipm", "k": "", "compression_bound": "off", "status": "ray"},
                    {"kind": "lcp", "method": "", "k": ""}, {"solver": "path-lib", "status": "unavailable"})
        self.solved("replay/stack__boxes-4", {"residual": "6e-9", "law_residual": "5e-3", "time_median_s": "2e-6"})
        section = sections.stored_problems(made.results(self.top, [made.row()]))
        lemke = section.data | section.timing["solvers"]["contact ap lemke k = 4"]
        self.assertEqual({key: lemke[key] for key in ("problems", "ok", "false_claims", "residual", "law_residual")},
                         {"problems": 4, "ok": 3, "false_claims": 1, "residual": 4e-9, "law_residual": 4e-3})
        self.assertEqual(section.timing["median_time_s"]["contact ap lemke k = 4"], 5e-6)
        self.assertEqual(section.timing["streams"]["stack boxes=4"]["median_time_s"], {"contact ap lemke k = 4": 2e-6})
        self.assertEqual((section.data["figure"]["commands"][0], section.data["streams"]["commands"][0]),
                         ("scripts/solve_all.py --out results/solve_all", "scripts/replay.py --out results/replay"))
        (all_of_them, stream), _ = made.page("stored_problems", section.shown)
        self.assertEqual(all_of_them, [[
            "problems", "solver", "number", "ok", "claims refuted", "worst checked residual", "median residual against Coulomb",
            "median time, us"], ["contact", "ap lemke k = 4", "4", "3 (75 %)", "1", "4e-09", "0.004", "5*"],
                                       ["contact", "convex ipm bound off", "1", "0 (0 %)", "0", "", "", ""],
                                       ["LCP", "LCP lemke", "1", "1 (100 %)", "0", "", "", ""]])
        self.assertEqual(stream[1], ["stack boxes=4", "ap lemke k = 4", "1", "1 (100 %)", "0", "6e-09", "0.005", "2"])
        empty = sections.stored_problems(made.results(self.top / "empty", [made.row()]))
        self.assertEqual((empty.shown["counts"], empty.shown["streams"], empty.data, empty.timing), (None, None, {}, {}))

    def test_what_is_left_out_has_a_table_each_for_what_it_saves_and_costs(self):
        columns = ("table", "what", "scene", "method", "with_us", "without_us", "ratio", "status")
        some = [("saves", "a", "b", "c", "1", "2", "0.5", "ok"), ("speed", "d", "e", "f", "3", "4", "0.75", "ok"),
                ("costs", "g", "h", "i", "6", "5", "1.2", "no")]
        made.write_rows(self.top / "left_out.csv", [dict(zip(columns, row)) for row in some])
        section = sections.left_out(made.results(self.top, [made.row()]))
        tables, _ = made.page("left_out", section.shown)
        self.assertEqual(tables[0][0], ["what", "scene", "method", "left out, us", "left in, us", "ratio", "status"])
        self.assertEqual([table[1:] for table in tables], [[list(some[n][1:])] for n in (0, 2, 1)])
        self.assertEqual((section.data, len(section.timing["rows"])), ({}, 3))

    def test_stiff_cases_are_counted_by_verdict_and_method_and_each_cell_has_its_reason(self):
        columns = ("id", "scene", "row", "method", "verdict", "status", "error", "bound", "residual", "expect", "note",
                   "command")
        some = [("M1", "tower", "n=2", "ap", "right", "ok", "0.00012345", "1e-9", "3e-10", "stands", "why", "run a"),
                ("M1", "tower", "n=2", "convex", "wrong", "inaccurate", "2.5", "2e-9", "4e-10", "stays", "because", "run b"),
                ("M1", "tower", "n=3", "ap", "silent", "ok", "", "", "", "falls", "", "run c"),
                ("A2", "box", "", "ap", "right", "ok", "", "", "", "", "", "run d")]
        made.write_rows(self.top / "stress/stress.csv", [dict(zip(columns, row)) for row in some])
        section = sections.stiff_cases(made.results(self.top, [made.row()]))
        self.assertEqual(
            section.data, {
                "cells": 4, "faults": {
                    "wrong": {"ap": 0, "convex": 1}, "silent": {"ap": 1, "convex": 0}, "defect": {"ap": 0, "convex": 0}}})
        self.assertEqual(section.timing["verdicts"]["right"], {"ap": 2, "convex": 0})
        (count, heat, every), words = made.page("stiff_cases", section.shown)
        self.assertEqual(count[0], ["verdict", "meaning", "ap", "convex", "all"])
        self.assertEqual({cells[0]: cells[2:] for cells in count[1:]}, {
            "right": ["2", "", "2"], "model": ["", "", "0"], "typed": ["", "", "0"], "engine": ["", "", "0"], "wrong": [
                "", "1", "1"], "silent": ["1", "", "1"], "defect": ["", "", "0"]})
        self.assertIn("4 cells", words)
        self.assertEqual(
            heat, [["case", "ap", "convex"], ["M1 tower: n=2", "r", "w"], ["M1 tower: n=3", "s", ""], ["A2 box:", "r", ""]])
        self.assertEqual(every[0], [
            "case", "scene", "row", "method", "verdict", "status", "error", "bound", "residual", "expected", "reason", "command"
        ])
        self.assertEqual(
            every[2],
            ["M1", "tower", "n=2", "convex", "wrong", "inaccurate", "2.5", "2e-09", "4e-10", "stays", "because", "run b"])
        self.assertEqual(every[1][6], "0.000123")

    def test_engines_stand_beside_the_methods_with_their_preflight_and_where_they_are_ahead(self):
        def row(name, error, seconds, **more):
            engine, _, variant = name.partition("/")
            of = {"method": engine, "variant": variant, "solver": "", "engine": engine} if variant else {}
            return made.row(sweeps="engines", processing_s=seconds, error_position_linf_m=error,
                            **of | {"setting": "default" if variant else ""} | more)

        rows = [
            row("ap", 1e-6, 4, busy="true"),
            row("ode/quick", 1e-3, 2, precision="single"),
            row("ode/world", 5e-3, 3, setting="tuned", knobs="setting=tuned"),
            row("dart/x", "", 1, status="time_limit", finished="false", reason="slow"),
            row("bullet/si", "", "", status="unavailable", finished="false")]
        results = made.results(self.top, [made.row()])
        made.results(self.top / "engines", rows, profile="quick")
        line = {"name": "gravity", "passed": False, "measured": 9.0, "expected": 9.8, "note": "", "unit": ""}
        checks = [{
            "engine": "ode", "variant": "quick", "setting": "default", "fault": None, "version": "0.16", "precision": "single",
            "lines": [line, line | {"passed": True}]}, {
                "engine": "ode", "variant": "world", "setting": "default", "fault": None, "version": "0.16",
                "precision": "single", "lines": [line | {"name": "spin"}]}]
        found = [{
            "says": "it creeps", "unit": "m", "comes_out": False, "unavailable": None, "runs": [{
                "name": "h", "number": 0.25, "status": "ok"}, {"name": "2 h", "number": None, "status": "crash"}]}]
        for name, what in (("preflight", checks), ("findings", found)):
            (self.top / f"engines/{name}.json").write_text(json.dumps(what))
        section = sections.engines(results)
        (ahead, preflight, again, scene, *_), words = made.page("engines", section.shown)
        self.assertEqual(ahead[1:], [["box", "ODE quick, default"]])
        self.assertEqual(preflight[1:], [["ode", "quick", "default", "0.16", "single", "gravity: 9, not 9.8"],
                                         ["ode", "world", "default", "0.16", "single", "spin: 9, not 9.8"]])
        self.assertEqual(again[1:], [["it creeps", "contradicted", "h: 0.25 m; 2 h: crash"]])
        self.assertEqual(scene[0], ["who", "setting", "knobs", "error, m", "us a step", "front", "status", "preflight"])
        self.assertEqual(scene[1:],
                         [["A-P Lemke", "", "", "1e-06", "2e+04*", "front", "ok", ""],
                          ["ODE quick (single)", "default", "", "0.001", "1e+04", "front", "ok", "gravity: 9, not 9.8"],
                          ["ODE world", "tuned", "setting=tuned", "0.005", "1.5e+04", "", "ok", ""],
                          ["DART x", "default", "", "", "", "", "time_limit: slow", ""],
                          ["Bullet si", "default", "", "", "", "", "unavailable", ""]])
        self.assertIn("(3 engines times ways of solving)", words)
        self.assertEqual(section.shown["columns"], [("dart", "x"), ("ode", "quick"), ("ode", "world")])
        said = {name: {r["who"] for r in of.values()} for name, of in section.data["scenes"].items()}
        self.assertEqual(said,
                         {"box": {"A-P Lemke", "ODE quick", "ODE world", "Bullet si"}})  # how a limit ends a run is timing
        self.assertEqual(len(section.timing["scenes"]["box"]), 5)
        quick = next(r for r in section.data["scenes"]["box"].values() if r["who"] == "ODE quick")
        self.assertEqual(
            quick, {
                "who": "ODE quick", "setting": "default", "precision": "single", "step": "0.01", "knobs": "",
                "measure": "position_linf_m", "status": "ok", "error": 1e-3, "fails": ["gravity: 9, not 9.8"]})

    def test_an_engine_s_own_problems_stand_with_its_residuals_and_those_of_our_methods(self):
        made.results(self.top / "engines", [made.row(sweeps="engines")])
        blank = dict.fromkeys(isolated.COLUMNS, "") | {
            "file": "a.hdf5", "scene": "sliding_box", "engine": "mujoco", "variant": "newton"}
        engine = {
            "by": "mujoco newton", "contacts": "4", "law_residual": "0.1", "law_residual_without_offset": "0.02",
            "own_residual": "0.003", "momentum_error": "0.0004", "velocity_error": "7", "largest_compliance_per_kg": "0.00005"}
        ours = [{"by": by, "status": "ok", "law_residual": str(n)} for n, by in enumerate(isolated.BESIDE, 2)]
        made.write_rows(self.top / "engines/own_problems.csv", [blank | of for of in (engine, *ours)])
        section = sections.engines(made.results(self.top, [made.row()]))
        table = next(t for t in made.page("engines", section.shown)[0] if t[0][:2] == ["scene", "engine"])
        self.assertEqual(table, [[
            "scene", "engine", "contacts", "compliance, 1/kg", "Coulomb", "without offset", "its own model", "momentum",
            *isolated.BESIDE],
                                 [
                                     "sliding box", "mujoco newton", "4", "5e-05", "0.1", "0.02", "0.003", "0.0004",
                                     *(str(n) for n, _ in enumerate(isolated.BESIDE, 2))]])
        self.assertEqual(section.data["own"], section.shown["own"])

    def test_knobs_that_were_searched_for_stand_with_their_scores(self):
        made.results(self.top / "engines", [made.row(sweeps="engines")])
        knobs = {
            "ode/quick": {"knobs": {"erp": 0.25, "cfm": 1e-9}, "tries": 7, "default_score": -2.5, "score": -4.5},
            "ode/world": {"knobs": {}, "tries": 3, "default_score": -1.5, "score": -1.5}}
        with mock.patch.object(sections.engines_beside, "tuned", lambda: knobs):
            section = sections.engines(made.results(self.top, [made.row()]))
        self.assertEqual(made.page("engines", section.shown)[0][-1],
                         [["engine", "knobs changed", "tries", "score at the defaults", "score"],
                          ["ode/quick", "erp = 0.25, cfm = 1e-09", "7", "-2.5", "-4.5"],
                          ["ode/world", "", "3", "-1.5", "-1.5"]])

    def test_runs_that_did_not_end_well_are_those_that_are_not_ok_or_whose_claims_were_refuted(self):
        rows = [
            made.row(run="good"),
            made.row(run="none", false_claims="", k="16"),
            made.row(run="liar", false_claims="3", k="4"),
            made.row(run="ray", status="ray", reason="no way on", t_reached="0.123456", solver="path"),
            made.row(run="late", status="time_limit", t_reached="", solver="ynl")]
        section = sections.unfinished(made.results(self.top, rows))
        self.assertEqual((section.data, section.timing),
                         ({"liar": ["ok", ""], "ray": ["ray", "no way on"]}, {"late": ["time_limit", ""]}))
        (table, ), _ = made.page("unfinished", section.shown)
        self.assertEqual(table, [["run", "status", "reached", "reason", "false claims"], ["liar", "ok", "2 s", "", "3"],
                                 ["ray", "ray", "0.1235 s", "no way on", "0"], ["late", "time_limit", "", "", "0"]])


class Data(Folder):
    """What report.json says of sections whose pages are looked at elsewhere."""
    def test_claims_stand_by_their_names_with_those_about_times_apart(self):
        rise = {"error_energy_rise_relative": 0.25}
        rows = [
            made.row(scene="impacting_sphere", solver="", method="newton", variant=v, **rise)
            for v in ("uncapped", "stick-tested")]
        rows += [
            made.row(scene="impacting_sphere", **rise | {"processing_s": 1}),
            made.row(scene="impacting_sphere", **made.EPS | rise | {"processing_s": 2})]
        section = sections.claim_table(made.results(self.top, rows, sweeps=["paper"]))
        self.assertEqual(list(section.data), [f"C{n}" for n in range(1, 11)])
        self.assertEqual([p["verdict"] for p in section.data["C1"]["parts"]], ["reproduced", "reproduced", "not reproduced"])
        self.assertEqual(set(section.timing), {"C9"})  # of the others about times there is no run
        self.assertEqual((section.timing["C9"]["parts"][0]["verdict"], section.data["C9"]["parts"][0]["verdict"]),
                         ("reproduced", "cannot be told"))
        (table, ), words = made.page("claim_table", section.shown)
        self.assertEqual(table[1][3], "in part (2 of 3 parts)")
        self.assertIn("contradicted : no other model gains more than 1e-9.", words)

    def test_table_one_says_why_and_when_a_run_ended_but_where_a_limit_of_the_machine_s_cut_it(self):
        ended = {"energy_blowup": "of 3 J", "time_limit": "60 s were over"}
        rows = [
            made.row(scene=scene, status=s, reason=r, t_reached=0.5, finished="false")
            for scene, (s, r) in zip(("impacting_sphere", "sticking_box"), ended.items())]
        section = sections.table_one(made.results(self.top, rows, sweeps=["paper"]))
        by_status = {row["status"]: row for row in section.data["rows"]}
        self.assertEqual((by_status["energy_blowup"]["reason"], float(by_status["energy_blowup"]["t_reached"])), ("of 3 J", 0.5))
        self.assertEqual({"reason", "t_reached"} & set(by_status["time_limit"]), set())
        self.assertEqual(len(by_status), len(ended))

    def test_orders_and_ways_of_stepping_name_their_runs(self):
        rows = [
            made.row(run=f"o{h}", sweeps="orders", step=h, knobs=f"step={h}", error_position_linf_m=h)
            for h in ("0.1", "0.4", "0.2", "0.8")]
        rows += [made.row(run="p", sweeps="polygons", k="16", error_position_linf_m=1, error_polygon_position_linf_m=2)]
        rows += [
            made.row(run="s", sweeps="stepping", knobs="accuracy=1e-3", error_position_linf_m=5e-3, switches=3, impacts=4,
                     first_order_steps=5, solves=6)]
        results = made.results(self.top, rows)
        data = sections.convergence(results).data
        self.assertEqual((data["orders"][0]["runs"], data["polygons"][0]["runs"]), (["o0.8", "o0.4", "o0.2", "o0.1"], ["p"]))
        self.assertNotIn("cells", data["orders"][0])
        self.assertEqual(
            sections.ways_of_stepping(results).data["wanted"], {
                "s": {
                    "scene": "box", "parameters": "", "method": "A-P Lemke, k = 8", "wanted": 1e-3, "status": "ok",
                    "reached": 5e-3, "switches": 3, "impacts": 4, "first_order_steps": 5, "solves": 6}})

    def test_what_several_machines_made_says_so(self):
        machines = [{"cpu": "one"}, {"cpu": "two"}]
        results = made.results(self.top, [made.row()], machine=machines, versions={"git": "abc"}, profile="paper", sweeps=[
            "motion"])
        section = sections.reading(results)
        self.assertEqual(section.shown["made_with"][:2], [("machine", machines), ("versions", {"git": "abc"})])
        _, words = made.page("reading", section.shown, profile="paper", worth={"exact": 1, "rounding": 0, "sample": 0})
        self.assertIn("Nothing was repeated, so that noise is not known.", words)
        self.assertIn("No run is known to have been disturbed", words)


class Whole(Folder):
    def test_of_other_scenes_the_figures_of_any_scene_are_drawn_alone_and_a_failure_is_said(self):
        for sweeps, names in ((["paper"], list(figures.FIGURES)), (["motion"], ["error_time", "error_budget"])):
            results = made.results(self.top, [made.row()], sweeps=sweeps)
            for name in ("error_time", "repose"):
                (self.top / "figures").mkdir(exist_ok=True)
                (self.top / f"figures/{name}.png").write_text("old")
            with mock.patch.object(report, "ProcessPoolExecutor") as pool, contextlib.redirect_stderr(io.StringIO()) as said:
                submit = pool.return_value.__enter__.return_value.submit
                submit.side_effect = lambda drawn, name, of: mock.Mock(
                    exception=lambda: BrokenExecutor() if name == names[0] else None,
                    result=lambda: "one\nno room" if name == names[1] else "")
                report.draw(results)
            self.assertEqual([call.args for call in submit.call_args_list], [(report.drawn, name, results) for name in names])
            self.assertEqual(
                said.getvalue(), f"report: {names[0]}.py could not draw: its process died\n"
                f"report: {names[1]}.py could not draw: no room\n")
            # A picture of other results must not stand in for one that is drawn now.
            self.assertEqual([(self.top / f"figures/{name}.png").exists() for name in ("error_time", "repose")],
                             [False, "repose" not in names])

    def test_numbers_of_pages_are_short_and_what_is_none_is_empty(self):
        sample = worth.Number(None, [0.12345, 0.5, None])
        self.assertEqual([templates.known(x) for x in (None, math.nan, 0.0, 12345.6, sample)],
                         ["", "", "0", "1.23e+04", "0.312 [0.123 to 0.5] in 2 of 3"])
        self.assertEqual([templates.short(x) for x in ("1.23456", "", "ray", "1e-9")], ["1.23", "", "ray", "1e-09"])
        filters = templates.TEMPLATES.filters
        self.assertEqual([filters[name](0.0123456) for name in ("g2", "g3", "g4", "g3_known")],
                         ["0.012", "0.0123", "0.01235", "0.0123"])
        self.assertEqual((filters["fixed"](1.23456, 2), filters["words"]("a_b_c"), filters["numbers"]([1.23456, 2e-9])),
                         ("1.23", "a b c", "1.23, 2e-09"))
        self.assertEqual(filters["e"]('<a href="b">&\'</a>'), "&lt;a href=&quot;b&quot;&gt;&amp;&#x27;&lt;/a&gt;")

    def test_sections_stand_in_groups_by_what_the_results_are_of(self):
        paper = made.results(self.top, [made.row()], sweeps=["orders", "paper"], profile="quick")
        self.assertEqual(report.heading(paper)["title"], "contact models compared")
        names = {title: [build.__name__ for build in group] for title, group in sections.groups(paper).items()}
        self.assertEqual(
            names, {
                "Which method": ["found", "advice", "error_time", "models_today", "scenes"], "The paper": [
                    "claim_table", "table_one", "figures"], "Accuracy and cost": [
                        "convergence", "ways_of_stepping", "performance", "stored_problems", "left_out"], "Other programs": [
                            "engines"], "Where it gets hard": ["stiff_cases", "unfinished"], "About": ["reading"]})
        other = made.results(
            self.top,
            [made.row(scene="b"), made.row(scene="a"), made.row(scene="b", k="4")], sweeps=["papers"])
        self.assertEqual(report.heading(other), {"title": "b, a", "heading": "Contact models compared: b, a"})
        self.assertEqual([build.__name__ for group in sections.groups(other).values() for build in group],
                         ["found", "scenes", "differences", "unfinished", "reading"])
        known = made.results(self.top, [made.row(sweeps="error_time", error_position_linf_m=1)], sweeps=["error_time"])
        self.assertIn(sections.error_time, sections.groups(known)["Which method"])

    def test_a_report_of_a_scene_is_a_page_and_a_file_with_the_class_of_each_number(self):
        rows = [
            made.row(sweeps="error_time", scene="my_box", step=h, knobs=f"step={h}", error_position_linf_m=2e-3 * float(h),
                     reference="analytic", **of) for h in ("0.1", "0.2") for of in ({}, made.EPS | {"processing_s": 1.5})]
        results = made.results(self.top, rows, sweeps=["error_time"], profile="mine", runs=4)
        with contextlib.redirect_stderr(io.StringIO()) as told:
            report.write(results)
        self.assertEqual(told.getvalue(), "report: no motion.html: no run kept its contacts\n")
        said = json.loads((self.top / "report.json").read_text())
        self.assertEqual(said["profile"], "mine")
        self.assertEqual({key for of in said["sections"].values() for key in of},
                         {"title", "data", "worth", "timing", "worth_of_timing"})
        self.assertEqual(said["sections"]["reading"]["data"]["runs"], 4)
        self.assertEqual([r["error"] for r in said["sections"]["differences"]["data"]["rows"]["my box"]],
                         [2e-4, 2e-4, 4e-4, 4e-4])
        self.assertEqual([r["time"] for r in said["sections"]["differences"]["timing"]["my box"]], [0.5, 0.75, 0.5, 0.75])
        page = (self.top / "report.html").read_text()
        self.assertIn("Contact models compared: my_box", page)
        at = [page.index(f'<section id="{name}">') for name in said["sections"]]
        self.assertEqual((at, len(at)), (sorted(at), 7))
        self.assertFalse((self.top / "table1.csv").exists())

    def test_settings_of_a_scene_and_how_far_methods_are_apart_at_their_finest_common_step(self):
        def row(h, **more):
            return made.row(sweeps="error_time", step=h, knobs=f"step={h}", **more)

        rows = [
            row("0.02", residual_max="0.25", max_gain_relative="1e-7"),
            row("0.01", error_position_linf_m=""),
            row("0.02", **made.EPS),
            row("0.01", **made.EPS | {"processing_s": "3"}),
            row("0.001", status="ray", finished="false", t_reached="0.5", solver="path"),
            row("0.005")]
        for of, way in zip(rows, (1, 2, 3.5, 2.75, 9, 2.5)):
            of["files"] = {"trajectory.csv": made.trajectory([(t, "body", (0, way * t, 0)) for t in (0, 0.5, 1)])}
        results = made.results(self.top, rows, sweeps=["error_time"])
        section = sections.differences(results)
        (table, far), words = made.page("differences", section.shown)
        self.assertEqual(table[0], [
            "method", "step, s", "ended", "moves, m", "time, s a simulated second", "worst residual",
            "largest gain of an event", "command"])
        # How far a motion is from its method's finest step: 2.5 of A-P's, 2.75 of convex's, and the finest from the next.
        self.assertEqual([cells[:7] for cells in table[1:]], [["A-P Lemke, k = 8", "0.02", "ok", "1.5", "0.5", "0.25", "1e-07"],
                                                              ["A-P Lemke, k = 8", "0.01", "ok", "0.5", "0.5", "", ""],
                                                              ["convex, epsilon 1e-12 J", "0.02", "ok", "0.75", "0.5", "", ""],
                                                              ["convex, epsilon 1e-12 J", "0.01", "ok", "0.75", "1.5", "", ""],
                                                              ["A-P PATH, k = 8", "0.001", "ray at 0.5 s", "", "", "", ""],
                                                              ["A-P Lemke, k = 8", "0.005", "ok", "0.5", "0.5", "", ""]])
        self.assertEqual(far, [["", "A-P Lemke, k = 8", "convex, epsilon 1e-12 J"], ["A-P Lemke, k = 8", "0", "0.75"],
                               ["convex, epsilon 1e-12 J", "0.75", "0"]])
        self.assertIn("at a step of 0.01 s", words)
        self.assertEqual((section.data["apart"]["box"]["step"], [r["time"] for r in section.timing["box"]][3]), ("0.01", 1.5))

    def test_what_is_no_number_is_null_in_json_and_a_figure_that_fails_says_why(self):
        self.assertEqual(report.finite({"a": (1.5, math.nan, [math.inf, -math.inf, "nan", True, None, 3])}),
                         {"a": [1.5, None, [None, None, "nan", True, None, 3]]})
        self.assertEqual(report.drawn("no such figure", None), "KeyError: 'no such figure'")

    def test_scenes_without_a_picture_are_named(self):
        results = made.results(self.top, [made.row(scene="b"), made.row(scene="a")], sweeps=["motion"])
        self.assertEqual(sections.scenes(results).shown, {"scenes": {}, "without": ["b", "a"], "repose": None})
        self.assertEqual([sections.scene_name("my_box", of) for of in ("", "n=2 mu_b=1")], ["my box", "my box n=2 mu_b=1"])
        times = made.results(
            self.top,
            [made.row(sweeps="error_time", duration=d, k=k) for d, k in (("20", "4"), ("5.5", "8"), ("20", "16"), ("", "2"))])
        self.assertEqual(sections.lasts(times, ("box", "")), "5.5 s or 20 s")


if __name__ == "__main__":
    unittest.main()
