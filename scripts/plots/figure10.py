"""Figure 10: creep of the grasped box, the root sum of squares of its displacement in both fingers' frames.

The paper's figure shows that only the convex method holds the box; the others drop it or fail to solve the problem. The
dotted line is half the box's size, beyond which it counts as dropped."""
import common
from common import np, plt
from reporting import robots

SCENE = "grasp"
SIZE = 0.03    # m, of the box (scenarios/grasp.xml)
LEAST = 1e-7   # m, drawn at least: all begin at 0

options = common.arguments()
cells, missing = common.uncut(common.cells(options, SCENE))
if not cells:
    common.nothing(options, "figure10", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, axes = plt.subplots(figsize=(7, 4.2))
dropped = axes.axhline(SIZE / 2, color="0.6", linestyle=":", linewidth=1.2, label="half the box's size")
for number, (cell, look) in enumerate(zip(cells, looks)):
    t, creep = robots.creep(cell)
    common.curve(axes, t, np.maximum(creep, LEAST), look, number, len(cells), cell.how_it_ended)
axes.set(title="creep of the grasped box", xlabel="time (s)", ylabel="displacement in the fingers' frames (m)", yscale="log")
# What falls further than this was dropped long before.
axes.set_ylim(LEAST, min(axes.get_ylim()[1], 1.0))
figure.tight_layout()
common.legend(figure, [dropped] + common.handles(cells, looks), note=missing)
common.save(figure, options, "figure10")
