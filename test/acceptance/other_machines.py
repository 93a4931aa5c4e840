#!/usr/bin/env python3
"""Sweeps by Slurm and by Dask while everything dies: scripts/test.sh --long.

usage: other_machines.py PROGRAM [--cells 400] [--kills 12] [--only slurm|dask] [--stub]

A sweep of many short cells is done on one machine, and by a Slurm of one node of its own (private_slurm.py; skipped where
slurmctld, slurmd or munge are not installed) and a Dask scheduler with two workers, where at random moments the sweep is
killed or interrupted, tasks, slurmd with all that it holds, slurmctld or workers are killed, and tasks are cancelled or
requeued. The same command again then ends with the same table but for times: no cell lost, none doubled, and few done twice.
Exits 1 where that does not hold. --stub: cells that a shell answers, to have 10,000 of them.
"""
import argparse
import collections
import csv
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import private_slurm
from contactbench.gather import TIMING

ROOT = Path(__file__).resolve().parents[2]
STALLED = 240  # s without a run begun
LOST = 3  # runs that a disturbance may have done once more, at most: two tasks, and one that was not yet known to be done


# What a shell does in place of the program: a good summary, with the cell's own number in it.
STUB = """[ "$1" != check ] || { echo "$2"; exit; }
out=${*##*--out }; out=${out%% *}; mu=${*##*mu=}; mu=${mu%% *}
mkdir -p "$out"
cat > "$out/summary.json" <<END
{"scenario": "sticking_box", "method": "newton", "status": "ok", "reason": null, "finished": true, "t_reached": 0.01,
 "options": {"step": 0.001, "duration": 0.01}, "errors": {"final_m": $mu}, "peak_memory_mb": 1.0,
 "time": {"total_s": 0, "dynamics_s": 0, "collision_s": 0, "assembly_s": 0, "solve_s": 0}}
END
"""


class Sweep:
    """A sweep into a folder of its own, by a program that counts its starts."""
    def __init__(self, top, name, options, cells, *words):
        self.top, self.starts, self.log = top / name, top / f"{name}.starts", open(top / f"{name}.log", "a")
        wrapped, ask = top / f"{name}.sh", f'exec {options.program} "$@"\n'
        wrapped.write_text(f'#!/bin/sh\n[ "$1" != run ] || echo "$*" >> {self.starts}\n' +
                           (f'[ "$1" != list ] || {ask}{STUB}' if options.stub else ask))
        wrapped.chmod(0o755)
        self.command = [sys.executable, "-B", str(ROOT / "scripts/sweep.py"), str(cells), "--program", str(wrapped), "--runs",
                        str(self.top / "runs"), "--out", str(self.top), *words]
        self.process = None

    def start(self):
        self.process = subprocess.Popen(self.command, stdout=self.log, stderr=self.log)

    def end(self, how):
        self.process.send_signal(how)
        return self.process.wait(timeout=120)

    def finish(self):
        """To the end by the same command, and once more: what it says then is left to do."""
        for _ in range(3):  # a cell at which three tasks were lost is a row `interrupted` until the next command
            subprocess.run(self.command, check=True, stdout=self.log, stderr=self.log)
            if not any(row["status"] == "interrupted" for row in self.table()):
                break
        start = time.monotonic()
        said = subprocess.run([*self.command, "--dry-run"], check=True, capture_output=True, text=True).stdout
        return said.strip().splitlines()[-1], time.monotonic() - start

    def table(self):
        with open(self.top / "runs.csv", newline="") as file:
            return [{c: v for c, v in row.items() if c not in TIMING} for row in csv.DictReader(file)]

    def started(self):
        return len(self.starts.read_text().splitlines()) if self.starts.exists() else 0


def disturb_slurm(slurm, sweep, chance, what):
    """One thing that goes wrong."""
    def tasks():
        said = slurm.call("squeue", "--noheader", "--array", "--states=RUNNING", "--format=%A").stdout.split()
        return [chance.choice(said)] if said else []

    if what in ("kill the sweep", "interrupt the sweep"):
        sweep.end(signal.SIGKILL if what == "kill the sweep" else signal.SIGTERM)
        sweep.start()
    elif what == "kill a task":
        for pid in slurm.steps()[:1]:
            for child in Path(f"/proc/{pid}/task").glob("*/children"):
                for one in private_slurm.read(child).split():
                    os.kill(int(one), signal.SIGKILL)
    elif what == "kill slurmd":  # its tasks live on
        slurm.kill("slurmd")
        time.sleep(1)
        slurm.start("slurmd")
    elif what == "kill the node":
        slurm.kill("slurmd")
        for pid in slurm.steps():
            os.kill(pid, signal.SIGKILL)
        time.sleep(1)
        slurm.start("slurmd")
    elif what == "kill slurmctld":
        slurm.kill("slurmctld")
        time.sleep(1)
        slurm.start("slurmctld")
    elif what == "cancel a task":
        for task in tasks():
            slurm.call("scancel", task)
    elif what == "requeue a task":
        for task in tasks():
            slurm.call("scontrol", "requeue", task)


SLURM = ("kill the sweep", "kill a task", "requeue a task", "cancel a task", "kill the node", "interrupt the sweep", "kill slurmd",
         "kill slurmctld")


def by_slurm(top, options, cells, chance):
    with private_slurm.PrivateSlurm(top / "private_slurm") as slurm:
        chunk = max(5, options.cells // 40)
        sweep = Sweep(top, "slurm", options, cells, "--engine", "slurm", "--chunk", str(chunk))
        return disturbed(sweep, options, chance, SLURM, lambda what: disturb_slurm(slurm, sweep, chance, what), slurm.resume, "Slurm")


def by_dask(top, options, cells, chance):
    port, folder = private_slurm.free_port(), top / "private_dask"
    folder.mkdir()
    address = f"tcp://127.0.0.1:{port}"

    def start(module, *words):
        return subprocess.Popen([sys.executable, "-m", f"distributed.cli.{module}", *words, "--no-dashboard"], cwd=folder,
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, "HOME": str(folder)})

    def worker():
        return start("dask_worker", address, "--nthreads", "1", "--no-nanny", "--local-directory", str(folder))

    scheduler = start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port))
    workers = [worker(), worker()]
    sweep = Sweep(top, "dask", options, cells, "--engine", f"dask:{address}")

    def disturb(what):
        if what == "kill a worker":
            workers[0].kill()
            workers[0].wait()
            workers[:] = [workers[1], worker()]
        else:
            sweep.end(signal.SIGKILL if what == "kill the sweep" else signal.SIGTERM)
            sweep.start()

    try:
        return disturbed(sweep, options, chance, ("kill the sweep", "kill a worker", "interrupt the sweep"), disturb, lambda: None, "Dask")
    finally:
        for process in (*workers, scheduler):
            process.terminate()
            process.wait(timeout=30)


def disturbed(sweep, options, chance, kinds, disturb, mend, by):
    """Disturbs it as often as asked, each kind in turn, in an order by chance; meanwhile `mend` does what people do who look
    after machines. Whatever hangs ends after STALLED."""
    start, done, left = time.monotonic(), collections.Counter(), []
    sweep.start()

    def wait(until):
        """Whether the sweep is still at work then."""
        before, since = -1, time.monotonic()
        while sweep.process.poll() is None and not until():
            if sweep.started() != before:
                before, since = sweep.started(), time.monotonic()
            if time.monotonic() - since > STALLED:
                sweep.end(signal.SIGTERM)
                raise RuntimeError(f"{by}: nothing was begun in {STALLED} s:\n{Path(sweep.log.name).read_text()[-3000:]}")
            mend()
            time.sleep(0.2)
        return sweep.process.poll() is None

    for number in range(options.kills):
        left = left or chance.sample(kinds, len(kinds))
        target = (number + chance.random()) / options.kills * options.cells * 0.9  # runs begun by then
        if not wait(lambda: sweep.started() >= target):  # pylint: disable=cell-var-from-loop
            if sweep.process.returncode == 0:
                break
            sweep.start()
        what = left.pop()
        disturb(what)
        done[what] += 1
    wait(lambda: False)
    said, again = sweep.finish()
    print(f"{by}: {options.cells} cells, {sum(done.values())} disturbances ({', '.join(f'{n} x {what}' for what, n in done.items())}) in "
          f"{time.monotonic() - start:.0f} s, exit code {sweep.process.returncode}; {sweep.started()} starts; again: {said} "
          f"({again:.1f} s)", flush=True)
    return sweep, sum(done.values())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--cells", type=int, default=400)
    parser.add_argument("--kills", type=int, default=12)
    parser.add_argument("--only", choices=("slurm", "dask"))
    parser.add_argument("--stub", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    options.program = str(Path(options.program).resolve())
    chance, faults = random.Random(options.seed), []
    ways = {"slurm": by_slurm, "dask": by_dask}
    if lacking := private_slurm.lacking():
        print(f"Slurm: skipped, {', '.join(lacking)} not installed (slurmctld, slurmd, munge, slurm-client)")
        del ways["slurm"]
    try:
        import distributed  # noqa: F401
    except ImportError:
        print("Dask: skipped, python3-distributed is not installed")
        del ways["dask"]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        top, cells = Path(folder), Path(folder) / "cells.toml"
        top.chmod(0o755)
        values = [round(0.7 + 1e-5 * n, 5) for n in range(options.cells)]
        cells.write_text('[[runs]]\nscene = "sticking_box"\nmethods = ["newton/uncapped"]\nduration = 0.01\nrecord_every = 0\n'
                         f"timed = false\ntime_limit_s = 60\nset.mu = {values}\n")
        start, calm = time.monotonic(), Sweep(top, "calm", options, cells, "--jobs", "2")
        calm.finish()
        print(f"one machine: {len(calm.table())} rows in {time.monotonic() - start:.0f} s", flush=True)
        for way in ways if not options.only else {*ways} & {options.only}:
            sweep, disturbances = ways[way](top, options, cells, chance)
            rows = sweep.table()
            names = collections.Counter(row["run"] for row in rows)
            if rows != calm.table():
                faults.append(f"{way}: another table: {len(rows)} rows, {max(names.values())} of one run at most")
            if {row["status"] for row in rows} != {"ok"}:
                faults.append(f"{way}: not every run is ok")
            if sweep.started() > options.cells + LOST * disturbances:
                faults.append(f"{way}: {sweep.started()} starts are too many")
            there = {f.name for f in (sweep.top / "runs").iterdir() if f.is_dir()}
            if there != set(names):
                faults.append(f"{way}: debris: {sorted(there - set(names))[:5]}")
            if faults:
                print((top / f"{way}.log").read_text()[-6000:])
    for fault in faults:
        print(f"FAULT: {fault}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
