"""scripts/contactbench/recommend.py: what it says of a choice and of a comparison, the small sweep that it asks for, its
exit codes. On points that are made up, each field another number; test_recommend.py has it on runs."""
import contextlib
import io
import json
import math
import tomllib
import types
import unittest
from pathlib import Path
from unittest import mock

import pandas as pd
from contactbench import engines, ladder, plan, precision, program, recommend, references, sweep
from folder import Folder

KNOBS = "step=1e-3 duration=2.0 friction=0.5"


class Cell(dict):
    """Of a table of runs."""
    label, command = "convex, k = 8", "contactbench run x"

    @property
    def row(self):
        return {"scene": "my", "parameters": "a=1", "method": self["method"], "variant": "", "solver": "", "k": "", "epsilon": "",
                "repeat": "1", "knobs": self["knobs"]}


def point(name="r1", **more):
    cell = Cell(method="convex", solver="ipm", variant="v", k="8", epsilon="1e-9", knobs=KNOBS, false_claims="0",
                duration="2.0")
    return {"run": name, "cell": cell, "measure": "position_linf_m", "error": 0.01, "worst": 0.02, "uncertainty": 0.003,
            "time": 4.0, "least": 3.0, "most": 6.0, "time_per_step": 0.0125, "repeats": 3, "busy": True, "step": "1e-3"} | more


SAID = {
    "run": "r1", "method": "convex", "solver": "ipm", "variant": "v", "k": "8", "epsilon": "1e-9", "knobs": KNOBS,
    "label": "convex, k = 8", "error": 0.01, "worst_of_ensemble": 0.02, "uncertainty": 0.003, "time_per_simulated_second": 4.0,
    "time_least": 3.0, "time_most": 6.0, "time_per_step": 0.0125, "repeats": 3, "busy": True, "command": "contactbench run x"}


def printed(what, *of):
    with contextlib.redirect_stdout(io.StringIO()) as said:
        what(*of)
    return said.getvalue().splitlines()


class Words(unittest.TestCase):
    def test_a_point_is_said_with_each_of_its_numbers(self):
        self.assertEqual(recommend.said(point()), SAID)
        self.assertIsNone(recommend.said(point(worst=math.inf))["worst_of_ensemble"])
        self.assertIsNone(recommend.said(None))

    def test_a_choice_is_printed_with_its_error_its_times_and_its_command(self):
        self.assertEqual(printed(recommend.show, "cheapest", SAID, "position_linf_m"), [
            "cheapest: convex, k = 8",
            "  position_linf_m = 0.01 (up to 0.02 in its ensemble); 4 s a simulated second (3 to 6 in 3 runs, machine busy), "
            "0.0125 s a step", "  run r1", "  contactbench run x"])
        self.assertEqual(
            printed(recommend.show, "x", SAID | {"repeats": 1, "busy": False}, ladder.RESIDUAL)[1],
            "  4 s a simulated second (one run: noise unknown), 0.0125 s a step")

    def made(self, **more):
        return {
            "scene": "my", "parameters": "a=1", "measure": "position_linf_m", "wanted": 0.05, "time_per_step": None,
            "reference": "analytic", "runs": 7, "basis": "exact", "trust": "as far as it goes", "best": SAID,
            "runner_up": SAID | {"label": "other"}, "told_apart": True, "cheaper_that_missed": 2, "measured_on": {
                "cpu": "a CPU", "cores": 8, "this_machine": False}} | more

    def test_an_answer_is_what_was_asked_by_what_it_is_known_and_who_comes_next(self):
        lines = printed(recommend.show_all, self.made())
        self.assertEqual(lines[:3], [
            "my a=1, position_linf_m <= 0.05 (reference analytic, 7 settings in the table)", "by what: exact: as far as it goes",
            "times are those of a CPU, 8 cores, not of this machine: --verify runs the answer here, "
            "scripts/reproduce.sh measures all of it here"
        ])
        self.assertEqual([lines[3], lines[7]], ["cheapest: convex, k = 8", "runner-up: other"])
        for apart, words in ((None, " (too few repeats to tell them apart)"), (False, " (times overlap: not told apart)")):
            self.assertIn(f"runner-up{words}: other", printed(recommend.show_all, self.made(told_apart=apart)))
        lines = printed(
            recommend.show_all,
            self.made(runner_up=None, time_per_step=1e-4, parameters="", why="they part", measured_on={
                "cpu": "", "cores": 2, "this_machine": True}))
        self.assertEqual(lines[:3], [
            "my, position_linf_m <= 0.05 and at most 0.0001 s a step (reference analytic, 7 settings in the table)",
            "by what: exact: as far as it goes (they part)", "times are those of an unnamed CPU, 2 cores, as this machine has"])
        self.assertEqual(lines[-1], "runner-up: no other method or solver met it")

    def test_what_was_confirmed_is_said_and_what_was_not(self):
        do_not, unfit = "the 2 cheaper in the table do not, run again", "3 cheaper are no answer by their step, their ensemble or a refuted claim"
        for missed, others, words in ((2, 0, do_not), (0, 0, "nothing in the table is cheaper"), (0, 3, unfit), (2, 3, f"{do_not}; {unfit}")):
            verified = {"faults": [], "missed": missed, "unfit": others}
            self.assertEqual(
                printed(recommend.show_all, self.made(verified=verified))[-1],
                f"confirmed: run again, it meets the error; {words}")
        self.assertEqual(
            printed(recommend.show_all, self.made(verified={"faults": ["a", "b"]}))[-2:],
            ["not confirmed: a", "not confirmed: b"])

    def test_where_none_did_the_nearest_is_said_or_who_came_furthest(self):
        lines = printed(recommend.show_all,
                        self.made(best=None, nearest=SAID, against={"rows": [], "unavailable": ["ode"], "cheapest": None}))
        self.assertEqual(lines[3:5], ["none did", "least error: convex, k = 8"])
        self.assertEqual(lines[-2:], ["  ode: unavailable", "cheapest of them: none met it here"])
        self.assertEqual(
            printed(recommend.show_all, self.made(best=None, nearest=None, furthest="ap at 0.5 s"))[3:],
            ["no run of it came to the end; furthest: ap at 0.5 s"])
        self.assertEqual(printed(recommend.show_all, self.made(best=None, nearest=None))[3:], ["none ended ok"])

    def test_steps_above_the_one_that_answers_are_said_with_their_least_error(self):
        steps = [{"basis": "alike", "trust": "t1", "nearest": SAID}, {
            "basis": "converging", "trust": "t2", "nearest": SAID | {"worst_of_ensemble": None}}, {
                "basis": ladder.RESIDUAL, "trust": "t3", "nearest": None}]
        lines = printed(recommend.show_all, self.made(steps=steps, basis=ladder.RESIDUAL, trust="t3", measure="residual"))
        self.assertEqual(lines[:4], [
            "my a=1, residual (reference analytic, 7 settings in the table)",
            "not by alike: the least is 0.01 m (up to 0.02 in its ensemble), by convex, k = 8; t1",
            "not by converging: the least is 0.01 m (a run of its ensemble does not end ok), by convex, k = 8; t2",
            f"by what: {ladder.RESIDUAL}: t3"])

    def test_engines_beside_the_answer_are_said_with_who_is_the_cheapest(self):
        row = {
            "engine": "", "variant": "", "knobs": "step=1", "status": "ok", "error": 0.0125, "meets": True,
            "time_per_simulated_second": 2.5}
        rows = [
            row, row | {
                "engine": "ode", "variant": "quick", "meets": False, "status": "crash", "error": None,
                "time_per_simulated_second": None}]
        for cheapest, words in ((row | {"run": "r1"}, "the answer (r1)"), (row | {"engine": "ode", "run": "r2"}, "ode (r2)")):
            lines = printed(recommend.show_against, {"rows": rows, "unavailable": [], "cheapest": cheapest})
            self.assertEqual(lines[1:], [
                "  the answer step=1: ok, 0.0125 (meets it), 2.5 s a simulated second", "  ode quick step=1: crash, no error",
                f"cheapest of them: {words}"])

    def test_the_machine_of_the_table_is_this_one_where_its_names_are(self):
        here = {"cpu": "a CPU", "cores": 8}
        other = {"cpu": "another", "cores": 2}
        with mock.patch.object(recommend, "this_machine", lambda: here):
            for machine, cpu, cores, same in (({**here, "os": "x",
                                                "more": 1}, "a CPU", 8, True), (here | {"cores": 4}, "a CPU", 4, False), ([
                                                    here, other, here], "several machines, as a CPU, another", None, False),
                                              (None, None, None, False)):
                made = recommend.measured_on(types.SimpleNamespace(manifest={"machine": machine}))
                self.assertEqual((made["cpu"], made["cores"], made["this_machine"]), (cpu, cores, same))
            self.assertEqual(set(made), {"cpu", "cores", "os", "this_machine"})

    def test_an_answer_of_a_table_is_about_the_longest_of_its_runs_that_have_an_error(self):
        points = [point(error=error) for error in (0.1, 0.2, 0.3, None)]
        for of, duration in zip(points, ("2.0", "10.0", "5.0", "70.0")):
            of["cell"]["duration"] = duration
        of_table, of_sweep = (types.SimpleNamespace(scene="stack", out=out) for out in (None, "folder"))
        self.assertEqual([recommend.lasts(points, of_table), recommend.lasts(points[3:], of_table), recommend.lasts(points, of_sweep)],
                         [10.0, None, None])


class Sweeps(Folder):
    def test_about_two_hundred_moments_are_kept_those_of_the_reference_among_them(self):
        # Four times a step of 1 ms: 25 of them make a tenth of a second, so that 25, 5 or 1 of them are an interval.
        for duration, interval in ((4.0, 0.02), (200.0, 0.1), (10.0, 0.1), (6.0, 0.02), (0.9, 0.004), (0.01, 0.004)):
            self.assertAlmostEqual(recommend.kept_every({"own_step": 1e-3, "duration": duration}), interval, delta=1e-12,
                                   msg=duration)
        # A step of 0.2 s meets every second moment of the reference.
        self.assertEqual(recommend.kept_every({"own_step": 0.05, "duration": 1.0}), 0.2)

    def test_moments_that_are_kept_are_whole_steps_of_all_steps_of_the_sweep(self):
        # 8 ms are no part of a tenth of a second, but of two; 12 ms of three; what is part of none, or of a shorter run, is kept as often.
        for step, duration, kept in ((1e-3, 8, (0.1, 100)), (8e-3, 2, (0.2, 25)), (1 / 15, 2, (0.2, 3)), (12e-3, 2, (0.3, 25)),
                                     (12e-3, 0.25, (0.024, 2)), (2.8e-3, 2, (36 * 2.8e-3, 36)), (4, 1, (4, 1))):
            interval, steps = recommend.whole(step, duration)
            self.assertEqual((round(interval, 12), steps), (round(kept[0], 12), kept[1]), (step, duration))
        for about in ({"own_step": 2e-3}, {"own_step": 3e-3}, {"own_step": 7e-4}):
            made = self.swept(**about)
            recorded = [plan.recorded({"record_interval_s": made["record_interval_s"]}, {"step": step}) * float(step) for step in made["step"]]
            self.assertAlmostEqual(max(recorded), min(recorded), delta=1e-12, msg=about)

    def swept(self, contacts=False, sets=(), limit=60, **about):
        """The sweep file that is asked for, and the flags."""
        known = {"own_step": 2e-3, "accepted": True, "until": 3.0, "duration": 4.0, "took_s": 0.5} | about
        options = types.SimpleNamespace(program="prog", scene="my", set=list(sets), duration=4.0, out=self.top, limit=limit)
        made, asked = [], []
        with mock.patch.object(recommend, "scene_file", lambda *_: "/p/my.xml"), \
                mock.patch.object(references, "make", lambda *of: made.append(of) or types.SimpleNamespace(about=known)), \
                mock.patch.object(sweep, "sweep", asked.append), mock.patch.object(recommend, "Runs", lambda *of: of):
            self.assertEqual(recommend.sweep_of(options, contacts), (self.top, self.top / "runs"))
        self.assertEqual(made, [("prog", "/p/my.xml", list(sets), 4.0, self.top / "references", limit)])
        (words, ) = asked
        file = self.top / f"{precision.SWEEP}.toml"
        self.assertEqual((words.sweeps, words.program, words.runs, words.out), ([file], "prog", self.top / "runs", self.top))
        return tomllib.loads(file.read_text())

    def test_a_small_sweep_is_of_steps_about_the_scene_s_own_for_as_long_as_can_be_measured(self):
        made = self.swept(sets=["boxes=4", "mu=1/2"], limit=12.5)
        self.assertEqual({k: v for k, v in made.items() if k != "title"}, {
            "outside": ["pgs"], "record_interval_s": "0.2", "step": ["0.008", "0.002", "0.0005"], "duration": "3.0", "k": [
                4, 8, 16], "epsilon": ["1e-2", "1e-6", "1e-12"], "repeats": 3, "time_limit_s": 12.5, "runs": [{
                    "scene": "/p/my.xml", "set": {"boxes": "4", "mu": "1/2"}}]})
        self.assertEqual(
            [self.swept(**about)["duration"] for about in ({"until": 2.0}, {"until": 1.9}, {"accepted": False, "until": None})],
            ["2.0", "4.0", "4.0"])

    def test_what_is_dear_is_swept_less_and_what_is_looked_at_goes_to_its_end_with_its_contacts(self):
        made = self.swept(took_s=1.1)
        self.assertEqual((made["k"], made["epsilon"], made["repeats"], made.get("record_contacts")),
                         ([8], ["1e-6", "1e-12"], 1, None))
        self.assertEqual(self.swept(took_s=1.0)["repeats"], 3)
        made = self.swept(contacts=True)
        self.assertEqual((made["record_contacts"], made["duration"]), (True, "4.0"))
        self.assertAlmostEqual(float(made["record_interval_s"]), recommend.kept_every({"own_step": 2e-3, "duration": 4.0}),
                               delta=1e-12)

    def test_what_cannot_be_made_or_swept_is_wrong_input(self):
        options = types.SimpleNamespace(program="prog", scene="my", set=[], duration=None, out=None, limit=60)
        with self.assertRaisesRegex(recommend.WrongInput, "my is not in the table: --out names a folder"):
            recommend.small_sweep(options)
        options.out = self.top
        for make, swept, said in ((program.ProgramError("no such scene"), None, "no such scene"), (None, SystemExit(1),
                                                                                                   "could not be done")):
            about = types.SimpleNamespace(about={"own_step": 1, "accepted": False, "duration": 1, "took_s": 1, "until": None})
            with mock.patch.object(recommend, "scene_file", lambda *_: "f"), \
                    mock.patch.object(references, "make", side_effect=make, return_value=about), \
                    mock.patch.object(sweep, "sweep", side_effect=swept), contextlib.redirect_stderr(io.StringIO()), \
                    self.assertRaisesRegex(recommend.WrongInput, said):
                recommend.sweep_of(options)

    def test_a_folder_without_a_table_is_said_with_what_makes_one(self):
        options = types.SimpleNamespace(scene="stack", set=[], out=None, results=self.top / "none")
        with self.assertRaisesRegex(recommend.WrongInput, "/none has no runs.csv: scripts/reproduce.sh makes it; --results names"):
            recommend.table(options)

    def test_a_scene_is_a_file_or_a_name_of_the_program_s(self):
        (self.top / "my.xml").touch()
        listed = {"scenarios": [{"name": "stack.xml", "file": "/p/stack.xml"}]}
        with mock.patch.object(program, "listed", lambda _: listed):
            self.assertEqual(recommend.scene_file("p", str(self.top / "my.xml")), str((self.top / "my.xml").resolve()))
            self.assertEqual([recommend.scene_file("p", name) for name in ("stack", "stack.xml")], ["/p/stack.xml"] * 2)
            with self.assertRaisesRegex(recommend.WrongInput, "no scene 'wall'"):
                recommend.scene_file("p", "wall")
        with self.assertRaisesRegex(recommend.WrongInput, "--program names another one"):
            recommend.listed("/nowhere/program")


class Once(unittest.TestCase):
    """Runs of the answer and of what it is held against."""
    options = types.SimpleNamespace(program="prog", scene="stack", limit=9.0, error=0.02, against=["ode", "dart"],
                                    time_per_step=None)

    def test_a_run_is_measured_in_a_folder_of_its_own_at_the_moments_of_the_reference(self):
        jobs = []

        def do(job, load):
            jobs.append(job)
            return {"status": "ok", "finished": True}

        row = {"status": "ok", "error_a": "0.25", "error_b": "", "processing_s": "3", "duration": "2", "certified": None}
        with mock.patch.object(recommend, "scene_file", lambda *_: "/p/stack.xml"), mock.patch.object(program, "do", do), \
                mock.patch.object(recommend, "listed", lambda _: {"statuses": [{"name": "ok"}]}), \
                mock.patch.object(references, "read", lambda *_: "known"), \
                mock.patch.object(program, "files_of", lambda *_: ()), mock.patch.object(recommend, "row_of", lambda *of: row):
            run, results = plan.Run("stack", (), "ap", "", "", (), 1), types.SimpleNamespace(folder=Path("/r"))
            self.assertEqual(recommend.once(run, "1e-3", "a", self.options, results), ("ok", 0.25, 1.5))
            self.assertEqual(recommend.once(run, "", "b", self.options, results), ("ok", None, 1.5))
            row["processing_s"] = ""
            self.assertEqual(recommend.once(run, "0.04", "none", self.options, results), ("ok", None, None))
        self.assertEqual([(job["record_every"], job["time_limit_s"], job["scene"], job["file"], job["flags"]) for job in jobs],
                         [(every, 9.0, "stack.xml", "/p/stack.xml", ["--method", "ap"]) for every in (100, 1, 5)])

    def engines(self, *ends, best=None, points=None, known=()):
        """The comparison with engines, where runs end so: {name of a run: its (status, error, time) in turn}."""
        said = {
            "engines": [{"name": "ode", "unavailable": None, "variants": [{"name": "quick"}, {"name": "world"}]}, {
                "name": "mujoco", "unavailable": None, "variants": [{"name": "newton"}]}, {
                    "name": "dart", "unavailable": "why", "variants": [{"name": "pgs"}]}, {
                        "name": "simbody", "unavailable": "why", "variants": []}]}
        ends, ran = iter(ends), []

        def once(run, step, measure, options, results):
            ran.append((run, step, measure))
            return next(ends)

        with mock.patch.object(recommend, "listed", lambda _: said), mock.patch.object(recommend, "once", once), \
                mock.patch.object(engines, "known", lambda *of: of in known):
            return recommend.against(best or point(), points
                                     or [point(), point(step="1e-2"), point(step="")], self.options, None), ran

    def test_the_answer_and_every_variant_asked_for_run_in_turns_and_the_least_time_counts(self):
        # The answer, quick at two steps, as it is and tuned, and world at two steps: seven, of which three meet 0.02 less 0.003.
        first = [("ok", 0.01, 4.0), ("ok", 0.0169, 2.0), ("ok", 0.0171, 1.0), ("ray", 0.001, 1.0), ("ok", None, 1.0),
                 ("inaccurate", 0.001, 1.0), ("ok", 0.001, 9.0)]
        again = [("ok", 0.01, 3.0), ("ok", 0.0169, 2.5), ("ok", 0.001, 8.0)]
        made, ran = self.engines(*first, *again, ("ok", 0.01, 3.5), ("ok", 0.0169, 1.5), ("ok", 0.001, None),
                                 known=[("ode", "quick")])
        names = [(row["engine"], row["variant"], row["knobs"]) for row in made["rows"]]
        usual = "duration=2.0 friction=0.5 setting="
        self.assertEqual(names[1:], [("ode", variant, f"step={step} {usual}{setting}")
                                     for variant, setting in (("quick", "default"), ("quick", "tuned"), ("world", "default"))
                                     for step in ("1e-3", "1e-2")])
        self.assertEqual(names[0], ("", "", "step=1e-3 duration=2.0 friction=0.5"))
        self.assertEqual([row["meets"] for row in made["rows"]], [True, True] + [False] * 5)  # each time that it is run
        self.assertEqual([row["time_per_simulated_second"] for row in made["rows"]], [3.0, 1.5, 1.0, 1.0, 1.0, 1.0, 8.0])
        self.assertEqual((made["cheapest"]["variant"], made["cheapest"]["time_per_simulated_second"], made["unavailable"]),
                         ("quick", 1.5, ["dart"]))
        self.assertEqual([(run.engine, step, measure) for run, step, measure in ran[:3]], [(False, "1e-3", "position_linf_m"),
                                                                                           (True, "1e-3", "position_linf_m"),
                                                                                           (True, "1e-2", "position_linf_m")])
        self.assertEqual(len(ran), 7 + 3 + 3)
        self.assertEqual(ran[1][0].flags()[:4], ["--engine", "ode", "--variant", "quick"])
        self.assertEqual((ran[1][0].scene, ran[1][0].sets), ("my", (("a", "1"), )))

    def test_an_engine_that_there_is_not_is_wrong_input(self):
        with self.assertRaisesRegex(recommend.WrongInput, "--against odd: no such engine; there are ode, mujoco, dart, simbody"):
            with mock.patch.object(self.options, "against", ["odd"]):
                self.engines(("ok", 0, 1))

    def verify(self, *ends, cheaper=(), time_per_step=None):
        ends, options = iter(ends), types.SimpleNamespace(error=0.02, time_per_step=time_per_step)
        with mock.patch.object(recommend, "again", lambda *_: next(ends)):
            return recommend.verify(point("best"), list(cheaper), options, None)

    def test_an_answer_is_confirmed_where_it_meets_the_error_again_and_nothing_cheaper_does(self):
        missed = point("cheap", error=0.05)
        made = self.verify(("ok", 0.0169, 1.5), ("ok", 0.05, 0.5), cheaper=[missed])
        self.assertEqual(
            made, {
                "faults": [], "missed": 1, "unfit": 0, "runs": [{"run": "best", "status": "ok", "error": 0.0169, "time_per_simulated_second": 1.5}, {
                    "run": "cheap", "status": "ok", "error": 0.05, "time_per_simulated_second": 0.5}]})
        for end in (("ok", 0.0171, 1), ("ray", 0.001, 1), ("ok", None, None)):
            self.assertEqual(self.verify(end)["faults"], [f"best does not meet the error: {end[0]}, {end[1]}"])
        met = "cheap is cheaper in the table and meets the error: 0.01"
        self.assertEqual(self.verify(("ok", 0.01, 1), ("ok", 0.01, 1), cheaper=[missed])["faults"], [met])
        # What is cheaper may have been left for another reason: a member of its ensemble, a refuted claim, too long a step.
        for more, late in (({"error": 0.01, "worst": 0.5}, None), ({
                "cell": point()["cell"] | {"false_claims": "1"}, "error": 0.05}, None), ({"error": 0.05,
                                                                                          "time_per_step": 0.2}, 0.1)):
            made = self.verify(("ok", 0.01, 1), ("ok", 0.01, 1), cheaper=[point("cheap", **more)], time_per_step=late)
            self.assertEqual((made["faults"], made["missed"], made["unfit"]), ([], 0, 1), more)
        self.assertEqual(
            self.verify(("ok", 0.01, 1), ("ok", 0.01, 1), cheaper=[missed | {"time_per_step": 0.05}],
                        time_per_step=0.1)["faults"], [met])
        # Of several each is counted.
        some = [point("slow", error=0.05, time_per_step=0.2), point("lucky", worst=0.5), missed]
        made = self.verify(("ok", 0.01, 1), *3 * [("ok", 0.05, 0.5)], cheaper=some, time_per_step=0.1)
        self.assertEqual((made["faults"], made["missed"], made["unfit"]), ([], 1, 2))


class Answers(unittest.TestCase):
    """The answer of a table, by points that are made up: the first misses 0.02 m, the others meet it."""
    def setUp(self):
        self.points = [
            point("near", error=0.05, worst=0.05, time=1.0),
            point("best", worst=0.015, time=2.0, least=1.9, most=2.1),
            point("second", worst=0.01, time=3.0, least=2.9, most=3.1)]
        for of in self.points:
            of["status"], of["cell"].key = "ok", of["run"]

    def answer(self, of_scene="position_linf_m", unsure=0.0, about=None, steps=(), **more):
        options = types.SimpleNamespace(
            **{
                "scene": "/x/my.xml", "set": ["a=1"], "error": 0.02, "time_per_step": None, "measure": None, "verify": False,
                "against": [], "duration": None, "out": None} | more)
        table = pd.DataFrame([{
            "scene": "my", "parameters": "a=1", "error_position_linf_m": "1", "error_other_m": "2", "error_none_m": ""}, {
                "scene": "my", "parameters": "", "error_position_linf_m": "", "error_other_m": "", "error_none_m": "3"}])
        results = types.SimpleNamespace(table=table, manifest={"references": {"my__a-1": about}},
                                        cells=lambda *_, **__: [1, 2, 3, 4])
        patches = {
            "measure": lambda *_: of_scene, "uncertainty": lambda *_: unsure, "points": lambda *_: self.points,
            "reference_of": lambda results, scene, parameters, name: f"against {scene} {parameters} {name}"}
        with mock.patch.object(recommend, "table", lambda _: results), mock.patch.multiple(precision, **patches), \
                mock.patch.object(recommend, "measured_on", lambda _: "a machine"), \
                mock.patch.object(ladder, "steps_down", lambda *_: list(steps)), \
                mock.patch.object(ladder, "furthest", lambda *_: "far"), \
                mock.patch.object(recommend, "verify", lambda best, cheaper, *_: [best["run"], *(p["run"] for p in cheaper)]), \
                mock.patch.object(recommend, "against", lambda best, *_: best["run"]):
            return recommend.answer(options)

    def test_the_cheapest_is_the_best_and_what_else_is_known_of_it_stands_beside(self):
        made = self.answer(verify=True, against=["ode"])
        self.assertEqual({k: v for k, v in made.items() if k not in ("best", "runner_up", "trust")}, {
            "scene": "my", "parameters": "a=1", "measure": "position_linf_m", "wanted": 0.02, "time_per_step": None,
            "measured_on": "a machine", "reference": "against my a=1 position_linf_m", "basis": "exact", "runs": 3,
            "cheaper_that_missed": 1, "told_apart": True, "verified": ["best", "near"], "against": "best"})
        self.assertEqual((made["best"]["run"], made["runner_up"]["run"]), ("best", "second"))
        self.assertFalse({"verified", "against"} & set(self.answer()))
        made = self.answer(error=1e-3, verify=True, against=["ode"])
        self.assertEqual((made["best"], made["nearest"]["run"], made["against"]), (None, "second", "second"))
        self.assertNotIn("verified", made)
        self.assertNotIn("against", self.answer(error=1e-3))

    def test_another_measure_is_one_that_this_scene_has_with_these_parameters(self):
        self.assertEqual(self.answer(measure="other_m")["measure"], "other_m")
        with self.assertRaisesRegex(recommend.WrongInput, "my has no error 'none_m'; it has position_linf_m, other_m$"):
            self.answer(measure="none_m")

    def test_a_reference_that_is_known_no_better_than_what_is_wanted_says_nothing(self):
        about = {"until": 2.0, "duration": 2.0, "reason": "they part"}
        made = self.answer(references.ERROR, unsure=0.019, about=about)
        self.assertEqual((made["basis"], made["trust"]), ("certified", ladder.TRUST["certified"]))
        made = self.answer(references.ERROR, about=about, duration=3.0)
        self.assertEqual((made["basis"], made["trust"]), ("agreed", ladder.TRUST["agreed"].format(until=2)))
        # The runs of the table need not be as long as the scene; of a small sweep the scene is what is asked about.
        long = {"until": 20.9, "duration": 70.0}
        self.assertEqual([self.answer(references.ERROR, about=long, **more)["basis"] for more in ({}, {"out": "my"})],
                         ["certified", "agreed"])
        first = {"basis": "alike", "trust": "t1", "best": None, "runner_up": None, "nearest": self.points[0]}
        second = {
            "basis": "converging", "trust": "t2", "best": self.points[1], "runner_up": self.points[2], "nearest": self.points[1]}
        last = {"basis": ladder.RESIDUAL, "trust": "t3", "best": None, "runner_up": None, "nearest": None}
        # The uncertainty counts of a certified reference alone.
        self.assertEqual(self.answer(unsure=9.0)["basis"], "exact")
        for of_scene, unsure, reference in ((references.ERROR, 0.02, f"against my a=1 {references.ERROR}"), ("", 0.0, "missing")):
            made = self.answer(of_scene, unsure=unsure, about=about, steps=[first, second, last])
            self.assertEqual(
                {k: made[k] for k in ("basis", "trust", "measure", "reference", "why", "runs", "told_apart", "furthest")}, {
                    "basis": "converging", "trust": "t2", "measure": "converging", "reference": reference, "why": "they part",
                    "runs": 4, "told_apart": True, "furthest": "far"})
            self.assertEqual([made[k]["run"] for k in ("best", "runner_up", "nearest")], ["best", "second", "near"])
            self.assertEqual([
                (s["basis"], s["best"] and s["best"]["run"], s["nearest"] and s["nearest"]["run"]) for s in made["steps"]],
                             [("alike", None, "near"), ("converging", "best", "best"), (ladder.RESIDUAL, None, None)])
            for flag, words in (("--verify", {"verify": True}), ("--against", {"against": ["ode"]})):
                with self.assertRaisesRegex(recommend.WrongInput, f"{flag} compares errors"):
                    self.answer(of_scene, unsure=unsure, steps=[second], **words)
        made = self.answer("", steps=[first])  # none met it
        self.assertEqual((made["basis"], made["best"], made["nearest"]["run"], made["furthest"], made["told_apart"]),
                         ("alike", None, "near", "", None))


class Ends(unittest.TestCase):
    def main(self, *words, **made):
        with mock.patch("sys.argv", ["recommend.py", "my", "--error", "0.5", *words]), \
                mock.patch.object(recommend, "answer", lambda options: {"best": SAID, "basis": "exact"} | made), \
                mock.patch.object(recommend, "show_all", lambda made: print("text")), \
                contextlib.redirect_stdout(io.StringIO()) as said:
            return recommend.main(), said.getvalue()

    def test_the_exit_code_says_whether_there_is_an_answer_and_whether_it_was_confirmed(self):
        self.assertEqual(self.main(), (0, "text\n"))
        for made, code in (({"verified": {"faults": []}}, 0), ({"verified": {"faults": ["x"]}}, 1), ({"best": None}, 3), ({
                "basis": ladder.RESIDUAL}, 3), ({"best": None, "verified": {"faults": ["x"]}}, 3)):
            self.assertEqual(self.main(**made)[0], code, made)
        self.assertEqual(json.loads(self.main("--json")[1]), {"best": SAID, "basis": "exact"})
        with mock.patch.object(recommend, "answer", side_effect=recommend.WrongInput("why")), \
                contextlib.redirect_stderr(io.StringIO()) as said, \
                mock.patch("sys.argv", ["recommend.py", "my", "--error", "0.5"]):
            self.assertEqual(recommend.main(), 2)
        self.assertEqual(said.getvalue(), "recommend: why\n")

    def test_a_number_that_is_not_positive_is_refused(self):
        for words in (("--error", "0"), ("--time-per-step", "-1"), ("--duration", "inf"), ("--limit", "nan")):
            with contextlib.redirect_stderr(io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
                self.main(*words)
            self.assertEqual(ended.exception.code, 2)
            self.assertIn(f"argument {words[0]}: {words[1]}: must be a positive number", said.getvalue())


if __name__ == "__main__":
    unittest.main()
