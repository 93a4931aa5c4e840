"""Frozen streams: residual against exact Coulomb friction over time of a solve, for the problems that one run met on its way.

One panel a scene, a point a problem and solver. The run is convex at 1e-12 J; everybody gets its problems, so that nobody's earlier
answers make the next problem easier or harder. Friction polygons and sequential impacts stand where their model puts them, loose
solvers where their tolerance does. What did not end ok stands on the rail above, at the time it took."""
import math

import common
from common import plt
from reporting import stored
from reporting.results import Results

FLOOR = 1e-17  # exact zeros are drawn here

options = common.arguments()
streams = stored.streams(Results(options.results, options.runs))
if not streams:
    common.nothing(options, "streams", "scripts/replay.py")
    raise SystemExit
figure, panels = plt.subplots(math.ceil(len(streams) / 2), 2, figsize=(9.5, 3.5 * math.ceil(len(streams) / 2)), squeeze=False)
for panel in panels.flat[len(streams):]:
    panel.axis("off")
handles = {}
for panel, (scene, rows) in zip(panels.flat, streams.items()):
    common.solves(panel, rows, "law_residual", FLOOR, handles)
    panel.set_ylabel("residual against Coulomb")
    panel.set_title(scene, pad=16)
figure.subplots_adjust(hspace=0.6, wspace=0.3)
common.legend(figure, list(handles.values()), columns=4)
common.save(figure, options, "streams")
