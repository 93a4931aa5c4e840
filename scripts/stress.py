#!/usr/bin/env python3
"""Runs every method and solver over the stiff and extreme cases (scenarios/stress/cases.toml) and says of each cell whether
it is a right answer, a typed failure, a departure that the model itself explains, or a defect of the program.

  scripts/stress.py --jobs 4                    all of it: results/stress/{stress.csv,stress.md,heatmap.png,heatmap.svg}
  scripts/stress.py --quick                     the first row of each case
  scripts/stress.py --only M1 --only T2         some cases, printed only
  scripts/stress.py --random 100 --seed 7       instead: a campaign of random scenes (docs/campaign.md), results/stress/random.{csv,md};
                                                goes on where it was stopped

Verdicts:
  right    the error is within the case's bound
  typed    the program says itself that there is no (accurate) answer
  model    the checked residual is at most 1e-6: the answer is what the method's model says, which departs from the case's
           expectation for a reason that cases.toml names for this method
  wrong    the same without such a reason
  silent   `ok` although the checked residual is above 1e-6, or the claim of success was refuted and not reported
  defect   crash, no return, garbage, NaN in a file
The exit code is 1 where a cell is wrong, silent or defect.
"""
import argparse
import concurrent.futures
import csv
import hashlib
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import interpreter

interpreter.need("matplotlib", "numpy", "tomllib")
import tomllib  # noqa: E402

from stressing import campaign, critical, measures, problems, random_scenes, stability_limit  # noqa: E402
from sweeping import one  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
CASES = ROOT / "scenarios" / "stress" / "cases.toml"
COLUMNS = ["id", "scene", "row", "method", "verdict", "status", "error", "bound", "residual", "energy_gain", "penetration",
           "share", "solve_s", "iterations", "expect", "note", "command"]
LEFT_OUT = {"pgs"}  # a solver that A-P's LCP is not for (docs/adding.md)
MEMORY_MB = 4000
BAD = ("wrong", "silent", "defect")
VERDICTS = ["right", "model", "typed", "wrong", "silent", "defect"]


def methods_of(listed):
    """Columns of the table: name, flags. The convex method's gap is relative, so that scales do not matter."""
    unavailable = {(s["method"], s["name"]) for s in listed["solvers"] if s["unavailable"]}
    for method in listed["methods"]:
        flags = {option["flag"] for option in method["options"]}
        for solver in method["solvers"] or [""]:
            if solver in LEFT_OUT or (method["name"], solver) in unavailable:
                continue
            for variant in method["variants"] or [""]:
                for bound in ["on", "off"] if "compression-bound" in flags else [""]:
                    name, chosen = method["name"], ["--method", method["name"]]
                    if solver and len(method["solvers"]) > 1:
                        name, chosen = f"{name}/{solver}", chosen + ["--solver", solver]
                    if variant:
                        name, chosen = f"{name}/{variant}", chosen + ["--variant", variant]
                    if bound:
                        name, chosen = f"{name}/bound-{bound}", chosen + ["--compression-bound", bound]
                    if "epsilon-relative" in flags:
                        chosen = chosen + ["--epsilon-relative", "1e-14"]
                    yield name, chosen


def row_text(row):
    return " ".join(f"{name}={value}" if not name.startswith("--") else f"{name} {value}" for name, value in row.items()) or "as it is"


def row_flags(row):
    flags = []
    for name, value in row.items():
        flags += [name, str(value)] if name.startswith("--") else ["--set", f"{name}={value}"]
    return flags


def scene_file(name):
    stress = ROOT / "scenarios" / "stress" / f"{name}.xml"
    return stress if stress.exists() else ROOT / "scenarios" / f"{name}.xml"


def rows_of(case, quick):
    """All rows; quick: the first, and one to compare with it where the measure compares."""
    return case["rows"][:2 if case.get("measure") == "same_as_first" else 1] if quick else case["rows"]


def plan(cases, columns, options):
    """All runs: dictionaries with case, row, method and flags; those of an ensemble carry size and seed, those of the other
    program its path."""
    jobs, quick = [], options.quick
    for number, case in enumerate(cases["case"]):
        if options.only and case["id"] not in options.only or quick and case.get("long"):
            continue
        chosen = [c for c in columns if c[0] in case.get("methods", [c[0]])]
        if case.get("other_program") and options.other_program:
            jobs += [{"case": number, "row": "by the other program", "first": False, "method": name, "flags": flags + row_flags(case["rows"][0]),
                      "drawn": None, "program": options.other_program} for name, flags in chosen]
        for row in rows_of(case, quick):
            for name, flags in chosen:
                seeds = [(size, seed) for size in case["perturb"] for seed in range(1, 2 if quick else case["ensemble"] + 1)] if "ensemble" in case else [None]
                for drawn in seeds:
                    extra = ["--perturb", f"{drawn[0]:g}", "--seed", str(drawn[1])] if drawn else []
                    jobs.append({"case": number, "row": row_text(row), "first": row == case["rows"][0], "method": name,
                                 "flags": flags + row_flags(row) + extra, "drawn": drawn})
    return jobs


def do_run(job, case, options, statuses):
    scene = scene_file(case["scene"])
    flags = list(job["flags"])
    if "--record-every" not in flags:
        flags += ["--record-every", "1"]
    limit = case.get("time_limit_s", options.time_limit)
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        command = [job.get("program", options.program), "run", str(scene), *flags, "--time-limit", f"{limit:g}", "--memory-limit", str(MEMORY_MB),
                   "--out", folder, "--quiet"]
        wall = 3 * limit + 20
        code, stopped, peak, said = one.execute(command, wall, (2 * MEMORY_MB + 256) << 20)
        summary = one.read_json(Path(folder) / "summary.json")
        asked = {"asked": {"scene": case["scene"], "method": job["method"].split("/")[0]}, "statuses": statuses,
                 "wall_limit_s": wall, "memory_limit_mb": MEMORY_MB}
        status, reason = one.verdict(code, stopped, peak, said, summary, asked)
        cell = {"status": status, "note": reason, "hung": stopped, "error": None, "residual": None, "energy_gain": None,
                "penetration": None, "solve_s": None, "iterations": None, "place": None, "memory": None, "nan": False, "false_claims": 0,
                "command": " ".join(["contactbench", "run", str(scene.relative_to(ROOT)), *job["flags"]])}
        if one.fault_of(summary, asked):
            return cell
        residuals = summary["residuals"]
        cell.update(residual=residuals["max"], false_claims=residuals["false_claims"], energy_gain=summary["energy"]["max_gain_relative"],
                    penetration=summary["max_penetration"], solve_s=summary["time"]["solve_s"], iterations=summary["iterations_total"], memory=summary["peak_memory_mb"])
        run = measures.Run(summary, Path(folder))
        cell["nan"] = run.has_nan()
        if status in ("ok", "inaccurate") and not cell["nan"]:
            error, note = getattr(measures, case["measure"])(run, case, job["row"])
            if isinstance(error, list):
                cell["place"] = error
            else:
                cell["error"] = error
            cell["note"] = note or (reason if status != "ok" else "")
        return cell


def judge(cell, case, method):
    """The verdict of a cell; see the head of this file."""
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
    if cell["error"] <= case["bound"]:
        return "right"
    return "model" if reason_of(case, method) else "wrong"


def reason_of(case, method):
    for departs in (case.get("departs", {}), DEPARTS):
        for name, reason in departs.items():
            if method == name or method.startswith(name + "/"):
                return reason
    return ""


DEPARTS = {}


def fold(cells):
    """An ensemble as one cell: the worst verdict, medians, and the share within the bound."""
    worst = max(cells, key=lambda c: VERDICTS.index(c["verdict"]))
    share = sum(c["verdict"] == "right" for c in cells) / len(cells)
    errors = [c["error"] for c in cells if c["error"] is not None]
    known = lambda key: [c[key] for c in cells if c[key] is not None]
    return {**worst, "share": share, "error": max(errors, default=None),
            **{key: max(known(key), default=None) for key in ("residual", "energy_gain", "penetration", "solve_s", "iterations")},
            "note": f"{sum(c['verdict'] == 'right' for c in cells)} of {len(cells)} within the bound; " + worst["note"]}


def do_limit(row, case, options):
    """The largest stable step of a scene, measured and estimated, as a row of the table."""
    text, command = row_text(row), ["contactbench", "check", case["scene"], *row_flags(row)]
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        measured, estimate = stability_limit.measure(options.program, scene_file(case["scene"]), row_flags(row), folder)
    error = abs(estimate / measured - 1)
    return {"id": case["id"], "scene": case["scene"], "row": text, "method": "explicit step", "verdict": "right" if error <= case["bound"] else "wrong",
            "status": "ok", "error": error, "bound": case["bound"], "residual": None, "energy_gain": None, "penetration": None, "share": None,
            "solve_s": None, "iterations": None, "expect": case["expect"], "command": " ".join(command),
            "note": f"measured {measured:.4g} s, estimated {estimate:.4g} s"}


def solve(kind, arguments, options):
    """`solve` of one stored problem: status, its last words, its answer, the largest velocity of a contact after the event, exit code."""
    command = [options.program, "solve", *arguments, "--json"]
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        u = Path(folder) / "u.mtx"
        command += ["--velocities", str(u)] if kind == "contact" else ["--time-limit", f"{options.time_limit:g}"]
        try:
            ended = subprocess.run(command, capture_output=True, text=True, timeout=3 * options.time_limit + 20)
            code, said = ended.returncode, ended.stderr.strip()
            answer = json.loads(ended.stdout) if ended.stdout.strip() else {}
        except subprocess.TimeoutExpired:
            return "time_limit", "did not come back", {}, None, -9
        except ValueError:
            code, said, answer = 1, "what it printed is no JSON", {}
        speed = None
        if u.exists():
            values = [float(line) for line in u.read_text().split("\n")[2:] if line and not line.startswith("%")]
            speed = max((math.hypot(*values[i : i + 3]) for i in range(0, len(values), 3)), default=0.0)  # n, t1, t2
    status = "input_error" if code == 2 else answer.get("status", "crash") if code in (0, 3) else "crash"
    return status, said.splitlines()[-1] if said and code else "", answer, speed, code


def do_critical(case, column, options):
    """From which value of a parameter on does it stand? By bisection, as a row of the table."""
    method, flags = column
    cell = {"id": case["id"], "scene": case["scene"], "row": f"critical {case['parameter']}", "method": method, "bound": case["bound"],
            "expect": case["expect"], "energy_gain": None, "penetration": None, "share": None, "solve_s": None, "iterations": None,
            "command": f"scripts/stress.py --only {case['id']} --method {method}"}
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        if case["scene"] == "arch":
            def trial(value):
                path = Path(folder) / "arch.dat"
                path.write_text(problems.arch(value))
                status, _, answer, speed, code = solve("contact", [str(path), "--kind", "contact", *flags], options)
                return "crash" if code == -9 else status, answer.get("residual"), speed is not None and speed < 1e-6 * problems.FALL
        else:
            def trial(value):
                command = [options.program, "run", str(scene_file(case["scene"])), *flags, "--set", f"{case['parameter']}={value!r}",
                           "--duration", f"{case['duration']:g}", "--time-limit", f"{options.time_limit:g}", "--out", folder, "--quiet"]
                (Path(folder) / "summary.json").unlink(missing_ok=True)
                one.execute(command, 3 * options.time_limit + 20, (2 * MEMORY_MB + 256) << 20)
                summary = one.read_json(Path(folder) / "summary.json")
                if summary is None:
                    return "crash", None, False
                run = measures.Run(summary, Path(folder))
                return run.summary["status"], run.summary["residuals"]["max"], measures.displacement(run, case, {})[0] < 1e-9
        found = critical.bisect(trial, case["from"], case["to"], case["bound"] / 10)
    cell.update(status=found.status, residual=found.residual, note=found.note)
    cell["error"] = None if found.value is None else abs(found.value / case["critical"] - 1)
    cell["verdict"] = judge({**cell, "hung": False, "nan": False, "false_claims": 0, "error": math.inf if found.value is None else cell["error"]},
                            case, method)
    if cell["verdict"] == "model":
        cell["note"] += "; " + reason_of(case, method)
    return cell


def do_problem(job, options):
    """One stored problem through `solve`."""
    status, said, answer, speed, code = solve(job["kind"], job["arguments"], options)
    hung = code == -9
    if job["speed"] is None:
        speed = None
    residual = answer.get("residual")
    cell = {"status": status, "note": answer.get("reason") or said, "residual": residual,
            "energy_gain": None, "penetration": None, "solve_s": answer.get("time_min_s"), "iterations": answer.get("iterations", answer.get("pivots")),
            "share": None, "error": residual, "bound": 1e-6, "command": job["text"]}
    if answer.get("condition"):
        cell["note"] = (cell["note"] + "; " if cell["note"] else "") + f"rank {answer['rank']} of {answer['rows']} rows, condition {answer['condition']:.2g}"
    solved = status in ("ok", "inaccurate") and residual is not None and residual <= 1e-6
    if status == "crash" or hung or (code == 0 and residual is None):
        cell["verdict"] = "defect"
    elif status == "ok" and not solved:
        cell["verdict"] = "silent"
    elif not solved:
        cell["verdict"] = "typed"
    elif "solved" not in job["ends"]:
        cell["verdict"], cell["note"] = "wrong", f"solved, although it must end as one of: {', '.join(job['ends'])}"
    elif speed is not None and abs(speed - job["speed"]) > 1e-3 * max(job["speed"], 1e-9) + 1e-9:
        cell["error"], cell["bound"] = abs(speed - job["speed"]), 1e-9
        cell["verdict"] = "model" if reason_of(job["case"], job["method"]) else "wrong"
        cell["note"] = f"moves with {speed:.3g} m/s, not {job['speed']:.3g}; " + cell["note"]
    else:
        cell["verdict"] = "right"
    return cell


def problem_jobs(cases, columns, listed, only, scratch):
    data = ROOT / "test" / "data" / "problems"
    lcp_solvers = [s["name"] for s in listed["solvers"] if not s["unavailable"] and s["method"] in (None, "", "ap")]
    lcp_solvers = list(dict.fromkeys(lcp_solvers))
    jobs = []
    for case in cases["problem"]:
        if only and case["id"] not in only:
            continue
        if case.get("generated"):
            files = []
            for name, text, ends, speed in problems.made():
                path = Path(scratch) / f"{name}.dat"
                path.write_text(text)
                files.append((name, path, ends, speed))
        else:
            folder = ROOT / case["folder"] if "folder" in case else data
            files = [(f, folder / f, case["ends"], None) for f in case["files"]]
        for name, path, ends, speed in files:
            if case["kind"] == "lcp":
                for solver in lcp_solvers:
                    arguments = ["--kind", "lcp", "--matrix", f"{path}.M.mtx", "--vector", f"{path}.q.mtx", "--solver", solver]
                    jobs.append({"kind": "lcp", "id": case["id"], "name": name, "method": f"ap/{solver}", "ends": ends, "speed": None,
                                 "case": case, "arguments": arguments,
                                 "text": f"contactbench solve --kind lcp --matrix {name}.M.mtx --vector {name}.q.mtx --solver {solver}"})
            else:
                for column, flags in columns:
                    jobs.append({"kind": "contact", "id": case["id"], "name": name, "method": column, "ends": ends, "speed": speed,
                                 "case": case, "arguments": [str(path), "--kind", "contact", *flags],
                                 "text": f"contactbench solve {path.name} --kind contact {' '.join(flags)}"})
    return jobs


def number(x):
    if x is None:
        return ""
    return f"{x:.3g}" if isinstance(x, float) else str(x)


def write_tables(rows, columns, out, manifest):
    with open(out / "stress.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({**row, **{key: "" if row[key] is None else row[key] for key in COLUMNS}})
    names = list(dict.fromkeys(row["method"] for row in rows))
    lines = ["# Stiff and extreme cases", "",
             "Made by `scripts/stress.py`; `stress.csv` has every number and the command that repeats it, `docs/stability.md` the reasons.",
             "Each cell: the verdict, and the error where it is over the bound or the status where the program ended the run itself.", ""]
    count = {v: sum(r["verdict"] == v for r in rows) for v in VERDICTS}
    lines += ["| verdict | " + " | ".join(names) + " | all |", "|---" * (len(names) + 2) + "|"]
    for v in VERDICTS:
        lines.append(f"| {v} | " + " | ".join(str(sum(r["verdict"] == v and r["method"] == n for r in rows)) for n in names) + f" | {count[v]} |")
    lines += ["", "| id | scene | row | expected | " + " | ".join(names) + " |", "|---" * (4 + len(names)) + "|"]
    table = {}
    for row in rows:
        table.setdefault((row["id"], row["scene"], row["row"], row["expect"]), {})[row["method"]] = row
    for (ident, scene, text, expect), cells in table.items():
        shown = []
        for name in names:
            cell = cells.get(name)
            if cell is None:
                shown.append("")
            elif cell["verdict"] == "typed":
                shown.append(f"*{cell['status']}*")
            elif cell["verdict"] == "right":
                shown.append("right" if cell["share"] is None else f"right, {100 * cell['share']:.0f} %")
            else:
                shown.append(f"**{cell['verdict']}** {number(cell['error'])}")
        lines.append("| " + " | ".join([ident, scene, text, expect] + shown) + " |")
    lines += ["", f"Program {manifest['git']} on {manifest['cpu']}, {manifest['made']}; {manifest['runs']} runs."]
    (out / "stress.md").write_text("\n".join(lines) + "\n")
    (out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "build/bin/contactbench"))
    parser.add_argument("--out", type=Path, default=ROOT / "results/stress")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", action="append", default=[], metavar="ID", help="only these cases; prints, writes no table")
    parser.add_argument("--method", action="append", default=[], help="only these columns, as in --method ap/lemke")
    parser.add_argument("--random", type=int, metavar="N", help="a campaign of N random scenes in place of the cases")
    parser.add_argument("--seed", type=int, default=1, help="of the random scenes [1]")
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="number of the first random scene [0]")
    parser.add_argument("--family", action="append", choices=list(random_scenes.FAMILIES), help="only random scenes of this family")
    parser.add_argument("--kind", choices=random_scenes.KINDS, help="only random scenes of this kind")
    parser.add_argument("--prune", action="append", choices=["on", "off"], help="random scenes: only with this [both]")
    parser.add_argument("--write-scenes", type=Path, metavar="DIR", help="writes the random scenes there and runs nothing")
    parser.add_argument("--reduce", action="store_true", help="makes failing random scenes smaller, into OUT/reduced")
    parser.add_argument("--other-program", metavar="PROGRAM", help="a build that rounds in another way (preset portable), to compare with in N1")
    parser.add_argument("--quick", action="store_true", help="the first row of each case but long ones, one seed of an ensemble")
    parser.add_argument("--time-limit", type=float, help=f"seconds a run may take [15; of a random scene {campaign.TIME_LIMIT:g}]")
    options = parser.parse_args()
    options.program = str(Path(options.program).resolve())
    if options.random is not None:
        sys.exit(campaign.main(options))
    options.time_limit = options.time_limit or 15
    if options.other_program:
        options.other_program = str(Path(options.other_program).resolve())

    listed = json.loads(subprocess.run([options.program, "list", "--json"], check=True, capture_output=True, text=True).stdout)
    statuses = [s["name"] for s in listed["statuses"]]
    cases = tomllib.loads(CASES.read_text())
    DEPARTS.update(cases.get("departs", {}))
    columns = [c for c in methods_of(listed) if not options.method or c[0] in options.method]
    rows, began = [], time.monotonic()
    with tempfile.TemporaryDirectory(prefix="stress") as scratch, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        options.scratch = scratch
        jobs = plan(cases, columns, options)
        solves = [j for j in problem_jobs(cases, columns, listed, options.only, scratch) if not options.method or j["method"] in options.method]
        futures = [pool.submit(do_run, job, cases["case"][job["case"]], options, statuses) for job in jobs]
        futures += [pool.submit(do_problem, job, options) for job in solves]
        limits = [pool.submit(do_limit, row, case, options) for case in cases["limit"] if not options.only or case["id"] in options.only
                  for row in rows_of(case, options.quick)]
        limits += [pool.submit(do_critical, case, column, options) for case in cases["critical"] if not options.quick
                   and (not options.only or case["id"] in options.only) for column in columns]
        cells = []
        for number_done, future in enumerate(futures, start=1):
            cells.append(future.result())
            if number_done % 50 == 0:
                spent = time.monotonic() - began
                print(f"{number_done} of {len(futures)}, {spent / number_done * (len(futures) - number_done):.0f} s left", file=sys.stderr, flush=True)

    memory = {}  # MB, of the case's first row in the same column
    first = {}  # where the case's first row of the same column ended
    for job, cell in sorted(zip(jobs, cells), key=lambda pair: not pair[0]["first"]):
        case = cases["case"][job["case"]]
        if cell["place"] is not None:
            if job["first"]:
                first[job["case"], job["method"]] = cell["place"]
            other = first.get((job["case"], job["method"]))
            if other is None:
                cell["error"], cell["note"] = None, "the first row has no answer to compare with"
                cell["status"] = "unsupported"
            else:
                cell["error"] = max(abs(a - b) for a, b in zip(other, cell["place"]))
        if case.get("memory_growth_mb") and cell["memory"] is not None:
            memory.setdefault((job["case"], job["method"]), cell["memory"])
            growth = cell["memory"] - memory[job["case"], job["method"]]
            cell["note"] = f"creep {number(cell['error'])} m, memory {growth:+.1f} MB from the first row's"
            if growth > case["memory_growth_mb"]:
                cell["error"] = math.inf
        cell["verdict"] = judge(cell, case, job["method"])
        if cell["verdict"] == "model":
            cell["note"] = (cell["note"] + "; " if cell["note"] else "") + reason_of(case, job["method"])
    groups = {}
    for job, cell in zip(jobs, cells):
        size = job["drawn"][0] if job["drawn"] else None
        groups.setdefault((job["case"], job["row"] + (f" perturbed by {size:g} m" if size else ""), job["method"]), []).append(cell)
    for (number_of, text, method), group in groups.items():
        case = cases["case"][number_of]
        cell = fold(group) if len(group) > 1 else {**group[0], "share": None}
        rows.append({**cell, "id": case["id"], "scene": case["scene"], "row": text, "method": method, "bound": case["bound"],
                     "expect": case["expect"]})
    for job, cell in zip(solves, cells[len(jobs):]):
        rows.append({**cell, "id": job["id"], "scene": job["name"], "row": "stored problem", "method": job["method"],
                     "expect": "ends: " + ", ".join(job["ends"])})
    rows += [future.result() for future in limits]

    for row in rows:
        if options.only or row["verdict"] in BAD:
            print(f"{row['verdict']:6} {row['id']:4} {row['scene']} [{row['row']}] {row['method']}: {row['status']}, "
                  f"error {number(row['error'])} (bound {number(row['bound'])}), residual {number(row['residual'])}; {row['note']}"[:300])
    bad = [row for row in rows if row["verdict"] in BAD]
    print(f"{len(rows)} cells: " + ", ".join(f"{sum(r['verdict'] == v for r in rows)} {v}" for v in VERDICTS)
          + f"; {len(cells)} runs in {time.monotonic() - began:.0f} s")
    if not options.only and not options.method:
        options.out.mkdir(parents=True, exist_ok=True)
        said = subprocess.run([str(options.program), "--version"], capture_output=True, text=True).stdout
        version = next(iter(re.findall(r"git ([^;)]*)", said)), "a program that said nothing of itself")
        cpu = next((line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "unknown")
        manifest = {"git": version, "program": hashlib.sha256(Path(options.program).read_bytes()).hexdigest()[:16], "cpu": cpu,
                    "made": time.strftime("%Y-%m-%d", time.gmtime()), "runs": len(cells), "quick": options.quick, "time_limit_s": options.time_limit,
                    "load_average": os.getloadavg()[0]}
        write_tables(rows, columns, options.out, manifest)
        from stressing import heatmap
        heatmap.draw(options.out / "stress.csv", options.out)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
