"""Runs every method and solver over the stiff and extreme cases (scenarios/stress/cases.toml) and says of each cell
whether it is a right answer, a typed failure, a departure that the model itself explains, or a defect of the program.

  scripts/stress.py --jobs 4                    all of it: results/stress/{stress.csv,stress.md,heatmap.png,heatmap.svg}
  scripts/stress.py --quick                     the first row of each case
  scripts/stress.py --engines                   the engines that are installed too (docs/engines.md)
  scripts/stress.py --only M1 --only T2         some cases, printed only
  scripts/stress.py --accuracy 1e-6             every scene by a wanted accuracy in place of its step; printed only
  scripts/stress.py --random 100 --seed 7       instead: a campaign of random scenes (docs/campaign.md),
                                                results/stress/random.{csv,md}; goes on where it was stopped

Verdicts:
  right    the error is within the case's bound
  typed    the program says itself that there is no (accurate) answer; with --accuracy: that it is further off than
           what was wanted
  model    the checked residual is at most 1e-6: the answer is what the method's model says, which departs from the
           case's expectation for a reason that cases.toml names for this method
  engine   an engine is off, crashes, hangs or ends in NaN: its own, whatever the bound. One that ends well and whose
           answer cannot be measured (nobody sees its events) has no cell
  wrong    the same without such a reason
  silent   `ok` although the checked residual is above 1e-6, or the claim of success was refuted and not reported
  defect   crash, no return, garbage, NaN in a file
The exit code is 3 where a cell is wrong, silent or defect.
"""
import json
import math
import os
import sys
import tempfile
import time
import tomllib
from pathlib import Path

from . import campaign, limits, measures, problems, program, scenes
from .measures import BAD, VERDICTS
from .plan import member_flags
from .program import ROOT, digest
from .runs import table_of as read_table
from .runs import write_table
from .templates import render

CASES = ROOT / "scenarios" / "stress" / "cases.toml"
COLUMNS = [
    "id", "scene", "row", "method", "verdict", "status", "error", "bound", "residual", "energy_gain", "penetration",
    "share", "solve_s", "iterations", "expect", "note", "command"]
MEASURED = ("residual", "energy_gain", "penetration", "solve_s", "iterations")
LEFT_OUT = {"pgs"}  # a solver that A-P's LCP is not for (docs/adding.md)
MEMORY_MB = 4000
DEPARTS = {}  # the general ones of the cases
BLANK = {
    **dict.fromkeys(COLUMNS), "hung": False, "nan": False, "false_claims": 0, "place": None, "memory": None,
    "engine": False, "wanted": 0.0, "estimate": 0.0}
NEAR = 10  # times of a wanted accuracy within which an error is (docs/stepping.md)


def methods_of(listed):
    """Columns of the table: name, flags. The convex method's gap is relative, so that scales do not matter."""
    for method, variant, solver in program.choices(listed, LEFT_OUT)[0]:
        flags = {option["flag"] for option in method["options"]}
        for bound in ["on", "off"] if "compression-bound" in flags else [""]:
            name, chosen = method["name"], ["--method", method["name"]]
            for flag, choice, said in (("solver", solver if len(method["solvers"]) > 1 else "", solver),
                                       ("variant", variant, variant), ("compression-bound", bound, f"bound-{bound}")):
                if choice:
                    name, chosen = f"{name}/{said}", chosen + [f"--{flag}", choice]
            yield name, chosen + (["--epsilon-relative", "1e-14"] if "epsilon-relative" in flags else [])


OF_ENGINES = {"--step", "--duration", "--friction", "--restitution", "--perturb", "--seed"}  # flags that they have too


def engines_of(listed):
    """Columns of the engines that are here, each with its first way of solving, at its defaults."""
    for engine in listed.get("engines", []):
        if not engine["unavailable"]:
            variant = engine["variants"][0]["name"]
            yield f"{engine['name']}/{variant}", ["--engine", engine["name"], "--variant", variant]


def takes(flags, row):
    """Whether a column's program has all flags of a row."""
    return "--engine" not in flags or all(name in OF_ENGINES for name in row if name.startswith("--"))


def row_text(row):
    return " ".join(f"{name} {value}" if name.startswith("--") else f"{name}={value}"
                    for name, value in row.items()) or "as it is"


def row_flags(row):
    return [
        word for name, value in row.items()
        for word in ((name, str(value)) if name.startswith("--") else ("--set", f"{name}={value}"))]


def with_accuracy(flags, accuracy):
    """Flags of a run by a wanted accuracy (m, or as much of the scene's own unit) in place of a step."""
    if not accuracy:
        return flags
    accuracy *= next((float(word[6:]) for word in flags if word.startswith("metre=")), 1)
    at = flags.index("--step") if "--step" in flags else len(flags)
    return [*flags[:at], *flags[at + 2:], "--accuracy", f"{accuracy:g}", "--record-interval", "1e-3"]


def scene_file(name):
    stress = ROOT / "scenarios" / "stress" / f"{name}.xml"
    return stress if stress.exists() else ROOT / "scenarios" / f"{name}.xml"


def rows_of(case, quick):
    """All rows; quick: the first, and one to compare with it where the measure compares."""
    return case["rows"][:2 if case.get("measure") == "same_as_first" else 1] if quick else case["rows"]


def plan(cases, columns, options):
    """All runs: dictionaries with case, row, method and flags; those of an ensemble carry size and seed, those of the
    other program its path."""
    jobs, quick = [], options.quick
    if options.accuracy:  # which engines do not have
        columns = [c for c in columns if "--engine" not in c[1]]
    for number, case in enumerate(cases["case"]):
        if options.only and case["id"] not in options.only or quick and case.get("long"):
            continue
        if options.accuracy and case.get("measure") in measures.BY_STEPS:
            continue
        chosen, first = [c for c in columns if c[0] in case.get("methods", [c[0]])], case["rows"][0]
        if case.get("other_program") and options.other_program and not options.accuracy:
            jobs += [{
                "case": number, "row": "by the other program", "first": False, "method": name,
                "flags": flags + row_flags(first), "drawn": None, "program": options.other_program}
                     for name, flags in chosen]
        drawn = [(size, seed) for size in case["perturb"]
                 for seed in range(1, 2 if quick else case["ensemble"] + 1)] if "ensemble" in case else [None]
        jobs += [{
            "case": number, "row": row_text(row), "first": row == first, "method": name, "drawn": one,
            "program": options.program, "flags": flags + row_flags(row) +
            (["--perturb", f"{one[0]:g}", "--seed", str(one[1])] if one else [])} for row in rows_of(case, quick)
                 for name, flags in chosen if takes(flags, row) for one in drawn]
    return [{
        **job, "flags": with_accuracy(job["flags"], options.accuracy) +
        ([] if "--engine" in job["flags"] else member_flags(options.member, job["flags"]))} for job in jobs]


def do_run(job, case, options):
    scene, limit = scene_file(case["scene"]), case.get("time_limit_s", options.time_limit)
    cell = {
        **BLANK, "engine": "--engine" in job["flags"], "command": " ".join([
            "contactbench", "run", str(scene.relative_to(ROOT)), *job["flags"]])}
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        cell["status"], cell["note"], cell["hung"], summary = program.watched(
            job["program"], scene, [*job["flags"], "--time-limit", f"{limit:g}"], folder, options.statuses,
            3 * limit + 20, MEMORY_MB)
        if not summary:
            return cell
        run, residuals = measures.Run(summary, Path(folder)), summary["residuals"]
        cell |= {
            "residual": residuals["max"], "false_claims": residuals["false_claims"],
            "energy_gain": summary["energy"]["max_gain_relative"], "penetration": summary["max_penetration"],
            "solve_s": summary["time"]["solve_s"], "iterations": summary["iterations_total"],
            "memory": summary["peak_memory_mb"], "nan": run.has_nan(), "wanted": options.accuracy,
            "estimate": summary.get("accuracy", {}).get("estimated_error_m", 0.0) /
            float(summary["parameters"].get("metre", 1))}
        if cell["status"] in ("ok", "inaccurate") and not cell["nan"]:
            error, note = getattr(measures, case["measure"])(run, case)
            cell["place" if isinstance(error, list) else "error"] = error
            cell["note"] = note or (cell["note"] if cell["status"] != "ok" else "")
    return cell


def reason_of(case, method):
    for departs in (case.get("departs", {}), DEPARTS):
        for name, reason in departs.items():
            if method == name or method.startswith(name + "/"):
                return reason
    return ""


def judge(cell, case, method):
    """The verdict of a cell; see the head of this file. None of what has none."""
    if cell["engine"]:
        if cell["status"] in ("crash", "not_finite") or cell["hung"] or cell["nan"]:
            return "engine"
        if cell["status"] != "ok":
            return "typed"
        return None if cell["error"] is None else "right" if cell["error"] <= case["bound"] else "engine"
    if cell["status"] == "crash" or cell["hung"] or cell["nan"]:
        return "defect"
    if cell["status"] not in ("ok", "inaccurate"):
        return "typed"
    if (cell["residual"] or 0) > 1e-6:
        return "silent" if cell["status"] == "ok" else "typed"
    if cell["status"] == "ok" and cell["false_claims"]:
        return "silent"
    if cell["error"] is None:
        return "defect"
    if cell["error"] <= max(case["bound"], NEAR * cell["wanted"]):
        return "right"
    if cell["estimate"] > cell["wanted"]:
        return "typed"
    if reason_of(case, method):
        return "model"
    return "typed" if cell["status"] == "inaccurate" else "wrong"


def judged(cell, case, method):
    """Fills in the verdict, and the reason of a departure."""
    cell["verdict"] = judge(cell, case, method)
    if cell["verdict"] == "model":
        cell["note"] = (cell["note"] + "; " if cell["note"] else "") + reason_of(case, method)


def fold(cells):
    """An ensemble as one cell: the worst verdict, the largest of each number, and the share within the bound."""
    worst = max(cells, key=lambda c: list(VERDICTS).index(c["verdict"]))
    right = sum(c["verdict"] == "right" for c in cells)
    most = {key: max((c[key] for c in cells if c[key] is not None), default=None) for key in ("error", *MEASURED)}
    return {
        **worst, **most, "share": right / len(cells),
        "note": f"{right} of {len(cells)} within the bound; " + worst["note"]}


def do_limit(row, case, options):
    """The largest stable step of a scene, measured and estimated, as a row of the table."""
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        measured, estimate = limits.stable_step(options.program, scene_file(case["scene"]), row_flags(row), folder)
    error = abs(estimate / measured - 1)
    return {
        **BLANK, **{key: case[key] for key in ("id", "scene", "bound", "expect")}, "row": row_text(row),
        "method": "explicit step",
        "verdict": "right" if error <= case["bound"] else "wrong", "status": "ok", "error": error, "command": " ".join([
            "contactbench", "check", case["scene"],
            *row_flags(row)]), "note": f"measured {measured:.4g} s, estimated {estimate:.4g} s"}


def solve(kind, arguments, options):
    """`solve` of one stored problem: status, its last words, its answer, the largest velocity of a contact after the
    event, exit code."""
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        u = Path(folder) / "u.mtx"
        more = ["--time-limit", f"{options.time_limit:g}", *(["--velocities", u] if kind == "contact" else [])]
        try:
            ended = program.call(options.program, "solve", *arguments, "--json", *more,
                                 timeout=3 * options.time_limit + 20)
            code, said = ended.returncode, ended.stderr.strip()
            answer = json.loads(ended.stdout) if ended.stdout.strip() else {}
        except program.Late:
            return "time_limit", "did not come back", {}, None, -9
        except ValueError:
            code, said, answer = 1, "what it printed is no JSON", {}
        values = program.read_vector(u)
        speed = max((math.hypot(*values[i:i + 3])
                     for i in range(0, len(values), 3)), default=0.0) if u.exists() else None  # n, t1, t2
    status = "input_error" if code == 2 else answer.get("status", "crash") if code in (0, 3) else "crash"
    return status, said.splitlines()[-1] if said and code else "", answer, speed, code


def do_critical(case, column, options):
    """From which value of a parameter on does it stand? By bisection, as a row of the table."""
    method, flags = column
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:

        def arch(value):
            path = Path(folder) / "arch.dat"
            path.write_text(problems.arch(value))
            status, _, answer, speed, code = solve("contact", [str(path), "--kind", "contact", *flags], options)
            return "crash" if code == -9 else status, answer.get(
                "residual"), speed is not None and speed < 1e-6 * problems.FALL

        def scene(value):
            lengths = ["--duration", f"{case['duration']:g}", "--time-limit", f"{options.time_limit:g}"]
            more = ["--set", f"{case['parameter']}={value!r}", *lengths]
            command = program.run_words(options.program, scene_file(case["scene"]), [*flags, *more], folder)
            (Path(folder) / "summary.json").unlink(missing_ok=True)
            program.execute(command, 3 * options.time_limit + 20, program.addresses(MEMORY_MB))
            summary = program.read_json(Path(folder) / "summary.json")
            if summary is None:
                return "crash", None, False
            moved, _ = measures.displacement(measures.Run(summary, Path(folder)), case)
            return summary["status"], summary["residuals"]["max"], moved < 1e-9

        found = limits.bisect(arch if case["scene"] == "arch" else scene, case["from"], case["to"], case["bound"] / 10)
    cell = {
        **BLANK,
        **{key: case[key] for key in ("id", "scene", "bound", "expect")}, "row": f"critical {case['parameter']}",
        "method": method, "command": f"scripts/stress.py --only {case['id']} --method {method}", "status": found.status,
        "residual": found.residual, "note": found.note,
        "error": math.inf if found.value is None else abs(found.value / case["critical"] - 1)}
    judged(cell, case, method)
    return cell | {"error": None if found.value is None else cell["error"]}


def do_problem(job, options):
    """One stored problem through `solve`."""
    status, said, answer, speed, code = solve(job["kind"], job["arguments"], options)
    residual = answer.get("residual")
    cell = {
        **BLANK, "status": status, "note": answer.get("reason") or said,
        "residual": residual, "solve_s": answer.get("time_min_s"), "iterations": answer.get(
            "iterations", answer.get("pivots")), "error": residual, "bound": 1e-6, "command": job["text"]}
    if answer.get("condition"):
        cell["note"] = (cell["note"] + "; " if cell["note"] else "") + \
            f"rank {answer['rank']} of {answer['rows']} rows, condition {answer['condition']:.2g}"
    solved = status in ("ok", "inaccurate") and residual is not None and residual <= 1e-6
    off = abs(speed - job["speed"]) if job["speed"] is not None and speed is not None else 0.0
    if status == "crash" or code == -9 or (code == 0 and residual is None):
        cell["verdict"] = "defect"
    elif not solved:
        cell["verdict"] = "silent" if status == "ok" else "typed"
    elif "solved" not in job["ends"]:
        gives_way = any(job["method"].startswith(name + "/") for name in job["case"].get("gives_way", []))
        cell["verdict"] = "model" if gives_way else "wrong"
        cell["note"] = f"solved, although it must end as one of: {', '.join(job['ends'])}"
        if gives_way:
            cell["note"] = reason_of(job["case"], job["method"])
    elif off > 1e-3 * max(job["speed"] or 0, 1e-9) + 1e-9:
        cell["error"], cell["bound"] = off, 1e-9
        cell["verdict"] = "model" if reason_of(job["case"], job["method"]) else "wrong"
        cell["note"] = f"moves with {speed:.3g} m/s, not {job['speed']:.3g}; " + cell["note"]
    else:
        cell["verdict"] = "right"
    return cell


def problem_jobs(cases, columns, listed, only, scratch):
    lcp_solvers = dict.fromkeys(
        s["name"] for s in listed["solvers"] if not s["unavailable"] and s["method"] in (None, "", "ap"))
    jobs = []
    for case in cases["problem"]:
        if only and case["id"] not in only:
            continue
        folder = ROOT / case.get("folder", "test/data/problems")
        files = [(f, folder / f, case["ends"], None) for f in case.get("files", [])]
        for name, text, ends, speed in problems.made() if case.get("generated") else []:
            files.append((name, Path(scratch) / f"{name}.dat", ends, speed))
            files[-1][1].write_text(text)
        for name, path, ends, speed in files:
            job = {"kind": case["kind"], "id": case["id"], "name": name, "ends": ends, "speed": speed, "case": case}
            if case["kind"] == "lcp":
                words = "--kind lcp --matrix {0}.M.mtx --vector {0}.q.mtx --solver {1}"
                jobs += [{
                    **job, "method": f"ap/{solver}", "arguments": words.format(path, solver).split(),
                    "text": "contactbench solve " + words.format(name, solver)} for solver in lcp_solvers]
            else:
                jobs += [{
                    **job, "method": column, "arguments": [str(path), "--kind", "contact", *flags],
                    "text": f"contactbench solve {path.name} --kind contact {' '.join(flags)}"}
                         for column, flags in columns]
    return jobs


def number(x):
    return "" if x is None else f"{x:.3g}" if isinstance(x, float) else str(x)


def shown(cell):
    """A cell in the page."""
    if cell is None:
        return ""
    if cell["verdict"] == "typed":
        return f"*{cell['status']}*"
    if cell["verdict"] == "right":
        return "right" if cell["share"] is None else f"right, {100 * cell['share']:.0f} %"
    return f"**{cell['verdict']}** {cell['status'] if cell['error'] is None else number(cell['error'])}"


def write_tables(rows, out, manifest):
    write_table(rows, COLUMNS, out / "stress.csv")
    names, table = list(dict.fromkeys(row["method"] for row in rows)), {}
    for row in rows:
        table.setdefault((row["id"], row["scene"], row["row"], row["expect"]), {})[row["method"]] = row
    count = {v: [sum(r["verdict"] == v and r["method"] == n for r in rows) for n in names] for v in VERDICTS}
    (out / "stress.md").write_text(
        render("stress.md", names=names, count=count, manifest=manifest, shown=shown, table=table))
    (out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


def manifest_of(options, runs):
    said = {"git": program.version(options.program), "program": digest(options.program), "cpu": program.cpu()}
    said |= {"made": time.strftime("%Y-%m-%d", time.gmtime()), "runs": runs, "quick": options.quick}
    return said | {"time_limit_s": options.time_limit, "load_average": os.getloadavg()[0]}


def in_place(rows, out, made):
    """The rows of OUT's table with these in their places; its manifest says what they were made with."""
    def cell(column, text):
        if column not in ("error", "bound", "share"):
            return text
        return None if text == "" else int(text) if text.lstrip("-").isdigit() else float(text)

    def key(row):
        return tuple(str(row[column] or "") for column in ("id", "scene", "row", "method"))

    new = {key(row): row for row in rows}
    before = [{column: cell(column, text) for column, text in row.items()}
              for row in read_table(out / "stress.csv").to_dict("records")]
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["columns_of_others"] = [
        *(one for one in manifest.get("columns_of_others", []) if one["columns"] != made["columns"]), made]
    after = [new.pop(key(row), row) for row in before]
    if new:
        raise program.ProgramError(f"{out / 'stress.csv'} has no row {' '.join(next(iter(new)))}: make the whole table")
    return after, manifest


def compare(jobs, cells, cases):
    """What needs a case's first row in the same column: places, and memory. Then the verdicts. An engine has none where
    its runs do not have what a case measures; one that has it in another row has not done what is measured."""
    memory, first = {}, {}  # MB; where it ended
    for job, cell in sorted(zip(jobs, cells), key=lambda pair: not pair[0]["first"]):
        case, column = cases["case"][job["case"]], (job["case"], job["method"])
        if cell["place"] is not None:
            if job["first"]:
                first[column] = cell["place"]
            if column in first:
                cell["error"] = max(abs(a - b) for a, b in zip(first[column], cell["place"]))
            else:
                cell |= {"error": None, "note": "the first row has no answer to compare with", "status": "unsupported"}
        if case.get("memory_growth_mb") and cell["memory"] is not None:
            growth = cell["memory"] - memory.setdefault(column, cell["memory"])
            cell["note"] = f"creep {number(cell['error'])} m, memory {growth:+.1f} MB from the first row's"
            if growth > case["memory_growth_mb"]:
                cell["error"] = math.inf
        judged(cell, case, job["method"])
    measured = {(job["case"], job["method"]) for job, cell in zip(jobs, cells) if cell["error"] is not None}
    for job, cell in zip(jobs, cells):
        if cell["verdict"] is None and (job["case"], job["method"]) in measured:
            cell["verdict"] = "engine"


def table_of(jobs, cells, cases):
    """A row a case, a row of its parameters and a method: an ensemble is one; what has no verdict is none."""
    groups = {}
    for job, cell in ((j, c) for j, c in zip(jobs, cells) if c["verdict"]):
        perturbed = f" perturbed by {job['drawn'][0]:g} m" if job["drawn"] and job["drawn"][0] else ""
        groups.setdefault((job["case"], job["row"] + perturbed, job["method"]), []).append(cell)
    return [{
        **(fold(group) if len(group) > 1 else group[0]), "row": text, "method": method, **{
            key: cases["case"][number_of][key] for key in ("id", "scene", "bound", "expect")}}
            for (number_of, text, method), group in groups.items()]


def results(futures):
    """Of all, with the time left now and then."""
    began = time.monotonic()
    for done, future in enumerate(program.as_they_end(futures), start=1):
        future.result()  # a fault ends all
        if done % 50 == 0:
            left = (time.monotonic() - began) / done * (len(futures) - done)
            print(f"{done} of {len(futures)}, {left:.0f} s left", file=sys.stderr, flush=True)
    return [future.result() for future in futures]


def run_all(cases, options):
    """All cells, as rows of the table; and how many runs."""
    listed = program.listed(options.program)
    options.statuses = program.statuses_of(listed)
    every, beside = list(methods_of(listed)), list(engines_of(listed)) if options.engines else []
    program.hold_to("--method", options.method, [*(name for name, _ in every + beside), *(f"ap/{s}" for s in LEFT_OUT)])
    columns, beside = ([c for c in some if not options.method or c[0] in options.method] for some in (every, beside))
    with tempfile.TemporaryDirectory(prefix="stress") as options.scratch, program.workers(options.jobs) as pool:
        jobs = plan(cases, columns + beside, options)
        solves = [] if options.accuracy else [
            j for j in problem_jobs(cases, columns, listed, options.only, options.scratch)
            if not options.method or j["method"] in options.method]
        futures = [pool.submit(do_run, job, cases["case"][job["case"]], options) for job in jobs]
        futures += [pool.submit(do_problem, job, options) for job in solves]
        wanted = {
            kind:
            [case for case in cases[kind] if not options.accuracy and (not options.only or case["id"] in options.only)]
            for kind in ("limit", "critical")}
        found = [
            pool.submit(do_limit, row, case, options) for case in wanted["limit"]
            for row in rows_of(case, options.quick)]
        found += [
            pool.submit(do_critical, case, column, options) for case in wanted["critical"] if not options.quick
            for column in columns]
        cells = results(futures + found)
    cells, limits_found = cells[:len(futures)], cells[len(futures):]
    compare(jobs, cells, cases)
    rows = table_of(jobs, cells, cases)
    rows += [{
        **cell, "id": job["id"], "scene": job["name"], "row": "stored problem", "method": job["method"],
        "expect": "ends: " + ", ".join(job["ends"])} for job, cell in zip(solves, cells[len(jobs):])]
    return rows + limits_found, len(cells)


def arguments():
    parser = program.flags(__doc__)
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, default=ROOT / "results/stress")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", action="append", default=[], metavar="ID",
                        help="only these cases; prints, writes no table")
    parser.add_argument("--method", action="append", default=[], help="only these columns, as in --method ap/lemke")
    parser.add_argument("--in-place", action="store_true",
                        help="with --method: their rows in place of those in OUT's table; all other rows stay")
    parser.add_argument("--engines", action="store_true", help="the engines that are installed beside the methods")
    parser.add_argument("--random", type=int, metavar="N", help="a campaign of N random scenes in place of the cases")
    parser.add_argument("--seed", type=int, default=1, help="of the random scenes [1]")
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="number of the first random scene [0]")
    parser.add_argument("--shapes", action="store_true", help="random scenes of the families with capsules and hulls")
    parser.add_argument("--family", action="append", choices=[*scenes.FAMILIES, *scenes.SHAPES],
                        help="only random scenes of this family")
    parser.add_argument("--kind", choices=scenes.KINDS, help="only random scenes of this kind")
    parser.add_argument("--prune", action="append", choices=["on", "off"], help="random scenes: only with this [both]")
    parser.add_argument("--write-scenes", type=Path, metavar="DIR",
                        help="writes the random scenes there and runs nothing")
    parser.add_argument("--reduce", action="store_true", help="makes failing random scenes smaller, into OUT/reduced")
    parser.add_argument("--other-program", metavar="PROGRAM",
                        help="a build that rounds in another way (preset portable), to compare with in N1")
    parser.add_argument("--accuracy", type=float, default=0.0, metavar="A",
                        help="m, that each run is to reach in place of its step")
    parser.add_argument("--member", type=int, default=0, metavar="N",
                        help="each run as member N of an ensemble (docs/numbers.md)")
    parser.add_argument("--quick", action="store_true",
                        help="the first row of each case but long ones, one seed of an ensemble")
    parser.add_argument("--time-limit", type=program.positive,
                        help=f"seconds a run may take [15; of a random scene {campaign.TIME_LIMIT:g}]")
    options = parser.parse_args()
    if options.in_place and (not options.method or options.only or options.accuracy or options.random is not None):
        parser.error("--in-place goes with --method, and without --only, --accuracy and --random")
    if options.in_place and not (options.out / "stress.csv").exists():
        parser.error(f"--in-place: {options.out} has no stress.csv")
    options.program = str(Path(options.program).resolve())
    options.other_program = options.other_program and str(Path(options.other_program).resolve())
    return options


def main():
    options = arguments()
    if options.random is not None:
        return campaign.main(options)
    options.time_limit = 15 if options.time_limit is None else options.time_limit
    cases, began = tomllib.loads(CASES.read_text()), time.monotonic()
    DEPARTS.update(cases.get("departs", {}))
    rows, runs = run_all(cases, options)
    for row in rows:
        if options.only or row["verdict"] in BAD:
            error, bound, residual = (number(row[key]) for key in ("error", "bound", "residual"))
            said = f"{row['verdict']:6} {row['id']:4} {row['scene']} [{row['row']}] {row['method']}: " \
                f"{row['status']}, error {error} (bound {bound}), residual {residual}; {row['note']}"
            print(said[:300])
    counts = ", ".join(f"{sum(r['verdict'] == v for r in rows)} {v}" for v in VERDICTS)
    print(f"{len(rows)} cells: {counts}; {runs} runs in {time.monotonic() - began:.0f} s")
    if options.in_place or not options.only and not options.method and not options.accuracy:
        from . import heatmap  # matplotlib is for this alone
        manifest = manifest_of(options, runs)
        if options.in_place:
            rows, manifest = in_place(rows, options.out, {"columns": options.method, **manifest})
        options.out.mkdir(parents=True, exist_ok=True)
        write_tables(rows, options.out, manifest)
        if not options.member:
            heatmap.draw(options.out / "stress.csv", options.out)
    return 3 if any(row["verdict"] in BAD for row in rows) else 0
