"""Figure 1: kinetic energy of the impacting sphere against time; the impact itself on the right.

The paper's figure shows that Newton's model gains energy at the impact and the others do not."""
import common
from common import np, plt

SCENE = "impacting_sphere"

options = common.arguments()
cells, missing = common.uncut(common.cells(options, SCENE))
if not cells:
    common.nothing(options, "figure01", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, (whole, close) = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True, gridspec_kw={"width_ratios": [3, 2]})

impact, before = [], []
for number, (cell, look) in enumerate(zip(cells, looks)):
    t, energy = cell.series("steps.csv", "t", "kinetic_energy")
    common.curve(whole, t, energy, look, number, len(cells), cell.how_it_ended)
    if len(t) < 2:
        continue
    jump = int(np.argmax(np.abs(np.diff(energy))))
    impact.append(t[jump + 1])
    before.append(energy[jump])
    window = np.abs(t - t[jump + 1]) <= 0.05
    common.curve(close, t[window], energy[window], look, number, len(cells), markers=3)

whole.set(title="whole run", xlabel="time (s)", ylabel="kinetic energy (J)")
whole.set_ylim(bottom=0)
if impact:
    where = float(np.median(impact))
    close.set(title=f"around the impact at t = {where:.3g} s", xlabel="time (s)",
              xlim=(max(0.0, where - 0.05), where + 0.05))
    close.axhline(max(before), color="0.55", linewidth=0.8, linestyle=(0, (6, 3)))
    close.annotate("before the impact", (where + 0.05, max(before)), xytext=(0, -3), textcoords="offset points",
                   ha="right", va="top", fontsize=7.5, color="0.35")
figure.tight_layout()
common.legend(figure, common.handles(cells, looks), note=missing)
common.save(figure, options, "figure01")
