#!/usr/bin/env python3
"""Does the runs of scripts/runs.py, one at a time (they are timed), and goes on after a failure.

A run that is there already is not done again, unless the program or its flags are newer. Beside the files of a run lies
run.json: what was asked, the exit code and, where the program could not say it itself, the status.
"""
import argparse
import dataclasses
import json
import os
import subprocess
import sys
import time
from pathlib import Path

from runs import PROFILES, runs


def methods_of(program):
    """The program's own list of methods, each with the solvers that this build can use."""
    listed = json.loads(subprocess.run([program, "list", "--json"], check=True, capture_output=True, text=True).stdout)
    out = {(s["method"], s["name"]): s["unavailable"] for s in listed["solvers"] if s["unavailable"]}
    for (method, solver), reason in out.items():
        print(f"{method or 'LCP'}/{solver} is left out: {reason}")
    return [{**m, "solvers": [s for s in m["solvers"] if (m["name"], s) not in out], "choice": bool(m["solvers"])}
            for m in listed["methods"]]


def read(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return {}


def is_done(folder, flags, program, keep):
    record = read(folder / "run.json")
    if not record or record["flags"] != flags or record["status"] in ("interrupted", "write_failed"):
        return False
    return keep or (folder / "run.json").stat().st_mtime >= os.stat(program).st_mtime


def do(run, folder, flags, program, limit):
    """Runs the program; its status, or the one that its end shows where it left no summary."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in ("run.json", "summary.json"):
        (folder / old).unlink(missing_ok=True)
    command = [program, "run", f"{run.scene}.xml", *flags, "--out", str(folder), "--quiet"]
    start = time.monotonic()
    try:
        # The program keeps its own limit; the outer one is for a program that does not come back.
        ended = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, timeout=2 * limit + 60)
        code, said = ended.returncode, ended.stderr.strip()
    except subprocess.TimeoutExpired:
        code, said = -9, "did not come back; stopped from outside"
    summary = read(folder / "summary.json")
    status = summary.get("status") or {2: "input_error", -9: "time_limit"}.get(code, "crash")
    record = {"run": run.name, **dataclasses.asdict(run), "sets": dict(run.sets), "flags": flags, "exit_code": code,
              "wall_s": round(time.monotonic() - start, 3), "status": status,
              "reason": summary.get("reason") or (said.splitlines()[-1] if said and status != "ok" else "")}
    (folder / "run.json").write_text(json.dumps(record, indent=1) + "\n")
    return record


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--out", required=True, type=Path, help="folder of the runs")
    parser.add_argument("--profile", choices=sorted(PROFILES), default="quick")
    parser.add_argument("--keep", action="store_true", help="keep finished runs even where the program is newer")
    arguments = parser.parse_args()

    limit = PROFILES[arguments.profile]["time_limit"]
    todo = runs(arguments.profile, methods_of(arguments.program))
    wanted = {run.name for run in todo}
    kept = 0
    for number, run in enumerate(todo, start=1):
        folder = arguments.out / run.name
        flags = run.flags() + ["--time-limit", str(limit)]
        if is_done(folder, flags, arguments.program, arguments.keep):
            kept += 1
            continue
        print(f"[{number:3}/{len(todo)}] {run.name} ", end="", flush=True)
        record = do(run, folder, flags, arguments.program, limit)
        reason = f" ({record['reason']})" if record["reason"] else ""
        print(f"{record['status']}{reason}, {record['wall_s']:.1f} s", flush=True)
    if kept:
        print(f"{kept} of {len(todo)} runs were there already")
    stray = sorted(f.name for f in arguments.out.iterdir() if f.is_dir() and f.name not in wanted)
    if stray:
        print(f"{len(stray)} folders are of no run of this list and stay out of the tables: {', '.join(stray[:5])}")
    (arguments.out / "list.json").write_text(json.dumps([run.name for run in todo], indent=1) + "\n")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("\ninterrupted; the same command goes on from here")
        sys.exit(130)
