"""Findings about engines (findings.py): what each asks of an engine, what it measures, and when it comes out again.

On runs that are made up; what becomes of runs that die is in test_engines.py."""
import contextlib
import io
import json
import math
import unittest
from pathlib import Path
from unittest import mock

from contactbench import findings, program
from folder import Folder

HEAD = "t,body,px,py,pz\n"
MUJOCO = {"engines": [{"name": "mujoco", "unavailable": None}]}


def says(words):
    return next(f for f in findings.FINDINGS if words in f.says)


class Measured(Folder):
    def motion(self, *rows):
        (self.top / "trajectory.csv").write_text(HEAD + "".join(",".join(map(str, row)) + "\n" for row in rows))

    def test_a_way_is_from_the_first_place_to_the_last_and_the_furthest_is_that_of_any_body_at_any_time(self):
        self.motion((0, "b", 1, 2, 3), (1, "b", 90, 0, 0), (2, "b", 3, 5, 9))
        self.assertEqual(findings.way({}, self.top), 7)  # 2, 3, 6
        # Each from its own start; the last moment has lost a body.
        self.motion((0, "a", 5, 0, 0), (0, "b", 0, 9, 0), (1, "a", 5, 0, 1), (1, "b", 2, 12, 6), (2, "a", 5, 0, 0),
                    (2, "b", 0, 9, 0), (3, "a", 99, 0, 0))
        self.assertEqual((findings.furthest(self.top), findings.moved({}, self.top)), (7, 7))
        self.motion()
        self.assertTrue(math.isnan(findings.furthest(self.top)))
        self.assertEqual(findings.error("b")({"errors": {"a": 1, "b": 2}}, self.top), 2)
        self.assertTrue(math.isnan(findings.error("c")({"errors": {"c": None}}, self.top)))

    def test_each_finding_asks_the_engine_for_what_it_speaks_of(self):
        asked = {f.says: [" ".join(c.words) for c in f.cases] for f in findings.FINDINGS}
        pushed = "sliding_box --engine {} --step 1e-3 --set push_angle={}"
        for who, flags in (("dart (dantzig)", "dart --variant dantzig"), ("ode (quick)", "ode --variant quick"),
                           ("ode (world)", "ode --variant world")):
            along, across = asked[f"the friction pyramid of {who} holds a box that is pushed at 45 degrees"]
            self.assertEqual(along, pushed.format(flags, "0"))
            self.assertEqual(across.rpartition("=")[0], pushed.format(flags, "x").rpartition("=")[0])
            self.assertEqual(float(across.rpartition("=")[2]), math.pi / 4)
        creep = "sticking_box --engine mujoco --variant newton-elliptic --step {} --duration 2"
        self.assertEqual(asked["that creep does not depend on the step"], [creep.format(h) for h in ("1e-2", "1e-3", "1e-4")])
        self.assertEqual(asked["MuJoCo at its defaults creeps by 3.8e-3 to 4e-3 m in 2 s"],
                         [creep.format(h) for h in ("1e-3", "1e-4")])
        self.assertEqual(asked["MuJoCo rebounds at e = 0 in a sliding impact"],
                         ["impacting_sphere --engine mujoco --variant newton-elliptic --step 1e-3"])
        self.assertEqual(
            asked["ODE's direct solver loses stacks from 4 to 8 boxes on"],
            [f"stack --engine ode --variant world --step 1e-3 --duration 1 --set boxes={n}" for n in (1, 2, 4, 8, 16)])
        self.assertEqual([(Path(words.split()[0]).name, *words.split()[1:])
                          for words in asked["sequential impulses break at mass ratios of 1e2 to 1e4"]],
                         [("mass_ratio.xml", *f"--engine bullet --variant si10 --step 1e-3 --set ratio={r}".split())
                          for r in ("1", "100", "1000", "10000", "1e+06")])
        self.assertEqual(
            {f.says: f.unit for f in findings.FINDINGS if f.unit != "m"},
            {"that creep does not depend on the step": "m/s", "MuJoCo rebounds at e = 0 in a sliding impact": "m/s"})

    def test_a_finding_comes_out_up_to_its_bounds(self):
        for words, again, otherwise in (("of ode (quick)", [(1.0, 0.0099)], [(1.0, 0.0101), (0.0, 1.0)]), ("creeps by", [
            (3.76e-3, 4.04e-3), (4.04e-3, 3.76e-3)], [
                (3.74e-3, 3.9e-3), (3.9e-3, 3.74e-3), (3.9e-3, 4.06e-3)]), ("that creep", [(1, 1.0009, 1)], [
                    (1, 1.0011, 1), (1.0011, 1, 1)]), ("rebounds", [(0.11, )], [(0.09, )]), ("ODE's direct", [
                        (0.9e-3, 0.9e-3, 9, 0.11, 0.11),
                        (0, 0, 0, math.inf, math.inf)], [(1.1e-3, 0, 0, 1, 1), (0, 1.1e-3, 0, 1, 1), (0, 0, 1, 0.09, 1),
                                                         (0, 0, 1, 1, 0.09)]), ("sequential", [(0.9e-3, 9, 9, 0.11, 0.11)], [
                                                             (1.1e-3, 9, 9, 1, 1), (0, 9, 9, 0.09, 1), (0, 9, 9, 1, 0.09)])):
            for numbers, answer in [(of, True) for of in again] + [(of, False) for of in otherwise]:
                self.assertIs(bool(says(words).comes_out(*numbers)), answer, (words, numbers))

    def test_a_row_has_the_number_of_each_run_in_the_order_of_the_cases(self):
        called = []

        def run(path, *words, timeout):
            called.append((path, *words[:2], words[words.index("--time-limit") + 1], timeout))
            step = words[words.index("--step") + 1]
            (Path(words[words.index("--out") + 1]) / "trajectory.csv").write_text(HEAD)
            summary = {
                "finished": True, "status": "inaccurate", "errors": {
                    "creep_rate_m_per_s": 2 + float(step), "position_linf_m": 9}}
            return mock.Mock(stdout=json.dumps(summary))

        with mock.patch.object(program, "call", run):
            row = findings.outcome("there", says("that creep"), MUJOCO, limit=7)
        self.assertEqual(called, [("there", "run", "sticking_box", 7, 41)] * 3)
        self.assertEqual(
            row, {
                "says": "that creep does not depend on the step", "engine": "mujoco", "unit": "m/s", "comes_out": False,
                "unavailable": None, "runs": [{"name": f"h = {h} s", "number": 2 + float(h), "status": "inaccurate"}
                                              for h in ("1e-2", "1e-3", "1e-4")]})
        self.assertEqual(
            findings.said(row),
            "contradicted: that creep does not depend on the step (h = 1e-2 s: 2.01 m/s; h = 1e-3 s: 2 m/s; "
            "h = 1e-4 s: 2 m/s)")
        row["runs"][1]["number"] = None
        self.assertIn("; h = 1e-3 s: inaccurate; ", findings.said(row | {"comes_out": True}))
        self.assertEqual([
            findings.verdict({"unavailable": no, "comes_out": out})
            for no, out in (("x", None), (None, True), (None, False), (None, None))],
                         ["not measured (x)", "comes out again", "contradicted", "not measured (a run has no number)"])
        self.assertEqual(findings.outcome("", says("that creep"), {"engines": []})["unavailable"], "no such engine")

    def test_findings_are_written_with_a_line_each(self):
        with mock.patch.object(findings, "outcome",
                               lambda path, f, listed: {"says": f.says, "unavailable": path, "runs": [], "comes_out": None}):
            with contextlib.redirect_stdout(io.StringIO()) as out:
                findings.write("why", {}, self.top / "new")
        rows = json.loads((self.top / "new/findings.json").read_text())
        self.assertEqual([r["says"] for r in rows], [f.says for f in findings.FINDINGS])
        self.assertEqual(out.getvalue().splitlines(), [f"not measured (why): {f.says}" for f in findings.FINDINGS])


if __name__ == "__main__":
    unittest.main()
