"""Figure 8: path of the mobile robot seen from above (left), its distance from the wanted path (right), and how the two
wheels share the load (below): blue is all on the left wheel, red all on the right, white both alike, grey no load.

The paper's figure shows that only the convex method drives the figure eight; with Anitescu and Potra's model one wheel at a
time is left without load."""
import common
from common import np, plt
from reporting import robots

SCENE = "mobile_robot"
LEAST = 1e-3  # m, drawn at least: all begin at 0

options = common.arguments()
cells, missing = common.uncut(common.cells(options, SCENE))
if not cells:
    common.nothing(options, "figure08", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure = plt.figure(figsize=(9.5, 4.6 + 0.24 * len(cells)))
upper, lower = figure.add_gridspec(2, 1, height_ratios=[4.4, 0.3 + 0.22 * len(cells)])
path, distance = (figure.add_subplot(g) for g in upper.subgridspec(1, 2))
share = figure.add_subplot(lower)

x, z = robots.figure_eight()
truth = path.plot(x, z, color="0.78", linewidth=6, label="wanted", zorder=2)[0]
extent, clipped, longest = 2.0 * robots.AMPLITUDE, False, 1.0
for number, (cell, look) in enumerate(zip(cells, looks)):
    t, x, z, _ = robots.axle(cell)
    if len(t) == 0:
        continue
    clipped = clipped or bool(np.max(np.maximum(np.abs(x), np.abs(z))) > extent)
    path.plot(x, z, **{**look, "marker": "", "linewidth": 0.8})
    at = [int((len(t) - 1) * (number + 0.5 + part) / len(cells) / 2) for part in (0, len(cells))]
    path.plot(x[at], z[at], **{**look, "linestyle": "", "markersize": 6, "zorder": 5})
    every = slice(None, None, 2)
    common.curve(distance, t[every], np.maximum(robots.cross_track(t[every], x[every], z[every]), LEAST), look, number,
                 len(cells), cell.how_it_ended, points=400)
    edges, left, right = robots.loads(cell)
    longest = max(longest, edges[-1])
    both = left + right
    part = np.ma.masked_where(both <= 0, left / np.where(both > 0, both, 1))
    share.pcolormesh(edges, [number - 0.42, number + 0.42], part[None, :], cmap="RdBu", vmin=0, vmax=1, rasterized=True)

path.set(title="path from above" + (" (cut off)" if clipped else ""), xlabel="x (m)", ylabel="z (m)")
if clipped:
    path.set(xlim=(-extent, extent), ylim=(-extent, extent))
path.set_aspect("equal", adjustable="box")
path.invert_yaxis()
distance.set(title="distance from the wanted path", xlabel="time (s)", ylabel="distance (m)", yscale="log")
distance.set_ylim(bottom=LEAST)
share.set_facecolor("0.7")
share.grid(False)
share.set(title="share of the load: left wheel (blue), right wheel (red)", xlabel="time (s)", xlim=(0, longest),
          ylim=(len(cells) - 0.5, -0.5))
share.set_yticks(range(len(cells)), [look["label"] for look in looks], fontsize=7.5)
figure.tight_layout()
common.legend(figure, [truth] + common.handles(cells, looks), note=missing)
common.save(figure, options, "figure08")
