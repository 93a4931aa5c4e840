"""Gathers finished runs into one tidy table (runs.csv: a row a run) and the manifest of what made it."""
import csv
import json
import platform
from pathlib import Path

from . import reference
from .one import read_json

# Column: where it comes from. `run.` is run.json (what was asked and how it ended), the rest is summary.json.
COLUMNS = {
    "run": "run.run", "sweeps": None, "scene": "run.scene", "parameters": "run.parameters", "method": "run.method",
    "variant": "run.variant", "solver": "run.solver", "k": "run.k", "epsilon": "run.epsilon", "knobs": "run.knobs",
    "repeat": "run.repeat", "status": "run.status", "reason": "run.reason", "finished": "run.finished",
    "reference": "reference.kind", "step": "options.step", "duration": "options.duration", "compression_bound": "options.compression_bound",
    "t_reached": None, "steps": "steps", "events": "events", "contacts_max": "contacts_max", "solves": "solves",
    "iterations_total": "iterations_total", "processing_s": None, "total_s": "time.total_s",
    "dynamics_s": "time.dynamics_s", "collision_s": "time.collision_s", "assembly_s": "time.assembly_s",
    "solve_s": "time.solve_s", "write_s": "time.write_s", "wall_s": "run.wall_s", "other_cores": "run.other_cores",
    "busy": "run.busy", "peak_memory_mb": None,
    "residual_max": "residuals.max", "residual_median": "residuals.median", "law_residual_max": "residuals.law_max",
    "gap_max_j": "residuals.gap_max_j", "infeasibility_max": "residuals.infeasibility_max",
    "inaccurate_events": "residuals.inaccurate_events", "false_claims": "residuals.false_claims",
    "max_penetration": "max_penetration", "max_gain_j": "energy.max_gain_j", "max_gain_relative": "energy.max_gain_relative",
}
# Columns that differ from run to run of the same input; so do all of a run that a time or memory limit cut.
TIMING = ("processing_s", "total_s", "dynamics_s", "collision_s", "assembly_s", "solve_s", "write_s", "wall_s",
          "other_cores", "busy", "peak_memory_mb")


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


def row_of(run, record, summary, folder, certified):
    """`folder`: files of the run; `certified`: the scene's reference.Reference, or None."""
    row = {}
    for column, source in COLUMNS.items():
        if source is not None:
            row[column] = text(lookup(record, source[4:]) if source.startswith("run.") else lookup(summary, source))
    row["sweeps"] = " ".join(run.sweeps)
    row["processing_s"] = text(processing_s(summary))
    # A run that could not say it itself is judged from outside.
    for column in ("t_reached", "peak_memory_mb"):
        row[column] = text(summary[column] if column in summary else record[column])
    for name, value in (summary.get("errors") or {}).items():
        row[f"error_{name}"] = text(value)
    if certified and record["finished"]:
        row[f"error_{reference.ERROR}"] = text(certified.error(lookup(summary, "options.duration"), Path(folder) / "trajectory.csv"))
    return row


def same_or_list(summaries, key):
    values = []
    for summary in summaries:
        if key in summary and summary[key] not in values:
            values.append(summary[key])
    return values[0] if len(values) == 1 else values


def gather(plan, missing, runs, out, sweeps, profile, references):
    """Writes OUT/runs.csv (cells in the order of the sweep files, the repeats of a cell together) and OUT/manifest.json:
    machine, versions, flags, statuses counted, certified references used; no dates, no paths. `references`: {(scene, parameters):
    reference.Reference} of the scenes that have one, accepted or not."""
    order = {}
    for run in plan:
        order.setdefault(run.cell, len(order))
    rows, summaries, absent = [], [], 0
    for run in sorted(plan, key=lambda run: (order[run.cell], run.repeat)):
        record = read_json(Path(runs) / run.name / "run.json")
        if not isinstance(record, dict):
            absent += 1
            continue
        summary = read_json(Path(runs) / run.name / "summary.json") or {}
        rows.append(row_of(run, record, summary, Path(runs) / run.name, references.get((run.scene, run.asked()["parameters"]))))
        summaries.append(summary)
    errors = list(dict.fromkeys(c for row in rows for c in row if c.startswith("error_")))
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "runs.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(COLUMNS) + errors, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    count = {}
    for row in rows:
        count[row["status"]] = count.get(row["status"], 0) + 1
    manifest = {"sweeps": sweeps, "profile": profile, "runs": len(rows), "runs_not_done_yet": absent, "missing": missing,
                "statuses": dict(sorted(count.items())), "machine": same_or_list(summaries, "machine"),
                "versions": same_or_list(summaries, "versions"), "python": ".".join(platform.python_version_tuple()[:2]),
                "references": {reference.name_of(*scene): {key: found.about.get(key) for key in reference.SAID}
                               for scene, found in sorted(references.items())},
                "timing": {"runs_on_a_busy_machine": sum(r["busy"] == "true" for r in rows),
                           "runs_not_judged": sum(r["busy"] == "" for r in rows)}}
    (out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    return rows
