#!/usr/bin/env python3
"""Gathers the runs into one tidy table (runs.csv: a row a run), a manifest, and the processing times (timings.md, .csv)."""
import argparse
import csv
import json
import os
import statistics
import sys
from pathlib import Path

# Column of runs.csv: where it comes from. `run.` is run.json (what was asked), the rest is summary.json.
COLUMNS = {
    "run": "run.run", "scene": "run.scene", "parameters": None, "method": "run.method", "variant": "run.variant",
    "solver": "run.solver", "k": "run.k", "epsilon": "run.epsilon", "repeat": "run.repeat", "status": "run.status",
    "reason": "run.reason", "finished": "finished", "step": "options.step", "duration": "options.duration", "t_reached": "t_reached",
    "steps": "steps", "events": "events", "contacts_max": "contacts_max", "solves": "solves",
    "iterations_total": "iterations_total", "processing_s": None, "total_s": "time.total_s",
    "dynamics_s": "time.dynamics_s", "collision_s": "time.collision_s", "assembly_s": "time.assembly_s",
    "solve_s": "time.solve_s", "write_s": "time.write_s", "peak_memory_mb": "peak_memory_mb",
    "residual_max": "residuals.max", "residual_median": "residuals.median", "law_residual_max": "residuals.law_max",
    "gap_max_j": "residuals.gap_max_j", "infeasibility_max": "residuals.infeasibility_max",
    "inaccurate_events": "residuals.inaccurate_events", "false_claims": "residuals.false_claims",
    "max_penetration": "max_penetration", "max_gain_j": "energy.max_gain_j", "max_gain_relative": "energy.max_gain_relative",
}


def read(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return {}


def lookup(tree, path):
    for key in path.split("."):
        if not isinstance(tree, dict) or key not in tree:
            return None
        tree = tree[key]
    return tree


def text(value):
    """As JSON would print it: numbers read back as the same double; missing is empty, never 0."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)


def processing_s(summary):
    """Seconds of dynamics, collision, assembly and solve: what the paper calls processing time. The check of each answer
    by the referee (in total_s) and writing (not in it) are no part of a method."""
    parts = [lookup(summary, f"time.{part}_s") for part in ("dynamics", "collision", "assembly", "solve")]
    return None if None in parts else sum(parts)


def row_of(record, summary):
    row = {}
    for column, source in COLUMNS.items():
        if source is None:
            continue
        row[column] = text(lookup(record, source[4:]) if source.startswith("run.") else lookup(summary, source))
    row["parameters"] = " ".join(f"{n}={v}" for n, v in record["sets"].items())
    row["processing_s"] = text(processing_s(summary))
    for name, value in (summary.get("errors") or {}).items():
        row[f"error_{name}"] = text(value)
    return row


def write_csv(path, columns, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def cell_of(row):
    return tuple(row[c] for c in ("scene", "parameters", "method", "variant", "solver", "k", "epsilon"))


def timings(rows):
    """A row a cell: minimum and median of the repeats; status and time reached where the run did not finish."""
    cells = {}
    for row in rows:
        cells.setdefault(cell_of(row), []).append(row)
    out = []
    for cell, repeats in cells.items():
        times = [float(r["processing_s"]) for r in repeats if r["processing_s"] and r["finished"] == "true"]
        # The worst repeat speaks for the cell: one that did not finish makes the cell unfinished.
        worst = next((r for r in repeats if r["finished"] != "true"), repeats[0])
        finished = all(r["finished"] == "true" for r in repeats)
        out.append(dict(zip(("scene", "parameters", "method", "variant", "solver", "k", "epsilon"), cell),
                        repeats=len(repeats), status=worst["status"], reason=worst["reason"],
                        t_reached=worst["t_reached"], duration=worst["duration"],
                        minimum_s=text(min(times)) if times and finished else "",
                        median_s=text(statistics.median(times)) if times and finished else ""))
    return out


def markdown(cells):
    """Rows methods, columns scenes: the median in seconds, or how the run ended and when."""
    def method(c):
        parts = [c["method"]] + [c[p] for p in ("variant", "solver") if c[p]]
        # k is the scene's own and stands in its column, unless the scene was run with several.
        return " ".join(parts + ([f"epsilon = {c['epsilon']} J"] if c["epsilon"] else []))

    edges = {}
    for c in cells:
        if c["k"]:
            edges.setdefault((c["scene"], c["parameters"]), []).append(c["k"])
    columns = []
    for c in cells:
        for k in dict.fromkeys(edges.get((c["scene"], c["parameters"]), [""])):
            if (c["scene"], c["parameters"], k) not in columns:
                columns.append((c["scene"], c["parameters"], k))
    table = {}
    for c in cells:
        entry = f"{float(c['median_s']):.3g}" if c["median_s"] else \
            f"{c['status']} at {float(c['t_reached']):.4g} s" if c["t_reached"] else c["status"]
        if c["median_s"] and c["status"] != "ok":
            entry += f" ({c['status']})"
        for column in columns:
            if column[:2] == (c["scene"], c["parameters"]) and (not c["k"] or column[2] == c["k"]):
                table.setdefault(method(c), {})[column] = entry

    def head(column):
        scene, parameters, k = column
        return " ".join([scene.replace("_", " ")] + ([parameters] if parameters else []) + ([f"(k = {k})"] if k else []))

    lines = ["| processing time, s | " + " | ".join(head(c) for c in columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for name in table:
        lines.append(f"| {name} | " + " | ".join(table[name].get(c, "") for c in columns) + " |")
    return lines


def manifest(profile, rows, summaries):
    """What made these results: machine, versions, flags; statuses counted. No dates, no paths."""
    def all_of(key):
        values = []
        for summary in summaries:
            if key in summary and summary[key] not in values:
                values.append(summary[key])
        return values[0] if len(values) == 1 else values
    count = {}
    for row in rows:
        count[row["status"]] = count.get(row["status"], 0) + 1
    return {"profile": profile, "runs": len(rows), "statuses": dict(sorted(count.items())),
            "machine": all_of("machine"), "versions": all_of("versions"),
            "python": ".".join(map(str, sys.version_info[:2]))}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", required=True, type=Path, help="folder that scripts/run_all.py filled")
    parser.add_argument("--out", required=True, type=Path, help="folder of runs.csv, manifest.json, timings.*")
    parser.add_argument("--profile", default="")
    arguments = parser.parse_args()

    rows, summaries = [], []
    for name in read(arguments.runs / "list.json") or sorted(os.listdir(arguments.runs)):
        record = read(arguments.runs / name / "run.json")
        if record:
            summary = read(arguments.runs / name / "summary.json")
            rows.append(row_of(record, summary))
            summaries.append(summary)
    # Cells in the order of the list; repeats of a cell together.
    order = {}
    for row in rows:
        order.setdefault(cell_of(row), len(order))
    rows.sort(key=lambda row: (order[cell_of(row)], int(row["repeat"])))

    errors = list(dict.fromkeys(c for row in rows for c in row if c.startswith("error_")))
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_csv(arguments.out / "runs.csv", list(COLUMNS) + errors, rows)
    (arguments.out / "manifest.json").write_text(json.dumps(manifest(arguments.profile, rows, summaries), indent=1) + "\n")
    cells = timings(rows)
    if cells:
        write_csv(arguments.out / "timings.csv", list(cells[0]), cells)
        (arguments.out / "timings.md").write_text("\n".join(markdown(cells)) + "\n")


if __name__ == "__main__":
    main()
