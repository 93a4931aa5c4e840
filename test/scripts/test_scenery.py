"""Scenes in the report (scenery.py): whose motions are shown, and how far methods are from each other, on made-up runs."""
import json
import math
import unittest
from unittest import mock

from contactbench import program, references, scenery, still, view
from folder import Folder
from made import csv_of, results, trajectory

SHAPES = csv_of("shape,body,kind,px,py,pz,qw,qx,qy,qz,radius,hx,hy,hz",
                [("ball", "ball", "sphere", *3 * (0, ), 1, *3 * (0, ), 0.5, *3 * (0, ))])


def moves(*ways, tenths=1):
    """trajectory.csv of a ball that is so far out at each moment."""
    return trajectory([(round(0.1 * tenths * n, 9), "ball", (0, 0, way)) for n, way in enumerate(ways)])


def shown(*ways, **summary):
    """Files of a run that kept its contacts."""
    return {
        "shapes.csv": SHAPES, "trajectory.csv": moves(*(ways or (0, 1))), "summary.json": json.dumps({"scenario": "box",
                                                                                                      **summary})}


class Scenery(Folder):
    def setUp(self):
        super().setUp()
        self.made = 0

    def results(self, *rows, **manifest):
        self.made += 1
        return results(self.top / str(self.made), rows, **manifest)

    def test_scenes_are_those_of_all_sweeps_once_each_in_their_order(self):
        made = self.results({"scene": "b", "parameters": "n=2"}, {"scene": "a", "sweeps": "other"},
                            {"scene": "b", "parameters": "n=2", "k": "16"}, {"scene": "b", "parameters": "n=1"})
        self.assertEqual(scenery.scenes(made), [("b", "n=2"), ("a", ""), ("b", "n=1")])

    def test_the_run_that_is_shown_came_to_its_end_and_is_of_the_liked_methods_the_most_exact(self):
        convex, ap, newton = {"method": "convex", "solver": "ipm"}, {"k": "8"}, {
            "method": "newton", "solver": "", "variant": "uncapped"}
        early = {"finished": "false", "status": "ray", "t_reached": "0.5"}
        order = [
            convex | {"step": "0.001", "epsilon": "1e-12", "knobs": "best"}, convex | {"step": "0.001", "epsilon": "1e-6"},
            convex | {"step": "0.01", "epsilon": "1e-12"}, ap | {"step": "0.001", "k": "16"}, ap | {"step": "0.001"},
            newton | {"step": "0.0001"}, convex | early | {"step": "0.001", "epsilon": "1e-9"}]
        hidden = [convex | {"run": "hidden__r1", "step": "1e-9"}, newton | {"scene": "other", "files": shown()}]
        for first, other in enumerate((3, 3, 3, 5, 5, 6, None)):  # the next of another method
            rows = [row | {"run": f"n{n}__r1", "files": shown()} for n, row in enumerate(order)][first:]
            found = [cell["run"] for cell in scenery.to_look_at(self.results(*rows[::-1], *hidden), "box", "")]
            self.assertEqual(found, [f"n{n}__r1" for n in (first, other) if n is not None])
        self.assertEqual(scenery.to_look_at(self.results({}), "box", ""), [])

    def test_each_scene_with_a_motion_has_its_picture_and_title(self):
        made = self.results({"parameters": "n=2", "files": shown(title="Two of them")}, {"scene": "still", "files": shown()},
                            {"scene": "without"}, {"scene": "broken", "files": {"shapes.csv": SHAPES}})
        found = scenery.motions(made)
        self.assertEqual({name: (one["title"], [cell["run"] for cell in one["cells"]]) for name, one in found.items()},
                         {"box n=2": ("Two of them", ["r0__r1"]), "still": ("", ["r1__r1"])})
        self.assertTrue(all(one["picture"].startswith("<svg") for one in found.values()))

    def test_the_picture_is_of_the_run_that_is_shown_first(self):
        made = self.results({"k": "8", "files": shown(0, 5, title="The other")},
                            {"method": "convex", "solver": "ipm", "files": shown(title="The first")})
        found = scenery.motions(made)["box"]
        first, other = (still.svg(view.Motion(cell.folder, cell.with_k, 2)) for cell in found["cells"])
        self.assertNotEqual(first, other)
        self.assertEqual((found["title"], found["picture"]), ("The first", first))

    def test_the_page_of_all_motions_has_two_runs_a_scene_with_what_they_are(self):
        made = self.results({"k": "8", "step": "0.001", "files": shown()},
                            {"method": "convex", "solver": "ipm", "step": "", "knobs": "accuracy=1e-6", "files": shown()},
                            {"scene": "other", "parameters": "n=3", "files": shown(*range(200))})
        with mock.patch.object(view, "page", side_effect=json.dumps):
            self.assertEqual(scenery.write_motions(made), "")
        first, second = json.loads((made.folder / "motion.html").read_text())
        self.assertEqual([part["name"] for part in (first, second)], ["box", "other n=3"])
        self.assertEqual([run["label"] for run in first["runs"]], ["convex, accuracy 1e-6 m", "A-P Lemke, k = 8, step 0.001 s"])
        self.assertEqual([len(run["t"]) for run in second["runs"]], [120])
        with mock.patch.object(view, "page", side_effect=program.ProgramError("no three.js")):
            self.assertEqual(scenery.write_motions(made), "no three.js")
        self.assertFalse((made.folder / "motion.html").exists())  # that of before is none of these runs
        self.assertEqual(scenery.write_motions(self.results({"scene": "without"})), "no run kept its contacts")

    def test_a_run_that_died_before_its_first_moment_stops_no_page(self):
        dead = {"status": "crash", "finished": "false", "files": {"shapes.csv": SHAPES, "trajectory.csv": ""}}
        convex = {"method": "convex", "solver": "ipm"}
        for rows, run in (([convex | dead, {"files": shown()}], "r1__r1"), ([convex | {"files": shown()}, dead], "r0__r1")):
            made = self.results(*rows)
            self.assertEqual([cell["run"] for cell in scenery.to_look_at(made, "box", "")], [run])
            with mock.patch.object(view, "page", side_effect=json.dumps):
                self.assertEqual(scenery.write_motions(made), "")
            (scene, ) = json.loads((made.folder / "motion.html").read_text())
            self.assertEqual(len(scene["runs"]), 1)

    def test_methods_are_compared_at_the_finest_step_at_which_most_came_to_the_end(self):
        convex, soft = {"method": "convex", "solver": "ipm"}, {"method": "soft", "solver": "sap"}
        early = {"finished": "false", "status": "ray", "t_reached": "0.1"}

        def run(way, step, row):
            return row | {"step": step, "knobs": f"step={step}", "files": {"trajectory.csv": moves(0, way, way / 2)}}

        made = self.results(run(1, "0.01", {"k": "8"}), run(3, "0.01", convex), run(7, "0.01", soft), run(
            1.5, "0.001", {"k": "8"}), run(2, "0.001", convex), run(9, "0.001", soft | early), run(11, "0.1", {"k": "8"}),
                            run(13, "0.1", convex), run(18, "0.1", soft))
        found = scenery.apart(made, "box", "")
        self.assertEqual(found,
                         {"step": "0.01", "rows": {"A-P Lemke, k = 8": [0, 2, 6], "convex": [2, 0, 4], "soft SAP": [6, 4, 0]}})
        made = self.results(run(1, "0.001", {"k": "8"}), run(3, "0.001", convex), run(1, "1e-05", {"k": "8"}), run(2, "1e-05", convex))
        self.assertEqual(scenery.apart(made, "box", ""), {"step": "1e-05", "rows": {"A-P Lemke, k = 8": [0, 1], "convex": [1, 0]}})
        made = self.results(run(1, "0.01", {"k": "8"}),
                            run(3, "0.01", convex) | {"files": {"trajectory.csv": trajectory([(5, "ball", (0, 0, 0))])}})
        (own, other), _ = scenery.apart(made, "box", "")["rows"].values()
        self.assertEqual(own, 0)
        self.assertTrue(math.isnan(other))  # no moment in common
        self.assertIsNone(scenery.apart(self.results(early), "box", ""))

    def test_settings_that_differ_in_another_knob_are_others(self):
        def run(way, step, knobs=""):
            return {"k": "8", "step": step, "knobs": f"step={step}{knobs}", "files": {"trajectory.csv": moves(0, way, way / 2)}}

        steps = " stepping=steps warm_start=on"
        made = self.results(run(1, "0.01"), run(3, "0.01", steps), run(1.5, "0.001"), run(2, "0.001", steps))
        name = "A-P Lemke, k = 8"
        self.assertEqual(scenery.apart(made, "box", ""), {
            "step": "0.001", "rows": {name: [0, 0.5], f"{name}, stepping=steps, warm_start=on": [0.5, 0]}})
        rows = scenery.table(made, "box", "")["rows"]
        self.assertEqual([(row["method"], row["error"]) for row in rows],
                         [(name, 0.5), (f"{name}, stepping=steps, warm_start=on", 1), (name, 0.5),
                          (f"{name}, stepping=steps, warm_start=on", 1)])  # each from its own finest step

    def test_the_table_has_the_error_where_a_reference_is_and_else_the_way_to_the_finest_step(self):
        numbers = {
            "duration": "4", "processing_s": "2", "residual_max": "1e-9", "max_gain_relative": "1e-3", "step": "0.01", "k": "8"}
        early = {"finished": "false", "status": "ray", "t_reached": "0.125"}
        made = self.results(
            numbers | {"error_position_linf_m": "0.25", "reference": "analytic"}, numbers | early | {"k": "16", "step": "0.02"},
            numbers |
            {"method": "convex", "solver": "ipm", "k": "", "knobs": "accuracy=1e-6", "step": "", "status": "inaccurate"})
        found = scenery.table(made, "box", "")
        self.assertEqual((found["measure"], found["reference"]), ("position_linf_m", "analytic"))
        self.assertEqual(
            found["rows"][0], {
                "method": "A-P Lemke, k = 8", "step": "0.01", "ended": "ok", "error": 0.25, "time": 0.5, "residual": "1e-9",
                "gain": "1e-3", "command": made.cells()[0].command, "run": "r0"})
        second, third = found["rows"][1:]
        self.assertEqual((second["ended"], math.isnan(second["time"]), math.isnan(second["error"])),
                         ("ray at 0.125 s", True, True))
        self.assertEqual((third["method"], third["step"], third["ended"], third["time"]),
                         ("convex", "to 1e-6 m", "inaccurate", 0.5))
        ways = [
            numbers | {"step": step, "knobs": f"step={step}", "files": {"trajectory.csv": moves(0, way)}}
            for step, way in (("0.01", 1), ("0.001", 1.25), ("0.1", 5))]
        made = self.results(*ways, references={references.name_of("box", ""): {"reason": "they part"}})
        found = scenery.table(made, "box", "")
        self.assertEqual((found["measure"], found["reference"]), ("", "missing: they part"))
        self.assertEqual([row["error"] for row in found["rows"]], [0.25, 0.25, 3.75])  # the finest from the next


if __name__ == "__main__":
    unittest.main()
