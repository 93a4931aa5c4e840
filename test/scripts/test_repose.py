"""The angle of repose (repose.py), on runs whose angle is known."""
import math
import unittest
from types import SimpleNamespace

import made
import matplotlib.pyplot as plt
import numpy as np
from contactbench import figures, repose
from folder import Folder

HEAD = "t,body,px,py,pz,qw,qx,qy,qz\n"


def write_run(folder, degrees, shapes=True):
    """Three balls in a row about a middle that has turned by so many degrees, a moment each."""
    folder.mkdir(parents=True)
    rows = ""
    for moment, turned in enumerate(degrees):
        a = math.radians(turned)
        rows += f"{moment},drum,0,9,0,1,0,0,0\n"
        rows += "".join(f"{moment},ball_{k},{0.3 * math.sin(a) + k * 0.1 * math.cos(a)},{-0.3 * math.cos(a) + k * 0.1 * math.sin(a)},"
                        f"{k},1,0,0,0\n" for k in (-1, 0, 1))
    (folder / "trajectory.csv").write_text(HEAD + rows)
    (folder / "steps.csv").write_text("step,t\n" + "".join(f"{n},{n}\n" for n in range(len(degrees))))
    if shapes:
        (folder / "shapes.csv").write_text("shape,body,kind,radius\n" + "".join(f"ball_{k},ball_{k},sphere,0.05\n" for k in (-1, 0, 1)))
    return folder


class Angle(Folder):
    def test_is_that_of_the_middle_of_the_balls(self):
        t, degrees = repose.angle(SimpleNamespace(folder=write_run(self.top / "a", (-5, 0, 25, 100))))
        self.assertEqual(list(t), [0, 1, 2, 3])
        for found, wanted in zip(degrees, (-5, 0, 25, 100)):
            self.assertAlmostEqual(found, wanted, 9)

    def test_settles_in_the_second_half_of_what_came_to_its_end(self):
        folder = write_run(self.top / "b", (0, 90, 20, 30, 25))
        least, mean, most = repose.settled(SimpleNamespace(folder=folder, finished=True))
        for found, wanted in ((least, 20), (mean, 25), (most, 30)):
            self.assertAlmostEqual(found, wanted, 9)
        self.assertIsNone(repose.settled(SimpleNamespace(folder=folder, finished=False)))
        self.assertIsNone(repose.settled(SimpleNamespace(folder=self.top / "none", finished=True)))

    def test_is_drawn_with_and_without_shapes(self):
        rows = [{"run": f"r{n}__r1", "sweeps": "motion", "scene": repose.SCENE, "parameters": f"mu={mu}", "method": "coulomb", "solver": "newton",
                 "step": "1", "duration": "4"} for n, mu in enumerate((0.1, 0.5))]
        for shapes in (True, False):
            top = self.top / f"shapes_{shapes}"
            for row in rows:
                share = 1 if row["parameters"] == "mu=0.5" else 0.5
                write_run(top / "runs" / row["run"], [share * degrees for degrees in (0, 10, 20, 30, 25)], shapes)
            results = made.results(top, rows, profile="quick")
            if shapes:  # a file of one is enough: it takes half a second
                figures.draw(repose.FIGURE, results)
                self.assertTrue((top / "figures/repose.png").exists())
            figure, (picture, over_time, of_mu) = repose.canvas(None)
            repose.repose(repose.runs(results), (picture, over_time, of_mu))
            # Over time the largest friction alone; against friction the second half of each.
            curve = max(over_time.lines, key=lambda line: len(line.get_xdata()))
            for drawn, wanted in zip(curve.get_xydata(), ((0, 0), (1, 10), (2, 20), (3, 30), (4, 25))):
                self.assertAlmostEqual(math.dist(drawn, wanted), 0, 9)
            means = [line.get_xydata()[0] for line in of_mu.lines]
            for (x, y), (mu, mean) in zip(means, ((0.1, 12.5), (0.5, 25))):
                self.assertAlmostEqual(x, mu, delta=0.01)
                self.assertAlmostEqual(y, mean, 9)
            self.assertEqual(len(means), 2)
            self.assertEqual(picture.axison, shapes)
            plt.close(figure)

    def test_methods_stand_beside_each_other_with_the_published_band_and_the_balls_of_the_shown_one(self):
        ways = {"ap": ("lemke", (0, 0, 30, 31, 35)), "convex": ("ipm", (0, 0, 20, 22, 27)), "soft": ("sap", (0, 0, 1, 2, 3))}
        rows = []
        for n, (method, (solver, degrees)) in enumerate(ways.items()):
            for mu in (0.25, 0.5):
                rows.append({
                    "run": f"{method}_{mu}__r1", "sweeps": "motion", "scene": repose.SCENE, "parameters": f"fill=3 mu={mu}",
                    "method": method, "solver": solver, "finished": "true" if method != "soft" else "false", "t_reached": "4",
                    "step": "1", "duration": "4"})
                folder = write_run(self.top / "runs" / rows[-1]["run"], [2 * mu * d for d in degrees])
                (folder / "shapes.csv").write_text(
                    "shape,body,kind,radius\nwall,,box,9\nball_-1,ball_-1,sphere,0.05\nball_0,ball_0,sphere,0.1\n"
                    "ball_1,ball_1,sphere,0.2\n")
        results = made.results(self.top, rows + [rows[0] | {"run": "own__r1", "parameters": ""}])
        self.assertEqual([repose.mu_of(cell) for cell in repose.cells(results)],
                         3 * [0.25, 0.5])  # what has the scene's own mu is left out
        self.addCleanup(plt.close, "all")
        figure, axes = repose.canvas(None)
        handles = repose.repose(repose.runs(results), axes)
        picture, over_time, of_mu = axes
        self.assertEqual([handle.get_label().partition(" (")[0] for handle in handles],
                         ["A-P, Lemke, k = 8", "convex", "soft, SAP", "published, mu from 0.3 to 0.6"])
        # Least to largest from 2 s of 4 on; convex to the right of its mu, others to the left; soft did not end.
        bars = {
            round(float(x), 3): (a, b) for some in of_mu.collections if hasattr(some, "get_segments")
            for (x, a), (_, b) in some.get_segments()}
        wanted = {0.244: (15, 17.5), 0.494: (30, 35), 0.256: (10, 13.5), 0.506: (20, 27)}
        self.assertEqual(set(bars), set(wanted))
        for at, ends in wanted.items():
            np.testing.assert_allclose(bars[at], ends)
        points = sorted(tuple(line.get_xydata()[0]) for line in of_mu.lines)
        np.testing.assert_allclose(points, [(0.244, 16), (0.256, 11.5), (0.494, 32), (0.506, 23)])
        curves = [line for line in over_time.lines if len(line.get_xdata()) == 5 and line.get_label()[0] != "_"]
        np.testing.assert_allclose([line.get_ydata() for line in curves], [degrees for _, degrees in ways.values()], atol=1e-9)
        self.assertEqual((over_time.get_title(loc="left"), over_time.get_xlabel(), over_time.get_ylabel()),
                         ("mu = 0.5", "time (s)", "angle (degrees)"))
        self.assertEqual((of_mu.get_title(loc="left"), of_mu.get_xlabel(), of_mu.get_ylim()[0]),
                         ("mean, least and largest\nof the second half", "friction mu", 0))
        band = of_mu.collections[-1].get_paths()[0].vertices
        np.testing.assert_allclose([band.min(axis=0), band.max(axis=0)], [(0.3, 20), (0.6, 35)])
        beside = over_time.patches[0].get_extents().transformed(over_time.transData.inverted())
        np.testing.assert_allclose([beside.y0, beside.y1], [20, 35])
        # The balls of convex at the end, turned by 27 degrees: their middle is 0.3 below the axis of the drum.
        *balls, drum = picture.patches
        a = math.radians(27)
        middle, along = np.array([0.3 * math.sin(a), -0.3 * math.cos(a)]), np.array([math.cos(a), math.sin(a)])
        self.assertEqual([ball.radius for ball in balls], [0.05, 0.1, 0.2])
        for k, ball in zip((-1, 0, 1), balls):
            np.testing.assert_allclose(ball.center, middle + 0.1 * k * along, atol=1e-12)
        self.assertEqual(drum.center, (0, 0))
        self.assertAlmostEqual(drum.radius, math.hypot(0.3, 0.1) + 0.2)  # around the farthest ball
        np.testing.assert_allclose([picture.get_xlim(), picture.get_ylim()], 2 * [(-1.05 * drum.radius, 1.05 * drum.radius)])
        half = math.sqrt(drum.radius**2 - 0.3**2) * along
        np.testing.assert_allclose(sorted(picture.lines[0].get_xydata().tolist()), [middle - half, middle + half], atol=1e-12)
        self.assertEqual(picture.get_title(loc="left"), "convex, mu = 0.5, at its end")


if __name__ == "__main__":
    unittest.main()
