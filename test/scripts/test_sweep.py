"""scripts/sweep.py on a stand-in for the program: every end of a run is one typed row, and nothing interrupts a sweep for good."""
import collections
import concurrent.futures
import csv
import dataclasses
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import standin
from contactbench import plan, program
from contactbench.gather import TIMING

ROOT = Path(__file__).resolve().parents[2]

SMALL = """
outside = ["pgs"]
time_limit_s = 1
memory_limit_mb = 200

[profiles.tiny]
repeats = 1
[profiles.full]
repeats = 3

[[runs]]
scene = "sliding_box"
k = [4, 8]
epsilon = ["1e-2", "1e-12"]

[[runs]]
scene = "stack"
set.boxes = [1, 2]
methods = ["ap", "newton/uncapped"]
k = 4
step = ["1e-2", "1e-3"]
"""


class Merged(unittest.TestCase):
    def test_a_run_of_two_blocks_is_recorded_as_finely_and_limited_as_widely_as_either_asks(self):
        run = plan.Run("stack", (), "ap", "", "lemke", (), 1)
        for ours, theirs, both in ((10, 2, 2), (2, 10, 2), (0, 5, 5), (5, 0, 5), (0, 0, 0), (30, 100, 10)):
            a, b = (dataclasses.replace(run, record_every=n, time_limit_s=n + 1, memory_limit_mb=n + 1) for n in (ours, theirs))
            merged = plan.merge(a, b)
            self.assertEqual(merged.record_every, both)
            self.assertEqual((merged.time_limit_s, merged.memory_limit_mb), 2 * (max(ours, theirs) + 1, ))


class Sweep(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)
        self.program = standin.write(self.top / "program")
        self.sweep = self.top / "small.toml"
        self.sweep.write_text(SMALL)
        self.log = self.top / "log"

    def command(self, *words, out="out"):
        # The words of a test come last and win.
        return [sys.executable, str(ROOT / "scripts/sweep.py"), str(self.sweep), "--program", str(self.program),
                "--runs", str(self.top / out / "runs"), "--out", str(self.top / out), "--profile", "tiny", *words]

    def run_sweep(self, *words, out="out", code=0, **fakes):
        ended = subprocess.run(self.command(*words, out=out), capture_output=True, text=True, timeout=300,
                               env=standin.environment(FAKE=json.dumps(fakes), LOG=str(self.log)))
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return ended.stdout + ended.stderr

    def table(self, out="out"):
        with open(self.top / out / "runs.csv", newline="") as file:
            return list(csv.DictReader(file))

    def untimed(self, out="out"):
        return [{c: v for c, v in row.items() if c not in TIMING} for row in self.table(out)]

    def one(self, mode):
        """The row of one run that behaves like that, while the others do not."""
        self.sweep.write_text(SMALL.split("[[runs]]")[0] + '[[runs]]\nscene = "sliding_box"\nmethods = ["mirtich"]\n'
                              '[[runs]]\nscene = "stack"\nmethods = ["mirtich"]\n')
        self.run_sweep(sliding_box=mode)
        rows = self.table()
        self.assertEqual([r["scene"] for r in rows], ["sliding_box", "stack"])
        self.assertEqual(rows[1]["status"], "ok")
        return rows[0]

    def again(self, mode):
        self.program.write_text(self.program.read_text() + "# newer\n")
        return self.one(mode)

    def test_every_method_runs_with_its_own_knobs_and_without_solvers_that_are_not_there(self):
        said = self.run_sweep()
        self.assertIn("ap/path-lib is left out: not installed", said)
        rows = self.table()
        count = collections.Counter((r["scene"], r["method"]) for r in rows)
        self.assertEqual(count, {("sliding_box", "newton"): 2, ("sliding_box", "mirtich"): 1, ("sliding_box", "ap"): 2,
                                 ("sliding_box", "convex"): 2, ("stack", "newton"): 4, ("stack", "ap"): 4})
        self.assertEqual({r["solver"] for r in rows if r["method"] == "ap"}, {"lemke"})
        self.assertEqual([r["knobs"] for r in rows if r["scene"] == "stack" and r["parameters"] == "boxes=2"][:2],
                         ["step=1e-2", "step=1e-3"])
        self.assertEqual({r["sweeps"] for r in rows}, {"small"})

    def test_a_value_with_a_slash_is_a_run_of_its_own(self):
        self.sweep.write_text(SMALL.replace("set.boxes = [1, 2]", 'set.boxes = ["4/2", "2*2/1"]'))
        self.run_sweep()
        self.assertEqual({row["parameters"] for row in self.table() if row["scene"] == "stack"}, {"boxes=4/2", "boxes=2*2/1"})

    def test_repeats_are_interleaved_and_lie_together_in_the_table(self):
        self.run_sweep("--profile", "full")
        done = self.log.read_text().splitlines()
        third = len(done) // 3
        self.assertEqual(len(done), 3 * 15)
        self.assertEqual(done[:third], done[third:2 * third])
        self.assertEqual(done[:third], done[2 * third:])
        self.assertEqual([r["repeat"] for r in self.table()], ["1", "2", "3"] * 15)

    def test_a_run_that_two_sweeps_want_is_done_once_and_belongs_to_both(self):
        other = self.top / "other.toml"
        other.write_text('outside = ["pgs"]\nrecord_every = 0\n[profiles.tiny]\n[[runs]]\nscene = "sliding_box"\nk = [8, 16]\n'
                         'methods = ["ap"]\n')
        self.run_sweep(str(other))
        of = {r["k"]: r["sweeps"] for r in self.table() if r["scene"] == "sliding_box" and r["method"] == "ap"}
        self.assertEqual(of, {"4": "small", "8": "small other", "16": "other"})
        record = json.loads((self.top / "out/runs/sliding_box__ap__lemke__k8__r1/run.json").read_text())
        self.assertEqual(record["record_every"], 1)

    def test_a_finished_run_is_not_done_again_until_program_scene_or_limits_change(self):
        self.run_sweep()
        self.assertIn("0 of 15 runs to do", self.run_sweep())
        self.program.write_text(self.program.read_text() + "# newer\n")
        self.assertIn("0 of 15 runs to do", self.run_sweep("--keep", "--dry-run"))
        self.assertIn("15 of 15 runs to do", self.run_sweep("--dry-run"))

    def test_a_run_whose_time_did_not_count_is_done_again_where_it_does(self):
        self.sweep.write_text("timed = false\n" + SMALL)
        self.run_sweep()
        self.assertIn("0 of 15 runs to do", self.run_sweep("--dry-run"))
        self.sweep.write_text(SMALL)
        self.assertIn("15 of 15 runs to do", self.run_sweep())
        self.sweep.write_text("timed = false\n" + SMALL)
        self.assertIn("0 of 15 runs to do", self.run_sweep("--dry-run"))
        # What says nothing of it is from before it was said, and counts.
        self.sweep.write_text(SMALL)
        for file in (self.top / "out/runs").glob("*/run.json"):
            file.write_text(json.dumps({k: v for k, v in json.loads(file.read_text()).items() if k != "timed"}))
        self.assertIn("0 of 15 runs to do", self.run_sweep("--dry-run"))

    def test_a_run_whose_steps_are_too_coarse_or_none_is_done_again_where_they_are_wanted(self):
        self.sweep.write_text("record_every = 0\n" + SMALL)
        self.run_sweep()
        self.assertIn("0 of 15 runs to do", self.run_sweep("--dry-run"))
        self.sweep.write_text("record_every = 10\n" + SMALL)
        self.assertIn("15 of 15 runs to do", self.run_sweep())
        for every, todo in ((0, 0), (20, 0), (10, 0), (5, 15)):
            self.sweep.write_text(f"record_every = {every}\n" + SMALL)
            self.assertIn(f"{todo} of 15 runs to do", self.run_sweep("--dry-run"))

    def test_a_finished_run_is_done_again_when_a_file_that_its_scene_reads_changes(self):
        (self.top / "my.xml").write_text("<scenario/>")
        robot = self.top / "my.urdf"
        robot.write_text("<robot/>")
        self.sweep.write_text(SMALL.split("[[runs]]")[0] + f'[[runs]]\nscene = "{self.top}/my.xml"\nmethods = ["mirtich"]\n')
        self.run_sweep()
        self.run_sweep()
        self.assertEqual(len(self.log.read_text().splitlines()), 1)
        robot.write_text("<robot />")
        self.run_sweep()
        self.assertEqual(len(self.log.read_text().splitlines()), 2)

    def test_rerun_takes_the_runs_of_one_status(self):
        self.run_sweep(stack="crash")
        self.assertIn("0 of 15 runs to do", self.run_sweep("--dry-run"))
        self.assertIn("8 of 15 runs to do", self.run_sweep("--dry-run", "--rerun", "crash"))
        self.run_sweep("--rerun", "crash")
        self.assertEqual({r["status"] for r in self.table()}, {"ok"})

    def test_some_runs_are_done_again_and_their_rows_put_in_place(self):
        self.run_sweep()
        before, manifest = self.table(), self.top / "out" / "manifest.json"
        self.program.write_text(self.program.read_text().replace('"final_m": 1e-9', '"final_m": 2e-9').replace('"abc"', '"newer"'))
        said = self.run_sweep("--only", "stack__*ap__*", "--only", "sliding_box__m?rtich*", "--runs", str(self.top / "elsewhere"))
        self.assertIn("5 of 5 runs to do", said)
        after = self.table()
        self.assertEqual([row["run"] for row in after], [row["run"] for row in before])
        for old, new in zip(before, after):
            again = (new["scene"], new["method"]) in (("stack", "ap"), ("sliding_box", "mirtich"))
            self.assertEqual(new["error_final_m"], "2e-09" if again else "1e-09")
            self.assertEqual({**old, **dict.fromkeys(TIMING), "error_final_m": ""}, {**new, **dict.fromkeys(TIMING), "error_final_m": ""})
        self.assertEqual(json.loads(manifest.read_text())["versions"], [{"git": "abc"}, {"git": "newer"}])
        self.assertEqual(json.loads(manifest.read_text())["runs"], len(before))
        self.assertIn("named like", self.run_sweep("--only", "pile*", code=1))
        self.assertIn("not with --budget", self.run_sweep("--only", "stack*", "--budget", "1", code=2))
        self.assertIn("is of the profile 'tiny'", self.run_sweep("--only", "stack*", "--profile", "full", code=1))
        self.sweep.write_text(SMALL.replace("k = [4, 8]", "k = [4, 8, 16]"))
        self.assertIn("has no row of", self.run_sweep("--only", "*16*", code=1))

    def test_an_interrupted_run_is_done_again(self):
        self.run_sweep(stack="interrupted")
        self.assertIn("8 of 15 runs to do", self.run_sweep())
        self.assertEqual({r["status"] for r in self.table()}, {"ok"})

    def test_what_the_time_of_a_sweep_does_not_reach_is_a_row_and_is_done_later(self):
        self.run_sweep("--budget", "1e-9")
        rows = self.table()
        self.assertEqual([(r["status"], r["t_reached"]) for r in rows], [("time_limit", "")] * 15)
        self.assertIn("not begun", rows[0]["reason"])
        self.assertIn("15 of 15 runs to do", self.run_sweep("--budget", "1"))
        self.assertEqual({r["status"] for r in self.table()}, {"ok"})

    def test_a_dry_run_does_nothing(self):
        self.run_sweep("--dry-run")
        self.assertFalse((self.top / "out").exists())
        self.assertFalse(self.log.exists())

    def test_a_crash_is_one_row(self):
        row = self.one("crash")
        self.assertEqual((row["status"], row["finished"]), ("crash", "false"))
        self.assertIn("SIGABRT", row["reason"])
        # What the program did not say is empty, but how far it came is in its files.
        self.assertEqual((row["processing_s"], row["error_final_m"], row["t_reached"]), ("", "", "10.0"))
        row = self.again("fault")
        self.assertEqual(row["status"], "crash")
        self.assertIn("no such thing", row["reason"])

    def test_a_crash_after_a_good_summary_is_a_crash(self):
        row = self.one("late")
        self.assertEqual((row["status"], row["processing_s"]), ("crash", ""))

    def test_a_run_that_hangs_is_stopped_and_is_one_row(self):
        # The outer limit is 1.2 times the program's own and ten seconds.
        row = self.one("hang")
        self.assertEqual(row["status"], "time_limit")
        self.assertIn("did not come back", row["reason"])
        self.assertLess(float(row["wall_s"]), 20)

    def test_a_run_that_eats_memory_is_stopped_and_is_one_row(self):
        row = self.one("eat")
        self.assertEqual(row["status"], "memory_limit")
        self.assertLess(float(row["peak_memory_mb"]), 2 * 200 + 256)

    def test_a_program_that_is_not_there_is_a_crash_without_memory(self):
        job = {
            "program": "/nowhere/contactbench", "scene": "x.xml", "flags": [], "statuses": ["ok"], "timed": False, "time_limit_s": 1,
            "wall_limit_s": 2, "memory_limit_mb": 200, "record_every": 1, "record_contacts": False}
        with tempfile.TemporaryDirectory() as folder:
            record = program.done(job, Path(folder), program.Load())
        self.assertEqual((record["status"], record["peak_memory_mb"]), ("crash", None))
        self.assertIn("No such file", record["reason"])

    def test_garbage_is_one_row_and_is_never_read_as_a_result(self):
        for mode in ("garbage", "cut", "silent", "nan", "liar"):
            with self.subTest(mode):
                row = self.again(mode)
                self.assertEqual(row["status"], "crash")
                self.assertIn("garbage", row["reason"])
                self.assertEqual((row["processing_s"], row["error_final_m"]), ("", ""))

    def test_a_program_that_never_stops_talking_neither_blocks_nor_fills_memory(self):
        self.assertEqual(self.one("spew")["status"], "ok")

    def test_the_last_words_of_a_run_are_its_reason(self):
        job = {"statuses": ["ok"], "memory_limit_mb": 1000, "wall_limit_s": 1}

        def ends(code, said, peak_mb=10):
            return program.verdict(code, False, peak_mb, said, None, job)

        self.assertEqual(ends(1, "first\nlast"), ("crash", "last"))
        self.assertEqual(ends(1, ""), ("crash", "exit code 1 without a message"))
        self.assertEqual(ends(2, "first\nlast"), ("input_error", "last"))
        self.assertEqual(ends(2, ""), ("input_error", "exit code 2 without a message"))
        self.assertEqual(ends(-11, "last"), ("crash", "SIGSEGV: last"))
        self.assertEqual(ends(-6, "last", 900), ("memory_limit", "died at 1000 MB: last"))
        self.assertEqual(ends(-6, "", 899), ("crash", "SIGABRT"))

    def test_a_refused_scene_keeps_its_message(self):
        row = self.one("refuse")
        self.assertEqual((row["status"], row["reason"]), ("input_error", "bad scene"))

    def test_a_wrong_sweep_file_is_refused_with_what_would_be_right(self):
        self.sweep.write_text('[[runs]]\nscene = "stack"\nbanana = 3\n')
        self.assertIn("unknown key 'banana'; known:", self.run_sweep("--profile", "", code=1))
        self.sweep.write_text('[[runs]]\nscene = "stack"\nset.bricks = 3\n')
        self.assertIn("no parameter 'bricks'; it has boxes", self.run_sweep("--profile", "", code=1))

    def test_a_scene_that_is_not_there_is_said_and_stops_nothing(self):
        self.sweep.write_text(SMALL + '[[runs]]\nscene = "moon"\n')
        self.assertIn("moon is left out", self.run_sweep())
        self.assertIn("moon", json.loads((self.top / "out/manifest.json").read_text())["missing"])

    def starts(self):
        return len(self.log.read_text().splitlines()) if self.log.exists() else 0

    def test_killed_at_random_twenty_times_it_ends_with_the_same_table(self):
        self.sweep.write_text('outside = ["pgs"]\n[profiles.tiny]\nrepeats = 6\n[[runs]]\nscene = "sliding_box"\nk = [4, 6, 8, 10]\n'
                              '[[runs]]\nscene = "stack"\nset.boxes = [1, 16]\nk = [4, 8, 12, 16, 20]\n')
        self.run_sweep("--jobs", "2", out="calm")
        self.log.unlink()
        chance = random.Random(1)
        environment = standin.environment(LOG=str(self.log), SLOW="0.02")
        for kill in range(20):
            process = subprocess.Popen(self.command("--jobs", "2"), env=environment, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
            # Half of the kills come at any moment, the others when a run of this start is on its way, however slow the machine.
            started, deadline = self.starts(), time.monotonic() + 30
            while kill % 2 and self.starts() == started and time.monotonic() < deadline:
                time.sleep(0.01)
            time.sleep(chance.uniform(0, 0.3) if kill % 2 else chance.uniform(0.05, 0.5))
            process.send_signal(signal.SIGKILL)
            self.assertEqual(process.wait(), -signal.SIGKILL, f"the sweep was through before kill {kill}; make it longer")
        starts_killed = self.starts()
        said = self.run_sweep("--jobs", "2")
        todo = int(said.split(" of ")[0].splitlines()[-1].split()[-1])
        rows = self.untimed()
        self.assertEqual(rows, self.untimed("calm"))
        self.assertEqual(len({r["run"] for r in rows}), len(rows))
        # The kills hit the sweep at work, and no finished run was done again: a kill costs at most the two in flight.
        self.assertGreaterEqual(starts_killed, 10)
        self.assertLess(todo, len(rows))
        self.assertLessEqual(starts_killed + todo, len(rows) + 20 * 2)

    def alive(self):
        """Command lines of the runs at work, without those that only warm up."""
        lines = [read(p) for p in Path("/proc").glob("[0-9]*/cmdline")]
        return [line for line in lines if f"{self.program}\0run".encode() in line and b"warm_up" not in line]

    def wait_for_runs(self):
        """Until a sweep has begun its first, however slow the machine."""
        end = time.monotonic() + 60
        while not self.alive():
            self.assertLess(time.monotonic(), end, "the sweep begins no run")
            time.sleep(0.05)

    def test_two_sweeps_do_not_share_a_folder(self):
        first = subprocess.Popen(self.command(), env=standin.environment(SLOW="0.3"), stdout=subprocess.DEVNULL)
        self.wait_for_runs()
        self.assertIn("another sweep is at work", self.run_sweep(code=1))
        self.assertEqual(first.wait(), 0)

    def test_interrupting_it_ends_its_runs_with_it(self):
        sweep = subprocess.Popen(self.command(), env=standin.environment(SLOW="30"), stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        self.wait_for_runs()
        sweep.send_signal(signal.SIGTERM)
        self.assertEqual(sweep.wait(timeout=10), 130)
        # What was killed with it is no result.
        self.assertEqual(list((self.top / "out/runs").glob("*/run.json")), [])
        self.assertEqual(self.alive(), [])

    def test_a_signal_that_wakes_nobody_is_heard(self):
        # As one that comes between the last look for signals and a wait: here another thread takes it.
        def heard(*_):
            raise InterruptedError

        before = signal.signal(signal.SIGUSR1, heard)
        self.addCleanup(signal.signal, signal.SIGUSR1, before)
        through = threading.Event()
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            slow = pool.submit(through.wait, 30)
            threading.Timer(0.2, lambda: signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)).start()
            try:
                with self.assertRaises(InterruptedError):
                    next(program.as_they_end([slow]))
                self.assertFalse(slow.done())
            finally:
                through.set()

    def test_futures_come_as_they_end(self):
        first = threading.Event()
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            slow, quick = pool.submit(first.wait, 30), pool.submit(lambda: 7)
            came = program.as_they_end([slow, quick])
            self.assertEqual(next(came).result(), 7)
            first.set()
            self.assertIs(next(came), slow)
            self.assertEqual(list(came), [])

    def test_timed_runs_go_alone_when_asked(self):
        self.sweep.write_text(SMALL.replace('step = ["1e-2", "1e-3"]', 'step = ["1e-2", "1e-3"]\ntimed = false'))
        self.run_sweep("--jobs", "3", "--timed-alone")
        scenes = [line.split()[0] for line in self.log.read_text().splitlines()]
        self.assertEqual(scenes, ["stack.xml"] * 8 + ["sliding_box.xml"] * 7)
        # Runs in company say nothing of the machine's load: they would count each other.
        self.assertEqual({r["busy"] for r in self.table() if r["scene"] == "stack"}, {""})

    def test_dask_gives_the_same_table(self):
        try:
            import distributed  # noqa: F401
        except ImportError:
            self.skipTest("python3-distributed is not installed")
        self.run_sweep(out="here", stack="crash")
        self.run_sweep("--engine", "dask", "--jobs", "2", out="there", stack="crash")
        self.assertEqual(self.untimed("here"), self.untimed("there"))

    def test_dask_takes_a_scheduler_that_is_there(self):
        try:
            import distributed  # noqa: F401
        except ImportError:
            self.skipTest("python3-distributed is not installed")
        start = [sys.executable, "-m", "distributed.cli.dask_scheduler"], [sys.executable, "-m", "distributed.cli.dask_worker"]
        port = free_port()
        environment = standin.environment(HOME=str(self.top), FAKE=json.dumps({"stack": "garbage"}))
        scheduler = subprocess.Popen([*start[0], "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"], cwd=self.top,
                                     env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        workers = [subprocess.Popen([*start[1], f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-dashboard",
                                     "--local-directory", str(self.top / f"worker{n}")], cwd=self.top, env=environment,
                                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for n in range(2)]
        try:
            self.run_sweep("--engine", f"dask:tcp://127.0.0.1:{port}", out="there")
        finally:
            for process in workers + [scheduler]:
                process.terminate()
            for process in workers + [scheduler]:
                process.wait(timeout=30)
        self.run_sweep(out="here", stack="garbage")
        self.assertEqual(self.untimed("here"), self.untimed("there"))


def free_port():
    import socket
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def read(path):
    try:
        return path.read_bytes()
    except OSError:
        return b""


if __name__ == "__main__":
    unittest.main()
