#!/usr/bin/env python3
"""Do the tests notice? Plants one small fault at a time in a copy of the tree, builds it, and runs the tests: those of the
fault's own room first, all that could see it where these pass.

  scripts/test.sh --mutants                       the whole campaign (hours on one core)
  test/mutation/campaign.py --room contact        the faults of one room
  test/mutation/campaign.py --id referee-holds    one fault
  test/mutation/campaign.py --nearest             own room's tests only: a first look; without it after that, all tests for who passed
  test/mutation/campaign.py --drawn-only --seed 2 --results /tmp/other   faults that were never drawn before
  test/mutation/campaign.py --shard 1/2           the first, third, ... fault
  test/mutation/campaign.py --list                the faults, without running anything

Faults are the rows of mutants.toml, written by people who read the code, and more than as many drawn by generate.py, so that
nobody plants only what is tested. A fault is killed where a test fails or does not come back; a survivor is a gap in the
tests, or changes nothing that the program promises: `equivalent` in its row, or in [drawn] for those that are drawn, says why.

Results: outcomes.csv beside this file, a row a fault, and outcomes.md, a table by room and what survived; both are kept with
the sources. The same command goes on after an interruption, also on another machine, and several with other --shard and
--folder may run at once. A kill stands while the fault's own file stays as it was; a survivor is tried again when any source
or test has changed; --afresh does all again. Exit code 1 where a fault survives without a reason, or an `equivalent` one is
killed.

The copy is built with -O1 and without warnings, by ccache where there is one; a test program stops at its first failure.
"""
import argparse
import collections
import csv
import fcntl
import hashlib
import io
import json
import math
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import generate

ROOT = Path(__file__).resolve().parents[2]
TABLE = Path(__file__).with_name("mutants.toml")
COLUMNS = ["id", "room", "file", "what", "outcome", "killed_by", "seconds", "equivalent", "from", "to", "of_file", "of_tests"]
PATIENCE = 4           # times what a test takes undisturbed: a fault that makes it hang longer is killed
LEAST_PATIENCE = 20    # s
DRAWN = 180           # faults that nobody chose
MEMORY = 4 << 30       # bytes of data a test may hold: a fault that makes it eat more is killed
# Look at the text of the sources and not at what the program does: they would be killed by any fault that breaks a line.
APART = {"rooms", "scripts_style"}
PARTS = ("lib/", "app/", "bench/", "test/", "scripts/", "scenarios/", "CMake")
MODULE = "contactbench_python"  # the target that makes the Python module
ENGINES = "engines"  # and that of all engines beside the program
# Tests of scripts that a fault there reaches first, where they have another name than the script; the others follow, the quick
# ones first.
SCRIPTS = {
    "references": ("references", "recommend"), "scenes": ("scenes", "campaign"), "recommend": ("recommend_words", "recommend"), "worth": ("worlds", "worth"),
    "stress": ("stress_runs", "stress_solves", "stress"), "campaign": ("campaign_runs", "campaign"), "sweep": ("sweep_jobs", "sweep"),
    "problems": ("stress_solves",), "limits": ("stress_solves",), "figures": ("figures", "figures_of_all"),
    "robots": ("looks",), "heatmap": ("figures_of_all",), "view": ("motions", "pages", "view"), "gltf": ("motions", "view"), "replay": ("replay",),
    "runs": ("tables",), "gather": ("tables",), "table1": ("tables",), "stepping": ("precision",), "ladder": ("choices",),
    "compare": ("choices",), "report": ("sections", "pages", "report"), "picture": ("pictures", "first_day"), "start": ("pictures", "first_day"), "small": ("bench",), "overhead": ("bench",),
    **{name: ("first_day", name) for name in ("bench", "build", "lib", "reproduce", "setup", "test")}}


def digest_of(*parts):
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part if isinstance(part, bytes) else part.encode())
    return digest.hexdigest()[:16]


def written(path=TABLE):
    """The table's faults, and why those survive that are drawn and change nothing: reason by id."""
    table = tomllib.loads(path.read_text())
    for fault in table["mutant"]:
        fault.setdefault("equivalent", "")
        fault["room"] = generate.room_of(fault["file"])
    return table["mutant"], table.get("drawn", {})


def plant(tree, fault):
    """Writes the fault into the tree; returns what puts the file right again; None where its text is not there just once."""
    path = tree / fault["file"]
    text = path.read_text()
    at = [i for i in range(len(text)) if text.startswith(fault["from"], i)]
    if "offset" in fault:
        at = [i for i in at if i == fault["offset"]]
    if len(at) != 1:
        return None
    path.write_text(text[: at[0]] + fault["to"] + text[at[0] + len(fault["from"]) :])
    return lambda: path.write_text(text)


def limits():
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class Copy:
    """A scratch copy of the tracked files, with a build of its own."""

    def __init__(self, folder, jobs):
        self.tree, self.build, self.jobs = folder / "tree", folder / "build", str(jobs)
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, check=True).stdout.decode().split("\0")
        self.files = [f for f in listed if f and (ROOT / f).is_file()]
        for name in self.files:
            target = self.tree / name
            if target.exists() and target.read_bytes() == (ROOT / name).read_bytes():
                continue  # its time stamp stays, and with it what was built
            target.parent.mkdir(parents=True, exist_ok=True)
            target.unlink(missing_ok=True)
            shutil.copy(ROOT / name, target, follow_symlinks=False)
        watched = [f for f in sorted(self.files) if f.startswith(PARTS) and not f.startswith("test/mutation/")]
        self.digest = digest_of(*(part for name in watched for part in (name, (ROOT / name).read_bytes())))
        # Test -> s that it takes, digest of the program that it runs; kept while the tree without a fault is the same.
        self.undisturbed, self.timed = {}, folder / "undisturbed.json"
        if self.timed.exists() and (kept := json.loads(self.timed.read_text()))["tree"] == self.digest:
            self.undisturbed = kept["tests"]

    def call(self, command, timeout=None, env=None, limited=False):
        """Exit code, what it printed; code None where it did not come back."""
        process = subprocess.Popen(command, cwd=self.tree, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   errors="replace", start_new_session=True, preexec_fn=limits if limited else None)
        try:
            said, _ = process.communicate(timeout=timeout)
            return process.returncode, said
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return None, ""

    def configure(self):
        flags = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        flags += ["-DCMAKE_EXE_LINKER_FLAGS=-fuse-ld=lld"] if shutil.which("ld.lld") else []
        code, said = self.call(["cmake", "-S", ".", "-B", str(self.build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                                "-DCMAKE_CXX_FLAGS=-w", "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG", "-DCONTACTBENCH_BENCH=OFF", *flags])
        if code != 0:
            raise SystemExit(said)
        _, said = self.call(["ctest", "--test-dir", str(self.build), "--show-only=json-v1"])
        self.tests = {test["name"]: test for test in json.loads(said[said.index("{") :])["tests"] if test["name"] not in APART}
        # ctest knows no command of a program that is yet to be built.
        for name, command in re.findall(r"^add_test\(\[=\[(\w+)\]=\] (.*)\)$", (self.build / "test/CTestTestfile.cmake").read_text(), re.MULTILINE):
            if name in self.tests:
                self.tests[name]["command"] = re.findall(r'"([^"]*)"', command)

    def make(self, *targets):
        """What the compiler says where it does not compile, else None."""
        code, said = self.call(["cmake", "--build", str(self.build), "--parallel", self.jobs, "--target", *targets])
        return said if code != 0 else None

    def programs(self, name):
        """Targets that a test needs."""
        command = " ".join(self.tests[name]["command"])
        own = re.findall(r"/bin/(\w+)", command.partition(str(self.build))[2])
        if "test_program" in own:
            own += ["contactbench", ENGINES]
        if name.startswith("python"):
            own = ["contactbench", MODULE]
        if name == "words":
            own = ["contactbench", ENGINES]
        return own or (["contactbench_wrong"] if name == "wrong_methods" else ["contactbench"])

    def of_programs(self, name):
        made = {MODULE: ["python/contactbench/_core*"], ENGINES: ["bin/contactbench-engine-*", "bin/*.so"]}
        files = (file for p in self.programs(name) for one in made.get(p, [f"bin/{p}"]) for file in sorted(self.build.glob(one)))
        return digest_of(*(file.read_bytes() for file in files))

    def of_tests(self, names):
        """Digest of the sources of some rooms' tests."""
        folders = tuple(f"test/{name}/" if (self.tree / "test" / name).is_dir() else "test/python/" if name.startswith("python") else "test/scripts/"
                        for name in names)
        files = [f for f in sorted(self.files) if f.startswith(folders)]
        return digest_of(*((self.tree / f).read_bytes() for f in files))

    def run(self, name, timeout):
        """Why the test fails, None where it passes."""
        test = self.tests[name]
        env, command = dict(os.environ), list(test["command"])
        for item in test.get("properties", []):
            if item["name"] == "ENVIRONMENT":
                env.update(entry.split("=", 1) for entry in item["value"])
        if re.search(r"/bin/test_\w+$", command[0]):
            command.append("--abort")
        elif command[0].endswith("test/scripts/run.sh"):
            command.insert(1, "--failfast")
        code, said = self.call(command, timeout, env, limited=True)
        if code in (0, 77):
            return None
        if code is None:
            return f"{name}: does not come back"
        case = re.search(r"^-{60,}\n(.+)\n(?:.+\n)*?-{60,}$", said, re.MULTILINE) or re.search(r"^(?:FAIL|ERROR): (\w+)", said, re.MULTILINE)
        case = case or re.search(r"^(?:.*\.cpp:\d+: FAILED|.*: first and second referee differ)", said, re.MULTILINE)
        return f"{name}: {(case[1] if case.groups() else case[0]).strip()}" if case else f"{name}: exit code {code}"

    def time(self, name):
        """Runs the test without a fault, once; it must pass."""
        if name in self.undisturbed:
            return
        if said := self.make(*self.programs(name)):
            raise SystemExit(f"the tree does not build without a fault:\n{said[-3000:]}")
        start = time.monotonic()
        if failure := self.run(name, 1800):
            raise SystemExit(f"fails without a fault: {failure}")
        self.undisturbed[name] = time.monotonic() - start, self.of_programs(name)
        self.timed.write_text(json.dumps({"tree": self.digest, "tests": self.undisturbed}))


def order(copy, fault, nearest_only):
    """Tests that can see the fault, nearest first, then the quick ones before the slow."""
    file, room = fault["file"], fault["room"]
    compiled = {name for name, test in copy.tests.items() if re.search(r"/bin/test_\w+$", test["command"][0])}
    stand_in = {name for name in copy.tests if name.startswith("scripts_")}  # they never start the program
    scripts = room == "scripts" or room == "bench" and file.endswith(".py")
    if scripts:
        can = [name for name in copy.tests if name not in compiled]
        name = Path(file).stem
        near = [test for name in SCRIPTS.get(name, (name,)) for test in (name, f"scripts_{name}")] + ["written"]
    else:
        can = [name for name in copy.tests if name not in stand_in]
        near = {"app": ["program"], "bench": ["program"], "cone": ["cone", "methods"], "ncp": ["ncp", "methods"],
                "contact": ["contact", "second_referee"], "python": ["python", "python_numbers"]}.get(room, [room])
        near += ["words", "answers"]  # which see what changes, whatever it is, as `written` does of scripts
    near = [name for name in near if name in can]
    if nearest_only:
        return near
    known = copy.undisturbed
    rest = (name for name in can if name not in near)
    if scripts:
        return near + sorted(rest, key=lambda name: known[name][0] if name in known else math.inf)
    return near + sorted(rest, key=lambda name: (name not in compiled, list(copy.tests).index(name)))


def judge(copy, fault, *groups):
    """Outcome and what killed it. Tests of a later group are not even timed where one of an earlier kills; a test whose program
    comes out the same, byte by byte, need not run."""
    for tests in groups:
        for name in tests:
            copy.time(name)
        restore = plant(copy.tree, fault)
        if restore is None:
            return "stale", ""
        try:
            for name in tests:
                if copy.make(*copy.programs(name)):
                    return "invalid", ""
                took, program = copy.undisturbed[name]
                if fault["file"].endswith((".cpp", ".h")) and copy.of_programs(name) == program:
                    continue
                if killer := copy.run(name, LEAST_PATIENCE + PATIENCE * took):
                    return "killed", killer
        finally:
            restore()
    return "survived", ""


def faults_of(options, files):
    faults, reasons = written()
    if options.drawn_only:
        faults = []
    faults += generate.draw(ROOT, files, options.generated, options.seed)
    names = collections.Counter(fault["id"] for fault in faults)
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise SystemExit(f"{TABLE.name}: used twice: {', '.join(twice)}")
    for fault in faults:
        fault["equivalent"] = fault["equivalent"] or reasons.get(fault["id"], "")
    return [f for f in faults if (not options.room or f["room"] in options.room) and (not options.id or f["id"] in options.id)]


def stands(row, fault, of_file, of_tests):
    """Is an earlier result still one?"""
    if row is None or (row["from"], row["to"], row["of_file"]) != (fault["from"], fault["to"], of_file):
        return False
    return row["outcome"] in ("killed", "invalid") or row["of_tests"] == of_tests


def table(rows):
    lines = ["| room | planted | killed | survived | explained | share killed |", "|---|---|---|---|---|---|"]
    for room in [*sorted({row["room"] for row in rows}), "all"]:
        of = [row for row in rows if room in (row["room"], "all") and row["outcome"] not in ("invalid", "stale")]
        killed = sum(row["outcome"] == "killed" for row in of)
        explained = sum(row["outcome"] != "killed" and bool(row["equivalent"]) for row in of)
        counted = len(of) - explained
        share = f"{100 * killed / counted:.0f} %" if counted else ""
        lines.append(f"| {room} | {len(of)} | {killed} | {len(of) - killed - explained} | {explained} | {share} |")
    return lines


def read_rows(path):
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def keep(row, folder, ids):
    """Writes the row among those that are there, of faults that still are; another campaign may do so at the same time."""
    lock = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        rows = {**read_rows(folder / "outcomes.csv"), row["id"]: row}
        rows = [rows[name] for name in ids if name in rows]
        text = io.StringIO()
        writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        lines = ["# Planted faults", "", f"{len(rows)} of {len(ids)} faults tried.", "", *table(rows), "", "## Survived", ""]
        for row in rows:
            if row["outcome"] not in ("killed", "invalid", "stale"):
                lines.append(f"* `{row['id']}` {row['file']}: {row['what']}" + (f": {row['equivalent']}" if row["equivalent"] else ""))
        for name, content in (("outcomes.csv", text.getvalue()), ("outcomes.md", "\n".join(lines) + "\n")):
            (folder / f".{name}").write_text(content, newline="")
            os.replace(folder / f".{name}", folder / name)  # whole or not at all
    finally:
        os.close(lock)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0], formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--room", action="append", help="faults of this room only; may be repeated")
    parser.add_argument("--id", action="append", help="this fault only; may be repeated")
    parser.add_argument("--generated", type=int, default=DRAWN, help=f"faults drawn by generate.py [{DRAWN}]")
    parser.add_argument("--seed", type=int, default=1, help="of the drawing [1]")
    parser.add_argument("--drawn-only", action="store_true", help="without those of mutants.toml")
    parser.add_argument("--nearest", action="store_true", help="the own room's tests only; who passes them is noted as `passed`, and done again")
    parser.add_argument("--afresh", action="store_true", help="earlier results count for nothing")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--shard", default="1/1", metavar="I/N", help="every N-th fault, from the I-th on [1/1]")
    parser.add_argument("--folder", type=Path, default=ROOT / "build-mutants", help="the scratch copy and its build [build-mutants]")
    parser.add_argument("--results", type=Path, default=TABLE.parent, help="folder of outcomes.csv and outcomes.md [test/mutation]")
    parser.add_argument("--list", action="store_true", help="print the faults and stop")
    options = parser.parse_args()
    if (options.drawn_only or options.seed != 1 or options.generated != DRAWN) and options.results == TABLE.parent:
        parser.error("other faults than the table's: name another folder for what comes of them (--results)")
    shard = re.fullmatch(r"([1-9]\d*)/([1-9]\d*)", options.shard)
    if not shard or int(shard[1]) > int(shard[2]):
        parser.error(f"--shard {options.shard}: I/N, with I from 1 to N")
    first, every = map(int, shard.groups())

    copy = Copy(options.folder.resolve(), options.jobs) if not options.list else None
    files = copy.files if copy else subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    faults = faults_of(options, files)
    ids = [fault["id"] for fault in faults_of(argparse.Namespace(**{**vars(options), "room": None, "id": None}), files)]
    faults = faults[first - 1 :: every]
    if options.list:
        for fault in faults:
            print(f"{fault['id']:40} {fault['file']:45} {fault['what']}")
        return 0

    options.results.mkdir(parents=True, exist_ok=True)
    done = read_rows(options.results / "outcomes.csv")
    copy.configure()
    rows = []
    for number, fault in enumerate(faults, 1):
        row = done.get(fault["id"])
        of_file = digest_of((copy.tree / fault["file"]).read_bytes())
        tests = order(copy, fault, options.nearest)
        of_tests = copy.of_tests(tests) if options.nearest else copy.digest
        if options.afresh or not stands(row, fault, of_file, of_tests):
            begun = time.monotonic()
            near = order(copy, fault, True)
            rest = [name for name in tests if name not in near]
            if not options.afresh and row and row["outcome"] == "passed" and stands(row, fault, of_file, copy.of_tests(near)):
                near = []  # it passed them already
            outcome, killer = judge(copy, fault, near, rest)
            if options.nearest and outcome == "survived":
                outcome = "passed"
            row = {**{key: fault.get(key, "") for key in COLUMNS}, "outcome": outcome, "killed_by": killer, "of_file": of_file,
                   "of_tests": of_tests, "seconds": f"{time.monotonic() - begun:.1f}"}
            print(f"{number:4}/{len(faults)} {row['outcome']:9} {row['id']:36} {row['seconds']:>6} s  {row['killed_by'] or row['what']}", flush=True)
        row["equivalent"] = fault["equivalent"]
        rows.append(row)
        keep(row, options.results, ids)
    print("\n".join(table(rows)))
    bad = [row for row in rows if (row["outcome"] in ("survived", "passed")) != bool(row["equivalent"]) and row["outcome"] not in ("invalid", "stale")]
    for row in bad:
        print(f"{row['outcome']}: {row['id']}: {row['what']}" + (f" (called equivalent: {row['equivalent']})" if row["equivalent"] else ""))
    broken = [row for row in rows if row["outcome"] == "stale" or (row["outcome"] == "invalid" and not row["id"].startswith("drawn-"))]
    for row in broken:
        print(f"{row['outcome']}: {row['id']}: its text is not there just once, or what takes its place does not compile")
    return 1 if bad or broken else 0


if __name__ == "__main__":
    sys.exit(main())
