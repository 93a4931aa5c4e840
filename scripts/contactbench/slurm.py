"""Sweeps by Slurm (sweep.py --engine slurm; docs/sweeps.md, "More than one machine"): the runs as array jobs, each
task a chunk of them one after another (program.do_chunk).

A submission is a folder RUNS/.slurm/<name>, named as its job: a file a chunk, the logs that its tasks write, and what
is half done. Taking the folder away revokes it: no task begins or publishes anything any more. Slurm only says which
tasks are still to come; what is done is in the logs. What a task left of its chunk when it ended is submitted again.
"""
import collections
import contextlib
import json
import math
import shlex
import shutil
import sys
import time
import uuid
from pathlib import Path

from . import program
from .program import ProgramError

FOLDER = ".slurm"  # in the folder of runs
NEEDED = ("sbatch", "squeue", "scancel", "scontrol")
GUESS_S = 1.0  # that a run takes, where nothing is known
WANTED_S = 120  # that a task should take
LONGEST_S = 600  # after that a task begins no run; what is left of its chunk goes to other tasks
BESIDE_MB = 256  # of a task, beside its run
LOOKS = (1.0, 15.0)  # s between looks at Slurm: at first, at most
SAID_EVERY = 60  # s, at least, between lines on how tasks stand
LAUNCH_FAILED = "LAUNCH_FAILED"  # ours: Slurm holds such a task until somebody releases it
OVER = {
    "BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", LAUNCH_FAILED, "NODE_FAIL", "OUT_OF_MEMORY",
    "PREEMPTED", "REVOKED", "TIMEOUT"}
# Status of a run at which program.TRIES tasks were lost, by how the last of them ended. Other ends say nothing of the
# run (how the program itself fails its task sees): `interrupted`, done again by the next command.
STATUS = {"TIMEOUT": "time_limit", "DEADLINE": "time_limit", "OUT_OF_MEMORY": "memory_limit"}


def slurm(*words):
    """A command of Slurm; None where it does not answer."""
    try:
        return program.call(*words, timeout=120)
    except program.Late:
        return None


def said_by(ended):
    lines = (ended.stderr or ended.stdout).strip().splitlines() if ended else []
    return lines[-1][:300] if lines else "no answer"


def largest_array():
    """Tasks that one array may have (MaxArraySize)."""
    ended = slurm("scontrol", "show", "config")
    for line in ended.stdout.splitlines() if ended else ():
        key, _, value = line.partition("=")
        if key.strip() == "MaxArraySize":
            return max(1, int(value))
    raise ProgramError(f"Slurm does not answer (scontrol show config): {said_by(ended)}")


def indices(word):
    """Of the tasks that a line of squeue is about: 7, or 3-5,9%2 where they have not begun."""
    for part in word.partition("%")[0].split(","):
        first, _, last = part.partition("-")
        if first.isdigit():
            yield from range(int(first), int(last or first) + 1)


class Submission:
    """An array job: its chunks, and what is known of them."""
    def __init__(self, folder: Path):
        self.folder, self.name = folder, folder.name
        self.chunks = {}  # number: {run: job} of what is not done yet
        for file in folder.glob("*.json"):
            chunk = program.read_json(file)
            if chunk:  # else it was cut short, and never submitted
                self.chunks[int(file.stem)] = {job["asked"]["run"]: job for job in chunk["jobs"]}
        self.read = {}  # log: bytes
        self.states = {}  # number: how its task stands, as Slurm says
        self.gone = set()  # numbers of tasks that were over at the last look

    def look(self):
        """What tasks have said since the last time."""
        for log in self.folder.glob("*.log"):
            with contextlib.suppress(OSError):
                lines, self.read[log] = program.lines_of(log, self.read.get(log, 0))
                for line in lines:
                    if "record" in line:
                        # A task that is over by what Slurm says may still write.
                        self.chunks.get(int(log.name.partition(".")[0]), {}).pop(line["run"], None)
                    yield line

    def over(self):
        """Numbers of chunks whose task will do no more: all is done, or Slurm has said so twice (what a task wrote last
        may come late from another machine)."""
        ended = {n for n in self.chunks if self.states.get(n, "gone") in OVER | {"gone"}}
        twice, self.gone = ended & self.gone, ended
        return twice | {n for n, jobs in self.chunks.items() if not jobs}

    def close(self, ended=True):
        """Revokes it. Of one that is through only tasks that wait are taken from Slurm: the others end by
        themselves."""
        program.clear(self.folder)
        waiting = {"PENDING", LAUNCH_FAILED} & {*self.states.values()}
        if not ended or waiting:
            which = ["--state=PENDING"] if ended else []
            cancelled = slurm("scancel", "--quiet", f"--name={self.name}", *which)
            if cancelled is None or cancelled.returncode != 0:
                print(f"scancel --name={self.name} does not work ({said_by(cancelled)}); its tasks end by themselves",
                      file=sys.stderr)

    def said(self):
        """The end of what a task wrote that ended badly."""
        for file in sorted(self.folder.glob("*.out")):
            lines = file.read_text(errors="replace").strip().splitlines()
            if lines:
                return lines[-1][:300]
        return ""


def ask(submissions):
    """Has Slurm say how the tasks stand: whether it answered, and the answer in words for people."""
    found = {s.name: {} for s in submissions}
    ended = slurm("env", "SLURM_BITSTR_LEN=0", "squeue", "--noheader", "--array", "--states=all",
                  f"--name={','.join(found)}", "--format=%j|%K|%T|%r")
    if ended is None or ended.returncode != 0:
        return False, said_by(ended)
    count = collections.Counter()
    for line in ended.stdout.splitlines():
        name, numbers, state, reason = line.strip().split("|", 3)
        if state == "PENDING" and "launch failed" in reason:
            state = LAUNCH_FAILED
        for number in indices(numbers) if name in found else ():
            if found[name].get(number, "GONE") in OVER | {"GONE"}:
                found[name][number] = state
                if state not in OVER:
                    count["wait (" + reason + ")" if state == "PENDING" else "at work"] += 1
    for submission in submissions:
        submission.states = found[submission.name]
    return True, ", ".join(f"{n} {what}" for what, n in sorted(count.items()))


def end_of(submission, number):
    """How a task ended, by what Slurm remembers of it or its accounting, where there is one."""
    if number in submission.states:
        return submission.states[number]
    ended = slurm("sacct", "--allocations", "--noheader", "--parsable2", "--starttime=now-30days",
                  f"--name={submission.name}", "--format=JobID,State") if shutil.which("sacct") else None
    for line in ended.stdout.splitlines() if ended and ended.returncode == 0 else ():
        job, _, state = line.partition("|")
        if number in indices(job.partition("_")[2].strip("[]")):
            return state.split()[0]
    return "unknown to Slurm"


class Work:
    """The runs that are to do, and what has been heard of them."""
    def __init__(self, options, is_done, todo, count, done):
        self.options, self.is_done, self.count, self.done = options, is_done, count, done
        self.waiting = {job["asked"]["run"]: job for job in todo}
        self.folder = options.runs.resolve() / FOLDER
        self.begun = collections.Counter()  # run: how often it was begun, of those that are not done
        self.silent = collections.Counter()  # run: how many of its tasks ended without a word
        self.took = [0, 0.0]  # runs, s
        self.said = ("", -SAID_EVERY)  # how tasks stood when it was said last, and when that was
        self.submissions = []

    def adopt(self):
        """Submissions of earlier commands: one that is at work on what is wanted goes on, others end."""
        for folder in sorted(self.folder.iterdir()) if self.folder.exists() else ():
            if not folder.name.startswith("contactbench-") or "." in folder.name:
                shutil.rmtree(folder, ignore_errors=True)  # revoked already
                continue
            submission = Submission(folder)
            answers, words = ask([submission])
            if not answers:
                raise ProgramError(f"Slurm does not answer (squeue): {words}")
            for line in submission.look():
                if "record" not in line:
                    self.begun[line["run"]] += 1
                elif line["run"] in self.waiting and self.is_done(self.waiting[line["run"]]):
                    del self.waiting[line["run"]]
                    self.done(line["record"])
            left = {run: job for jobs in submission.chunks.values() for run, job in jobs.items()}
            alive = any(state not in OVER for state in submission.states.values())
            if alive and left and all(self.waiting.get(run) == job for run, job in left.items()):
                print(f"{len(left)} runs are with Slurm already ({submission.name}: {words})", flush=True)
                self.submissions.append(submission)
            else:
                submission.close(ended=not alive)

    def under_way(self):
        return {run for submission in self.submissions for jobs in submission.chunks.values() for run in jobs}

    def submit(self, jobs):
        """Gives jobs to Slurm, in chunks of every nth: neighbours take alike."""
        seconds = self.took[1] / self.took[0] if self.took[0] else GUESS_S
        each = self.options.chunk or min(max(1, int(WANTED_S / seconds)), math.ceil(len(jobs) / (self.count or 1)))
        tasks, most = math.ceil(len(jobs) / each), largest_array()
        if tasks > most:
            tasks = most
            print(f"more runs a task than asked for: an array of this Slurm has up to {most} tasks (MaxArraySize)")
        folder = self.folder / f"contactbench-{uuid.uuid4().hex[:8]}"
        folder.mkdir(parents=True)
        # Tasks that nobody waits for do all of their chunk.
        longest = None if self.options.chunk or self.options.submit_only else LONGEST_S
        for number in range(tasks):
            chunk = {"jobs": jobs[number::tasks], "seconds": longest}
            (folder / f"{number}.json").write_text(json.dumps(chunk))
        script = folder / "task.sh"
        command = shlex.join([sys.executable, str(Path(program.__file__).resolve())])
        script.write_text(f"#!/bin/sh\nexec {command} {shlex.quote(str(folder))}/$SLURM_ARRAY_TASK_ID.json\n")
        memory = math.ceil(max(job["memory_limit_mb"] for job in jobs)) + BESIDE_MB
        at_a_time = f"%{self.count}" if self.count else ""
        self.submissions.append(Submission(folder))  # whatever interrupts this
        ended = slurm("sbatch", "--parsable", f"--job-name={folder.name}", f"--array=0-{tasks - 1}{at_a_time}",
                      f"--output={folder}/%a.out", "--open-mode=append", "--ntasks=1", "--cpus-per-task=1",
                      f"--mem={memory}M", "--requeue", *shlex.split(self.options.slurm), script)
        if ended is None or ended.returncode != 0:
            self.submissions.pop().close(ended=ended is not None)
            raise ProgramError(f"sbatch takes no job: {said_by(ended)}. Options of sbatch go into --slurm")
        print(
            f"{len(jobs)} runs to Slurm: {tasks} tasks of up to {math.ceil(len(jobs) / tasks)} "
            f"(job {ended.stdout.strip()}, {folder.name})", flush=True)

    def hear(self, submission):
        for line in submission.look():
            run = line["run"]
            if "record" not in line:
                self.begun[run] += 1
                continue
            self.took = [self.took[0] + 1, self.took[1] + line["took_s"]]
            if self.waiting.pop(run, None):
                self.done(line["record"])

    def judge(self, submission):
        """What tasks left that will do no more is to be submitted again, or is a row of its own."""
        heard = {int(log.name.partition(".")[0]) for log in submission.read if submission.read[log]}
        for number in submission.over():
            left = submission.chunks.pop(number)
            end = end_of(submission, number) if left else ""
            for run in left:
                if run in self.waiting and self.begun[run] >= program.TRIES:
                    ended = program.not_run(STATUS.get(end, "interrupted"),
                                            f"{self.begun[run]} tasks of Slurm were lost at it; the last: {end}")
                    self.done(program.do(self.waiting.pop(run), None, ended=ended))
                self.silent[run] += number not in heard
                if self.silent[run] >= program.TRIES:
                    said = submission.said()
                    raise ProgramError(f"{program.TRIES} tasks of Slurm one after another did not begin their runs; "
                                       f"the last: {end}" + (f", and wrote: {said}" if said else ""))
            if left and end != "COMPLETED":
                print(f"task {number} of {submission.name} is lost ({end}): {len(left)} runs once more", flush=True)
        if not submission.chunks:
            submission.close()
            self.submissions.remove(submission)

    def say(self, words):
        before, at = self.said
        if words and words != before and time.monotonic() - at >= SAID_EVERY:
            self.said = words, time.monotonic()
            print(f"Slurm: {words}", flush=True)

    def do(self):
        pause = LOOKS[0]
        try:
            self.adopt()
            while self.waiting:
                under_way = self.under_way()
                rest = [job for run, job in self.waiting.items() if run not in under_way]
                if rest:
                    self.submit(rest)
                if self.options.submit_only:
                    print("the same command without --submit-only waits for them and gathers")
                    return
                time.sleep(pause)
                pause = min(1.5 * pause, LOOKS[1])
                answers, words = ask(self.submissions)
                self.say(words if answers else f"does not answer ({words}); waiting for it")
                for submission in [*self.submissions]:
                    self.hear(submission)
                    if answers:
                        self.judge(submission)
            for submission in self.submissions:
                submission.close()
        except BaseException:
            if self.submissions:
                print("cancels its jobs of Slurm", file=sys.stderr, flush=True)
            for submission in self.submissions:
                submission.close(ended=False)
            program.clear(self.folder)
            raise
        program.clear(self.folder)  # with what tasks of revoked submissions wrote before they ended


def engine(options, is_done):
    """As `sweep.local`. `is_done(job)`: whether its run is there already."""
    lacking = [name for name in NEEDED if not shutil.which(name)]
    if lacking:
        print(
            f"sweep: --engine slurm needs Slurm's commands ({', '.join(lacking)} not found): apt install slurm-client, "
            "on a machine that the cluster knows; without a cluster, --engine local or dask", file=sys.stderr)
        raise SystemExit(2)
    return lambda todo, count, done: Work(options, is_done, todo, count, done).do()
