"""The grasp at moments of its run: the arm with its fingers' pads (grey) and the box (in the method's colour).

One row a method; the small dots are the box's centre up to that moment. The paper has no such picture."""
import common
from common import np, plt
from matplotlib.patches import Polygon
from reporting import robots

SCENE = "grasp"
MOMENTS = (0, 0.06, 0.14, 0.6, 1)  # of the time reached
# Boxes of grasp.xml: body, half extents, centre in the body's frame (m).
PADS = (("finger_left", (0.005, 0.015, 0.011), (0.005, -0.04, 0.0)), ("finger_right", (0.005, 0.015, 0.011), (-0.005, -0.04, 0.0)))
BOX = ("box", (0.015, 0.015, 0.015), (0.0, 0.0, 0.0))
ARM = ("shoulder_1", "shoulder_2", "upper_arm", "lower_arm", "wrist", "palm")
# Seen from the front, right and above, without perspective.
SIDE, RAISED = np.radians(35), np.radians(20)
RIGHT = np.array([np.cos(SIDE), 0, -np.sin(SIDE)])
UP = np.array([-np.sin(SIDE) * np.sin(RAISED), np.cos(RAISED), -np.cos(SIDE) * np.sin(RAISED)])
VIEW = np.stack([RIGHT, UP])

options = common.arguments()
cells, missing = common.uncut(common.cells(options, SCENE))
if not cells:
    common.nothing(options, "grasp_picture", SCENE)
    raise SystemExit
# One cell a method and solver: the first, which is the most exact.
cells = list({cell.key: cell for cell in reversed(cells)}.values())[::-1]
looks = common.styles(cells)


def hull(points):
    """Outline of points in the plane (Andrew's monotone chain)."""
    points = sorted(map(tuple, points))
    cross = lambda o, a, b: (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])  # noqa: E731
    halves = []
    for order in (points, points[::-1]):
        half = []
        for p in order:
            while len(half) > 1 and cross(half[-2], half[-1], p) <= 0:
                half.pop()
            half.append(p)
        halves += half[:-1]
    return np.array(halves)


def silhouette(pose, half, centre):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half + np.array(centre)
    world = pose[1:4, None] + robots.turned(np.repeat(pose[4:8, None], 8, axis=1), corners.T)
    return hull((VIEW @ world).T)


figure, axes = plt.subplots(len(cells), len(MOMENTS), figsize=(2.1 * len(MOMENTS), 1.75 * len(cells) + 0.3), squeeze=False, sharex=True,
                            sharey=True)
every, box_places = 1500, []
for row, (cell, look) in enumerate(zip(cells, looks)):
    tracks = {name: cell.series("trajectory.csv", "t", *robots.POSE, of=(name,), most=every)
              for name in ARM + robots.FINGERS + ("box",)}
    count = min(track.shape[1] for track in tracks.values())
    for column, panel in enumerate(axes[row]):
        panel.set_xticks([])
        panel.set_yticks([])
        panel.set_aspect("equal", adjustable="box")
        panel.spines[:].set_visible(False)
        if count == 0:
            continue
        i = round((count - 1) * MOMENTS[column])
        places = np.array([VIEW @ tracks[name][1:4, i] for name in ARM])
        panel.plot(*places.T, color="0.55", linewidth=3, marker="o", markersize=3, zorder=2, solid_joinstyle="round")
        palm = places[-1]
        for name, half, centre in PADS:
            finger = VIEW @ tracks[name][1:4, i]
            panel.plot(*np.array([palm, finger]).T, color="0.55", linewidth=1.5, zorder=2)
            panel.add_patch(Polygon(silhouette(tracks[name][:, i], half, centre), facecolor="0.8", edgecolor="0.3", linewidth=0.6,
                                    zorder=3 if name.endswith("left") else 5))
        panel.add_patch(Polygon(silhouette(tracks["box"][:, i], *BOX[1:]), facecolor=look["color"], edgecolor="black",
                                linewidth=0.5, alpha=0.9, zorder=4))
        trace = VIEW @ tracks["box"][1:4, :i + 1]
        panel.plot(*trace[:, ::8], linestyle="", marker=".", markersize=1.2, color=look["color"], zorder=1)
        box_places += [places.min(axis=0), places.max(axis=0)]
        panel.text(0.03, 0.02, f"{tracks['box'][0, i]:.3g} s", transform=panel.transAxes, fontsize=7)
    axes[row, 0].set_title(look["label"] + common.ending(cell), fontsize=8.5)
if box_places:
    low, high = np.min(box_places, axis=0), np.max(box_places, axis=0)
    # Room for the hand; a box that falls leaves the picture.
    axes[0, 0].set(xlim=(low[0] - 0.1, high[0] + 0.02), ylim=(low[1] - 0.07, high[1] + 0.06))
figure.tight_layout(h_pad=0.4, w_pad=0.2)
common.legend(figure, [], note=missing)
common.save(figure, options, "grasp_picture")
