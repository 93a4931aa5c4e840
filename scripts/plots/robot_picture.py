"""The mobile robot from above: where it is every five seconds, and which way it faces (drawn at twice its size).

One picture a method; the grey line is the wanted path, the robot begins in its middle. The paper has no such picture."""
import common
from common import np, plt
from reporting import robots

SCENE = "mobile_robot"
EVERY = 5.0                      # s
SIZE = 2.0                       # times as large as the scene has it
WIDTH, LENGTH = 0.3, 0.4         # m, of the base
AHEAD = 0.055                    # m, from the base's middle to the axle
AXLE, RADIUS = 0.3206, 0.0825    # m

options = common.arguments()
cells, missing = common.uncut(common.cells(options, SCENE))
if not cells:
    common.nothing(options, "robot_picture", SCENE)
    raise SystemExit
# One cell a method and solver: the first, which is the most exact.
cells = list({cell.key: cell for cell in reversed(cells)}.values())[::-1]
looks = common.styles(cells)


def outline(x, z, heading):
    """Corners of the base and ends of the wheels in the world."""
    forward = np.array([-np.sin(heading), -np.cos(heading)])
    right = np.array([np.cos(heading), -np.sin(heading)])
    at = lambda along, aside: np.array([x, z]) + SIZE * (along * forward + aside * right)  # noqa: E731
    base = [at(-AHEAD + a * LENGTH / 2, b * WIDTH / 2) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
    wheels = [[at(-RADIUS, s * AXLE / 2), at(RADIUS, s * AXLE / 2)] for s in (-1, 1)]
    nose = [at(-AHEAD, 0), at(-AHEAD + 0.7 * LENGTH, 0)]
    return np.array(base), np.array(wheels), np.array(nose)


columns = min(3, len(cells))
rows = -(-len(cells) // columns)
figure, axes = plt.subplots(rows, columns, figsize=(3.3 * columns, 3.5 * rows), squeeze=False, sharex=True, sharey=True)
extent = 1.5 * robots.AMPLITUDE
for panel in axes.flat[len(cells):]:
    panel.axis("off")
for panel, cell, look in zip(axes.flat, cells, looks):
    panel.plot(*robots.figure_eight(), color="0.8", linewidth=4, zorder=2)
    t, x, z, heading = robots.axle(cell)
    panel.plot(x, z, color=look["color"], linewidth=0.7, zorder=3)
    moments = np.arange(0, t[-1] + 1e-9, EVERY) if len(t) else []
    for moment in moments:
        i = int(np.argmin(np.abs(t - moment)))
        base, wheels, nose = outline(x[i], z[i], heading[i])
        panel.fill(*base.T, facecolor="white", edgecolor=look["color"], linewidth=0.8, zorder=4)
        panel.plot(*nose.T, color=look["color"], linewidth=0.8, zorder=5)
        for wheel in wheels:
            panel.plot(*wheel.T, color="black", linewidth=2, solid_capstyle="butt", zorder=5)
    ended = cell.how_it_ended
    panel.set_title(look["label"] + (f"\n{ended}" if ended else ""), fontsize=8.5)
    panel.set_aspect("equal", adjustable="box")
axes[0, 0].set(xlim=(-extent, extent), ylim=(extent, -extent))
for panel in axes[:, 0]:
    panel.set_ylabel("z (m)")
for panel in axes[-1]:
    panel.set_xlabel("x (m)")
figure.tight_layout()
common.legend(figure, [], note=missing)
common.save(figure, options, "robot_picture")
