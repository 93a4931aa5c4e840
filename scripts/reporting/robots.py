"""What the pictures of the two robot scenes share: places in the scenes, the path that is wanted, turns."""
import numpy as np

# mobile_robot.xml: the path X = -4 cos s, Z = 4 sin 2s, s = t/10 + 3 pi/2.
AMPLITUDE, RATE, START = 4.0, 0.1, 1.5 * np.pi
PERIOD = 2 * np.pi / RATE  # s
WHEELS = ("wheel_left", "wheel_right")
TYRES = ("tyre_left", "tyre_right")

# grasp.xml
FINGERS = ("finger_left", "finger_right")


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
    """Middles of `bins` spans of the run, and each wheel's mean normal impulse of a step in them, N s; 0 where none."""
    parts = []
    for tyre in TYRES:
        parts.append(cell.series("loads.csv", "t", "normal", of=(tyre,)))
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


POSE = ("px", "py", "pz", "qw", "qx", "qy", "qz")


def creep(cell, most=3000):
    """Time, and the root sum of squares of the box's displacement in both fingers' frames since the start, m."""
    box = cell.series("trajectory.csv", "t", *POSE, of=("box",), most=most)
    total = np.zeros(box.shape[1])
    for name in FINGERS:
        finger = cell.series("trajectory.csv", "t", *POSE, of=(name,), most=most)
        n = min(box.shape[1], finger.shape[1])
        box, total = box[:, :n], total[:n]
        if n == 0:
            return box[0], total
        place = turned_back(finger[4:8, :n], box[1:4] - finger[1:4, :n])
        total += np.sum((place - place[:, :1])**2, axis=0)
    return box[0], np.sqrt(total)
