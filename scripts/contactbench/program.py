#!/usr/bin/env python3
"""The one place that starts processes. A run of a sweep is a process of its own, within limits, whatever the program
does: always one record with a typed status.

The program writes into a folder of its own under RUNS/.doing, which becomes RUNS/<name> by one rename when its record
(run.json) is complete. So a run is there whole or not at all, and a late writer of a killed sweep disturbs nobody. As a
script this reads a job as JSON from standard input and prints the record (Dask), or does the jobs of a file (Slurm).
Hence nothing but the standard library here.
"""
import argparse
import collections
import concurrent.futures
import contextlib
import ctypes
import errno
import functools
import hashlib
import json
import math
import os
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
import uuid
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DEFAULT = str(ROOT / "build/bin/contactbench")
TUNED = ROOT / "scenarios/engines/tuned.json"  # of engines, as scripts/engines.py tune finds them
DOING = ".doing"
TAIL = 1 << 16  # bytes of what a program says that are kept
FILE_LIMIT = 16 << 30  # bytes that one file of a run may have
WARM_UP = 0.1  # s, of a timed run done once before it counts: caches, clock and page tables are as it wants them
BUSY = 0.25  # cores that others may use before a run counts as disturbed
HEARD = 0.1  # s, the longest that a signal waits to be heard
TRIES = 3  # tasks of Slurm that may be lost at one run before it is left alone
AGAIN = ("interrupted", "write_failed")  # statuses that say nothing about the method: done again by themselves
PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None)
NO_MEMORY = re.compile(r"bad_alloc|out of memory|MemoryError|cannot allocate memory|std::length_error", re.IGNORECASE)

active = set()  # processes to be ended with the sweep
lock = threading.RLock()  # a signal may come while it is held, and what ends all takes it
over = threading.Event()  # the sweep is ended: nothing is started any more, and what was killed is no result


def read_json(path) -> dict | list | None:
    try:
        return json.loads(Path(path).read_text(errors="replace"))
    except (OSError, ValueError, RecursionError):
        return None


Late = subprocess.TimeoutExpired  # what `call` raises where a command takes longer than it may


class Ended(Exception):
    """The sweep was ended while this run was on its way."""


class ProgramError(Exception):
    """The program does not do what is asked of it: says why."""


def flags(doc: str | None) -> argparse.ArgumentParser:
    """The parser of a script, whose head is the help."""
    return argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)


def hold_to(flag: str, asked: list[str], known: list[str]) -> None:
    """Ends with 2 where a name is none of those that there are."""
    for name in asked:
        if name not in known:
            print(f"{flag} {name}: no such; there are {', '.join(known)}", file=sys.stderr)
            raise SystemExit(2)


def call(*words, timeout: float | None = None) -> subprocess.CompletedProcess:
    """Runs a command to its end: exit code (`returncode`), `stdout` and `stderr` as text. It ends with `workers`."""
    with lock:
        if over.is_set():
            raise Ended
        process = subprocess.Popen([str(w) for w in words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=dies_with(
                                       os.getpid()))
        active.add(process)
    with process:
        try:
            out, err = process.communicate(timeout=timeout)
        finally:
            end(process)  # what takes too long, and whatever it started in turn
            with lock:
                active.discard(process)
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


def run_words(program, scene, flags: list, out) -> list[str]:
    """The command of a run into the folder `out`."""
    return [str(w) for w in (program, "run", scene, *flags, "--out", out, "--quiet")]


def setting(pair: str) -> str:
    """NAME=VALUE without blanks, which mean nothing in a value and would part it in a table."""
    return "".join(pair.split())


def positive(text: str) -> float:
    """A flag's number that is finite and above zero."""
    value = float(text)
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}: must be a positive number")
    return value


def settings(pairs: list[str]) -> list[str]:
    """Flags of scene parameters given as NAME=VALUE."""
    return [word for pair in pairs for word in ("--set", pair)]


def listed(program) -> dict:
    """What the program says of itself: methods, solvers, scenarios, statuses."""
    try:
        ended = subprocess.run([program, "list", "--json"], check=True, capture_output=True, text=True, timeout=60)
        return json.loads(ended.stdout)
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        raise ProgramError(f"`{program} list --json` does not work: {error}") from None


def cpu() -> str:
    """Of this machine, as the program names it in a summary."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")


def version(program) -> str:
    """The commit that the program says it is of."""
    return next(iter(re.findall(r"git ([^;)]*)",
                                call(program, "--version").stdout)), "a program that said nothing of itself")


def scenes_of(said: dict) -> dict[str, dict]:
    return {s["name"].removesuffix(".xml"): s for s in said["scenarios"]}


def statuses_of(said: dict) -> list[str]:
    return [s["name"] for s in said["statuses"]]


def choices(said: dict, outside=(), unavailable=False) -> tuple[list[tuple], dict[str, str]]:
    """(method row, variant, solver) of everything this build has, or could have, in the order of its own list, but
    methods and solvers named `outside`; and what it has not: {method/solver: reason}."""
    out = {(s["method"], s["name"]): s["unavailable"] for s in said["solvers"]
           if s["unavailable"] and not {s["name"], s["method"]} & {*outside}}
    rows = [(method, variant, solver) for method in said["methods"] for solver in method["solvers"] or [""]
            if not {method["name"], solver} & {*outside} and (unavailable or (method["name"], solver) not in out)
            for variant in method["variants"] or [""]]
    return rows, {f"{method}/{solver}": reason for (method, solver), reason in out.items()}


@functools.cache
def files_of(program, file, parameters: str, timeout: float | None = None) -> tuple[str, ...]:
    """The files that a scene reads, of which the program knows: its own and those of its robots. Its own where it is
    refused, or does not come back."""
    try:
        ended = call(program, "check", file, "--files", *settings(parameters.split()), timeout=timeout)
    except (OSError, Late):
        return (str(file), )
    return tuple(ended.stdout.splitlines()) if ended.returncode == 0 else (str(file), )


def beside(job: dict) -> tuple[str, ...]:
    """What a run of an engine reads besides: its program, where contactbench looks for it (app/engines.cpp), and the
    knobs that were searched for."""
    engine, here = job["asked"].get("engine"), Path(job["program"]).resolve().parent
    if not engine:
        return ()
    own = os.environ.get("CONTACTBENCH_ENGINES")
    places = [*([Path(own)] if own else []), here, here.parent / "libexec/contactbench"]
    files = [place / f"contactbench-engine-{engine}" for place in places]
    found = [file for file in files if file.exists()][:1] + [TUNED] * ("tuned" in job["flags"] and TUNED.exists())
    return tuple(map(str, found))


def digest(*paths) -> str:
    """Of the bytes of files together. Each set of files is read once, until one of them is another."""
    return digest_of(
        tuple((str(path), at.st_mtime_ns, at.st_size, at.st_ino) for path, at in zip(paths, map(os.stat, paths))))


@functools.cache
def digest_of(files: tuple) -> str:
    return hashlib.sha256(b"".join(Path(path).read_bytes() for path, *_ in files)).hexdigest()[:16]


def read_vector(path: Path) -> list[float]:
    """The numbers of a Matrix Market array file with one column; none where there is no file."""
    lines = [line for line in path.read_text().splitlines()
             if line and not line.startswith("%")] if path.exists() else []
    return [float(line) for line in lines[1:]]


class Load:
    """How many cores others keep busy: the machine's busy time less that of this process and its finished children.

    The kernel counts in 10 ms, so nothing is said of less than a second; a short run is judged by the last second or
    so."""
    def __init__(self):
        self.samples = collections.deque(maxlen=4096)
        self.sample()

    def sample(self):
        try:
            with open("/proc/stat") as file:
                user, nice, system, _, _, irq, soft, steal = map(int, file.readline().split()[1:9])
        except (OSError, ValueError):
            return None
        own = sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        now = (time.monotonic(), (user + nice + system + irq + soft + steal) / os.sysconf("SC_CLK_TCK"), own)
        self.samples.append(now)
        return now

    def others(self, start: float) -> float | None:
        """Cores in use by others since `start` (or the last second, whichever is longer); None where it cannot be
        told."""
        now = self.sample()
        if now is None:
            return None
        before = [s for s in list(self.samples) if s[0] <= min(start, now[0] - 1.0)]
        if not before:
            return None
        span = now[0] - before[-1][0]
        return max(0.0, (now[1] - before[-1][1] - (now[2] - before[-1][2])) / span)


def addresses(memory_mb: float) -> int:
    """Bytes of address space of a program that may use so much memory: it holds more than what is in use; the program's
    own limit is the sharper one."""
    return int((2 * memory_mb + 256) * 2**20)


def dies_with(parent):
    """For the child, before it becomes the program."""
    def prepare():
        LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(127)

    return prepare


def limited(parent, memory_bytes):
    """For the child, before it becomes the program: dies with its parent, cannot eat the machine, leaves no core
    file."""
    dies = dies_with(parent)

    def prepare():
        dies()
        # A program with sanitizers does not start with such a limit.
        if os.environ.get("CONTACTBENCH_ADDRESS_SPACE") != "unlimited":
            resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
        resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_LIMIT, FILE_LIMIT))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    return prepare


def drain(pipe, tail):
    """Reads all that a program says and keeps the end of it, so that it neither blocks nor fills memory."""
    with pipe:
        while chunk := pipe.read1(TAIL):
            tail[:] = (tail + chunk)[-TAIL:]


def end(process):
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        pass


def end_all():
    over.set()
    with lock:
        for process in active:
            end(process)


def as_they_end(futures):
    """Futures of executors in the order in which they end. Whoever begins to wait just after a signal came hears of it
    when that wait ends, and so none here is long."""
    ended = queue.SimpleQueue()
    for future in futures:
        future.add_done_callback(ended.put)
    for _ in futures:
        future = None
        while future is None:
            with contextlib.suppress(queue.Empty):
                future = ended.get(timeout=HEARD)
        yield future


@contextlib.contextmanager
def workers(count):
    """Threads that do runs; where their block is left early nothing more is begun, and what runs ends."""
    with concurrent.futures.ThreadPoolExecutor(count) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            end_all()
            raise


def together(tasks: list) -> list:
    """What each of the tasks, functions whose times do not count, returns; as many run at a time as there are cores."""
    with workers(os.cpu_count() or 1) as pool:
        futures = [pool.submit(task) for task in tasks]
        for future in as_they_end(futures):
            future.result()  # or what it raised, as soon as it did
        return [future.result() for future in futures]


def execute(command: list[str], wall_limit: float, memory_bytes: int) -> tuple[int, bool, float, str]:
    """Exit code, whether it had to be stopped, peak memory in MB, and the end of what it said."""
    with lock:
        if over.is_set():
            raise Ended
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   start_new_session=True, preexec_fn=limited(os.getpid(), memory_bytes),
                                   env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
        active.add(process)
    tail, stopped = bytearray(), threading.Event()
    reader = threading.Thread(target=drain, args=(process.stderr, tail), daemon=True)
    reader.start()
    timer = threading.Timer(wall_limit, lambda: (stopped.set(), end(process)))
    timer.daemon = True
    timer.start()
    try:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    finally:
        timer.cancel()
        end(process)  # whatever it started in turn
        with lock:
            active.discard(process)
    reader.join(timeout=5)
    killed = stopped.is_set() and process.returncode == -signal.SIGKILL
    return process.returncode, killed, usage.ru_maxrss / 1024, bytes(tail).decode(errors="replace").strip()


def finite(value):
    """Whether all numbers of what JSON holds are."""
    if isinstance(value, (dict, list)):
        return all(map(finite, value.values() if isinstance(value, dict) else value))
    return not isinstance(value, float) or math.isfinite(value)


def fault_of(summary, job: dict) -> str:
    """Why a summary is none; empty for a good one."""
    if not isinstance(summary, dict):
        return "summary.json is no JSON object"
    if summary.get("status") not in job["statuses"]:
        return f"summary.json has no known status, but {summary.get('status')!r}"[:120]
    ended = summary.get("finished")
    if not isinstance(ended, bool) or ended != (summary["status"] in ("ok", "inaccurate")):
        return "summary.json contradicts itself on whether the run finished"
    if summary.get("scenario") != job["asked"]["scene"] or summary.get("method") != job["asked"]["method"]:
        return "summary.json is of another run"
    times = summary.get("time")
    parts = [
        times.get(f"{p}_s") if isinstance(times, dict) else None
        for p in ("dynamics", "collision", "assembly", "solve")]
    if not all(isinstance(p, (int, float)) and math.isfinite(p) for p in parts + [summary.get("t_reached")]):
        return "summary.json lacks its times"
    return "" if finite(summary) else "summary.json holds NaN or infinity"


def verdict(code, stopped, peak_mb, said, summary, job):
    """Status and reason of a run from what its end shows; the program's own word counts only where all fits
    together."""
    last = said.splitlines()[-1][:300] if said else ""
    if stopped:
        return "time_limit", f"did not come back within {job['wall_limit_s']:g} s; stopped from outside"
    fault = fault_of(summary, job)
    if not fault and code == (0 if summary["finished"] else 3):
        return summary["status"], summary.get("reason") or ""
    if code not in (0, 2, 3) and (NO_MEMORY.search(said) or peak_mb >= 0.9 * job["memory_limit_mb"]):
        return "memory_limit", f"died at {job['memory_limit_mb']:g} MB" + (f": {last}" if last else "")
    if code == 2:
        return "input_error", last or "exit code 2 without a message"
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
        return "crash", name + (f": {last}" if last else "")
    if code == 1:
        return "crash", last or "exit code 1 without a message"
    return "crash", f"garbage: {fault or 'exit code does not fit the summary'} (exit code {code})"


def watched(program, scene, flags: list, folder, statuses: list[str], wall_limit: float, memory_mb: float) -> tuple:
    """A run of a scene file into `folder`, recorded where the flags do not say otherwise: (status, reason, had to be
    stopped, summary or None)."""
    recorded = [] if "--record-every" in flags else ["--record-every", "1"]
    command = run_words(program, scene, [*flags, *recorded, "--memory-limit", memory_mb], folder)
    job = {
        "asked": {
            "scene": Path(scene).stem,
            "method": flags[flags.index("--engine" if "--engine" in flags else "--method") + 1]}, "statuses": statuses,
        "wall_limit_s": wall_limit, "memory_limit_mb": memory_mb}
    code, stopped, peak, said = execute(command, wall_limit, addresses(memory_mb))
    summary = read_json(Path(folder) / "summary.json")
    status, reason = verdict(code, stopped, peak, said, summary, job)
    return status, reason, stopped, None if fault_of(summary, job) else summary


def reached(folder: Path) -> float | None:
    """Simulated time in the last whole row of steps.csv, of a run that could not say it itself."""
    try:
        with open(folder / "steps.csv", "rb") as file:
            head = file.readline(1 << 16).decode(errors="replace").strip().split(",")
            file.seek(max(file.tell(), os.fstat(file.fileno()).st_size - TAIL))
            lines = file.read(TAIL).decode(errors="replace").split("\n")[:-1]
        t = float(lines[-1].split(",")[head.index("t")])
        return t if math.isfinite(t) else None
    except (OSError, ValueError, IndexError):
        return None


# Runs of a sweep.


def job_of(run, program, scene, file, runs, statuses, time_limit, memory_limit_mb=4096, record_every=1, timed=True,
           deadline=None, record_contacts=False):
    """What `do` needs to know of a run (plan.Run). The program keeps its own limit; the outer one is for one that does
    not come back."""
    return {
        "asked": run.asked(), "flags": run.flags(), "program": program, "scene": scene, "file": file, "runs": str(runs),
        "statuses": statuses, "timed": timed, "time_limit_s": time_limit, "wall_limit_s": 1.2 * time_limit + 10,
        "memory_limit_mb": memory_limit_mb, "record_every": record_every, "deadline": deadline,
        "record_contacts": record_contacts}


def within(job: dict, now: float) -> dict:
    """The job with no more time than its sweep has left (`deadline`, s since the epoch, or None)."""
    if job["deadline"] is None or job["deadline"] - now >= job["time_limit_s"]:
        return job
    left = round(max(0.0, job["deadline"] - now), 3)
    return {**job, "time_limit_s": left, "wall_limit_s": 1.2 * left + 10}


def do(job: dict, load: Load, doing: Path | None = None, ended: dict | None = None) -> dict:
    """Does one job of `job_of`; returns its record, which is then in RUNS/<name>/run.json too. `doing`: folder of what
    is half done [RUNS/.doing]; `ended`: how the run ended (`not_run`), of one that is not done."""
    runs, name = Path(job["runs"]), job["asked"]["run"]
    runs.mkdir(parents=True, exist_ok=True)
    job = within(job, time.time())
    if job["time_limit_s"] <= 0:
        ended = not_run("time_limit", "not begun: the time of the sweep was spent")
    scratch = begin(doing or runs / DOING, name)
    record = {
        **job["asked"], "flags": job["flags"], **read_by(job), "limits": [job["time_limit_s"], job["memory_limit_mb"]],
        "record_every": job["record_every"], "record_contacts": job["record_contacts"], "timed": job["timed"]}
    record |= ended or done(job, scratch, load)
    if over.is_set():
        raise Ended
    publish(record, scratch, runs / name)
    return record


def begin(doing: Path, name: str) -> Path:
    """A new folder in `doing` for a run, with its record, empty yet. What `doing` is in must be there: a submission
    that is revoked does not come back by this."""
    doing.mkdir(exist_ok=True)
    scratch = doing / f"{name}.{uuid.uuid4().hex[:12]}"
    scratch.mkdir()
    (scratch / "run.json").touch()
    return scratch


def read_by(job: dict) -> dict:
    """What a run reads: its scene's files (also a robot's), an engine's, and a key that changes when one of them or the
    program does."""
    own = files_of(job["program"], job["file"], job["asked"]["parameters"], job["wall_limit_s"])
    files = [*own, *beside(job)]
    try:
        return {"files": files, "key": digest(job["program"], *files)}
    except OSError:
        return {"files": files, "key": ""}  # the run will say what is not there


def not_run(status: str, reason: str) -> dict:
    return {
        "status": status, "reason": reason, "exit_code": None, "finished": False, "t_reached": None, "wall_s": 0.0,
        "peak_memory_mb": None, "other_cores": None, "busy": None}


def done(job: dict, scratch: Path, load: Load) -> dict:
    """Runs the program into `scratch`: how it ended, as fields of its record."""
    def command(out, limit):
        limits = ["--time-limit", f"{limit:g}", "--memory-limit", f"{job['memory_limit_mb']:g}"]
        kept = ["--record-contacts"] if job["record_contacts"] else []
        flags = [*job["flags"], "--record-every", job["record_every"], *kept, *limits]
        return run_words(job["program"], job["scene"], flags, out)

    memory, warm_up, start = addresses(job["memory_limit_mb"]), scratch / "warm_up", time.monotonic()
    try:
        if job["timed"]:
            execute(command(warm_up, min(WARM_UP, job["time_limit_s"])), 8 * WARM_UP, memory)
            start = time.monotonic()
        code, stopped, peak, said = execute(command(scratch, job["time_limit_s"]), job["wall_limit_s"], memory)
    except OSError as error:
        code, stopped, peak, said = 1, False, 0.0, f"{job['program']}: {error.strerror}"
    wall = time.monotonic() - start
    shutil.rmtree(warm_up, ignore_errors=True)
    others = load.others(start)
    if not job["timed"]:
        others = None  # it may have company of its own, and nobody reads its time
    summary = read_json(scratch / "summary.json")
    status, reason = verdict(code, stopped, peak, said, summary, job)
    trusted = not fault_of(summary, job) and status == summary["status"]
    if not trusted:
        # Nothing downstream may take such a file for a summary.
        (scratch / "summary.json").unlink(missing_ok=True)
    record = {"status": status, "reason": reason.replace(str(scratch), "."), "exit_code": code}
    record |= {"finished": status in ("ok", "inaccurate"), "t_reached": None if trusted else reached(scratch)}
    # What could not be started has no memory.
    record |= {"wall_s": round(wall, 4), "peak_memory_mb": round(peak, 2) or None}
    known = others is not None
    return record | {"other_cores": round(others, 3) if known else None, "busy": others > BUSY if known else None}


def publish(record, scratch, place):
    # "r+": where the folder was taken away (`clear`) and the program made another of its name, there is no record.
    with open(scratch / "run.json", "r+") as file:
        file.write(json.dumps(record, indent=1) + "\n")
        file.flush()
        os.fsync(file.fileno())
    old = scratch.with_name(scratch.name + ".old")
    while True:
        try:
            os.rename(place, old)
        except FileNotFoundError:
            pass
        try:
            os.rename(scratch, place)
            break
        except OSError as error:
            # Another task that does the same run was between the two: the last one stays.
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            shutil.rmtree(old, ignore_errors=True)
    shutil.rmtree(old, ignore_errors=True)


def clear(folder: Path) -> None:
    """Takes a folder away at once and then deletes it: who still writes into it finds no place, and publishes nothing
    that lacks a file."""
    away = folder.with_name(f"{folder.name}.away.{uuid.uuid4().hex[:12]}")
    try:
        os.rename(folder, away)
    except FileNotFoundError:
        pass
    for some in folder.parent.glob(f"{folder.name}.away.*"):
        shutil.rmtree(some, ignore_errors=True)


def elsewhere(client, job, priority):
    """A task of a Dask client that does a job. What is sent is a function of the standard library, so that workers need
    not import anything of ours."""
    return client.submit(subprocess.run, [sys.executable, str(Path(__file__).resolve())], input=json.dumps(job),
                         text=True, capture_output=True, pure=False, priority=priority, retries=2)


def lines_of(log: Path, start: int = 0) -> tuple[list[dict], int]:
    """What a task has said from byte `start` on, as whole lines, and where they end."""
    with open(log, "rb") as file:
        file.seek(start)
        said = file.read()
    whole = said[:said.rfind(b"\n") + 1]
    return [json.loads(line) for line in whole.splitlines()], start + len(whole)


def do_chunk(file: Path) -> None:
    """What an array task of Slurm does (slurm.py): the jobs of a file one after another, until its time is over or the
    file is gone. What it begins and the record of what it did stand in a log of this start alone; what an earlier start
    did is not done again, nor what TRIES of them were lost at."""
    chunk, begun, there = json.loads(file.read_text()), collections.Counter(), set()
    for log in file.parent.glob(f"{file.stem}.*.log"):
        for line in lines_of(log)[0]:
            begun[line["run"]] += "record" not in line
            there |= {line["run"]} if "record" in line else set()
    load, end = Load(), time.monotonic() + (chunk["seconds"] or math.inf)
    with open(file.with_suffix(f".{uuid.uuid4().hex[:12]}.log"), "w") as log:

        def say(**line):
            log.write(json.dumps(line) + "\n")
            log.flush()
            os.fsync(log.fileno())

        for job in chunk["jobs"]:
            name, start = job["asked"]["run"], time.monotonic()
            if name in there or begun[name] >= TRIES:
                continue
            if start > end or not file.exists():
                return
            say(run=name)
            try:
                record = do(job, load, file.parent / DOING)
            except FileNotFoundError:
                if file.exists():
                    raise
                return  # revoked
            say(run=name, record=record, took_s=round(time.monotonic() - start, 4))


if __name__ == "__main__":
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.signal(signal.SIGTERM, lambda *_: (end_all(), os._exit(143)))
    if sys.argv[1:]:
        do_chunk(Path(sys.argv[1]))
    else:
        json.dump(do(json.load(sys.stdin), Load()), sys.stdout)
