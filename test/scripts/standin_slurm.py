"""A stand-in for Slurm's commands (one file, called by their names), whose tasks run one after another on this machine and
can be told what becomes of them: FATES in its folder, one for each task that begins, the rest well."""
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

COMMANDS = ("sbatch", "squeue", "scancel", "scontrol", "sacct")


def write(folder, largest=4):
    """Puts the commands into a folder, which then is first in PATH."""
    folder.mkdir()
    for name in COMMANDS:
        command = folder / name
        command.write_text(f"#!/bin/sh\nexec {sys.executable} -S {Path(__file__).resolve()} {folder} {name} \"$@\"\n")
        command.chmod(0o755)
    (folder / "config").write_text(f"Configuration data\nMaxArraySize            = {largest}\nMaxDBDMsgs = 20\n")
    return folder


def flag(words, name):
    return next((w.split("=", 1)[1] for w in words if w.startswith(f"--{name}=")), "")


def tasks(folder, name):
    return sorted(folder.glob(f"{name}.task*"), key=lambda path: int(path.name.rsplit("task", 1)[1]))


def number(task):
    return task.name.rsplit("task", 1)[1]


def say(task, state, reason="None"):
    new = task.with_name(f"new.{task.name}")
    new.write_text(f"{state}|{reason}")
    os.rename(new, task)


def fate(folder):
    """Of the next task that begins."""
    fates = json.loads((folder / "FATES").read_text()) if (folder / "FATES").exists() else []
    if fates:
        (folder / "FATES").write_text(json.dumps(fates[1:]))
    return fates[0] if fates else "well"


def begin(task, script, out):
    return subprocess.Popen(["sh", script], env={**os.environ, "SLURM_ARRAY_TASK_ID": number(task)}, start_new_session=True,
                            stdout=open(out.replace("%a", number(task)), "a"), stderr=subprocess.STDOUT)


def run(folder, name, script, out):
    """All tasks of a job."""
    for task in tasks(folder, name):
        if not task.read_text().startswith("PENDING"):
            continue
        what = fate(folder)
        if what == "held":
            say(task, "PENDING", "launch failed requeued held")
            continue
        if what == "silent":
            Path(out.replace("%a", number(task))).write_text("no such python here\n")
            say(task, "FAILED")
            continue
        say(task, "RUNNING")
        processes = [begin(task, script, out) for _ in range(2 if what == "twice" else 1)]
        end = time.monotonic() + (60 if what in ("well", "twice") else float(os.environ.get("KILLED_AFTER", "0.5")))
        while any(p.poll() is None for p in processes) and time.monotonic() < end and task.read_text().startswith("RUNNING"):
            time.sleep(0.02)
        for process in processes:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        if what == "forgotten":
            with open(folder / "ended", "a") as ended:
                ended.write(f"{name}|7_{number(task)}|CANCELLED by 0\n")
            task.unlink()
        elif task.read_text().startswith("RUNNING"):
            say(task, "COMPLETED" if what in ("well", "twice") else what)


def main(folder, command, words):
    if command == "sbatch":
        with open(folder / "sbatch.log", "a") as log:
            log.write(" ".join(words) + "\n")
        if flag(words, "partition") == "nowhere":
            sys.exit("sbatch: error: invalid partition specified: nowhere")
        name, last = flag(words, "job-name"), int(flag(words, "array").partition("%")[0].split("-")[1])
        for n in range(last + 1):
            say(folder / f"{name}.task{n}", "PENDING", "Resources")
        subprocess.Popen([sys.executable, "-S", __file__, folder, "run", name, words[-1], flag(words, "output")], start_new_session=True,
                         stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        print(7)
    elif command == "run":
        run(folder, *words)
    elif command == "squeue":
        for name in flag(words, "name").split(","):
            for task in tasks(folder, name):
                print(f"{name}|{number(task)}|{task.read_text()}")
    elif command == "scancel":
        for task in tasks(folder, flag(words, "name")):
            state = task.read_text().split("|")[0]
            if state == (flag(words, "state") or state) and state in ("PENDING", "RUNNING"):
                say(task, "CANCELLED")
    elif command == "scontrol":
        print((folder / "config").read_text())
    elif command == "sacct" and (folder / "ended").exists():
        for line in (folder / "ended").read_text().splitlines():
            if line.startswith(flag(words, "name") + "|"):
                print(line.split("|", 1)[1])


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], sys.argv[3:])
