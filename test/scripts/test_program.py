"""scripts/contactbench/program.py: how a run is called, what its end is taken for, and what is kept of it. On processes
of the shell and on answers that are made up."""
import collections
import contextlib
import io
import json
import math
import os
import resource
import subprocess
import threading
import time
import types
import unittest
from pathlib import Path
from unittest import mock

from contactbench import plan, program
from folder import Folder

SUMMARY = {
    "status": "ok", "reason": "by itself", "finished": True, "scenario": "stack", "method": "ap", "t_reached": 0.5,
    "time": {"dynamics_s": 1, "collision_s": 2, "assembly_s": 3, "solve_s": 4}}
JOB = {
    "asked": {"run": "stack__ap__r1", "scene": "stack", "method": "ap", "parameters": "a=1"}, "flags": ["--method", "ap"],
    "program": "prog", "scene": "stack.xml", "file": "/p/stack.xml", "statuses": ["ok", "inaccurate", "ray"], "timed": False,
    "time_limit_s": 5.0, "wall_limit_s": 16.0, "memory_limit_mb": 1000, "record_every": 7, "deadline": None,
    "record_contacts": False}


class Calls(Folder):
    def test_a_run_is_called_with_its_scene_its_flags_and_its_folder(self):
        self.assertEqual(program.run_words("p", "s.xml", ["--method", "ap", "--k", 4], Path("/o")),
                         ["p", "run", "s.xml", "--method", "ap", "--k", "4", "--out", "/o", "--quiet"])
        self.assertEqual(program.settings(["a=1", "b=2"]), ["--set", "a=1", "--set", "b=2"])

    def test_a_command_is_run_to_its_end_and_no_longer_than_it_may(self):
        ended = program.call("sh", "-c", "echo out; echo $0 >&2; exit 7", 4.5)
        self.assertEqual((ended.returncode, ended.stdout, ended.stderr), (7, "out\n", "4.5\n"))
        with self.assertRaises(program.Late):
            program.call("sleep", 5, timeout=0.05)

    def test_tasks_side_by_side_return_in_their_order_and_end_with_the_first_that_fails(self):
        self.assertEqual(program.together([lambda: program.call("sh", "-c", "sleep 0.05; echo a").stdout, lambda: "b"]), ["a\n", "b"])

        def fails():
            raise ValueError("of a task")

        start = time.monotonic()
        with mock.patch.object(program, "over", threading.Event()), mock.patch.object(os, "cpu_count", lambda: 2), \
                self.assertRaisesRegex(ValueError, "of a task"):
            program.together([lambda: program.call("sleep", 60), fails])
        self.assertLess(time.monotonic() - start, 30)

    def test_a_name_that_is_not_there_ends_with_2_and_the_names_that_are(self):
        self.assertIsNone(program.hold_to("--flag", ["a", "b"], ["b", "a", "c"]))
        with contextlib.redirect_stderr(io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
            program.hold_to("--flag", ["a", "d"], ["b", "a"])
        self.assertEqual((ended.exception.code, said.getvalue()), (2, "--flag d: no such; there are b, a\n"))

    def test_a_program_that_does_not_list_itself_is_none(self):
        for path in ("/nowhere/program", "false", "echo"):
            with self.assertRaisesRegex(program.ProgramError, f"`{path} list --json` does not work: "):
                program.listed(path)

    def test_methods_come_with_each_variant_and_solver_in_the_order_of_the_list(self):
        def method(name, solvers=(), variants=()):
            return {"name": name, "solvers": list(solvers), "variants": list(variants)}

        said = {
            "methods": [
                method("newton", (), ("a", "b")),
                method("ap", ("lemke", "path", "lib")),
                method("both", ("x", "y"), ("u", "v"))], "solvers": [{"method": "ap", "name": "lib", "unavailable": "why"}, {
                    "method": "ap", "name": "path", "unavailable": None}, {"method": "both", "name": "y", "unavailable": "no"}]}

        def of(**more):
            rows, missing = program.choices(said, **more)
            return [(m["name"], v, s) for m, v, s in rows], missing

        rows, missing = of()
        self.assertEqual(rows, [("newton", "a", ""), ("newton", "b", ""), ("ap", "", "lemke"), ("ap", "", "path"),
                                ("both", "u", "x"), ("both", "v", "x")])
        self.assertEqual(missing, {"ap/lib": "why", "both/y": "no"})
        self.assertEqual(of(outside=["newton", "path", "lib"]), ([("ap", "", "lemke"), *rows[4:]], {"both/y": "no"}))
        self.assertEqual(of(outside=["both"])[1], {"ap/lib": "why"})
        self.assertEqual([r for r in of(unavailable=True)[0] if r not in rows], [("ap", "", "lib"), ("both", "u", "y"),
                                                                                 ("both", "v", "y")])

    def test_scenes_statuses_and_the_version_are_what_the_program_says_of_itself(self):
        said = {
            "scenarios": [{"name": "a.xml", "file": 1}, {"name": "b.xml", "file": 2}], "statuses": [{"name": "ok"}, {
                "name": "ray"}]}
        self.assertEqual({name: s["file"] for name, s in program.scenes_of(said).items()}, {"a": 1, "b": 2})
        self.assertEqual(program.statuses_of(said), ["ok", "ray"])
        for stdout, commit in (("contactbench 1.2 (git 12ab, dirty; gcc 12)", "12ab, dirty"),
                               ("nothing", "a program that said nothing of itself")):
            with mock.patch.object(program, "call", return_value=types.SimpleNamespace(stdout=stdout)):
                self.assertEqual(program.version("p"), commit)

    def test_a_scene_s_files_are_what_the_program_says_and_else_its_own(self):
        program.files_of.cache_clear()
        asked = []

        def call(*words, timeout=None):
            asked.append((words, timeout))
            return types.SimpleNamespace(returncode=2 if "refused=1" in words else 0, stdout="/a.xml\n/b.urdf\n")

        with mock.patch.object(program, "call", call):
            self.assertEqual(program.files_of("p", Path("/a.xml"), "x=1 y=2", 9), ("/a.xml", "/b.urdf"))
            self.assertEqual(program.files_of("p", Path("/a.xml"), "refused=1"), ("/a.xml", ))
        self.assertEqual(asked[0], (("p", "check", Path("/a.xml"), "--files", "--set", "x=1", "--set", "y=2"), 9))
        with mock.patch.object(program, "call", side_effect=program.Late("p", 1)):
            self.assertEqual(program.files_of("late", "/a.xml", ""), ("/a.xml", ))
        program.files_of.cache_clear()

    def test_a_digest_changes_with_any_byte_of_any_file_and_with_nothing_else(self):
        a, b = self.top / "a", self.top / "b"
        a.write_bytes(b"one")
        b.write_bytes(b"two")
        first = program.digest(a, b)
        self.assertRegex(first, "^[0-9a-f]{16}$")
        a.touch()
        self.assertEqual(program.digest(a, b), first)
        b.write_bytes(b"twp")
        self.assertNotEqual(program.digest(a, b), first)
        with self.assertRaises(OSError):
            program.digest(a, self.top / "none")

    def test_the_machine_s_cpu_is_the_first_that_it_names(self):
        text = "processor : 0\nmodel name\t: A CPU: 3 GHz\nmodel name : Another\n"
        for read, cpu in (({"return_value": text}, "A CPU: 3 GHz"), ({"return_value": "processor : 0\n"}, "unknown"), ({
                "side_effect": OSError}, "unknown")):
            with mock.patch.object(Path, "read_text", **read):
                self.assertEqual(program.cpu(), cpu)

    def test_a_vector_is_read_without_its_head_and_none_is_none(self):
        (self.top / "u").write_text("%%MatrixMarket matrix array real general\n% said\n\n3 1\n1.5\n-2\n3e-4\n")
        self.assertEqual(program.read_vector(self.top / "u"), [1.5, -2, 3e-4])
        self.assertEqual(program.read_vector(self.top / "none"), [])

    def test_what_is_no_json_is_none(self):
        for text, read in (('{"a": 1}', {"a": 1}), ("[1]", [1]), ("{", None), ("", None)):
            (self.top / "x").write_text(text)
            self.assertEqual(program.read_json(self.top / "x"), read)
        self.assertIsNone(program.read_json(self.top / "none"))


class Company(unittest.TestCase):
    """Cores that others keep busy."""
    def others(self, *samples, start):
        load = program.Load()
        load.samples = collections.deque(samples[:-1])
        with mock.patch.object(load, "sample", lambda: samples[-1]):
            return load.others(start)

    def test_it_is_the_machine_s_time_less_ones_own_since_the_start_or_a_second_ago(self):
        samples = (10.0, 100.0, 50.0), (12.0, 103.0, 51.0), (14.0, 109.0, 54.0)  # when, s busy, s of one's own
        self.assertEqual(self.others(*samples, start=12.5), (6 - 3) / 2)
        self.assertEqual(self.others(*samples, start=11.0), (9 - 4) / 4)
        # Of less than a second nothing is said: the last second or so counts.
        self.assertEqual(self.others(*samples[:2], (13.5, 108.0, 53.0), samples[2], start=13.9), (6 - 3) / 2)
        self.assertIsNone(self.others(*samples, start=9.0))
        self.assertEqual(self.others((10.0, 100.0, 50.0), (12.0, 101.0, 53.0), start=10.0), 0)
        self.assertIsNone(self.others((10.0, 100.0, 50.0), None, start=10.0))

    def test_time_in_which_nobody_works_or_waits_for_a_disk_is_none(self):
        text = "cpu  100 200 300 4000 5000 60 70 80 900 1000\n"
        with mock.patch("builtins.open", mock.mock_open(read_data=text)):
            _, busy, own = program.Load().sample()
        self.assertAlmostEqual(busy, (100 + 200 + 300 + 60 + 70 + 80) / os.sysconf("SC_CLK_TCK"))
        self.assertGreaterEqual(own, sum(resource.getrusage(resource.RUSAGE_SELF)[:2]) * 0.5)


class Ends(Folder):
    def test_the_first_thing_that_is_wrong_of_a_summary_is_said(self):
        self.assertEqual(program.fault_of(SUMMARY, JOB), "")
        self.assertEqual(program.fault_of(SUMMARY | {"status": "inaccurate"}, JOB), "")
        self.assertEqual(program.fault_of(SUMMARY | {"status": "ray", "finished": False}, JOB), "")
        another, contradicts = "summary.json is of another run", "summary.json contradicts itself on whether the run finished"
        lacks, nan = "summary.json lacks its times", "summary.json holds NaN or infinity"
        for more, fault in (({
                "status": "new"}, "summary.json has no known status, but 'new'"), ({"finished": False}, contradicts), ({
                    "finished": 1}, contradicts), ({"status": "ray"}, contradicts), ({"scenario": "wall"}, another), ({
                        "method": "ap2"}, another), ({"t_reached": None}, lacks), ({"t_reached": math.inf}, lacks), ({
                            "time": None}, lacks), *(({"time": SUMMARY["time"] | {f"{part}_s": "x"}}, lacks)
                                                     for part in ("dynamics", "collision", "assembly", "solve")), ({
                                                         "deep": [{"x": [1,
                                                                         math.nan]}]}, nan), ({"deep": {"x": -math.inf}}, nan)):
            self.assertEqual(program.fault_of(SUMMARY | more, JOB), fault, more)
        self.assertEqual(program.fault_of([SUMMARY], JOB), "summary.json is no JSON object")

    def verdict(self, code=0, stopped=False, peak=10, said="", **summary):
        return program.verdict(code, stopped, peak, said, SUMMARY | summary, JOB)

    def test_the_word_of_the_program_counts_where_its_exit_code_says_the_same(self):
        ray = {"status": "ray", "finished": False}
        self.assertEqual(self.verdict(), ("ok", "by itself"))
        self.assertEqual(self.verdict(3, **ray), ("ray", "by itself"))
        self.assertEqual(self.verdict(3, **ray | {"reason": None}), ("ray", ""))
        self.assertEqual(self.verdict(0, **ray), ("crash", "garbage: exit code does not fit the summary (exit code 0)"))
        self.assertEqual(self.verdict(3), ("crash", "garbage: exit code does not fit the summary (exit code 3)"))
        self.assertEqual(self.verdict(0, scenario="x"), ("crash", "garbage: summary.json is of another run (exit code 0)"))
        self.assertEqual(self.verdict(stopped=True), ("time_limit", "did not come back within 16 s; stopped from outside"))

    def test_a_death_for_want_of_memory_is_told_by_its_words_or_its_size(self):
        for said in ("terminate: std::bad_alloc", "x\nOut of memory", "MemoryError", "cannot allocate memory",
                     "std::length_error"):
            self.assertEqual(self.verdict(-6, said=said)[0], "memory_limit")
        self.assertEqual(self.verdict(1, peak=900), ("memory_limit", "died at 1000 MB"))
        self.assertEqual(self.verdict(2, peak=900, said="bad"), ("input_error", "bad"))
        self.assertEqual(self.verdict(-40), ("crash", "signal 40"))
        self.assertEqual(self.verdict(77)[0], "crash")

    def test_addresses_are_twice_the_memory_and_some_more(self):
        self.assertEqual(program.addresses(1000), 2256 * 1024 * 1024)

    def test_a_process_is_held_to_its_limits_and_its_last_words_are_kept(self):
        code, stopped, peak, said = program.execute(["sh", "-c", "ulimit -v; ulimit -c; echo first >&2; echo last >&2; exit 5"],
                                                    20, 1 << 30)
        self.assertEqual((code, stopped, said), (5, False, "first\nlast"))
        # What is forked begins as large as these tests are.
        own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        self.assertTrue(0.1 < peak < 100 + own, (peak, own))
        shown = self.top / "shown"
        with mock.patch.dict(os.environ, {"CONTACTBENCH_ADDRESS_SPACE": ""}):
            program.execute(["sh", "-c", f"(ulimit -v; ulimit -c; echo $OMP_NUM_THREADS $OPENBLAS_NUM_THREADS) > {shown}"], 20,
                            1 << 30)
        self.assertEqual(shown.read_text().split(), [str(1 << 20), "0", "1", "1"])
        program.execute(["sh", "-c", f"cat /proc/self/limits > {shown}"], 20, 1 << 30)
        line = next(line for line in shown.read_text().splitlines() if line.startswith("Max file size"))
        self.assertEqual(line.split()[3:5], 2 * [str(16 * 1024**3)])
        code, stopped, *_ = program.execute(["sleep", "9"], 0.05, 1 << 30)
        self.assertEqual((code, stopped), (-9, True))
        # What kills itself was not stopped.
        self.assertEqual(program.execute(["sh", "-c", "kill -9 $$"], 20, 1 << 30)[:2], (-9, False))

    def test_of_much_that_a_process_says_the_end_is_kept(self):
        *_, said = program.execute(["sh", "-c", "yes noise | head -c 300000 >&2; echo last >&2"], 20, 1 << 30)
        self.assertEqual(said.splitlines()[-1], "last")
        self.assertLessEqual(len(said), 1 << 16)

    def gone(self, pid):
        """Whether a process comes to its end soon, though nobody may have asked for its exit code; else it is ended."""
        end = time.monotonic() + 5
        while time.monotonic() < end:
            try:
                if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX":
                    return True
            except OSError:
                return True
            time.sleep(0.01)
        os.kill(pid, 9)
        return False

    def test_what_a_process_started_in_turn_ends_with_it(self):
        child = self.top / "child"
        code, stopped, *_ = program.execute(["sh", "-c", f"sleep 60 & echo $! > {child}; exit 4"], 20, 1 << 30)
        self.assertEqual((code, stopped), (4, False))
        self.assertTrue(self.gone(int(child.read_text())))

    def test_a_process_dies_with_the_one_that_started_it_however_that_ends(self):
        child = self.top / "child"
        words = ["sh", "-c", f"echo $$ > {child}.new; mv {child}.new {child}; exec sleep 60"]
        code = f"from contactbench import program; program.execute({words!r}, 60, 1 << 30)"
        parent = subprocess.Popen([program.sys.executable, "-S", "-c", code], cwd=Path(program.__file__).parents[1])
        self.addCleanup(parent.kill)
        end = time.monotonic() + 30
        while not child.exists() and time.monotonic() < end:
            time.sleep(0.01)
        parent.kill()
        parent.wait()
        self.assertTrue(self.gone(int(child.read_text())))

    def test_a_run_that_is_watched_is_recorded_and_its_summary_counts_where_it_is_whole(self):
        for flags, recorded, summary in ((["--method", "ap"], ["--record-every", "1"], SUMMARY), ([
                "--record-every", "5", "--engine", "ode"], [], SUMMARY | {"method": "ode"}), (["--method", "convex"], [
                    "--record-every", "1"], None)):
            asked = []

            def execute(*words, asked=asked):
                asked.append(words)
                (self.top / "summary.json").write_text(json.dumps(summary or SUMMARY))
                return 0, False, 10, ""

            with mock.patch.object(program, "execute", execute):
                status, reason, stopped, found = program.watched("p", Path("/x/stack.xml"), flags, self.top, JOB["statuses"],
                                                                 12.5, 1000)
            self.assertEqual(asked, [
                (["p", "run", "/x/stack.xml", *flags, *recorded, "--memory-limit", "1000", "--out",
                  str(self.top), "--quiet"], 12.5, 2256 * 2**20)])
            self.assertEqual((status, stopped, found), ("ok" if summary else "crash", False, summary))
            self.assertIn("by itself" if summary else "of another run", reason)

    def test_how_far_a_run_came_is_in_the_last_whole_row_of_its_steps(self):
        steps = self.top / "steps.csv"
        for text, t in (("step,t,x\n1,0.5,7\n2,1.25,8\n3,9.", 1.25), ("t\n0.5\n", 0.5), ("step,t\n", None), ("", None),
                        ("step,t\n1,nan\n", None), ("step,x\n1,2\n", None), ("step,t,x\n" + "1,0.5,7\n" * 20000 + "2,3.5,1\n",
                                                                             3.5)):
            steps.write_text(text)
            self.assertEqual(program.reached(self.top), t)
        self.assertIsNone(program.reached(self.top / "none"))


class Runs(Folder):
    def setUp(self):
        super().setUp()
        program.files_of.cache_clear()
        self.job = JOB | {"runs": str(self.top / "runs")}

    def test_a_job_is_what_its_run_asks_and_how_long_it_may_take(self):
        run = plan.Run("stack", (("boxes", "4"), ), "ap", "", "lemke", (("k", "8"), ), 2)
        job = program.job_of(run, "p", "stack.xml", "/f/stack.xml", Path("/r"), ["ok"], 100, 200, 3, False, 1e9, True)
        self.assertEqual(
            job, {
                "asked": run.asked(), "flags": run.flags(), "program": "p", "scene": "stack.xml", "file": "/f/stack.xml",
                "runs": "/r", "statuses": ["ok"], "timed": False, "time_limit_s": 100, "wall_limit_s": 130,
                "memory_limit_mb": 200, "record_every": 3, "deadline": 1e9, "record_contacts": True})
        usual = program.job_of(run, "p", "s", "f", "/r", [], 100)
        self.assertEqual([usual[k] for k in ("memory_limit_mb", "record_every", "timed", "deadline", "record_contacts")],
                         [4096, 1, True, None, False])

    def test_a_run_has_no_more_time_than_its_sweep(self):
        self.assertEqual(program.within(self.job, 1e9), self.job)
        late = self.job | {"deadline": 1000.0}
        self.assertEqual(program.within(late, 995.0), late)
        cut = program.within(late, 997.5)
        self.assertEqual((cut["time_limit_s"], cut["wall_limit_s"]), (2.5, 13.0))
        self.assertEqual(program.within(late, 2000.0)["time_limit_s"], 0)

    def done(self, code=0, stopped=False, peak=12.346, said="", summary=None, others=0.3, **more):
        """The record of a run that ends like this, and the commands."""
        asked = []

        def execute(command, wall, memory):
            asked.append((command, wall, memory))
            out = Path(command[command.index("--out") + 1])
            out.mkdir(exist_ok=True)
            (out / "summary.json").write_text(json.dumps(SUMMARY if summary is None else summary))
            (out / "steps.csv").write_text("t\n0.75\n")
            return code, stopped, peak, said

        load = types.SimpleNamespace(others=lambda start: others)
        with mock.patch.object(program, "execute", execute):
            return program.done(self.job | more, self.top, load), asked

    def test_a_run_is_called_with_its_flags_and_limits(self):
        _, ((command, wall, memory), ) = self.done()
        self.assertEqual(command, [
            "prog", "run", "stack.xml", "--method", "ap", "--record-every", "7", "--time-limit", "5", "--memory-limit", "1000",
            "--out",
            str(self.top), "--quiet"])
        self.assertEqual((wall, memory), (16.0, 2256 * 2**20))
        _, ((command, *_), ) = self.done(record_contacts=True)
        self.assertEqual(command[5:8], ["--record-every", "7", "--record-contacts"])
        # A run whose time counts is warmed up for a tenth of a second, in a folder that is gone afterwards.
        _, ((command, wall, _), (timed, *_)) = self.done(timed=True)
        self.assertEqual((command[-6:], wall), (["0.1", "--memory-limit", "1000", "--out",
                                                 str(self.top / "warm_up"), "--quiet"], 0.8))
        self.assertEqual(timed[-2], str(self.top))
        self.assertFalse((self.top / "warm_up").exists())
        _, ((command, *_), _) = self.done(timed=True, time_limit_s=0.05)
        self.assertEqual(command[7:9], ["--time-limit", "0.05"])

    def test_the_time_of_a_run_and_its_company_are_counted_from_the_end_of_its_warm_up(self):
        now, began = [100.0], []

        def execute(command, *_):
            now[0] += 0.5 if command[-2].endswith("warm_up") else 4.0
            return 0, False, 10, ""

        load = types.SimpleNamespace(others=lambda start: began.append(start) or 0.0)
        with mock.patch.object(program, "execute", execute), mock.patch.object(program.time, "monotonic", lambda: now[0]):
            record = program.done(self.job | {"timed": True}, self.top, load)
        self.assertEqual((record["wall_s"], began), (4.0, [100.5]))

    def test_the_record_says_how_it_ended(self):
        record, _ = self.done(timed=True)
        self.assertTrue(0 <= record.pop("wall_s") < 5)
        self.assertEqual(
            record, {
                "status": "ok", "reason": "by itself", "exit_code": 0, "finished": True, "t_reached": None,
                "peak_memory_mb": 12.35, "other_cores": 0.3, "busy": True})
        for others, busy in ((0.25, False), (0.2514, True), (None, None)):
            record, _ = self.done(timed=True, others=others)
            self.assertEqual((record["other_cores"], record["busy"]), (others and round(others, 3), busy))
        record, _ = self.done()  # whose time does not count
        self.assertEqual((record["other_cores"], record["busy"]), (None, None))
        record, _ = self.done(3, summary=SUMMARY | {"status": "ray", "finished": False})
        self.assertEqual((record["status"], record["finished"], record["exit_code"], record["t_reached"]),
                         ("ray", False, 3, None))
        self.assertTrue((self.top / "summary.json").exists())

    def test_a_summary_that_is_not_trusted_is_taken_away_and_the_time_reached_is_that_of_the_steps(self):
        for more in ({"code": -6}, {"stopped": True}, {"summary": SUMMARY | {"method": "x"}}):
            record, _ = self.done(said=f"it wrote to {self.top}/x", **more)
            self.assertIn(record["status"], ("crash", "time_limit"))
            self.assertEqual((record["t_reached"], record["finished"]), (0.75, False))
            self.assertFalse((self.top / "summary.json").exists())
        self.assertEqual(self.done(-6, said=f"it wrote to {self.top}/x")[0]["reason"], "SIGABRT: it wrote to ./x")

    def test_a_run_is_published_with_what_it_read_and_was_allowed(self):
        (self.top / "prog").write_text("p")
        (self.top / "stack.xml").write_text("s")
        job = self.job | {"program": str(self.top / "prog"), "file": str(self.top / "stack.xml")}
        reads = types.SimpleNamespace(returncode=0, stdout=f"{self.top}/stack.xml\n")
        with mock.patch.object(program, "call", return_value=reads), \
                mock.patch.object(program, "done", lambda *_: {"status": "ok"}):
            record = program.do(job, None)
        self.assertEqual(
            record, JOB["asked"] | {
                "flags": ["--method", "ap"], "files": [f"{self.top}/stack.xml"], "key": program.digest(
                    self.top / "prog", self.top / "stack.xml"), "limits": [5.0, 1000], "record_every": 7,
                "record_contacts": False, "timed": False, "status": "ok"})
        self.assertEqual(json.loads((self.top / "runs/stack__ap__r1/run.json").read_text()), record)
        self.assertEqual(list((self.top / "runs/.doing").iterdir()), [])
        # Of what is not there no key is known; where the time of the sweep is over nothing is begun.
        with mock.patch.object(program, "call", side_effect=OSError), mock.patch.object(program, "done", self.fail):
            record = program.do(self.job | {"deadline": time.time() - 1}, None)
        self.assertEqual((record["key"], record["files"], record["status"], record["wall_s"], record["finished"]),
                         ("", ["/p/stack.xml"], "time_limit", 0.0, False))
        self.assertEqual(record["reason"], "not begun: the time of the sweep was spent")

    def test_what_was_ended_with_the_sweep_is_not_published(self):
        over = threading.Event()
        over.set()
        with mock.patch.object(program, "over", over), mock.patch.object(program, "done", lambda *_: {"status": "crash"}), \
                mock.patch.object(program, "call", side_effect=OSError):
            with self.assertRaises(program.Ended):
                program.do(self.job, None)
            with self.assertRaises(program.Ended):
                program.execute(["true"], 1, 1 << 30)
        self.assertFalse((self.top / "runs/stack__ap__r1").exists())

    def test_a_folder_is_taken_away_with_what_an_earlier_time_left_of_it(self):
        for name in ("x", "x.away.123", "x.away", "y.away.1"):
            (self.top / name).mkdir()
        program.clear(self.top / "x")
        program.clear(self.top / "none")
        self.assertEqual(sorted(path.name for path in self.top.iterdir()), ["x.away", "y.away.1"])


class Chunks(Folder):
    """The jobs of a task of Slurm."""
    def chunk(self, *names, seconds=None, logs=(), takes=0.0):
        """Runs that were done, and the lines that were written."""
        file, did, now = self.top / "3.json", [], [100.0]
        file.write_text(json.dumps({"jobs": [{"asked": {"run": name}} for name in names], "seconds": seconds}))
        for n, lines in enumerate(logs):
            (self.top / f"3.before{n}.log").write_text("".join(json.dumps(line) + "\n" for line in lines))

        def do(job, load, doing):
            did.append((job["asked"]["run"], doing))
            now[0] += takes
            return {"status": "ok"}

        with mock.patch.object(program, "do", do), mock.patch.object(program.time, "monotonic", lambda: now[0]):
            program.do_chunk(file)
        new = [path for path in self.top.glob("3.*.log") if "before" not in path.name]
        self.assertEqual({doing for _, doing in did} - {self.top / ".doing"}, set())
        return [name for name, _ in did], program.lines_of(new[0])[0]

    def test_each_run_is_said_before_and_after(self):
        did, lines = self.chunk("a", "b", takes=2.5)
        self.assertEqual(did, ["a", "b"])
        self.assertEqual(
            lines, [line for name in did for line in ({"run": name}, {"run": name, "record": {"status": "ok"}, "took_s": 2.5})])

    def test_what_is_there_or_was_begun_three_times_is_left(self):
        logs = ([{"run": "a"}, {"run": "a", "record": {}}, {"run": "b"}, {"run": "c"}], [{"run": "b"}, {"run": "c"}], [{
            "run": "b"}])
        self.assertEqual(self.chunk("a", "b", "c", "d", logs=logs)[0], ["c", "d"])

    def test_no_run_is_begun_after_the_time_of_the_task(self):
        self.assertEqual(self.chunk("a", "b", "c", "d", seconds=5, takes=2.0)[0], ["a", "b", "c"])

    def test_lines_are_read_on_from_where_the_last_whole_one_ended(self):
        log = self.top / "x.log"
        log.write_text('{"a": 1}\n{"b": 2}\n{"c"')
        lines, at = program.lines_of(log)
        self.assertEqual((lines, at), ([{"a": 1}, {"b": 2}], 18))
        log.write_text('{"a": 1}\n{"b": 2}\n{"c": 3}\n')
        self.assertEqual(program.lines_of(log, at), ([{"c": 3}], 27))

    def test_as_a_script_it_reads_a_job_and_prints_its_record(self):
        job = JOB | {"runs": str(self.top / "runs"), "deadline": 1.0}
        ended = subprocess.run([program.sys.executable, "-S", program.__file__], input=json.dumps(job), capture_output=True,
                               text=True)
        self.assertEqual((json.loads(ended.stdout)["status"], ended.returncode), ("time_limit", 0), ended.stderr)
        self.assertTrue((self.top / "runs/stack__ap__r1/run.json").exists())


if __name__ == "__main__":
    unittest.main()
