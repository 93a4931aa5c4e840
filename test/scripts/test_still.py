"""The small pictures of scenes (still.py): where bodies are drawn, in which order, colour and size."""
import math
import re
import types
import unittest
import xml.etree.ElementTree

import numpy as np
from contactbench import still

ROUND = {
    "kind": "sphere", "radius": 0.5, "hx": 0, "hy": 0, "hz": 0, "px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}
UPRIGHT = (0, 0, 0, 1)


def motion(shapes, *frames, bodies=("a", "b")):
    """Frames: of each body where it is, and how it is turned (x, y, z, w)."""
    poses = [[np.array([*place, *turned], dtype=float) for place, turned in frame] for frame in frames]
    return types.SimpleNamespace(bodies=list(bodies), poses=poses, t=range(len(frames)), surfaces=lambda: shapes, summary={
        "scenario": "my_scene"})


def drawn(some):
    root = xml.etree.ElementTree.fromstring(still.svg(some))
    return root, list(root)


class Still(unittest.TestCase):
    def test_the_eye_stands_in_front_to_the_right_and_above(self):
        axes = np.array([still.RIGHT, still.UP, still.BEHIND])
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
        self.assertAlmostEqual(np.linalg.det(axes), 1)
        self.assertAlmostEqual(still.RIGHT[1], 0)  # what is level stays level
        self.assertTrue(still.RIGHT[0] > 0 and still.UP[1] > 0 and still.BEHIND[2] > still.BEHIND[0] > still.BEHIND[1] > 0)

    def test_balls_begin_pale_and_end_full_in_the_colour_of_their_body_the_far_one_first(self):
        shapes = [
            ROUND | {"body": "b", "radius": 0.25}, ROUND | {"body": "a"}, ROUND | {"body": ""},
            ROUND | {"kind": "half_space", "body": "", "radius": 0}]
        begin, end = ((0, 3, 0), (-1, 0, 0)), ((0, 0, 2), (-1, 0, 2))
        some = motion(shapes, [(p, UPRIGHT) for p in begin], [((9, 9, 9), UPRIGHT)] * 2, [(p, UPRIGHT) for p in end])
        root, parts = drawn(some)
        self.assertEqual((root.get("aria-label"), {part.tag for part in parts}), ("my_scene", {"circle"}))

        def paper(p):
            return np.array([p @ still.RIGHT, -(p @ still.UP)])

        places = {
            name: np.array(p, dtype=float)
            for name, p in (("a0", begin[0]), ("b0", begin[1]), ("fixed", (0, 0, 0)), ("a1", end[0]), ("b1", end[1]))}
        radii = {"a": 0.5, "b": 0.25, "f": 0.5}
        low = np.min([paper(p) - radii[name[0]] for name, p in places.items()], axis=0)
        high = np.max([paper(p) + radii[name[0]] for name, p in places.items()], axis=0)
        scale = 280 / max(high - low)
        self.assertEqual(root.get("viewBox").split(), ["0", "0", *(f"{x:.0f}" for x in scale * (high - low) + 20)])
        # Each frame for itself from the far ones to the near ones: towards the eye z counts most.
        order = ["b0", "fixed", "a0", "fixed", "b1", "a1"]
        self.assertEqual(sorted(order[:3], key=lambda name: places[name] @ still.BEHIND), order[:3])
        self.assertEqual(sorted(order[3:], key=lambda name: places[name] @ still.BEHIND), order[3:])
        colours = {"a": still.TONES[0], "b": still.TONES[1], "f": "#9a9a96"}
        for part, name, pale in zip(parts, order, [True] * 3 + [False] * 3, strict=True):
            at = scale * (paper(places[name]) - low) + 10
            np.testing.assert_allclose([float(part.get(key)) for key in ("cx", "cy", "r")], [*at, scale * radii[name[0]]],
                                       atol=0.051)
            self.assertEqual((part.get("fill"), part.get("opacity")), (colours[name[0]], ".25" if pale else None), name)

    def test_a_shape_beside_the_middle_of_its_body_turns_about_it(self):
        quarter = (0, math.sin(math.pi / 4), 0, math.cos(math.pi / 4))  # about y: what was at x is at -z
        some = motion([ROUND | {"body": "b", "px": 2.0}], [((7, 7, 7), UPRIGHT), ((10, 20, 30), quarter)])
        (depth, flat, radius, bright, number), = still.faces_at(some, 0)
        at = np.array([10, 20, 28])
        np.testing.assert_allclose([depth, *flat[0]], [at @ still.BEHIND, at @ still.RIGHT, -(at @ still.UP)])
        self.assertEqual((radius, bright, number), (0.5, 1.0, 1))

    def test_a_shape_is_turned_in_its_body_and_then_with_it(self):
        sine = math.sin(math.pi / 4)
        about_x = dict(zip(("qx", "qy", "qz", "qw"), (sine, 0, 0, sine)))  # y to z, z to -y
        some = motion([ROUND | about_x | {"kind": "hull", "body": "a", "faces": [[(1, 2, 3), (0, 0, 0), (0, 0, 1)]]}],
                      [((0, 0, 0), UPRIGHT), ((0, 0, 0), UPRIGHT)], [((0, 0, 0), (0, sine, 0, sine)), ((0, 0, 0), UPRIGHT)])
        # (1, 2, 3) is at (1, -3, 2) in the body, and then a quarter about y takes z to x and x to -z.
        for frame, corner in enumerate(((1, -3, 2), (2, -3, -1))):
            (_, flat, *_), = still.faces_at(some, frame)
            np.testing.assert_allclose(flat[0], [np.array(corner) @ still.RIGHT, -(np.array(corner) @ still.UP)])

    def test_nothing_to_draw_is_no_picture(self):
        self.assertEqual(still.svg(motion([], [], bodies=())), "")

    def test_a_tone_is_the_colour_of_the_body_made_darker(self):
        self.assertEqual([still.tone(n, 1.0) for n in (-1, 0, 5, 6)],
                         ["#9a9a96", still.TONES[0], still.TONES[5], still.TONES[0]])
        self.assertEqual((still.TONES[0], still.tone(0, 0.5)), ("#4f86b0", "#284358"))

    def test_a_quaternion_is_x_y_z_w_and_need_not_be_of_length_one(self):
        half = 0.35
        for axis, first, second in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            q = np.zeros(4)
            q[axis], q[3] = 3 * math.sin(half), 3 * math.cos(half)
            expected = np.eye(3)
            expected[np.ix_((first, second), (first, second))] = [[math.cos(0.7), -math.sin(0.7)], [
                math.sin(0.7), math.cos(0.7)]]
            np.testing.assert_allclose(still.turn(q), expected, atol=1e-15)

    def test_faces_are_those_of_the_shape(self):
        def faces(kind, **of):
            return still.faces_of({"kind": kind, "radius": 0, "hx": 1, "hy": 2, "hz": 3} | of)

        box = faces("box")
        self.assertEqual(sorted(tuple(face.mean(axis=0)) for face in box),
                         sorted([(1, 0, 0), (-1, 0, 0), (0, 2, 0), (0, -2, 0), (0, 0, 3), (0, 0, -3)]))
        for face in box:
            np.testing.assert_allclose(np.abs(face), [[1, 2, 3]] * 4)
            sides = np.linalg.norm(face - np.roll(face, 1, axis=0), axis=1)  # around it, not across
            self.assertEqual(set(sides) <= {2, 4, 6} and len(set(map(tuple, face))), 4)
        tin = faces("cylinder", radius=0.5)
        self.assertEqual(len(tin), 2 + still.SIDES)
        for cap, y in zip(tin[:2], (2, -2)):
            np.testing.assert_allclose(cap[:, 1], y)
            np.testing.assert_allclose(np.hypot(cap[:, 0], cap[:, 2]), 0.5)
        for side in tin[2:]:
            np.testing.assert_allclose(np.sort(side[:, 1]), [-2, -2, 2, 2])
            self.assertAlmostEqual(np.linalg.norm(side[0] - side[1]), 2 * 0.5 * math.sin(math.pi / still.SIDES))
        # A capsule: every corner lies on it; its length is that of the axis and of three rings of its ends.
        pill = faces("capsule", radius=0.5)
        self.assertEqual(len(pill), 2 * (2 * still.SIDES + 1) + still.SIDES)
        for corner in np.vstack(pill):
            beyond = max(abs(corner[1]) - 2, 0)
            self.assertAlmostEqual(math.hypot(corner[0], corner[2], beyond), 0.5)
        self.assertAlmostEqual(np.vstack(pill)[:, 1].max(), 2 + 0.5 * math.sin(math.pi / 3))
        self.assertAlmostEqual(np.vstack(pill)[:, 1].min(), -2 - 0.5 * math.sin(math.pi / 3))
        ends = [face[0, 1] for face in pill if np.ptp(face[:, 1]) < 1e-12]  # what closes it at the top and below
        np.testing.assert_allclose(sorted(ends), [-2 - 0.5 * math.sin(math.pi / 3), 2 + 0.5 * math.sin(math.pi / 3)])
        corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        np.testing.assert_array_equal(faces("hull", faces=[corners]), [corners])
        np.testing.assert_array_equal(faces("sphere", radius=1), [[[0, 0, 0]]])

    def test_of_a_box_the_three_faces_towards_the_eye_are_drawn_the_upper_one_brightest(self):
        box = ROUND | {"kind": "box", "body": "b", "hx": 1, "hy": 2, "hz": 3, "radius": 0}
        some = motion([box], [((7, 7, 7), UPRIGHT), ((1, 2, 3), UPRIGHT)])
        found = list(still.faces_at(some, 0))
        self.assertEqual([number for *_, number in found], [1] * 3)
        middle = lambda axis: np.array([1, 2, 3]) + np.eye(3)[axis] * (axis + 1)  # of the face of that axis
        middles = {}
        for depth, flat, radius, bright, _ in found:
            axis = min(range(3), key=lambda a: abs(depth - middle(a) @ still.BEHIND))
            self.assertAlmostEqual(depth, middle(axis) @ still.BEHIND)
            np.testing.assert_allclose(flat.mean(axis=0), [middle(axis) @ still.RIGHT, -(middle(axis) @ still.UP)], atol=1e-12)
            middles[axis] = bright
            self.assertEqual(radius, 0)
        light = np.array([0.4, 0.85, 0.35]) / math.sqrt(0.4**2 + 0.85**2 + 0.35**2)
        for axis, bright in middles.items():
            self.assertAlmostEqual(bright, 0.62 + 0.38 * light[axis])
        self.assertEqual(len(re.findall("<polygon", still.svg(some))), 6)  # it begins and ends there
        # Of a cylinder all are, the near ones over the far ones.
        tin = box | {"kind": "cylinder", "radius": 0.5}
        self.assertEqual(len(list(still.faces_at(motion([tin], *[[((0, 0, 0), UPRIGHT)] * 2]), 0))), 2 + still.SIDES)


if __name__ == "__main__":
    unittest.main()
