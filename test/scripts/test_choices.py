"""Which method, by which evidence (today.py, ladder.py, compare.py and their sections), on folders made by hand."""
import contextlib
import io
import json
import math
import sys
import unittest
from unittest import mock

import made
import numpy as np
from contactbench import compare, ladder, sections, today
from folder import Folder

ERROR = "error_position_linf_m"
PLAIN = {"solver": ""}
METHODS = {
    "lemke": {}, "path": {"solver": "path"}, "convex": made.EPS, "early": made.EPS | {"epsilon": "1e-6"},
    "mirtich": PLAIN | {"method": "mirtich"}, "soft": PLAIN | {"method": "soft", "solver": "sap"}
} | {solver: PLAIN | {"method": "coulomb", "solver": solver} for solver in ("newton", "cascade", "nsgs", "bisection", "admm")}


class Results(Folder):
    sweep = "error_time"

    def row(self, name, step="0.01", **more):
        return made.row(**{"sweeps": self.sweep, "step": step, "knobs": f"step={step}"} | METHODS[name] | more)

    def results(self, some, ensemble=(), **manifest):
        """`some`: pairs of a row and where its body is at each of some moments, m."""
        rows = [row | {"files": {"trajectory.csv": made.trajectory([(t, "body", (x, 0, 0)) for t, x in places.items()])}}
                if places else row for row, places in some]
        return made.results(self.top, rows, ensemble, **manifest)


class Today(Results):
    sweep = "today"

    def test_each_run_is_as_far_from_the_law_as_its_bodies_and_a_step_costs_what_it_costs(self):
        law = {"law_residual_max": "0.9e-8"}
        arm = {"scene": "arm", "parameters": "n=2"}
        results = self.results([
            (self.row("admm", **{ERROR: 8}), {0: 0, 1: 7}), (self.row("lemke", k="4"), {0: 0, 1: 9}),
            (self.row("lemke", k="4", repeat=2, status="ray", finished="false", processing_s=9), {0: 0, 1: 9}),
            (self.row("newton", **{ERROR: 4e-3} | law), {0: 0, 1: 1}), (self.row("cascade", **{ERROR: 9}), {0: 0, 1: 1.25}),
            (self.row("lemke", processing_s=3, steps=40, law_residual_max=0.125, **{ERROR: 7e-3}), {0: 0, 1: 1.5}),
            (self.row("convex", step="0.02", status="inaccurate"), {0: 0, 1: 6}),
            (self.row("newton", step="0.02", status="ray", finished="false"), {0: 0, 1: 6}),
            (self.row("soft", **arm), {0: 0, 1: 3}), (self.row("admm", law_residual_max="1.1e-8", **arm), {0: 0, 1: 3})])
        rows = {(r["scene"], r["parameters"], r["step"], r["label"]): r for r in today.rows_of(results)}
        # Of a setting of which one repeat did not come to its end nothing is said.
        part = rows["box", "", "0.01", "A-P Lemke, k = 4"]
        np.testing.assert_equal([part[key] for key in ("status", "apart", "time_per_step")], ["ray at 2 s", math.nan, math.nan])
        lemke = rows["box", "", "0.01", "A-P Lemke, k = 8"]
        self.assertEqual({key: lemke[key] for key in lemke if key != "cell"}, {
            "scene": "box", "parameters": "", "step": "0.01", "label": "A-P Lemke, k = 8", "column": "polygon", "status": "ok",
            "agree": 0.25, "apart": 0.5, "law": 0.125, "error": 7e-3, "measure": "position_linf_m", "time_per_step": 0.075})
        self.assertEqual(rows["box", "", "0.01", "Coulomb cascade"]["apart"], 0.25)
        line = today.budget(rows.values())["box", "", "0.01"]
        self.assertEqual((line["agree"], line["law_error"]), (0.25, 4e-3))
        # At a step without an exact run, and in a scene without one, nobody knows how far.
        none = rows["box", "", "0.02", "convex"]
        np.testing.assert_equal([none[key] for key in ("agree", "apart", "status", "error")],
                                [math.nan, math.nan, "inaccurate", math.nan])
        ray = rows["box", "", "0.02", "Coulomb Newton"]
        np.testing.assert_equal([ray[key] for key in ("status", "time_per_step")], ["ray at 2 s", math.nan])
        self.assertTrue(math.isnan(rows["arm", "n=2", "0.01", "soft SAP"]["apart"]))
        self.assertEqual(rows["arm", "n=2", "0.01", "soft SAP"]["measure"], "")

    def test_a_label_has_the_knobs_that_tell_runs_apart(self):
        some = made.cell(**made.EPS | {"knobs": "step=1e-2 duration=3 compression_bound=off prune=on"})
        self.assertEqual(today.label_of(some), "convex, bound off, prune on")
        self.assertEqual(today.label_of(made.cell(**METHODS["early"])), "convex, epsilon 1e-6 J")

    def test_one_contact_after_another_is_the_law_where_it_came_to_it(self):
        for name, law, column in (("bisection", 1e-3, "sequence"), ("bisection", 0, ""), ("nsgs", 1.1e-8, "sequence"),
                                  ("nsgs", 0.9e-8, ""), ("admm", 1e-3, ""), ("mirtich", 0, "sequence"), ("soft", 0,
                                                                                                         "softness")):
            self.assertEqual(today.column_of(made.cell(**METHODS[name] | {"law_residual_max": law})), column, (name, law))
        cells = [
            made.cell(**METHODS[name] | {"step": "1"} | more)
            for name, more in (("admm", {}), ("cascade", {}), ("newton", {"law_residual_max": "1.1e-8"}),
                               ("nsgs", {"finished": "false"}), ("bisection", {"step": "2"}), ("convex", {}))]
        self.assertEqual([c["solver"] for c in today.references(cells, "1")], ["cascade", "admm"])

    def test_the_tables_have_each_model_in_its_column_and_times_in_microseconds(self):
        places = {"newton": 1, "lemke": 1.5, "path": 1.25, "convex": 1 + 9e-6, "soft": 1 + 1.1e-5, "mirtich": 3}
        seconds = {"newton": 4, "lemke": 1, "path": 1, "convex": 2, "soft": 0.5, "mirtich": 1}
        results = self.results([(self.row(name, processing_s=seconds[name], **{ERROR: 2e-3 if name == "newton" else 1}), {
            0: 0, 1: x}) for name, x in places.items()])
        section = sections.models_today(results)
        (budget, cost, every), _ = made.page("models_today", section.shown)
        self.assertEqual(budget[0], [
            "scene", "polygon", "convexity", "softness", "sequence", "two solvers of the law, m",
            "the law's own error at this step, m"])
        self.assertEqual(budget[1:], [[
            "box, step 0.01 s", "0.25 (A-P PATH, k = 8); 0.5 (A-P Lemke, k = 8)", "9e-06 (convex)", "1.1e-05 (soft SAP)",
            "2 (Mirtich)", "", "0.002"]])
        self.assertEqual(cost[1:], [["box, step 0.01 s", "convex: 1e+04; Coulomb Newton: 2e+04"]])  # of 200 steps, in s 2 and 4
        self.assertEqual(every[2][:9], ["box", "0.01", "A-P Lemke, k = 8", "ok", "polygon", "0.5", "0", "1", "5e+03"])
        name = next(r["run"] for r in results.records if r["method"] == "convex").removesuffix("__r1")
        self.assertEqual(section.timing["cheapest"], {"box, step 0.01 s": name})
        self.assertEqual((section.timing["time_per_step"][name], section.data["runs"][name]["column"]), (0.01, "convexity"))
        self.assertEqual(sections.models_today(made.results(self.top, [made.row()])).shown, {"rows": None})


class Ladder(Results):
    def test_evidence_is_exact_certified_for_the_whole_time_or_agreed_for_a_part_of_it(self):
        about = {"until": 3.0, "duration": 5.0}
        self.assertEqual(ladder.basis_of("position_linf_m", {}, None), "exact")
        self.assertEqual([ladder.basis_of("certified_linf_m", about, t) for t in (None, 3.0, 2.0, 3.1)],
                         ["agreed", "certified", "certified", "agreed"])
        self.assertEqual(ladder.basis_of("certified_linf_m", {"until": None, "duration": 5.0}, None), "agreed")

    def test_a_point_of_no_column_has_the_times_of_its_cell(self):
        rows = [self.row("lemke", repeat=n, processing_s=s, steps=50, duration=4) for n, s in enumerate((8, 2, 3), 1)]
        cell, = self.results([(row, None) for row in rows]).cells(sweep=None)
        point = ladder.point(cell, "alike", 0.25)
        self.assertEqual([
            point[key]
            for key in ("measure", "error", "worst", "time", "least", "most", "time_per_step", "repeats", "uncertainty")],
                         ["alike", 0.25, 0.25, 0.75, 0.5, 2.0, 0.06, 3, 0])

    def test_a_step_is_held_against_the_finest_of_its_own_and_that_one_against_the_next(self):
        some = [("lemke", "0.01", 5.0), ("lemke", "0.001", 1.0), ("lemke", "0.1", 9.0), ("convex", "0.01", 7.0),
                ("mirtich", "0.01", 0.0), ("mirtich", "0.1", 2.0)]
        results = self.results([(self.row(name, step), {0: 0, 1: x / 2, 2: x}) for name, step, x in some])
        runs = {(c["method"], c["step"]): c["run"] for c in results.cells(sweep="error_time")}
        for until, share in ((math.inf, 1), (1, 0.5)):
            own = ladder.own_steps(results, "box", "", until)
            self.assertEqual(
                own, {
                    runs[of]: share * far for of, far in ((("ap", "0.01"), 4), (("ap", "0.001"), 4), (("ap", "0.1"), 8),
                                                          (("mirtich", "0.01"), 2), (("mirtich", "0.1"), 2))})
        cell = next(c for c in results.cells(sweep="error_time") if c["run"] == runs["ap", "0.01"])
        self.assertEqual(ladder.spread(results, "box", "", cell), (5, 3.5))  # from Mirtich's and from convex at its step
        fine = next(c for c in results.cells(sweep="error_time") if c["run"] == runs["ap", "0.001"])
        self.assertIsNone(ladder.spread(results, "box", "", fine))

    def test_steps_that_share_the_start_alone_are_not_held_against_each_other(self):
        # Recorded every 12th step of 8 ms and every 50th of 2 ms, for 2 s.
        times = {"0.008": 0.096, "0.002": 0.1, "0.0005": 0.1}
        some = [(self.row("lemke", step), {0: 0} | {round(n * dt, 9): 5.0 * float(step) for n in range(1, 21)})
                for step, dt in times.items()]
        results = self.results(some)
        steps = {c["run"]: c["step"] for c in results.cells(sweep="error_time")}
        self.assertEqual({steps[run] for run in ladder.own_steps(results, "box", "")}, {"0.002", "0.0005"})

    def test_steps_of_another_kind_have_a_finest_of_their_own(self):
        rows = [(self.row("lemke", step, knobs=f"step={step}{kind}"), {0: 0, 1: x})
                for kind, step, x in (("", "0.01", 5.0), ("", "0.001", 1.0), (" stepping=steps", "0.1", 7.5), (" stepping=steps", "0.01", 2.0))]
        self.assertEqual(sorted(ladder.own_steps(self.results(rows), "box", "").values()), [4, 4, 5.5, 5.5])

    def test_what_solves_its_problems_comes_in_the_order_of_what_is_worse(self):
        some = [("refuted", "lemke", {"false_claims": 1, "processing_s": 1}),
                ("late", "path", {"finished": "false", "status": "ray"}),
                ("gains", "convex", {"max_gain_relative": "2e-9", "processing_s": 2}),
                ("polygon", "mirtich", {"law_residual_max": "2e-8", "processing_s": 3}),
                ("slow", "newton", {"max_gain_relative": "0.5e-9", "law_residual_max": "0.5e-8", "processing_s": 9}),
                ("quick", "admm", {"processing_s": 8})]
        results = self.results([(self.row(name, run=run, **more), None) for run, name, more in some])
        self.assertEqual([p["run"] for p in ladder.sound(results, "box", "")], ["quick", "slow", "polygon", "gains", "refuted"])

    def test_what_gains_energy_is_no_answer_by_its_residuals(self):
        def some(*gains):
            rows = [(self.row(name, processing_s=n, max_gain_relative=gain), None)
                    for n, (name, gain) in enumerate(zip(("lemke", "path", "convex"), gains), 1)]
            (row, ) = ladder.steps_down(self.results(rows), "box", "", 1e-3, None)
            return [row[key] and row[key]["cell"].key[1] for key in ("best", "runner_up", "nearest")]

        self.assertEqual(some("0", "2e-9", "2e-9"), ["lemke", None, "lemke"])
        self.assertEqual(some("2e-9", "0", "0"), ["path", "ipm", "path"])
        self.assertEqual(some("2e-9", "2e-9", "2e-9"), [None, None, "lemke"])  # as on a belt, which puts it in

    def test_two_are_alike_for_as_long_as_they_stay_within_the_error_of_each_other(self):
        def some(**of):
            return self.results([(self.row(name, step, **more), {t / 10: x for t, x in enumerate(places)})
                                 for name, (step, places, more) in of.items()])

        still = [0, 0, 0, 0, 0]
        results = some(lemke=("0.01", still, {}), convex=("0.01", [0, 1, 2, 4, 1], {}), newton=("0.01", [0, -3, 3, 3, 3.4], {}),
                       mirtich=("0.01", still, {}), path=("0.01", still, {}), admm=("0.1", still, {}), cascade=("0.01", still, {
                           "false_claims": "1"}))
        until, words, two = ladder.alike(results, "box", "", 2.5)
        self.assertEqual((until, words, [c["method"] for c in two]), (0.2, "the first 0.2 s, and part then", ["ap", "convex"]))
        until, words, two = ladder.alike(results, "box", "", 3.5)
        self.assertEqual((until, words, [c["method"] for c in two]), (0.4, "the whole run, 0.4 s", ["ap", "coulomb"]))
        self.assertEqual(ladder.alike(results, "box", "", 0.5), (0.0, "", ()))
        apart = some(lemke=("0.02", [0, 0], {}), convex=("0.02", [1, 0], {}))  # at the start already
        for read in (ladder.precision.moments, ladder.precision.distances_of):
            read.cache_clear()
        self.assertEqual(ladder.alike(apart, "box", "", 0.5), (0.0, "", ()))

    def test_steps_down_say_by_what_they_judge_and_how_far_that_can_be_trusted(self):
        # A-P and convex share a motion to 0.25 m; the coarse convex is 0.5 m from its own finest and 0.75 m from A-P's.
        some = [("lemke", "0.01", 1.0, 8), ("convex", "0.01", 1.25, 9), ("convex", "0.1", 1.75, 1), ("lemke", "0.1", 3.0, 0.5),
                ("mirtich", "0.1", 9.0, 0.25), ("newton", "0.01", 1.9, 7), ("newton", "0.1", 1.0, 0.4)]
        results = self.results([(self.row(name, step, processing_s=s, steps=10 if name == "mirtich" else 100), {
            0: 0, 1: x / 2, 2: x}) for name, step, x, s in some])
        alike, converging, residual = ladder.steps_down(results, "box", "", 0.8, None)
        self.assertEqual([row["basis"] for row in (alike, converging, residual)], ["alike", "converging", "residual"])
        self.assertEqual((alike["best"]["cell"]["method"], alike["best"]["step"], alike["best"]["error"]),
                         ("convex", "0.1", 0.75))
        # The others are too far from their own finest steps, or have one step alone.
        self.assertIsNone(alike["runner_up"])
        self.assertTrue(alike["trust"].startswith(
            "A-P Lemke and convex, epsilon 1e-12 J at their finest step stay within 0.8 m of each other for the whole run, 2 s")
                        )
        # By its own steps alone it is nearer; Mirtich's at its step is 7.25 m away.
        self.assertEqual((converging["best"]["step"], converging["best"]["error"]), ("0.1", 0.5))
        self.assertIn("at its step the others are up to 7.2 m away", converging["trust"])
        self.assertEqual((residual["best"]["cell"]["method"], residual["best"]["error"]), ("mirtich", 0.0))
        self.assertEqual(residual["runner_up"]["cell"]["method"], "coulomb")
        # Where none meets the error the nearest stands there; a limit of a step's time is of all of them.
        alike, converging, residual = ladder.steps_down(results, "box", "", 0.3, None)
        self.assertEqual([row["best"] for row in (alike, converging)], [None, None])
        self.assertEqual([(row["nearest"]["step"], row["nearest"]["error"]) for row in (alike, converging)], [("0.01", 0.5),
                                                                                                              ("0.1", 0.5)])
        alike = ladder.steps_down(results, "box", "", 0.2, None)[0]
        self.assertIn("for the first 1 s, and part then", alike["trust"])
        self.assertEqual(alike["nearest"]["error"], 0.25)  # up to then
        limited = ladder.steps_down(results, "box", "", 0.8, 0.0045)
        self.assertEqual([row["best"] and row["best"]["cell"]["method"] for row in limited], [None, None, "coulomb"])
        # What was recorded at other moments than those two is not held against them.
        some = [(self.row(name, step, scene="arm", processing_s=s), {t: 0 for t in times})
                for name, step, s, times in (("lemke", "0.01", 8, (0, 1)), ("convex", "0.01", 9, (0, 1)),
                                             ("lemke", "0.1", 2, (0, 1)), ("path", "0.01", 7, (0.5, 1.5)), ("path", "0.1", 1,
                                                                                                            (0.5, 1.5)))]
        alike = ladder.steps_down(self.results(some), "arm", "", 0.2, None)[0]
        self.assertEqual((alike["basis"], alike["best"]["cell"]["solver"], alike["best"]["step"]), ("alike", "lemke", "0.1"))

    def test_of_a_scene_that_nobody_got_through_the_one_that_came_furthest_is_named(self):
        stopped = {"status": "ray", "finished": "false"}
        results = self.results([
            (self.row(name, t_reached=t, **stopped), None) for name, t in (("lemke", "9.5"), ("convex", "10.5"), ("path", ""))])
        self.assertEqual(
            ladder.furthest(results, "box", ""), "convex, epsilon 1e-12 J, step=0.01: ray at 10.5 s, contactbench run box.xml "
            "--method convex --solver ipm --step 0.01 --epsilon 1e-12")
        self.assertEqual(ladder.furthest(results, "arm", ""), "")

    def test_all_settings_of_a_scene_are_printed_by_time_with_what_stopped_them_last(self):
        rows = [
            self.row("lemke", processing_s=3, max_gain_relative="1.5e-7", **{ERROR: 1.25e-3}),
            self.row("convex", processing_s=1, **{ERROR: 2.5e-3}),
            self.row("path", step="", knobs="", status="crash", finished="false", t_reached="0.25")]
        results = self.results([(row | {"reference": "analytic"}, None) for row in rows])
        with contextlib.redirect_stdout(io.StringIO()) as said:
            compare.show(results)
        lines = said.getvalue().splitlines()
        self.assertEqual(lines[0].split(), ["method", "step,", "s", "error,", "m", "s", "a", "simulated", "s", "gain", "ended"])
        self.assertEqual([line.split() for line in lines[1:4]],
                         [["convex,", "epsilon", "1e-12", "J", "0.01", "0.0025", "0.5", "ok"],
                          ["A-P", "Lemke,", "k", "=", "8", "0.01", "0.00125", "1.5", "1.5e-07", "ok"],
                          ["A-P", "PATH,", "k", "=", "8", "crash", "at", "0.25", "s"]])

    def test_flags_that_make_no_sense_and_scenes_that_are_not_there_end_with_2(self):
        for words in (["--duration", "0"], ["--duration", "inf"], ["--limit", "-1"], ["--limit", "nan"]):
            with mock.patch.object(sys, "argv",
                                   ["compare.py", "box", *words]), contextlib.redirect_stderr(io.StringIO()) as said:
                with self.assertRaises(SystemExit) as ended:
                    compare.main()
            self.assertEqual(ended.exception.code, 2)
            self.assertIn(f"argument {words[0]}: {words[1]}: must be a positive number", said.getvalue())
        wrong = mock.Mock(side_effect=compare.recommend.WrongInput("no such scene"))
        with mock.patch.object(sys, "argv", ["compare.py", "there/box.xml"]), mock.patch.object(
                compare.recommend, "sweep_of", wrong):
            with contextlib.redirect_stderr(io.StringIO()) as said:
                self.assertEqual(compare.main(), 2)
        self.assertEqual(said.getvalue(), "compare: no such scene\n")
        self.assertEqual((str(wrong.call_args.args[0].out), wrong.call_args.args[0].limit), ("box", 20))

    def test_the_way_on_is_that_of_the_same_scene(self):
        for words, way in ((["stack"], "stack --error E --out stack"),
                           (["stack", "--duration", "3.1415927"], "stack --duration 3.1415927 --error E --out stack"),
                           (["stack", "--set", "boxes = 4", "--set", "mu=1", "--duration", "0.5", "--out", "four"],
                            "stack --set boxes=4 --set mu=1 --duration 0.5 --error E --out four"),
                           (["my.xml", "--set", "lean = atan(0.5)", "--out", "my own"], "my.xml --set 'lean=atan(0.5)' --error E --out 'my own'")):
            with mock.patch.object(sys, "argv", ["compare.py", *words]), contextlib.redirect_stdout(io.StringIO()) as said, \
                    mock.patch.object(compare.recommend, "sweep_of", lambda *_, **__: None), \
                    mock.patch.object(compare, "show"), mock.patch.multiple(compare.report, draw=mock.DEFAULT, write=mock.DEFAULT):
                self.assertEqual(compare.main(), 0)
            self.assertTrue(said.getvalue().endswith(f"which to use: scripts/recommend.py {way}\n"), said.getvalue())

    def test_a_command_is_what_a_shell_takes(self):
        self.assertEqual(made.cell(parameters="lean=atan(0.5)", method="mirtich", solver="").command,
                         "contactbench run box.xml --method mirtich --set 'lean=atan(0.5)'")

    def test_without_a_reference_settings_are_printed_by_how_far_they_move(self):
        results = self.results([
            (self.row("lemke", step, processing_s=s), {0: 0, 1: x}) for step, s, x in (("0.01", 1, 2.5), ("0.001", 3, 1))])
        with contextlib.redirect_stdout(io.StringIO()) as said:
            compare.show(results)
        lines = said.getvalue().splitlines()
        self.assertIn("moves, m", lines[0])
        self.assertEqual([line.split()[5:8] for line in lines[1:3]], [["0.01", "1.5", "0.5"], ["0.001", "1.5", "1.5"]])
        self.assertTrue(lines[3].startswith("moves: how far"))


class Advice(Results):
    """Two scenes; in s a simulated second and m: what is cheapest changes with the error."""
    def some(self):
        rows = []
        for scene, name, seconds, error, more in (("sliding_box", "mirtich", (1, 1.2), 5e-3, {}), ("sliding_box", "lemke",
                                                                                                   (2, 3), 5e-5, {}),
                                                  ("sliding_box", "convex", (2.5, 4), 6e-5,
                                                   {}), ("sliding_box", "newton",
                                                         (8, 9), 5e-7, {}), ("arm", "lemke", (3, 3.1), 2e-2, {
                                                             "parameters": "n=2"}), ("arm", "early", (4, 4.1), 5e-3, {
                                                                 "parameters": "n=2"}), ("arm", "convex", (6, 6.2), 4e-3, {
                                                                     "parameters": "n=2"})):
            for n, s in enumerate(seconds, 1):
                rows.append((self.row(name, scene=scene, repeat=n, processing_s=2 * s,
                                      busy="true" if name == "newton" else "false", **{ERROR: error} | more), None))
        return rows

    def test_the_cheapest_and_the_runner_up_stand_under_the_wanted_error_with_times_and_cost(self):
        section = sections.advice(self.results(self.some()))
        (table, ), _ = made.page("advice", section.shown)
        lines = {cells[0]: dict(zip(table[0][1:], cells[1:])) for cells in table[1:]}
        box, arm = lines["sliding box, 2 s"], lines["arm n=2, 2 s"]
        self.assertEqual(table[0], ["scene", "0.01 m", "0.0001 m", "1e-06 m", "1e-09 m"])
        self.assertEqual(
            box["0.01 m"],
            "Mirtich, step 0.01 s | 0.005 m in 1.1 (1 to 1.2) s | then A-P Lemke, k = 8, step 0.01 s: 2.3 times the cost")
        self.assertEqual(
            box["0.0001 m"],
            "A-P Lemke, k = 8, step 0.01 s | 5e-05 m in 2.5 (2 to 3) s | then convex, epsilon 1e-12 J, step 0.01 s: "
            "1.3 times the cost, not told apart")
        self.assertEqual(box["1e-06 m"], "Coulomb Newton, step 0.01 s | 5e-07 m in 8.5* (8 to 9) s")
        self.assertEqual(box["1e-09 m"], "none did | nearest: 5e-07 m, Coulomb Newton, step 0.01 s")
        self.assertEqual(arm["0.01 m"], "convex, epsilon 1e-6 J, step 0.01 s | 0.005 m in 4.05 (4 to 4.1) s")
        self.assertEqual(arm["0.0001 m"], "none did | nearest: 0.004 m, convex, epsilon 1e-12 J, step 0.01 s")
        answers = section.timing["answers"]
        self.assertEqual(
            {
                name: (of["best"].split("__")[1 + (name[0] == "a")], of["runner_up"] and of["runner_up"].split("__")[1])
                for name, of in answers.items()}, {
                    "sliding box 0.01": ("mirtich", "ap"), "sliding box 0.0001": ("ap", "convex"),
                    "sliding box 1e-06": ("coulomb", None), "arm n=2 0.01": ("convex", None)})
        text = " ".join(section.shown["text"])
        self.assertIn(
            "Of 4 answers to a scene and an error, the cheapest is Mirtich "
            "in 1, A-P Lemke in 1, Coulomb Newton in 1, convex in 1.", text)
        self.assertIn(
            "convex: epsilon = 1e-12 in place of 1e-6 lowered the error by "
            "more than a tenth in 1 of 1 cases and raised it in 0, at 1.5 times the cost", text)
        self.assertIn(
            "sliding box: the least error is 5e-07 m, by Coulomb Newton, step 0.01 s; what is left is mostly of the step.",
            text)
        self.assertIn("a box that should tip slides", text)
        self.assertEqual(section.timing["text"], section.shown["text"])
        self.assertTrue(section.shown["rows"].alone)
        self.assertEqual(sections.advice(made.results(self.top, [made.row()])).shown, {"rows": {}, "sweep": "error_time"})

    def test_what_a_finer_knob_bought_is_counted_at_the_same_step_and_solver_beyond_a_tenth(self):
        # Pairs by step: coarse and fine error, coarse and fine seconds.
        pairs = {
            "0.1": (1.0, 0.89, 1, 2), "0.2": (1.0, 0.91, 1, 8), "0.3": (0.89, 1.0, 2, 2), "0.4": (0.91, 1.0, 1, 4),
            "0.5": (5e-13, 1e-13, 1, 4), "0.6": (1e-13, 5e-13, 1, 4)}
        rows = [(self.row("lemke", step, k=k, processing_s=s, **{ERROR: e}), None)
                for step, (coarse, fine, a, b) in pairs.items() for k, e, s in (("4", coarse, a), ("8", fine, b))]
        # Neither another solver nor a pair of which one stopped is one.
        rows += [(self.row("path", "0.1", k="8", **{ERROR: 0.1}), None), (self.row("lemke", "0.7", k="4", **{ERROR: 1}), None),
                 (self.row("lemke", "0.7", k="8", status="ray", finished="false", **{ERROR: 0.1}), None)]
        text = sections.knob(self.results(rows), [("box", "")], "ap", "k", "4", "8")
        self.assertIn(
            "k = 8 in place of 4 lowered the error by more than a tenth in "
            "1 of 6 cases and raised it in 1, at 4 times the cost (median)", text)
        self.assertEqual(sections.knob(self.results(rows), [("box", "")], "convex", "k", "4", "8"), "")
        # Nor are two accuracies.
        to = lambda accuracy, k, error, **more: (self.row("lemke", "", knobs=f"accuracy={accuracy}", k=k, **{ERROR: error}, **more), None)
        some = [to("1e-3", "4", 1.0), to("1e-3", "8", 0.5), to("1e-5", "4", 0.1), to("1e-5", "8", 9, status="ray", finished="false")]
        self.assertIn("in 1 of 1 cases and raised it in 0", sections.knob(self.results(some), [("box", "")], "ap", "k", "4", "8"))

    def test_what_a_turned_polygon_errs_by_is_said_with_its_fewest_and_most_edges(self):
        rows = [(self.row("convex", **{ERROR: 1e-3}), None)]
        for angle, errors in ((math.pi, (0.5, 0.25, 0.125)), (0, (7, 8, 9))):
            rows += [(self.row("lemke", sweeps="polygons", scene="my_box", k=k, parameters=f"rotate_cone={angle / k!r}", **{
                ERROR: e}), None) for k, e in zip((16, 4, 64), (errors[1], errors[0], errors[2]))]
        text, = (line for line in sections.advice(self.results(rows)).shown["text"] if "corners" in line)
        self.assertIn("my box with the polygon turned by pi/k errs by 0.5 m at k = 4 and by 0.12 m at k = 64.", text)

    def test_what_is_left_at_the_best_is_said_of_the_reference_too(self):
        results = self.results([(self.row("convex", error_certified_linf_m=3e-4), None)], references={
            "box": {"uncertainty_m": 2e-5}})
        self.assertIn(
            "box: the least error is 0.0003 m (the reference is known to "
            "2e-05 m), by convex, epsilon 1e-12 J, step 0.01 s; what is left is mostly of the step.",
            sections.limit(results, ("box", "")))
        results = self.results([(self.row("convex", status="inaccurate", **{ERROR: 1}), None)])
        self.assertIn("box: no run ended ok", sections.limit(results, ("box", "")))

    def test_fronts_errors_and_what_they_are_against_stand_in_their_tables(self):
        some = self.some() + [
            (self.row("path", scene="sliding_box", status="ray", finished="false", t_reached=1, **{ERROR: 1}), None)]
        members = [
            self.row("mirtich", scene="sliding_box", member=1, **{ERROR: 8e-3}),
            self.row("lemke", scene="sliding_box", member=1, **{ERROR: 5e-5})]
        for row, _ in some:
            row["reference"] = "analytic"
        results = self.results(some, members, references={
            "grasp": {"accepted": False, "reason": "methods part"}, "x": {"accepted": True}})
        section = sections.error_time(results)
        (against, arm_or_box, arm, *budgets), _ = made.page("error_time", section.shown)
        self.assertEqual(against[1:],
                         [["sliding box", "position_linf_m", "2 s", "analytic"],
                          ["arm n=2", "position_linf_m", "2 s", "analytic"], ["grasp", "", "", "missing: methods part"]])
        self.assertEqual(
            [cells[:4] for cells in arm_or_box[1:]],
            [["Mirtich", "0.01", "1.1 (1 to 1.2)", "0.0065 [0.005 to 0.008]"],
             ["A-P Lemke, k = 8", "0.01", "2.5 (2 to 3)", "5e-05"], ["Coulomb Newton", "0.01", "8.5* (8 to 9)", "5e-07"]])
        self.assertEqual(arm_or_box[1][4], "contactbench run sliding_box.xml --method mirtich --step 0.01")
        self.assertEqual([cells[0] for cells in arm[1:]],
                         ["A-P Lemke, k = 8", "convex, epsilon 1e-6 J", "convex, epsilon 1e-12 J"])
        line = next(cells for cells in budgets[0][1:] if cells[0] == "Coulomb Newton")
        self.assertEqual(line[:7], ["Coulomb Newton", "0.01", "0", "0", "5e-07", "step", "5e-07"])
        points = {p["run"]: p for p in section.data["points"]}
        lemke = next(p for run, p in points.items() if run.startswith("sliding_box__ap__lemke"))
        self.assertEqual({key: lemke[key] for key in lemke if key != "run"}, {
            "scene": "sliding_box", "parameters": "", "step": "0.01", "measure": "position_linf_m", "status": "ok",
            "error": 5e-5})
        self.assertEqual(len(points), 8)
        timed = next(p for p in section.timing["points"] if p["run"].startswith("sliding_box__coulomb"))
        self.assertEqual([timed[key] for key in ("time", "least", "most", "repeats", "busy")], [8.5, 8, 9, 2, True])
        self.assertEqual([run.split("__")[1] for run in section.timing["pareto"]["sliding box"]], ["mirtich", "ap", "coulomb"])
        self.assertEqual(list(section.data["budget"]), ["sliding box", "arm n=2"])

    def test_the_budget_has_each_part_under_its_head(self):
        rows = [(self.row("newton", **{ERROR: 1e-3}), {0: 0, 1: 1}),
                (self.row("lemke", **{ERROR: 8, "error_polygon_position_linf_m": 3e-4}), {0: 0, 1: 1.5}),
                (self.row("path", **{ERROR: 9}), {0: 0, 1: 1.75})]
        *_, budget = made.page("error_time", sections.error_time(self.results(rows)).shown)[0]
        self.assertEqual(budget[0][:7],
                         ["method", "step, s", "solver, m", "model, m", "step, m", "largest", "against the reference, m"])
        self.assertEqual([cells[:7] for cells in budget[2:]],
                         [["A-P Lemke, k = 8", "0.01", "0", "0.5", "0.0003", "model", "8"],
                          ["A-P PATH, k = 8", "0.01", "0.25", "0.5", "0.0003", "model", "9"]])

    def test_what_the_page_s_script_draws_are_the_points_with_an_error(self):
        some = self.some() + [
            (self.row("path", scene="sliding_box", status="inaccurate", processing_s=6, **{ERROR: 2e-3}), None),
            (self.row("nsgs", scene="sliding_box"), None)]
        members = [
            self.row("mirtich", scene="sliding_box", member=n, status=status, **{ERROR: e})
            for n, e, status in ((1, 8e-3, "ok"), (2, 2e-3, "ok"), (3, 0, "ray"))]
        shown = sections.error_time(self.results(some, members)).shown["hover"]
        json.dumps(shown, allow_nan=False)
        self.assertEqual({name: [p["label"] for p in of] for name, of in shown["scenes"].items()}, {
            "sliding box": [
                f"{of}, step 0.01 s"
                for of in ("Mirtich", "A-P Lemke, k = 8", "convex, epsilon 1e-12 J", "Coulomb Newton", "A-P PATH, k = 8")],
            "arm n=2": [
                f"{of}, step 0.01 s" for of in ("A-P Lemke, k = 8", "convex, epsilon 1e-6 J", "convex, epsilon 1e-12 J")]})
        points = {p["label"].partition(",")[0]: p for p in shown["scenes"]["sliding box"]}
        mirtich = points["Mirtich"]
        self.assertEqual([
            mirtich[key]
            for key in ("error", "few", "worst", "good", "time", "least", "most", "repeats", "uncertainty", "status", "key")],
                         [8e-3, 2e-3, 1e300, True, 1.1, 1, 1.2, 2, 0, "ok", "Mirtich"])
        self.assertEqual([points[name]["good"] for name in ("A-P Lemke", "A-P PATH", "Coulomb Newton")], [True, False, True])
        self.assertEqual(points["A-P Lemke"]["command"],
                         "contactbench run sliding_box.xml --method ap --solver lemke --step 0.01 --k 8")
        # A method has its colour of the pictures.
        self.assertEqual(shown["colours"], {
            "Mirtich": "#CC79A7", "A-P Lemke": "#0072B2", "convex": "#000000", "Coulomb Newton": "#332288",
            "A-P PATH": "#56B4E9"})
        self.assertEqual(sections.hover([]), {"scenes": {}, "colours": {}})

    def test_a_scene_without_members_that_ended_is_drawn_with_its_own_error(self):
        point = {
            "run": "r", "error": 1.0, "errors": [1.0, math.inf], "worst": math.inf, "uncertainty": 0, "status": "ok", "time": 1,
            "least": 1, "most": 1, "repeats": 1, "scene": "s", "parameters": ""}
        shown = sections.hover([point | {"cell": made.cell(method="new", solver="")}])
        self.assertEqual([shown["scenes"]["s"][0][key] for key in ("error", "few")], [1.0, 1.0])
        self.assertEqual(shown["colours"], {"new": sections.COLOURS[0]})


if __name__ == "__main__":
    unittest.main()
