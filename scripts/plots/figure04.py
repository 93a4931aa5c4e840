"""Figure 4: creep of the box that should stick on its ramp (top), processing time (bottom).

The paper's figure shows that Newton's model lets go after about a second, and about seven orders of magnitude between
the best and the worst of the others."""
import common
from common import np, plt

SCENE = "sticking_box"
FLOOR = 1e-18  # m; what is below, exact zeros too, is drawn here

options = common.arguments()
cells = common.cells(options, SCENE)
if not cells:
    common.nothing(options, "figure04", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 6.8), gridspec_kw={"height_ratios": [3, 2]})

floor = False
for number, (cell, look) in enumerate(zip(cells, looks)):
    t, x, y, z = cell.series("trajectory.csv", "t", "px", "py", "pz")
    if len(t) == 0:
        continue
    creep = np.sqrt((x - x[0])**2 + (y - y[0])**2 + (z - z[0])**2)
    floor = floor or bool(np.any(creep[1:] <= FLOOR))
    common.curve(top, t[1:], np.maximum(creep[1:], FLOOR), look, number, len(cells), cell.how_it_ended, points=300)
top.set(title="creep: distance from the start, 0 m is exact", xlabel="time (s)", ylabel="displacement (m)", yscale="log")
if floor:
    top.axhline(FLOOR, color="0.55", linewidth=0.8, linestyle=(0, (6, 3)), zorder=2)
    top.annotate("exactly 0, or below $10^{-18}$ m, is drawn here", (1, FLOOR), xycoords=("axes fraction", "data"), xytext=(-2, -4),
                 textcoords="offset points", ha="right", va="top", fontsize=7.5, color="0.35")
    top.set_ylim(bottom=FLOOR / 100)
common.timing_panel(bottom, cells, looks, "processing time")
figure.tight_layout()
common.legend(figure, common.handles(cells, looks), columns=2)
common.save(figure, options, "figure04")
