"""scripts/sweep.py --engine slurm on stand-ins for Slurm and the program: the same table as on one machine, whatever becomes of
tasks; and what slurm.py makes of each thing that Slurm says. With a Slurm that is one: test/acceptance/other_machines.py."""
import collections
import contextlib
import csv
import io
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest
from pathlib import Path
from unittest import mock

import standin
import standin_slurm
from contactbench import program, slurm
from contactbench.gather import TIMING

ROOT = Path(__file__).resolve().parents[2]

CELLS = """
outside = ["pgs"]
timed = false
time_limit_s = 60
memory_limit_mb = 200
[[runs]]
scene = "sliding_box"
memory_limit_mb = 150
k = [4, 8]
epsilon = ["1e-2", "1e-12"]
[[runs]]
scene = "stack"
set.boxes = [1, 2]
methods = ["ap"]
k = [4, 8]
"""
COUNT = 11
ONE = 'timed = false\n[[runs]]\nscene = "sliding_box"\nmethods = ["mirtich"]\n'


class Slurm(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)
        self.program, self.sweep = standin.write(self.top / "program"), self.top / "small.toml"
        self.sweep.write_text(CELLS)
        self.slurm = standin_slurm.write(self.top / "slurm")

    def fates(self, *fates):
        (self.slurm / "FATES").write_text(json.dumps(fates))

    def command(self, *words, out="out", engine="slurm"):
        return [sys.executable, str(ROOT / "scripts/sweep.py"), str(self.sweep), "--program", str(self.program), "--runs",
                str(self.top / out / "runs"), "--out", str(self.top / out), "--engine", engine, *words]

    def environment(self, slow=0.0, **fakes):
        return standin.environment(FAKE=json.dumps(fakes), LOG=str(self.top / "log"), SLOW=str(slow),
                                   PATH=f"{self.slurm}:{os.environ['PATH']}")

    def run_sweep(self, *words, out="out", engine="slurm", code=0, slow=0.0, **fakes):
        ended = subprocess.run(self.command(*words, out=out, engine=engine), capture_output=True, text=True, timeout=300,
                               env=self.environment(slow, **fakes))
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return ended.stdout + ended.stderr

    def table(self, out="out"):
        with open(self.top / out / "runs.csv", newline="") as file:
            return [{c: v for c, v in row.items() if c not in TIMING} for row in csv.DictReader(file)]

    def starts(self):
        return (self.top / "log").read_text().splitlines() if (self.top / "log").exists() else []

    def submitted(self):
        return (self.slurm / "sbatch.log").read_text().splitlines()

    def no_debris(self, out="out"):
        hidden = {path.name for path in (self.top / out / "runs").iterdir() if path.name.startswith(".")}
        self.assertEqual(hidden, {".lock"})

    def wait_for(self, so):
        deadline = time.monotonic() + 60
        while not so() and time.monotonic() < deadline:
            time.sleep(0.02)
        self.assertTrue(so())

    def test_the_table_is_that_of_one_machine_and_no_array_is_larger_than_slurm_takes(self):
        self.run_sweep(out="here", engine="local", stack="crash")
        self.run_sweep("--chunk", "1", "--jobs", "2", "--slurm", "--partition=short --comment='two words'", out="there", stack="crash")
        self.assertEqual(self.table("here"), self.table("there"))
        self.assertEqual(len(self.table("there")), COUNT)
        (said, ) = self.submitted()
        self.assertIn("--array=0-3%2 ", said)
        self.assertIn("--mem=456M", said)
        self.assertIn("--partition=short --comment=two words", said)
        self.no_debris("there")

    def test_tasks_that_are_lost_in_any_way_cost_no_run(self):
        self.run_sweep(out="calm", engine="local")
        (self.top / "log").unlink()
        self.fates("NODE_FAIL", "forgotten", "held", "TIMEOUT")
        said = self.run_sweep("--chunk", "3", slow=0.2)
        for end in ("NODE_FAIL", "CANCELLED", "LAUNCH_FAILED", "TIMEOUT"):
            self.assertIn(f"is lost ({end})", said)
        self.assertEqual(self.table(), self.table("calm"))
        # A task loses the run that it is at.
        self.assertLessEqual(len(self.starts()), COUNT + 3)
        self.no_debris()

    def test_a_run_at_which_three_tasks_were_lost_is_a_row_with_what_ended_them(self):
        self.sweep.write_text(ONE)
        for end, status in (("TIMEOUT", "time_limit"), ("OUT_OF_MEMORY", "memory_limit"), ("NODE_FAIL", "interrupted")):
            self.fates(end, end, end)
            self.run_sweep("--rerun", "all", slow=30)
            (row, ) = self.table()
            self.assertEqual((row["status"], row["reason"]), (status, f"3 tasks of Slurm were lost at it; the last: {end}"))
        # What says nothing of the run is done again by itself.
        self.run_sweep()
        self.assertEqual([row["status"] for row in self.table()], ["ok"])

    def test_where_no_task_begins_its_runs_the_sweep_ends_with_what_they_wrote(self):
        self.fates(*["silent"] * 20)
        said = self.run_sweep(code=1)
        self.assertIn("3 tasks of Slurm one after another did not begin their runs; the last: FAILED, and wrote: no such python here", said)
        self.no_debris()

    def test_two_tasks_that_do_the_same_runs_at_the_same_time_make_one_row_of_each(self):
        self.run_sweep(out="calm", engine="local")
        self.fates("twice", "twice", "twice")
        self.run_sweep("--chunk", "4", slow=0.05)
        self.assertEqual(self.table(), self.table("calm"))

    def test_a_killed_sweep_leaves_its_jobs_and_the_same_command_goes_on_with_them(self):
        sweep = subprocess.Popen(self.command("--chunk", "3"), env=self.environment(0.3), stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        self.wait_for(lambda: len(self.starts()) > 2)
        sweep.kill()
        sweep.wait()
        self.assertIn("runs are with Slurm already", self.run_sweep("--chunk", "3", slow=0.3))
        self.assertEqual(collections.Counter(row["status"] for row in self.table()), {"ok": COUNT})
        self.assertEqual((len(self.submitted()), len(self.starts())), (1, COUNT))
        self.no_debris()

    def test_jobs_that_do_what_is_no_longer_wanted_are_cancelled(self):
        self.run_sweep("--submit-only", "--chunk", "3", slow=0.5)
        self.sweep.write_text(CELLS.replace("time_limit_s = 60", "time_limit_s = 61"))
        said = self.run_sweep("--chunk", "3")
        self.assertNotIn("with Slurm already", said)
        self.assertEqual(collections.Counter(row["status"] for row in self.table()), {"ok": COUNT})
        self.no_debris()

    def test_an_interrupted_sweep_cancels_its_jobs(self):
        sweep = subprocess.Popen(self.command(), env=self.environment(20), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.wait_for(lambda: len(self.starts()) > 0)
        sweep.send_signal(signal.SIGINT)
        said, _ = sweep.communicate(timeout=30)
        self.assertEqual(sweep.returncode, 130)
        self.assertIn("cancels its jobs of Slurm", said)
        self.assertEqual({task.read_text() for task in self.slurm.glob("contactbench-*")}, {"CANCELLED|None"})
        self.no_debris()

    def test_runs_that_were_only_submitted_are_gathered_later(self):
        self.assertIn("the same command without --submit-only waits", self.run_sweep("--submit-only"))
        self.assertFalse((self.top / "out/runs.csv").exists())
        self.wait_for(lambda: len(self.starts()) == COUNT)
        self.run_sweep()
        self.assertEqual(len(self.table()), COUNT)
        self.assertEqual((len(self.submitted()), len(self.starts())), (1, COUNT))
        self.no_debris()

    def test_without_slurm_it_says_what_to_install(self):
        empty = self.top / "empty"
        empty.mkdir()
        ended = subprocess.run(self.command(), capture_output=True, text=True, timeout=60, env={**self.environment(), "PATH": str(empty)})
        self.assertEqual((ended.returncode, ended.stdout), (2, ""))
        self.assertEqual(len(ended.stderr.splitlines()), 1)
        self.assertIn("apt install slurm-client", ended.stderr)

    def test_what_sbatch_refuses_is_said_and_leaves_nothing(self):
        said = self.run_sweep("--slurm=--partition=nowhere", code=1)
        self.assertIn("sbatch takes no job: sbatch: error: invalid partition specified: nowhere. Options of sbatch go into --slurm", said)
        self.no_debris()

    def test_flags_of_slurm_are_of_no_other_engine(self):
        for words in (["--chunk", "3"], ["--slurm=--time=1"], ["--submit-only"]):
            self.assertIn("are of --engine slurm", self.run_sweep(*words, engine="local", code=2))
        self.assertIn("--slurm: No closing quotation", self.run_sweep("--slurm='", code=2))


class Revoked(unittest.TestCase):
    def test_a_run_of_a_revoked_submission_is_not_published_though_the_program_made_its_folder_anew(self):
        with tempfile.TemporaryDirectory() as folder:
            submission, place = Path(folder) / "submission", Path(folder) / "run"
            submission.mkdir()
            scratch = program.begin(submission / program.DOING, "run")
            program.clear(submission)
            scratch.mkdir(parents=True)  # as the program does with --out
            (scratch / "summary.json").write_text("{}")
            with self.assertRaises(FileNotFoundError):
                program.publish({}, scratch, place)
            self.assertFalse(place.exists())

    def test_a_revoked_submission_does_not_come_back_by_a_task_that_begins_a_run(self):
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaises(FileNotFoundError):
                program.begin(Path(folder) / "submission" / program.DOING, "run")
            self.assertEqual(list(Path(folder).iterdir()), [])

    def test_a_task_that_is_over_may_still_write(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "1.json").write_text(json.dumps({"jobs": [{"asked": {"run": "a"}}], "seconds": None}))
            submission = slurm.Submission(Path(folder))
            submission.chunks.pop(1)
            line = {"run": "a", "record": {"status": "ok"}, "took_s": 1.0}
            (Path(folder) / "1.late.log").write_text(json.dumps(line) + "\n")
            self.assertEqual(list(submission.look()), [line])


class Publish(unittest.TestCase):
    def test_writers_of_the_same_run_at_the_same_time_leave_one_whole_run(self):
        with tempfile.TemporaryDirectory() as folder:
            doing, place, faults = Path(folder) / "doing", Path(folder) / "run", []

            def write(writer):
                try:
                    for n in range(100):
                        scratch = program.begin(doing, str(writer))
                        (scratch / "summary.json").write_text(f"{writer} {n}")
                        program.publish({"by": f"{writer} {n}"}, scratch, place)
                except OSError as error:
                    faults.append(error)

            writers = [threading.Thread(target=write, args=(n, )) for n in range(4)]
            for writer in writers:
                writer.start()
            for writer in writers:
                writer.join()
            self.assertEqual(faults, [])
            self.assertEqual(json.loads((place / "run.json").read_text())["by"], (place / "summary.json").read_text())
            self.assertEqual(list(doing.iterdir()), [])


class Tasks(unittest.TestCase):
    """What Slurm says of tasks (slurm.py)."""
    def ask(self, text, names=("contactbench-a", "contactbench-b"), code=0):
        submissions = [types.SimpleNamespace(name=name, states={"old": 1}) for name in names]
        ended = types.SimpleNamespace(returncode=code, stdout=text, stderr="down\n")
        with mock.patch.object(slurm, "slurm", lambda *_: ended):
            return slurm.ask(submissions), [s.states for s in submissions]

    def test_a_line_of_the_queue_is_about_one_task_or_several(self):
        self.assertEqual([list(slurm.indices(word)) for word in ("7", "3-5,9%2", "0,2-3", "N/A", "")],
                         [[7], [3, 4, 5, 9], [0, 2, 3], [], []])

    def test_tasks_are_counted_by_how_they_stand(self):
        (answers, words), states = self.ask(
            "contactbench-a|0|RUNNING|None\ncontactbench-a|1-3%2|PENDING|Resources\n "
            "contactbench-b|4|PENDING|launch failed requeued held \n"
            "contactbench-b|5|COMPLETED|None\ncontactbench-b|6|COMPLETING|None\nanother|0|RUNNING|None\n")
        self.assertEqual((answers, words), (True, "2 at work, 3 wait (Resources)"))
        self.assertEqual(
            states,
            [{0: "RUNNING", 1: "PENDING", 2: "PENDING", 3: "PENDING"}, {4: "LAUNCH_FAILED", 5: "COMPLETED", 6: "COMPLETING"}])

    def test_of_a_task_that_was_begun_again_the_one_that_is_not_over_counts(self):
        for text in ("contactbench-a|0|NODE_FAIL|x\ncontactbench-a|0|RUNNING|x\n",
                     "contactbench-a|0|RUNNING|x\ncontactbench-a|0|NODE_FAIL|x\n"):
            self.assertEqual(self.ask(text)[1][0], {0: "RUNNING"})

    def test_where_it_does_not_answer_nothing_changes(self):
        (answers, words), states = self.ask("contactbench-a|0|RUNNING|None\n", code=1)
        self.assertEqual((answers, words, states), (False, "down", [{"old": 1}] * 2))

    def test_how_a_task_ended_is_what_slurm_remembers_or_its_accounting(self):
        submission = types.SimpleNamespace(name="n", states={3: "TIMEOUT"})
        accounting = types.SimpleNamespace(returncode=0, stdout="7_[1-2]|COMPLETED\n7_4|CANCELLED by 1000\n7_5|FAILED\n",
                                           stderr="")
        for there, number, end in ((True, 3, "TIMEOUT"), (True, 4, "CANCELLED"), (True, 2, "COMPLETED"),
                                   (True, 9, "unknown to Slurm"), (False, 4, "unknown to Slurm")):
            with mock.patch.object(slurm, "slurm", lambda *_: accounting), mock.patch.object(
                    slurm.shutil, "which", lambda _: there):
                self.assertEqual(slurm.end_of(submission, number), end)

    def test_a_task_is_over_where_slurm_says_so_twice_or_nothing_is_left_of_it(self):
        with tempfile.TemporaryDirectory() as folder:
            for n in range(4):
                (Path(folder) / f"{n}.json").write_text(json.dumps({"jobs": [{"asked": {"run": f"r{n}"}}]}))
            (Path(folder) / "9.json").write_text("{")  # never submitted
            submission = slurm.Submission(Path(folder))
        self.assertEqual(set(submission.chunks), {0, 1, 2, 3})
        submission.states = {0: "RUNNING", 1: "FAILED", 2: "PENDING"}
        submission.chunks[0].clear()
        self.assertEqual(submission.over(), {0})
        submission.states[1] = "RUNNING"  # requeued
        self.assertEqual(submission.over(), {0, 3})
        submission.states[1] = "FAILED"
        self.assertEqual(submission.over(), {0, 3})
        self.assertEqual(submission.over(), {0, 1, 3})

    def test_chunks_are_every_nth_run_and_take_two_minutes_at_the_pace_of_those_that_were_heard(self):
        def submit(count, took=(0, 0.0), at_a_time=0, chunk=None, only=False, largest=1000):
            with tempfile.TemporaryDirectory() as folder, mock.patch.object(slurm, "largest_array", lambda: largest), \
                    contextlib.redirect_stdout(io.StringIO()) as said:
                options = types.SimpleNamespace(runs=Path(folder), chunk=chunk, submit_only=only, slurm="--time=5 --x='a b'")
                jobs = [{"asked": {"run": f"r{n}"}, "memory_limit_mb": 100.5 + n} for n in range(count)]
                work = slurm.Work(options, None, jobs, at_a_time, None)
                work.took = list(took)
                asked = []
                answer = types.SimpleNamespace(returncode=0, stdout="77\n", stderr="")
                with mock.patch.object(slurm, "slurm", lambda *words: asked.append([str(w) for w in words]) or answer):
                    work.submit(jobs)
                place, = (Path(folder).resolve() / ".slurm").iterdir()
                chunks = {int(file.stem): json.loads(file.read_text()) for file in place.glob("*.json")}
            return [[job["asked"]["run"] for job in chunks[n]["jobs"]]
                    for n in sorted(chunks)], chunks[0]["seconds"], asked[0], said.getvalue(), place

        runs, seconds, words, said, place = submit(5, chunk=2)
        self.assertEqual((runs, seconds), ([["r0", "r3"], ["r1", "r4"], ["r2"]], None))
        self.assertEqual(words, [
            "sbatch", "--parsable", f"--job-name={place.name}", "--array=0-2", f"--output={place}/%a.out", "--open-mode=append",
            "--ntasks=1", "--cpus-per-task=1", "--mem=361M", "--requeue", "--time=5", "--x=a b", f"{place}/task.sh"])
        self.assertEqual(said, f"5 runs to Slurm: 3 tasks of up to 2 (job 77, {place.name})\n")
        # 2 s a run: sixty a task; two at a time: no more than half of them. Tasks that somebody waits for end after ten minutes.
        runs, seconds, words, *_ = submit(90, (4, 8.0))
        self.assertEqual(([len(r) for r in runs], seconds, words[3]), ([45, 45], 600, "--array=0-1"))
        runs, _, words, *_ = submit(90, (4, 8.0), 3)
        self.assertEqual(([len(r) for r in runs], words[3]), ([30] * 3, "--array=0-2%3"))
        self.assertEqual(submit(90, at_a_time=2, chunk=30)[2][3], "--array=0-2%2")
        self.assertEqual([len(r) for r in submit(3, (1, 500.0))[0]], [1, 1, 1])
        self.assertEqual([len(r) for r in submit(240)[0]], [120, 120])  # a second each, where nothing is known
        self.assertIsNone(submit(2, only=True)[1])
        runs, *_, said, _ = submit(7, chunk=1, largest=3)
        self.assertEqual([len(r) for r in runs], [3, 2, 2])
        self.assertIn("an array of this Slurm has up to 3 tasks", said)

    def judged(self, end, begun=0, silent=0, heard=True, left=("a", "b")):
        """What becomes of the runs that a task left which ended so: rows, what is said, what still waits."""
        done, closed = [], []
        todo = [{"asked": {"run": run}} for run in "abc"]
        work = slurm.Work(types.SimpleNamespace(runs=Path("/r")), None, todo, 1, done.append)
        work.begun["a"], work.silent["a"] = begun, silent
        submission = types.SimpleNamespace(name="n", chunks={4: dict.fromkeys(left)}, states={4: end}, said=lambda: "no python",
                                           read={Path("4.x.log"): 9 if heard else 0}, over=lambda: {4},
                                           close=lambda: closed.append(1))
        work.submissions = [submission]
        with mock.patch.object(program, "do", lambda job, load, ended: (job["asked"]["run"], ended["status"], ended["reason"])), \
                contextlib.redirect_stdout(io.StringIO()) as said:
            work.judge(submission)
        self.assertEqual((work.submissions, closed), ([], [1]))
        return done, said.getvalue(), list(work.waiting)

    def test_what_a_task_left_is_done_once_more_and_what_three_were_lost_at_is_a_row(self):
        lost = "task 4 of n is lost (NODE_FAIL): 2 runs once more\n"
        self.assertEqual(self.judged("NODE_FAIL", 2), ([], lost, ["a", "b", "c"]))
        for end, status in (("NODE_FAIL", "interrupted"), ("TIMEOUT", "time_limit"), ("DEADLINE", "time_limit"),
                            ("OUT_OF_MEMORY", "memory_limit")):
            done, _, waiting = self.judged(end, 3)
            self.assertEqual(done, [("a", status, f"3 tasks of Slurm were lost at it; the last: {end}")])
            self.assertEqual(waiting, ["b", "c"])
        # One whose time was over ended as it should, and one that left nothing is not said.
        self.assertEqual(self.judged("COMPLETED"), ([], "", ["a", "b", "c"]))
        self.assertEqual(self.judged("FAILED", left=()), ([], "", ["a", "b", "c"]))

    def test_three_tasks_that_did_not_begin_end_the_sweep(self):
        self.judged("FAILED", silent=1, heard=False)
        self.judged("FAILED", silent=2)
        with self.assertRaisesRegex(program.ProgramError, "3 tasks of Slurm one after another did not begin their runs; "
                                    "the last: FAILED, and wrote: no python"):
            self.judged("FAILED", silent=2, heard=False)

    def test_what_is_heard_of_a_run_counts_once_and_its_time_for_the_pace(self):
        done = []
        work = slurm.Work(types.SimpleNamespace(runs=Path("/r")), None, [{"asked": {"run": run}} for run in "ab"], 1, done.append)
        lines = [{"run": "a"}, {"run": "a", "record": 1, "took_s": 2.5}, {"run": "b"}, {"run": "a", "record": 2, "took_s": 4.0}]
        work.hear(types.SimpleNamespace(look=lambda: lines))
        self.assertEqual((done, work.took, dict(work.begun), list(work.waiting)), ([1], [2, 6.5], {"a": 1, "b": 1}, ["b"]))

    def test_while_slurm_does_not_answer_no_task_counts_as_lost(self):
        done, given, answers = [], [], iter([(False, "down")] * 3 + [(True, "")])
        with tempfile.TemporaryDirectory() as folder:
            options = types.SimpleNamespace(runs=Path(folder), submit_only=False)
            work = slurm.Work(options, None, [{"asked": {"run": "a"}}], 1, done.append)

            def submit(jobs):
                given.append([job["asked"]["run"] for job in jobs])
                place = work.folder / f"contactbench-{len(given)}"
                place.mkdir(parents=True)
                (place / "0.json").write_text(json.dumps({"jobs": jobs, "seconds": None}))
                work.submissions.append(slurm.Submission(place))

            def ask(submissions):
                answer = next(answers)
                if answer[0]:
                    line = {"run": "a", "record": {"status": "ok"}, "took_s": 1.0}
                    (submissions[-1].folder / "0.x.log").write_text(json.dumps(line) + "\n")
                return answer

            with mock.patch.object(work, "submit", submit), mock.patch.object(slurm, "ask", ask), \
                    mock.patch.object(slurm.time, "sleep"), mock.patch.object(slurm.shutil, "which", lambda _: None), \
                    contextlib.redirect_stdout(io.StringIO()) as said:
                work.do()
        self.assertEqual((given, done), ([["a"]], [{"status": "ok"}]))
        self.assertEqual(said.getvalue(), "Slurm: does not answer (down); waiting for it\n")

    def test_what_tasks_of_an_earlier_command_did_and_were_lost_at_is_known(self):
        def ask(submissions):
            submissions[0].states = {0: "RUNNING"}
            return True, "1 at work"

        done, jobs = [], [{"asked": {"run": run}} for run in "abc"]
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder).resolve() / ".slurm/contactbench-1"
            place.mkdir(parents=True)
            (place / "0.json").write_text(json.dumps({"jobs": jobs, "seconds": None}))
            for log, lines in (("0.x", [{"run": "b"}, {"run": "b", "record": 1}, {"run": "c", "record": 2}, {"run": "a"}]),
                               ("0.y", [{"run": "a"}])):
                (place / f"{log}.log").write_text("".join(json.dumps(line) + "\n" for line in lines))
            # The folder of c is there no more.
            work = slurm.Work(types.SimpleNamespace(runs=Path(folder)), lambda job: job["asked"]["run"] == "b", jobs, 1, done.append)
            with mock.patch.object(slurm, "ask", ask), contextlib.redirect_stdout(io.StringIO()) as said:
                work.adopt()
            self.assertEqual((done, list(work.waiting), work.begun["a"], work.under_way()), ([1], ["a", "c"], 2, {"a"}))
        self.assertEqual(said.getvalue(), "1 runs are with Slurm already (contactbench-1: 1 at work)\n")

    def test_how_tasks_stand_is_said_where_it_changed_and_once_a_minute(self):
        work, now = slurm.Work(types.SimpleNamespace(runs=Path("/r")), None, [], 1, None), iter((0.0, 0.0, 59.0, 61.0, 61.0))
        with mock.patch.object(slurm.time, "monotonic", lambda: next(now)), contextlib.redirect_stdout(io.StringIO()) as said:
            for words in ("1 at work", "1 at work", "2 at work", "", "3 at work"):
                work.say(words)
        self.assertEqual(said.getvalue(), "Slurm: 1 at work\nSlurm: 3 at work\n")

    def test_tasks_that_wait_are_taken_from_slurm_and_of_what_is_not_through_all(self):
        for states, ended, words in (({0: "COMPLETED"}, True, []), ({0: "RUNNING", 1: "PENDING"}, True, ["--state=PENDING"]),
                                     ({0: "LAUNCH_FAILED"}, True, ["--state=PENDING"]), ({0: "COMPLETED"}, False, [])):
            with tempfile.TemporaryDirectory() as folder:
                place = Path(folder) / "contactbench-1"
                place.mkdir()
                submission, asked = slurm.Submission(place), []
                submission.states = states
                answer = types.SimpleNamespace(returncode=1, stdout="", stderr="x\nnot yours\n")
                with mock.patch.object(slurm, "slurm", lambda *said: asked.append(list(said)) or answer), \
                        contextlib.redirect_stderr(io.StringIO()) as said:
                    submission.close(ended)
                self.assertFalse(place.exists())
            called = [["scancel", "--quiet", "--name=contactbench-1", *words]] if words or not ended else []
            self.assertEqual(asked, called)
            refused = "scancel --name=contactbench-1 does not work (not yours); its tasks end by themselves\n"
            self.assertEqual(said.getvalue(), refused if called else "")

    def test_what_is_said_of_a_task_is_the_last_line_of_the_first_that_wrote_one(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in (("1.out", " \n"), ("2.out", "a banner\nthe error\n\n"), ("3.out", "another\n"), ("4.log", "none\n")):
                (Path(folder) / name).write_text(text)
            self.assertEqual(slurm.Submission(Path(folder)).said(), "the error")
            (Path(folder) / "1.out").write_text("begin\n" + "x" * 400)
            self.assertEqual(slurm.Submission(Path(folder)).said(), "x" * 300)
        self.assertEqual(slurm.Submission(Path(folder)).said(), "")

    def test_the_largest_array_is_asked_of_slurm(self):
        for stdout, found in (("A = 1\nMaxArraySize            = 1001\nB = 2\n", 1001), ("MaxArraySize = 0\n", 1)):
            with mock.patch.object(slurm, "slurm", lambda *_: types.SimpleNamespace(stdout=stdout, stderr="")):
                self.assertEqual(slurm.largest_array(), found)
        with mock.patch.object(slurm, "slurm", lambda *_: None), self.assertRaisesRegex(program.ProgramError, "no answer"):
            slurm.largest_array()


if __name__ == "__main__":
    unittest.main()
