"""The table of runs (gather.py), its cells (runs.py) and Table I (table1.py): every number under its own head, on runs whose
numbers are all different."""
import csv
import dataclasses
import math
import statistics
import unittest

import made
import numpy as np
from contactbench import gather, plan, references, sections, table1
from contactbench.runs import Cell, Runs, series
from folder import Folder


class Gathered(Folder):
    """What a run wrote, as a row."""

    one = plan.Run("box", (("mu", "0.3"), ), "ap", "", "lemke", (("step", "1e-2"), ("k", "8")), 2, sweeps=("one", "two"))
    # Each field another number; times that add up to no other.
    summary = {
        "engine": {"setting": "tuned", "precision": "single"}, "reference": {"kind": "analytic"}, "steps": 101, "events": 102,
        "options": {"step": 0.01, "duration": 3.5, "compression_bound": True}, "contacts_max": 103, "solves": 104,
        "iterations_total": 105, "time": {
            "total_s": 1000, "dynamics_s": 1, "collision_s": 2, "assembly_s": 4, "solve_s": 8, "write_s": 16}, "residuals": {
                "max": 0.21, "median": 0.22, "law_max": 0.23, "gap_max_j": 0.24, "infeasibility_max": 0.25,
                "inaccurate_events": 106, "false_claims": 107}, "max_penetration": 0.31, "energy": {
                    "max_gain_j": 0.41, "max_gain_relative": 0.42}, "accuracy": {
                        "estimated_error_m": 0.51, "switches": 108, "impacts": 109,
                        "first_order_steps": 110}, "t_reached": 3.25, "peak_memory_mb": 77.5, "errors": {
                            "final_m": 0.61, "other_m": None}}

    def record(self, **more):
        return self.one.asked() | {
            "status": "ok", "reason": "none", "finished": True, "wall_s": 32.5, "other_cores": 0.125, "busy": False,
            "t_reached": 9.0, "peak_memory_mb": 99.0} | more

    def test_every_column_is_of_the_field_of_its_name(self):
        row = gather.row_of(self.one, self.record(), self.summary, self.top, None)
        self.assertEqual(
            row, {
                "run": "box__mu-0.3__ap__lemke__h1e-2__k8__r2", "sweeps": "one two", "scene": "box", "parameters": "mu=0.3",
                "method": "ap", "variant": "", "solver": "lemke", "k": "8", "epsilon": "", "knobs": "step=1e-2", "repeat": "2",
                "member": "0", "engine": "", "setting": "tuned", "precision": "single", "status": "ok", "reason": "none",
                "finished": "true", "reference": "analytic", "step": "0.01", "duration": "3.5", "compression_bound": "true",
                "t_reached": "3.25", "steps": "101", "events": "102", "contacts_max": "103", "solves": "104",
                "iterations_total": "105", "processing_s": "15", "total_s": "1000", "dynamics_s": "1", "collision_s": "2",
                "assembly_s": "4", "solve_s": "8", "write_s": "16", "wall_s": "32.5", "other_cores": "0.125", "busy": "false",
                "peak_memory_mb": "77.5", "residual_max": "0.21", "residual_median": "0.22", "law_residual_max": "0.23",
                "gap_max_j": "0.24", "infeasibility_max": "0.25", "inaccurate_events": "106", "false_claims": "107",
                "max_penetration": "0.31", "max_gain_j": "0.41", "max_gain_relative": "0.42", "estimated_error_m": "0.51",
                "switches": "108", "impacts": "109", "first_order_steps": "110", "error_final_m": "0.61", "error_other_m": ""})

    def test_times_memory_and_who_else_used_the_machine_are_no_numbers_of_the_input(self):
        times = {column for column, source in gather.COLUMNS.items() if (source or "").startswith("time.")}
        self.assertEqual(len(times), 6)
        self.assertEqual(set(gather.TIMING), times | {"processing_s", "wall_s", "other_cores", "busy", "peak_memory_mb"})

    def test_a_run_that_could_not_say_it_is_judged_from_outside_and_what_is_missing_is_empty(self):
        row = gather.row_of(self.one, self.record(finished=False), {}, self.top, None)
        self.assertEqual((row["t_reached"], row["peak_memory_mb"], row["wall_s"]), ("9.0", "99.0", "32.5"))
        self.assertEqual((row["processing_s"], row["solves"], row["false_claims"], row["busy"]), ("", "", "", "false"))
        # A part of the time that is missing makes no smaller sum.
        self.assertIsNone(gather.processing_s({"time": {"dynamics_s": 1, "collision_s": 1, "assembly_s": 1}}))

    def test_the_error_against_a_reference_is_that_of_a_run_to_its_end(self):
        (self.top / "trajectory.csv").write_text("t,body,px,py,pz\n0,a,0,0,0\n3.5,a,0,3,4\n")
        certified = references.Reference({"until": 3.5}, {(0.0, "a"): (0, 0, 0), (3.5, "a"): (0, 0, 0)})
        row = gather.row_of(self.one, self.record(), self.summary, self.top, certified)
        self.assertEqual(row["error_certified_linf_m"], "5.0")
        row = gather.row_of(self.one, self.record(finished=False), self.summary, self.top, certified)
        self.assertNotIn("error_certified_linf_m", row)
        # With another friction than the scene's own the bodies should be elsewhere.
        for knob, told in (("step", True), ("friction", False), ("restitution", False)):
            run = dataclasses.replace(self.one, knobs=((knob, "0.5"), *self.one.knobs))
            row = gather.row_of(run, self.record(), self.summary, self.top, certified)
            self.assertEqual("error_certified_linf_m" in row, told, knob)

    def test_each_run_is_held_against_the_reference_of_its_scene_and_parameters(self):
        runs = [
            plan.Run(scene, sets, "ap", "", "lemke", (("k", "8"), ), 1)
            for scene, sets in (("box", (("mu", "0.3"), )), ("box", ()), ("arm", (("mu", "0.3"), )))]
        for n, run in enumerate(runs, 1):
            folder = self.top / run.name
            folder.mkdir()
            (folder / "run.json").write_text(gather.json.dumps(run.asked() | self.record() | {"scene": run.scene}))
            (folder / "summary.json").write_text(
                gather.json.dumps({"options": {"duration": 1.0}, "t_reached": 1, "peak_memory_mb": 1}))
            (folder / "trajectory.csv").write_text(f"t,body,px,py,pz\n0,a,0,0,0\n1,a,{n},0,0\n")
        motion = {(0.0, "a"): (0, 0, 0), (1.0, "a"): (0, 0, 0)}
        certified = {("box", "mu=0.3"): references.Reference({"until": 1.0}, motion),
                     ("arm", "mu=0.3"): references.Reference({}, None)}
        rows, summaries = gather.rows_of([*runs, plan.Run("none", (), "ap", "", "", (), 1)], self.top, certified)
        self.assertEqual([row.get("error_certified_linf_m") for row in rows], ["1.0", None, ""])
        self.assertEqual(len(summaries), 3)

    def test_the_manifest_counts_what_the_table_holds(self):
        def done(run, status, busy, machine=None):
            folder = self.top / "runs" / run.name
            folder.mkdir(parents=True)
            summary = {"machine": machine, "versions": {"git": "abc"}} if machine else {"versions": {"git": "abc"}}
            record = run.asked() | {
                "status": status, "reason": None, "finished": True, "wall_s": 1, "other_cores": 0, "busy": busy, "t_reached": 1,
                "peak_memory_mb": 1}
            (folder / "run.json").write_text(gather.json.dumps(record))
            (folder / "summary.json").write_text(gather.json.dumps(summary))

        def run(repeat, member=0, scene="box"):
            return plan.Run(scene, (), "ap", "", "lemke", (("k", "8"), ), repeat, member)

        # In the order in which they are done; two of six are not done yet.
        runs = [run(1), run(1, scene="arm"), run(2), run(2, scene="arm"), run(3), run(3, scene="arm")]
        for one, status, busy in zip(runs[:4], ("ok", "ray", "ok", "inaccurate"), (True, None, False, True)):
            done(one, status, busy, {"cores": 2})
        members = [run(1, 2), run(1, 1), run(1, 1, "arm")]
        for one in members:
            done(one, "ok", None, {"cores": 2})
        certified = {("box", "mu=0.3"): references.Reference(
                         {
                             "accepted": False, "reason": "no", "accuracy_m": 1e-8, "duration": 5, "until": 4,
                             "uncertainty_m": 2, "runs": []}, None)}
        gather.gather(runs, members, {"dart": "not here"}, self.top / "runs", self.top, ["one"], "quick", certified)
        manifest = gather.read_json(self.top / "manifest.json")
        machine = manifest.pop("python")
        self.assertEqual(
            manifest, {
                "sweeps": ["one"], "profile": "quick", "runs": 4, "runs_not_done_yet": 2, "members": 3, "missing": {
                    "dart": "not here"}, "statuses": {"inaccurate": 1, "ok": 2, "ray": 1}, "machine": {"cores": 2},
                "versions": {"git": "abc"}, "references": {
                    "box__mu-0.3": {
                        "accepted": False, "reason": "no", "accuracy_m": 1e-8, "duration": 5, "until": 4, "uncertainty_m": 2}
                }, "timing": {"runs_on_a_busy_machine": 2, "runs_not_judged": 1}})
        self.assertRegex(machine, r"^3\.\d+$")
        # Repeats of a cell lie together, cells in the order of the sweep; members by their number.
        names = {}
        for file in ("runs.csv", "ensemble.csv"):
            with open(self.top / file, newline="") as table:
                names[file] = [(r["scene"], r.get("member"), r["repeat"]) for r in csv.DictReader(table)]
        self.assertEqual(names["runs.csv"], [("box", None, "1"), ("box", None, "2"), ("arm", None, "1"), ("arm", None, "2")])
        self.assertEqual(names["ensemble.csv"], [("box", "1", "1"), ("box", "2", "1"), ("arm", "1", "1")])
        # Where summaries differ all stand; without members there is no table of them.
        self.assertEqual(gather.same_or_list([{"a": 1}, {}, {"a": 2}, {"a": 1}], "a"), [1, 2])
        gather.gather(runs, [], {}, self.top / "runs", self.top, ["one"], "quick", {})
        self.assertFalse((self.top / "ensemble.csv").exists())

    def test_rows_that_are_put_in_place_bring_their_columns_and_what_is_counted_is_counted_again(self):
        run = plan.Run("box", (), "ap", "", "lemke", (("k", "8"), ), 1, sweeps=("one", ))
        member = dataclasses.replace(run, member=1)
        rows = [{"run": run.name, "sweeps": "paper orders", "error_old_m": "1"}, {"run": "other__r1", "status": "ray", "busy": "true"}]
        made.results(self.top, rows, [{"run": member.name, "member": "1", "error_old_m": "2"}], machine={"cpu": "a"},
                     statuses={"ok": 1, "ray": 1}, timing={"runs_on_a_busy_machine": 1, "runs_not_judged": 0})
        for some, error in ((run, 0.25), (member, 0.5)):
            folder = self.top / "runs" / some.name
            folder.mkdir()
            (folder / "run.json").write_text(gather.json.dumps(self.record(status="inaccurate", busy=True) | some.asked()))
            (folder / "summary.json").write_text(gather.json.dumps({"errors": {"new_m": error}, "machine": {"cpu": "b"}}))
        gather.put_in_place([run], [member], self.top / "runs", self.top, {})
        found = {}
        for file in ("runs.csv", "ensemble.csv"):
            with open(self.top / file, newline="") as table:
                found[file] = [(r["run"], r["sweeps"], r["status"], r["error_old_m"], r["error_new_m"]) for r in csv.DictReader(table)]
        self.assertEqual(found, {
            "runs.csv": [(run.name, "paper orders", "inaccurate", "", "0.25"), ("other__r1", "paper", "ray", "", "")],
            "ensemble.csv": [(member.name, "paper", "inaccurate", "", "0.5")]})
        manifest = gather.read_json(self.top / "manifest.json")
        self.assertEqual({key: manifest[key] for key in ("statuses", "timing", "machine")}, {
            "statuses": {"inaccurate": 1, "ray": 1}, "timing": {"runs_on_a_busy_machine": 2, "runs_not_judged": 0},
            "machine": [{"cpu": "a"}, {"cpu": "b"}]})
        # And once more, on a third machine.
        (self.top / "runs" / run.name / "summary.json").write_text(gather.json.dumps({"machine": {"cpu": "c"}}))
        gather.put_in_place([run], [], self.top / "runs", self.top, {})
        self.assertEqual(gather.read_json(self.top / "manifest.json")["machine"], [{"cpu": cpu} for cpu in "abc"])

    def test_a_member_that_came_to_the_same_settles_and_rounding_is_no_difference(self):
        row = {"status": "ok", "error_a": "2.0", "error_b": "", "processing_s": "1"}
        for other, settled in (({}, True), ({"processing_s": "9"}, True), ({"error_a": "2.000000001"}, True), ({
                "error_a": "2.00000001"}, False), ({"error_b": "0.0"}, False), ({
                    "error_c": "1"}, False), ({"status": "ray"}, False)):
            self.assertIs(gather.settled(row, row | other), settled, other)
        self.assertIs(gather.settled(row, {"status": "ok"}), False)
        # As a fraction of the smaller one, and of 1 where both are small.
        for a, b, same in ((1e9, 1e9 + 0.9, True), (1e9, 1e9 + 1.1, False), (0.0, 0.9e-9, True), (0.0, 1.1e-9, False),
                           (-2.0, 2.0, False), (True, 1, True), ("a", "b", False), (None, 0.0, False)):
            self.assertIs(gather.close(a, b), same, (a, b))


class Cells(Folder):
    def test_a_cell_is_the_median_of_its_finished_repeats_and_says_what_stopped_the_others(self):
        def repeats(*rows):
            return Cell([made.row(run=f"r{n}", **of) for n, of in enumerate(rows, 1)], self.top)

        whole = repeats({"processing_s": 5}, {"processing_s": 1, "busy": "true"}, {"processing_s": 2})
        self.assertEqual((whole["run"], whole.times, whole.seconds, whole.busy, whole.finished),
                         ("r3", [5, 1, 2], 2, True, True))
        self.assertEqual((whole.how_it_ended, whole.cut, whole.folder), ("", "", self.top / "r3"))
        ray = {"status": "ray", "finished": "false", "t_reached": "0.12345"}
        part = repeats({"processing_s": 4}, ray | {"processing_s": 9}, {"processing_s": 6})
        self.assertEqual((part.times, part.seconds, part.finished, part.busy), ([4, 6], 5, False, False))
        self.assertEqual((part.how_it_ended, part.cut), ("ray at 0.123 s", ""))
        late = repeats({}, {"status": "time_limit", "finished": "false", "t_reached": ""})
        self.assertEqual((late.how_it_ended, late.cut), ("time_limit", "time_limit"))
        self.assertEqual(repeats({"processing_s": 5}, {"processing_s": 1})["run"], "r2")  # of two in the middle the quicker
        # One that died before it could say its time is the slowest of all.
        dead = {"status": "crash", "finished": "false", "t_reached": "", "processing_s": ""}
        self.assertEqual((repeats(dead, {"processing_s": 5})["run"], repeats(dead, {"processing_s": 5}, {"processing_s": 1})["run"]),
                         ("r2", "r2"))
        doubtful = repeats({"status": "inaccurate"})
        self.assertEqual((doubtful.how_it_ended, doubtful.finished), ("inaccurate", True))
        self.assertTrue(math.isnan(repeats(ray).seconds))

    def test_its_names_say_the_method_and_all_that_was_asked(self):
        polygon = made.cell(scene="stack", parameters="boxes=4 mu=0.5", solver="path", k="16", knobs="step=1e-3 prune=off",
                            repeat="2")
        self.assertEqual((polygon.name, polygon.with_k, polygon.label),
                         ("A-P PATH", "A-P PATH, k = 16", "A-P PATH, k = 16, step=1e-3 prune=off"))
        self.assertEqual(
            polygon.command, "contactbench run stack.xml --method ap --solver path --step 1e-3 --prune off --k 16 "
            "--set boxes=4 --set mu=0.5")
        self.assertEqual((polygon.key, polygon.knob("prune"), polygon.knob("order")), (("ap", "path"), "off", ""))
        self.assertEqual((polygon.way, polygon.step_or_accuracy), ("step 0.01 s", "0.01"))
        self.assertEqual(polygon.unrepeated, polygon["run"].removesuffix("__r2"))
        newton = made.cell(method="newton", solver="", variant="uncapped")
        self.assertEqual((newton.name, newton.key), ("Newton uncapped", ("newton", "uncapped")))
        convex = made.cell(**made.EPS, knobs="accuracy=1e-6")
        self.assertEqual((convex.name, convex.with_k, convex.key), ("convex, epsilon 1e-12 J", ) * 2 + (("convex", "ipm"), ))
        self.assertEqual((convex.way, convex.step_or_accuracy), ("accuracy 1e-6 m", "to 1e-6 m"))
        engine = made.cell(method="ode", solver="", variant="quick", engine="ode", knobs="setting=tuned")
        self.assertEqual((engine.name, engine.command),
                         ("ODE quick", "contactbench run box.xml --engine ode --variant quick --setting tuned"))

    def test_methods_and_engines_have_the_names_that_readers_know(self):
        for method, choice, name in (("ap", "lemke", "A-P Lemke"), ("ap", "ynl", "A-P YNL"),
                                     ("ap", "path-lib", "A-P PATH library"), ("ap", "pgs", "A-P pgs"),
                                     ("coulomb", "newton", "Coulomb Newton"), ("coulomb", "nsgs", "Coulomb Gauss-Seidel"),
                                     ("coulomb", "admm", "Coulomb ADMM"), ("soft", "sap", "soft SAP"),
                                     ("soft", "mujoco", "soft MuJoCo"), ("mirtich", "", "Mirtich"), ("convex", "ipm", "convex"),
                                     ("ode", "", "ODE"), ("bullet", "", "Bullet"), ("bullet-float", "", "Bullet (float)"),
                                     ("dart", "", "DART"), ("simbody", "", "Simbody"), ("siconos", "nsgs",
                                                                                        "Siconos Gauss-Seidel")):
            self.assertEqual(made.cell(method=method, solver=choice).name, name)

    def test_cells_are_those_of_the_scene_the_sweep_and_the_columns_that_are_asked_for(self):
        rows = [
            made.row(scene=scene, sweeps=sweeps, k=k, repeat=n)
            for scene, sweeps, k, n in (("box", "paper", "8", 1), ("arm", "paper orders", "8", 1), ("box", "papers", "4", 1),
                                        ("box", "paper", "8", 2), ("box", "orders", "16", 1))]
        members = [made.row(scene="arm", member=n, status=status) for n, status in ((1, "ok"), (2, "ray"))]
        results = made.results(self.top, rows, members, missing={"robot": "not here"}, profile="quick")
        asked = lambda *words, **more: [
            (c["scene"], c["k"], len(c.rows), len(c.members)) for c in results.cells(*words, **more)]
        self.assertEqual(asked(), [("box", "8", 2, 0), ("arm", "8", 1, 2)])
        self.assertEqual(asked("box"), [("box", "8", 2, 0)])
        self.assertEqual(asked("box", None), [("box", "8", 2, 0), ("box", "4", 1, 0), ("box", "16", 1, 0)])
        self.assertEqual(asked(sweep="orders"), [("arm", "8", 1, 2), ("box", "16", 1, 0)])
        self.assertEqual(asked(sweep=None, k="8", scene="arm"), [("arm", "8", 1, 2)])
        self.assertEqual([m["status"] for m in results.cells("arm")[0].members], ["ok", "ray"])
        self.assertEqual([results.missing(scene) for scene in ("arm", "robot", "grasp")],
                         ["", "not here", "no run of it is in this profile"])
        self.assertEqual((results.profile, Runs(self.top).runs), ("quick", self.top / "runs"))
        (self.top / "runs/quick").mkdir()
        self.assertEqual(Runs(self.top).runs, self.top / "runs/quick")
        # Another table has its own cells, and no ensemble.
        other = results.seen(results.table[results.table["scene"] == "arm"], aside=3)
        self.assertEqual([(c["scene"], len(c.members)) for c in other.cells()], [("arm", 0)])
        self.assertEqual((other.aside, other.whole, results.whole, len(results.cells())), (3, False, True, 2))

    def test_another_file_is_that_of_the_member_and_its_lack_is_noted(self):
        results = made.results(self.top, [made.row()])
        made.write_rows(self.top / "left_out.csv", [{"what": "own"}])
        made.write_rows(self.top / "members/1/left_out.csv", [{"what": "of the first"}])
        for member, what, lacking in ((0, "own", False), (1, "of the first", False), (2, "own", True)):
            world = results.seen(results.table, aside=member)
            self.assertEqual((list(world.read("left_out.csv")["what"]), world.lacking), ([what], lacking))
        made.write_rows(self.top / "once.csv", [{"what": "of no member"}])
        world = results.seen(results.table, aside=2)
        self.assertEqual((list(world.read("once.csv")["what"]), world.lacking), (["of no member"], False))
        self.assertIsNone(results.read("nothing.csv"))

    def test_columns_of_a_file_are_those_of_a_body_evenly_thinned_and_without_half_a_row(self):
        file = self.top / "t.csv"
        file.write_text("t,body,px,py\n" + "".join(f"{n},{body},{n * by},{-n}\n" for n in range(9)
                                                   for body, by in (("a", 1), ("ab", 2))) + "9,a,9,-")
        np.testing.assert_array_equal(series(file, "py", "t", of=("a", )), [[-n for n in range(9)], list(range(9))])
        np.testing.assert_array_equal(series(file, "px", of=("ab", ), most=3), [[0, 8, 16]])
        self.assertEqual(series(file, "t", "px", of=("b", )).shape, (2, 0))
        self.assertEqual(series(self.top / "none.csv", "t", "px").shape, (2, 0))
        file.write_text("t,px\n1,2\n")
        np.testing.assert_array_equal(series(file, "px", "t"), [[2], [1]])


def times(*seconds, **of):
    return [made.row(repeat=n, processing_s=s, **of) for n, s in enumerate(seconds, 1)]


class TableOne(Folder):
    """On the sliding box (k = 16) and stacks of 2 and 4 boxes; the paper prints 15.01 s for convex on the sliding box and
    5.18 s for A-P Lemke, 0.07 s and 0.29 s for convex on the stacks."""
    def setUp(self):
        super().setUp()
        slides = {"scene": "sliding_box", "duration": "8.0"}
        rows = times(4, 2, 3, **slides, **made.EPS)
        rows += times(9, 7, 5, 6, k="16", **slides)
        rows[-1]["busy"] = "true"
        # Neither another k than the paper's nor other knobs are of the table.
        rows += times(100, k="8", **slides) + times(100, k="16", knobs="step=1e-4", **slides)
        rows += times(1.5, method="newton", solver="", variant="uncapped", status="inaccurate", **slides)
        stopped = made.row(scene="stack", parameters="boxes=2", k="4", repeat="2", status="ray", finished="false",
                           reason="no way on", t_reached="0.2468", processing_s="50", duration="1.0")
        rows += times(0.25, scene="stack", parameters="boxes=2", k="4", duration="1.0") + [stopped]
        rows += times(0.5, scene="stack", parameters="boxes=4", duration="1.0", **made.EPS)
        rows += times(60, scene="stack", parameters="boxes=4", k="4", duration="1.0")
        members = [
            made.row(scene="stack", parameters="boxes=4", k="4", member=n, status=status)
            for n, status in ((1, "ray"), (2, "ok"))]
        self.results = made.results(self.top, rows, members, sweeps=["paper"])
        found = table1.entries(self.results)
        self.rows = {(c["scene"], c["parameters"], c["method"]): row for c, row in found}
        self.assertEqual(len(found), len(self.rows))
        self.shown = table1.grid(self.results, found)

    def test_a_row_has_the_median_least_and_most_of_its_repeats_and_ratios_to_convex_here_and_there(self):
        row = self.rows["sliding_box", "", "ap"]
        self.assertEqual({key: row[key] for key in row if key != "paper_ratio"}, {
            "method": "ap", "variant": "", "solver": "lemke", "epsilon": "", "k": "16", "scene": "sliding_box",
            "parameters": "", "simulated_s": "8.0", "repeats": 4, "status": "ok", "reason": "", "t_reached": "2.0",
            "median_s": 6.5, "minimum_s": 5, "maximum_s": 9, "ratio": 6.5 / 3, "busy": "true", "paper_s": "5.18",
            "paper_certain": "yes"})
        self.assertAlmostEqual(row["paper_ratio"], 5.18 / 15.01)
        convex = self.rows["sliding_box", "", "convex"]
        self.assertEqual([convex[key] for key in ("median_s", "ratio", "paper_s", "paper_ratio", "busy")],
                         [3, 1, "15.01", 1, "false"])
        newton = self.rows["sliding_box", "", "newton"]
        self.assertEqual([newton[key] for key in ("status", "median_s", "ratio", "paper_s")], ["inaccurate", 1.5, 0.5, "0.97"])

    def test_a_cell_of_which_one_repeat_stopped_has_its_status_and_no_time(self):
        row = self.rows["stack", "boxes=2", "ap"]
        self.assertEqual([row[key] for key in ("status", "reason", "t_reached", "repeats")], ["ray", "no way on", "0.2468", 2])
        self.assertEqual([row[key] for key in ("median_s", "minimum_s", "maximum_s", "ratio")], [""] * 4)
        # Without the unit in the column there is no ratio of ours, nor one of the paper's.
        self.assertEqual(row["paper_ratio"], "")
        other = self.rows["stack", "boxes=4", "ap"]
        self.assertEqual((other["ratio"], other["paper_certain"]), (120, "no"))

    def test_ratios_are_of_two_numbers_and_short(self):
        self.assertEqual(
            [table1.over(a, b) for a, b in (("3", 4), ("DNF", 1), (1, "DNF"), (1, 0), ("", 1), (1, math.nan), (1, math.inf))],
            [0.75, "", "", "", "", "", 0.0])
        self.assertEqual([table1.ratio(r) for r in ("", 0.0123, 1.26, 99.4, 99.5, 1234.4)],
                         ["", "0.012", "1.3", "99", "100", "1234"])

    def test_the_page_and_the_files_have_each_cell_under_its_scene(self):
        (table, ), _ = made.page("table_one", self.shown)
        at = {head.partition(" |")[0]: place for place, head in enumerate(table[0])}
        lines = {cells[0]: cells for cells in table[1:]}
        self.assertEqual(table[0][at["sliding box"]], "sliding box | 8 s, k = 16")
        self.assertEqual(table[0][at["grasp"]], "grasp | k = 12")
        self.assertEqual(lines["A-P Lemke"][at["sliding box"]], "6.5* (2.2) | 5.18 (0.35)")
        self.assertEqual(lines["A-P Lemke"][at["stack of 2"]], "ray at 0.247 s | 1.36?")
        self.assertEqual(lines["Newton uncapped"][at["sliding box"]], "1.5 (inaccurate) (0.5) | 0.97 (0.065)")
        self.assertEqual(lines["convex, epsilon 1e-12 J"][at["stack of 4"]], "0.5 (1) | 0.29? (1)")
        self.assertEqual([lines[name][at["grasp"]] for name in lines], [""] * 3)
        table1.write(self.results, self.shown)
        markdown = [[cell.strip() for cell in line.split("|")] for line in (self.top / "table1.md").read_text().splitlines()]
        of = {line[1]: line for line in markdown if len(line) > 2}
        at = next(n for n, head in enumerate(markdown[0]) if head.startswith("sliding box (8 s, k = 16)"))
        self.assertEqual(of["A-P Lemke"][at], "6.5 (2.2) / 5.18 (0.35)")
        self.assertEqual(of["A-P Lemke"][at + 1], "")
        latex = (self.top / "table1.tex").read_text().splitlines()
        self.assertIn(r"\begin{tabular}{l" + "r" * 11 + "}", latex)
        lemke = next(n for n, line in enumerate(latex) if line.startswith("A-P Lemke"))
        self.assertEqual(latex[lemke].split(" & ")[2], "6.5 (2.2)")
        self.assertEqual(latex[lemke + 1].split(" & ")[2], r"\emph{5.18 (0.35)}")
        self.assertEqual(table1.tex("a_b 5% & #1 \\"), r"a\_b 5\% \& \#1 \textbackslash ")
        titles = [
            "impacting sphere", "sliding box", "sticking box", "circular sliding", *(f"stack of {n}" for n in (1, 2, 4, 8, 16)),
            "mobile robot", "grasp"]
        self.assertEqual([title for title, _ in self.shown["columns"]], titles)
        with open(self.top / "table1.csv", newline="") as file:
            heads, *lines = csv.reader(file)
        line = next(line for line in lines if line[:2] == ["ap", ""] and line[5] == "sliding_box")
        self.assertEqual(list(zip(heads, line)), [("method", "ap"), ("variant", ""), ("solver", "lemke"), ("epsilon", ""),
                                                  ("k", "16"), ("scene", "sliding_box"), ("parameters", ""),
                                                  ("simulated_s", "8.0"), ("repeats", "4"), ("status", "ok"), ("reason", ""),
                                                  ("t_reached", "2.0"), ("median_s", "6.5"), ("minimum_s", "5.0"),
                                                  ("maximum_s", "9.0"), ("ratio", repr(6.5 / 3)), ("busy", "true"),
                                                  ("paper_s", "5.18"), ("paper_certain", "yes"),
                                                  ("paper_ratio", repr(5.18 / 15.01)), ("ensemble", "ok 1")])
        with open(self.top / "table1.csv", newline="") as file:
            rows = {(r["parameters"], r["method"]): r for r in csv.DictReader(file)}
        self.assertEqual((rows["boxes=4", "ap"]["ensemble"], rows["", "ap"]["ensemble"]), ("ok 2, ray 1", "ok 1"))
        self.assertEqual((rows["boxes=4", "ap"]["median_s"], rows["boxes=4", "ap"]["minimum_s"]), ("60.0", "60.0"))

    def test_in_the_report_what_follows_the_clock_is_timing_and_so_is_how_far_a_limit_let_it_come(self):
        section = sections.table_one(self.results)
        by = [{(r["scene"], r["parameters"], r["method"]): r for r in section.data["rows"]}, section.timing["rows"]]
        self.assertEqual(by[0]["stack", "boxes=2", "ap"]["reason"], "no way on")
        self.assertEqual({key for row in section.timing["rows"] for key in row},
                         {"median_s", "minimum_s", "maximum_s", "ratio", "busy"})
        self.assertFalse({key for row in section.data["rows"]
                          for key in row} & {"median_s", "minimum_s", "maximum_s", "ratio", "busy"})
        self.assertEqual([r["median_s"] for r in section.timing["rows"]], [r["median_s"] for r in self.rows.values()])
        self.results.table.loc[self.results.table["status"] == "ray", "status"] = "time_limit"
        cut, = (r for r in sections.table_one(self.results.seen(self.results.table)).data["rows"]
                if r["status"] == "time_limit")
        self.assertEqual([key in cut for key in ("reason", "t_reached", "status")], [False, False, True])

    def test_the_times_of_the_paper_are_found_by_method_solver_epsilon_and_scene(self):
        times_of = table1.paper_times()

        def found(scene, parameters="", **of):
            return table1.paper_cell(times_of, made.cell(scene=scene, parameters=parameters, **of))

        # As the paper prints them; convex has a row without epsilon where it says none.
        self.assertEqual(found("sliding_box", **made.EPS | {"epsilon": "1e-2"}), ("13.05", True))
        self.assertEqual(found("grasp", **made.EPS), ("1108.29", True))
        self.assertEqual(found("stack", "boxes=16", **made.EPS), ("79.57", False))
        self.assertEqual(found("impacting_sphere", solver="ynl"), ("126.19", True))
        self.assertEqual(found("stack", "boxes=8", method="mirtich", solver=""), ("178.20", True))
        self.assertEqual(found("nowhere"), ("", True))


class Reading(Folder):
    def test_how_far_repeats_are_apart_is_of_all_cells_that_have_some(self):
        rows = times(2, 3, sweeps="other") + times(1, 4, 2, k="4") + times(7, k="16")
        results = made.results(self.top, rows, sweeps=["paper", "other"],
                               profile="quick", runs=6, statuses={"ok": 5, "ray": 1}, machine={"cpu": "one"}, versions={
                                   "git": "abc"}, python="3.13", missing={"dart": "not here"}, runs_not_done_yet=4, timing={
                                       "runs_on_a_busy_machine": 2}, members=9)
        section = sections.reading(results)
        self.assertEqual(section.timing["spread"], {"cells": 2, "median": statistics.median([1.5, 4.0]), "worst": 4.0})
        self.assertEqual(
            section.data, {
                "profile": "quick", "sweeps": ["paper", "other"], "runs": 6, "members": 9, "missing": {"dart": "not here"},
                "statuses": {"ok": 5, "ray": 1}})
        (table, ), words = made.page("reading", section.shown, profile="quick", worth={
            "exact": 30, "rounding": 4, "sample": 200})
        self.assertEqual(table[1:], [["cpu", "one"], ["git", "abc"], ["python", "3.13"], ["sweeps", "paper, other"],
                                     ["runs", "6, 5 ok, 1 ray"], ["left out: dart", "not here"], ["not done yet", "4"]])
        for said in ("During 2 of 6 runs others used the machine", "Of 2 cells with repeats",
                     "took 2.75 times as long as the quickest (median; 4.00 at worst)", "Of the 234 numbers",
                     "30 repeat exactly, 4 to rounding, 200 are samples", "quick : one run a cell"):
            self.assertIn(said, words)


if __name__ == "__main__":
    unittest.main()
