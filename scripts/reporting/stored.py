"""The table of scripts/solve_all.py (results/solve_all/solve_all.csv): every solver over every stored problem."""
import csv
import math
import statistics

from .results import number


def rows(results):
    path = results.folder / "solve_all" / "solve_all.csv"
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def solver(row):
    parts = [row["method"] or "LCP", row["solver"], row["variant"], f"k = {row['k']}" if row["k"] else "",
             f"bound {row['compression_bound']}" if row["compression_bound"] else ""]
    return " ".join(p for p in parts if p)


def summary(results):
    """{(kind, solver): counts, worst checked residual and median time of the ok ones}."""
    out = {}
    for row in rows(results):
        # A solver that is not installed here has no place in a comparison.
        if row["status"] != "unavailable":
            out.setdefault((row["kind"], solver(row)), []).append(row)
    return {key: {"problems": len(some), "ok": sum(r["status"] == "ok" for r in some),
                  "false_claims": sum(r["false_claim"] == "True" for r in some),
                  "residual": max((number(r["residual"]) for r in some if r["status"] == "ok" and r["residual"]), default=math.nan),
                  "time": statistics.median([number(r["time_median_s"]) for r in some if r["status"] == "ok" and r["time_median_s"]] or [math.nan])}
            for key, some in out.items()}
