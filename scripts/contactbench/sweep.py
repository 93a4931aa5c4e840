"""Does the runs of sweep files (scenarios/sweeps/*.toml): every run a process of its own within limits, every end of it
a row with a typed status. What is finished is not done again, whatever interrupted the sweep; docs/sweeps.md says more.

  scripts/sweep.py scenarios/sweeps/paper.toml --profile quick --dry-run
  scripts/sweep.py scenarios/sweeps/*.toml --profile paper --jobs 8 --timed-alone
  scripts/sweep.py scenarios/sweeps/paper.toml --rerun crash --rerun time_limit
  scripts/sweep.py scenarios/sweeps/paper.toml --engine dask:tcp://head:8786
"""
import concurrent.futures
import contextlib
import fcntl
import json
import os
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

from . import program, references, worth
from .plan import plan
from .program import ProgramError
from .runs import LIMITS, gather, rows_of


def arguments(words):
    parser = program.flags(__doc__)
    parser.add_argument("sweeps", nargs="+", type=Path, metavar="SWEEP.toml")
    parser.add_argument("--profile", default="", help="which of the files' profiles [the files' own settings]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--runs", type=Path, help="one folder a run [results/runs/PROFILE]")
    parser.add_argument("--out", type=Path, help="folder of runs.csv and manifest.json [results]")
    parser.add_argument("--references", type=Path,
                        help="folder of certified references (scripts/references.py) [OUT/references]")
    parser.add_argument("--jobs", type=int, default=1,
                        help="runs at a time, 0: one a core [1: timings are not disturbed]")
    parser.add_argument("--timed-alone", action="store_true",
                        help="runs whose times count go one at a time, after the others went --jobs at a time")
    parser.add_argument(
        "--budget", type=float, metavar="HOURS",
        help="end after this time: what is not done by then is a row `time_limit`, done when the sweep goes on")
    parser.add_argument("--engine", default="local", help="local, dask (a cluster here), dask:ADDRESS [local]")
    parser.add_argument("--rerun", action="append", default=[], metavar="STATUS",
                        help="do runs with this status again (or `all`)")
    parser.add_argument("--keep", action="store_true",
                        help="keep finished runs although program or scene have changed since")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, and do nothing")
    parsed = parser.parse_intermixed_args(words)
    if parsed.jobs < 0:
        parser.error("--jobs must not be negative")
    if parsed.budget is not None and not parsed.budget > 0:
        parser.error("--budget must be a positive number of hours")
    parsed.deadline = None if parsed.budget is None else time.time() + 3600 * parsed.budget
    parsed.jobs = parsed.jobs or os.cpu_count() or 1
    parsed.out = parsed.out or program.ROOT / "results"
    parsed.references = parsed.references or parsed.out / "references"
    parsed.runs = parsed.runs or program.ROOT / "results" / "runs" / (parsed.profile or "default")
    return parsed


def local(todo, count, done):
    """An engine, as is each of `dask`: does the jobs, `count` at a time, and calls done(record) in this process after
    every run."""
    load = program.Load()
    with concurrent.futures.ThreadPoolExecutor(count) as pool:
        try:
            for future in concurrent.futures.as_completed([pool.submit(program.do, job, load) for job in todo]):
                done(future.result())
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            program.end_all()
            raise


def dask(address):
    """Tasks of a Dask scheduler, its workers one run at a time each; without an address, a cluster on this machine.
    Workers need this folder and that of the runs under the same paths, and nothing but the standard library."""
    def engine(todo, count, done):
        try:
            from distributed import Client, LocalCluster, as_completed
        except ImportError as error:
            raise ProgramError(f"--engine dask needs Dask ({error}): apt install python3-distributed") from None
        # A cluster of our own lives in this process' folder of temporary files and prints nothing but faults.
        with contextlib.ExitStack() as stack:
            if not address:
                scratch = stack.enter_context(tempfile.TemporaryDirectory())
                cluster = stack.enter_context(
                    LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None, local_directory=scratch,
                                 silence_logs=50))
            try:
                client = stack.enter_context(Client(address or cluster, timeout="30s"))
            except OSError as error:
                raise ProgramError(f"no Dask scheduler answers at {address}: {error}") from None
            futures = [program.elsewhere(client, job, -number) for number, job in enumerate(todo)]
            for future, ended in as_completed(futures, with_results=True, raise_errors=True):
                if ended.returncode != 0:
                    raise ProgramError(f"a worker could not do a run: {ended.stderr.strip()[-500:]}")
                done(json.loads(ended.stdout))
                future.release()

    return engine


def engine_of(name):
    kind, _, address = name.partition(":")
    if kind == "dask":
        return dask(address)
    if kind == "local" and not address:
        return local
    raise ProgramError(f"no engine '{name}'; there are: local, dask, dask:SCHEDULER-ADDRESS")


def files_of(options, scenes, run):
    return program.files_of(options.program, run.file or scenes[run.scene]["file"], run.asked()["parameters"])


def certified(runs, listed, options):
    """{(scene, parameters): its certified reference}, of those that have one."""
    asked = {(run.scene, run.asked()["parameters"]): run for run in runs}
    found = {
        scene: references.read(options.references, *scene, files_of(options, program.scenes_of(listed), run))
        for scene, run in asked.items()}
    return {scene: known for scene, known in found.items() if known}


def jobs_of(runs, listed, options):
    """What `program.do` needs to know of each run; `key` changes when program, scene (its own file or a robot's) or
    flags do."""
    path, scenes = str(Path(options.program).resolve()), program.scenes_of(listed)
    read = {run: files_of(options, scenes, run) for run in runs}
    keys = {files: references.digest(path, *files) for files in set(read.values())}
    return [
        program.job_of(run, path, run.file or f"{run.scene}.xml", options.runs.resolve(), program.statuses_of(listed),
                       run.time_limit_s, run.memory_limit_mb, run.record_every, run.timed, keys[read[run]],
                       options.deadline, run.record_contacts) for run in runs]


def is_done(job, options):
    record = program.read_json(options.runs / job["asked"]["run"] / "run.json")
    if not isinstance(record, dict) or record.get("status") in program.AGAIN or record.get("flags") != job["flags"]:
        return False
    if {record["status"], "all"} & set(options.rerun) or not (options.keep or record.get("key") == job["key"]):
        return False
    # A wider limit may change the end of a run that a limit cut; finer files are wanted where none or coarser ones are.
    if record["status"] in LIMITS and record["limits"] != [job["time_limit_s"], job["memory_limit_mb"]]:
        return False
    if job["record_contacts"] and not record.get("record_contacts"):
        return False
    every, has = job["record_every"], record["record_every"]
    return every == 0 or 0 < has <= every


class Progress:
    """A bar with the time left on a terminal (tqdm, where it is installed); else a line a run."""
    def __init__(self, total):
        self.total, self.number, self.start, self.bar = total, 0, time.monotonic(), None
        if sys.stderr.isatty():
            with contextlib.suppress(ImportError):
                from tqdm import tqdm
                self.bar = tqdm(total=total, unit="run", smoothing=0.05, dynamic_ncols=True)

    def done(self, record):
        self.number += 1
        said = f"{record['run']} {record['status']}" + (f" ({record['reason']})" if record["reason"] else "")
        if self.bar is not None:
            if record["status"] != "ok":
                self.bar.write(said)
            self.bar.update()
            return
        left = (time.monotonic() - self.start) / self.number * (self.total - self.number)
        busy = ", machine busy" if record["busy"] else ""
        done = f"{self.number:{len(str(self.total))}}/{self.total}"
        print(f"[{done}, {left:.0f} s left] {said}, {record['wall_s']:.1f} s{busy}", flush=True)

    def close(self):
        if self.bar is not None:
            self.bar.close()


def only_one_sweep(runs):
    """The folder of runs belongs to one sweep at a time; the lock goes with the process, however that ends."""
    runs.mkdir(parents=True, exist_ok=True)
    lock = open(runs / ".lock", "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        sys.exit(f"sweep: another sweep is at work in {runs}")
    return lock


def to_do(runs, listed, options, show=False):
    """[(run, job)] of those that are not done."""
    jobs = jobs_of(runs, listed, options)
    todo = [(run, job) for run, job in zip(runs, jobs) if not is_done(job, options)]
    for _, job in todo if show else ():
        print(" ".join(["contactbench", "run", job["scene"], *job["flags"]]))
    print(f"{len(todo)} of {len(jobs)} runs to do, {len(jobs) - len(todo)} there already", flush=True)
    return todo


def do_all(todo, engine, options):
    progress = Progress(len(todo))
    alone = [job for run, job in todo if options.timed_alone and run.timed]
    together = [job for run, job in todo if not (options.timed_alone and run.timed)]
    try:
        for some, count in ((together, options.jobs), (alone, 1)):
            if some:
                engine(some, count, progress.done)
    finally:
        progress.close()


def unsettled(runs, options, known):
    """The further members of the cells whose first one came to something else than the run, but for those that a limit
    cut."""
    out = []
    for run in runs:
        if run.repeat == 1 and run.members > 1:
            rows, _ = rows_of([run, run.as_member(1)], options.runs, known)
            if len(rows) == 2 and rows[0]["status"] not in LIMITS and not worth.settled(rows[0], rows[1]):
                out += [run.as_member(n) for n in range(2, run.members + 1)]
    return sorted(out, key=lambda run: run.member)


def sweep(options):
    try:
        listed = program.listed(options.program)
    except ProgramError as error:
        raise ProgramError(f"{error}. --program names another one") from None
    runs, missing = plan(options.sweeps, options.profile, listed)
    engine = engine_of(options.engine)
    for name, reason in missing.items():
        print(f"{name} is left out: {reason}")
    known = certified(runs, listed, options)
    # Of each cell the first member of its ensemble; the others of those that this one does not settle.
    members = [run.as_member(1) for run in runs if run.repeat == 1 and run.members > 0]
    if options.dry_run:
        to_do(runs + members, listed, options, show=True)
        return
    with only_one_sweep(options.runs):
        shutil.rmtree(options.runs / program.DOING, ignore_errors=True)  # what a killed sweep left half done
        try:
            do_all(to_do(runs + members, listed, options), engine, options)
            further = unsettled(runs, options, known)
            if further:
                print(f"{len({run.cell for run in further})} cells differ with the last bits of their start or the "
                      "order of contacts: the rest of their ensembles")
                do_all(to_do(further, listed, options), engine, options)
                members += further
        finally:
            shutil.rmtree(options.runs / program.DOING, ignore_errors=True)
        stray = sorted({f.name for f in options.runs.iterdir() if f.is_dir()} - {run.name for run in runs + members})
        if stray:
            print(
                f"{len(stray)} folders are of no run of these sweeps and stay out of the tables: {', '.join(stray[:5])}"
            )
        gather(runs, members, missing, options.runs, options.out, [path.stem for path in options.sweeps],
               options.profile, known)


def interrupt(*_):
    raise KeyboardInterrupt


def main():
    signal.signal(signal.SIGTERM, interrupt)
    try:
        sweep(arguments(None))
    except KeyboardInterrupt:
        print("\ninterrupted; the same command goes on from here", file=sys.stderr, flush=True)
        os._exit(130)
