"""What the figures over all scenes draw (figures.py, heatmap.py): error against time, its budget, profiles, solves and the map of
stiff cases, on made-up runs whose numbers are known."""
import csv
import math
import unittest
from unittest import mock

import matplotlib.pyplot as plt
import numpy as np
from contactbench import figures, heatmap, measures, precision
from folder import Folder
from made import lines_of, results
from test_figures import RAY, Drawn, said

SWEEP = {"sweeps": "error_time", "scene": "one_scene", "parameters": "mu=1", "reference": "analytic", "duration": "2"}


def offset(some):
    """Segments of a collection of lines."""
    return [segment.tolist() for segment in some.get_segments()]


class ErrorTime(Drawn):
    def made(self):
        coarse = SWEEP | {"k": "8", "knobs": "step=0.01", "error_position_linf_m": "1e-3"}
        fine = SWEEP | {
            "k": "8", "knobs": "step=0.005", "step": "0.005", "error_position_linf_m": "1e-4", "processing_s": "4", "busy": "true"
        }
        rows = [coarse | {"run": f"coarse__r{n}", "repeat": str(n), "processing_s": str(s)} for n, s in ((1, 6), (2, 1), (3, 2))]
        rows += [
            fine, SWEEP | {"k": "4", "knobs": "step=0.01", "error_position_linf_m": "2e-2", "processing_s": "0.5"}, SWEEP | {
                "method": "convex", "solver": "ipm", "epsilon": "1e-12", "knobs": "accuracy=1e-5", "step": "",
                "error_position_linf_m": "0", "processing_s": "10"},
            SWEEP | {"method": "coulomb", "solver": "newton", "knobs": "step=0.01", **RAY},
            SWEEP | {"scene": "other", "parameters": "", "error_position_linf_m": "3e-5", "processing_s": "7"}]
        members = [
            coarse | {"member": "1", "error_position_linf_m": "5e-4"}, coarse | {"member": "2", "error_position_linf_m": "4e-3"},
            fine | {"member": "1", "error_position_linf_m": "9", **RAY}]
        return results(self.top, rows, members)

    def test_errors_are_drawn_over_time_with_their_spread_and_the_front(self):
        axes, handles = self.drawn("error_time", self.made())
        (panel, other), = axes
        self.assertEqual([(handle.get_label(), handle.get_marker()) for handle in handles], [("A-P, Lemke", "o"), ("convex", "d"),
                                                                                             ("Coulomb, Newton", "X")])
        groups = [line for line in panel.lines if line.get_linestyle() in ("-", "--")][:3]
        # Seconds a simulated second of two; of an ensemble the largest error of what ended ok; the coarser step first.
        self.same(groups[0], [1, 2], [4e-3, 1e-4])
        self.same(groups[1], [0.25], [2e-2])
        self.same(groups[2], [5], [1e-18])
        self.assertEqual([(line.get_linestyle(), line.get_markersize(), line.get_markerfacecolor() == "none") for line in groups],
                         [("-", 7, False), ("-", 3.5, False), ("--", 3.5, True)])  # k = 8 and 4; to an accuracy
        across, along = panel.collections[::2], panel.collections[1::2]
        self.assertEqual(
            [offset(c) for c in across],
            [[[[0.5, 4e-3], [3, 4e-3]], [[2, 1e-4], [2, 1e-4]]], [[[0.25, 2e-2], [0.25, 2e-2]]], [[[5, 1e-18], [5, 1e-18]]]])
        self.assertEqual([offset(c) for c in along][0], [[[1, 5e-4], [1, 4e-3]], [[2, 1e-4], [2, 9]]])
        rings = next(line for line in panel.lines if line.get_markersize() == 11)
        self.same(rings, [0.25, 1, 5], [2e-2, 4e-3, 1e-18])  # a member of the finer one did not end ok
        rail = [line for line in panel.lines if list(line.get_xdata()) == [1.03]]
        self.assertEqual([(list(line.get_ydata()), line.get_marker(), line.get_color()) for line in rail],
                         [([0.5], "X", "#332288")])
        self.assertEqual([text.get_text() for text in panel.texts], ["1 did not finish", "exactly 0, or below $10^{-18}$ m"])
        self.assertEqual(panel.get_title(loc="right"), "others used the machine during 1 of 5")
        self.assertEqual(said(panel),
                         ("one scene mu=1", "processing time for a simulated second (s)", "largest error (m)", "log", "log"))
        self.same(next(line for line in other.lines if len(line.get_xdata()) == 1), [3.5], [3e-5])
        self.assertEqual((said(other)[0], other.get_title(loc="right"), len(other.texts)), ("other", "", 0))

    def test_a_canvas_has_two_panels_in_a_line_and_what_is_left_over_is_empty(self):
        made = self.made()
        made.table = made.table[made.table["scene"] == "other"]
        axes, _ = self.drawn("error_time", made.seen(made.table))
        self.assertEqual([panel.axison for panel in axes.flat], [True, False])
        for count, lines in ((1, 1), (2, 1), (3, 2), (5, 3)):
            self.assertEqual(figures.two_beside(lambda table, count=count: count)(None)[1].shape, (lines, 2))

    def test_the_budget_has_a_panel_a_part_of_the_error(self):
        cells = results(
            self.top,
            [SWEEP | {"processing_s": "6"}, SWEEP | {"method": "convex", "solver": "ipm", "busy": "true"}]).cells(sweep=None)
        rows = [{"cell": cells[0], "solver": 1e-3, "model": 1e-5, "step_error": 1e-7}, {
            "cell": cells[1], "solver": 0.0, "model": math.nan, "step_error": 1e-2}]
        with mock.patch.object(precision, "scenes", return_value=[("one_scene", "mu=1"), ("other", "")]), \
                mock.patch.object(precision, "budget", side_effect=lambda _, scene, more: rows if more else rows[:1]):
            axes, handles = self.drawn("error_budget", results(self.top / "more", [SWEEP]))
        self.assertEqual([handle.get_label() for handle in handles], ["A-P, Lemke", "convex"])
        for panel, title, points in zip(axes[0], ("solver", "model", "step"),
                                        (((3, 1e-3), (0.5, 1e-17)), ((3, 1e-5), ), ((3, 1e-7), (0.5, 1e-2)))):
            self.assertEqual([tuple(line.get_xydata()[0]) for line in panel.lines], list(points))
            self.assertEqual((said(panel)[0], *said(panel)[3:]), (f"one scene mu=1: of the {title}", "log", "log"))
        self.assertEqual([said(panel)[0] for panel in axes[1]],
                         [f"other: of the {title}" for title in ("solver", "model", "step")])
        self.assertEqual([axes[n][0].get_ylabel() for n in (0, 1)],
                         ["error (m)\n(others used the\nmachine: 1 of 2)", "error (m)"])
        self.assertEqual({panel.get_xlabel() for panel in axes[1]}, {"processing time for a simulated second (s)"})

    def test_profiles_are_the_share_of_problems_within_a_ratio(self):
        cells = results(self.top, [SWEEP, SWEEP | {"method": "convex", "solver": "ipm"}]).cells(sweep=None)
        profiles = [{"A-P": [1, 1, 3, math.inf], "convex": [1, 2, 4, 8]}, {
            "A-P": [math.inf] * 4, "convex": [1, 2, math.inf, math.inf]}]
        with mock.patch.object(precision, "contenders", return_value={"A-P": {1: cells[0]}, "convex": {1: cells[1]}}), \
                mock.patch.object(precision, "profiles", return_value=profiles):
            axes, handles = self.drawn("performance", [1])
        self.assertEqual([(handle.get_label(), handle.get_color()) for handle in handles], [("A-P", "#0072B2"),
                                                                                            ("convex", "#000000")])
        for panel, title, end, curves in ((axes[0], "ended ok", 12, (([1, 1, 1, 3, 12], [0, 0.25, 0.5, 0.75, 0.75]), ([
                1, 1, 2, 4, 8, 12], [0, 0.25, 0.5, 0.75,
                                     1, 1]))), (axes[1], "ended ok, with the least error or up to twice that", 3, (([1, 3], [
                                         0, 0]), ([1, 1, 2, 3], [0, 0.25, 0.5, 0.5])))):
            for line, (x, y) in zip(lines_of(panel), curves, strict=True):
                self.same(line, x, y)
                self.assertEqual(line.get_drawstyle(), "steps-post")
            self.assertEqual((said(panel)[:2], panel.get_xscale()), ((title, "time over that of the fastest"), "log"))
            np.testing.assert_allclose(panel.get_xlim(), (0.95, end))
        self.assertEqual(axes[0].get_ylabel(), "share of problems")


class Solves(Drawn):
    def rows(self, *some):
        head = ("kind", "method", "solver", "variant", "status", "time_median_s", "residual", "law_residual", "busy")
        return [dict(zip(head, row)) for row in some]

    def test_stored_problems_are_drawn_by_their_kind_with_the_checked_residual(self):
        rows = self.rows(("contact", "ap", "lemke", "", "ok", "1e-3", "1e-9", "0.5", "False"),
                         ("lcp", "", "path", "", "ok", "2e-3", "0", "", "False"))
        axes, handles = self.drawn("stored_problems", rows)
        self.assertEqual([handle.get_label() for handle in handles], ["A-P, Lemke", "A-P, PATH"])
        for panel, title, x, y in zip(axes, ("contact problems", "linear complementarity problems"), (1e-3, 2e-3), (1e-9, 1e-17)):
            self.same(panel.lines[0], [x], [y])
            self.assertEqual(said(panel)[::2], (title + "; above: not ok", "checked residual", "log"))

    def test_streams_are_drawn_by_their_scene_with_the_residual_against_coulomb(self):
        rows = self.rows(("contact", "ap", "lemke", "", "ok", "1e-3", "1e-9", "0.5", "False"))
        axes, _ = self.drawn("streams", {"first scene": rows, "second": self.rows(), "third": rows})
        self.assertEqual((axes.shape, [panel.axison for panel in axes.flat]), ((2, 2), [True, True, True, False]))
        self.assertEqual([said(panel)[0] for panel in axes.flat], ["first scene", "second", "third", ""])
        self.same(axes[0, 0].lines[0], [1e-3], [0.5])
        self.assertEqual(axes[0, 0].get_ylabel(), "residual against Coulomb")


class HeatMap(Folder):
    COLUMNS = ("id", "scene", "row", "method", "verdict", "residual", "error", "bound", "energy_gain", "penetration", "solve_s")

    def setUp(self):
        super().setUp()
        self.addCleanup(plt.close, "all")

    def test_each_case_is_a_row_each_method_a_column_and_each_quantity_a_panel_of_its_own(self):
        verdicts = list(measures.VERDICTS)
        rows = [("B2", "wall", "mu = nan", "soft", verdicts[2], "1e-3", "1e-2", "1e-4", "1e-5", "1e-6", "1e-1"),
                ("B2", "wall", "mu = nan", "convex", verdicts[0], "1e-30", "1e-30", "1e-4", "0", "-1", "1e9"),
                ("A1", "arch", "", "convex", verdicts[6], "1e9", "1e9", "1", "1e9", "1e9", "1e-9"),
                ("A1", "wall", "", "soft", verdicts[4], "", "", "", "", "", ""),
                ("A1", "wall", "", "soft", verdicts[1], "1e-7", "3", "3", "1e-8", "1e-9", "1e-2")]
        with open(self.top / "stress.csv", "w", newline="") as file:
            csv.writer(file).writerows([self.COLUMNS, *rows])
        with mock.patch.object(heatmap.plt, "close"):
            heatmap.draw(self.top / "stress.csv", self.top)
        self.assertEqual({p.name for p in self.top.iterdir()}, {"stress.csv", "heatmap.png", "heatmap.svg"})
        axes = plt.gcf().axes[:6]
        none = math.nan
        # Powers of ten within the limits of each panel; zero and less are the least; of two of one case the last.
        wanted = (("", [[2, 0], [none, 6], [1, none]], (0, 6)), ("checked residual", [[-3, -16], [none, 0], [
            -7, none]], (-16, 0)), ("error / bound", [[2, -6], [none, 6], [0, none]], (-6, 6)), ("energy gain of an event", [[
                -5, -16], [none, 2], [-8, none]], (-16, 2)), ("penetration, m", [[-6, -16], [none, 0], [
                    -9, none]], (-16, 0)), ("time solving, s", [[-1, 1.5], [none, -5], [-2, none]], (-5, 1.5)))
        for panel, (name, values, limits) in zip(axes, wanted, strict=True):
            with self.subTest(name):
                picture = panel.images[0]
                np.testing.assert_allclose(np.ma.filled(picture.get_array().astype(float), none), values, atol=1e-9)
                self.assertEqual([text.get_text() for text in panel.get_xticklabels()], ["soft", "convex"])
                if name:
                    self.assertEqual((picture.get_clim(), picture.colorbar.ax.get_xlabel()), (limits, f"log10 of {name}"))
        self.assertEqual([text.get_text() for text in axes[0].get_yticklabels()],
                         ["wall: mu = nan  B2", "arch:   A1", "wall:   A1"])
        verdict = axes[0].images[0]
        self.assertEqual([text.get_text() for text in verdict.colorbar.ax.get_xticklabels()], verdicts)
        self.assertEqual(len({verdict.cmap(verdict.norm(n)) for n in range(7)}), 7)
        self.assertEqual(verdict.cmap(verdict.norm(6)), (0, 0, 0, 1))  # a defect is black
        red, green, _, _ = verdict.cmap(verdict.norm(0))
        self.assertGreater(green, red)


if __name__ == "__main__":
    unittest.main()
