"""Figure 9: processing time of the mobile robot, summed up over simulated time.

In the paper's Table I Anitescu-Potra with Lemke's method takes 4.76 s, the convex method 1.21 s."""
import common
from common import plt

SCENE = "mobile_robot"

options = common.arguments()
cells = common.cells(options, SCENE)
if not cells:
    common.nothing(options, "figure09", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, axes = plt.subplots(figsize=(6.5, 3.6))
common.timing_panel(axes, cells, looks, "mobile robot")
figure.tight_layout()
common.legend(figure, common.handles(cells, looks))
common.save(figure, options, "figure09")
