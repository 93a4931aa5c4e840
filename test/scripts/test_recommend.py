"""scripts/recommend.py and certified references, on the runs of a stand-in for the program whose errors and times are known."""
import contextlib
import csv
import io
import json
import shutil
import subprocess
import sys
import tempfile
import types
import unittest
from pathlib import Path
from unittest import mock

import standin
from contactbench import engines, ladder, program, recommend, references

ROOT = Path(__file__).resolve().parents[2]

SWEEP = """
outside = ["pgs"]
k = [4, 8]
epsilon = "1e-12"
step = ["1e-2", "1e-3"]
record_interval_s = "0.1"
repeats = 2

[[runs]]
scene = "sliding_box"

[[runs]]
scene = "stack"
set.boxes = 4
"""


class Recommend(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.swept = Path(folder.name)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)
        self.program = standin.write(self.top / "program")
        self.environment = standin.environment(FAKE=json.dumps({"sliding_box": "error", "my": "error"}))

    def sweep(self):
        """What SWEEP left, made once and copied: it takes ten seconds and more."""
        swept = self.swept
        if not (swept / "error_time.toml").exists():
            program = standin.write(swept / "program")
            (swept / "error_time.toml").write_text(SWEEP)
            subprocess.run([sys.executable, "-B", ROOT / "scripts/sweep.py", swept / "error_time.toml", "--program", program,
                            "--runs", swept / "runs", "--out", swept], check=True, stdout=subprocess.DEVNULL, env=self.environment)
        shutil.copytree(swept, self.top, dirs_exist_ok=True)

    def ask(self, *words, code=0):
        ended = subprocess.run([sys.executable, "-B", ROOT / "scripts/recommend.py", "--program", self.program, "--results", self.top,
                                "--json", *map(str, words)], capture_output=True, text=True, env=self.environment)
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return json.loads(ended.stdout) if code != 2 else ended.stderr

    def test_the_cheapest_that_meets_the_error_is_named_with_evidence_and_runner_up(self):
        self.sweep()
        # At 1e-2 s newton errs by 0.1 m, mirtich by 0.05, ap by 0.02, convex by 0.01; each step costs the dearer method more.
        made = self.ask("sliding_box", "--error", 0.03, "--verify")
        self.assertEqual((made["best"]["method"], made["best"]["knobs"], made["best"]["error"]), ("ap", "step=1e-2", 0.02))
        self.assertEqual(made["runner_up"]["method"], "convex")
        self.assertEqual(made["best"]["command"], "contactbench run sliding_box.xml --method ap --solver lemke --step 1e-2 --k 4")
        self.assertEqual(made["reference"], "analytic")
        self.assertFalse(made["verified"]["faults"])
        # The answer and, once each, the three that are cheaper: two of newton, one of mirtich.
        self.assertEqual(len(made["verified"]["runs"]), 4)
        self.assertEqual(made["best"]["repeats"], 2)

    def test_an_engine_is_run_beside_the_answer_and_may_be_cheaper(self):
        self.sweep()
        # At 1e-2 s ode errs by 0.04 m and costs a sixth of ap.
        made = self.ask("sliding_box", "--error", 0.05, "--against", "ode")["against"]
        self.assertEqual((made["cheapest"]["engine"], made["cheapest"]["knobs"]), ("ode", "step=0.01 setting=default"))
        rows = {row["knobs"]: row for row in made["rows"] if row["engine"]}
        settings = ("default", "tuned") if any(key.startswith("ode/") for key in engines.tuned()) else ("default",)
        self.assertEqual({knobs: row["error"] for knobs, row in rows.items()},
                         {f"step={step} setting={setting}": 4 * step for step in (0.01, 0.001) for setting in settings})
        made = self.ask("sliding_box", "--error", 0.03, "--against", "ode", "--against", "dart")["against"]
        self.assertEqual((made["cheapest"]["engine"], made["cheapest"]["error"], made["unavailable"]), ("", 0.02, ["dart"]))
        self.assertFalse(next(row for row in made["rows"] if row["error"] == 0.04)["meets"])
        self.assertIn("no such engine", self.ask("sliding_box", "--error", 0.03, "--against", "od", code=2))
        # None of ours came so near; an engine that did not either is no answer.
        made = self.ask("sliding_box", "--error", 1e-6, "--against", "ode", code=3)
        self.assertIsNone(made["against"]["cheapest"])

    def test_runs_are_found_where_published_ones_lie_and_where_those_of_one_scene_do(self):
        self.sweep()
        options = types.SimpleNamespace(scene="sliding_box", set=[], out=None, results=self.top)
        self.assertTrue(recommend.table(options).cells("sliding_box", None)[0].folder.is_dir())
        (self.top / "runs").rename(self.top / "default")
        (self.top / "runs").mkdir()
        (self.top / "default").rename(self.top / "runs/default")
        self.assertTrue(recommend.table(options).cells("sliding_box", None)[0].folder.is_dir())

    def test_the_text_says_what_the_choice_went_by(self):
        point = {"label": "a", "repeats": 1, "busy": False, "error": 0.01, "time_per_simulated_second": 1.0, "time_per_step": 1.0, "run": "r",
                 "command": "c"}
        for worst, words in ((0.01, "m = 0.01; "), (0.02, "m = 0.01 (up to 0.02 in its ensemble); "),
                             (None, "m = 0.01 (a run of its ensemble does not end ok); ")):
            with contextlib.redirect_stdout(io.StringIO()) as said:
                recommend.show("cheapest", point | {"worst_of_ensemble": worst}, "m")
            self.assertIn(words, said.getvalue())

    def test_none_did_where_none_did_and_the_nearest_is_said(self):
        self.sweep()
        made = self.ask("sliding_box", "--error", 1e-6, code=3)
        self.assertIsNone(made["best"])
        self.assertEqual((made["nearest"]["method"], made["nearest"]["error"]), ("convex", 1e-3))

    def test_times_are_said_to_be_those_of_the_machine_that_measured_them(self):
        self.sweep()
        manifest = self.top / "manifest.json"
        here = recommend.this_machine()
        for machine, same in ((here | {"os": "any"}, True), (here | {"cpu": "Another 9000"}, False), ({}, False)):
            manifest.write_text(json.dumps(json.loads(manifest.read_text()) | {"machine": machine}))
            made = self.ask("sliding_box", "--error", 0.03)
            self.assertEqual((made["measured_on"]["cpu"], made["measured_on"]["this_machine"]), (machine.get("cpu"), same))
            with contextlib.redirect_stdout(io.StringIO()) as said:
                recommend.show_all(made)
            self.assertEqual("not of this machine" in said.getvalue(), not same)
            self.assertIn(machine.get("cpu", "unnamed"), said.getvalue())

    def test_a_time_per_step_narrows_the_choice(self):
        self.sweep()
        step = self.ask("sliding_box", "--error", 0.012)["best"]["time_per_step"]
        self.ask("sliding_box", "--error", 0.012, "--time-per-step", step / 100, code=3)
        self.assertLessEqual(self.ask("sliding_box", "--error", 1, "--time-per-step", step)["best"]["time_per_step"], step)

    def test_a_table_that_says_too_much_is_not_confirmed(self):
        self.sweep()
        with open(self.top / "runs.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            if row["method"] == "newton" and row["knobs"] == "step=1e-2":
                row["error_position_linf_m"] = "1e-9"
        with open(self.top / "runs.csv", "w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        made = self.ask("sliding_box", "--error", 1e-3, "--verify", code=1)
        self.assertIn("does not meet the error", made["verified"]["faults"][0])

    def test_wrong_input_says_what_would_be_right(self):
        self.sweep()
        self.assertIn("--set boxes=4", self.ask("stack", "--error", 1, code=2))
        self.assertIn("position_linf_m", self.ask("sliding_box", "--error", 1, "--measure", "beauty", code=2))
        self.assertIn("--out", self.ask("circular_sliding", "--error", 1, code=2))
        self.assertIn("no scene", self.ask("nowhere", "--error", 1, "--out", self.top / "new", code=2))
        self.assertIn("positive", self.ask("sliding_box", "--error", -1, code=2))

    def test_a_scene_of_ones_own_is_swept_first_against_a_reference_made_for_it(self):
        scene = self.top / "my.xml"
        scene.write_text("<scenario/>")
        out = self.top / "mine"
        made = self.ask(scene, "--error", 0.03, "--out", out)
        # Four times the step of 1e-3 s is the coarsest of the sweep; mirtich errs there by 0.02 m.
        self.assertEqual((made["best"]["method"], made["best"]["knobs"]), ("mirtich", "step=0.004 duration=10.0"))
        self.assertTrue(json.loads((out / "references/my.json").read_text())["accepted"])
        again = self.ask(scene, "--error", 0.03, "--out", out, "--measure", references.ERROR)
        self.assertIn("certified", again["reference"])
        self.assertEqual(again["best"]["error"], 0.0)  # the stand-in's bodies move the same, whatever the method
        self.assertEqual(again["best"]["method"], "newton")
        # A reference that is known no better than the wanted error cannot say who meets it.
        stored = out / "references/my.json"
        stored.write_text(json.dumps(json.loads(stored.read_text()) | {"uncertainty_m": 0.03}))
        self.assertEqual(self.ask(scene, "--error", 0.03, "--out", out, "--measure", references.ERROR)["basis"], "alike")


    def test_where_no_two_methods_agree_the_answer_is_by_how_a_method_converges(self):
        scene = self.top / "my.xml"
        scene.write_text("<scenario/>")
        self.environment = standin.environment(FAKE=json.dumps({"my": "apart"}))
        made = self.ask(scene, "--error", 0.01, "--out", self.top / "mine")
        self.assertEqual((made["basis"], made["reference"]), ("converging", "missing"))
        self.assertIn("no second method agrees", made["why"])
        # The motion of a method is off by 10 s times its step: from the finest, 2.5e-4 s, a run at 1e-3 s by 7.5e-3 m.
        self.assertAlmostEqual(made["best"]["error"], 7.5e-3, 9)
        # Methods are 1 m a second apart from each other, up to 4 m a second.
        far = float(made["trust"].split("up to ")[1].split()[0])
        self.assertTrue(10 <= far <= 40, made["trust"])
        for flag in (("--verify", ), ("--against", "ode")):
            self.assertIn(f"{flag[0]} compares errors", self.ask(scene, "--error", 0.01, "--out", self.top / "mine", *flag, code=2))
        # Where none converges either, what solves its contact problems is named, and that nothing is known of its error.
        none = self.ask(scene, "--error", 1e-9, "--out", self.top / "mine", code=3)
        self.assertAlmostEqual(none["nearest"]["error"], made["best"]["error"], 9)
        self.assertEqual((none["basis"], [s["basis"] for s in none["steps"]]), ("residual", ["converging", "residual"]))
        self.assertEqual(none["best"]["run"], none["steps"][1]["best"]["run"])
        with contextlib.redirect_stdout(io.StringIO()) as said:
            recommend.show_all(none)
        self.assertIn("not by converging: the least is 0.0075 m", said.getvalue())

    def test_for_as_long_as_two_methods_are_alike_they_say_who_meets_the_error(self):
        scene = self.top / "my.xml"
        scene.write_text("<scenario/>")
        self.environment = standin.environment(FAKE=json.dumps({"my": "alike"}))
        made = self.ask(scene, "--error", 5.55e-3, "--out", self.top / "mine")
        # ap and convex are 1 mm a second apart, which is less than the error for 5.5 s. Up to then ap at 1e-3 s is
        # 0.75 mm a second off its finest step, and less off convex's; convex at that step is 1.75 mm a second off ap's.
        self.assertEqual(made["basis"], "alike")
        self.assertIn("the first 5.5 s, and part then", made["trust"])
        self.assertEqual((made["best"]["method"], made["best"]["knobs"].split()[0]), ("ap", "step=0.001"))
        self.assertAlmostEqual(made["best"]["error"], 0.75e-3 * 5.5, 9)

    def test_where_nothing_is_right_the_least_wrong_is_named(self):
        scene = self.top / "my.xml"
        scene.write_text('<scenario><reference kind="missing"/></scenario>')
        self.environment = standin.environment(FAKE=json.dumps({"my": "inaccurate"}))
        made = self.ask(scene, "--error", 0.03, "--out", self.top / "mine", code=3)
        self.assertEqual((made["basis"], made["reference"], made["best"]), ("residual", "missing", None))
        self.assertEqual(made["why"], "to 1e-08 m: convex: inaccurate; to 1e-06 m: convex: inaccurate")
        self.assertTrue(made["nearest"]["run"].startswith("my__"))

    def test_a_setting_is_held_against_its_own_finest_step_and_no_other_s(self):
        def cell(k, step, place):
            made = types.SimpleNamespace(key=("ap", "lemke"), place=place)
            made.values = {"variant": "", "k": k, "epsilon": "", "step": step, "run": f"k{k} {step}"}
            return type("Cell", (), {"__getitem__": lambda _, name: made.values[name], "key": made.key, "place": place,
                                 "setting": f"A-P Lemke, k = {k}"})()

        cells = [cell("4", "1e-2", 5.0), cell("4", "1e-3", 4.0), cell("8", "1e-2", 2.5), cell("8", "5e-3", 2.0), cell("16", "1e-2", 9.0)]
        with mock.patch.object(ladder, "finished", lambda *_: cells), \
                mock.patch.object(ladder.precision, "apart", lambda a, b, until: abs(a.place - b.place)):
            self.assertEqual(ladder.own_steps(None, "", ""), {"k4 1e-3": 1.0, "k4 1e-2": 1.0, "k8 5e-3": 0.5, "k8 1e-2": 0.5})

    def test_motions_agree_until_the_last_moment_at_which_all_bodies_do(self):
        a = {(t, body): (t, 0.0, 0.0) for t in (0.0, 0.1, 0.2, 0.3) for body in ("a", "z")}
        self.assertEqual(references.agree_until(a, a, 1e-6), 0.3)
        self.assertEqual(references.agree_until(a, a | {(0.3, "z"): (0.4, 0.0, 0.0)}, 1e-6), 0.2)
        self.assertEqual(references.agree_until(a, a | {(0.3, "a"): (0.4, 0.0, 0.0)}, 1e-6), 0.2)
        self.assertIsNone(references.agree_until(a, a | {(0.1, "z"): (0.4, 0.0, 0.0)}, 1e-6))

    def test_where_nothing_can_be_measured_the_runner_up_is_another_setting_that_is_right_as_well(self):
        class Cell(dict):
            key = property(lambda self: self["setting"])

        def settings(*rows):
            return [{"cell": Cell(setting=key, status=status, false_claims=claims, max_gain_relative=""), "time_per_step": 0.0}
                    for key, status, claims in rows]

        best, again, refuted = ("a", "ok", "0"), ("a", "ok", "0"), ("b", "ok", "1")
        for others, second in (([], None), ([again, refuted], None), ([again, refuted, ("c", "inaccurate", "0"), ("d", "ok", "0")], "d")):
            with mock.patch.multiple(ladder, finished=lambda *of: [], own_steps=lambda *of: {}, sound=lambda *of: settings(best, *others)):
                row, = ladder.steps_down(None, "my", "", 1e-3, None)
            self.assertEqual(row["best"]["cell"].key, "a")
            self.assertEqual(row["runner_up"] and row["runner_up"]["cell"].key, second, others)

    def test_all_methods_on_one_scene_are_one_command_with_a_report_of_it_alone(self):
        scene = self.top / "my.xml"
        scene.write_text("<scenario/>")
        out = self.top / "mine"
        ended = subprocess.run([sys.executable, "-B", ROOT / "scripts/compare.py", scene, "--program", self.program, "--out", out],
                               capture_output=True, text=True, env=self.environment)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        # Newton's at four times the step of 1e-3 s errs by 0.04 m and is the cheapest.
        first = ended.stdout.splitlines()[1].split()
        self.assertEqual((first[0], first[-4:]), ("Newton", ["0.004", "0.04", "0.0275", "ok"]), ended.stdout)
        page = (out / "report.html").read_text()
        self.assertIn("Contact models compared: my", page)
        for word in ("paper", "reproduced", "contradicted"):
            at = page.lower().find(word)
            self.assertEqual(at, -1, page[max(0, at - 200):at + 200])
        sections = json.loads((out / "report.json").read_text())["sections"]
        self.assertNotIn("claim_table", sections)
        self.assertEqual(len(sections["differences"]["data"]["rows"]["my"]), len({r["run"] for r in sections["differences"]["data"]["rows"]["my"]}))
        # A run that ended without a summary says no step, and is a row like others.
        for run in (out / "runs").glob("my__mirtich__h0.004*__r*"):
            (run / "summary.json").unlink()
            record = json.loads((run / "run.json").read_text())
            (run / "run.json").write_text(json.dumps(record | {"status": "crash", "finished": False}))
        ended = subprocess.run([sys.executable, "-B", ROOT / "scripts/compare.py", scene, "--program", self.program, "--out", out],
                               capture_output=True, text=True, env=self.environment)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertIn(["Mirtich", "crash"], [line.split() for line in ended.stdout.splitlines()])


class References(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)
        self.scene = self.top / "scene.xml"
        self.scene.write_text("<scenario/>")

    def about(self, **more):
        return {"scene": "scene", "parameters": "mu=0.5", "scene_digest": references.digest(self.scene), "accepted": True,
                "duration": 1.0, "until": 1.0} | more

    def store(self, about, motion):
        references.Reference(about, motion).store(self.top)

    def trajectory(self, shift, until=1.0):
        path = self.top / "trajectory.csv"
        path.write_text("t,body,px,py,pz\n" + "".join(f"{t},box,{t + shift},0,0\n" for t in (0.0, 0.1 + 2e-17, until)))
        return path

    def test_the_error_is_the_largest_distance_at_the_same_moments(self):
        self.store(self.about(), {(t, "box"): (t, 0.0, 0.0) for t in (0.0, 0.1, 0.2, 1.0)})
        known = references.read(self.top, "scene", "mu=0.5", [self.scene])
        self.assertAlmostEqual(known.error(1.0, self.trajectory(0.25)), 0.25)
        self.assertIsNone(known.error(2.0, self.trajectory(0.25)), "a run that goes on longer")
        self.assertAlmostEqual(known.error(0.2, self.trajectory(0.25, 0.2)), 0.25)
        self.assertIsNone(known.error(1.0, self.trajectory(0.25, 0.5)), "a run that is not known at the end")
        self.assertIsNone(known.error(1.0, self.top / "none.csv"))
        # Moments are kept to a nanosecond, and a third of a second is a little longer than the last one of it.
        third = references.places(self.trajectory(0, 1 / 3))
        self.store(self.about(duration=1 / 3, until=max(t for t, _ in third)), third)
        known = references.read(self.top, "scene", "mu=0.5", [self.scene])
        self.assertAlmostEqual(known.error(1 / 3, self.trajectory(0.25, 1 / 3)), 0.25)
        self.assertIsNone(known.error(1 / 3 + 1e-8, self.trajectory(0.25, 1 / 3)))

    def test_a_reference_of_another_scene_file_is_none(self):
        self.store(self.about(), {(1.0, "box"): (0.0, 0.0, 0.0)})
        self.scene.write_text("<scenario />")
        self.assertIsNone(references.read(self.top, "scene", "mu=0.5", [self.scene]))

    def test_a_reference_of_another_robot_file_is_none(self):
        robot = self.top / "scene.urdf"
        robot.write_text("<robot/>")
        files = program.files_of(standin.write(self.top / "program"), self.scene, "mu=0.5")
        self.assertEqual(files, (str(self.scene), str(robot)))
        self.store(self.about(scene_digest=references.digest(*files)), {(1.0, "box"): (0.0, 0.0, 0.0)})
        self.assertIsNotNone(references.read(self.top, "scene", "mu=0.5", files))
        robot.write_text("<robot />")
        self.assertIsNone(references.read(self.top, "scene", "mu=0.5", files))

    def test_a_reference_that_was_refused_has_a_reason_and_no_error(self):
        self.store(self.about(accepted=False, reason="they differ"), None)
        known = references.read(self.top, "scene", "mu=0.5", [self.scene])
        self.assertEqual((known.about["reason"], known.error(1.0, self.trajectory(0))), ("they differ", None))

    def certified(self, *motions):
        """What becomes of a scene whose runs end like this: at its own step, to 1e-8 m, to ten times that, of the other methods;
        then to 1e-6 m. A place, or a list of them, each 0.5 s."""
        class Scripted:
            program, file, sets, said = "/bin/false", self.scene, [], iter(motions)

            def run(self, method, accuracy, duration):
                x = next(self.said)
                summary = {"scenario": "scene", "status": "ok" if x is not None else "ray", "reason": None, "finished": x is not None,
                           "options": {"step": 0.01, "duration": 1.0}, "residuals": {"false_claims": 0, "law_max": 0.0},
                           "time": {"total_s": 1.0}, "versions": {}, "machine": {}}
                places = x if isinstance(x, list) else [x, x]
                return summary, None if x is None else {(0.5 * n + 0.5, "box"): (p, 0.0, 0.0) for n, p in enumerate(places)}, "command"
        made = references.certify(Scripted(), None)
        return made.about, made.motion

    def test_two_methods_must_agree_to_a_tenth_of_what_is_to_be_measured(self):
        about, motion = self.certified(0.1, 0.0, 1e-3, 5e-3)
        self.assertTrue(about["accepted"])
        self.assertEqual((about["uncertainty_m"], about["accuracy_m"], about["own_step"], about["reason"]), (5e-3, 1e-8, 0.01, ""))
        about, motion = self.certified(0.1, 0.0, 6e-3, 0.02, 5e-3)
        self.assertTrue(about["accepted"], "the second of the others agrees")
        self.assertEqual(about["uncertainty_m"], 6e-3, "what ten times the accuracy changed")
        about, motion = self.certified(0.1, 0.0, 0.0, 0.02, 0.02, None, 0.0, 0.0, 0.02, 0.03, 0.03)
        self.assertIsNone(motion)
        self.assertIn("ap lemke: apart by more than 0.01 m from 0 s on", about["reason"])
        self.assertIn("ap path: ray", about["reason"])
        about, motion = self.certified(0.1, None, 0.0, 0.0, 1e-3)
        self.assertEqual((about["accepted"], about["accuracy_m"]), (True, 1e-6), "where the finer run fails")
        about, motion = self.certified(0.1, None, None)
        self.assertIn("to 1e-06 m: convex: ray", about["reason"])

    def test_a_reference_ends_where_two_methods_part(self):
        about, motion = self.certified(0.1, [0.0, 0.0], [0.0, 0.5], [1e-3, 0.5], [1e-3, 0.4], [1e-3, 0.4])
        self.assertEqual((about["accepted"], about["until"], about["uncertainty_m"], len(motion)), (True, 0.5, 1e-3, 1))
        self.assertIn("from 0.5 s on", about["reason"])


if __name__ == "__main__":
    unittest.main()
