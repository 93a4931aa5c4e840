"""scripts/contactbench/sweep.py: its flags, what is done and what is done again, in which order, and what it says.
Without runs; with runs: test_sweep.py."""
import contextlib
import dataclasses
import io
import json
import os
import time
import types
import unittest
from pathlib import Path
from unittest import mock

from contactbench import plan, program, references, sweep
from folder import Folder

RUN = plan.Run("stack", (("boxes", "4"), ), "ap", "", "lemke", (("k", "8"), ), 1)
LISTED = {"scenarios": [{"name": "stack.xml", "file": "/s/stack.xml", "parameters": {}}],
          "statuses": [{"name": "ok"}, {"name": "ray"}]}


class Flags(unittest.TestCase):
    def arguments(self, *words):
        return sweep.arguments(["a.toml", *words])

    def refused(self, *words):
        with contextlib.redirect_stderr(io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
            self.arguments(*words)
        self.assertEqual(ended.exception.code, 2)
        return said.getvalue()

    def test_places_follow_from_the_profile_and_from_the_folder_of_the_table(self):
        usual = self.arguments()
        results = program.ROOT / "results"
        self.assertEqual((usual.sweeps, usual.out, usual.references, usual.runs),
                         ([Path("a.toml")], results, results / "references", results / "runs/default"))
        self.assertEqual((usual.jobs, usual.deadline, usual.rerun, usual.engine, usual.keep, usual.timed_alone),
                         (1, None, [], "local", False, False))
        self.assertEqual(self.arguments("--profile", "paper").runs, results / "runs/paper")
        given = self.arguments("--out", "o", "b.toml", "--runs", "r", "--rerun", "ray", "--rerun", "crash")
        self.assertEqual((given.sweeps, given.references, given.runs, given.rerun),
                         ([Path("a.toml"), Path("b.toml")], Path("o/references"), Path("r"), ["ray", "crash"]))
        self.assertEqual(self.arguments("--references", "f").references, Path("f"))

    def test_no_jobs_are_one_a_core_and_with_slurm_as_many_as_it_lets(self):
        with mock.patch.object(os, "cpu_count", lambda: 6):
            self.assertEqual([self.arguments("--jobs", n).jobs for n in ("0", "3")], [6, 3])
            self.assertEqual(
                [self.arguments("--engine", "slurm", *words).jobs for words in ((), ("--jobs", "0"), ("--jobs", "2"))], [0, 0, 2])

    def test_a_budget_is_in_hours_from_now(self):
        self.assertAlmostEqual(self.arguments("--budget", "0.5").deadline - time.time(), 1800, delta=5)

    def test_what_makes_no_sense_is_refused(self):
        for words, said in ((["--jobs", "-1"], "--jobs must not be negative"), (["--chunk", "2"], "are of --engine slurm"), ([
                "--engine", "slurm", "--chunk", "0"], "--chunk must be at least 1"), ([
                    "--engine", "slurm", "--submit-only",
                    "--timed-alone"], "not with --submit-only"), (["--budget", "0"], "--budget must be a positive"), ([
                        "--budget", "nan"], "--budget must be a positive")):
            self.assertIn(said, self.refused(*words))
        for engine in ("fork", "local:x", "slurm:x"):
            with self.assertRaisesRegex(program.ProgramError, f"no engine '{engine}'; there are: local, dask, "):
                sweep.engine_of(types.SimpleNamespace(engine=engine))
        self.assertIs(sweep.engine_of(types.SimpleNamespace(engine="local")), sweep.local)


class Again(Folder):
    """Which finished runs are done again."""
    def setUp(self):
        super().setUp()
        self.program, self.scene = self.top / "program", self.top / "scene"
        for file in (self.program, self.scene):
            file.write_text(file.name)
        self.job = {
            "asked": {"run": "r", "parameters": ""}, "flags": ["--k", "8"], "program": str(self.program), "file": str(self.scene),
            "time_limit_s": 10, "memory_limit_mb": 100, "record_every": 0, "record_contacts": False, "timed": False}
        self.record = {
            "status": "ok", "flags": ["--k", "8"], "files": [str(self.scene)], "key": program.digest(self.program, self.scene),
            "limits": [10, 100], "record_every": 5, "timed": True}

    def is_done(self, record=None, job=None, keep=False, rerun=()):
        (self.top / "r").mkdir(exist_ok=True)
        (self.top / "r/run.json").write_text(json.dumps(self.record | (record or {})))
        return sweep.is_done(self.job | (job or {}), types.SimpleNamespace(runs=self.top, keep=keep, rerun=rerun))

    def test_a_run_of_the_same_program_scene_and_flags_is_done(self):
        self.assertTrue(self.is_done())
        for more in ({"status": "interrupted"}, {"status": "write_failed"}, {"flags": ["--k", "4"]}, {"key": "another"}):
            self.assertFalse(self.is_done(more), more)
        self.assertTrue(self.is_done({"key": "another"}, keep=True))
        self.assertFalse(self.is_done({"flags": ["--k", "4"]}, keep=True))
        (self.top / "r/run.json").write_text("{")
        self.assertFalse(sweep.is_done(self.job, types.SimpleNamespace(runs=self.top, keep=True, rerun=[])))

    def test_a_status_that_is_to_be_done_again_is(self):
        self.assertEqual([self.is_done({"status": s}, rerun=["ray", "crash"]) for s in ("ok", "ray", "crash")],
                         [True, False, False])
        self.assertFalse(self.is_done(rerun=["all"], keep=True))

    def test_another_limit_matters_to_what_a_limit_cut(self):
        for status in ("time_limit", "memory_limit"):
            self.assertTrue(self.is_done({"status": status}))
            self.assertFalse(self.is_done({"status": status}, {"time_limit_s": 11}))
            self.assertFalse(self.is_done({"status": status}, {"memory_limit_mb": 99}))
        self.assertTrue(self.is_done(job={"time_limit_s": 11, "memory_limit_mb": 99}))

    def test_contacts_times_and_steps_are_wanted_where_there_are_none(self):
        self.assertFalse(self.is_done(job={"record_contacts": True}))
        self.assertTrue(self.is_done({"record_contacts": True}, {"record_contacts": True}))
        self.assertFalse(self.is_done({"timed": False}, {"timed": True}))
        self.assertTrue(self.is_done({"timed": False}))
        self.assertEqual([self.is_done(job={"record_every": n}) for n in (0, 4, 5, 6, 10)], [True, False, True, False, True])
        self.assertFalse(self.is_done({"record_every": 0}, {"record_every": 9}))

    def test_where_a_file_of_the_scene_is_gone_the_program_is_asked_for_them(self):
        other = self.top / "other"
        other.write_text("more")
        key = program.digest(self.program, other)
        with mock.patch.object(program, "files_of", return_value=(str(other), )) as asked:
            self.assertTrue(self.is_done())
            asked.assert_not_called()
            for files in ([str(self.scene), "/nowhere"], [], None):
                self.assertTrue(self.is_done({"files": files, "key": key}), files)
                self.assertFalse(self.is_done({"files": files}), files)
        self.assertEqual(asked.call_args.args, (str(self.program), str(self.scene), ""))
        with mock.patch.object(program, "files_of", return_value=("/nowhere", )):
            self.assertFalse(self.is_done({"files": []}))

    def test_a_run_of_an_engine_is_done_again_where_its_program_or_the_knobs_that_were_searched_for_are_others(self):
        engine, tuned = self.top / "contactbench-engine-ode", self.top / "tuned.json"
        job = {"asked": {"run": "r", "parameters": "", "engine": "ode"}, "flags": ["--engine", "ode", "--setting", "tuned"], "wall_limit_s": 1}
        made = lambda: {"flags": job["flags"], **program.read_by(self.job | job)}
        with mock.patch.object(program, "TUNED", tuned), mock.patch.object(program, "files_of", return_value=(str(self.scene), )), \
                mock.patch.dict(os.environ, {"CONTACTBENCH_ENGINES": ""}):
            for file, text in ((engine, "built"), (tuned, "found"), (tuned, "found again"), (engine, "built once more")):
                before = made()
                self.assertTrue(self.is_done(before, job))
                file.write_text(text)
                self.assertFalse(self.is_done(before, job), text)
                self.assertTrue(self.is_done(made(), job))
            # What is no run of it does not read it.
            self.assertEqual(program.read_by(self.job | {"wall_limit_s": 1})["files"], [str(self.scene)])
            plain = job | {"flags": ["--engine", "ode"]}
            self.assertEqual(program.read_by(self.job | plain)["files"], [str(self.scene), str(engine.resolve())])

    def test_an_engine_s_program_is_looked_for_where_contactbench_looks_for_it(self):
        top, name = self.top.resolve(), "contactbench-engine-ode"
        places = [top / "own", top / "bin", top / "libexec/contactbench"]
        for place in places:
            place.mkdir(parents=True)
            (place / name).touch()
        job = {"asked": {"engine": "ode"}, "program": str(top / "bin/contactbench"), "flags": []}
        with mock.patch.dict(os.environ, {"CONTACTBENCH_ENGINES": str(places[0])}):
            for place in places:  # the first that has it
                self.assertEqual(program.beside(job), (str(place / name), ))
                (place / name).unlink()
            self.assertEqual(program.beside(job), ())


class Order(Folder):
    def options(self, **more):
        return types.SimpleNamespace(
            **{
                "program": "/p/contactbench", "runs": self.top, "deadline": 1e9, "references": self.top, "timed_alone": False,
                "jobs": 3, "engine": "local", "keep": False, "rerun": []} | more)

    def test_a_job_is_its_run_with_the_program_and_the_deadline_of_the_sweep(self):
        runs = [
            dataclasses.replace(RUN, record_every=3, timed=False, time_limit_s=20, memory_limit_mb=300, record_contacts=True),
            dataclasses.replace(RUN, scene="mine", file="/m/mine.xml")]
        first, second = sweep.jobs_of(runs, LISTED, self.options())
        self.assertEqual(
            first, {
                "asked": runs[0].asked(), "flags": runs[0].flags(), "program": "/p/contactbench", "scene": "stack.xml",
                "file": "/s/stack.xml", "runs": str(self.top.resolve()), "statuses": [
                    "ok", "ray"], "timed": False, "time_limit_s": 20, "wall_limit_s": 34.0, "memory_limit_mb": 300,
                "record_every": 3, "deadline": 1e9, "record_contacts": True})
        self.assertEqual((second["scene"], second["file"]), ("/m/mine.xml", "/m/mine.xml"))

    def test_runs_whose_times_count_go_alone_and_last_where_that_is_asked(self):
        todo = [(dataclasses.replace(RUN, timed=n % 2 == 0), n) for n in range(5)]
        for more, calls in (({}, [([0, 1, 2, 3, 4], 3)]), ({"timed_alone": True}, [([1, 3], 3), ([0, 2, 4], 1)])):
            went = []
            sweep.do_all(todo, lambda some, count, done: went.append((some, count)), self.options(**more))
            self.assertEqual(went, calls)
        # Where nothing is to do Slurm may still hold jobs.
        for engine, calls in (("local", []), ("slurm", [([], 3), ([], 1)])):
            went = []
            sweep.do_all([], lambda some, count, done: went.append((some, count)), self.options(engine=engine))
            self.assertEqual(went, calls)

    def test_timed_runs_go_alone_to_any_number_of_dask_s_workers(self):
        went, ranks = [], []

        def submit(client, job, priority):
            went.append(f"begin {job['n']}")
            ranks.append(priority)
            return types.SimpleNamespace(n=job["n"], release=lambda: None)

        def as_completed(futures, **_):
            for future in futures:
                went.append(f"end {future.n}")
                yield future, types.SimpleNamespace(returncode=0, stdout="{}", stderr="")

        client = mock.MagicMock()
        fake = types.SimpleNamespace(Client=lambda *_, **__: client, LocalCluster=None, as_completed=as_completed)
        in_turn, at_once = ["begin 0", "end 0", "begin 1", "end 1"], ["begin 0", "begin 1", "end 0", "end 1"]
        for timed, alone, order in ((True, True, in_turn), (True, False, at_once), (False, True, at_once)):
            went.clear()
            engine = sweep.engine_of(types.SimpleNamespace(engine="dask:tcp://head:8786", timed_alone=alone))
            with mock.patch.dict("sys.modules", {"distributed": fake}), mock.patch.object(program, "elsewhere", submit):
                engine([{"n": n, "timed": timed} for n in range(2)], 1, lambda record: None)
            self.assertEqual(went, order)
        self.assertGreater(*ranks[-2:])  # what is first in the sweep is first with Dask

    def test_a_run_that_a_worker_could_not_do_ends_the_sweep_with_its_last_words(self):
        ended = types.SimpleNamespace(returncode=1, stdout="", stderr="noise\n" * 200 + "OSError: no such folder\n")
        fake = types.SimpleNamespace(Client=lambda *_, **__: mock.MagicMock(), LocalCluster=None,
                                     as_completed=lambda futures, **_: [(future, ended) for future in futures])
        engine = sweep.engine_of(types.SimpleNamespace(engine="dask:tcp://head:8786", timed_alone=False))
        with mock.patch.dict("sys.modules", {"distributed": fake}), self.assertRaises(program.ProgramError) as refused:
            engine([{"timed": True}], 1, self.fail)
        self.assertRegex(str(refused.exception), r"^a worker could not do a run: [\s\S]*OSError: no such folder$")

    def test_what_is_to_do_is_said_with_its_command(self):
        runs = [RUN, dataclasses.replace(RUN, repeat=2), dataclasses.replace(RUN, method="convex", solver="ipm")]
        with mock.patch.object(sweep, "is_done",
                               lambda job, _: job["asked"]["repeat"] == 2), contextlib.redirect_stdout(io.StringIO()) as said:
            todo = sweep.to_do(runs, LISTED, self.options(), show=True)
        self.assertEqual([(run, job["asked"]["run"]) for run, job in todo], [(run, run.name) for run in (runs[0], runs[2])])
        self.assertEqual(said.getvalue().splitlines(), [
            "contactbench run stack.xml --method ap --solver lemke --k 8 --set boxes=4",
            "contactbench run stack.xml --method convex --solver ipm --k 8 --set boxes=4", "2 of 3 runs to do, 1 there already"])

    def test_a_certified_reference_is_known_by_scene_and_parameters(self):
        runs = [
            RUN,
            dataclasses.replace(RUN, repeat=2),
            dataclasses.replace(RUN, sets=()),
            dataclasses.replace(RUN, scene="mine", file="/m/mine.xml")]
        for name in ("stack__boxes-4", "mine__boxes-4"):
            (self.top / f"{name}.json").touch()
        asked = []

        def read(folder, scene, parameters, files):
            asked.append((folder, scene, parameters, files))
            return None if scene == "mine" else "a reference"

        with mock.patch.object(references, "read", read), mock.patch.object(program, "files_of", lambda path, file, parameters:
                                                                            (path, file)):
            self.assertEqual(sweep.certified(runs, LISTED, self.options()), {("stack", "boxes=4"): "a reference"})
        self.assertEqual(asked, [(self.top, "stack", "boxes=4", ("/p/contactbench", "/s/stack.xml")),
                                 (self.top, "mine", "boxes=4", ("/p/contactbench", "/m/mine.xml"))])

    def unsettled(self, *ends, members=3):
        """Which further members are asked for, where a run and its first member end so."""
        runs = [dataclasses.replace(RUN, members=members, sets=(("boxes", str(n)), )) for n in range(len(ends))]
        runs += [dataclasses.replace(run, repeat=2) for run in runs]
        said = {}
        for run, both in zip(runs, 2 * ends):
            for of, (status, error) in zip((run, run.as_member(1)), both):
                said[of.name] = {"status": status, "error_final_m": error}

        def rows_of(some, folder, known):
            rows = [said[run.name] for run in some if run.name in said and said[run.name]["status"]]
            return rows, []

        with mock.patch.object(sweep, "rows_of", rows_of):
            return [(dict(run.sets)["boxes"], run.member, run.timed) for run in sweep.unsettled(runs, self.options(), {})]

    def test_further_members_are_asked_where_the_first_came_to_something_else(self):
        ends = [(("ok", "0.5"), ("ok", "0.5")), (("ok", "0.5"), ("ok", "0.6")), (("ok", "0.5"), ("ray", "0.5")),
                (("time_limit", ""), ("ok", "")), (("ok", "0.5"), ("", "")), (("ok", "0.5"), ("ok", "0.5000000000001"))]
        self.assertEqual(self.unsettled(*ends), [("1", 2, False), ("2", 2, False), ("1", 3, False), ("2", 3, False)])
        self.assertEqual(self.unsettled(*ends, members=1), [])


class Saying(unittest.TestCase):
    def test_each_run_is_a_line_with_the_time_that_is_left(self):
        record = {"run": "r1", "status": "ray", "reason": "no way on", "wall_s": 1.26, "busy": True}
        with mock.patch.object(sweep.sys.stderr, "isatty", lambda: False, create=True), \
                mock.patch.object(sweep.time, "monotonic", side_effect=[100.0, 104.0, 110.0]), \
                contextlib.redirect_stdout(io.StringIO()) as said:
            progress = sweep.Progress(12)
            progress.done(record)
            progress.done(record | {"status": "ok", "reason": "", "busy": None})
            progress.close()
        self.assertEqual(said.getvalue().splitlines(),
                         ["[ 1/12, 44 s left] r1 ray (no way on), 1.3 s, machine busy", "[ 2/12, 50 s left] r1 ok, 1.3 s"])

    def test_on_a_terminal_a_bar_counts_every_run_and_what_did_not_end_ok_is_said(self):
        bar, record = mock.Mock(), {"run": "r1", "status": "ray", "reason": "no way on", "wall_s": 1.26, "busy": True}
        with mock.patch.object(sweep.sys.stderr, "isatty", lambda: True, create=True), \
                mock.patch.dict("sys.modules", {"tqdm": types.SimpleNamespace(tqdm=lambda **_: bar)}), \
                contextlib.redirect_stdout(io.StringIO()) as said:
            progress = sweep.Progress(2)
            progress.done(record)
            progress.done(record | {"status": "ok", "reason": ""})
            progress.close()
        wanted = [mock.call.write("r1 ray (no way on)"), mock.call.update(), mock.call.update(), mock.call.close()]
        self.assertEqual(bar.method_calls, wanted)
        self.assertEqual(said.getvalue(), "")


class Whole(Folder):
    """A sweep from its file to its table, where no run is done."""
    def sweep(self, *words, further=()):
        (self.top /
         "a.toml").write_text("methods = ['ap']\n[[runs]]\nscene = 'stack'\nmembers = 2\nrepeats = 2\nset.boxes = [1, 2]\n")
        listed = LISTED | {
            "methods": [{"name": "ap", "solvers": ["lemke", "lib"], "variants": [], "options": []}], "solvers": [{
                "method": "ap", "name": "lib", "unavailable": "not installed"}]}
        listed["scenarios"][0]["parameters"] = {"boxes": "16"}
        went, gathered = [], []
        options = sweep.arguments([str(self.top / "a.toml"), "--runs", str(self.top / "runs"), "--out", str(self.top), *words])
        with mock.patch.object(program, "listed", lambda _: listed), mock.patch.object(sweep, "is_done", lambda *_: False), \
                mock.patch.object(sweep, "do_all", lambda todo, *_: went.append([run.name for run, _ in todo])), \
                mock.patch.object(sweep, "unsettled", lambda *_: list(further)), \
                mock.patch.object(sweep, "gather", lambda *of: gathered.append(of)), \
                mock.patch.object(sweep.slurm, "engine", lambda *_: None), contextlib.redirect_stdout(io.StringIO()) as said:
            sweep.sweep(options)
        return went, gathered, said.getvalue()

    def test_runs_go_with_the_first_member_of_each_cell_and_the_others_where_that_does_not_settle_it(self):
        (self.top / "runs/stray__run").mkdir(parents=True)
        (self.top / "runs/.doing/half").mkdir(parents=True)
        for name in ("r1", "m1", "m3"):
            (self.top / f"runs/stack__boxes-2__ap__lemke__{name}").mkdir()
        more = dataclasses.replace(RUN, sets=(("boxes", "2"), ), knobs=(), member=2)
        third = dataclasses.replace(more, member=3)
        went, ((runs, members, missing, folder, out, sweeps, profile, known), ), said = self.sweep(further=[more, third])
        first = [f"stack__boxes-{n}__ap__lemke__r{repeat}" for repeat in (1, 2) for n in (1, 2)]
        of_first, of_others = ([f"stack__boxes-{n}__ap__lemke__m{m}" for n, m in some]
                               for some in (((1, 1), (2, 1)), ((2, 2), (2, 3))))
        self.assertEqual(went, [[*first, *of_first], of_others])
        self.assertEqual([run.name for run in runs], first)
        self.assertEqual([run.name for run in members],
                         [*of_first, *of_others])
        self.assertEqual((missing, folder, out, sweeps, profile, known),
                         ({"ap/lib": "not installed"}, self.top / "runs", self.top, ["a"], "", {}))
        self.assertIn("ap/lib is left out: not installed\n", said)
        self.assertIn("1 cells differ with the last bits of their start", said)
        self.assertIn("1 folders are of no run of these sweeps and stay out of the tables: stray__run\n", said)
        self.assertFalse((self.top / "runs/.doing").exists())

    def test_nothing_further_is_asked_where_all_is_settled_and_nothing_is_gathered_of_what_was_only_submitted(self):
        went, gathered, said = self.sweep()
        self.assertEqual((len(went), len(gathered)), (1, 1))
        self.assertNotIn("differ", said)
        self.assertNotIn("folders are of no run", said)
        went, gathered, _ = self.sweep("--engine", "slurm", "--submit-only")
        self.assertEqual((len(went), len(gathered)), (1, 0))

    def test_of_members_that_are_named_those_that_have_a_row_are_done_again(self):
        name = "stack__boxes-{}__ap__lemke__{}".format
        (self.top / "runs.csv").write_text("run\n" + "".join(name(n, "r1") + "\n" for n in (1, 2)))
        some = [name(*of) for of in ((1, "m1"), (2, "m1"), (2, "m2"))]
        (self.top / "ensemble.csv").write_text("run\n" + "".join(run + "\n" for run in some))
        (self.top / "manifest.json").write_text('{"profile": ""}')
        with mock.patch.object(sweep, "put_in_place") as put:
            went, gathered, _ = self.sweep("--only", "*__m[0-9]")
        self.assertEqual((went, gathered), ([some], []))
        self.assertEqual([[run.name for run in of] for of in put.call_args.args[:2]], [[], some])

    def test_a_program_that_is_not_there_is_said_with_the_flag_that_names_another(self):
        with self.assertRaisesRegex(program.ProgramError, "does not work: .*--program names another one"):
            sweep.sweep(sweep.arguments(["a.toml", "--program", "/nowhere/program"]))


if __name__ == "__main__":
    unittest.main()
