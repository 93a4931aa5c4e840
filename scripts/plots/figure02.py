"""Figure 2: processing time of the impacting sphere, summed up over simulated time.

The paper's figure shows Newton and Mirtich cheapest, A-P with YNL the most expensive by far."""
import common
from common import plt

SCENE = "impacting_sphere"

options = common.arguments()
cells = common.cells(options, SCENE)
if not cells:
    common.nothing(options, "figure02", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, axes = plt.subplots(figsize=(6.5, 3.6))
common.timing_panel(axes, cells, looks, "impacting sphere")
figure.tight_layout()
common.legend(figure, common.handles(cells, looks))
common.save(figure, options, "figure02")
