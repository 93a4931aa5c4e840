"""Table I: processing time of each method on each scene at the paper's settings, beside what the paper prints.

The paper's numbers (paper_table1.csv) are those that a scan of it shows; cells whose column the scan lost are marked.
Another machine, fifteen years ago: what can be compared are ratios inside a column. The unit of a column is the convex
method at 1e-12 J, here and there, because it is the only one that the paper has a time for in every column.
"""
import collections
import math
from pathlib import Path

import pandas as pd

from .runs import write_table
from .templates import render

# Column: scene, parameters, the paper's k, heading.
COLUMNS = [("impacting_sphere", "", "8", "impacting sphere"), ("sliding_box", "", "16", "sliding box"),
           ("sticking_box", "", "8", "sticking box"), ("circular_sliding", "", "8", "circular sliding")]
COLUMNS += [("stack", f"boxes={n}", "4", f"stack of {n}") for n in (1, 2, 4, 8, 16)]
COLUMNS += [("mobile_robot", "", "4", "mobile robot"), ("grasp", "", "12", "grasp")]
FIELDS = [
    "method", "variant", "solver", "epsilon", "k", "scene", "parameters", "simulated_s", "repeats", "status", "reason",
    "t_reached", "median_s", "minimum_s", "maximum_s", "ratio", "busy", "paper_s", "paper_certain", "paper_ratio",
    "ensemble"]


def paper_times():
    """(method, solver, epsilon or "", column) -> (seconds or "DNF", certain)."""
    times = {}
    for row in pd.read_csv(Path(__file__).with_name("paper_table1.csv"), comment="#", dtype=str,
                           keep_default_na=False).to_dict("records"):
        scene, _, boxes = row["scene"].partition("_") if row["scene"].startswith("stack") else (row["scene"], "", "")
        solver = "" if row["method"] == "convex" else row["solver"]
        times[row["method"], solver, row["epsilon"], scene,
              f"boxes={boxes}" if boxes else ""] = (row["processing_s"], row["certain"] == "yes")
    return times


def paper_cell(times, cell):
    solver = "" if cell["method"] == "convex" else cell["solver"]
    for epsilon in (cell["epsilon"], ""):
        found = times.get((cell["method"], solver, epsilon, cell["scene"], cell["parameters"]))
        if found:
            return found
    return "", True


def is_unit(cell):
    return cell["method"] == "convex" and cell["epsilon"] == "1e-12"


def entries(results):
    """A row a cell of the table; what is missing or has no time is empty."""
    times, out = paper_times(), []
    for scene, parameters, k, _ in COLUMNS:
        column = [c for c in results.cells(scene, parameters=parameters, knobs="") if c["k"] in ("", k)]
        unit = next((c.seconds for c in column if is_unit(c) and c.finished), math.nan)
        paper_unit = next((paper_cell(times, c)[0] for c in column if is_unit(c)), "")
        for cell in column:
            paper, certain = paper_cell(times, cell)
            timed = cell.finished and cell.times
            worst = next((r for r in cell.rows if r["finished"] != "true"), cell.row)
            row = {f: cell[f] for f in FIELDS[:7]} | {"simulated_s": cell["duration"], "repeats": len(cell.rows)}
            row |= {key: worst[key] for key in ("status", "reason", "t_reached")}
            row |= {"median_s": cell.seconds if timed else ""}
            row |= {"minimum_s": min(cell.times) if timed else "", "maximum_s": max(cell.times) if timed else ""}
            row |= {"ratio": over(cell.seconds, unit) if timed else "", "busy": "true" if cell.busy else "false"}
            row |= {
                "paper_s": paper, "paper_certain": "yes" if certain else "no", "paper_ratio": over(paper, paper_unit)}
            out.append((cell, row))
    return out


def over(time, unit):
    """A ratio, empty where one of the two is no number."""
    try:
        ratio_of = float(time) / float(unit)
    except (ValueError, ZeroDivisionError):
        return ""
    return ratio_of if math.isfinite(ratio_of) else ""


def ours(row):
    """Time in s, or the status with the simulated time that was reached."""
    if row["median_s"] != "":
        return f"{row['median_s']:.3g}" + ("" if row["status"] == "ok" else f" ({row['status']})")
    return f"{row['status']}" + (f" at {row['t_reached']:.3g} s" if row["t_reached"] != "" else "")


def theirs(row):
    return row["paper_s"] + ("" if row["paper_certain"] == "yes" or not row["paper_s"] else "?")


def ratio(value):
    return "" if value == "" else f"{value:.0f}" if value >= 99.5 else f"{value:.2g}"


def bracket(value):
    return f" ({ratio(value)})" if value != "" else ""


def tex(text):
    for plain, escaped in (("\\", r"\textbackslash "), ("_", r"\_"), ("%", r"\%"), ("&", r"\&"), ("#", r"\#")):
        text = text.replace(plain, escaped)
    return text


def grid(results, rows):
    """What the templates show: columns (title, about), and of each method its name and a row, or none, a column; `rows`
    are entries()."""
    table = {}
    for cell, row in rows:
        reached = float(row["t_reached"]) if row["t_reached"] else ""
        table.setdefault(cell.name, {})[cell["scene"], cell["parameters"]] = row | {"t_reached": reached}
    columns = []
    for scene, parameters, k, title in COLUMNS:
        durations = {c["duration"] for c in results.cells(scene, parameters=parameters, knobs="") if c["duration"]}
        columns.append((title, ", ".join([f"{float(d):g} s" for d in sorted(durations)] + [f"k = {k}"])))
    return {
        "columns": columns, "ours": ours, "theirs": theirs, "bracket": bracket, "tex": tex, "methods": [
            (name, [of.get((scene, parameters)) for scene, parameters, _, _ in COLUMNS]) for name, of in table.items()]}


def ensemble(cell):
    """How the runs of a cell's ensemble ended."""
    count = collections.Counter(c["status"] for c in (cell, *cell.members))
    return ", ".join(f"{status} {n}" for status, n in count.items())


def write(results, shown):
    """table1.csv, .md and .tex in the folder of the results; `shown` is the grid of the report."""
    rows = [row | {"ensemble": ensemble(cell)} for cell, row in entries(results)]
    write_table(rows, FIELDS, results.folder / "table1.csv")
    for kind in ("md", "tex"):
        (results.folder / f"table1.{kind}").write_text(render(f"table1.{kind}", **shown))
