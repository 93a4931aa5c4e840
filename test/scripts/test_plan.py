"""scripts/contactbench/plan.py: from sweep files to runs, their names and their flags."""
import dataclasses
import math
import unittest
from pathlib import Path

from contactbench import plan, program, table1
from contactbench.plan import Run
from folder import Folder


def method(name, solvers=(), variants=(), flags=(), **more):
    options = [{"flag": flag} for flag in flags]
    return {"name": name, "solvers": list(solvers), "variants": list(variants), "options": options, **more}


LISTED = {
    "methods": [method("newton", variants=("uncapped", "stick-tested"), no_expansion="contact after contact"),
                method("ap", ("lemke", "path"), flags=("k", "warm-start")), method("convex", ("ipm", ), flags=("epsilon", ))],
    "solvers": [{"method": "ap", "name": "lemke", "unavailable": None},
                {"method": "ap", "name": "path", "unavailable": "not installed"},
                {"method": "convex", "name": "ipm", "unavailable": None}],
    "scenarios": [{"name": "stack.xml", "file": "/p/stack.xml", "parameters": {"boxes": "16", "mu": "0.5"}},
                  {"name": "slide.xml", "file": "/p/slide.xml", "parameters": {"rotate_cone": "0"}}],
    "engines": [{"name": "ode", "unavailable": None, "variants": [{"name": "quick"}, {"name": "world"}]},
                {"name": "dart", "unavailable": "not installed"}], "statuses": []}


class Names(unittest.TestCase):
    run_ = Run("stack", (("boxes", "4"), ("mu", "1/2")), "ap", "v", "lemke",
               (("step", "1e-3"), ("order", "2"), ("warm_start", "on"), ("k", "8"), ("other", "x")), 3)

    def test_a_run_s_name_has_all_that_tells_it_from_others(self):
        self.assertEqual(self.run_.name, "stack__boxes-4__mu-1:2__ap__v__lemke__h1e-3__p2__warm-on__k8__other-x__r3")
        self.assertEqual(dataclasses.replace(self.run_, member=2, variant="", sets=(), knobs=()).name, "stack__ap__lemke__m2")
        knobs = (("stepping", "a"), ("accuracy", "b"), ("record_interval", "c"), ("joint_forces", "d"), ("duration", "e"),
                 ("epsilon", "f"), ("epsilon_relative", "g"), ("compression_bound", "h"), ("regularise", "i"),
                 ("restitution", "j"), ("friction", "l"), ("prune", "m"))
        self.assertEqual(
            Run("s", (), "m", "", "", knobs, 1).name,
            "s__m__by-a__Ab__dtc__joints-d__Te__epsf__epsrelg__bound-h__regi__ej__mul__prune-m__r1")

    def test_flags_are_those_of_the_program(self):
        self.assertEqual(self.run_.flags(), [
            "--method", "ap", "--variant", "v", "--solver", "lemke", "--step", "1e-3", "--order", "2", "--warm-start", "on",
            "--k", "8", "--other", "x", "--set", "boxes=4", "--set", "mu=1/2"])
        self.assertEqual(
            Run("stack", (), "ode", "quick", "", (), 1, engine=True).flags(), ["--engine", "ode", "--variant", "quick"])
        self.assertEqual(
            Run("stack", (), "mirtich", "", "", (), 1, member=2).flags(),
            ["--method", "mirtich", "--perturb", "1e-15", "--seed", "2", "--shuffle-contacts", "2"])

    def test_a_member_gets_what_is_not_given_and_its_command_without_that_is_the_run_s(self):
        self.assertEqual(plan.member_flags(0), [])
        for given, flags in (((), "--perturb 1e-15 --seed 3 --shuffle-contacts 3"), (("--perturb", "1"), "--shuffle-contacts 3"),
                             (("--shuffle-contacts", "1"), "--perturb 1e-15 --seed 3"), (("--perturb", "--shuffle-contacts"),
                                                                                         "")):
            self.assertEqual(" ".join(plan.member_flags(3, given)), flags)
            command = " ".join(filter(None, ("contactbench run", *given, flags)))
            self.assertEqual(plan.without_member(command, 3), " ".join(("contactbench run", *given)))
        self.assertEqual(plan.without_member("run --seed 3", 0), "run --seed 3")

    def test_a_member_is_recorded_coarsely_and_not_timed(self):
        run = dataclasses.replace(self.run_, record_contacts=True, members=5)
        member = run.as_member(4)
        self.assertEqual((member.member, member.timed, member.record_every, member.record_contacts, member.cell),
                         (4, False, 10, False, run.cell))
        for every in (0, 5, 20):
            self.assertEqual(dataclasses.replace(run, record_every=every).as_member(1).record_every, every)
        # Steps of an accuracy end at the moments of a reference.
        self.assertEqual(dataclasses.replace(run, knobs=(("accuracy", "1e-6"), )).as_member(1).record_every, 1)

    def test_what_a_run_asks_for_gives_the_run_back(self):
        run = dataclasses.replace(self.run_, knobs=(("step", "1e-3"), ("warm_start", "on"), ("k", "8"), ("epsilon", "1e-9")),
                                  member=2)
        self.assertEqual(
            run.asked(), {
                "run": run.name, "scene": "stack", "parameters": "boxes=4 mu=1/2", "method": "ap", "variant": "v",
                "solver": "lemke", "k": "8", "epsilon": "1e-9", "knobs": "step=1e-3 warm_start=on", "repeat": 3, "member": 2,
                "engine": ""})
        again = Run.of({key: str(value) for key, value in run.asked().items()})
        self.assertEqual((again.repeat, again.sets, dict(again.knobs)), (3, run.sets, dict(run.knobs)))
        self.assertEqual([name for name, _ in again.knobs], ["step", "k", "epsilon", "warm_start"])
        self.assertEqual(Run("s", (), "ode", "", "", (), 1, engine=True).asked()["engine"], "ode")


class Files(Folder):
    def plan(self, *texts, profile=""):
        paths = [self.top / f"sweep{n}.toml" for n in range(len(texts))]
        for path, text in zip(paths, texts):
            path.write_text(text)
        return plan.plan(paths, profile, LISTED)

    def runs(self, *texts, profile=""):
        return self.plan(*texts, profile=profile)[0]

    def test_a_file_that_is_wrong_is_refused_with_what_would_be_right(self):
        for text, said in (("x = [", "sweep0.toml: "), ("k = 4", "no [[runs]] block"),
                           ("bananas = 4\n[[runs]]\nscene = 's'", "unknown key 'bananas'; "
                            "known: accuracy, "), ("[[runs]]\nscene = 'stack'\n[[runs]]\nscene = 'stack'\nkk = 4",
                                                   "block 2: unknown key 'kk'; known: "),
                           ("[profiles.a]\n[[runs]]\nscene = 'stack'\na.kk = 4", "block 1: unknown key 'kk'"),
                           ("[profiles.a]\nk = 4\n[profiles.b]\nmember = 5\n[[runs]]\nscene = 'stack'",
                            "profile b: unknown key 'member'; known: "),
                           ("[[runs]]\nk = 4", "block 1: no scene"), ("[[runs]]\nscene = 'none.xml'",
                                                                      f"no file {self.top.resolve()}/none.xml"),
                           ("[[runs]]\nscene = 'stack'\nset.bricks = 1", "stack has no parameter 'bricks'; it has boxes, mu")):
            with self.assertRaises(plan.SweepError) as refused:
                self.plan(text)
            self.assertIn(said, str(refused.exception))
            self.assertIn("sweep0.toml", str(refused.exception))
        with self.assertRaisesRegex(plan.SweepError, "no profile 'b'; known: a, c"):
            self.plan("[profiles.a]\n[profiles.c]\n[[runs]]\nscene = 'stack'", profile="b")
        with self.assertRaisesRegex(plan.SweepError, "none.toml: No such file"):
            plan.plan([self.top / "none.toml"], "", LISTED)

    def test_each_profile_has_every_column_of_table_1_at_the_paper_s_settings(self):
        # With another duration, as with any other knob, a run is none of the table's.
        scenes = [{"name": f"{name}.xml", "file": f"/p/{name}.xml", "parameters": {"boxes": "16"}}
                  for name in dict.fromkeys(column[0] for column in table1.COLUMNS)]
        listed = LISTED | {"scenarios": scenes, "methods": [*LISTED["methods"], method("mirtich")]}
        for profile in ("quick", "paper"):
            asked = [run.asked() for run in plan.plan([program.ROOT / "scenarios/sweeps/paper.toml"], profile, listed)[0]]
            there = {tuple(row[c] for c in ("scene", "parameters", "method", "k")) for row in asked if not row["knobs"]}
            for scene, parameters, k, _ in table1.COLUMNS:
                for name, edges in (("newton", ""), ("mirtich", ""), ("ap", k), ("convex", "")):
                    self.assertIn((scene, parameters, name, edges), there, profile)

    def test_two_scenes_of_one_name_are_refused_and_one_that_two_blocks_name_is_not(self):
        for folder in ("a", "b"):
            (self.top / folder).mkdir()
            (self.top / folder / "box.xml").write_text("<scenario/>")
        (self.top / "stack.xml").write_text("<scenario/>")
        one = "[[runs]]\nscene = '{}'\nmethods = ['ap']\n".format
        for first, second in (("a/box.xml", "b/box.xml"), ("stack", "stack.xml"), ("stack.xml", "stack")):
            with self.assertRaisesRegex(plan.SweepError, f"two scenes are called {Path(first).stem}, .*rename one"):
                self.plan(one(first) + one(second))
        self.assertEqual(self.runs(one("a/box.xml") + one("a/box.xml")), self.runs(one("a/box.xml")))

    def test_values_lose_their_blanks_which_would_part_them_in_a_table(self):
        run, = self.runs("[[runs]]\nscene = 'stack'\nset.mu = '0.5 * 2'\nmethods = ['ap/lemke']\nk = 4\n")
        self.assertEqual(dict(run.sets)["mu"], "0.5*2")
        self.assertEqual(plan.Run.of(run.asked()).sets, run.sets)

    def test_a_method_is_asked_for_by_its_whole_name_or_what_stands_before_the_slash(self):
        for patterns, wanted in ((None, True), ([], True), (["ap"], True), (["ap/lemke"], True), (["ap/lem"], False), ([
                "a"], False), (["convex", "ap"], True)):
            self.assertEqual(plan.wanted("ap/lemke", patterns), wanted, patterns)

    def test_each_method_has_its_own_knobs_beside_those_of_all(self):
        runs = self.runs(
            "[[runs]]\nscene = 'stack'\nstep = ['1e-3', 1e-4]\nk = 4\nepsilon = 1e-9\nprune = false\nwarm_start = true\n"
            "set.mu = [0.25, 0.50]\n")
        self.assertEqual(sorted({(r.method, r.variant, r.solver) for r in runs}), [("ap", "", "lemke"), ("convex", "", "ipm"),
                                                                                   ("newton", "stick-tested", ""),
                                                                                   ("newton", "uncapped", "")])
        self.assertEqual(len(runs), 4 * 2 * 2)
        self.assertEqual([(r.sets, r.knobs) for r in runs if r.method == "ap"], [
            ((("mu", mu), ), (("step", step), ("prune", "off"), ("k", "4"), ("warm_start", "on")))
            for mu in ("0.25", "0.50") for step in ("1e-3", "1e-4")])
        self.assertEqual({r.knobs for r in runs if r.method == "newton"},
                         {(("step", step), ("prune", "off")) for step in ("1e-3", "1e-4")})
        self.assertEqual({r.knobs[2] for r in runs if r.method == "convex"}, {("epsilon", "1e-9")})

    def test_a_block_comes_before_a_profile_and_that_before_the_file_and_a_profile_of_the_block_before_all(self):
        text = "methods = ['ap']\nk = 4\nstep = 1\nrepeats = 2\nduration = 5\n[profiles.p]\nk = 6\nstep = 2\nrepeats = 3\n" \
               "[[runs]]\nscene = 'stack'\nstep = 3\nk = 8\np.k = 10\n"
        for profile, knobs, repeats in (("", {"step": "3", "k": "8", "duration": "5"}, 2), ("p", {
                "step": "3", "k": "10", "duration": "5"}, 3)):
            runs = self.runs(text, profile=profile)
            self.assertEqual([dict(r.knobs) for r in runs], [knobs] * repeats)
        # A block may be of some profiles alone, and may leave a knob of the file out.
        text = "methods = ['ap']\nk = 4\n[profiles.p]\n[profiles.q]\n[[runs]]\nscene = 'stack'\nprofiles = ['q']\n" \
               "[[runs]]\nscene = 'slide'\nk = []\n"
        self.assertEqual([(r.scene, r.knobs) for r in self.runs(text, profile="p")], [("slide", ())])
        self.assertEqual([r.scene for r in self.runs(text, profile="q")], ["stack", "slide"])
        self.assertEqual([r.scene for r in self.runs(text)], ["stack", "slide"])

    def test_settings_are_those_of_the_file_and_else_the_usual_ones(self):
        run, = self.runs("methods = ['convex']\n[[runs]]\nscene = 'stack'\n")
        self.assertEqual(
            (run.record_every, run.timed, run.time_limit_s, run.memory_limit_mb, run.members, run.record_contacts, run.repeat),
            (1, True, 3600, 4096, 0, False, 1))
        text = "methods = ['convex']\nengines = ['ode/quick']\nmembers = 7\nrecord_every = 5\ntimed = false\ntime_limit_s = 9\n" \
               "memory_limit_mb = 100\nrecord_contacts = true\nrepeats = 2\n[[runs]]\nscene = 'stack'\n"
        runs = self.runs(text)
        self.assertEqual([(r.method, r.engine, r.repeat, r.members, r.record_contacts) for r in runs],
                         [("convex", False, 1, 7, True), ("ode", True, 1, 0, False), ("convex", False, 2, 7, True),
                          ("ode", True, 2, 0, False)])
        self.assertEqual({(r.record_every, r.timed, r.time_limit_s, r.memory_limit_mb, r.sweeps) for r in runs},
                         {(5, False, 9, 100, ("sweep0", ))})

    def test_an_interval_of_records_is_so_many_steps(self):
        for settings, step, every in (("record_interval_s = '0.1'", "1e-3", 100), ("record_interval_s = 0.1", "0.04", 2),
                                      ("record_interval_s = 0.3", "0.1", 3),
                                      ("record_interval_s = 0.1", "1", 1), ("record_every = 7", "1e-3", 7)):
            run, = self.runs(f"methods = ['convex']\n{settings}\n[[runs]]\nscene = 'stack'\nstep = '{step}'\n")
            self.assertEqual(run.record_every, every, (settings, step))
        run, = self.runs("methods = ['convex']\nrecord_interval_s = 0.1\nrecord_every = 3\n[[runs]]\nscene = 'stack'\n")
        self.assertEqual(run.record_every, 3)  # of a step that is the scene's own

    def test_an_accuracy_takes_the_place_of_a_step_and_not_of_methods_without_an_expansion(self):
        runs = self.runs("step = 1\nk = 4\n[[runs]]\nscene = 'stack'\naccuracy = [1e-6, 1e-8]\n")
        self.assertEqual([(r.method, r.knobs) for r in runs], [("ap", (("accuracy", "1e-6"), ("k", "4"))),
                                                               ("ap", (("accuracy", "1e-8"), ("k", "4"))),
                                                               ("convex", (("accuracy", "1e-6"), )),
                                                               ("convex", (("accuracy", "1e-8"), ))])

    def test_a_polygon_is_turned_by_its_own_angle_and_what_has_none_is_not(self):
        runs = self.runs("[[runs]]\nscene = 'slide'\nk = [4, 8]\nset.rotate_cone = ['pi/k', 'pi/2k', '0.5']\n")
        angles = {(r.method, dict(r.knobs).get("k"), r.sets[0][1]) for r in runs}
        self.assertEqual(
            angles, {
                *(("ap", str(k), angle) for k in (4, 8) for angle in (repr(math.pi / k), repr(math.pi / (2 * k)), "0.5")),
                ("newton", None, "0.5"), ("convex", None, "0.5")})

    def test_engines_have_the_knobs_that_they_share_and_their_setting(self):
        runs = self.runs(
            "engines = ['ode', 'dart']\nmethods = ['none']\nstep = 1\nk = 4\nprune = 'on'\nsetting = 'tuned'\nrestitution = 0\n"
            "duration = 2\nfriction = 0.5\n[[runs]]\nscene = 'stack'\n")
        self.assertEqual([(r.method, r.variant, [n for n, _ in r.knobs]) for r in runs],
                         [("ode", "quick", ["step", "duration", "restitution", "friction", "setting"]),
                          ("ode", "world", ["step", "duration", "restitution", "friction", "setting"]), ("dart", "", [])])

    def test_a_run_that_two_files_ask_for_is_one_of_both(self):
        text = "methods = ['convex']\ntimed = {}\nmembers = {}\nrecord_contacts = {}\n[[runs]]\nscene = 'stack'\n"
        run, = self.runs(text.format("false", 2, "false"), text.format("true", 5, "true"), text.format("false", 3, "false"))
        self.assertEqual((run.sweeps, run.timed, run.members, run.record_contacts),
                         (("sweep0", "sweep1", "sweep2"), True, 5, True))
        run, = self.runs(text.format("false", 2, "false"), text.format("false", 2, "false"))
        self.assertEqual((run.timed, run.record_contacts), (False, False))
        for either, other, both in ((4, 6, 2), (10, 0, 10), (0, 10, 10), (3, 9, 3)):  # 0: none; else the moments of both
            run, = self.runs(*(f"methods = ['convex']\nrecord_every = {every}\n[[runs]]\nscene = 'stack'\n" for every in (either, other)))
            self.assertEqual(run.record_every, both, (either, other))

    def test_what_the_program_does_not_have_is_said_with_its_reason(self):
        (self.top / "mine.xml").write_text("<scenario/>")
        runs, missing = self.plan(
            "outside = ['newton']\n[[runs]]\nscene = 'moon'\n[[runs]]\nscene = 'mine.xml'\nset.anything = 1\nk = 4\n")
        self.assertEqual(missing, {"moon": "this build has no such scene", "ap/path": "not installed"})
        self.assertEqual([(r.scene, r.file, r.method) for r in runs],
                         [("mine", f"{self.top.resolve()}/mine.xml", m) for m in ("ap", "convex")])
        # What is left out on purpose is not missing.
        self.assertEqual(self.plan("outside = ['path']\n[[runs]]\nscene = 'stack'\n")[1], {})

    def test_repeats_of_all_come_after_one_another(self):
        runs = self.runs("methods = ['convex']\n[[runs]]\nscene = 'stack'\nrepeats = 2\n[[runs]]\nscene = 'slide'\nrepeats = 3\n")
        self.assertEqual([(r.scene, r.repeat) for r in runs], [("stack", 1), ("slide", 1), ("stack", 2), ("slide", 2),
                                                               ("slide", 3)])


if __name__ == "__main__":
    unittest.main()
