"""Figure 6: processing time of the box that slides in a circle, summed up over simulated time.

The paper's figure shows A-P with YNL the most expensive by far, and PATH well above Lemke."""
import common
from common import plt

SCENE = "circular_sliding"

options = common.arguments()
cells = common.cells(options, SCENE)
if not cells:
    common.nothing(options, "figure06", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, axes = plt.subplots(figsize=(6.5, 3.6))
common.timing_panel(axes, cells, looks, "box sliding in a circle")
figure.tight_layout()
common.legend(figure, common.handles(cells, looks))
common.save(figure, options, "figure06")
