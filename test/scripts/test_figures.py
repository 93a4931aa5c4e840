"""What the figures of single scenes draw (figures.py): their lines, limits and words, on made-up runs whose numbers are known."""
import itertools
import unittest
from unittest import mock

import matplotlib.pyplot as plt
import numpy as np
from contactbench import figures, robots
from folder import Folder
from made import csv_of, lines_of, results, trajectory
from matplotlib.collections import QuadMesh
from matplotlib.patches import Polygon

RAY = {"status": "ray", "finished": "false", "t_reached": "0.25"}


def said(axes):
    return axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel(), axes.get_xscale(), axes.get_yscale()


class Drawn(Folder):
    """Draws figures of made-up runs."""
    def setUp(self):
        super().setUp()
        self.addCleanup(plt.close, "all")

    def table(self, *rows, **files):
        """Curves of runs that differ in k; `files`: of each run its text."""
        rows = [{"k": str(4 + n), **row} for n, row in enumerate(rows)]
        for name, texts in files.items():
            for row, text in zip(rows, texts):
                row.setdefault("files", {})[f"{name}.csv"] = text
        return figures.Curves(results(self.top, rows).cells())

    def drawn(self, name, table):
        """Axes of a figure, flat, and the handles of its legend."""
        this = figures.FIGURES[name]
        _, axes = this.canvas(table)
        axes = [axes] if isinstance(axes, plt.Axes) else axes
        handles = this.draw(table, axes[0] if len(axes) == 1 and not isinstance(axes, np.ndarray) else axes)
        return axes, handles

    def same(self, line, x, y, **more):
        np.testing.assert_allclose(line.get_xdata(), x, **more)
        np.testing.assert_allclose(line.get_ydata(), y, **more)


class Paper(Drawn):
    def test_the_energy_is_drawn_whole_and_about_the_impact_with_what_was_there_before_it(self):
        # Energies fall by 4 at 0.3 s, by 5 at 0.1 s, by 3 at 0.4 s: in the middle at 0.3 s; the most before is 7.
        t, some = (0, 0.1, 0.2, 0.3, 0.4), ((5, 5, 5, 1, 1), (7, 2, 2, 2, 2), (6, 6, 6, 6, 3))
        table = self.table({}, {}, {}, steps=[
            csv_of("t,residual,kinetic_energy", [(a, 9, b) for a, b in zip(t, e)]) for e in some])
        (whole, close), handles = self.drawn("figure01", table)
        self.assertIsNone(handles)
        for line, energy in zip(lines_of(whole), some, strict=True):
            self.same(line, t, energy)
        self.assertEqual(said(whole), ("whole run", "time (s)", "kinetic energy (J)", "linear", "linear"))
        self.assertEqual((whole.get_ylim()[0], close.get_ylim()), (0, whole.get_ylim()))
        for line, at, after in zip(lines_of(close), (0.3, 0.1, 0.4), (1, 2, 3)):
            self.same(line, [at], [after])
        self.assertEqual(len([line for line in close.lines if list(line.get_ydata()) == [7, 7]]), 1)
        self.assertEqual([(text.get_text(), text.xy) for text in close.texts], [("before the impact", (0.35, 7))])
        self.assertEqual(said(close)[:2], ("around the impact at t = 0.3 s", "time (s)"))
        np.testing.assert_allclose(close.get_xlim(), (0.25, 0.35))

    def test_the_pushed_box_is_drawn_beside_its_exact_way_and_by_how_far_it_is_off(self):
        # 1 N on 1 kg from 1 to 5 s, friction 0.98 N: 0.02 m/s^2, and 0.08 m/s after 4 s. It is 3 mm off along and 4 mm across.
        t, exact = np.array([0, 1, 3, 5]), np.array([0, 0, 0.04, 0.16])
        off = np.array([0, 0, 1, 1])
        table = self.table({}, RAY, trajectory=[
            trajectory([(a, "box", (2 + e + 3e-3 * o, 7 + a, -1 + 4e-3 * o)) for a, e, o in zip(t, exact, off)]),
            trajectory([(a, "box", (2 + e, 0, -1)) for a, e in zip(t, exact)])],
                           steps=2 * [csv_of("t,dynamics_s,collision_s,assembly_s,solve_s", [(1, 1, 2, 3, 4), (2, 1, 2, 3, 5)])])
        (top, middle, bottom), handles = self.drawn("figure03", table)
        truth, *ways = lines_of(top)
        self.assertEqual([handle.get_label() for handle in handles],
                         ["exact", "A-P, Lemke, k = 4", r"A-P, Lemke, k = 5 ($\bf{\times}$ ray at 0.25 s)"])
        self.assertIs(handles[0], truth)
        for moment, way in ((0, 0), (2, 0.01), (5, 0.16), (8, 0.16 + 0.08**2 / 1.96)):
            self.assertAlmostEqual(np.interp(moment, *truth.get_xydata().T), way, 12)
        self.assertEqual(max(truth.get_xdata()), 8)
        self.same(ways[0], t, exact + 3e-3 * off, atol=1e-12)
        self.same(ways[1], t, exact, atol=1e-12)
        errors = lines_of(middle)
        self.same(errors[0], t, [1e-16, 1e-16, 5e-3, 5e-3], rtol=1e-9)
        self.assertGreaterEqual(min(errors[1].get_ydata()), 1e-16)
        self.assertLess(max(errors[1].get_ydata()), 1e-14)
        self.same(lines_of(bottom)[0], [1, 2], [10, 21])
        self.assertEqual(said(top), ("displacement along the push", "time (s)", "displacement (m)", "linear", "linear"))
        self.assertEqual(
            said(middle),
            ("distance from the exact position (below 1e-16 m drawn at 1e-16)", "time (s)", "error (m)", "linear", "log"))
        self.assertEqual(said(bottom)[0], "processing time")

    def test_a_box_that_slides_far_too_far_is_drawn_over_powers_of_ten(self):
        exact = 0.16 + 0.08**2 / 1.96
        for times, scale in ((19, "linear"), (21, "symlog")):
            for sign in (1, -1):
                rows = [(t, "box", (sign * times * exact * t, 0, 0)) for t in (0, 1)]
                (top, *_), _ = self.drawn("figure03", self.table({}, trajectory=[trajectory(rows)]))
                self.assertEqual(top.get_yscale(), scale)

    def test_the_creep_of_the_box_that_sticks_is_its_whole_way_from_the_start(self):
        rows = [(t, "box", (1 + 2e-6 * t, 2 + 3e-6 * t, 3 + 6e-6 * t)) for t in (0, 1, 2)]
        (top, bottom), handles = self.drawn("figure04", self.table({}, trajectory=[trajectory(rows)]))
        self.assertIsNone(handles)
        self.same(lines_of(top)[0], [1, 2], [7e-6, 14e-6], rtol=1e-9)
        self.assertEqual(len(top.texts), 0)
        self.assertEqual(said(top),
                         ("creep: distance from the start, 0 m is exact", "time (s)", "displacement (m)", "linear", "log"))
        self.assertEqual(said(bottom)[0], "processing time")
        still = [(t, "box", (1, 2, 3)) for t in (0, 1, 2)]
        (top, _), _ = self.drawn("figure04", self.table({}, {}, trajectory=[trajectory(still), trajectory(rows)]))
        self.same(lines_of(top)[0], [1, 2], [1e-18, 1e-18])
        self.assertEqual([text.xy[1] for text in top.texts], [1e-18])
        self.assertAlmostEqual(top.get_ylim()[0] / 1e-20, 1)

    def circle(self, t, dx=0.0, dz=0.0):
        """The box on its circle (scenarios/circular_sliding.xml), from the second moment on shifted."""
        lag = np.arccos(0.02 * 9.8 / 0.4)
        radius = 0.4 * np.sin(lag)
        return trajectory([
            (a, "box", (radius * np.sin(a - lag) + dx * (a > 0), 0.5, -radius * np.cos(a - lag) + dz * (a > 0)))
            for a in t])

    def test_the_box_that_slides_in_a_circle_is_seen_from_above_and_its_distance_is_from_the_law(self):
        t = np.arange(0, 2001) * 0.005
        table = self.table({}, {}, trajectory=[self.circle(t, 3e-3, 4e-3), self.circle(t, 3e-4, -4e-4)])
        (path, distance), handles = self.drawn("figure05", table)
        truth, *ways = lines_of(path)
        self.assertEqual([handle.get_label() for handle in handles], ["exact", "A-P, Lemke, k = 4", "A-P, Lemke, k = 5"])
        # The exact way is Newton's second law: the turning drive of 0.4, less mu g = 0.196 against the velocity.
        s, p = np.linspace(0, 2 * np.pi, 400), truth.get_xydata()
        v, a = (np.gradient(of, s, axis=0)[3:-3] for of in (p, np.gradient(p, s, axis=0)))
        drive = 0.4 * np.column_stack([np.cos(s), np.sin(s)])[3:-3]
        np.testing.assert_allclose(a, drive - 0.196 * v / np.linalg.norm(v, axis=1)[:, None], atol=1e-4)
        np.testing.assert_allclose(p[[0, -1]], 0, atol=1e-12)
        for n, shift in enumerate(((3e-3, 4e-3), (3e-4, -4e-4))):
            self.assertEqual(len(ways[2 * n].get_xdata()), 501)  # a point every 20 ms
            way, marks = ways[2 * n].get_xydata(), ways[2 * n + 1].get_xydata()
            np.testing.assert_allclose(
                way[1:],
                np.column_stack([np.interp(t[4::4], s, p[:, k], period=2 * np.pi) for k in (0, 1)]) + shift, atol=1e-4)
            self.same(
                lines_of(distance)[n],
                lines_of(distance)[n].get_xdata(), np.where(lines_of(distance)[n].get_xdata() > 0, np.hypot(*shift), 1e-16),
                rtol=1e-9)
            # Marks at an eighth and five of the first turn, and those of the other a quarter further.
            np.testing.assert_allclose(
                marks,
                np.column_stack([np.interp(2 * np.pi * np.array([1, 5]) / 8 + n * np.pi / 2, s, p[:, k])
                                 for k in (0, 1)]) + shift, atol=3e-3)
        self.assertEqual(said(path)[:3], ("path from above", "x (m)", "z (m)"))
        self.assertEqual(said(distance), ("distance from the exact position", "time (s)", "distance (m)", "linear", "log"))
        self.assertTrue(path.yaxis_inverted())
        self.assertEqual(path.get_aspect(), 1)
        self.assertAlmostEqual(distance.get_ylim()[0], 5e-4 / 3)

    def test_a_path_that_leaves_the_picture_is_cut_off(self):
        # 0.349 m of radius about (0.304, 0.171): three times that to each side are drawn; what is twice as far out is cut.
        radius, lag = 0.4 * np.sqrt(1 - 0.49**2), np.arccos(0.49)
        for far, cut in ((5.5, ""), (6.5, " (cut off)")):
            rows = [(t, "box", (far * radius * t, 0, 0)) for t in (0, 1)]
            (path, _), _ = self.drawn("figure05", self.table({}, trajectory=[trajectory(rows)]))
            self.assertEqual(said(path)[0], "path from above" + cut)
        np.testing.assert_allclose(path.get_xlim(), radius * np.sin(lag) + 3 * radius * np.array([-1, 1]))
        np.testing.assert_allclose(path.get_ylim(), radius * np.cos(lag) + 3 * radius * np.array([1, -1]))

    def test_stacks_are_a_curve_a_method_over_their_boxes_and_what_did_not_finish_has_no_time(self):
        crash = {"status": "crash", "finished": "false"}
        rows = [{"k": "4", "parameters": f"boxes={n}", "processing_s": str(s), **ended}
                for n, s, ended in ((4, 1, {}), (16, 8, {}), (32, 9, RAY), (64, 9, crash), (128, 9, crash))]
        rows += [{
            "method": "convex", "solver": "ipm", "epsilon": "1e-2", "k": "", "parameters": f"boxes={n}", "processing_s": str(s),
            **ended} for n, s, ended in ((4, 2, {}), (16, 3, {}), (64, 9, RAY))]
        (axes, ), handles = self.drawn("figure07", self.table(*rows))
        polygon, convex = lines_of(axes)[:2]
        self.same(polygon, [4, 16], [1, 8])
        self.same(convex, [4, 16], [2, 3])
        rail = [(line.get_xdata()[0], round(line.get_ydata()[0], 6), line.get_marker()) for line in axes.lines
                if len(line.get_xdata()) == 1]
        self.assertEqual(rail, [(32, 1.05, "o"), (64, 1.05, "o"), (128, 1.05, "o"), (64, 1.085, "d")])
        self.assertEqual([handle.get_label() for handle in handles],
                         ["A-P, Lemke, k = 4 (32: ray; 64, 128: crash)", r"convex, $\epsilon$ = $10^{-2}$ J (64: ray)"])
        self.assertEqual(said(axes), ("stack of boxes, 1 s simulated", "boxes", "processing time (s)", "log", "log"))
        self.assertEqual([text.get_text() for text in axes.get_xticklabels()], ["4", "16", "32", "64", "128"])
        self.assertEqual([text.get_text() for text in axes.texts], ["did not\nfinish"])
        (axes, ), handles = self.drawn("figure07", self.table(*rows[:2]))
        self.assertEqual((len(axes.texts), handles[0].get_label()), (0, "A-P, Lemke, k = 4"))

    def test_the_table_of_figures_has_each_scene_and_those_without_times_leave_out_what_a_limit_cut(self):
        scenes = ("impacting_sphere", "sliding_box", "sticking_box", "circular_sliding", "stack", "mobile_robot", "grasp")
        cut = {"status": "time_limit", "finished": "false", "t_reached": "0.5"}
        shown = {
            "figure01": (0, False), "figure02": (0, True), "figure03": (1, True), "figure04": (2, True), "figure05": (3, False),
            "figure06": (3, True), "figure07": (4, True), "figure08": (5, False), "figure09": (5, True), "figure10": (6, False),
            "figure11": (6, True), "grasp_picture": (6, False), "robot_picture": (5, False)}
        made = results(self.top, [{"scene": scene, "k": k, **(cut if k == "8" else {})} for scene in scenes for k in ("4", "8")])
        self.assertEqual(set(shown), {name for name, this in figures.FIGURES.items() if this.scene})
        for name, (scene, with_times) in shown.items():
            with self.subTest(name):
                this = figures.FIGURES[name]
                table = this.table(made, this.scene)
                self.assertEqual([(c["scene"], c["k"]) for c in table.cells],
                                 [(scenes[scene], k) for k in ("4", "8")[:1 + with_times]])
                self.assertEqual(table.note, "" if with_times else "cut by a limit, not drawn: A-P Lemke, k = 8")
        for name, title in (("figure02", "impacting sphere"), ("figure06", "box sliding in a circle"),
                            ("figure09", "mobile robot"), ("figure11", "manipulator grasp")):
            (axes, ), _ = self.drawn(
                name, self.table({}, steps=[csv_of("t,dynamics_s,collision_s,assembly_s,solve_s", [(1, 1, 2, 3, 4)])]))
            self.assertEqual(said(axes)[0], title)
            self.same(lines_of(axes)[0], [1], [10])

    def test_a_picture_shows_the_first_setting_of_each_method_and_solver(self):
        rows = [{"k": "4"}, {"k": "8"}, {"solver": "path", "k": "4"}, {"method": "convex", "solver": "ipm", "epsilon": "1e-12"}, {
            "method": "convex", "solver": "ipm", "epsilon": "1e-2"}]
        table = figures.one_each(results(self.top, rows), "box")
        self.assertEqual([cell["run"] for cell in table.cells], ["r0__r1", "r2__r1", "r3__r1"])


class Canvas(Drawn):
    def draw(self, name, made):
        with mock.patch.object(figures, "save") as saved:
            figures.draw(name, made)
        return saved.call_args.args

    def test_a_figure_has_its_legend_and_note_and_goes_beside_its_results(self):
        made = results(self.top, [{"scene": "impacting_sphere", "k": ""}, {
            "scene": "impacting_sphere", "k": "8", "status": "time_limit", "finished": "false", "t_reached": "1"}])
        figure, folder, name = self.draw("figure01", made)
        self.assertEqual((folder, name), (self.top / "figures", "figure01"))
        self.assertEqual([text.get_text() for text in figure.legends[0].get_texts()],
                         ["A-P, Lemke", "cut by a limit, not drawn: A-P Lemke, k = 8"])
        figure, *_ = self.draw("figure02", made)
        self.assertEqual([text.get_text() for text in figure.legends[0].get_texts()],
                         ["A-P, Lemke", r"A-P, Lemke, k = 8 ($\bf{\times}$ time_limit at 1 s)"])
        figure, *_ = self.draw("figure10", results(self.top, [{"scene": "grasp", "k": ""}]))
        self.assertEqual([text.get_text() for text in figure.legends[0].get_texts()], ["half the box's size", "A-P, Lemke"])

    def test_where_nothing_is_to_be_shown_the_picture_says_what_is_missing(self):
        made = results(self.top, [{"scene": "other"}])
        for name, what in (("figure01", "impacting_sphere"), ("error_time", "the sweep error_time"),
                           ("streams", "scripts/replay.py"), ("stored_problems", "scripts/solve_all.py"),
                           ("performance", "the sweep error_time"), ("repose", "the sweep motion")):
            figure, *_ = self.draw(name, made)
            self.assertEqual([text.get_text() for text in figure.axes[0].texts], [f"no run of {what} in runs.csv"])

    def test_a_figure_is_drawn_by_its_name_from_where_it_is_told(self):
        results(self.top, [{"scene": "other"}])
        words = ["--results", str(self.top), "--runs", str(self.top / "runs")]
        with mock.patch("sys.argv", ["plots/figure04.py", *words]), mock.patch.object(figures, "draw") as draw:
            figures.main()
        self.assertEqual((draw.call_args.args[0], draw.call_args.args[1].folder, draw.call_args.args[1].runs),
                         ("figure04", self.top, self.top / "runs"))
        with mock.patch("sys.argv", ["figure.py", *words]), mock.patch("sys.stderr"), self.assertRaises(SystemExit) as ended:
            figures.main()
        self.assertEqual(ended.exception.code, 2)


class Robot(Drawn):
    def wheels(self, places):
        """trajectory.csv of (t, middle, heading)."""
        rows = []
        for t, (x, z), turn in places:
            aside = 0.1603 * np.array([np.cos(turn), 0, -np.sin(turn)])
            rows += [(t, "wheel_left", np.array([x, 0.08, z]) - aside),
                     (t, "wheel_right", np.array([x, 0.08, z]) + aside)]
        return trajectory(rows)

    def test_the_path_of_the_robot_its_distance_and_who_bears_it(self):
        t = np.arange(0, 10.5, 0.5)
        wanted = np.column_stack(robots.wanted(robots.RATE * t + robots.START))
        places = [wanted, wanted + [0.25, 0]]
        heads = "t,pair,normal"
        loads = [
            csv_of(heads, [(a, name, n) for a in (2, 9) for name, n in (("tyre_left", 1), ("tyre_right", 3))]),
            csv_of(heads, [(6, "tyre_left", 5), (8, "tyre_right", 2)])]
        table = self.table({}, RAY, trajectory=[self.wheels([(a, p, 0) for a, p in zip(t, some)]) for some in places],
                           loads=loads)
        (path, distance, share), handles = self.drawn("figure08", table)
        self.assertEqual([handle.get_label() for handle in handles],
                         ["wanted", "A-P, Lemke, k = 4", r"A-P, Lemke, k = 5 ($\bf{\times}$ ray at 0.25 s)"])
        truth, *ways = lines_of(path)
        self.same(truth, *robots.figure_eight())
        for n, some in enumerate(places):
            self.same(ways[2 * n], *some.T, atol=1e-12)
            at = [int(20 * (n + 0.5 + half) / 4) for half in (0, 2)]
            self.same(ways[2 * n + 1], *some[at].T, atol=1e-12)
            every = slice(None, None, 2)
            self.same(lines_of(distance)[n], t[every], np.maximum(robots.cross_track(t[every], *some[every].T), 1e-3), atol=1e-9)
        self.assertEqual({round(y, 12) for y in lines_of(distance)[0].get_ydata()}, {1e-3})
        self.assertEqual((said(path)[:3], path.yaxis_inverted()), (("path from above", "x (m)", "z (m)"), True))
        self.assertEqual(said(distance), ("distance from the wanted path", "time (s)", "distance (m)", "linear", "log"))
        self.assertAlmostEqual(distance.get_ylim()[0], 1e-3)
        for n, (mesh, end, wanted) in enumerate(
                zip([c for c in share.collections if isinstance(c, QuadMesh)], (9, 8), ([0.25, 0.25], [1, 0]))):
            part = np.ma.masked_array(mesh.get_array()).ravel()
            np.testing.assert_allclose(part.compressed(), wanted)
            corners = mesh.get_coordinates()
            self.assertEqual((corners[..., 0].min(), corners[..., 0].max()), (0, end))
            np.testing.assert_allclose(sorted(set(corners[..., 1].ravel())), [n - 0.42, n + 0.42])
            self.assertEqual((mesh.get_clim(), mesh.get_cmap().name), ((0, 1), "RdBu"))  # 1, all on the left, is blue
            first = np.flatnonzero(~np.ma.getmaskarray(part))[0]  # of 350 spans
            self.assertEqual(first, int((2, 6)[n] / end * 350))
        self.assertEqual(said(share)[:2], ("share of the load: left wheel (blue), right wheel (red)", "time (s)"))
        self.assertEqual((share.get_xlim(), share.get_ylim()), ((0, 9), (1.5, -0.5)))
        self.assertEqual([text.get_text() for text in share.get_yticklabels()], ["A-P, Lemke, k = 4", "A-P, Lemke, k = 5"])

    def test_a_robot_that_leaves_the_picture_is_cut_off_at_twice_the_eight(self):
        for end, cut in (((0, -7.9), ""), ((0, 8.1), " (cut off)"), ((-8.1, 0), " (cut off)")):
            table = self.table({}, trajectory=[self.wheels([(0, (0, 0), 0), (1, end, 0)])], loads=[""])
            with mock.patch.object(robots, "loads", return_value=(np.linspace(0, 1, 3), np.zeros(2), np.zeros(2))):
                (path, *_), _ = self.drawn("figure08", table)
            self.assertEqual(said(path)[0], "path from above" + cut)
        self.assertEqual((path.get_xlim(), path.get_ylim()), ((-8, 8), (8, -8)))

    def test_the_creep_of_the_box_in_the_hand_stands_beside_half_its_size(self):
        def moved(ways):
            return trajectory([(t, name, (way if name == "box" else 0, 0, 0)) for t, way in enumerate(ways)
                               for name in ("box", "finger_left", "finger_right")])

        (axes, ), handles = self.drawn("figure10", self.table({}, {}, trajectory=[moved((0, 1e-3, 1e-2)), moved((0, 2e-9, 50))]))
        size, *creeps = lines_of(axes)
        self.assertEqual(list(size.get_ydata()), [0.015, 0.015])
        self.assertEqual([handle.get_label() for handle in handles],
                         ["half the box's size", "A-P, Lemke, k = 4", "A-P, Lemke, k = 5"])
        self.same(creeps[0], [0, 1, 2], [1e-7, np.sqrt(2) * 1e-3, np.sqrt(2) * 1e-2])
        self.same(creeps[1], [0, 1, 2], [1e-7, 1e-7, np.sqrt(2) * 50])
        self.assertEqual(said(axes),
                         ("creep of the grasped box", "time (s)", "displacement in the fingers' frames (m)", "linear", "log"))
        np.testing.assert_allclose(axes.get_ylim(), (1e-7, 1))

    def test_the_robot_is_drawn_where_it_is_every_five_seconds(self):
        moves = [(t, (0.1 * t, -0.2 * t), 0.05 * t) for t in range(13)]
        table = self.table({}, RAY, {}, {}, trajectory=[self.wheels(moves), self.wheels(moves[:7])])
        axes, handles = self.drawn("robot_picture", table)
        self.assertEqual((axes.shape, handles), ((2, 3), []))
        self.assertEqual([panel.axison for panel in axes.flat], [True, True, True, True, False, False])
        for panel, some, moments in zip(axes.flat, (moves, moves[:7]), ((0, 5, 10), (0, 5))):
            self.same(panel.lines[0], *robots.figure_eight())
            self.same(panel.lines[1], *np.array([p for _, p, _ in some]).T, atol=1e-12)
            bases = [patch for patch in panel.patches if isinstance(patch, Polygon)]
            for patch, (_, place, heading) in zip(bases, [moves[moment] for moment in moments], strict=True):
                np.testing.assert_allclose(patch.get_xy()[:4], robots.outline(*place, heading)[0], atol=1e-12)
            self.assertEqual(len(panel.lines), 2 + 3 * len(moments))  # two wheels and a nose
            self.same(panel.lines[4], *robots.outline(0, 0, 0)[1][1].T, atol=1e-12)
            self.same(panel.lines[2], *robots.outline(0, 0, 0)[2].T, atol=1e-12)
        self.assertEqual([panel.get_title() or panel.get_title(loc="left") for panel in axes.flat[:2]],
                         ["A-P, Lemke, k = 4", "A-P, Lemke, k = 5\nray at 0.25 s"])
        self.assertEqual({(panel.get_xlim(), panel.get_ylim()) for panel in axes.flat[:2]}, {((-6, 6), (6, -6))})
        self.assertEqual((axes[0, 0].get_ylabel(), axes[1, 0].get_xlabel(), axes[0, 0].get_xlabel()), ("z (m)", "x (m)", ""))

    def test_the_grasp_is_drawn_at_moments_of_the_time_that_it_reached(self):
        names = (*robots.ARM, *robots.FINGERS, "box")
        starts = {name: np.array([0.1 * n, 0.02 * n * n, -0.03 * n]) for n, name in enumerate(names)}
        half = {"finger_left": (0.005, 0.015, 0.011), "finger_right": (0.005, 0.015, 0.011), "box": (0.015, 0.015, 0.015)}
        centre = {"finger_left": (0.005, -0.04, 0), "finger_right": (-0.005, -0.04, 0), "box": (0, 0, 0)}

        def place(name, t):
            return starts[name] + 0.01 * t * np.array([1, 2, 3]) * (2 if name == "box" else 1)

        files = [
            trajectory([(0.1 * n, name, place(name, 0.1 * n)) for n in range(count) for name in names])
            for count in (101, 51)]
        axes, handles = self.drawn("grasp_picture", self.table({}, RAY, {}, trajectory=files))
        self.assertEqual((axes.shape, handles), ((3, 5), []))
        for row, moments in enumerate(((0, 0.6, 1.4, 6, 10), (0, 0.3, 0.7, 3, 5))):
            for panel, t in zip(axes[row], moments):
                self.assertEqual(panel.texts[0].get_text(), f"{t:g} s")
                arm = panel.lines[0].get_xydata()
                np.testing.assert_allclose(arm, [robots.VIEW @ place(name, t) for name in robots.ARM], atol=1e-9)
                for finger, line in zip(robots.FINGERS, panel.lines[1:3]):
                    np.testing.assert_allclose(line.get_xydata(), [arm[-1], robots.VIEW @ place(finger, t)], atol=1e-9)
                self.assertEqual([patch.get_zorder() for patch in panel.patches], [3, 5, 4])  # the box between the pads
                for patch, name in zip(panel.patches, (*robots.FINGERS, "box"), strict=True):
                    corners = [
                        robots.VIEW @ (place(name, t) + np.array(centre[name]) + np.array(signs) * half[name])
                        for signs in itertools.product((-1, 1), repeat=3)]
                    np.testing.assert_allclose(
                        [patch.get_xy().min(axis=0), patch.get_xy().max(axis=0)],
                        [np.min(corners, axis=0), np.max(corners, axis=0)], atol=1e-9)
                trace = panel.lines[3].get_xydata()  # of the box, every eighth record up to now
                np.testing.assert_allclose(trace, [robots.VIEW @ place("box", 0.8 * n) for n in range(len(trace))], atol=1e-9)
                self.assertEqual(len(trace), round(10 * t) // 8 + 1)
        self.assertEqual([axes[row, 0].get_title(loc="left") for row in (0, 1)],
                         ["A-P, Lemke, k = 4", r"A-P, Lemke, k = 5 ($\bf{\times}$ ray at 0.25 s)"])
        self.assertEqual(len(axes[2, 0].patches), 0)  # kept no motion
        self.assertEqual(len({(panel.get_xlim(), panel.get_ylim()) for panel in axes.flat}), 1)
        arms = np.array([robots.VIEW @ place(name, t) for name in robots.ARM for t in (0, 10)])
        np.testing.assert_allclose(axes[0, 0].get_xlim(), (arms[:, 0].min() - 0.1, arms[:, 0].max() + 0.02), atol=1e-9)
        np.testing.assert_allclose(axes[0, 0].get_ylim(), (arms[:, 1].min() - 0.07, arms[:, 1].max() + 0.06), atol=1e-9)


if __name__ == "__main__":
    unittest.main()
