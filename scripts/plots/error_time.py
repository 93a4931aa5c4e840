"""Error against run time: largest error over time against processing time for a simulated second, one panel a scene.

The paper shows times and trajectories apart. Here each point is a method with one step and one polygon or tolerance: the median
of its repeats, with a bar from the least to the most. Lines join its steps, larger markers are finer polygons or tolerances, grey
rings mark the points that none beats in both time and error (the Pareto front), and runs that did not finish stand on a rail at the
right."""
import math

import common
from common import plt
from reporting import precision
from reporting.results import Results

FLOOR = 1e-18  # m; what is below, exact zeros too, is drawn here

options = common.arguments()
results = Results(options.results, options.runs)
scenes = precision.scenes(results)
if not scenes:
    common.nothing(options, "error_time", "the sweep error_time")
    raise SystemExit
columns = 2
rows = math.ceil(len(scenes) / columns)
figure, panels = plt.subplots(rows, columns, figsize=(9.5, 3.5 * rows), squeeze=False)
for panel in panels.flat[len(scenes):]:
    panel.axis("off")


def fineness(cells):
    """Marker sizes: the k or epsilon of a cell from coarse to fine."""
    knobs = sorted({(float(c["k"] or 0), -math.log10(float(c["epsilon"] or 1))) for c in cells})
    return {knob: 3.5 + 3.5 * n / max(len(knobs) - 1, 1) for n, knob in enumerate(knobs)}


handles = {}
for panel, (scene, parameters) in zip(panels.flat, scenes):
    points = precision.points(results, scene, parameters)
    looks = common.styles([p["cell"] for p in points])
    groups, failed = {}, []
    for point, look in zip(points, looks):
        cell = point["cell"]
        name = common.LOOKS.get(cell.key, common.LOOKS.get((cell.key[0], ""), (look["label"],)))[0]
        handles.setdefault(name, plt.Line2D([], [], linestyle="", marker=look["marker"], color=look["color"], label=name))
        if point["error"] is None:
            failed.append((look, point["status"]))
        else:
            groups.setdefault((cell.key, cell["k"], cell["epsilon"]), []).append((point, look))
    sizes = {key: fineness([p["cell"] for p in points if p["cell"].key == key]) for key in {p["cell"].key for p in points}}
    floor = False
    for (key, k, epsilon), some in groups.items():
        some.sort(key=lambda pair: -float(pair[0]["step"]))
        error = [max(p["error"], FLOOR) for p, _ in some]
        floor = floor or min(error) <= FLOOR
        look = {**some[0][1], "linestyle": "-", "linewidth": 0.6, "label": "_",
                "markersize": sizes[key][float(k or 0), -math.log10(float(epsilon or 1))]}
        panel.plot([p["time"] for p, _ in some], error, **look)
        panel.hlines(error, [p["least"] for p, _ in some], [p["most"] for p, _ in some], color=look["color"], linewidth=1.6, alpha=0.35)
    front = precision.pareto(points)
    panel.plot([p["time"] for p in front], [max(p["error"], FLOOR) for p in front], linestyle="", marker="o", markersize=11,
               markerfacecolor="none", markeredgecolor="0.5", markeredgewidth=1.0, zorder=2.5)
    for number, (look, status) in enumerate(failed):
        panel.plot([1.03], [0.03 + 0.94 * (number + 0.5) / len(failed)], transform=panel.transAxes, clip_on=False, linestyle="",
                   marker=look["marker"], color=look["color"], markerfacecolor="none", markersize=5)
    if failed:
        panel.text(1.06, 0.5, f"{len(failed)} did not finish", transform=panel.transAxes, rotation=90, va="center", fontsize=7.5)
    busy = sum(p["busy"] for p in points)
    if busy:
        panel.set_title(f"others used the machine during {busy} of {len(points)}", loc="right", fontsize=7.5, color="0.35")
    if floor:
        panel.axhline(FLOOR, color="0.55", linewidth=0.8, linestyle=(0, (6, 3)), zorder=2)
        panel.annotate("exactly 0, or below $10^{-18}$ m", (1, FLOOR), xycoords=("axes fraction", "data"), xytext=(-2, 3),
                       textcoords="offset points", ha="right", va="bottom", fontsize=7.5, color="0.35")
    # A scene on which nothing moves has few decades; what is there is told apart all the same.
    panel.set(xscale="log", yscale="log", title=" ".join([scene.replace("_", " "), parameters]).strip(),
              xlabel="processing time for a simulated second (s)", ylabel="largest error (m)")
figure.tight_layout()
common.legend(figure, list(handles.values()), columns=4)
common.save(figure, options, "error_time")
