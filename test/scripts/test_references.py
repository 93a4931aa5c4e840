"""scripts/contactbench/references.py: how runs of a reference are called, what of them is kept, when it is made again, and
what is said. On a program that is made up; test_recommend.py has what agreement means."""
import contextlib
import io
import itertools
import json
import types
import unittest
from pathlib import Path
from unittest import mock

from contactbench import program, references
from folder import Folder


class Scratch(Folder):
    def setUp(self):
        super().setUp()
        self.scene = self.top / "scene.xml"
        self.scene.write_text("<scenario/>")


class Motions(Scratch):
    def test_places_are_told_by_moment_and_body(self):
        path = self.top / "trajectory.csv"
        path.write_text("t,body,qw,pz,px,py\n0.1,b,9,3,1,2\n0.30000000000000004,b,9,6,4,5\n0.3,a,9,9,7,8\n0.4,a,9\n")
        self.assertEqual(references.places(path), {(0.1, "b"): (1, 2, 3), (0.3, "b"): (4, 5, 6), (0.3, "a"): (7, 8, 9)})

    def test_two_motions_are_as_far_apart_as_a_body_at_any_moment_that_both_have(self):
        a = {(t, body): (0.0, 0.0, 0.0) for t in (0.0, 0.5, 1.0) for body in "ab"}
        b = a | {(0.5, "b"): (2.0, 3.0, 6.0), (1.0, "a"): (0.0, 5.0, 0.0)}
        self.assertEqual(references.apart(a, b), 7)
        self.assertEqual(references.apart(a, references.up_to(b, 0.4)), 0)
        self.assertEqual(references.up_to(b, 0.5), {key: place for key, place in b.items() if key[0] < 1})
        # The shorter one may end earlier, and must then be known at its end; of none in common nothing is known.
        longer = b | {(2.0, "a"): (9.0, 9.0, 9.0), (1.25, "b"): (9.0, 9.0, 9.0)}
        self.assertEqual(references.apart(a, longer), 7)
        del longer[1.0, "a"], longer[1.0, "b"]
        self.assertIsNone(references.apart(a, longer))
        self.assertIsNone(references.apart({(0.1, "a"): (0, 0, 0)}, {(0.2, "a"): (0, 0, 0)}))

    def test_motions_agree_up_to_the_last_moment_before_one_that_differs(self):
        a = {(t, "a"): (t, 0.0, 0.0) for t in (0.0, 0.5, 1.0, 1.5)}
        of = lambda at, off: references.agree_until(a, a | {(at, "a"): (at, 0.0, off)}, 1e-3)
        self.assertEqual([of(1.5, 0.9e-3), of(1.5, 1.1e-3), of(1.0, -1.1e-3)], [1.5, 1.0, 0.5])
        self.assertIsNone(of(0.5, 1.0))  # at the start alone
        self.assertIsNone(references.agree_until(a, {}, 1))

    def test_what_is_stored_is_read_back_to_the_last_bit(self):
        motion = {(0.1, "a"): (1 / 3, -2e-17, 0.1 + 0.2), (0.2, "b"): (4.0, 5.0, 6.0)}
        about = {
            "scene": "scene", "parameters": "boxes=4 mu=1", "scene_digest": program.digest(self.scene), "accepted": True,
            "until": 1.0}
        references.Reference(about, motion).store(self.top / "new")
        self.assertEqual({path.name for path in (self.top / "new").iterdir()},
                         {f"scene__boxes-4__mu-1.{end}" for end in ("csv", "json")})
        read = references.read(self.top / "new", "scene", "boxes=4 mu=1", [self.scene])
        self.assertEqual((read.about, read.motion), (about, motion))
        self.assertIsNone(references.read(self.top / "new", "scene", "boxes=4", [self.scene]))
        # A value may be an expression.
        references.Reference(about | {"parameters": "lean=pi/8"}, motion).store(self.top / "new")
        self.assertEqual(references.read(self.top / "new", "scene", "lean=pi/8", [self.scene]).motion, motion)
        # One of an older program, which does not say until when, is none; nor is one that is damaged.
        file = self.top / "new/scene__boxes-4__mu-1.json"
        for text in (json.dumps({k: v for k, v in about.items() if k != "until"}), "{"):
            file.write_text(text)
            self.assertIsNone(references.read(self.top / "new", "scene", "boxes=4 mu=1", [self.scene]))


class Making(Scratch):
    def run_one(self, *of, code=0, finished=True, stderr="", steps=10):
        """What Maker.run returns, and the words of the program."""
        asked = []

        def call(*words):
            asked.append([str(w) for w in words])
            out = Path(words[-1])
            out.mkdir(exist_ok=True)
            (out / "summary.json").write_text(json.dumps({"finished": finished}))
            # A step of 0.04 s meets the moments of a tenth of a second at every fifth of one.
            times = [0.04 * n for n in range(steps + 1)]
            (out / "trajectory.csv").write_text("t,body,px,py,pz\n" + "".join(f"{t!r},a,{t!r},0,0\n" for t in times))
            return types.SimpleNamespace(returncode=code, stderr=stderr)

        with mock.patch.object(program, "call", call):
            return references.Maker("prog", self.scene, ["a=1", "b=2"], self.top, 60).run(*of), asked[0]

    def test_a_run_to_an_accuracy_keeps_the_moments_of_the_reference(self):
        (summary, motion, command), words = self.run_one(("--method", "ap", "--solver", "path"), 1e-8, 2.5)
        flags = [
            "--method", "ap", "--solver", "path", "--accuracy", "1e-08", "--record-interval", "0.1", "--duration", "2.5", "--set",
            "a=1", "--set", "b=2"]
        self.assertEqual(
            words,
            ["prog", "run",
             str(self.scene), *flags, "--time-limit", "60", "--quiet", "--out",
             str(self.top / "ap__path__1e-08")])
        self.assertEqual(command, " ".join(["contactbench run scene.xml", *flags]))
        self.assertEqual([t for t, _ in motion], [0.0, 0.2, 0.4])
        self.assertEqual(summary, {"finished": True})

    def test_the_end_of_a_run_is_kept_though_it_is_no_such_moment(self):
        (_, motion, _), _ = self.run_one(("--method", "ap"), 1e-8, 0.32, steps=8)
        self.assertEqual([t for t, _ in motion], [0.0, 0.2, 0.32])

    def test_a_run_at_the_scene_s_own_step_and_length_names_neither(self):
        (_, motion, _), words = self.run_one(("--method", "convex"), None, None, code=3, finished=False)
        self.assertEqual(words[3:9], ["--method", "convex", "--set", "a=1", "--set", "b=2"])
        self.assertIsNone(motion)
        with self.assertRaisesRegex(program.ProgramError, "no such scene"):
            self.run_one(("--method", "convex"), None, None, code=2, stderr="no such scene\n")
        with self.assertRaisesRegex(program.ProgramError, "prog ended without a word"):
            self.run_one(("--method", "convex"), None, None, code=-6)

    def certify(self, runs, duration=None):
        """`runs`: x of the one body at 1 s and 2 s of each run in turn, or what its summary says otherwise."""
        asked, number = [], itertools.count()

        class Scripted:
            program, file, sets, said = "/bin/false", self.scene, ["a=1", "b=2"], iter(runs)

            def run(self, method, accuracy, duration):
                asked.append((method, accuracy, duration))
                x, n = next(self.said), next(number)
                summary = {
                    "scenario": "scene", "status": "ok", "reason": "", "finished": True, "options": {
                        "step": 0.05, "duration": 2.0}, "residuals": {"false_claims": 0, "law_max": n / 100}, "time": {
                            "total_s": n + 0.5}, "versions": {"git": n}, "machine": {"cpu": n}, "accuracy": {
                                "estimated_error_m": n / 1000}}
                if isinstance(x, dict):
                    return summary | x, {(1.0, "a"): (0.0, 0.0, 0.0)}, f"command {n}"
                return summary, {(t, "a"): (p, 0.0, 0.0) for t, p in zip((1.0, 2.0), x)}, f"command {n}"

        made = references.certify(Scripted(), duration)
        return made.about, made.motion, asked

    def test_a_reference_says_how_it_was_made(self):
        about, motion, asked = self.certify([(0.0, 0.75), (0.0, 0.5), (0.0, 0.5 + 3e-9), (0.0, 0.5 - 2e-9)])
        convex, coulomb = references.FIRST, references.SECOND[0]
        self.assertEqual(asked, [(convex, None, None), (convex, 1e-8, 2.0), (convex, 1e-7, 2.0), (coulomb, 1e-8, 2.0)])
        self.assertAlmostEqual(about.pop("uncertainty_m"), 3e-9, delta=1e-15)
        self.assertEqual(about.pop("runs"), [{
            "command": f"command {n}", "status": "ok", "law_residual_max": n / 100, "estimated_error_m": n / 1000,
            "seconds": n + 0.5, **({"agree_until_s": 2.0} if n == 3 else {})} for n in (1, 2, 3)])
        self.assertEqual(
            about, {
                "scene": "scene", "parameters": "a=1 b=2", "scene_digest": program.digest(self.scene), "accepted": True,
                "reason": "", "own_step": 0.05, "took_s": 0.5, "accuracy_m": 1e-8, "duration": 2.0, "asked_s": None, "until": 2.0, "versions": {
                    "git": 0}, "machine": {"cpu": 0}, "error_of_own_step_m": 0.25})
        self.assertEqual(motion, {(1.0, "a"): (0.0, 0.0, 0.0), (2.0, "a"): (0.5, 0.0, 0.0)})

    def test_the_second_method_that_agrees_for_longest_is_taken(self):
        # They may differ by a tenth of 0.25 m. The first of the others leaves after a second, the next stays to the end.
        about, motion, asked = self.certify([(0.0, 0.75), (0.0, 0.5), (0.0, 0.5), (0.001, 0.6), (0.002, 0.51)])
        self.assertEqual((about["until"], about["uncertainty_m"], about["reason"], len(asked)),
                         (2.0, 0.010000000000000009, "", 5))
        # Where none does to the end, what it is left at is said; the parts up to there count.
        about, motion, asked = self.certify([(0.0, 0.75), (0.0, 0.5), (0.004, 0.9), (0.001, 0.6), (9.0, 0.5), (0.003, 0.7)])
        self.assertEqual((about["accepted"], about["until"], about["uncertainty_m"], len(motion)), (True, 1.0, 0.004, 1))
        self.assertEqual(about["reason"], "coulomb: apart by more than 0.025 m from 1 s on")
        self.assertEqual([run.get("agree_until_s") for run in about["runs"]], [None, None, 1.0, None, 1.0])

    def test_the_error_of_a_step_that_the_duration_is_no_multiple_of_is_known(self):
        class Scripted:
            program, file, sets = "/bin/false", self.scene, []

            def run(self, method, accuracy, duration):
                x, times = (0.0, (0.9, 1.8, 2.0)) if accuracy else (0.25, (0.9, 1.8, 2.001))  # by steps of 3 ms
                x = 0.01 if method == references.SECOND[0] else x
                summary = {
                    "scenario": "scene", "status": "ok", "reason": "", "options": {"step": 3e-3, "duration": 2.0}, "residuals": {
                        "false_claims": 0, "law_max": 0.0}, "time": {"total_s": 1}, "versions": {}, "machine": {}}
                return summary, {(t, "a"): (x, 0.0, 0.0) for t in times}, "command"

        about = references.certify(Scripted(), None).about
        self.assertEqual((about["error_of_own_step_m"], about["accepted"], about["until"]), (0.25, True, 2.0))

    def test_a_run_whose_claims_are_refuted_or_that_does_not_end_ok_is_no_witness(self):
        refuted = {"residuals": {"false_claims": 1, "law_max": 0.0}}
        for bad in (refuted, {"status": "inaccurate", "reason": "why"}):
            about, motion, asked = self.certify([(0.0, 0.75), bad, (0.0, 0.5), (0.0, 0.5), (0.0, 0.5)])
            self.assertEqual((about["accepted"], about["accuracy_m"], [of[1] for of in asked]),
                             (True, 1e-6, [None, 1e-8, 1e-6, 10 * 1e-6, 1e-6]))
            self.assertEqual(len(about["runs"]), 4)
        about, motion, _ = self.certify([(0.0, 0.75), {"status": "ray", "reason": "why"}, {"status": "inaccurate"}])
        self.assertEqual((about["reason"], motion), ("to 1e-08 m: convex: ray (why); to 1e-06 m: convex: inaccurate", None))
        # What ten times the accuracy comes to must be known.
        about, motion, _ = self.certify([(0.0, 0.75), *2 * [(0.0, 0.5), refuted, (0.0, 0.5)]])
        self.assertFalse(about["accepted"])

    def test_a_reference_is_made_where_none_is_of_this_scene_and_duration(self):
        made, kept = [], self.top / "kept"

        def certify(maker, duration):
            made.append((maker.program, maker.file, maker.sets, maker.limit, duration))
            about = {
                "scene": "scene", "parameters": "a=1", "scene_digest": program.digest(self.scene), "accepted": False,
                "until": None, "duration": duration or 5.0, "asked_s": duration, "reason": "x"}
            return references.Reference(about, None)

        with mock.patch.object(references, "certify", certify), mock.patch.object(program, "files_of", lambda *_:
                                                                                  (str(self.scene), )):

            def make(duration, again=False):
                return references.make("prog", str(self.scene), ["a=1"], duration, kept, 60, again).about["duration"]

            self.assertEqual([make(None), make(None), make(5.0)], [5.0] * 3)
            self.assertEqual(made, [("prog", str(self.scene), ["a=1"], 60, None)])
            self.assertEqual((make(7.0), make(None), len(made)), (7.0, 5.0, 3))  # the scene's own again
            self.assertEqual((make(7.0, again=True), len(made)), (7.0, 4))
            self.scene.write_text("<scenario />")
            self.assertEqual((make(7.0), len(made)), (7.0, 5))

    def main(self, *words, about):
        asked = []
        listed = {"scenarios": [{"name": f"{name}.xml", "file": f"/p/{name}.xml"} for name, _ in references.SCENES]}
        with mock.patch("sys.argv", ["references.py", "--program", "sh", "--out", str(self.top / "o"), *words]), \
                mock.patch.object(program, "listed", lambda _: listed), contextlib.redirect_stdout(io.StringIO()) as said, \
                mock.patch.object(references, "make", lambda *of: asked.append(of) or types.SimpleNamespace(about=about)):
            references.main()
        return asked, said.getvalue().splitlines()

    def test_the_command_makes_the_scenes_of_the_project_or_one(self):
        about = {"accepted": True, "uncertainty_m": 1.26e-8, "until": 2.5, "duration": 5.0, "reason": "x"}
        asked, said = self.main("--limit", "7", "--again", about=about)
        self.assertEqual(asked, [
            ("sh", f"/p/{name}.xml", [], duration, self.top / "o", 7.0, True) for name, duration in references.SCENES])
        self.assertEqual(said, [f"{name}, 2.5 of 5 s: to 1.3e-08 m" for name, _ in references.SCENES])
        asked, said = self.main(str(self.scene), "--set", "a=1", "--duration", "3",
                                about=about | {"accepted": False, "until": None})
        self.assertEqual(asked, [("sh", str(self.scene), ["a=1"], 3.0, self.top / "o", 300, False)])
        self.assertEqual(said, [f"{self.scene.with_suffix('')}, 5 of 5 s: missing (x)"])
        asked, _ = self.main("grasp.xml", about=about)
        self.assertEqual(asked[0][1], "/p/grasp.xml")
        with self.assertRaisesRegex(SystemExit, "no scene moon"):
            self.main("moon", about=about)
        with self.assertRaisesRegex(SystemExit, "/nowhere/p is no program"):
            self.main("--program", "/nowhere/p", about=about)


if __name__ == "__main__":
    unittest.main()
