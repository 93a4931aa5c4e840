"""A still picture of a motion as a small SVG: bodies where they begin, pale, and where they end; seen as view.html sees
them. Faces are drawn from the far ones to the near ones, which is right for what does not interlock."""
import math

import numpy as np

SIDES = 20
TONES = ("#4f86b0", "#c98a4b", "#6d9f6d", "#a87ba3", "#b0a14f", "#5f9ea0")
BEHIND = np.array([0.55, 0.4, 1.0]) / np.linalg.norm([0.55, 0.4, 1.0])  # towards the eye
RIGHT = np.cross([0.0, 1.0, 0.0], BEHIND) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], BEHIND))
UP = np.cross(BEHIND, RIGHT)
LIGHT = np.array([0.4, 0.85, 0.35]) / np.linalg.norm([0.4, 0.85, 0.35])


def turn(q):
    """The matrix of a quaternion x, y, z, w."""
    x, y, z, w = np.asarray(q) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def faces_of(shape):
    """Corners of the faces of a shape in its own frame; a sphere is its middle alone."""
    h = np.array([shape["hx"], shape["hy"], shape["hz"]])
    if shape["kind"] == "box":
        sides = [(a, s) for a in range(3) for s in (1, -1)]
        square = np.array([[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]])
        return [h * np.roll(square * [s, 1, 1], a, axis=1) for a, s in sides]
    if shape["kind"] == "hull":
        return [np.array(corners) for corners in shape["faces"]]
    if shape["kind"] in ("cylinder", "capsule"):
        rim = [
            np.array([math.cos(2 * math.pi * k / SIDES), 0,
                      math.sin(2 * math.pi * k / SIDES)]) for k in range(SIDES)]
        rim, y = [shape["radius"] * p for p in rim], np.array([0, shape["hy"], 0])
        if shape["kind"] == "capsule":  # its ends are facetted cones of three rings
            ends = []
            for s in (1, -1):
                rings = [[p * math.cos(t) + s * (y + [0, shape["radius"] * math.sin(t), 0]) for p in rim]
                         for t in (0, math.pi / 6, math.pi / 3)]
                for low, high in zip(rings, rings[1:]):
                    ends += [
                        np.array([a, b, c, d]) for a, b, c, d in zip(low, low[1:] + low[:1], high[1:] + high[:1], high)]
                ends.append(np.array(rings[-1]))
        else:
            ends = [np.array([p + s * y for p in rim]) for s in (1, -1)]
        return ends + [np.array([a + y, b + y, b - y, a - y]) for a, b in zip(rim, rim[1:] + rim[:1])]
    return [np.zeros((1, 3))]


def faces_at(motion, frame):
    """(depth, points on the paper, radius of a sphere or 0, how bright, body) of every face at a frame."""
    places = {body: motion.poses[frame][n] for n, body in enumerate(motion.bodies)}
    for shape in motion.surfaces():
        if shape["kind"] == "half_space":
            continue
        R = turn([shape[k] for k in ("qx", "qy", "qz", "qw")])
        p = np.array([shape[k] for k in ("px", "py", "pz")])
        if shape["body"] in places:
            x = places[shape["body"]]
            p, R = x[:3] + turn(x[3:7]) @ p, turn(x[3:7]) @ R
        number = motion.bodies.index(shape["body"]) if shape["body"] in places else -1
        for face in faces_of(shape):
            at = face @ R.T + p
            bright = 1.0
            if len(at) > 1:
                out = np.mean(at, axis=0) - p
                if out @ BEHIND <= 0 and shape["kind"] in ("box", "capsule"):
                    continue
                bright = 0.62 + 0.38 * max(0.0, float(out @ LIGHT) / (np.linalg.norm(out) or 1.0))
            flat = np.column_stack([at @ RIGHT, -(at @ UP)])
            yield float(np.mean(at @ BEHIND)), flat, shape["radius"] if len(at) == 1 else 0.0, bright, number


def tone(number, bright):
    colour = "#9a9a96" if number < 0 else TONES[number % len(TONES)]
    return "#" + "".join(f"{round(int(colour[i:i + 2], 16) * bright):02x}" for i in (1, 3, 5))


def svg(motion):
    """The picture, self-contained; coordinates in a box 300 wide."""
    drawn = [(frame, face) for frame in (0, len(motion.t) - 1)
             for face in sorted(faces_at(motion, frame), key=lambda f: f[0])]
    if not drawn:
        return ""
    reach = [np.vstack([f[1] - f[2], f[1] + f[2]]) for _, f in drawn]
    low, high = np.vstack(reach).min(axis=0), np.vstack(reach).max(axis=0)
    scale = 280 / max(*(high - low), 1e-9)
    lines = []
    for frame, (_, flat, radius, bright, number) in drawn:
        look = f'fill="{tone(number, bright)}"' + (' opacity=".25"' if frame == 0 else "")
        points = [[f"{x:.1f}" for x in point] for point in scale * (flat - low) + 10]
        if radius:
            lines.append(f'<circle cx="{points[0][0]}" cy="{points[0][1]}" r="{scale * radius:.1f}" {look}/>')
        else:
            lines.append(f'<polygon points="{" ".join(",".join(p) for p in points)}" {look}/>')
    wide, tall = scale * (high - low) + 20
    return f'<svg viewBox="0 0 {wide:.0f} {tall:.0f}" stroke="#20242a" stroke-width=".4" role="img" ' \
        f'aria-label="{motion.summary.get("scenario", "")}">' + "".join(lines) + "</svg>"
