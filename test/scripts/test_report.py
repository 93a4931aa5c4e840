"""The reproduction's scripts, run on a stand-in for the program whose answers are known."""
import csv
import json
import os
import stat
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "scripts"

# A program that knows one method of each kind. Its runs take 100 steps; `STOP_AT` ends every run of ap early.
STAND_IN = """#!{python}
import json, os, sys
words = sys.argv[1:]
if words[0] == "list":
    method = lambda name, solvers, variants, flags: {{"name": name, "solvers": solvers, "variants": variants,
                                                      "options": [{{"flag": f}} for f in flags]}}
    print(json.dumps({{"methods": [method("newton", [], ["uncapped", "stick-tested"], []),
                                   method("ap", ["lemke", "path-lib"], [], ["k"]),
                                   method("convex", ["ipm"], [], ["epsilon"])],
                       "solvers": [{{"method": "ap", "name": "path-lib", "unavailable": "not installed"}},
                                   {{"method": "ap", "name": "lemke", "unavailable": None}}]}}))
    sys.exit()
scene, out = words[1], words[words.index("--out") + 1]
if os.environ.get("CRASH") == scene: os.abort()
if os.environ.get("REFUSE") == scene:
    sys.stderr.write("bad scene\\n")
    sys.exit(2)
n, early = 100, "ap" in words and scene == "stack.xml"
status = "ray" if early else "ok"
with open(out + "/trajectory.csv", "w") as f:
    f.write("t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\\n")
    for i in range(n + 1): f.write(f"{{i / 10}},box,{{i * 1e-9}},0.5,0,1,0,0,0,0,0,0,0,0,0\\n")
    f.write("10.1,box,0.")  # what a killed program leaves
with open(out + "/steps.csv", "w") as f:
    f.write("step,t,status,residual,kinetic_energy,dynamics_s,collision_s,assembly_s,solve_s,step_s\\n")
    for i in range(n): f.write(f"{{i + 1}},{{(i + 1) / 10}},ok,,{{n - i}},1e-6,1e-6,1e-6,1e-6,1e-5\\n")
json.dump({{"status": status, "reason": "no way on" if early else None, "finished": not early, "t_reached": 0.25,
           "options": {{"step": 0.001, "duration": 10}}, "errors": {{"final_m": 1e-9}},
           "time": {{"total_s": 1, "dynamics_s": 0.25, "collision_s": 0.125, "assembly_s": 0.0625, "solve_s": 0.0625}},
           "residuals": {{"max": None}}, "versions": {{"git": "abc"}}, "machine": {{"cores": 2}}}},
          open(out + "/summary.json", "w"))
sys.exit(3 if early else 0)
"""


class Reproduction(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.top = Path(self.folder.name)
        self.runs = self.top / "runs"
        self.runs.mkdir()
        self.program = self.top / "program"
        self.program.write_text(STAND_IN.format(python=sys.executable))
        self.program.chmod(self.program.stat().st_mode | stat.S_IXUSR)

    def script(self, *words, **environment):
        ended = subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True,
                               env={**os.environ, **environment})
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return ended.stdout

    def do_runs(self, **environment):
        return self.script(SCRIPTS / "run_all.py", "--program", self.program, "--out", self.runs, **environment)

    def table(self):
        self.script(SCRIPTS / "table.py", "--runs", self.runs, "--out", self.top, "--profile", "quick")
        with open(self.top / "runs.csv", newline="") as file:
            return list(csv.DictReader(file))

    def draw(self, name):
        self.script(SCRIPTS / "plots" / f"{name}.py", "--results", self.top, "--runs", self.runs)
        return [(self.top / "figures" / f"{name}.{kind}").read_bytes() for kind in ("png", "svg")]

    def test_every_method_runs_on_every_scene_but_with_solvers_that_are_not_there(self):
        said = self.do_runs()
        self.assertIn("ap/path-lib is left out: not installed", said)
        rows = self.table()
        # 9 scenes: newton twice, convex twice, ap once, and once more with k = 16 on the sticking box.
        self.assertEqual(len(rows), 9 * 5 + 1)
        self.assertEqual({r["solver"] for r in rows if r["method"] == "ap"}, {"lemke"})
        self.assertEqual([r["k"] for r in rows if r["scene"] == "sticking_box" and r["method"] == "ap"], ["8", "16"])

    def test_a_finished_run_is_not_done_again_until_the_program_is_newer(self):
        self.do_runs()
        self.assertNotIn("] ", self.do_runs())
        later = max(p.stat().st_mtime for p in self.runs.rglob("run.json")) + 10
        os.utime(self.program, (later, later))
        self.assertIn("[  1/", self.do_runs())

    def test_an_interrupted_run_is_done_again(self):
        self.do_runs()
        record = next(self.runs.rglob("run.json"))
        record.write_text(json.dumps({**json.loads(record.read_text()), "status": "interrupted"}))
        again = self.do_runs()
        self.assertEqual(again.count("] "), 1)
        self.assertIn(record.parent.name, again)

    def test_a_failure_is_a_row_with_its_status_and_stops_nothing(self):
        self.do_runs(CRASH="sliding_box.xml", REFUSE="circular_sliding.xml")
        rows = self.table()
        of = {scene: {r["status"] for r in rows if r["scene"] == scene and r["method"] == "convex"}
              for scene in ("sliding_box", "circular_sliding", "stack")}
        self.assertEqual(of, {"sliding_box": {"crash"}, "circular_sliding": {"input_error"}, "stack": {"ok"}})
        crashed = next(r for r in rows if r["status"] == "crash")
        self.assertEqual((crashed["processing_s"], crashed["t_reached"], crashed["error_final_m"]), ("", "", ""))
        refused = next(r for r in rows if r["status"] == "input_error")
        self.assertEqual(refused["reason"], "bad scene")
        cells = (self.top / "timings.md").read_text()
        self.assertIn("ray at 0.25 s", cells)
        self.assertIn("crash", cells)

    def test_processing_time_is_the_sum_of_the_parts_and_missing_is_empty(self):
        self.do_runs()
        rows = self.table()
        self.assertEqual({float(r["processing_s"]) for r in rows}, {0.5})
        self.assertEqual({r["residual_max"] for r in rows}, {""})
        manifest = json.loads((self.top / "manifest.json").read_text())
        self.assertEqual(manifest["statuses"], {"ok": 9 * 4 + 5, "ray": 5})
        self.assertEqual(manifest["versions"], {"git": "abc"})
        self.assertNotIn(str(self.top), (self.top / "runs.csv").read_text() + json.dumps(manifest))

    def test_the_same_runs_draw_the_same_bytes(self):
        self.do_runs()
        self.table()
        for name in sorted(p.stem for p in (SCRIPTS / "plots").glob("figure*.py")):
            first = self.draw(name)
            if name in ("figure04", "figure07"):
                self.assertEqual(first, self.draw(name), name)

    def test_figures_are_drawn_where_runs_failed_or_are_not_there(self):
        self.do_runs(CRASH="sticking_box.xml")
        self.table()
        self.draw("figure04")
        with open(self.top / "runs.csv") as file:
            head = file.readline()
        (self.top / "runs.csv").write_text(head)
        self.draw("figure04")


if __name__ == "__main__":
    unittest.main()
