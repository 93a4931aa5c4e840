"""Stiff and extreme cases (results/stress, made by scripts/stress.py): where each method breaks, and whether it says so."""
import csv

from ..section import Section, esc, picture, table

TITLE = "Stiff and extreme cases"
MEANING = {"right": "within the case's bound", "model": "what the method's model says, for a reason that is named",
           "typed": "the program says itself that it has no accurate answer", "wrong": "off without a known reason",
           "silent": "ok beside a checked residual above 1e-6", "defect": "crash, no return, NaN"}


def build(results):
    folder = results.folder / "stress"
    if not (folder / "stress.csv").exists():
        return Section("<p class='open'>Not made: <code>scripts/stress.py --jobs 2 --out results/stress</code>.</p>")
    with open(folder / "stress.csv", newline="") as file:
        cells = list(csv.DictReader(file))
    methods = list(dict.fromkeys(c["method"] for c in cells))
    count = {v: {m: sum(c["verdict"] == v and c["method"] == m for c in cells) for m in methods} for v in MEANING}
    html = (f"<p>{len(cells)} cells: a case, a row of its parameters and a method each. Command: <code>scripts/stress.py --jobs 2</code>; "
            "cases and reasons: <code>scenarios/stress/cases.toml</code>, <code>docs/stability.md</code>; all numbers: "
            "<code>stress/stress.csv</code>.</p>")
    html += table(["verdict", "meaning", *map(esc, methods), "all"],
                  [[v, meaning, *(count[v][m] or "" for m in methods), sum(count[v].values())] for v, meaning in MEANING.items()])
    named = [c for c in cells if c["verdict"] in ("wrong", "silent", "defect")]
    if named:
        html += table(["case", "scene", "row", "method", "verdict", "error", "note"],
                      [[esc(c[k]) for k in ("id", "scene", "row", "method", "verdict", "error", "note")] for c in named])
    if (folder / "heatmap.png").exists():
        html += f"<figure><figcaption>Each case and method: verdict, checked residual and cost.</figcaption>{picture(folder / 'heatmap.png', 'heat map of the stiff cases')}</figure>"
    # Which cells end at their limit of time depends on the machine; none of these may.
    faults = {v: count[v] for v in ("wrong", "silent", "defect")}
    return Section(html, {"cells": len(cells), "faults": faults}, {"verdicts": count})
