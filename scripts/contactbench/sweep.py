"""Does the runs of sweep files (scenarios/sweeps/*.toml): every run a process of its own within limits, every end of it
a row with a typed status. What is finished is not done again, whatever interrupted the sweep; docs/sweeps.md says more.

  scripts/sweep.py scenarios/sweeps/paper.toml --profile quick --dry-run
  scripts/sweep.py scenarios/sweeps/*.toml --profile paper --jobs 8 --timed-alone
  scripts/sweep.py scenarios/sweeps/paper.toml --rerun crash --rerun time_limit
  scripts/sweep.py scenarios/sweeps/*.toml --profile paper --only 'grasp__mirtich*'
  scripts/sweep.py scenarios/sweeps/paper.toml --engine dask:tcp://head:8786
  scripts/sweep.py scenarios/sweeps/paper.toml --engine slurm --slurm "--partition=short --time=1:00:00"
"""
import contextlib
import csv
import fcntl
import fnmatch
import json
import os
import shlex
import signal
import sys
import tempfile
import time
from pathlib import Path

from . import program, references, slurm
from .gather import LIMITS, TABLES, gather, put_in_place, rows_of, settled
from .plan import plan
from .program import ProgramError


def arguments(words):
    parser = program.flags(__doc__)
    parser.add_argument("sweeps", nargs="+", type=Path, metavar="SWEEP.toml")
    parser.add_argument("--profile", default="", help="which of the files' profiles [the files' own settings]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--runs", type=Path, help="one folder a run [results/runs/PROFILE]")
    parser.add_argument("--out", type=Path, help="folder of runs.csv and manifest.json [results]")
    parser.add_argument("--references", type=Path,
                        help="folder of certified references (scripts/references.py) [OUT/references]")
    parser.add_argument(
        "--jobs", type=int, help="runs at a time, 0: one a core [1: timings are not disturbed; "
        "with --engine slurm as many as Slurm lets]")
    parser.add_argument("--timed-alone", action="store_true",
                        help="runs whose times count go one at a time, after the others went --jobs at a time")
    parser.add_argument(
        "--budget", type=float, metavar="HOURS",
        help="end after this time: what is not done by then is a row `time_limit`, done when the sweep goes on")
    parser.add_argument("--engine", default="local", help="local, dask (a cluster here), dask:ADDRESS, slurm [local]")
    parser.add_argument("--slurm", default="", metavar="OPTIONS",
                        help='of sbatch, for --engine slurm: "--partition=short --time=1:00:00"')
    parser.add_argument("--chunk", type=int, metavar="N",
                        help="runs that a task of Slurm does one after another [as many as take it minutes]")
    parser.add_argument("--submit-only", action="store_true",
                        help="give the runs to Slurm and end; the same command without it waits and gathers")
    parser.add_argument("--rerun", action="append", default=[], metavar="STATUS",
                        help="do runs with this status again (or `all`)")
    parser.add_argument("--keep", action="store_true",
                        help="keep finished runs although program or scene have changed since")
    parser.add_argument(
        "--only", action="append", default=[], metavar="PATTERN",
        help="do the runs and members with such names (*, ?), and put their rows in place of those in OUT's "
        "tables; all other rows stay, whatever program and machine they are of")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, and do nothing")
    parsed = parser.parse_intermixed_args(words)
    on_slurm = parsed.engine == "slurm"
    if parsed.jobs is None:
        parsed.jobs = 0 if on_slurm else 1
    if parsed.jobs < 0:
        parser.error("--jobs must not be negative")
    if not on_slurm and (parsed.slurm or parsed.chunk is not None or parsed.submit_only):
        parser.error("--slurm, --chunk and --submit-only are of --engine slurm")
    try:
        shlex.split(parsed.slurm)
    except ValueError as error:
        parser.error(f"--slurm: {error}")
    if parsed.chunk is not None and parsed.chunk < 1:
        parser.error("--chunk must be at least 1")
    if parsed.submit_only and parsed.timed_alone:
        parser.error("--timed-alone waits until the other runs are done: not with --submit-only")
    if parsed.only and parsed.budget is not None:
        parser.error("--only puts rows in place: not with --budget, whose rows of runs that were not begun say nothing")
    if parsed.budget is not None and not parsed.budget > 0:
        parser.error("--budget must be a positive number of hours")
    parsed.deadline = None if parsed.budget is None else time.time() + 3600 * parsed.budget
    parsed.jobs = parsed.jobs if on_slurm else parsed.jobs or os.cpu_count() or 1
    parsed.out = parsed.out or program.ROOT / "results"
    parsed.references = parsed.references or parsed.out / "references"
    parsed.runs = parsed.runs or program.ROOT / "results" / "runs" / (parsed.profile or "default")
    return parsed


def local(todo, count, done):
    """An engine, as is each of `dask` and `slurm.engine`: does the jobs, `count` at a time, and calls done(record) in
    this process after every run."""
    load = program.Load()
    with program.workers(count) as pool:
        for future in program.as_they_end([pool.submit(program.do, job, load) for job in todo]):
            done(future.result())


def dask(address, timed_alone=False):
    """Tasks of a Dask scheduler, its workers one run at a time each; without an address, a cluster on this machine.
    Workers need this folder and that of the runs under the same paths, and nothing but the standard library. With
    `timed_alone` the runs whose times count go one by one, however many workers there are."""
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
            alone = timed_alone and all(job["timed"] for job in todo)
            for some in [[job] for job in todo] if alone else [todo]:
                futures = [program.elsewhere(client, job, -number) for number, job in enumerate(some)]
                for future, ended in as_completed(futures, with_results=True, raise_errors=True):
                    if ended.returncode != 0:
                        raise ProgramError(f"a worker could not do a run: {ended.stderr.strip()[-500:]}")
                    done(json.loads(ended.stdout))
                    future.release()

    return engine


ENGINES = {  # name: what makes it of an address and the options
    "local": lambda address, options: local, "dask": lambda address, options: dask(address, options.timed_alone),
    "slurm": lambda address, options: slurm.engine(options, lambda job: is_done(job, options))}


def engine_of(options):
    kind, _, address = options.engine.partition(":")
    if kind not in ENGINES or address and kind != "dask":
        raise ProgramError(f"no engine '{options.engine}'; there are: local, dask, dask:SCHEDULER-ADDRESS, slurm")
    return ENGINES[kind](address, options)


def file_of(run, scenes):
    return run.file or scenes[run.scene]["file"]


def certified(runs, listed, options):
    """{(scene, parameters): its certified reference}, of those that have one."""
    scenes, found = program.scenes_of(listed), {}
    for run in runs:
        scene = run.scene, run.asked()["parameters"]
        if scene not in found:
            there = (options.references / f"{references.name_of(*scene)}.json").exists()
            found[scene] = there and references.read(options.references, *scene,
                                                     program.files_of(options.program, file_of(run, scenes), scene[1]))
    return {scene: known for scene, known in found.items() if known}


def jobs_of(runs, listed, options):
    """What `program.do` needs to know of each run."""
    path, scenes, statuses = str(Path(
        options.program).resolve()), program.scenes_of(listed), program.statuses_of(listed)
    return [
        program.job_of(run, path, run.file or f"{run.scene}.xml", file_of(run, scenes), options.runs.resolve(),
                       statuses, run.time_limit_s, run.memory_limit_mb, run.record_every, run.timed, options.deadline,
                       run.record_contacts) for run in runs]


def unchanged(record, job):
    """Whether program and scene (its own file or a robot's), and an engine, are those of the record. What a scene reads
    follows from the files that it read: the program is asked only where one of them is no longer there."""
    files, engine = record.get("files") or [], program.beside(job)
    if not files or not all(map(os.path.exists, files)) or not set(engine) <= set(files):
        files = [*program.files_of(job["program"], job["file"], job["asked"]["parameters"]), *engine]
    try:
        return record.get("key") == program.digest(job["program"], *files)
    except OSError:
        return False


def is_done(job, options):
    record = program.read_json(options.runs / job["asked"]["run"] / "run.json")
    if not isinstance(record, dict) or record.get("status") in program.AGAIN or record.get("flags") != job["flags"]:
        return False
    if {record["status"], "all"} & set(options.rerun) or not (options.keep or unchanged(record, job)):
        return False
    # A wider limit may change the end of a run that a limit cut; moments are wanted where they are not.
    if record["status"] in LIMITS and record["limits"] != [job["time_limit_s"], job["memory_limit_mb"]]:
        return False
    if job["record_contacts"] and not record.get("record_contacts"):
        return False
    # The time of a run counts only where it was warmed up and had no company; what says nothing of it was.
    if job["timed"] and not record.get("timed", True):
        return False
    every, has = job["record_every"], record["record_every"]
    return every == 0 or has > 0 and every % has == 0


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
        print(shlex.join(["contactbench", "run", job["scene"], *job["flags"]]))
    print(f"{len(todo)} of {len(jobs)} runs to do, {len(jobs) - len(todo)} there already", flush=True)
    return todo


def do_all(todo, engine, options):
    progress = Progress(len(todo))
    alone = [job for run, job in todo if options.timed_alone and run.timed]
    together = [job for run, job in todo if not (options.timed_alone and run.timed)]
    try:
        for some, count in ((together, options.jobs), (alone, 1)):
            # Slurm may still hold jobs where nothing is left to do.
            if some or not todo and options.engine == "slurm":
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
            if len(rows) == 2 and rows[0]["status"] not in LIMITS and not settled(rows[0], rows[1]):
                out += [run.as_member(n) for n in range(2, run.members + 1)]
    return sorted(out, key=lambda run: run.member)


def names_in(out):
    """Of the runs and members that have a row in the tables."""
    names = set()
    for file in TABLES:
        with contextlib.suppress(FileNotFoundError), open(out / file, newline="") as table:
            names |= {row["run"] for row in csv.DictReader(table)}
    return names


def sweep(options):
    try:
        listed = program.listed(options.program)
    except ProgramError as error:
        raise ProgramError(f"{error}. --program names another one") from None
    engine = engine_of(options)
    runs, missing = plan(options.sweeps, options.profile, listed)
    for name, reason in missing.items():
        print(f"{name} is left out: {reason}")
    known = certified(runs, listed, options)
    # Of each cell the first member of its ensemble; the others of those that this one does not settle.
    members = [run.as_member(1) for run in runs if run.repeat == 1 and run.members > 0]
    if options.only:
        there = names_in(options.out)
        members = [
            member for run in runs if run.repeat == 1 for member in map(run.as_member, range(1, run.members + 1))
            if member.name in there]
        runs, members = ([
            run for run in some if any(fnmatch.fnmatchcase(run.name, pattern) for pattern in options.only)]
                         for some in (runs, members))
        if not runs + members:
            raise ProgramError(f"no run of these sweeps is named like {' or '.join(options.only)}")
        made_by = (program.read_json(options.out / "manifest.json") or {}).get("profile")
        if made_by != options.profile:
            raise ProgramError(f"{options.out} is of the profile '{made_by}', not of '{options.profile}'")
        absent = [run.name for run in runs if run.name not in there]
        if absent:
            raise ProgramError(f"{options.out} has no row of {', '.join(absent)}: without --only the sweep writes all")
    if options.dry_run:
        to_do(runs + members, listed, options, show=True)
        return
    with only_one_sweep(options.runs):
        program.clear(options.runs / program.DOING)  # what a killed sweep left half done
        try:
            do_all(to_do(runs + members, listed, options), engine, options)
            if options.submit_only:
                return
            further = [] if options.only else unsettled(runs, options, known)
            if further:
                print(f"{len({run.cell for run in further})} cells differ with the last bits of their start or the "
                      "order of contacts: the rest of their ensembles")
                do_all(to_do(further, listed, options), engine, options)
                members += further
        finally:
            program.clear(options.runs / program.DOING)
        if options.only:
            put_in_place(runs, members, options.runs, options.out, known)
            return
        with os.scandir(options.runs) as entries:
            folders = {entry.name for entry in entries if entry.is_dir() and not entry.name.startswith(".")}
        stray = sorted(folders - {run.name for run in runs + members})
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
