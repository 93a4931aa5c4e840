"""Ways of stepping (docs/stepping.md), from the runs of the sweep `stepping`: wanted against reached, what each order
costs, and the steps that were taken over time. Reads result files; runs nothing."""
import math

import numpy as np

from . import precision
from .looks import plt, point

SWEEP = "stepping"
FIGURE = "steps_taken"
SHOWN = "1e-6"  # m, the accuracy whose steps are drawn
# What is marked: name, colour, marker, its size.
MARKS = {
    "macro": ("macro step", "0.45", ".", 2), "switch": ("switch", "C3", "x", 6),
    "first_order": ("first order (switches pile up)", "C1", "+", 5), "impact": ("after an impact", "C0", "v", 6)}


def error_of(cell, name):
    """Largest error against the exact answer of the law that the method solves, m; nan where none is known."""
    own = cell.error(f"polygon_{name}") if cell["method"] == "ap" else math.nan
    return cell.error(name) if math.isnan(own) else own


def cells_of(results):
    """(scene, parameters, cell) of the runs to an accuracy."""
    return [(c["scene"], c["parameters"], c) for c in results.cells(sweep=SWEEP) if c.knob("accuracy")]


def count(cell, column):
    return int(cell.row.get(column) or 0)


def wanted(results):
    """Wanted against reached: a row a run of the order that the program chose."""
    rows, counts = [], ("solves", "switches", "impacts", "first_order_steps")
    for scene, parameters, cell in cells_of(results):
        if cell.knob("order"):
            continue
        name, goal = precision.measure(results, scene, parameters, SWEEP), float(cell.knob("accuracy"))
        error = error_of(cell, name) if cell.finished and name else math.nan
        rows.append({
            "scene": scene, "parameters": parameters, "method": cell.with_k, "wanted": goal, "status": cell["status"],
            "reached": None if math.isnan(error) else error, "ratio": None if math.isnan(error) else error / goal,
            "estimated": float(cell.row.get("estimated_error_m") or "nan"), "run": cell["run"]})
        rows[-1] |= {name: count(cell, name) for name in counts}
    return rows


def cost(results):
    """What each order takes on the circle: errors, solves, the slope of their logarithms (the order), and solves for
    1e-6 m by it. Order 1 is the scene by events."""
    scene, groups = "circular_sliding", {}
    for cell in results.cells(scene, SWEEP):
        order = int(cell.knob("order") or 0) if cell.knob("accuracy") else 1
        if order and cell.finished:
            groups.setdefault(order, []).append(cell)
    rows = []
    for order, cells in sorted(groups.items()):
        name = precision.measure(results, scene, cells[0]["parameters"], SWEEP)
        some = sorted((count(c, "solves"), c.error(name)) for c in cells if c.error(name) > precision.TINY)
        # As many solves whatever is wanted, or more of them to the same error: no order to tell.
        if len(some) < 2 or some[-1][0] < 1.5 * some[0][0]:
            continue
        solves, errors = [s for s, _ in some], [e for _, e in some]
        slope = precision.slope(solves, errors)
        if slope > -0.5:
            continue
        at_micron = solves[-1] * (1e-6 / errors[-1])**(1 / slope)
        row = {"order": order, "solves": solves, "errors": errors, "slope": -slope}
        rows.append(row | {"solves_for_1e-6_m": at_micron})
    return rows


def drawn(results, _=None):
    """The cells whose steps are drawn: one a scene, convex to 1e-6 m."""
    return [
        c for _, _, c in cells_of(results)
        if c["method"] == "convex" and c.knob("accuracy") == SHOWN and not c.knob("order")]


def canvas(cells):
    lines = -(-len(cells) // 2)
    return plt.subplots(lines, 2, figsize=(9.5, 2.6 * lines), squeeze=False)


def steps_taken(cells, axes):
    """Length of each step over time; switches and impacts marked."""
    for panel in axes.flat[len(cells):]:
        panel.axis("off")
    for panel, cell in zip(axes.flat, cells):
        try:
            lines = (cell.folder / "stepping.csv").read_text().splitlines()[1:]
        except OSError:
            lines = []
        rows = [line.split(",") for line in lines]
        t, length = np.array([float(r[1]) for r in rows]), np.array([float(r[4]) for r in rows])
        marked = {kind: np.array([r[2] == kind for r in rows], dtype=bool) for kind in MARKS}
        marked["impact"] = np.array([r[3] == "1" for r in rows], dtype=bool)
        for kind, (_, colour, marker, size) in MARKS.items():
            if marked[kind].any():
                panel.plot(t[marked[kind]], length[marked[kind]], linestyle="", color=colour, marker=marker,
                           markersize=size, markerfacecolor="none" if kind == "impact" else colour)
        panel.set(yscale="log", xlabel="time (s)", ylabel="step (s)",
                  title=f"{cell['scene'].replace('_', ' ')} {cell['parameters']}".strip())
    return [point(*mark[:3]) for mark in MARKS.values()]
