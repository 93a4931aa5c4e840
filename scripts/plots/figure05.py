"""Figure 5: paths of the box that slides in a circle, seen from above (left), and distance from the exact position (right).

The paper's figure shows that Anitescu-Potra comes near the convex method as the polygon gets finer, that Mirtich draws
another circle, and that Newton slides almost in one direction."""
import common
from common import np, plt

SCENE = "circular_sliding"
MU, G, DRIVE = 0.02, 9.8, 0.4  # the scene's own (scenarios/circular_sliding.xml)
RADIUS = np.sqrt(DRIVE**2 - (MU * G)**2)  # m, and m/s: one turn takes 2 pi s
LAG = np.arccos(MU * G / DRIVE)           # rad, of the velocity behind the drive


def exact(t):
    """Steady start: velocity of constant length, LAG behind the turning drive."""
    return RADIUS * (np.sin(t - LAG) + np.sin(LAG)), RADIUS * (np.cos(LAG) - np.cos(t - LAG))


options = common.arguments()
cells, missing = common.uncut(common.cells(options, SCENE))
if not cells:
    common.nothing(options, "figure05", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, (path, distance) = plt.subplots(1, 2, figsize=(9.5, 4.2))

x, z = exact(np.linspace(0, 2 * np.pi, 400))
truth = path.plot(x, z, color="0.78", linewidth=6, label="exact", zorder=2)[0]
extent = 3 * RADIUS
clipped, least = False, 1.0
for number, (cell, look) in enumerate(zip(cells, looks)):
    t, px, pz = cell.series("trajectory.csv", "t", "px", "pz")
    if len(t) == 0:
        continue
    # One point every 20 ms of the path is enough for the eye.
    every = max(1, int(round(0.02 / (t[1] - t[0])))) if len(t) > 1 else 1
    dx, dz = px - px[0], pz - pz[0]
    clipped = clipped or bool(np.max(np.hypot(dx, dz)) > 2 * extent)
    path.plot(dx[::every], dz[::every], **{**look, "marker": "", "linewidth": 0.7})
    # Two markers of each curve in the first turn, at places of their own.
    turn = max(1, min(len(t) - 1, int(np.searchsorted(t, 2 * np.pi))))
    at = [int(turn * (number + 0.5 + half) / len(cells) / 2) for half in (0, len(cells))]
    path.plot(dx[at], dz[at], **{**look, "linestyle": "", "markersize": 6, "zorder": 5})
    ex, ez = exact(t)
    error = np.maximum(np.hypot(dx - ex, dz - ez), 1e-16)
    least = min(least, float(np.quantile(error, 0.02)))
    common.curve(distance, t, error, look, number, len(cells), cell.how_it_ended,
                 points=300)

path.set(title="path from above" + (" (cut off)" if clipped else ""), xlabel="x (m)", ylabel="z (m)")
if clipped:
    centre = RADIUS * np.sin(LAG), RADIUS * np.cos(LAG)
    path.set(xlim=(centre[0] - extent, centre[0] + extent), ylim=(centre[1] - extent, centre[1] + extent))
path.set_aspect("equal", adjustable="box")
path.invert_yaxis()  # y points up, towards the reader: x to the right puts z downwards
distance.set(title="distance from the exact position", xlabel="time (s)", ylabel="distance (m)", yscale="log")
distance.set_ylim(bottom=least / 3)  # all begin at 0
figure.tight_layout()
common.legend(figure, [truth] + common.handles(cells, looks), note=missing)
common.save(figure, options, "figure05")
