"""The campaign of random scenes: runs every method over them with and without pruning, looks at each run, writes the tables.

Each finished run is one line of random_runs.jsonl in the folder of the results; a run that is there already, of the same program, scene
and limit, is not done again. So a campaign that was stopped goes on, and one with more scenes begins where the smaller one ended.
"""
import collections
import concurrent.futures
import csv
import hashlib
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from stressing import look, random_scenes, reduce
from sweeping import one

METHODS = {"ap/lemke": ["--method", "ap", "--solver", "lemke"], "ap/path": ["--method", "ap", "--solver", "path"],
           "ap/ynl": ["--method", "ap", "--solver", "ynl"], "convex/bound-on": ["--method", "convex", "--compression-bound", "on"],
           "convex/bound-off": ["--method", "convex", "--compression-bound", "off"], "newton": ["--method", "newton"],
           "newton/stick-tested": ["--method", "newton", "--variant", "stick-tested"], "mirtich": ["--method", "mirtich"]}
MEMORY_MB = 2000
TIME_LIMIT = 10.0  # s of waiting that a run may take
LATE = 2.0         # s after its limit of time that a run may come back, on a machine with other work
COLUMNS = ["scene", "family", "kind", "method", "prune", "verdict", "status", "faults", "penetration_m", "penetration_of_size", "where", "energy_gain",
           "event_energy_gain", "momentum_of_bound", "false_claims", "residual", "t_reached", "events", "run_s", "reason", "again", "command"]


def wall_limit(time_limit):
    """A run that is still there then does not hear its own limit: a hang."""
    return 1.5 * time_limit + 5


def run(program, path, flags, time_limit, folder, statuses):
    """One run of a scene file into `folder`: (status, reason, hung, summary or None)."""
    limits = ["--record-every", "1", "--time-limit", f"{time_limit:g}", "--memory-limit", str(MEMORY_MB)]
    command = [program, "run", str(path), *flags, *limits, "--out", str(folder), "--quiet"]
    code, stopped, peak, said = one.execute(command, wall_limit(time_limit), (2 * MEMORY_MB + 256) << 20)
    summary = one.read_json(Path(folder) / "summary.json")
    asked = {"asked": {"scene": path.stem, "method": flags[flags.index("--method") + 1]}, "statuses": statuses,
             "wall_limit_s": wall_limit(time_limit), "memory_limit_mb": MEMORY_MB}
    status, reason = one.verdict(code, stopped, peak, said, summary, asked)
    return status, reason, stopped, None if one.fault_of(summary, asked) else summary


def examine(program, path, model, flags, time_limit, folder, statuses):
    """A run and the look at it: what a row of the table is made of. A fault counts as a defect where the run says `ok`; a crash, a hang
    and damaged numbers always do."""
    began = time.monotonic()
    status, reason, hung, summary = run(program, path, flags, time_limit, folder, statuses)
    took = time.monotonic() - began
    row = {"status": status, "reason": reason, "faults": [], "false_claims": 0, "run_s": round(took, 3)}
    if hung:
        row["faults"].append("hang: stopped from outside")
    elif took > time_limit + LATE:
        row["faults"].append(f"late: came back {took - time_limit:.1f} s after its limit")
    elif status in ("crash", "input_error"):
        row["faults"].append(f"{status}: {reason}"[:200])
    if summary:
        seen = look.look(folder, model, summary)
        row.update(penetration_m=seen.penetration, penetration_of_size=seen.penetration_relative, where=seen.where, energy_gain=seen.energy_gain,
                   event_energy_gain=seen.event_gain, momentum_of_bound=seen.momentum, false_claims=summary["residuals"]["false_claims"],
                   residual=summary["residuals"]["max"], git=summary["versions"]["git"], t_reached=summary["t_reached"], events=summary["events"])
        row["faults"] += [fault for fault in seen.faults if status == "ok" or fault.startswith("files")]
        if status == "ok" and row["false_claims"]:
            row["faults"].append(f"claims: {row['false_claims']} claims of success were refuted")
    row["verdict"] = "defect" if row["faults"] else "ok" if status == "ok" else "typed"
    return row, summary


def label(row):
    """What a reduced scene must still show: the kind of the first fault, or the status."""
    return row["faults"][0].split(":")[0] if row["faults"] else row["status"]


def digest(*parts):
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def keep(failing, row, path, files, folder, summary, program, flags):
    """Keeps a failing run's scene, its hard problem and the commands; returns whether the problem fails again by its command."""
    place = failing / f"{row['scene']}__{row['method'].replace('/', '-')}__prune-{row['prune']}"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for source in [path] + [path.parent / name for name in files]:
        shutil.copy(source, place)
    lines = [f"{row['status']}: {row['reason']}", *row["faults"], f"contactbench run {path.name} {' '.join(flags)}"]
    again = ""
    problem = (summary or {}).get("hard_problem")
    if problem and (Path(folder) / problem).exists():
        shutil.copy(Path(folder) / problem, place)
        command = summary.get("hard_problem_command")
        if command:
            lines.append(command)
            words = [program if word.endswith("contactbench") else word for word in command.split()]
            code, stopped, _, _ = one.execute(words_in(words, place), 60, (2 * MEMORY_MB + 256) << 20)
            again = "no" if code == 0 and not stopped else "yes"
    (place / "how.txt").write_text("\n".join(lines) + "\n")
    return again


def words_in(words, place):
    """The command's files, which stand in `place`, by their whole path."""
    return [str(place / word) if (place / word).is_file() else word for word in words]


def do(job):
    path, flags = Path(job["path"]), job["flags"]
    with tempfile.TemporaryDirectory(prefix="campaign") as folder:
        row, summary = examine(job["program"], path, look.Model(path), flags, job["time_limit"], folder, job["statuses"])
        row = {**{key: job[key] for key in ("scene", "family", "kind", "method", "prune", "key")}, **row,
               "command": f"contactbench run {path.name} {' '.join(flags)}", "again": ""}
        if row["verdict"] != "ok":
            row["again"] = keep(Path(job["failing"]), row, path, job["files"], folder, summary, job["program"], flags)
    return row


def jobs_of(scenes, options, out, statuses):
    program_hash = hashlib.sha256(Path(options.program).read_bytes()).hexdigest()[:16]
    for scene in scenes:
        path = random_scenes.write(scene, out / "scenes")
        for method, flags in METHODS.items():
            if options.method and method not in options.method:
                continue
            for prune in options.prune or ["on", "off"]:
                key = digest(program_hash, scene.xml(), *scene.files.values(), method, prune, f"{options.time_limit:g}", source_of_look())
                yield {"scene": scene.name, "family": scene.family, "kind": scene.kind, "method": method, "prune": prune, "key": key, "path": str(path),
                       "files": list(scene.files), "flags": flags + ["--prune", prune], "program": options.program, "time_limit": options.time_limit,
                       "statuses": statuses, "failing": str(out / "failing")}


def source_of_look():
    """Another look is another run: it sees the files, which are not kept."""
    return digest(Path(look.__file__).read_text())


def finished(path):
    rows = {}
    if path.exists():
        for line in path.read_text().splitlines():
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
        if len(pair) == 2 and pair["on"]["status"] != pair["off"]["status"] and "time_limit" not in (pair["on"]["status"], pair["off"]["status"]):
            for row in pair.values():
                row["faults"] = row["faults"] + [f"pruning: {pair['on']['status']} with it, {pair['off']['status']} without"]
                row["verdict"] = "defect"


def share(rows):
    ok = sum(row["status"] == "ok" for row in rows)
    return f"{ok}/{len(rows)}" if rows else ""


def write_tables(rows, out, manifest):
    with open(out / "random.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({**{key: "" if row.get(key) is None else row.get(key) for key in COLUMNS}, "faults": "; ".join(row["faults"])})
    (out / "random.md").write_text("\n".join(table(rows, manifest)) + "\n")


def table(rows, manifest):
    methods = [name for name in METHODS if any(row["method"] == name for row in rows)]
    of = lambda **want: [row for row in rows if all(row[key] == value for key, value in want.items())]
    scenes = len({row["scene"] for row in rows})
    lines = ["# Random scenes", "", f"Made by `{manifest['command']}` (`docs/campaign.md`): {scenes} scenes, {len(rows)} runs"
             f"{'' if len(rows) == manifest['runs'] else ' of ' + str(manifest['runs']) + ' (interrupted)'} of contactbench {manifest['git']}; "
             "`random.csv` has every run.", "", "Share of runs that end `ok`, with pruning and without:", "",
             "| family | kind | " + " | ".join(methods) + " |", "|---" * (len(methods) + 2) + "|"]
    for family in random_scenes.FAMILIES:
        for kind in random_scenes.KINDS:
            if of(family=family, kind=kind):
                lines.append(f"| {family} | {kind} | " + " | ".join(share(of(family=family, kind=kind, method=m)) for m in methods) + " |")
    for kind in random_scenes.KINDS:
        lines.append(f"| all | {kind} | " + " | ".join(share(of(kind=kind, method=m)) for m in methods) + " |")
    statuses = collections.Counter(row["status"] for row in rows)
    faults = collections.Counter(fault.split(":")[0] for row in rows for fault in row["faults"])
    lines += ["", "| how runs end | " + " | ".join(methods) + " |", "|---" * (len(methods) + 1) + "|"]
    for status, _ in statuses.most_common():
        lines.append(f"| {status} | " + " | ".join(str(len(of(method=m, status=status))) for m in methods) + " |")
    lines += ["", "| defects | " + " | ".join(methods) + " |", "|---" * (len(methods) + 1) + "|"]
    for kind, _ in faults.most_common():
        lines.append(f"| {kind} | " + " | ".join(str(sum(any(f.startswith(kind + ":") for f in row["faults"]) for row in of(method=m))) for m in methods) + " |")
    if not faults:
        lines.append("| none |" + " 0 |" * len(methods))
    worst = max((row for row in rows if row["status"] == "ok"), key=lambda row: row.get("penetration_of_size") or 0, default=None)
    if worst and worst.get("penetration_of_size"):
        lines += ["", f"Deepest penetration with `ok`: {worst['penetration_of_size']:.3g} of the size, {worst['penetration_m']:.3g} m ({worst['scene']}, "
                  f"{worst['method']}, {worst['where']})."]
    lines += listing(rows, methods)
    typed = [row for row in rows if row["verdict"] == "typed" and row["again"]]
    if typed:
        lines += ["", f"Of {len(typed)} kept problems {sum(row['again'] == 'yes' for row in typed)} fail again by the command that is kept with them."]
    return lines


def listing(rows, methods):
    """Which scenes fail how."""
    ends = collections.defaultdict(dict)
    for row in rows:
        for end in {fault.split(":")[0] for fault in row["faults"]} | ({f"*{row['status']}*"} if row["verdict"] == "typed" else set()):
            ends[methods.index(row["method"]), end][f"{row['scene']} ({row['family']})"] = None
    if not ends:
        return []
    lines = ["", "| method | defect or *end* | scenes |", "|---|---|---|"]
    return lines + [f"| {methods[m]} | {end} | {', '.join(scenes)} |" for (m, end), scenes in sorted(ends.items())]


def scenes_of(options):
    for number in range(options.first, options.first + options.random):
        scene = random_scenes.make(options.seed, number)
        if (not options.family or scene.family in options.family) and (not options.kind or scene.kind == options.kind):
            yield scene


def main(options):
    """Runs what scripts/stress.py --random asks for; returns the exit code."""
    scenes = list(scenes_of(options))
    if options.write_scenes:
        for scene in scenes:
            print(random_scenes.write(scene, options.write_scenes))
        return 0
    options.time_limit = options.time_limit or TIME_LIMIT
    listed = json.loads(subprocess.run([options.program, "list", "--json"], check=True, capture_output=True, text=True).stdout)
    statuses = [s["name"] for s in listed["statuses"]]
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    record = out / "random_runs.jsonl"
    jobs, known = list(jobs_of(scenes, options, out, statuses)), finished(record)
    todo = [job for job in jobs if job["key"] not in known]
    print(f"{len(scenes)} scenes, {len(jobs)} runs, {len(jobs) - len(todo)} of them done before", file=sys.stderr, flush=True)
    run_all(todo, known, record, options.jobs)
    rows = [known[job["key"]] for job in jobs if job["key"] in known]
    disagreements(rows)
    version = next((row["git"] for row in rows if row.get("git")), "a program that said nothing of itself")
    command = f"scripts/stress.py --random {options.random} --seed {options.seed}" + (f" --first {options.first}" if options.first else "")
    write_tables(rows, out, {"git": version, "command": command, "runs": len(jobs)})
    if options.reduce:
        reduce_all(rows, jobs, out)
    count = collections.Counter(row["verdict"] for row in rows)
    print(f"{len(rows)} runs: {count['ok']} ok, {count['typed']} typed, {count['defect']} defects; {out}/random.md")
    return 1 if count["defect"] or len(rows) < len(jobs) else 0


def deaf():
    """An interruption is for the campaign, which lets its workers finish the runs that they are at."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_all(todo, known, record, count):
    """Runs what is to do; each row goes to the file and into `known` at once. An interruption leaves what is finished."""
    began = time.monotonic()
    with open(record, "a") as file, concurrent.futures.ProcessPoolExecutor(count, initializer=deaf) as pool:
        futures = [pool.submit(do, job) for job in todo]
        try:
            for done, future in enumerate(concurrent.futures.as_completed(futures), start=1):
                row = future.result()
                known[row["key"]] = row
                file.write(json.dumps(row) + "\n")
                file.flush()
                if row["verdict"] == "defect":
                    print(f"{row['scene']} {row['family']} {row['kind']} {row['method']} prune {row['prune']}: {row['status']}; {'; '.join(row['faults'])}", flush=True)
                if done % 50 == 0:
                    spent = time.monotonic() - began
                    print(f"{done} of {len(todo)}, {spent / done * (len(todo) - done):.0f} s left", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            print("interrupted; the same command goes on", file=sys.stderr)


def reduce_all(rows, jobs, out):
    """One reduced scene for each label, family and method, the first of its rows."""
    seen = set()
    for row, job in zip(rows, jobs):
        kind = (label(row), row["family"], row["method"])
        if row["verdict"] == "ok" or kind in seen or label(row) == "pruning":
            continue
        seen.add(kind)

        def same(path):
            try:
                model = look.Model(path)
                if look.initial_penetration(model) > 1e-9:
                    return False
                with tempfile.TemporaryDirectory(prefix="reduce") as folder:
                    return label(examine(job["program"], path, model, job["flags"], job["time_limit"], folder, job["statuses"])[0]) == label(row)
            except (ValueError, OSError):
                return False

        name = f"{row['scene']}__{row['method'].replace('/', '-')}__{label(row)}"
        target = reduce.reduce(Path(job["path"]), out / "reduced" / f"{name}.xml", same)
        print(f"{name}: {target}", flush=True)
