"""The campaign of random scenes: runs every method over them with and without pruning, looks at each run, writes the
tables.

Each finished run is one line of random_runs.jsonl in the folder of the results; a run that is there already, of the
same program, scene and limit, is not done again. So a campaign that was stopped goes on, and one with more scenes
begins where the smaller one ended.
"""
import collections
import concurrent.futures
import hashlib
import json
import re
import shlex
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

from . import look, program, reduce, scenes
from .program import digest
from .runs import write_table
from .templates import render

METHODS = {
    name: flags.split() for name, flags in {
        "ap/lemke": "--method ap --solver lemke", "ap/path": "--method ap --solver path",
        "ap/ynl": "--method ap --solver ynl", "convex/bound-on": "--method convex --compression-bound on",
        "convex/bound-off": "--method convex --compression-bound off",
        "newton/uncapped": "--method newton --variant uncapped",
        "newton/stick-tested": "--method newton --variant stick-tested", "mirtich": "--method mirtich",
        "coulomb/newton": "--method coulomb --solver newton", "coulomb/nsgs": "--method coulomb --solver nsgs",
        "coulomb/admm": "--method coulomb --solver admm", "coulomb/cascade": "--method coulomb --solver cascade",
        "soft/sap": "--method soft --variant sap", "soft/mujoco": "--method soft --variant mujoco"}.items()}
MEMORY_MB = 2000
SOLVE_LIMIT = 60  # s that a kept problem may take
TIME_LIMIT = 10.0  # s of waiting that a run may take
# What a method's own law allows, and its page says: found, counted, and no defect of the program.
GIVES_WAY = {"limits": "its contacts and stops give way (docs/methods/soft.md)"}
DEPARTS = {
    "newton/uncapped": {"energy": "its friction is not capped (docs/methods/newton.md)"}, "soft/sap": GIVES_WAY,
    "soft/mujoco": GIVES_WAY}
LATE = 2.0  # s after its limit of time that a run may come back, on a machine with other work
COLUMNS = [
    "scene", "family", "kind", "method", "prune", "verdict", "status", "faults", "departures", "penetration_m",
    "penetration_of_size", "where", "energy_gain", "event_energy_gain", "momentum_of_bound", "false_claims", "residual",
    "t_reached", "events", "run_s", "reason", "again", "command"]


def kind_of(fault):
    return fault.split(":")[0]


def examine(job, path, model, folder):
    """A run and the look at it: what a row of the table is made of, and the summary. A fault counts as a defect where
    the run says `ok`, unless the method's law is known for it; a crash, a hang and damaged numbers always do."""
    began, limit = time.monotonic(), job["time_limit"]
    # A run that is still there half as long again after its limit does not hear it: a hang.
    flags = [*job["flags"], "--time-limit", f"{limit:g}"]
    status, reason, hung, summary = program.watched(job["program"], path, flags, folder, job["statuses"],
                                                    1.5 * limit + 5, MEMORY_MB)
    took = time.monotonic() - began
    row = {
        "status": status, "reason": reason, "faults": [], "departures": [], "false_claims": 0, "run_s": round(took, 3)}
    if hung:
        row["faults"].append("hang: stopped from outside")
    elif took > limit + LATE:
        row["faults"].append(f"late: came back {took - limit:.1f} s after its limit")
    elif status in ("crash", "input_error"):
        row["faults"].append(f"{status}: {reason}"[:200])
    if summary:
        seen, residuals = look.look(folder, model, summary), summary["residuals"]
        row |= {
            "penetration_m": seen.penetration, "penetration_of_size": seen.penetration_relative, "where": seen.where,
            "energy_gain": seen.energy_gain, "event_energy_gain": seen.event_gain, "momentum_of_bound": seen.momentum,
            "false_claims": residuals["false_claims"], "residual": residuals["max"], "git": summary["versions"]["git"],
            "t_reached": summary["t_reached"], "events": summary["events"]}
        row["faults"] += [fault for fault in seen.faults if status == "ok" or kind_of(fault) == "files"]
        if status == "ok" and row["false_claims"]:
            row["faults"].append(f"claims: {row['false_claims']} claims of success were refuted")
    known = DEPARTS.get(job["method"], {})
    row["departures"] = [fault for fault in row["faults"] if kind_of(fault) in known]
    row["faults"] = [fault for fault in row["faults"] if fault not in row["departures"]]
    law = "model" if row["departures"] else "ok"
    row["verdict"] = "defect" if row["faults"] else "typed" if status != "ok" else law
    return row, summary


def label(row):
    """What a reduced scene must still show: the kind of the first fault, or the status."""
    return kind_of(row["faults"][0]) if row["faults"] else row["status"]


def key_of(*parts):
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def kept_in(job):
    """The folder of a run, if it fails."""
    return Path(job["failing"]) / f"{job['scene']}__{job['method'].replace('/', '-')}__prune-{job['prune']}"


def keep(job, row, folder, summary):
    """Keeps a failing run's scene, its hard problem and the commands; whether the problem fails again by its command:
    yes, no, or nothing."""
    path, place = Path(job["path"]), kept_in(job)
    place.mkdir(parents=True)
    for source in [path] + [path.parent / name for name in job["files"]]:
        shutil.copy(source, place)
    lines, again = [f"{row['status']}: {row['reason']}", *row["faults"], row["command"]], ""
    problem, command = ((summary or {}).get(key) for key in ("hard_problem", "hard_problem_command"))
    if problem and (Path(folder) / problem).exists():
        shutil.copy(Path(folder) / problem, place)
        if command:
            command = command.replace(str(Path(folder) / problem), problem)  # that folder will be gone
            lines.append(command)
            again = "no" if solves(job["program"], command, place) else "yes"
    (place / "how.txt").write_text("\n".join(lines) + "\n")
    return again


def solves(path, command, place):
    """Does the program answer the kept problem `ok`, by the command that it said itself? Its files stand in `place`."""
    words = [
        path if word.endswith("contactbench") else place / word if (place / word).is_file() else word
        for word in shlex.split(command)]
    try:
        done = program.call(*words, timeout=SOLVE_LIMIT)
    except program.Late:
        return False
    return done.returncode == 0 and re.search(r"^\W*status\W+ok\b", done.stdout, re.MULTILINE) is not None


def do(job):
    path = Path(job["path"])
    shutil.rmtree(kept_in(job), ignore_errors=True)  # an earlier failure must not stand for a run that ends well
    with tempfile.TemporaryDirectory(prefix="campaign") as folder:
        row, summary = examine(job, path, look.Model(path), folder)
        row = {
            **{key: job[key] for key in ("scene", "family", "kind", "method", "prune", "key")},
            **row, "command": f"contactbench run {path.name} {' '.join(job['flags'])}", "again": ""}
        if row["verdict"] in ("typed", "defect"):
            row["again"] = keep(job, row, folder, summary)
    return row


def jobs_of(some, options):
    # Another look is another run: it sees the files, which are not kept.
    program_hash, look_hash = digest(options.program), digest(look.__file__)
    statuses = program.statuses_of(program.listed(options.program))
    for scene in some:
        path = scenes.write(scene, options.out / "scenes")
        for method, flags in METHODS.items():
            for prune in (options.prune or ["on", "off"]) if not options.method or method in options.method else []:
                key = key_of(program_hash, scene.xml(), *scene.files.values(), method, prune, f"{options.time_limit:g}",
                             look_hash)
                yield {
                    "scene": scene.name, "family": scene.family, "kind": scene.kind, "method": method, "prune": prune,
                    "key": key, "path": str(path), "files": list(scene.files), "flags": flags + ["--prune", prune],
                    "program": options.program, "time_limit": options.time_limit, "statuses": statuses, "failing": str(
                        options.out / "failing")}


def finished(path):
    rows = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            row = json.loads(line)
            rows[row["key"]] = row
        except (ValueError, KeyError):
            pass  # what an interrupted write leaves
    return rows


def disagreements(rows):
    """Runs that end differently with and without pruning: adds a fault to both rows."""
    ends = collections.defaultdict(dict)
    for row in rows:
        ends[row["scene"], row["method"]][row["prune"]] = row
    for pair in ends.values():
        said = {prune: row["status"] for prune, row in pair.items()}
        if len(set(said.values())) == 2 and "time_limit" not in said.values():
            for row in pair.values():
                row["faults"] = row["faults"] + [f"pruning: {said['on']} with it, {said['off']} without"]
                row["verdict"] = "defect"


def page(rows, manifest):
    """random.md."""
    methods = [name for name in METHODS if any(row["method"] == name for row in rows)]

    def of(**want):
        return [row for row in rows if all(row[key] == value for key, value in want.items())]

    def having(kind, method, what="faults"):
        return sum(any(kind_of(found) == kind for found in row[what]) for row in of(method=method))

    def shares(**want):
        ok = [
            (sum(row["status"] == "ok" for row in some), len(some)) for some in (of(**want, method=m) for m in methods)]
        return [f"{good}/{count}" if count else "" for good, count in ok]

    every = [*scenes.FAMILIES, *scenes.SHAPES]
    families = [(family, kind) for family in every for kind in scenes.KINDS if of(family=family, kind=kind)]
    statuses = collections.Counter(row["status"] for row in rows).most_common()
    faults = collections.Counter(kind_of(fault) for row in rows for fault in row["faults"]).most_common()
    worst = max(of(status="ok"), key=lambda row: row.get("penetration_of_size") or 0, default={})
    kept = [row["again"] for row in rows if row["verdict"] == "typed" and row["again"]]
    table = {"shares": [(*key, shares(family=key[0], kind=key[1])) for key in families]}
    table["shares"] += [("all", kind, shares(kind=kind)) for kind in scenes.KINDS]
    table["ends"] = [(status, [len(of(method=m, status=status)) for m in methods]) for status, _ in statuses]
    table["defects"] = [(kind, [having(kind, m) for m in methods]) for kind, _ in faults]
    table["defects"] = table["defects"] or [("none", [0] * len(methods))]
    departs = [(kind, method, having(kind, method, "departures"), reason) for method, known in DEPARTS.items()
               for kind, reason in known.items()]
    return render("random.md", manifest=manifest, scenes=len({row["scene"] for row in rows}), runs=len(rows),
                  methods=methods, **table, departs=[row for row in departs if row[2]], kept=kept,
                  worst=worst if worst.get("penetration_of_size") else None, listing=listing(rows, methods))


def listing(rows, methods):
    """Which scenes fail how: method, fault or end, scenes."""
    ends = collections.defaultdict(dict)
    for row in rows:
        typed = {f"*{row['status']}*"} if row["verdict"] == "typed" else set()
        for end in typed | {kind_of(fault) for fault in row["faults"]}:
            ends[methods.index(row["method"]), end][f"{row['scene']} ({row['family']})"] = None
    return [(methods[m], end, ", ".join(some)) for (m, end), some in sorted(ends.items())]


def write_tables(rows, out, manifest):
    said = [{**row, "faults": "; ".join(row["faults"]), "departures": "; ".join(row["departures"])} for row in rows]
    write_table(said, COLUMNS, out / "random.csv")
    (out / "random.md").write_text(page(rows, manifest))


def deaf():
    """An interruption is for the campaign, which lets its workers finish the runs that they are at."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_all(todo, known, record, count):
    """Runs what is to do; each row goes to the file and into `known` at once. An interruption leaves what is
    finished."""
    began = time.monotonic()
    with open(record, "a") as file, concurrent.futures.ProcessPoolExecutor(count, initializer=deaf) as pool:
        futures = [pool.submit(do, job) for job in todo]
        try:
            for done, future in enumerate(program.as_they_end(futures), start=1):
                row = future.result()
                known[row["key"]] = row
                file.write(json.dumps(row) + "\n")
                file.flush()
                if row["verdict"] == "defect":
                    print(*(row[key] for key in ("scene", "family", "kind", "method")),
                          f"prune {row['prune']}: {row['status']}; {'; '.join(row['faults'])}", flush=True)
                if done % 50 == 0:
                    left = (time.monotonic() - began) / done * (len(todo) - done)
                    print(f"{done} of {len(todo)}, {left:.0f} s left", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            print("interrupted; the same command goes on", file=sys.stderr)


def reduce_all(done, out):
    """One reduced scene for each label, family and method, the first of its (row, job)."""
    first = {}
    for row, job in done:
        if row["verdict"] not in ("ok", "model") and label(row) not in ("pruning", "time_limit"):
            first.setdefault((label(row), row["family"], row["method"]), (row, job))
    for (kind, _, method), (row, job) in first.items():

        def same(path, kind=kind, job=job):
            try:
                model = look.Model(path)
                if look.initial_penetration(model) > 1e-9:
                    return False
                with tempfile.TemporaryDirectory(prefix="reduce") as folder:
                    return label(examine(job, path, model, folder)[0]) == kind
            except (ValueError, OSError):
                return False

        name = f"{row['scene']}__{method.replace('/', '-')}__{kind}"
        print(f"{name}: {reduce.reduce(Path(job['path']), out / 'reduced' / f'{name}.xml', same)}", flush=True)


def flags_of(options):
    """What the command says besides of which runs there are and how they end."""
    several = {"--family": options.family, "--method": options.method, "--prune": options.prune}
    one = {"--first": options.first, "--kind": options.kind}
    if options.time_limit != TIME_LIMIT:
        one["--time-limit"] = f"{options.time_limit:g}"
    said = [(flag, value) for flag, values in several.items() for value in values or ()]
    said += [(flag, value) for flag, value in one.items() if value]
    return " --shapes" * options.shapes + "".join(f" {flag} {value}" for flag, value in said)


def main(options):
    """Runs what scripts/stress.py --random asks for; returns the exit code: 3 where there is a defect, 1 where runs are
    left."""
    numbers = range(options.first, options.first + options.random)
    some = [scenes.make(options.seed, number, options.shapes) for number in numbers]
    some = [
        scene for scene in some
        if (not options.family or scene.family in options.family) and options.kind in (None, scene.kind)]
    if options.random and not some:
        print(
            f"none of the scenes {numbers.start} to {numbers.stop - 1} is of that family and kind; there are "
            f"{', '.join(scenes.FAMILIES)}; with --shapes {', '.join(scenes.SHAPES)}", file=sys.stderr)
        return 2
    if options.write_scenes:
        for scene in some:
            print(scenes.write(scene, options.write_scenes))
        return 0
    program.hold_to("--method", options.method, list(METHODS))
    options.time_limit, out = options.time_limit or TIME_LIMIT, options.out
    out.mkdir(parents=True, exist_ok=True)
    record = out / "random_runs.jsonl"
    jobs, known = list(jobs_of(some, options)), finished(record)
    todo = [job for job in jobs if job["key"] not in known]
    print(f"{len(some)} scenes, {len(jobs)} runs, {len(jobs) - len(todo)} of them done before", file=sys.stderr,
          flush=True)
    run_all(todo, known, record, options.jobs)
    done = [(known[job["key"]], job) for job in jobs if job["key"] in known]  # not all, where one interrupts
    rows = [row for row, _ in done]
    disagreements(rows)
    version = next((row["git"] for row in rows if row.get("git")), "a program that said nothing of itself")
    command = f"scripts/stress.py --random {options.random} --seed {options.seed}{flags_of(options)}"
    write_tables(rows, out, {"git": version, "command": command, "runs": len(jobs)})
    if options.reduce:
        reduce_all(done, out)
    count = collections.Counter(row["verdict"] for row in rows)
    print(f"{len(rows)} runs: {count['ok']} ok, {count['model']} as their law allows, {count['typed']} typed, "
          f"{count['defect']} defects; {out}/random.md")
    if len(rows) < len(jobs):
        return 1
    return 3 if count["defect"] else 0
