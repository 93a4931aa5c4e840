"""Random scenes (scenes.py) hold what their families say. That they are the same everywhere is in test_campaign.py."""
import math
import unittest
import xml.etree.ElementTree as ET
from unittest import mock

import numpy as np
from contactbench import look, scenes
from folder import Folder


def numbers(text):
    return [float(word) for word in text.split()]


def gap(a, b):
    return float(look.apart(a, a.p[None], a.R[None], b, b.p[None], b.R[None])[0])


class Families(Folder):
    def model(self, scene):
        path = scenes.write(scene, self.top)
        self.assertEqual(path, self.top / f"{scene.name}.xml")
        return look.Model(path)

    def made(self, family, number=0, **chosen):
        """A scene of a family; `chosen`: what one_of takes where it is there, by the first of its values."""
        def one_of(draw, values):
            draw.random.random()
            return next((value for value in chosen.values() if value in values), values[0])

        scene = scenes.Scene(scenes.Draw(1, number, scenes.KINDS[number % 2]), "family", "name")
        with mock.patch.object(scenes.Draw, "one_of", one_of):
            family(scene)
        return scene

    def test_a_stick_across_two_lies_on_both_and_they_on_the_floor(self):
        model = self.model(self.made(scenes.sticks, manner="across"))
        plane, *rods = model.shapes
        self.assertGreaterEqual(len(rods), 3 * 4)
        for left, right, across in zip(rods[::3], rods[1::3], rods[2::3]):
            for low in (left, right):
                self.assertAlmostEqual(gap(low, plane), 0, 9)
                self.assertAlmostEqual(gap(across, low), 0, 9)
            self.assertAlmostEqual(abs(float(left.R[:, 1] @ across.R[:, 1])), 0, 9)
            np.testing.assert_allclose((left.p + right.p) / 2, across.p - [0, 2 * left.radius, 0], atol=1e-7)
            self.assertGreater(gap(left, right), 0)

    def test_what_rolls_does_not_slide_at_first(self):
        for family, kind in ((scenes.cylinders, "cylinder"), (scenes.sticks, "capsule")):
            root = ET.fromstring(self.made(family, manner="rolls").xml())
            some = [body for body in root.iter(kind) if body.get("angular_velocity")]
            self.assertGreater(len(some), 1)
            for body in some:
                v, w, r = numbers(body.get("velocity")), numbers(body.get("angular_velocity")), float(body.get("radius"))
                slides = np.array(v) + np.cross(w, [0, -r, 0])  # of the lowest point
                np.testing.assert_allclose(slides, 0, atol=1e-3 * abs(v[0]))
                self.assertAlmostEqual(numbers(body.get("position"))[1], r)

    def test_stacks_and_slabs_stand_flush_and_one_of_them_is_kicked(self):
        for family, numbers_of in ((scenes.stack, range(4)), (scenes.dominoes, range(2))):
            for number in numbers_of:
                scene = self.made(family, number)
                model = self.model(scene)
                plane, *boxes = model.shapes
                below = [plane, *boxes[:-1]] if family is scenes.stack else [plane] * len(boxes)
                for low, high in zip(below, boxes):
                    self.assertAlmostEqual(gap(high, low), 0, 7)
                self.assertEqual(sum("velocity=" in body for body in scene.bodies), 1)

    def test_the_first_domino_turns_about_its_lower_edge_in_front(self):
        body = ET.fromstring(self.made(scenes.dominoes).xml()).find("bodies/box")
        v, w, size = (numbers(body.get(name)) for name in ("velocity", "angular_velocity", "size"))
        edge = np.array([size[0] / 2, -size[1] / 2, 0])
        np.testing.assert_allclose(np.array(v) + np.cross(w, edge), 0, atol=1e-3)
        self.assertLess(w[2], 0)  # towards the next, which is on the side of +x

    def test_a_robot_is_the_same_from_its_file_and_native(self):
        for free in (True, False):
            for number in range(6):
                links = scenes.tree_of(scenes.Draw(1, number, "tame"), free, 1.25)
                models = []
                for kind in ("native", "file"):
                    scene = scenes.Scene(scenes.Draw(1, number, "tame"), "robot", kind)
                    if kind == "native":
                        scene.bodies.append(scenes.ROBOTS.native(links))
                    else:
                        scene.files["r.urdf"] = scenes.ROBOTS.urdf(links, free, scenes.seen_from)
                        scene.bodies.append(scenes.ROBOTS.from_file("r.urdf", links, free))
                    models.append(self.model(scene))
                native, file = models
                self.assertEqual(native.limits, file.limits)
                self.assertEqual({name: (m, i.tolist()) for name, (m, i) in native.links.items()},
                                 {name: (m, i.tolist()) for name, (m, i) in file.links.items()})
                for a, b, one in zip(native.shapes, file.shapes, links, strict=True):
                    self.assertEqual((a.kind, a.owner, a.size), (b.kind, b.owner, b.size))
                    np.testing.assert_allclose([a.p, b.p], 2 * [one["centre"]], atol=1e-9)
                    # Of a bar about its own axes, or a ball; each link begins where the one before it ends.
                    size = 2 * a.half if a.kind == "box" else None
                    moments = one["mass"] / 12 * (
                        (size**2).sum() - size**2) if a.kind == "box" else 3 * [0.4 * one["mass"] * a.radius**2]
                    np.testing.assert_allclose(one["inertia"], moments, rtol=1e-5)
                    self.assertAlmostEqual(one["centre"][0] - one["anchor"][0], one["long"] / 2, 5)
                    if one["parent"]:
                        self.assertAlmostEqual(one["anchor"][0], one["parent"]["anchor"][0] + one["parent"]["long"], 5)

    def test_a_tilted_gravity_is_that_of_the_slope(self):
        found = [scene for scene in (self.made(scenes.ramp, n) for n in range(12)) if scene.gravity[0]]
        self.assertTrue(found)
        for scene in found:
            self.assertAlmostEqual(math.hypot(*scene.gravity) / scene.g, 1, 3)
            self.assertTrue(
                scene.draw.ranges["slope"][0] <= -scene.gravity[0] / scene.gravity[1] <= scene.draw.ranges["slope"][1] * 1.001)


if __name__ == "__main__":
    unittest.main()
