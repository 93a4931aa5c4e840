"""What figures are made of (looks.py, robots.py): the look of a method, curves with their marks, and the places of robots, on
numbers that are known."""
import itertools
import unittest
import xml.etree.ElementTree as ET
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from contactbench import looks, robots
from folder import Folder
from made import csv_of, lines_of, results, trajectory
from PIL import Image

SCENES = Path(__file__).resolve().parents[2] / "scenarios"
PARTS = "t,dynamics_s,write_s,collision_s,check_s,assembly_s,solve_s"


class Drawn(Folder):
    def setUp(self):
        super().setUp()
        self.addCleanup(plt.close, "all")

    def cells(self, *rows):
        return results(self.top, rows).cells()


class Looks(Drawn):
    def test_a_method_has_its_own_name_colour_and_marker(self):
        said = {("newton", "uncapped"): "Newton, uncapped", ("newton", "stick-tested"): "Newton, stick-tested",
                ("mirtich", ""): "Mirtich", ("ap", "lemke"): "A-P, Lemke", ("ap", "path"): "A-P, PATH", ("ap", "ynl"): "A-P, YNL",
                ("ap", "pgs"): "A-P, PGS", ("convex", "ipm"): "convex", ("coulomb", "newton"): "Coulomb, Newton",
                ("coulomb", "nsgs"): "Coulomb, Gauss-Seidel", ("coulomb", "bisection"): "Coulomb, bisection",
                ("coulomb", "admm"): "Coulomb, ADMM", ("coulomb", "cascade"): "Coulomb, cascade", ("soft", "sap"): "soft, SAP",
                ("soft", "mujoco"): "soft, MuJoCo"}
        self.assertEqual({key: look[0] for key, look in looks.LOOKS.items()}, said)
        for part in (1, 2):
            self.assertEqual(len({look[part] for look in looks.LOOKS.values()}), len(said), part)
        self.assertEqual(looks.look_of(("ap", "path"), None), ("A-P, PATH", looks.SKY, "s"))
        self.assertEqual(looks.look_of(("mirtich", "other"), None)[0], "Mirtich")  # that of the method without a solver
        self.assertEqual(looks.look_of(("ap", "other"), "instead"), "instead")
        self.assertEqual(len(set(looks.LATER)), len(looks.LATER))

    def test_labels_say_the_knobs_and_lines_tell_them_apart_within_a_method(self):
        cells = self.cells({"k": "4"}, {"method": "convex", "solver": "ipm", "epsilon": "1e-12"}, {"k": "16"},
                           {"method": "convex", "solver": "ipm", "epsilon": "2.5e-3", "knobs": "compression_bound=off"},
                           {"method": "late", "solver": "one"}, {"method": "late", "solver": "two"})
        made = looks.styles(cells)
        self.assertEqual([look["label"] for look in made], [
            "A-P, Lemke, k = 4", r"convex, $\epsilon$ = $10^{-12}$ J", "A-P, Lemke, k = 16",
            r"convex, $\epsilon$ = 2.5 $\times$ $10^{-3}$ J, compression bound=off", "late one", "late two"])
        self.assertEqual([looks.LINES.index(look["linestyle"]) for look in made], [0, 0, 1, 1, 0, 0])
        self.assertEqual([(look["color"], look["marker"]) for look in made[:4]], 2 * [(looks.BLUE, "o"), (looks.BLACK, "d")])
        self.assertEqual([(look["color"], look["marker"]) for look in made[4:]], looks.LATER[:2])
        self.assertEqual([look["zorder"] for look in made], sorted({look["zorder"] for look in made}))  # the later above

    def test_a_power_of_ten_has_its_mantissa_where_it_has_one(self):
        for number, said in (("1e-12", "$10^{-12}$"), ("0.01", "$10^{-2}$"), ("3e4", r"3 $\times$ $10^{4}$"),
                             ("1.25e-6", r"1.25 $\times$ $10^{-6}$")):
            self.assertEqual(looks.power(number), said)

    def test_a_thinned_curve_keeps_its_ends_and_every_extreme(self):
        t, y = np.arange(10000.0), np.zeros(10000)
        y[[1234, 7777, 1, 2, 9993, 9994]], y[[0, -1]] = (5, -7, 3, -3, 3, -3), (1, 2)
        x, z = looks.thin(t, y, 100)
        self.assertLessEqual(len(x), 102)
        self.assertLessEqual({(0, 1), (1, 3), (2, -3), (1234, 5), (7777, -7), (9993, 3), (9994, -3), (9999, 2)}, set(zip(x, z)))
        self.assertEqual(sorted(set(x)), list(x))
        self.assertIs(looks.thin(t, y, 10000)[0], t)

    def test_how_a_run_ended_is_added_to_its_name(self):
        cells = self.cells({"k": ""}, {"k": "4", "status": "inaccurate"},
                           {"k": "8", "status": "ray", "finished": "false", "t_reached": "0.25"})
        self.assertEqual([looks.ending(cell) for cell in cells], ["", " (inaccurate)", r" ($\bf{\times}$ ray at 0.25 s)"])
        labels = [handle.get_label() for handle in looks.Curves(cells).handles()]
        self.assertEqual(labels,
                         ["A-P, Lemke", "A-P, Lemke, k = 4 (inaccurate)", r"A-P, Lemke, k = 8 ($\bf{\times}$ ray at 0.25 s)"])

    def test_the_legend_lies_below_the_picture_with_its_note_at_the_end(self):
        figure = plt.figure()
        looks.legend(figure, [looks.point("one", "C0", "o"), looks.point("two", "C1", "x")], 2, "and a note")
        made = figure.legends[0]
        self.assertEqual([text.get_text() for text in made.get_texts()], ["one", "two", "and a note"])
        self.assertEqual([line.get_marker() for line in made.get_lines()], ["o", "x", "None"])
        self.assertEqual((made._ncols, made.get_bbox_to_anchor().transformed(figure.transFigure.inverted()).y1), (2, 0))
        looks.legend(figure, [looks.point("one", "C0", "o")])
        self.assertEqual(len(figure.legends[1].get_texts()), 1)

    def test_a_floor_is_a_line_where_it_is_with_its_words_at_the_right(self):
        _, axes = plt.subplots()
        looks.floor_line(axes, 0.25, "below is here", xytext=(-2, 3))
        self.assertEqual(list(axes.lines[0].get_ydata()), [0.25, 0.25])
        self.assertEqual((axes.texts[0].get_text(), axes.texts[0].xy), ("below is here", (1, 0.25)))

    def test_a_picture_is_saved_as_png_and_svg_and_closed(self):
        figure, axes = plt.subplots(figsize=(3, 2))
        axes.plot([0, 1], [0, 1], color="#ff0000")
        looks.save(figure, self.top / "deep/er", "name")
        self.assertEqual(sorted(p.name for p in (self.top / "deep/er").iterdir()), ["name.png", "name.svg"])
        with Image.open(self.top / "deep/er/name.png") as drawn:
            colours = [colour for _, colour in drawn.convert("RGB").getcolors(100000)]
        self.assertTrue({(255, 0, 0), (255, 255, 255)} <= set(colours))
        self.assertFalse(plt.fignum_exists(figure.number))


class Curves(Drawn):
    def test_markers_stand_apart_and_a_cross_is_where_a_run_stopped(self):
        t = np.arange(81.0)
        table = looks.Curves(
            self.cells({"k": ""}, {"k": "4", "status": "ray", "finished": "false", "t_reached": "80"},
                       {"k": "8", "status": "inaccurate"}, {"k": "16", "status": "ray", "finished": "false", "t_reached": "8"}))
        _, axes = plt.subplots()
        for number in range(4):
            table.draw(axes, number, t, 100 * number + t, **{"cross": False} if number == 3 else {})
        self.assertEqual([list(line.get_ydata()) for line in lines_of(axes)], [list(100 * n + t) for n in range(4)])
        self.assertEqual([line.get_label() for line in lines_of(axes)], [look["label"] for look in table.looks])
        marked = [line for line in lines_of(axes, linestyle="None") if line.get_marker() == "o"]
        # Ten apart in 80, by a quarter of that from one curve to the next: 1.25, 3.75, ... and the point that follows.
        for number, (line, first) in enumerate(zip(marked, (2, 4, 7, 9))):
            np.testing.assert_array_equal(line.get_xdata(), first + 10 * np.arange(8))
            np.testing.assert_array_equal(line.get_ydata(), 100 * number + line.get_xdata())
        self.assertEqual([list(line.get_xydata()[0]) for line in lines_of(axes, marker="x")], [[80, 180]])
        table.draw(axes, 0, [], [])
        self.assertEqual(len(lines_of(axes)), 4)

    def test_the_two_markers_of_a_path_are_at_places_of_its_own_in_its_first_turn(self):
        table = looks.Curves(self.cells({}, {"k": "4"}))
        _, axes = plt.subplots()
        self.assertEqual([table.path(axes, n, [1, 2], [3, 4 + n], 0.7, 40) for n in (0, 1)], [[5, 25], [15, 35]])
        self.assertEqual([line.get_xydata().tolist() for line in axes.lines], [[[1, 3], [2, 4]], [[1, 3], [2, 5]]])
        self.assertEqual({(line.get_linewidth(), line.get_marker()) for line in axes.lines}, {(0.7, "")})

    def test_processing_time_adds_up_the_four_parts_without_the_check_and_writing(self):
        def steps(share):
            return {"steps.csv": csv_of(PARTS, [(t, share, 1e6, 2 * share, 1e6, 4 * share, 8 * share * t) for t in (1, 2, 3)])}

        # Steps take 7 + 8 t of a share: 15, 38, 69 in all.
        table = looks.Curves(self.cells({"k": "", "files": steps(1)}, {"k": "4", "files": steps(10)}, {"k": "8"}))
        _, axes = plt.subplots()
        table.time(axes, "a title")
        self.assertEqual([line.get_xydata().tolist() for line in lines_of(axes)],
                         [[[1, share * 15], [2, share * 38], [3, share * 69]] for share in (1, 10)])
        self.assertEqual((axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel(), axes.get_yscale()),
                         ("a title", "simulated time (s)", "processing time (s)", "linear"))
        for share, scale in ((19, "linear"), (21, "log")):  # from twenty times the least on
            _, axes = plt.subplots()
            looks.Curves(self.cells({"files": steps(1)}, {"k": "4", "files": steps(share)})).time(axes, "")
            self.assertEqual(axes.get_yscale(), scale)
        self.assertAlmostEqual(axes.get_ylim()[0], 0.69)

    def test_solves_are_drawn_by_solver_and_what_did_not_end_ok_on_the_rail(self):
        head = "method,solver,variant,status,time_median_s,residual,law_residual,busy".split(",")
        rows = [
            dict(zip(head, line.split(",")))
            for line in ("ap,lemke,,ok,1e-3,1e-9,0.5,True", "ap,lemke,,ok,2e-3,0,0.25,False", "ap,lemke,,ray,3e-3,1e-2,0.7,True",
                         "ap,lemke,,ok,4e-3,,,False", "newton,,uncapped,ok,5e-3,1e-8,0.125,False",
                         ",lemke,,ok,6e-3,1e-7,0.1,False", "x,y,,crash,,,,False")]
        for column, values in (("residual", (1e-9, 1e-17, 1e-7, 1e-8)), ("law_residual", (0.5, 0.25, 0.1, 0.125))):
            _, panel = plt.subplots()
            known = {}
            looks.solves(panel, rows, column, 1e-17, known)
            good, bad = panel.lines[::2], panel.lines[1::2]
            self.assertEqual([line.get_xydata().tolist() for line in good],
                             [[[1e-3, values[0]], [2e-3, values[1]], [6e-3, values[2]]], [[5e-3, values[3]]], []])
            self.assertEqual([line.get_xydata().tolist() for line in bad], [[[3e-3, 1.04]], [], []])
            self.assertEqual([line.get_markerfacecolor() for line in bad], 3 * ["none"])
            self.assertEqual([line.get_color() for line in good], [looks.BLUE, looks.VERMILION, looks.YELLOW])
            self.assertEqual([(name, handle.get_marker()) for name, handle in known.items()], [("A-P, Lemke", "o"),
                                                                                               ("Newton, uncapped", "v"),
                                                                                               ("x y", "*")])
            self.assertEqual(panel.get_title(loc="right"), "others used the machine during 2 of 7")
            self.assertEqual((panel.get_xscale(), panel.get_yscale(), panel.get_xlabel()),
                             ("log", "log", "time of a solve, median (s)"))


class Robots(Drawn):
    def cell(self, **files):
        return self.cells({"files": {f"{name}.csv": text for name, text in files.items()}})[0]

    def test_the_axle_is_between_the_wheels_and_heads_across_the_line_from_left_to_right(self):
        # Facing -z, the right wheel is on the side of +x; turned by 90 degrees about y it faces -x, by 180 degrees +z.
        places = ((0, (1, 0.1, 5), (3, 0.1, 5), 0), (0.1, (2, 0.1, 6), (2, 0.1, 4), np.pi / 2),
                  (0.2, (3, 0.1, 5), (1, 0.1, 5), np.pi), (0.3, (2, 0.1, 4), (2, 0.1, 6), -np.pi / 2))
        rows = [(t, name, place) for t, *both, _ in places for name, place in zip(("wheel_left", "wheel_right"), both)]
        t, x, z, heading = robots.axle(self.cell(trajectory=trajectory([*rows, (0.4, "wheel_left", (9, 9, 9))])))
        np.testing.assert_allclose(t, [0, 0.1, 0.2, 0.3])
        np.testing.assert_allclose([x, z], [4 * [2], 4 * [5]])
        np.testing.assert_allclose(np.exp(1j * heading), np.exp(1j * np.array([way for *_, way in places])), atol=1e-12)

    def test_the_wanted_path_is_an_eight_that_begins_in_its_middle(self):
        x, z = robots.figure_eight()
        np.testing.assert_allclose([x.min(), x.max(), z.min(), z.max()], [-4, 4, -4, 4], atol=1e-12)
        np.testing.assert_allclose([x[0] - x[-1], z[0] - z[-1]], 0, atol=1e-12)
        np.testing.assert_allclose(robots.wanted(robots.START), 0, atol=1e-12)
        # From there x falls and z falls twice as fast; s takes 10 s a radian.
        np.testing.assert_allclose(robots.wanted(robots.START + 1e-6), [-4e-6, -8e-6], rtol=1e-6)
        self.assertEqual(robots.RATE, 0.1)

    def test_the_distance_from_the_path_is_on_the_branch_that_is_driven(self):
        # At 2 s the wanted place is 0.2 rad past the start; points on the path near it are on it, beside it they are as far as
        # they were moved across it, and on the other branch, which crosses, they are not.
        def at(d):
            return np.array([-4 * np.sin(d), -4 * np.sin(2 * d)])  # of start + d

        across = np.array([-8 * np.cos(0.4), 4 * np.cos(0.2)])
        across /= np.linalg.norm(across)
        points = np.array([at(0.2), at(0.7), at(-0.5), at(0.2) + 0.3 * across, at(0.2) - 0.3 * across, at(0.2) * (1, -1)])
        found = robots.cross_track(np.full(6, 2.0), *points.T)
        np.testing.assert_allclose(found[:3], 0, atol=0.01)
        np.testing.assert_allclose(found[3:5], 0.3, atol=0.01)
        self.assertGreater(found[5], 1)

    def test_loads_are_those_of_each_wheel_in_each_span_of_the_run(self):
        rows = [(0.5, "tyre_left", 1, 9), (0.5, "tyre_right", 2, 9), (1.5, "tyre_left", 4, 9), (3, "tyre_right", 8, 9),
                (4, "tyre_left", 16, 9)]
        edges, left, right = robots.loads(self.cell(loads=csv_of("t,pair,normal,tangent", rows)), 4)
        np.testing.assert_allclose(edges, [0, 1, 2, 3, 4])
        np.testing.assert_allclose([left, right], [[1, 4, 0, 16], [2, 0, 0, 8]])

    def test_creep_is_the_way_of_the_box_in_the_frames_of_both_fingers(self):
        turn = np.array([np.cos(0.6), 0.36 * np.sin(0.6), 0.48 * np.sin(0.6), 0.8 * np.sin(0.6)])
        w, x, y, z = turn
        R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
        shift, box = np.array([5.0, 6, 7]), np.array([1.0, 2, 3])
        rows = []
        # At first; the box moved by 3; all turned and moved alike; and the right finger by 4 across that besides.
        for t, (q, of_box, of_right) in enumerate(((0, 0, 0), (0, 3, 0), (1, 0, 0), (0, 3, 4))):
            for name, place in (("box", box + [of_box, 0, 0]), ("finger_left", np.array([
                    1.0, 1, 1])), ("finger_right", np.array([2.0, 1 + of_right, 1]))):
                rows.append((t, name, R @ place + shift if q else place, turn if q else None))
        t, creep = robots.creep(self.cell(trajectory=trajectory(rows)))
        np.testing.assert_allclose(t, [0, 1, 2, 3])
        np.testing.assert_allclose(creep, [0, np.sqrt(3**2 + 3**2), 0, np.sqrt(3**2 + 3**2 + 4**2)], atol=1e-12)

    def test_the_view_is_from_the_front_the_right_and_above(self):
        right, up = robots.VIEW
        np.testing.assert_allclose(robots.VIEW @ robots.VIEW.T, np.eye(2), atol=1e-15)
        eye = np.cross(right, up)  # towards it
        np.testing.assert_allclose(eye, [
            np.sin(np.radians(35)) * np.cos(np.radians(20)),
            np.sin(np.radians(20)),
            np.cos(np.radians(35)) * np.cos(np.radians(20))], atol=1e-15)
        self.assertGreater(up[1], 0)

    def test_the_base_of_the_mobile_robot_is_behind_its_axle(self):
        # Towards -z, as it looks at the start: the base's middle 0.055 m behind the axle, wheels beside it.
        base, wheels, nose = (part / robots.SCALE for part in robots.outline(0, 0, 0))
        np.testing.assert_allclose(sorted(map(tuple, base)), [(-0.15, -0.145), (-0.15, 0.255), (0.15, -0.145), (0.15, 0.255)])
        np.testing.assert_allclose(np.mean(wheels, axis=1)[:, 1], 0, atol=1e-15)
        np.testing.assert_allclose(nose, [(0, 0.055), (0, 0.055 - 0.28)], atol=1e-15)

    def test_an_outline_is_the_corners_and_nothing_within(self):
        square = [(0, 0), (2, 0), (2, 1), (0, 1)]
        inner = [(1, 0.5), (1, 0), (2, 0.5)]  # also on its sides
        self.assertEqual({tuple(p) for p in robots.hull(square + inner)}, set(map(tuple, square)))
        self.assertEqual(len(robots.hull(square + inner)), 4)

    def test_a_turned_box_is_seen_where_its_corners_are(self):
        # A quarter about z takes x to y and y to -x; the box's middle is beside the origin of its body.
        pose = np.array([0.5, 10, 20, 30, np.sqrt(0.5), 0, 0, np.sqrt(0.5)])  # t before it
        half, centre = np.array([1.0, 2, 3]), np.array([0.5, 0.25, 0])
        signs = np.array(list(itertools.product((-1, 1), repeat=3)))
        world = [(10 - (0.25 + 2 * b), 20 + 0.5 + a, 30 + 3 * c) for a, b, c in signs]
        found, corners = robots.silhouette(pose, half, centre), np.array(world) @ robots.VIEW.T
        self.assertEqual(len(found), 6)  # of a box that shows three faces
        for point in found:
            self.assertLess(np.linalg.norm(corners - point, axis=1).min(), 1e-12)
        np.testing.assert_allclose([found.min(axis=0), found.max(axis=0)], [corners.min(axis=0), corners.max(axis=0)])

    def test_the_base_is_as_long_as_it_is_and_its_wheels_stand_beside_it(self):
        base, wheels, nose = robots.outline(0.0, 0.0, 0.0)  # facing -z, drawn twice as large
        np.testing.assert_allclose(np.ptp(base, axis=0), [2 * 0.3, 2 * 0.4])
        self.assertEqual(len({tuple(corner.round(9)) for corner in base}), 4)
        np.testing.assert_allclose(sorted(wheel[0][0] for wheel in wheels), [-0.3206, 0.3206])
        np.testing.assert_allclose([np.ptp(wheel[:, 1]) for wheel in wheels], 4 * 0.0825)
        np.testing.assert_allclose(nose[1] - nose[0], [0, -2 * 0.7 * 0.4], atol=1e-12)
        np.testing.assert_allclose(
            robots.outline(0.0, 0.0, -np.pi / 2)[2][1] - robots.outline(0.0, 0.0, -np.pi / 2)[2][0], [0.56, 0], atol=1e-12)


class Scene(unittest.TestCase):
    def parts(self, scene):
        """{name: (place, size or radius)} of what a scene has."""
        found = {}
        for one in ET.parse(SCENES / f"{scene}.xml").iter():
            if one.tag in ("link", "box", "cylinder"):
                found[one.get("name")] = tuple(
                    np.array(list(map(float,
                                      one.get(key).split()))) if one.get(key) else None for key in ("position", "size", "radius"))
        return found

    def test_pads_and_box_of_the_grasp_are_drawn_where_its_scene_has_them(self):
        parts = self.parts("grasp")
        for name, half, centre in robots.PADS:
            place, size, _ = parts[name.replace("finger", "pad")]
            np.testing.assert_allclose(2 * np.array(half), size)
            np.testing.assert_allclose(centre, place - parts[name][0], atol=1e-12)
        np.testing.assert_allclose(2 * np.array(robots.BOX[0]), parts["box"][1])
        self.assertEqual(robots.BOX[1], (0, 0, 0))
        self.assertLessEqual(set(robots.ARM) | set(robots.FINGERS), set(parts))

    def test_wheels_are_drawn_as_large_and_as_far_apart_as_the_scene_has_them(self):
        parts = self.parts("mobile_robot")
        left, right = (parts[name] for name in robots.TYRES)
        self.assertAlmostEqual(right[0][0] - left[0][0], robots.AXLE)
        self.assertAlmostEqual(float(left[2][0]), robots.RADIUS)
        self.assertAlmostEqual(parts["base"][0][2] - left[0][2], robots.AHEAD)  # it faces -z


if __name__ == "__main__":
    unittest.main()
