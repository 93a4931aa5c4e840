#!/usr/bin/env python3
"""The reproduction with the real program: scripts/test.sh --long.

usage: reproduction.py PROGRAM [--profile quick] [--sweep FILE ...] [--kills 20]

One sweep undisturbed; one killed with SIGKILL at random moments and started again each time; one given to a Dask cluster, and one
to Slurm. All end with the same table, but for times. The report made twice of the first and of the second is the same but for
its timing fields and the pictures that show times. Exits 1 where that does not hold.
"""
import argparse
import csv
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import private_slurm
from contactbench.gather import TIMING

ROOT = Path(__file__).resolve().parents[2]

LIMITS = ("time_limit", "memory_limit")
WITHOUT_TIMES = ("figure01", "figure05", "figure08", "figure10", "grasp_picture", "robot_picture")


def table(out, name="runs.csv"):
    with open(out / name, newline="") as file:
        rows = list(csv.DictReader(file))
    # How far a run comes before a limit depends on the machine.
    return [{c: v for c, v in row.items() if c not in TIMING} for row in rows if row["status"] not in LIMITS], rows


def cut(out):
    """Runs, and members of ensembles, that a limit of time or memory ended."""
    every = [row for name in ("runs.csv", "ensemble.csv") if (out / name).exists() for row in table(out, name)[1]]
    return {row["run"] for row in every if row["status"] in LIMITS}


def differences(a, b, at="report"):
    """Where two parts of reports differ."""
    if isinstance(a, dict) and isinstance(b, dict):
        return [place for key in a.keys() | b.keys() for place in differences(a.get(key), b.get(key), f"{at}/{key}")]
    return [] if a == b else [at]


def report(out):
    subprocess.run([sys.executable, "-B", ROOT / "scripts/report.py", "--results", out, "--runs", out / "runs"],
                   check=True)
    made = json.loads((out / "report.json").read_text())
    for section in made["sections"].values():
        del section["timing"], section["worth_of_timing"]
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--profile", default="quick")
    parser.add_argument("--sweep", nargs="+", type=Path, default=[ROOT / "scenarios/sweeps/paper.toml"])
    parser.add_argument("--kills", type=int, default=20)
    options = parser.parse_args()
    chance, faults = random.Random(5), []
    with tempfile.TemporaryDirectory() as folder:
        top = Path(folder)

        def command(out, *words):
            return [
                sys.executable, "-B",
                str(ROOT / "scripts/sweep.py"), *map(str, options.sweep), "--profile", options.profile, "--program",
                options.program, "--runs",
                str(top / out / "runs"), "--out",
                str(top / out), *words]

        start = time.monotonic()
        subprocess.run(command("calm"), check=True, stdout=subprocess.DEVNULL)
        took = time.monotonic() - start
        kills = 0
        for _ in range(options.kills):
            process = subprocess.Popen(command("killed"), stdout=subprocess.DEVNULL)
            time.sleep(chance.uniform(0.2, 1.6 * took / options.kills))
            process.send_signal(signal.SIGKILL)
            kills += process.wait() == -signal.SIGKILL
        subprocess.run(command("killed"), check=True, stdout=subprocess.DEVNULL)
        outs = {"calm": "undisturbed", "killed": f"killed {kills} times"}
        try:
            import distributed  # noqa: F401
            subprocess.run(command("dask", "--engine", "dask", "--jobs", "2"), check=True, stdout=subprocess.DEVNULL)
            outs["dask"] = "by Dask"
        except ImportError:
            print("Dask: skipped, python3-distributed is not installed")
        if lacking := private_slurm.lacking():
            print(f"Slurm: skipped, {', '.join(lacking)} not installed")
        else:
            with private_slurm.PrivateSlurm(top / "private_slurm"):
                subprocess.run(command("slurm", "--engine", "slurm"), check=True, stdout=subprocess.DEVNULL)
            outs["slurm"] = "by Slurm"
        calm, all_rows = table(top / "calm")
        names = [row["run"] for row in all_rows]
        for out, said in outs.items():
            rows, every = table(top / out)
            known = {row["run"]: row for row in rows}
            different = [row["run"] for row in calm if row["run"] in known and known[row["run"]] != row]
            if [row["run"] for row in every] != names or different:
                faults.append(f"{said}: another table: {', '.join(different[:5]) or 'other rows'}")
            print(f"{said}: {len(every)} rows, {len(different)} differ from the undisturbed sweep's")
        # What shows those that a limit cut shows how fast the machine was: they are the same ones for both reports.
        for run in cut(top / "calm") | cut(top / "killed"):
            shutil.rmtree(top / "killed/runs" / run, ignore_errors=True)
            if (top / "calm/runs" / run).exists():  # not a member that only the other sweep had need of
                shutil.copytree(top / "calm/runs" / run, top / "killed/runs" / run)
        subprocess.run(command("killed"), check=True, stdout=subprocess.DEVNULL)
        places = sorted(differences(report(top / "calm"), report(top / "killed")))
        if places:
            faults.append(f"the report made of the second sweep differs in more than times: {', '.join(places[:5])}")
        for name in WITHOUT_TIMES:
            pictures = [(top / out / "figures" / f"{name}.svg") for out in ("calm", "killed")]
            if pictures[0].exists() and pictures[0].read_bytes() != pictures[1].read_bytes():
                faults.append(f"{name}, which shows no times, differs")
    for fault in faults:
        print(f"FAULT: {fault}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
