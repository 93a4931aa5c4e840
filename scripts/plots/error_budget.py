"""Error budget: what of each run's error is the solver's, the model's and the step's, each against processing time.

Solver: against the same model solved tightly at the same step. Model: that against exact Coulomb friction at the same step. Step:
the same law against its exact answer. The largest of the three is what a user should work on first; a point at the bottom has
none of that kind."""
import math

import common
from common import plt
from reporting import precision
from reporting.results import Results

FLOOR = 1e-17  # m
COLUMNS = (("solver", "of the solver"), ("model", "of the model"), ("step_error", "of the step"))

options = common.arguments()
results = Results(options.results, options.runs)
scenes = precision.scenes(results)
if not scenes:
    common.nothing(options, "error_budget", "the sweep error_time")
    raise SystemExit
figure, panels = plt.subplots(len(scenes), 3, figsize=(9.5, 2.5 * len(scenes)), squeeze=False, sharex="row", sharey="row")
handles = {}
for line, (scene, parameters) in zip(panels, scenes):
    rows = precision.budget(results, scene, parameters)
    looks = common.styles([r["cell"] for r in rows])
    for row, look in zip(rows, looks):
        cell = row["cell"]
        name = common.LOOKS.get(cell.key, common.LOOKS.get((cell.key[0], ""), (look["label"],)))[0]
        handles.setdefault(name, plt.Line2D([], [], linestyle="", marker=look["marker"], color=look["color"], label=name))
        for panel, (part, _) in zip(line, COLUMNS):
            if not math.isnan(row[part]) and cell.times:
                panel.plot([cell.seconds / float(cell["duration"])], [max(row[part], FLOOR)], **{**look, "linestyle": "", "label": "_"})
    for panel, (_, title) in zip(line, COLUMNS):
        panel.set(xscale="log", yscale="log", title=f"{scene.replace('_', ' ')} {parameters}: {title}".replace(" :", ":"))
        panel.title.set_fontsize(8.5)
    busy = sum(r["cell"].busy for r in rows)
    line[0].set_ylabel("error (m)" + (f"\n(others used the\nmachine: {busy} of {len(rows)})" if busy else ""))
for panel in panels[-1]:
    panel.set_xlabel("processing time for a simulated second (s)")
figure.tight_layout()
common.legend(figure, list(handles.values()), columns=4)
common.save(figure, options, "error_budget")
