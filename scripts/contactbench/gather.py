"""The one table of runs (runs.csv: a row a run) and the manifest of what made it, from the folders of the runs.
Nothing but the standard library: a sweep starts at once, and what it forks is small."""
import collections
import csv
import json
import math
import platform
from pathlib import Path

from . import references
from .program import read_json

# Column: where it comes from. `run.` is run.json (what was asked and how it ended), the rest is summary.json.
COLUMNS = {
    "run": "run.run", "sweeps": None, "scene": "run.scene", "parameters": "run.parameters", "method": "run.method",
    "variant": "run.variant", "solver": "run.solver", "k": "run.k", "epsilon": "run.epsilon", "knobs": "run.knobs",
    "repeat": "run.repeat", "engine": "run.engine", "setting": "engine.setting", "precision": "engine.precision",
    "status": "run.status", "reason": "run.reason", "finished": "run.finished", "reference": "reference.kind",
    "step": "options.step", "duration": "options.duration", "compression_bound": "options.compression_bound",
    "t_reached": None, "steps": "steps", "events": "events", "contacts_max": "contacts_max", "solves": "solves",
    "iterations_total": "iterations_total", "processing_s": None, "total_s": "time.total_s",
    "dynamics_s": "time.dynamics_s", "collision_s": "time.collision_s", "assembly_s": "time.assembly_s",
    "solve_s": "time.solve_s", "write_s": "time.write_s", "wall_s": "run.wall_s", "other_cores": "run.other_cores",
    "busy": "run.busy", "peak_memory_mb": None, "residual_max": "residuals.max", "residual_median": "residuals.median",
    "law_residual_max": "residuals.law_max", "gap_max_j": "residuals.gap_max_j",
    "infeasibility_max": "residuals.infeasibility_max", "inaccurate_events": "residuals.inaccurate_events",
    "false_claims": "residuals.false_claims", "max_penetration": "max_penetration", "max_gain_j": "energy.max_gain_j",
    "max_gain_relative": "energy.max_gain_relative", "estimated_error_m": "accuracy.estimated_error_m",
    "switches": "accuracy.switches", "impacts": "accuracy.impacts", "first_order_steps": "accuracy.first_order_steps"}
# Columns that differ from run to run of the same input; so do all of a run that a time or memory limit cut.
TIMING = ("processing_s", "total_s", "dynamics_s", "collision_s", "assembly_s", "solve_s", "write_s", "wall_s",
          "other_cores", "busy", "peak_memory_mb")
PARTS = ("dynamics_s", "collision_s", "assembly_s", "solve_s")  # of processing time
CELL = ["scene", "parameters", "method", "variant", "solver", "k", "epsilon", "knobs"]
LIMITS = ("time_limit", "memory_limit")  # how far a run that they cut comes depends on the machine
# What right answers of one event may differ by (the referee's accepted residual, docs/judging.md), and four million
# roundings: numbers closer than this, as a fraction or in the unit of the number, whichever is more, are the same.
ROUNDING = 1e-9
# Flags that make another scene of one: where its bodies should be then is not what its certified reference says.
OTHER_SCENE = {"friction", "restitution"}


def lookup(tree, path: str):
    for key in path.split("."):
        if not isinstance(tree, dict) or key not in tree:
            return None
        tree = tree[key]
    return tree


def text(value):
    """As JSON would print it: numbers read back as the same double; missing is empty, never 0."""
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)


def processing_s(summary):
    """Seconds of dynamics, collision, assembly and solve: what the paper calls processing time. The check of each
    answer by the referee (in total_s) and writing (not in it) are no part of a method."""
    parts = [lookup(summary, f"time.{part}") for part in PARTS]
    return None if None in parts else sum(parts)


def row_of(run, record, summary, folder, certified):
    """`folder`: files of the run; `certified`: the scene's references.Reference, or None."""
    row = {
        column: text(lookup(record, source[4:]) if source.startswith("run.") else lookup(summary, source))
        for column, source in COLUMNS.items() if source}
    row |= {"sweeps": " ".join(run.sweeps), "member": str(run.member), "processing_s": text(processing_s(summary))}
    # A run that could not say it itself is judged from outside.
    row |= {
        column: text((summary if column in summary else record)[column]) for column in ("t_reached", "peak_memory_mb")}
    row |= {f"error_{name}": text(value) for name, value in (summary.get("errors") or {}).items()}
    if OTHER_SCENE & {*dict(run.knobs)}:
        certified = None
    if certified and record["finished"]:
        row[f"error_{references.ERROR}"] = text(
            certified.error(lookup(summary, "options.duration"),
                            Path(folder) / "trajectory.csv"))
    return row


def same_or_list(summaries, key):
    values = []
    for summary in summaries:
        if key in summary and summary[key] not in values:
            values.append(summary[key])
    return values[0] if len(values) == 1 else values


def rows_of(plan, runs, certified):
    """Rows and summaries of the runs that are there. `certified`: {(scene, parameters): references.Reference} of the
    scenes that have one, accepted or not."""
    rows, summaries = [], []
    for run in plan:
        folder = Path(runs) / run.name
        record = read_json(folder / "run.json")
        if isinstance(record, dict):
            summaries.append(read_json(folder / "summary.json") or {})
            rows.append(
                row_of(run, record, summaries[-1], folder, certified.get((run.scene, run.asked()["parameters"]))))
    return rows, summaries


def timing_of(rows):
    return {
        "runs_on_a_busy_machine": sum(row["busy"] == "true" for row in rows),
        "runs_not_judged": sum(row["busy"] == "" for row in rows)}


def gather(plan, members, missing, runs, out, sweeps, profile, certified):
    """Writes OUT/runs.csv (cells in the order of the sweep files, the repeats of a cell together), OUT/ensemble.csv
    (the members, where there are any) and OUT/manifest.json: machine, versions, flags, statuses counted, certified
    references used; no dates, no paths."""
    order, out = {}, Path(out)
    for run in plan:
        order.setdefault(run.cell, len(order))
    out.mkdir(parents=True, exist_ok=True)

    def table_of_runs(some, file, *more):
        some = sorted(some, key=lambda run: (order[run.cell], run.member, run.repeat))
        rows, summaries = rows_of(some, runs, certified)
        errors = dict.fromkeys(c for row in rows for c in row if c.startswith("error_"))
        with open(out / file, "w", newline="") as table:
            writer = csv.DictWriter(table, [*more, *COLUMNS, *errors], "", "ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        return rows, summaries

    (out / "ensemble.csv").unlink(missing_ok=True)
    if members:
        table_of_runs(members, "ensemble.csv", "member")
    rows, summaries = table_of_runs(plan, "runs.csv")
    manifest = {
        "sweeps": sweeps, "profile": profile, "runs": len(rows), "runs_not_done_yet": len(plan) - len(rows),
        "members": len(members), "missing": missing, "statuses": dict(
            sorted(collections.Counter(row["status"] for row in rows).items())), "machine": same_or_list(
                summaries, "machine"), "versions": same_or_list(summaries, "versions"), "python": ".".join(
                    platform.python_version_tuple()[:2]), "references": {
                        references.name_of(*scene): {key: found.about.get(key) for key in references.SAID}
                        for scene, found in sorted(certified.items())}, "timing": timing_of(rows)}
    (out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


TABLES = ("runs.csv", "ensemble.csv")


def put_in_place(plan, members, runs, out, certified):
    """Rows of these runs and members in place of those of the same names in OUT's tables; what they were made with
    joins what OUT/manifest.json has."""
    out, made = Path(out), []
    for some, file in zip((plan, members), TABLES):
        rows, summaries = rows_of(some, runs, certified)
        if not rows:
            continue
        made += summaries
        rows = {row["run"]: row for row in rows}
        with open(out / file, newline="") as table:
            reader = csv.DictReader(table)
            before, columns = list(reader), list(reader.fieldnames)
        columns += [
            c for c in dict.fromkeys(c for row in rows.values() for c in row if c.startswith("error_"))
            if c not in columns]
        # To which sweeps a run belongs only those say that made the table.
        after = [{**rows.pop(row["run"]), "sweeps": row["sweeps"]} if row["run"] in rows else row for row in before]
        with open(out / file, "w", newline="") as table:
            writer = csv.DictWriter(table, columns, "", "ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(after)
    manifest = read_json(out / "manifest.json") or {}
    for key in ("machine", "versions"):
        known = manifest.get(key, [])
        manifest[key] = same_or_list([{key: one} for one in (known if isinstance(known, list) else [known])] + made,
                                     key)
    with open(out / "runs.csv", newline="") as table:
        rows = list(csv.DictReader(table))
    manifest["statuses"] = dict(sorted(collections.Counter(row["status"] for row in rows).items()))
    manifest["timing"] = timing_of(rows)
    (out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


def number(cell: str) -> float:
    """A cell of a table as a number; nan where it is empty."""
    return math.nan if cell is None or cell == "" else float(cell)


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def close(a, b) -> bool:
    """The same, but for rounding."""
    if not (is_number(a) and is_number(b)):
        return a == b
    return a == b or abs(a - b) <= ROUNDING * max(1.0, min(abs(a), abs(b)))


def settled(row: dict, other: dict) -> bool:
    """Whether a member came to what the run came to, so that no further one is asked. How far a run comes before a
    limit is a matter of time."""
    def value(cell):
        return float(cell) if cell else None

    names = [c for c in {**row, **other} if c.startswith("error_")]
    return row["status"] == other["status"] and all(
        close(value(row.get(c, "")), value(other.get(c, ""))) for c in names)
