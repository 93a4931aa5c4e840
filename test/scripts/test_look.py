"""The independent look at runs (look.py): what it reads of a scene, and what it says of files written by hand. Distances of
shapes are in test_campaign.py."""
import math
import unittest

import numpy as np
from contactbench import look
from folder import Folder
from made import csv_of

HEAD = "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"
OK = {"status": "ok", "energy": {"max_gain_relative": 0}}
GRAVITY = np.array([0.5, -9.0, 1.5])
TURN = np.array([0.5, 0.1, -0.7, 0.5])  # of length 1


def one(kind, **more):
    """A shape in the middle."""
    points = np.array(more["points"]) if "points" in more else None
    return look.Shape(kind, "s", "s", np.zeros(3), np.eye(3), **more | ({} if points is None else {"points": points}))


class Modelled(Folder):
    def model(self, bodies, pairs='<pair a="*" b="*" mu="0.5"/>', more="", duration=0.002):
        path = self.top / "scene.xml"
        path.write_text(
            f'<scenario><simulation step="1e-3" duration="{duration}"/><gravity constant="0.5 -9 1.5"/><bodies>{bodies}</bodies>'
            f"<contacts>{pairs}</contacts>{more}</scenario>")
        return look.Model(path)


class Shapes(unittest.TestCase):
    def test_quaternions_of_any_length_begin_with_w(self):
        half = math.pi / 8
        R = look.matrix(3 * np.array([math.cos(half), 0, 0, math.sin(half)]))
        s = math.sqrt(0.5)
        np.testing.assert_allclose(R, [[s, -s, 0], [s, s, 0], [0, 0, 1]], atol=1e-15)
        R = look.matrix(TURN)
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-15)
        np.testing.assert_allclose(R @ TURN[1:], TURN[1:], atol=1e-15)
        self.assertAlmostEqual(np.trace(R), 1 + 2 * math.cos(2 * math.acos(0.5)))
        both = look.matrix(np.array([TURN, [1, 0, 0, 0]]))
        np.testing.assert_allclose(both, [R, np.eye(3)])

    def test_a_sphere_about_a_shape_and_its_largest_extent(self):
        for shape, bound, size in ((one("box", half=np.array([1.0, 2, 2])), 3, 4), (one("sphere", radius=0.7), 0.7, 1.4), (one(
                "cylinder", radius=3, length=8), 5, 8), (one("cylinder", radius=3, length=2), math.sqrt(10), 6), (one(
                    "capsule", radius=0.5,
                    length=3), 2, 4), (one("hull", points=[(-3.0, 0, 0), (1, 0, 0), (0, 3, 0), (0, 0, 1.0)]), 3, 4), (one(
                        "half_space", normal=np.array([0, 1, 0])), math.inf, math.inf)):
            self.assertAlmostEqual(shape.bound, bound)
            self.assertAlmostEqual(shape.size, size)

    def test_a_capsule_has_the_moments_of_its_slices(self):
        r, length, mass = 0.3, 0.8, 7.0
        y = np.linspace(-length / 2 - r, length / 2 + r, 200001)
        square = np.clip(r**2 - np.maximum(np.abs(y) - length / 2, 0)**2, 0, None)  # radius of a slice
        volume, axial, across = (float(np.sum(of)) * (y[1] - y[0]) * math.pi
                                 for of in (square, square**2 / 2, square**2 / 4 + square * y**2))
        rod = one("capsule", radius=r, length=length)
        self.assertAlmostEqual(look.VOLUME["capsule"](rod) / volume, 1, 6)
        np.testing.assert_allclose(look.inertia_of(rod, mass), mass / volume * np.array([across, axial, across]), rtol=1e-6)

    def test_a_tetrahedron_has_the_moments_of_the_closed_form(self):
        # Legs a, b, c from a corner: about the middle, a quarter along each, I_xx = 3 m (b^2 + c^2) / 80 and I_xy = m a b / 80.
        a, b, c, mass = 1.0, 2.0, 3.0, 5.0
        corner = np.array([10.0, 20, 30])
        shape = one("hull", points=corner + np.array([(0, 0, 0), (a, 0, 0), (0, b, 0), (0, 0, c)]))
        volume, centre, _ = shape.solid.moments()
        self.assertAlmostEqual(volume, a * b * c / 6)
        np.testing.assert_allclose(centre, corner + [a / 4, b / 4, c / 4])
        wanted = [[3 * (b * b + c * c), a * b, a * c], [a * b, 3 * (a * a + c * c), b * c], [a * c, b * c, 3 * (a * a + b * b)]]
        np.testing.assert_allclose(look.inertia_of(shape, mass), mass / 80 * np.array(wanted), rtol=1e-9)
        self.assertAlmostEqual(look.VOLUME["hull"](shape), 1)

    def test_a_hull_without_symmetry_is_as_far_from_all_shapes_as_its_own_side_says(self):
        # Legs of 1, 2 and 3 along x, y and z; upside down, turned about x, it reaches from -2 to 0 in y and from -3 to 0 in z.
        wedge = one("hull", points=[(0.0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)])
        up, down = np.eye(3), np.diag([1.0, -1, -1])
        plane, ball = one("half_space", normal=np.array([0.0, 1, 0])), one("sphere", radius=0.5)
        box, can = one("box", half=np.array([9.0, 1, 9])), one("cylinder", radius=9, length=2)
        rod, same = one("capsule", radius=0.25, length=1.5), one("hull", points=[(0.0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)])
        across = 1 / math.sqrt(1 + 1 / 4 + 1 / 9)  # of the origin from the slanted face
        for other, at, turn, gap in ((plane, (0, 0, 0), up, 0), (plane, (0, 0, 0), down, -2), (box, (0, 3.5, 0), up, 0.5),
                                     (box, (0, 3.5, 0), down, 2.5), (box, (0, -3.25, 0), up, 2.25),
                                     (box, (0, -3.25, 0), down, 0.25), (box, (0, -0.875, 0), up, -0.125), (can, (0, 2.875, 0), up,
                                                                                                           -0.125),
                                     (can, (0, -3.25, 0), down, 0.25), (ball, (0, 0, 4), up, 0.5), (ball, (0, 0, -4), up, 3.5),
                                     (ball, (0, 0, -4), down, 0.5), (ball, (-3, 0, 0), up, 2.5), (ball, (2.5, 0, 0), down, 1),
                                     (rod, (0.2, -2, 0.3), up, 1), (rod, (0, 4, 0), up, 1), (rod, (0, 4, 0), down, 3),
                                     (same, (0, 2.5, 0), up, 0.5), (same, (0, -4.5, 0), down, 0.5), (ball, (0.1, 0.1, -0.75), up,
                                                                                                     0.25)):
            # Of shapes that are apart the gap of solids is a bound from below; along an axis of theirs it is the distance.
            q = (np.zeros((1, 3)), turn[None])
            p = (np.array([at], float), np.eye(3)[None])
            with self.subTest(other.kind, at=at, down=turn is down):
                for found in (look.apart(wedge, *q, other, *p), look.apart(other, *p, wedge, *q)):
                    self.assertAlmostEqual(float(found[0]), gap, 7)
        for t in (-0.125, 0.5):  # over the slanted face, and below it
            point = (across + t) * across * np.array([1, 1 / 2, 1 / 3])
            self.assertAlmostEqual(float(look.point_solid(wedge.solid, np.zeros((1, 3)), up[None], point[None])[0]), t, 9)

    def test_a_hull_of_too_many_points_is_refused(self):
        turn = np.linspace(0, 2 * math.pi, look.HULL + 1, endpoint=False)
        with self.assertRaisesRegex(ValueError, f"a hull of {look.HULL + 1} points; at most {look.HULL}"):
            look.Solid(np.column_stack([np.cos(turn), np.sin(turn), turn]))


class Scenes(Modelled):
    def test_masses_moments_and_poses_are_those_of_the_scene(self):
        model = self.model(
            '<box name="b" size="0.4 0.5 0.6" density="1000" position="1 2 3" axis="0 0 2" angle="1.5707963267948966"/>'
            '<sphere name="s" radius="0.2" mass="3" position="4 5 6"/>'
            '<cylinder name="c" radius="0.3" length="0.8" density="500" position="7 8 9" quaternion="2 0 0 2"/>'
            '<capsule name="r" radius="0.1" length="0.5" density="1000" position="0 0 0"/>'
            '<hull name="h" points="0 0 0 1 0 0 0 2 0 0 0 3" scale="2" density="10" position="0 0 0"/>'
            '<half_space name="p" point="0 -1 0" normal="0 3 4"/><box name="f" size="1 2 3" fixed="yes" position="0 0 9"/>',
            '<pair a="b*" b="p" restitution="0.25"/><pair a="s" b="c"/>',
            '<forces><force body="b" force="1 2 3" from="0.5" to="0.75"/></forces>', 0.25)
        self.assertEqual((model.step, model.duration, model.gravity.tolist()), (1e-3, 0.25, GRAVITY.tolist()))
        self.assertEqual({name: round(mass, 9) for name, (mass, _) in model.free.items()}, {
            "b": 120, "s": 3, "c": round(500 * math.pi * 0.09 * 0.8, 9), "r": round(1000 * math.pi * 0.01 *
                                                                                    (0.5 + 0.4 / 3), 9), "h": 80})
        can = 500 * math.pi * 0.09 * 0.8
        for name, inertia in (("b", 10 * np.array([0.25 + 0.36, 0.16 + 0.36, 0.16 + 0.25])), ("s", 3 * [0.4 * 3 * 0.04]),
                              ("c", can * np.array([0.09 / 4 + 0.64 / 12, 0.09 / 2, 0.09 / 4 + 0.64 / 12]))):
            np.testing.assert_allclose(model.free[name][1], inertia, err_msg=name)
        shapes = {shape.name: shape for shape in model.shapes}
        quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        for name, owner, place, turn in (("b", "b", (1, 2, 3), quarter), ("s", "s", (4, 5, 6), np.eye(3)),
                                         ("c", "c", (7, 8, 9), quarter), ("p", "", (0, -1, 0), np.eye(3)), ("f", "", (0, 0, 9),
                                                                                                            np.eye(3))):
            self.assertEqual(shapes[name].owner, owner)
            np.testing.assert_allclose(shapes[name].p, place)
            np.testing.assert_allclose(shapes[name].R, turn, atol=1e-15)
        np.testing.assert_allclose(shapes["p"].normal, [0, 0.6, 0.8])
        np.testing.assert_allclose([shapes["b"].half, shapes["f"].half], [[0.2, 0.25, 0.3], [0.5, 1, 1.5]])
        self.assertEqual((shapes["c"].radius, shapes["c"].length, shapes["r"].size, shapes["h"].size), (0.3, 0.8, 0.7, 6))
        self.assertEqual(model.pairs, [("b*", "p", 0.25), ("s", "c", 0)])
        (body, force, begin, end), = model.forces
        self.assertEqual((body, force.tolist(), begin, end, model.driven), ("b", [1, 2, 3], 0.5, 0.75, True))

    def test_links_of_a_robot_have_their_shapes_masses_and_limits(self):
        model = self.model(
            '<robot name="r"><link name="a" mass="2" inertia="1 2 3"><box name="s1" size="1 1 2" position="0 1 0"/></link>'
            '<link name="b" mass="3" inertia="4 5 6"><sphere name="s2" radius="0.5" position="5 0 0"/></link>'
            '<joint name="j" lower="-0.5" upper="2" limit_rate="0.25"/><joint name="k"/>'
            '<joint name="l" lower="0" upper="1"/></robot>')
        self.assertEqual({name: (mass, inertia.tolist()) for name, (mass, inertia) in model.links.items()},
                         {"a": (2, [1, 2, 3]), "b": (3, [4, 5, 6])})
        self.assertEqual(model.limits, {"j": (-0.5, 2, 0.25), "l": (0, 1, 0)})
        self.assertEqual([(shape.name, shape.owner, shape.p.tolist()) for shape in model.shapes], [("s1", "a", [0, 1, 0]),
                                                                                                   ("s2", "b", [5, 0, 0])])
        self.assertFalse(model.free or model.driven)

    def test_a_robot_from_a_file_stands_where_its_origins_add_up_to(self):
        def link(name, mass, inertia, at, solid):
            moments = " ".join(f'{key}="{value}"' for key, value in zip(("ixx", "iyy", "izz"), inertia))
            return (f'<link name="{name}"><inertial><mass value="{mass}"/><inertia {moments}/></inertial>'
                    f'<collision><origin xyz="{at}"/>'
                    f"<geometry>{solid}</geometry></collision></link>")

        def joint(name, kind, parent, child, at, limit=""):
            return (f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
                    f'<origin xyz="{at}"/>{limit}</joint>')

        (self.top /
         "arm.urdf").write_text('<robot><link name="base"/>' + link("a", 2, (1, 2, 3), "0 0 0.5", '<box size="1 2 3"/>') +
                                link("b", 4, (5, 6, 7), "0 0.25 0", '<sphere radius="0.75"/>') +
                                joint("j", "revolute", "base", "a", "1 0 0", '<limit lower="-1" upper="2"/>') +
                                joint("k", "prismatic", "a", "b", "0 2 0", '<limit upper="3"/>') +
                                joint("f", "fixed", "b", "c", "0 0 0", '<limit lower="1" upper="2"/>') + "</robot>")
        model = self.model('<robot name="r" urdf="arm.urdf"/>')
        self.assertEqual({name: (mass, inertia.tolist()) for name, (mass, inertia) in model.links.items()},
                         {"a": (2, [1, 2, 3]), "b": (4, [5, 6, 7])})
        box, ball = model.shapes
        self.assertEqual((box.kind, box.owner, box.p.tolist(), box.half.tolist()), ("box", "a", [1, 0, 0.5], [0.5, 1, 1.5]))
        self.assertEqual((ball.kind, ball.owner, ball.p.tolist(), ball.radius), ("sphere", "b", [1, 2.25, 0], 0.75))
        self.assertEqual(model.limits, {"j": (-1, 2, 0), "k": (0, 3, 0)})

    def test_what_is_not_read_here_is_refused(self):
        for bodies, more, why in (('<array count="2"/>', "", "parameters, harmonics and arrays"), ("", "<parameters/>",
                                                                                                   "parameters, harmonics"),
                                  ('<robot name="r" position="0 0 0"/>', "",
                                   "robots that are placed"), ('<robot name="r" prefix="x"/>', "", "placed"),
                                  ('<sphere name="s" radius="1" mass="1" position="0 0"/>', "",
                                   "3 plain numbers are needed, not '0 0'")):
            with self.assertRaisesRegex(ValueError, why):
                self.model(bodies, more=more)

    def test_shapes_collide_where_a_pair_names_them_either_way_round_and_never_with_their_own(self):
        ball = '<sphere name="{}" radius="{}" mass="1" position="{} 0 0"/>'
        model = self.model(
            "".join(ball.format(name, r, x) for name, r, x in (("b1", 1, 0), ("b2", 1, 1), ("c1", 0.75, 1.5), ("c2", 1, 99))) +
            '<half_space name="p" point="0 -0.75 0" normal="0 1 0"/><box name="q" size="9 9 9" fixed="yes" position="0 0 0"/>'
            '<robot name="r"><link name="k" mass="1" inertia="1 1 1"><box name="s1" size="1 1 1" position="0 0 0"/>'
            '<box name="s2" size="1 1 1" position="0 0 0"/></link></robot>', '<pair a="b*" b="c1"/><pair a="p" b="b2"/>'
            '<pair a="s*" b="s*"/><pair a="p" b="q"/>')
        shapes = {shape.name: shape for shape in model.shapes}
        found = {(a, b) for a in shapes for b in shapes if model.collide(shapes[a], shapes[b])}
        wanted = {("b1", "c1"), ("b2", "c1"), ("p", "b2")}
        self.assertEqual(found, wanted | {(b, a) for a, b in wanted})
        # b2 and c1, of 2 m and 1.5 m, overlap by 1.25 m, more than b1 and c1, or b2 and the ground, by 0.25 m.
        self.assertAlmostEqual(look.initial_penetration(model), 1.25 / 1.5)


class Files(Modelled):
    """Runs of 1 ms steps; bodies are {name: (p, q, v, w)} of each moment."""
    def look(self, model, bodies, kinetic=None, joints=(), loads="", **summary):
        count = len(next(iter(bodies.values()))[0])
        rows = [(repr(1e-3 * n), name, *(repr(float(x)) for part in parts for x in part[n])) for n in range(count)
                for name, parts in bodies.items()]
        (self.top / "trajectory.csv").write_text(csv_of(HEAD, rows))
        (self.top / "steps.csv").write_text(
            csv_of("t,status,kinetic_energy",
                   [(1e-3 * n, "ok", repr(k))
                    for n, k in enumerate(kinetic if kinetic is not None else (count - 1) * [0.0], start=1)]))
        (self.top / "joints.csv").write_text(csv_of("t,joint,q", joints))
        if loads:
            (self.top / "loads.csv").write_text(loads)
        return look.look(self.top, model, OK | summary)

    def falling(self, count=3, v=(1.0, 2, 3), p=(0.0, 5, 0), spin=(0.0, 0, 0), gravity=GRAVITY):
        """Free fall by explicit Euler, velocities first."""
        vs = [np.array(v) + 1e-3 * n * gravity for n in range(count)]
        ps = [np.array(p) + 1e-3 * sum(vs[1:n + 1], np.zeros(3)) for n in range(count)]
        return ps, count * [(1.0, 0, 0, 0)], vs, count * [spin]

    def kinetic(self, mass, vs):
        return [0.5 * mass * float(v @ v) for v in vs[1:]]

    BALL = '<sphere name="b" radius="0.5" mass="2" position="0 5 0"/>'

    def test_free_fall_is_right_and_its_energies_have_to_be_those_of_the_steps(self):
        model, body = self.model(self.BALL), self.falling()
        kinetic = self.kinetic(2, body[2])
        self.assertEqual(self.look(model, {"b": body}, kinetic).faults, [])
        kinetic[1] *= 1 + 2e-6
        fault, = self.look(model, {"b": body}, kinetic).faults
        self.assertIn(f"energy: steps.csv has {kinetic[1]!r} J at t = 0.002 s, the trajectory {kinetic[1] / (1 + 2e-6):.9g} J",
                      fault)

    def test_each_law_of_free_flight_is_named_by_what_breaks_it(self):
        model = self.model(self.BALL)
        for part, what in ((0, "place"), (2, "velocity"), (3, "angular momentum")):
            body = self.falling(spin=(0.0, 3, 0))
            body = [[np.array(x, float) for x in of] for of in body]
            body[part][2] = body[part][2] + (-1e-4 if part == 2 else 1e-4 if part == 0 else np.array([1e-3, -1e-3, 0.0]))
            if part == 2:
                body[0][2] = body[0][1] + 1e-3 * body[2][2]
            out = self.look(model, {"b": body}, self.kinetic(2, body[2]))
            self.assertTrue(
                any(
                    f.startswith(f"momentum: b touches nothing, and its {what} is off by") and "at t = 0.002 s" in f
                    for f in out.faults), out.faults)
            self.assertGreater(out.momentum, 1)

    def test_a_velocity_in_flight_is_right_to_a_billionth(self):
        model = self.model(self.BALL)
        for off, count in ((1e-9, 0), (2e-8, 1)):  # along each axis, of 3.7 m/s
            body = [[np.array(x, float) for x in of] for of in self.falling()]
            body[2][2] = body[2][2] - off
            body[0][2] = body[0][1] + 1e-3 * body[2][2]
            self.assertEqual(len(self.look(model, {"b": body}, self.kinetic(2, body[2])).faults), count, off)

    def test_a_force_pushes_the_body_that_it_is_of_from_its_begin_to_its_end(self):
        model = self.model(self.BALL + self.BALL.replace('"b"', '"c"'),
                           more='<forces><force body="b" force="4 0 0" from="0.001" to="0.003"/></forces>')
        times = 1e-3 * np.arange(6)
        np.testing.assert_allclose(
            look.push(model, "b", 2.0, times) - GRAVITY, [[2 * (n in (1, 2)), 0, 0] for n in range(5)], atol=1e-12)
        np.testing.assert_allclose(look.push(model, "c", 2.0, times), 5 * [GRAVITY])
        both = '<force body="b" force="4 0 0" from="0.001" to="0.003"/>' \
            '<force body="b" force="0 6 0" from="0.002" to="0.004"/>'
        model = self.model(self.BALL, more=f"<forces>{both}</forces>")  # both push in the third step
        np.testing.assert_allclose(
            look.push(model, "b", 2.0, times) - GRAVITY, [[2 * (n in (1, 2)), 3 * (n in (2, 3)), 0] for n in range(5)],
            atol=1e-12)

    def test_the_momentum_that_is_off_most_counts_of_all_bodies(self):
        model = self.model(self.BALL + self.BALL.replace('"b"', '"c"').replace('"0 5 0"', '"9 5 0"'))
        off, right = ([[np.array(x, float) for x in of] for of in self.falling(p=(x, 5, 0))] for x in (0.0, 9.0))
        off[2][2] = off[2][2] - 1e-9  # along each axis, of 3.7 m/s: half of what may be
        off[0][2] = off[0][1] + 1e-3 * off[2][2]
        kinetic = [a + b for a, b in zip(self.kinetic(2, off[2]), self.kinetic(2, right[2]))]
        for bodies in ({"b": off, "c": right}, {"b": right, "c": off}):
            out = self.look(model, bodies, kinetic)
            self.assertEqual(out.faults, [])
            self.assertTrue(0.3 < out.momentum < 0.7, out.momentum)
        # What gains is named by its own island, the second.
        off[2][2] = off[2][2] + 1e-4
        off[0][2] = off[0][1] + 1e-3 * off[2][2]
        kinetic = [a + b for a, b in zip(self.kinetic(2, off[2]), self.kinetic(2, right[2]))]
        energy, = (fault for fault in self.look(model, bodies, kinetic).faults if fault.startswith("energy: "))
        self.assertRegex(energy, "^energy: kinetic energy gains .* the island of c in the step to t = 0.002 s$")

    def test_files_that_are_no_run_of_the_scene_are_said(self):
        model, body = self.model(self.BALL), self.falling()
        kinetic = self.kinetic(2, body[2])
        self.assertEqual(self.look(model, {"c": body}, kinetic).faults, ["files: trajectory.csv has other bodies than the scene"])
        self.assertEqual(
            self.look(self.model(self.BALL, duration=0.004), {"b": body}, kinetic).faults,
            ["files: the trajectory ends at 0.002 s, not 0.004 s"])
        for status, count in (("inaccurate", 1), ("ray", 0)):
            self.assertEqual(
                len(
                    self.look(model=self.model(self.BALL, duration=0.004), bodies={"b": body}, kinetic=kinetic,
                              status=status).faults), count)
        self.assertEqual(
            self.look(model, {"b": body}, [kinetic[0], math.nan]).faults, ["files: steps.csv: kinetic_energy is 'nan'"])
        for loads, faults in (("t,a,b,normal\n0,ball,ground,\n", []), ("t,a,b,normal\n0,ball,ground,inf\n", [
                "files: loads.csv: normal is 'inf'"]), ("t,what\n0,word\n", ["files: loads.csv: what is 'word'"])):
            self.assertEqual(self.look(model, {"b": body}, kinetic, loads=loads).faults, faults)

    def test_penetration_is_of_the_smaller_size_and_as_deep_as_the_program_states_where_that_is_less(self):
        model = self.model('<box name="b" size="0.2 0.2 0.2" mass="2" position="0 0.1 0"/>'
                           '<box name="f" size="9 2 9" fixed="yes" position="0 -1 0"/>')
        rest = [np.zeros(3)] * 3
        for depth, bound, found in ((1e-7, {}, False), (3e-7, {}, True), (3e-8, {"penetration_bound": 1e-7}, True), (1e-8, {
                "penetration_bound": 1e-7}, False), (3e-7, {"penetration_bound": 1.0}, True)):
            places = [np.array([0, 0.1 - depth * (n == 1), 0]) for n in range(3)]
            out = self.look(model, {"b": (places, 3 * [(1, 0, 0, 0)], rest, rest)}, options=bound)
            said = [fault for fault in out.faults if fault.startswith("penetration")]
            self.assertEqual(len(said), found, depth)
            self.assertAlmostEqual(out.penetration / depth, 1, 5)
            self.assertAlmostEqual(out.penetration_relative / (depth / 0.2), 1, 5)
        self.assertEqual(said, ["penetration: 3e-07 m, 1.5e-06 of the size, b and f at t = 0.001 s"])

    def test_the_worst_penetration_is_that_of_the_largest_share_of_a_size(self):
        boxes = [
            f'<box name="b{n}" size="{size} {size} {size}" mass="1" position="{9 * n} {size / 2} 0"/>'
            for n, size in enumerate((4, 0.2))]
        rest = [np.zeros(3)] * 2
        for order in (1, -1):
            model = self.model("".join(boxes[::order]) + '<half_space name="p" point="0 0 0" normal="0 1 0"/>', duration=0.001)
            out = self.look(
                model, {
                    f"b{n}": (2 * [np.array([9 * n, size / 2 - depth, 0])], 2 * [(1, 0, 0, 0)], rest, rest)
                    for n, size, depth in ((0, 4, 4e-6), (1, 0.2, 3e-7))})
            self.assertAlmostEqual(out.penetration / 3e-7, 1, 5)
            self.assertEqual(out.where, "b1 and p at t = 0 s")

    def test_a_gain_in_an_event_is_said_from_a_billionth_on_with_what_it_is_in_joules(self):
        model, body = self.model(self.BALL), self.falling()
        for gain, count in ((9e-10, 0), (2e-9, 1)):
            out = self.look(model, {"b": body}, self.kinetic(2, body[2]), energy={"max_gain_relative": gain, "max_gain_j": 0.125})
            self.assertEqual((out.event_gain, len(out.faults)), (gain, count))
        self.assertEqual(out.faults, ["energy: an event gains 2e-09 of its kinetic energy (0.125 J)"])
        self.assertEqual(self.look(model, {"b": body}, self.kinetic(2, body[2]), energy={"max_gain_relative": -1}).event_gain, 0)

    def test_a_hull_has_the_frame_of_its_centre_and_principal_axes(self):
        # A block of 1 x 2 x 3 from a corner: its frame is about its middle, and may have its axes in another order.
        points = " ".join(f"{x} {y} {z}" for x in (0, 1) for y in (0, 2) for z in (0, 3))
        hull = f'<hull name="h" points="{points}" mass="12" position="0 50 0"/>'
        ps, _, vs, ws = self.falling(p=(0.5, 51, 1.5))
        kinetic = self.kinetic(12, vs)
        model = self.model(hull)
        self.assertEqual(self.look(model, {"h": (ps, 3 * [(1, 0, 0, 0)], vs, ws)}, kinetic).faults, [])
        np.testing.assert_allclose(model.free["h"][1], [4 + 9, 1 + 9, 1 + 4])
        model = self.model(hull)
        third = 3 * [(0.5, 0.5, 0.5, 0.5)]  # x of the frame is y of the points, y is z, and z is x
        self.assertEqual(self.look(model, {"h": (ps, third, vs, ws)}, kinetic).faults, [])
        np.testing.assert_allclose(model.free["h"][1], [1 + 9, 1 + 4, 4 + 9])
        said = ["files: the frame of h is not that of its centre and principal axes"]
        self.assertEqual(
            self.look(self.model(hull), {"h": (ps, 3 * [(math.cos(0.1), 0, 0, math.sin(0.1))], vs, ws)}, kinetic).faults, said)
        ps = [p + [0, 1e-6, 0] for p in ps]
        self.assertEqual(self.look(self.model(hull), {"h": (ps, 3 * [(1, 0, 0, 0)], vs, ws)}, kinetic).faults, said)

    def test_a_joint_is_within_its_limits_on_either_side_to_their_tolerance(self):
        robot = ('<robot name="r"><link name="k" mass="1" inertia="1 1 1"><sphere name="s" radius="1" position="0 0 0"/></link>'
                 '<joint name="j" lower="-0.5" upper="2"/></robot>')
        still = {"k": ([np.zeros(3)] * 3, 3 * [(1, 0, 0, 0)], [np.zeros(3)] * 3, [np.zeros(3)] * 3)}
        said = "limits: j is {} beyond its limit at t = 0.001 s"
        for q, fault in ((2 + 5e-9, []), (2 + 2e-8, [said.format("2e-08")]), (-0.5 - 5e-9, []), (-0.625, [said.format(0.125)])):
            rows = [(0, "j", 0), (0.001, "j", q), (0.001, "other", 99)]
            self.assertEqual(self.look(self.model(robot), still, joints=rows).faults, fault)
        # Each joint has its own.
        two = self.model(robot.replace("</robot>", '<joint name="l" lower="0" upper="1"/></robot>'))
        rows = [(0, "j", 0), (0, "l", 0), (0.001, "j", 1.5), (0.001, "l", 1.25)]
        self.assertEqual(self.look(two, still, joints=rows).faults,
                         ["limits: l is 0.25 beyond its limit at t = 0.001 s"])

    def test_limits_that_are_driven_move_both_the_same_way(self):
        robot = ('<robot name="r"><link name="k" mass="1" inertia="1 1 1"><sphere name="s" radius="1" position="0 0 0"/></link>'
                 '<joint name="j" lower="-0.5" upper="2" limit_rate="{}"/></robot>')
        still = {"k": ([np.zeros(3)] * 3, 3 * [(1, 0, 0, 0)], [np.zeros(3)] * 3, [np.zeros(3)] * 3)}
        said = "limits: j is 0.125 beyond its limit at t = 0.5 s"
        # After half a second at 1 and at -1 a second: from 0 to 2.5, and from -1 to 1.5.
        for rate, q, fault in ((1, 2.5, []), (1, 2.625, [said]), (1, 0, []), (1, -0.125, [said]), (-1, 1.5, []), (-1, 1.625, [said]),
                               (-1, -1, []), (-1, -1.125, [said])):
            rows = [(0, "j", 0), (0.5, "j", q)]
            self.assertEqual(self.look(self.model(robot.format(rate)), still, joints=rows).faults, fault, (rate, q))


class Energies(Modelled):
    def test_a_turning_body_has_the_energy_of_its_own_axes_and_gravity_s_kick(self):
        model = self.model('<box name="b" size="1 2 3" mass="12" position="0 0 0"/>')
        inertia, R = np.array([13.0, 10, 5]), look.matrix(TURN)
        own = np.array([1.0, -2, 3])  # about its own axes
        v = np.array([4.0, 5, 6])
        motion = {"b": (np.zeros((2, 3)), np.array([TURN, TURN]), np.array([v, v]), np.array([R @ own, R @ own]))}
        frame = np.array([1.0, 0, 0])
        kinetic, begun = look.energies(model, np.array([0, 1e-3]), motion, model.free, frame)
        turning = 0.5 * float(inertia @ own**2)
        np.testing.assert_allclose(kinetic, 2 * [[6 * (9 + 25 + 36) + turning]])
        kicked = v - frame + 1e-3 * GRAVITY
        torque = np.cross(own, own * inertia)
        np.testing.assert_allclose(begun, [[6 * kicked @ kicked + turning + 0.5e-6 * float(torque**2 / inertia @ np.ones(3))]],
                                   rtol=1e-12)

    def test_links_may_gain_to_second_order_of_how_fast_the_robot_changes(self):
        model = self.model(
            '<robot name="r"><link name="a" mass="2" inertia="1 2 4"><box name="s" size="1 1 2" position="0 0 0"/></link>'
            '<link name="b" mass="1" inertia="1 1 1"><sphere name="t" radius="0.25" position="0 0 0"/></link></robot>')
        at = np.zeros((2, 3))
        turn = np.array([TURN, TURN])  # the frame of a link is the world's in its zero pose
        motion = {"a": (at, turn, at + [3, 0, 4], at + [0, 7, 0]), "b": (at, turn, at + [0, 2, 0], at)}
        np.testing.assert_allclose(look.fastest(model, motion), 2 * [7 + 5 / 0.5 + 2 / 0.5])
        kinetic, begun = look.energies(model, np.array([0, 1e-3]), motion, model.links, np.zeros(3))
        np.testing.assert_allclose(kinetic[0], [25 + 49, 2])
        for n, (mass, v, turning) in enumerate(((2, np.array([3, 0, 4]), 49), (1, np.array([0, 2, 0]), 0))):
            kicked = v + 1e-3 * GRAVITY
            self.assertAlmostEqual(begun[0, n], 0.5 * mass * kicked @ kicked + turning + (1e-3 * 21)**2 * kinetic[0, n], 12)

    def test_links_of_a_robot_are_one_island_with_all_that_one_of_them_touches(self):
        link = '<link name="{0}" mass="1" inertia="1 1 1"><sphere name="s{0}" radius="1" position="0 0 0"/></link>'
        model = self.model('<robot name="r">' + link.format("k1") + link.format("k2") + "</robot>" +
                           "".join(f'<sphere name="{name}" radius="1" mass="1" position="0 0 0"/>'
                                   for name in ("b1", "b2", "b3")))
        names = ["b1", "b2", "b3", "k1", "k2"]
        label = look.islands(names, model, [("k2", "b3", np.array([True, False])), ("b1", "k1", np.array([True, True]))], 2)
        self.assertEqual([len(set(row)) for row in label], [2, 3])
        self.assertEqual(len({label[0, n] for n in (0, 2, 3, 4)}), 1)
        self.assertEqual(len({label[1, n] for n in (0, 3, 4)}), 1)

    def test_the_frame_of_a_belt_is_its_steady_velocity_and_none_where_it_has_several_or_turns(self):
        robot = '<robot name="r"><link name="k" mass="1" inertia="1 1 1"/><link name="l" mass="1" inertia="1 1 1"/></robot>'
        none, run = np.zeros((3, 3)), np.tile([2.0, 0, 1], (3, 1))
        for first, second, turn, frame in ((run, run, none, [2, 0, 1]), (run, -run, none, None), (run, run, none + 1e-3, None)):
            found = look.moving_frame(self.model(robot), {"k": (none, none, first, none), "l": (none, none, second, turn)})
            self.assertEqual(None if found is None else found.tolist(), frame)
        driven = self.model(robot, more="<controllers/>")
        self.assertIsNone(look.moving_frame(driven, {"k": (none, none, run, none), "l": (none, none, run, none)}))


class Poses(Modelled):
    def test_a_shape_moves_with_its_link_from_the_zero_pose_and_with_its_body(self):
        model = self.model(
            '<robot name="r"><link name="k" mass="1" inertia="1 1 1">'
            '<sphere name="s" radius="0.5" position="3 0 0"/></link></robot>'
            '<sphere name="b" radius="0.5" mass="1" position="0 0 0"/><half_space name="p" point="0 -1 0" normal="0 1 0"/>')
        quarter = [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
        p, v, w = np.array([[1.0, 0, 0], [1, 5, 0]]), np.array([[0.0, 3, 4], [0, 0, 1]]), np.array([[0.0, 0, 2], [0, 0, 1]])
        # The link's frame begins turned; its shape is 2 m beside it, and then a quarter further.
        both = np.array([quarter, [0, 0, 0, 1]])
        motion = {"k": (p, both, v, w), "b": (p + 10, np.array([quarter, quarter]), 2 * v, w)}
        (of_link, R, _, _), (of_body, Q, _, _), (plane, _, still, _) = at = look.poses(model, motion)
        np.testing.assert_allclose(of_link, [[3, 0, 0], [1, 7, 0]], atol=1e-12)
        np.testing.assert_allclose(R, [np.eye(3), look.matrix(np.array(quarter))], atol=1e-12)
        np.testing.assert_allclose(of_body, p + 10)
        np.testing.assert_allclose(Q[0], look.matrix(np.array(quarter)))
        np.testing.assert_allclose([plane, still], [2 * [[0, -1, 0]], np.zeros((2, 3))])
        # How far they get in 1 ms: the faster of now and then, at the rim, which of a link is as far out as its zero pose says.
        fall = 1e-3 * float(np.linalg.norm(GRAVITY))
        link, body, ground = look.travels(model, at)
        np.testing.assert_allclose(link, 1e-3 * (np.array([5 + 3.5 * 2, 1 + 3.5 * 1]) + fall))
        np.testing.assert_allclose(body, 1e-3 * (np.array([10 + 0.5 * 2, 2 + 0.5 * 1]) + fall))
        np.testing.assert_allclose(ground, 0)
        slow_first = [(of_body, Q, 2 * v[::-1], w[::-1])]
        model.shapes = model.shapes[1:2]
        np.testing.assert_allclose(look.travels(model, slow_first), [1e-3 * (np.array([11, 11]) + fall)])

    def test_what_may_touch_in_a_step_is_no_free_flight_and_touches_by_name(self):
        model = self.model(
            '<sphere name="b" radius="0.5" mass="1" position="0 0 0"/><sphere name="c" radius="0.25" mass="1" position="0 0 0"/>'
            '<half_space name="p" point="0 0 0" normal="0 1 0"/>', '<pair a="b" b="*"/>')
        still, turn = np.zeros((4, 3)), np.tile([1.0, 0, 0, 0], (4, 1))
        # The ground is far but at the second moment, when b is 15 micrometres above it, and gravity brings it 9 down in a step,
        # which is counted twice; c is near at the last one alone, beside b.
        b = np.array([[0, 3, 0], [0, 0.5 + 1.5e-5, 0], [0, 0.5 + 3e-5, 0], [0, 3, 0]])
        c = np.array([[9, 3, 0], [9, 3, 0], [9, 3, 0], [0.75, 3, 0.0]])
        out = look.Look()
        found = look.penetrations(model, 1e-3 * np.arange(4), {"b": (b, turn, still, still), "c": (c, turn, still, still)}, OK,
                                  out)
        self.assertEqual([(x, y, touching.tolist()) for x, y, touching in found], [("c", "b", [False, False, True]),
                                                                                   ("", "b", [True, True, False])])
        self.assertEqual(out.penetration, 0)
        np.testing.assert_array_equal(look.close_times(model.shapes[2], still, model.shapes[0], b, 0.1), [1, 2])
        np.testing.assert_array_equal(look.close_times(model.shapes[0], b, model.shapes[1], c, np.full(4, 0.1)), [3])

    def test_how_near_is_near_and_how_deep_is_of_the_moment(self):
        model = self.model('<box name="b" size="1 1 1" mass="1" position="0 3 0"/>'
                           '<half_space name="p" point="0 0 0" normal="0 1 0"/>', '<pair a="b" b="p"/>')
        still, turn = np.zeros((3, 3)), np.tile([1.0, 0, 0, 0], (3, 1))

        def look_at(heights, speed):
            """Which steps may touch, and what was deepest; it has that speed at first."""
            out, p, v = look.Look(), np.zeros((3, 3)), np.zeros((3, 3))
            p[:, 1], v[0, 1] = heights, speed
            found = look.penetrations(model, 1e-3 * np.arange(3), {"b": (p, turn, v, still)}, OK, out)
            return [touching.tolist() for *_, touching in found], out.penetration, out.where

        # What moves by a decimetre in a step, as it did at first, is near a centimetre above the ground; what stands is not.
        self.assertEqual(look_at([3, 0.51, 0.51], 100), ([[False, False]], 0, ""))
        (touching, ), depth, where = look_at([3, 3, 0.4], 0)
        self.assertEqual((touching, where), ([False, True], "b and p at t = 0.002 s"))
        self.assertAlmostEqual(depth, 0.1)


if __name__ == "__main__":
    unittest.main()
