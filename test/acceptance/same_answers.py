#!/usr/bin/env python3
"""Two builds give the same answers, byte for byte: what a change that is to change no answer is held to.

usage: same_answers.py BEFORE AFTER [--method ap] [--only TEXT] [--jobs N] [--save FILE]

BEFORE and AFTER are programs, or what --save has kept of one (FILE holds AFTER's answers). Compared are
* every stored problem of test/data and scenarios by every method and solver, `ap` with polygons of 4, 8 and 16 edges, so that its
  LCPs go to the dense kernel and to the sparse one: impulses, velocities, statuses, reasons, iterations, residuals;
* streams of problems that scenes meet on their way (stored by the first program given), solved likewise;
* the scenes of the published sweeps, scenes under stress and test/data/scenes for a short time, cold, with --warm-start and with
  --prune off: trajectories, and the steps and summaries but for times and memory.
What did not come to an end within LIMIT seconds is not compared, and counted. A field that one of the programs does not write yet, or
no more, is no difference. Exits 1 where anything differs; the last lines say by method how: in statuses, in files (impulses,
velocities, trajectories), or in what is measured of the same files alone.
"""
import argparse
import collections
import csv
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
LIMIT = 30  # s, for one problem or run
EDGES = ("4", "8", "16")
# Depend on the machine, on the build or on where a file was put.
APART = ("problem", "vector", "hard_problem_command", "time", "peak_memory_mb", "wall", "file", "program", "version", "build",
         "machine", "started", "commit")

# Scene, parameters, flags: the published sweeps', long enough for what happens in them, and some under stress.
SCENES = [
    ("impacting_sphere", {}, ["--duration", "1"]), ("sliding_box", {}, ["--step", "1e-2", "--duration", "4"]),
    ("sticking_box", {}, ["--duration", "0.3"]), ("circular_sliding", {}, ["--step", "1e-2", "--duration", "4"]),
    ("circular_sliding", {"start": "rest"}, ["--step", "1e-2", "--duration", "2"]),
    *(("stack", {"boxes": boxes}, ["--duration", "0.1"]) for boxes in ("1", "2", "4", "8", "16")),
    ("stack", {"boxes": "8"}, ["--duration", "0.05", "--perturb", "1e-4", "--seed", "3"]),
    ("mobile_robot", {}, ["--duration", "0.3"]), ("mobile_robot_caster", {}, ["--duration", "0.2"]), ("grasp", {}, ["--duration", "0.1"]),
    ("tipping_box", {}, ["--duration", "0.3"]), ("pushed_block", {}, ["--duration", "0.3"]), ("urdf_arm", {}, ["--duration", "0.6"]),
    *((f"stress/{name}", {}, ["--duration", "0.1"]) for name in
      ("alternating_stack", "card_house", "card_house_three", "contact_grid", "cradle", "groove", "mass_ratio", "painleve",
       "rocking_block", "slender", "squeeze", "units", "wall")),
]
STREAMS = [("sliding_box", {}, "2", "500"), ("circular_sliding", {}, "2", "500"), ("stack", {"boxes": "4"}, "0.3", "75"),
           ("stack", {"boxes": "12"}, "0.1", "50"), ("mobile_robot", {}, "1", "250"), ("grasp", {}, "0.4", "100")]


def table(program):
    return json.loads(subprocess.run([program, "list", "--json"], check=True, capture_output=True, text=True).stdout)


def choices(program, only_method):
    """Flags of every method, variant and solver, and of every LCP solver alone."""
    listed = table(program)
    unavailable = {row["name"] for row in listed["solvers"] if row.get("unavailable")}
    methods, lcp = [], []
    for row in listed["solvers"]:
        if row["method"] in (None, "ap") and row["name"] not in unavailable and only_method in ("", "ap"):
            lcp.append(["--solver", row["name"]])
    for row in listed["methods"]:
        if only_method not in ("", row["name"]):
            continue
        flags = {option["flag"] for option in row["options"]}
        for solver in row["solvers"] or [None]:
            for variant in row["variants"] or [None]:
                if solver not in unavailable:
                    words = ["--method", row["name"], *(["--solver", solver] if solver else []),
                             *(["--variant", variant] if variant else [])]
                    methods.append((words, flags))
    return methods, lcp


def cases(program, only_method, streams):
    """(words, files it writes) of everything that is asked of a program."""
    methods, lcp = choices(program, only_method)
    files = sorted(p for folder in (ROOT / "test/data", ROOT / "scenarios", streams) for p in folder.rglob("*")
                   if p.suffix in (".hdf5", ".mtx", ".dat"))
    for file in files:
        if file.name.endswith(".M.mtx") or file.name.startswith("lcp"):
            vector = Path(str(file).replace(".M.mtx", ".q.mtx"))
            data = ["--matrix", str(file), "--vector", str(vector)] if vector != file else [str(file)]
            for words in lcp if vector.exists() else []:
                yield ["solve", "--kind", "lcp", *data, *words, "--json", "--out", "z.mtx"], ["z.mtx"]
        elif file.suffix != ".mtx":
            for words, flags in methods:
                for more in [["--k", k] for k in EDGES] if "k" in flags else [[]]:
                    yield (["solve", "--kind", "contact", str(file), *words, *more, "--json", "--out", "r.mtx", "--velocities", "u.mtx"],
                           ["r.mtx", "u.mtx"])
    scenes = [(ROOT / "scenarios" / f"{name}.xml", sets, flags) for name, sets, flags in SCENES]
    scenes += [(file, {}, ["--duration", "0.1"]) for file in sorted((ROOT / "test/data/scenes").glob("*.xml"))]
    for scene, sets, flags in scenes:
        setting = [word for pair in sets.items() for word in ("--set", "=".join(pair))]
        for words, known in methods:
            for more in [[], *([["--warm-start", "on"]] if "warm-start" in known else []), ["--prune", "off"]]:
                for edges in (["--k", "4"], ["--k", "12"]) if "k" in known else ([],):
                    yield (["run", str(scene), *setting, *words, *flags, *more, *edges, "--quiet", "--json", "--out", "run",
                            "--time-limit", str(LIMIT)], ["run/trajectory.csv", "run/steps.csv"])


def is_time(name):
    return name.endswith("_s") and not name.endswith("per_s")


def timeless(value):
    """What stays of a JSON answer when times and the machine are left out."""
    if isinstance(value, dict):
        return {key: timeless(x) for key, x in value.items() if not is_time(key) and not key.startswith(APART)}
    return [timeless(x) for x in value] if isinstance(value, list) else value


def digest(path):
    """Of a file's bytes; of a table of steps without the columns of times."""
    if not path.exists():
        return None
    data = path.read_bytes()
    if path.name == "steps.csv":
        rows = list(csv.reader(data.decode().splitlines()))
        keep = [i for i, name in enumerate(rows[0]) if not is_time(name)] if rows else []
        data = "\n".join(",".join(row[i] for i in keep) for row in rows).encode()
    return hashlib.sha256(data).hexdigest()


def ask(program, words, files):
    """What a program answers: its JSON and the digests of its files; None where it took too long."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True, timeout=LIMIT)
        except subprocess.TimeoutExpired:
            return None
        answer = json.loads(done.stdout) if done.stdout.strip().startswith("{") else {"said": done.stdout, "status": ""}
        if answer["status"] == "time_limit":
            return None
        return {"exit": done.returncode, "answer": timeless(answer), "files": [digest(Path(folder) / file) for file in files]}


def label(words, streams):
    return " ".join(words).replace(str(streams), "STREAMS").replace(str(ROOT) + "/", "")


def store_streams(program, folder):
    for scene, sets, duration, every in STREAMS:
        setting = [word for pair in sets.items() for word in ("--set", "=".join(pair))]
        subprocess.run([program, "run", str(ROOT / "scenarios" / f"{scene}.xml"), *setting, "--method", "convex", "--duration", duration,
                        "--prune", "off", "--record-every", "0", "--save-problems", str(folder / "_".join([scene, *sets.values()])),
                        "--save-every", every, "--out", str(folder / "run"), "--quiet"], check=True, capture_output=True)


def answers(source, only, asked, streams, jobs):
    """By label, from a program or from what was kept of one."""
    if source.endswith(".json"):
        return json.loads(Path(source).read_text())
    program = os.path.abspath(source)
    chosen = [(label(words, streams), words, files) for words, files in asked if only in label(words, streams)]
    with ThreadPoolExecutor(jobs) as pool:
        return dict(zip([name for name, _, _ in chosen], pool.map(lambda case: ask(program, case[1], case[2]), chosen)))


def common(a, b):
    """Both without the fields that the other has not."""
    if isinstance(a, dict) and isinstance(b, dict):
        both = {key: common(a[key], b[key]) for key in a.keys() & b.keys()}
        return {key: x for key, (x, _) in both.items()}, {key: y for key, (_, y) in both.items()}
    return a, b


def differences(before, after):
    """(label, what differs) of what both have brought to an end."""
    for name in sorted(before.keys() & after.keys()):
        a, b = before[name], after[name]
        if a is None or b is None or a == b:
            continue
        x, y = common(a["answer"], b["answer"])
        what = [key for key in sorted(x) if x[key] != y[key]]
        moved = 1 if name.startswith("run ") else 2  # of a run the trajectory; its second file is the table of steps
        what += ["files"] * (a["files"][:moved] != b["files"][:moved]) + ["steps.csv"] * (a["files"][moved:] != b["files"][moved:])
        what += ["exit code"] * (a["exit"] != b["exit"])
        if what:
            yield name, what, a, b


def method_of(name):
    words = name.split()
    return " ".join(words[words.index(flag) + 1] for flag in ("--method", "--solver", "--variant") if flag in words)


def by_method(both, found):
    """Lines: cases of each method, and how many of them differ in what."""
    cases, kinds = collections.Counter(map(method_of, both)), {}
    for name, what, _, _ in found:
        kind = "status" if {"status", "exit code"} & {*what} else "files" if "files" in what else "measures"
        kinds.setdefault(method_of(name), collections.Counter())[kind] += 1
    for method in sorted(cases):
        of = kinds.get(method, collections.Counter())
        yield (f"{method:24} {cases[method]:5} cases, {cases[method] - of.total():5} the same; other statuses {of['status']}, "
               f"files {of['files']}, measures of the same files {of['measures']}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("--method", default="", help="this method alone [all]")
    parser.add_argument("--only", default="", help="cases whose words contain this")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--show", type=int, default=20, help="differences, and cases without an end, that are named [20]")
    parser.add_argument("--save", type=Path, help="keep AFTER's answers here")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        programs = [os.path.abspath(source) for source in (options.before, options.after) if not source.endswith(".json")]
        streams = Path(folder)
        if programs:
            store_streams(programs[0], streams)
        asked = list(cases(programs[0], options.method, streams)) if programs else []
        before, after = (answers(source, options.only, asked, streams, options.jobs) for source in (options.before, options.after))
    if options.save:
        options.save.write_text(json.dumps(after, sort_keys=True))
    both = before.keys() & after.keys()
    slow = sorted(name for name in both if before[name] is None or after[name] is None)
    found = list(differences(before, after))
    for name, what, a, b in found[:options.show]:
        print(f"differs in {', '.join(what)}: {name}")
        for key in [key for key in what if key in a["answer"] or key in b["answer"]][:4]:
            print(f"    {key}: {a['answer'].get(key)} | {b['answer'].get(key)}")
    for name in slow[:options.show]:
        print(f"not brought to an end: {name}")
    for line in by_method(both, found):
        print(line)
    print(f"{len(both)} cases, {len(both) - len(slow) - len(found)} the same, {len(found)} different, {len(slow)} not brought to an end")
    sys.exit(1 if found or not both else 0)


if __name__ == "__main__":
    main()
