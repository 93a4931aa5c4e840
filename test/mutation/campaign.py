#!/usr/bin/env python3
"""Do the tests notice? Plants one small fault at a time in a copy of the tree, builds it, and runs the tests: those of the
fault's own room first, all of them where these pass.

  test/mutation/campaign.py                       the whole campaign (hours)
  test/mutation/campaign.py --room contact        the faults of one room
  test/mutation/campaign.py --id referee-holds    one fault
  test/mutation/campaign.py --list                the faults, without running anything

Faults are the rows of mutants.toml, written by people who read the code, and as many again drawn by generate.py, so that
nobody plants only what is tested. A fault is killed where a test fails or does not come back; a survivor is a gap in the
tests, or changes nothing that the program promises, and then its row says why (`equivalent`).

Results: FOLDER/mutants.csv, a row a fault, and a table by room on standard output. The same command goes on after an
interruption; rows of an older tree are done again. Exit code 1 where a fault survives without a reason, or an
`equivalent` one is killed.
"""
import argparse
import collections
import csv
import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import generate

ROOT = Path(__file__).resolve().parents[2]
TABLE = Path(__file__).with_name("mutants.toml")
COLUMNS = ["id", "room", "file", "what", "outcome", "killed_by", "seconds", "equivalent", "from", "to", "tree"]
PATIENCE = 4          # times what the tests take undisturbed: a fault that makes them hang longer is killed
LEAST_PATIENCE = 60   # s
NEAREST = {"app": "program|wrong_methods", "scripts": "scripts_|replay"}  # else the room's own test
# Tests that look at the text of the sources and not at what the program does would kill any fault that breaks a line.
APART = "rooms|fuzz|convex_peer"


def room_of(file):
    parts = Path(file).parts
    return parts[1] if parts[0] == "lib" else parts[0]


def written(path=TABLE):
    faults = tomllib.loads(path.read_text())["mutant"]
    for fault in faults:
        fault.setdefault("equivalent", "")
        fault["room"] = room_of(fault["file"])
    return faults


def plant(tree, fault):
    """Writes the fault into the tree; returns what puts the file right again. A row that no longer fits is an error."""
    path = tree / fault["file"]
    text = path.read_text()
    at = [i for i in range(len(text)) if text.startswith(fault["from"], i)]
    if "offset" in fault:
        at = [i for i in at if i == fault["offset"]]
    if len(at) != 1:
        raise SystemExit(f"{TABLE.name}: {fault['id']}: its text is {len(at)} times in {fault['file']}; it must be there once")
    path.write_text(text[: at[0]] + fault["to"] + text[at[0] + len(fault["from"]) :])
    return lambda: path.write_text(text)


class Copy:
    """A scratch copy of the tracked files, with a build of its own."""

    def __init__(self, folder, jobs):
        self.tree, self.build, self.jobs = folder / "tree", folder / "build", str(jobs)
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode().split("\0")
        self.files = [f for f in listed if f and (ROOT / f).is_file() and not f.startswith("results/")]
        for name in self.files:
            target = self.tree / name
            if target.exists() and target.read_bytes() == (ROOT / name).read_bytes():
                continue  # its time stamp stays, and with it what was built
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, target)
            shutil.copymode(ROOT / name, target)
        digest = hashlib.sha256()
        for name in sorted(self.files):
            if name.startswith(("lib/", "app/", "test/", "scripts/", "scenarios/", "CMake")) and not name.startswith("test/mutation/"):
                digest.update(name.encode() + (ROOT / name).read_bytes())
        self.digest = digest.hexdigest()[:16]

    def call(self, command, timeout=None):
        """Exit code, what it printed; None where it did not come back."""
        process = subprocess.Popen(command, cwd=self.tree, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
        try:
            said, _ = process.communicate(timeout=timeout)
            return process.returncode, said
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            process.wait()
            return None, ""

    def configure(self):
        launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        code, said = self.call(["cmake", "-S", ".", "-B", str(self.build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                                "-DCONTACTBENCH_BENCH=OFF", *launcher])
        if code != 0:
            raise SystemExit(said)

    def make(self, *targets):
        """Does it compile?"""
        wanted = ["--target", *targets] if targets else []
        return self.call(["cmake", "--build", str(self.build), "--parallel", self.jobs, *wanted])[0] == 0

    def test(self, only, without, patience):
        """Name of the first test that fails or does not come back, None where all pass."""
        command = ["ctest", "--test-dir", str(self.build), "--parallel", self.jobs, "--stop-on-failure", "--timeout", str(int(patience))]
        command += ["-R", f"^({only})"] if only else []
        code, said = self.call(command + ["-E", f"^({without})$"], timeout=20 * patience)
        if code == 0:
            return None
        failed = re.search(r"^\s*\d+ - (\S+) \(", said, re.MULTILINE)
        return failed[1] if failed else "tests"


def nearest(room):
    return NEAREST.get(room, room + "$")


def targets(room, tree):
    if room == "scripts":
        return ["contactbench", "contactbench_wrong"]
    if room == "app":
        return ["contactbench", "contactbench_wrong", "test_program"]
    return [f"test_{room}"] if (tree / "test" / room).is_dir() else ["all"]


def judge(copy, fault, patience):
    """Outcome and what killed it."""
    restore = plant(copy.tree, fault)
    try:
        if not copy.make(*targets(fault["room"], copy.tree)):
            return "invalid", ""
        killer = copy.test(nearest(fault["room"]), APART, patience)
        if killer:
            return "killed", killer
        if not copy.make():
            return "invalid", ""
        killer = copy.test("", APART, patience)
        return ("killed", killer) if killer else ("survived", "")
    finally:
        restore()


def faults_of(options, copy_files):
    faults = written()
    faults += generate.draw(ROOT, copy_files, options.generated if options.generated is not None else len(faults), options.seed)
    names = collections.Counter(fault["id"] for fault in faults)
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise SystemExit(f"{TABLE.name}: used twice: {', '.join(twice)}")
    return [f for f in faults if (not options.room or f["room"] in options.room) and (not options.id or f["id"] in options.id)]


def table(rows):
    rooms = sorted({row["room"] for row in rows})
    lines = ["| room | planted | killed | survived | explained | share killed |", "|---|---|---|---|---|---|"]
    for room in [*rooms, "all"]:
        of = [row for row in rows if room in (row["room"], "all") and row["outcome"] != "invalid"]
        killed = sum(row["outcome"] == "killed" for row in of)
        explained = sum(row["outcome"] == "survived" and bool(row["equivalent"]) for row in of)
        counted = len(of) - explained
        share = f"{100 * killed / counted:.0f} %" if counted else ""
        lines.append(f"| {room} | {len(of)} | {killed} | {len(of) - killed - explained} | {explained} | {share} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0], formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--room", action="append", help="faults of this room only; may be repeated")
    parser.add_argument("--id", action="append", help="this fault only; may be repeated")
    parser.add_argument("--generated", type=int, help="faults drawn by generate.py [as many as are written]")
    parser.add_argument("--seed", type=int, default=1, help="of the drawing [1]")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--folder", type=Path, default=ROOT / "build-mutants", help="the scratch copy, its build, and mutants.csv")
    parser.add_argument("--list", action="store_true", help="print the faults and stop")
    options = parser.parse_args()

    copy = Copy(options.folder.resolve(), options.jobs) if not options.list else None
    files = copy.files if copy else subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    faults = faults_of(options, files)
    if options.list:
        for fault in faults:
            print(f"{fault['id']:40} {fault['file']:45} {fault['what']}")
        return 0

    report = options.folder / "mutants.csv"
    done = {}
    if report.exists():
        with report.open(newline="") as file:
            done = {row["id"]: row for row in csv.DictReader(file) if row["tree"] == copy.digest}
    copy.configure()
    if not copy.make():
        raise SystemExit("the tree does not build without a fault")
    start = time.monotonic()
    if killer := copy.test("", APART, 600):
        raise SystemExit(f"{killer} fails without a fault")
    patience = max(LEAST_PATIENCE, PATIENCE * (time.monotonic() - start))

    rows = []
    for number, fault in enumerate(faults, 1):
        row = done.get(fault["id"])
        if row is None or (row["from"], row["to"]) != (fault["from"], fault["to"]):
            begun = time.monotonic()
            outcome, killer = judge(copy, fault, patience)
            row = {**{key: fault.get(key, "") for key in COLUMNS}, "outcome": outcome, "killed_by": killer, "tree": copy.digest,
                   "seconds": f"{time.monotonic() - begun:.1f}"}
        row["equivalent"] = fault["equivalent"]
        rows.append(row)
        print(f"{number:4}/{len(faults)} {row['outcome']:9} {row['id']:40} {row['killed_by']:16} {row['seconds']} s", flush=True)
        with report.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            kept = {**done, **{r["id"]: r for r in rows}}
            writer.writerows(kept.values())
    print(table(rows))
    bad = [row for row in rows if (row["outcome"] == "survived") != bool(row["equivalent"]) and row["outcome"] != "invalid"]
    for row in bad:
        print(f"{row['outcome']}: {row['id']}: {row['what']}" + (f" (called equivalent: {row['equivalent']})" if row["equivalent"] else ""))
    broken = [row for row in rows if row["outcome"] == "invalid" and not row["id"].startswith("drawn-")]
    for row in broken:
        print(f"does not compile: {row['id']}")
    return 1 if bad or broken else 0


if __name__ == "__main__":
    sys.exit(main())
