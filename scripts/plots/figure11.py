"""Figure 11: processing time of the grasp, summed up over simulated time.

The paper's figure lacks Anitescu-Potra with Lemke's method and YNL, which failed at the first step."""
import common
from common import plt

SCENE = "grasp"

options = common.arguments()
cells = common.cells(options, SCENE)
if not cells:
    common.nothing(options, "figure11", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, axes = plt.subplots(figsize=(6.5, 3.6))
common.timing_panel(axes, cells, looks, "manipulator grasp")
figure.tight_layout()
common.legend(figure, common.handles(cells, looks))
common.save(figure, options, "figure11")
