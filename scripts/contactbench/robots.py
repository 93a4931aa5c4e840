"""What the pictures of the two robot scenes share: places in the scenes, the path that is wanted, turns, outlines."""
import numpy as np

# mobile_robot.xml: the path X = -4 cos s, Z = 4 sin 2s, s = t/10 + 3 pi/2.
AMPLITUDE, RATE, START = 4.0, 0.1, 1.5 * np.pi
WHEELS = ("wheel_left", "wheel_right")
TYRES = ("tyre_left", "tyre_right")
SCALE = 2.0  # times as large as the scene has it, the robot is drawn
WIDTH, LENGTH = 0.3, 0.4  # m, of the base
AHEAD = 0.055  # m, from the base's middle to the axle
AXLE, RADIUS = 0.3206, 0.0825  # m

# grasp.xml. Boxes: body, half extents, centre in the body's frame (m).
FINGERS = ("finger_left", "finger_right")
PADS = (("finger_left", (0.005, 0.015, 0.011), (0.005, -0.04, 0.0)), ("finger_right", (0.005, 0.015, 0.011),
                                                                      (-0.005, -0.04, 0.0)))
BOX = ((0.015, 0.015, 0.015), (0.0, 0.0, 0.0))
ARM = ("shoulder_1", "shoulder_2", "upper_arm", "lower_arm", "wrist", "palm")
POSE = ("px", "py", "pz", "qw", "qx", "qy", "qz")
# Seen from the front, right and above, without perspective.
SIDE, RAISED = np.radians(35), np.radians(20)
VIEW = np.array([[np.cos(SIDE), 0, -np.sin(SIDE)],
                 [-np.sin(SIDE) * np.sin(RAISED),
                  np.cos(RAISED), -np.cos(SIDE) * np.sin(RAISED)]])


def wanted(s):
    return -AMPLITUDE * np.cos(s), AMPLITUDE * np.sin(2 * s)


def figure_eight():
    return wanted(np.linspace(0, 2 * np.pi, 721))


def axle(cell, most=3500):
    """Time, middle of the axle (x, z) and heading (rad, about y, 0 along -z) of a run."""
    left = cell.series("trajectory.csv", "t", "px", "py", "pz", of=WHEELS[:1], most=most)
    right = cell.series("trajectory.csv", "t", "px", "py", "pz", of=WHEELS[1:], most=most)
    n = min(left.shape[1], right.shape[1])
    left, right = left[:, :n], right[:, :n]
    middle, across = (left + right) / 2, right - left
    return left[0], middle[1], middle[3], np.arctan2(-across[3], across[1])


def cross_track(t, x, z):
    """Distance from the path, on the branch that the wanted place runs on (lib/evaluation/no_slip_drive.h)."""
    out = np.empty(len(t))
    near = np.linspace(-0.8, 0.8, 641)
    for i, now in enumerate(t):
        px, pz = wanted(RATE * now + START + near)
        out[i] = np.min(np.hypot(px - x[i], pz - z[i]))
    return out


def loads(cell, bins=350):
    """Edges of `bins` spans of the run, and the sum of each wheel's normal impulses in them, N s; 0 where none."""
    parts = [cell.series("loads.csv", "t", "normal", of=(tyre, )) for tyre in TYRES]
    end = max((p[0][-1] for p in parts if p.shape[1]), default=0.0)
    edges = np.linspace(0, end, bins + 1)
    sums = [np.histogram(p[0], edges, weights=p[1])[0] for p in parts]
    return edges, sums[0], sums[1]


def turned_back(q, v):
    """R(q)^T v for quaternions (4, n) as w, x, y, z and vectors (3, n)."""
    w, u = q[0], -q[1:]
    cross = np.cross(u, v, axis=0)
    return v + 2 * (w * cross + np.cross(u, cross, axis=0))


def turned(q, v):
    """R(q) v."""
    return turned_back(np.vstack([q[:1], -q[1:]]), v)


def creep(cell, most=3000):
    """Time, and the root sum of squares of the box's displacement in both fingers' frames since the start, m."""
    box = cell.series("trajectory.csv", "t", *POSE, of=("box", ), most=most)
    total = np.zeros(box.shape[1])
    for name in FINGERS:
        finger = cell.series("trajectory.csv", "t", *POSE, of=(name, ), most=most)
        n = min(box.shape[1], finger.shape[1])
        box, total = box[:, :n], total[:n]
        if n == 0:
            return box[0], total
        place = turned_back(finger[4:8, :n], box[1:4] - finger[1:4, :n])
        total += np.sum((place - place[:, :1])**2, axis=0)
    return box[0], np.sqrt(total)


def outline(x, z, heading):
    """Corners of the mobile robot's base, ends of its wheels, and its nose, in the world."""
    forward, right = np.array([-np.sin(heading), -np.cos(heading)]), np.array([np.cos(heading), -np.sin(heading)])

    def at(along, aside):
        return np.array([x, z]) + SCALE * (along * forward + aside * right)

    base = [at(-AHEAD + a * LENGTH / 2, b * WIDTH / 2) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
    wheels = [[at(-RADIUS, s * AXLE / 2), at(RADIUS, s * AXLE / 2)] for s in (-1, 1)]
    return np.array(base), np.array(wheels), np.array([at(-AHEAD, 0), at(-AHEAD + 0.7 * LENGTH, 0)])


def hull(points):
    """Outline of points in the plane (Andrew's monotone chain)."""
    points, halves = sorted(map(tuple, points)), []

    def cross(o, a, b):
        return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])

    for order in (points, points[::-1]):
        half = []
        for p in order:
            while len(half) > 1 and cross(half[-2], half[-1], p) <= 0:
                half.pop()
            half.append(p)
        halves += half[:-1]
    return np.array(halves)


def silhouette(pose, half, centre):
    """Of a box of the grasp, as it is seen."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half + np.array(centre)
    world = pose[1:4, None] + turned(np.repeat(pose[4:8, None], 8, axis=1), corners.T)
    return hull((VIEW @ world).T)
