"""The tables of scripts/solve_all.py: every solver over every stored problem (results/solve_all), and over the streams of problems
that one run of a scene met (scripts/replay.py, results/replay/SCENE)."""
import csv
import math
import statistics

from .results import number


def rows(results, folder="solve_all"):
    """Solves of a folder, but those of a solver that is not installed here: it has no place in a comparison."""
    path = results.folder / folder / "solve_all.csv"
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return [row for row in csv.DictReader(file) if row["status"] != "unavailable"]


def streams(results):
    """{scene with its parameters: rows} of the replayed streams."""
    found = {path.parent.name: rows(results, path.parent.relative_to(results.folder))
             for path in sorted((results.folder / "replay").glob("*/solve_all.csv"))}
    return {name.replace("__", " ").replace("-", "=").replace("_", " "): some for name, some in found.items()}


def solver(row):
    parts = [row["method"] or "LCP", row["solver"], row["variant"], f"k = {row['k']}" if row["k"] else "",
             f"bound {row['compression_bound']}" if row["compression_bound"] else ""]
    return " ".join(p for p in parts if p)


def summary(some):
    """{(kind, solver): counts (`busy`: solves during which others used the machine); worst checked residual, median residual against
    Coulomb and median time of the ok ones}."""
    def of(ok, column):
        return [number(r[column]) for r in ok if r["status"] == "ok" and r[column]]
    out = {}
    for row in some:
        out.setdefault((row["kind"], solver(row)), []).append(row)
    return {key: {"problems": len(group), "ok": sum(r["status"] == "ok" for r in group),
                  "false_claims": sum(r["false_claim"] == "True" for r in group), "busy": sum(r["busy"] == "True" for r in group),
                  "residual": max(of(group, "residual"), default=math.nan),
                  "law_residual": statistics.median(of(group, "law_residual") or [math.nan]),
                  "time": statistics.median(of(group, "time_median_s") or [math.nan])}
            for key, group in out.items()}
