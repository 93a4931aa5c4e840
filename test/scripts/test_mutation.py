"""What the campaign of planted faults keeps (test/mutation/campaign.py)."""
import importlib.util
import subprocess
import sys
import tempfile
import types
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def campaign():
    folder = str(ROOT / "test/mutation")
    sys.path.insert(0, folder)
    try:
        spec = importlib.util.spec_from_file_location("campaign", f"{folder}/campaign.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    finally:
        sys.path.remove(folder)


class Outcomes(unittest.TestCase):
    def setUp(self):
        self.campaign = campaign()
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def keep(self, name, outcome, ids=("a", "b", "c"), **others):
        row = {**dict.fromkeys(self.campaign.COLUMNS, ""), "id": name, "room": "cone", "outcome": outcome, **others}
        self.campaign.keep(row, self.folder, ids)

    def rows(self):
        return self.campaign.read_rows(self.folder / "outcomes.csv")

    def test_a_row_takes_its_place_among_those_that_are_there(self):
        self.keep("b", "survived")
        self.keep("a", "killed", what='a "quoted"\nline, of two')
        self.keep("b", "killed")
        self.assertEqual([(name, row["outcome"]) for name, row in self.rows().items()], [("a", "killed"), ("b", "killed")])
        self.assertEqual(self.rows()["a"]["what"], 'a "quoted"\nline, of two')

    def test_rows_of_faults_that_are_gone_leave(self):
        self.keep("a", "killed")
        self.keep("c", "killed", ids=("b", "c"))
        self.assertEqual(list(self.rows()), ["c"])

    def test_the_page_counts_those_tried_and_names_who_survived_and_why(self):
        self.keep("a", "killed")
        self.keep("b", "survived", file="x.cpp", what="one more", equivalent="nobody sees it")
        page = (self.folder / "outcomes.md").read_text()
        self.assertIn("2 of 3 faults tried", page)
        self.assertIn("| cone | 2 | 1 | 0 | 1 | 100 % |", page)
        self.assertIn("* `b` x.cpp: one more: nobody sees it", page)


class Nearest(unittest.TestCase):
    """Which tests see a fault first. One that no test is near has passed without having been run."""
    def near(self, room, file):
        names = ("cone", "methods", "program", "scripts_bench", "scripts_first_day", "scripts_plan", "scripts_sweep")
        tests = {name: {"command": [f"/b/bin/test_{name}" if "_" not in name else "python3"]} for name in names}
        return campaign().order(types.SimpleNamespace(tests=tests, undisturbed={}), {"room": room, "file": file}, True)

    def test_each_fault_has_those_that_read_its_file(self):
        for room, file, tests in (
            ("cone", "lib/cone/rows.cpp", ["cone", "methods"]), ("bench", "bench/engines/ode.cpp", ["program"]),
            ("bench", "bench/small.py", ["scripts_bench"]), ("scripts", "scripts/contactbench/plan.py", ["scripts_plan"]),
            ("scripts", "scripts/setup.sh", ["scripts_first_day"]), ("scripts", "scripts/bench.sh", ["scripts_first_day", "scripts_bench"])):
            self.assertEqual(self.near(room, file), tests, file)


class Flags(unittest.TestCase):
    def refused(self, *flags):
        ended = subprocess.run([sys.executable, "-B", str(ROOT / "test/mutation/campaign.py"), "--list", *flags], capture_output=True, text=True)
        self.assertEqual(ended.returncode, 2, ended.stdout[-200:])
        return ended.stderr

    def test_other_faults_do_not_come_among_those_that_are_kept(self):
        for flags in (["--drawn-only"], ["--seed", "2"], ["--generated", "5"]):
            self.assertIn("--results", self.refused(*flags))

    def test_a_shard_that_is_none_is_refused(self):
        for shard in ("0/2", "3/2", "1", "a/b"):
            self.assertIn("--shard", self.refused("--shard", shard))


if __name__ == "__main__":
    unittest.main()
