#!/usr/bin/env python3
"""Does the runs of sweep files (scenarios/sweeps/*.toml): every run a process of its own within limits, every end of it a
row with a typed status. What is finished is not done again, whatever interrupted the sweep; docs/sweeps.md says more.

  scripts/sweep.py scenarios/sweeps/paper.toml --profile quick --dry-run
  scripts/sweep.py scenarios/sweeps/*.toml --profile paper --jobs 8 --timed-alone
  scripts/sweep.py scenarios/sweeps/paper.toml --rerun crash --rerun time_limit
  scripts/sweep.py scenarios/sweeps/paper.toml --engine dask:tcp://head:8786
"""
import argparse
import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import interpreter

interpreter.need("tomllib")
from sweeping import engines, gather, one, reference  # noqa: E402
from sweeping.plan import SweepError, plan, scene_names  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sweeps", nargs="+", type=Path, metavar="SWEEP.toml")
    parser.add_argument("--profile", default="", help="which of the files' profiles [the files' own settings]")
    parser.add_argument("--program", default=str(ROOT / "build/bin/contactbench"))
    parser.add_argument("--runs", type=Path, help="one folder a run [results/runs/PROFILE]")
    parser.add_argument("--out", type=Path, help="folder of runs.csv and manifest.json [results]")
    parser.add_argument("--references", type=Path, help="folder of certified references (scripts/references.py) [OUT/references]")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time, 0: one a core [1: timings are not disturbed]")
    parser.add_argument("--timed-alone", action="store_true",
                        help="runs whose times count go one at a time, after the others went --jobs at a time")
    parser.add_argument("--budget", type=float, metavar="HOURS",
                        help="end after this time: what is not done by then is a row `time_limit`, done when the sweep goes on")
    parser.add_argument("--engine", default="local", help="local, dask (a cluster here), dask:ADDRESS [local]")
    parser.add_argument("--rerun", action="append", default=[], metavar="STATUS", help="do runs with this status again (or `all`)")
    parser.add_argument("--keep", action="store_true", help="keep finished runs although program or scene have changed since")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, and do nothing")
    parsed = parser.parse_intermixed_args()
    if parsed.jobs < 0:
        parser.error("--jobs must not be negative")
    if parsed.budget is not None and not parsed.budget > 0:
        parser.error("--budget must be a positive number of hours")
    parsed.jobs = parsed.jobs or os.cpu_count() or 1
    parsed.out = parsed.out or ROOT / "results"
    parsed.references = parsed.references or parsed.out / "references"
    parsed.runs = parsed.runs or ROOT / "results" / "runs" / (parsed.profile or "default")
    return parsed


def scene_files(program, run, scenes):
    return reference.files_of(program, run.file or scenes[run.scene]["file"], run.asked()["parameters"])


def references_of(program, runs, listed, folder):
    """{(scene, parameters): its certified reference}, of those that have one."""
    scenes = scene_names(listed)
    asked = {(run.scene, run.asked()["parameters"]): run for run in runs}
    found = {scene: reference.read(folder, *scene, scene_files(program, run, scenes)) for scene, run in asked.items()}
    return {scene: known for scene, known in found.items() if known}


def program_list(program):
    try:
        ended = subprocess.run([program, "list", "--json"], check=True, capture_output=True, text=True, timeout=60)
        return json.loads(ended.stdout)
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        sys.exit(f"sweep: `{program} list --json` does not work: {error}. --program names another one")


def jobs_of(runs, listed, options):
    """What `one.do` needs to know of each run; `key` changes when program, scene (its own file or a robot's) or flags do."""
    program = str(Path(options.program).resolve())
    scenes = scene_names(listed)
    read = {run: scene_files(program, run, scenes) for run in runs}
    keys = {files: reference.digest(program, *files) for files in set(read.values())}
    statuses = [s["name"] for s in listed["statuses"]]
    deadline = None if options.budget is None else time.time() + 3600 * options.budget
    return [{"asked": run.asked(), "flags": run.flags(), "key": keys[read[run]], "program": program,
             "scene": run.file or f"{run.scene}.xml", "runs": str(options.runs.resolve()), "statuses": statuses,
             "timed": run.timed, "time_limit_s": run.time_limit_s,
             # The program keeps its own limit; the outer one is for a program that does not come back.
             "wall_limit_s": 1.2 * run.time_limit_s + 10, "memory_limit_mb": run.memory_limit_mb,
             "record_every": run.record_every, "deadline": deadline} for run in runs]


def is_done(job, options):
    record = one.read_json(options.runs / job["asked"]["run"] / "run.json")
    if not isinstance(record, dict) or record.get("status") in one.AGAIN or record.get("flags") != job["flags"]:
        return False
    if {record["status"], "all"} & set(options.rerun) or not (options.keep or record.get("key") == job["key"]):
        return False
    # A wider limit may change the end of a run that a limit cut; finer files are wanted where none or coarser ones are.
    if record["status"] in ("time_limit", "memory_limit") and record["limits"] != [job["time_limit_s"], job["memory_limit_mb"]]:
        return False
    every, has = job["record_every"], record["record_every"]
    return every == 0 or 0 < has <= every


class Progress:
    """A bar with the time left on a terminal (tqdm, where it is installed); else a line a run."""

    def __init__(self, total):
        self.total, self.number, self.start, self.bar = total, 0, time.monotonic(), None
        if sys.stderr.isatty():
            try:
                from tqdm import tqdm
                self.bar = tqdm(total=total, unit="run", smoothing=0.05, dynamic_ncols=True)
            except ImportError:
                pass

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
        print(f"[{self.number:{len(str(self.total))}}/{self.total}, {left:.0f} s left] {said}, {record['wall_s']:.1f} s{busy}",
              flush=True)

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


def main():
    options = arguments()
    listed = program_list(options.program)
    try:
        runs, missing = plan(options.sweeps, options.profile, listed)
        engine = engines.by_name(options.engine)
    except (SweepError, engines.EngineError) as error:
        sys.exit(f"sweep: {error}")
    for name, reason in missing.items():
        print(f"{name} is left out: {reason}")
    jobs = jobs_of(runs, listed, options)
    todo = [(run, job) for run, job in zip(runs, jobs) if not is_done(job, options)]
    if options.dry_run:
        for _, job in todo:
            print(" ".join(["contactbench", "run", job["scene"], *job["flags"]]))
        print(f"{len(todo)} of {len(jobs)} runs to do, {len(jobs) - len(todo)} there already")
        return

    lock = only_one_sweep(options.runs)
    shutil.rmtree(options.runs / one.DOING, ignore_errors=True)  # what a killed sweep left half done
    print(f"{len(todo)} of {len(jobs)} runs to do, {len(jobs) - len(todo)} there already", flush=True)
    progress = Progress(len(todo))
    alone = [job for run, job in todo if options.timed_alone and run.timed]
    together = [job for run, job in todo if not (options.timed_alone and run.timed)]
    try:
        for some, count in ((together, options.jobs), (alone, 1)):
            if some:
                engine(some, count, progress.done)
    except engines.EngineError as error:
        sys.exit(f"sweep: {error}")
    finally:
        progress.close()
        shutil.rmtree(options.runs / one.DOING, ignore_errors=True)
    wanted = {run.name for run in runs}
    stray = sorted(f.name for f in options.runs.iterdir() if f.is_dir() and f.name not in wanted)
    if stray:
        print(f"{len(stray)} folders are of no run of these sweeps and stay out of the tables: {', '.join(stray[:5])}")
    gather.gather(runs, missing, options.runs, options.out, [path.stem for path in options.sweeps], options.profile,
                  references_of(options.program, runs, listed, options.references))
    lock.close()


def interrupt(*_):
    raise KeyboardInterrupt


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, interrupt)
    try:
        main()
    except KeyboardInterrupt:
        print("\ninterrupted; the same command goes on from here", file=sys.stderr)
        sys.stderr.flush()
        os._exit(130)
