"""The angle of repose, on runs whose angle is known."""
import csv
import json
import math
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

import matplotlib.pyplot as plt
from contactbench import figures, gather, repose
from contactbench.runs import Runs

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


class Angle(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)

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
        rows = [{"run": f"r{n}__r1", "sweeps": "motion", "scene": repose.SCENE, "parameters": f"mu={mu}", "method": "convex", "solver": "ipm",
                 "status": "ok", "finished": "true", "repeat": "1", "step": "1", "duration": "4"} for n, mu in enumerate((0.1, 0.5))]
        for shapes in (True, False):
            top = self.top / f"shapes_{shapes}"
            for row in rows:
                share = 1 if row["parameters"] == "mu=0.5" else 0.5
                write_run(top / "runs" / row["run"], [share * degrees for degrees in (0, 10, 20, 30, 25)], shapes)
            with open(top / "runs.csv", "w") as file:
                table = csv.DictWriter(file, gather.COLUMNS, "")
                table.writeheader()
                table.writerows(rows)
            (top / "manifest.json").write_text(json.dumps({"profile": "quick"}))
            results = Runs(top, top / "runs")
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


if __name__ == "__main__":
    unittest.main()
