"""results/ belongs to the program beside it: published runs, solves and stiff cases come out again to the last digit. Each with
its neighbours in time left out: of the runs the cheapest of each scene, method and set of knobs; what is left takes a minute.

Where a change is meant to move numbers, results/ is made anew with it: scripts/reproduce.sh --profile paper."""
import contextlib
import csv
import dataclasses
import io
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path
from types import SimpleNamespace

import standin
from contactbench import gather, plan, program, references, solve_all, stress, sweep
from contactbench.runs import write_table

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results"
PROGRAM = os.environ.get("PROGRAM")
SWEEPS = (
    "motion", "paper", "robots", "claims", "error_time", "orders", "polygons", "stepping", "today")  # of reproduce.sh
FROM_FILES = {"error_time", "engines", "models_today",
              "claim_table"}  # sections that read what runs wrote, which is not kept
LONGEST = 1  # s: what took longer when it was published is left out
ADVICE = "results/ is another program's: scripts/reproduce.sh --profile paper makes it anew"


def published(name):
    with open(RESULTS / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def differences(found, wanted, key, apart):
    """Of rows by key: all that differs, a line each."""
    wanted = {tuple(row[k] for k in key): row for row in wanted}
    for row in found:
        name = tuple(row[k] for k in key)
        for column in dict.fromkeys([*wanted[name], *row]):
            ours, theirs = row.get(column, ""), wanted[name].get(column, "")
            if column not in apart and ours != theirs:
                yield f"{' '.join(name)}: {column} is {ours!r}, published {theirs!r}"


def without_values(knobs):
    """Steps, durations and accuracies are many of a kind."""
    words = [knob.split("=", 1) for knob in knobs.split()]
    return " ".join(name if name in ("step", "duration", "accuracy") else f"{name}={value}" for name, value in words)


def chosen(rows):
    """Names of the cheapest runs of their kind."""
    cheapest = {}
    for row in rows:
        kind = (row["scene"], *(word.split("=")[0] for word in row["parameters"].split()), row["method"],
                row["variant"], row["solver"], without_values(row["knobs"]), row["status"])
        if row["status"] not in gather.LIMITS and float(row["wall_s"] or math.inf) < LONGEST:
            cheapest[kind] = min(row, cheapest.get(kind, row), key=lambda one: float(one["wall_s"]))
    return {row["run"] for row in cheapest.values()}


@unittest.skipUnless(PROGRAM, "PROGRAM is not set: ctest names the program")
class Published(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.top = Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.top, ignore_errors=True)
        cls.listed = program.listed(PROGRAM)
        manifest = json.loads((RESULTS / "manifest.json").read_text())
        cls.profile = manifest["profile"]
        levels = set(re.findall(r"-march=\S+", json.dumps(manifest["versions"])))
        if not levels & set(re.findall(r"-march=\S+", program.call(PROGRAM, "--version").stdout)):
            raise unittest.SkipTest(f"the published numbers are of another instruction set: {', '.join(levels)}")

    def same(self, found, wanted, key, apart=()):
        different = list(differences(found, wanted, key, apart))
        self.assertFalse(different, "\n".join([ADVICE, f"{len(different)} numbers differ:", *different[:20]]))

    def done(self, runs):
        """Rows of runs, done as a sweep does them."""
        options = SimpleNamespace(program=PROGRAM, runs=self.top / "runs", references=RESULTS / "references",
                                  deadline=None)
        options.runs.mkdir(exist_ok=True)
        with program.workers(os.cpu_count()) as pool:
            load = program.Load()
            for future in [pool.submit(program.do, job, load) for job in sweep.jobs_of(runs, self.listed, options)]:
                future.result()
        rows, _ = gather.rows_of(runs, options.runs, sweep.certified(runs, self.listed, options))
        self.assertEqual(len(rows), len(runs))
        return rows

    def planned(self, sweeps=SWEEPS):
        return plan.plan([ROOT / f"scenarios/sweeps/{name}.toml" for name in sweeps], self.profile, self.listed)[0]

    def test_runs_are_those_that_the_sweeps_name(self):
        self.assertEqual({run.name for run in self.planned()}, {row["run"] for row in published("runs.csv")})

    def test_runs_come_out_again(self):
        table = published("runs.csv")
        names = chosen(table)
        # No run is timed, so that none is warmed up by another.
        runs = [dataclasses.replace(run, timed=False) for run in self.planned() if run.name in names]
        self.assertGreater(len(runs), 30)
        self.same(self.done(runs), table, ["run"], (*gather.TIMING, "member"))

    def test_runs_beside_engines_come_out_again(self):
        table = [row for row in published("engines/runs.csv") if not row["engine"]]
        names = chosen(table)
        runs = [dataclasses.replace(run, timed=False) for run in self.planned(["engines"]) if run.name in names]
        self.assertGreater(len(runs), 10)
        # That sweep has no certified references.
        self.same(self.done(runs), table, ["run"], (*gather.TIMING, "member", f"error_{references.ERROR}"))

    def test_members_of_ensembles_come_out_again(self):
        table = published("ensemble.csv")
        names = chosen(row for row in table if row["member"] == "1")
        runs = [run.as_member(1) for run in self.planned() if run.repeat == 1 and run.members]
        runs = [run for run in runs if run.name in names][::3]
        self.assertGreater(len(runs), 5)
        self.same(self.done(runs), table, ["run"], gather.TIMING)

    def test_solves_come_out_again(self):
        table = published("solve_all/solve_all.csv")
        slow = {row["problem"] for row in table if float(row["time_median_s"] or 0) > 0.05}
        names = sorted({row["problem"] for row in table} - slow)[::4]
        self.assertGreater(len(names), 5)
        found = []
        for name in names:
            with contextlib.redirect_stdout(io.StringIO()):
                solve_all.main([
                    "--program", PROGRAM, "--quiet", "--out",
                    str(self.top / name), "--repeat", "1", "--only", f"{name}."])
            with open(self.top / name / "solve_all.csv", newline="", encoding="utf-8") as file:
                found += list(csv.DictReader(file))
        self.same(found, table, ["problem", "kind", *solve_all.CHOSEN], ("time_min_s", "time_median_s", "busy"))

    def test_stiff_cases_come_out_again(self):
        cases, table = tomllib.loads(stress.CASES.read_text()), published("stress/stress.csv")
        stress.DEPARTS.update(cases.get("departs", {}))
        options = SimpleNamespace(program=PROGRAM, other_program=None, only=[], quick=False, accuracy=0.0, member=0,
                                  time_limit=15, scratch=self.top, statuses=program.statuses_of(self.listed))
        slow = {(row["id"], row["method"]) for row in table if float(row["solve_s"] or math.inf) > 0.1}
        jobs = [
            job for job in stress.plan(cases, list(stress.methods_of(self.listed)), options)
            if job["method"] in ("ap/lemke", "convex/bound-on", "coulomb/newton", "newton/stick-tested", "mirtich",
                                 "soft/sap") and (cases["case"][job["case"]]["id"], job["method"]) not in slow]
        self.assertGreater(len(jobs), 150)
        with program.workers(os.cpu_count()) as pool:
            cells = [
                future.result()
                for future in [pool.submit(stress.do_run, job, cases["case"][job["case"]], options) for job in jobs]]
        stress.compare(jobs, cells, cases)
        write_table(stress.table_of(jobs, cells, cases), stress.COLUMNS, self.top / "stress.csv")
        with open(self.top / "stress.csv", newline="", encoding="utf-8") as file:
            self.same(list(csv.DictReader(file)), table, ["id", "scene", "row", "method"], ("solve_s", "note"))


class Report(unittest.TestCase):
    def test_comes_out_of_the_tables_again(self):
        with tempfile.TemporaryDirectory() as folder:
            top = Path(folder) / "results"
            shutil.copytree(RESULTS, top, ignore=shutil.ignore_patterns("runs", "*.html"))
            ended = subprocess.run([
                sys.executable, "-B",
                str(ROOT / "scripts/report.py"), "--results", top, "--runs", top / "runs", "--no-draw"],
                                   capture_output=True, text=True, timeout=900, check=False)
            self.assertEqual(ended.returncode, 0, ended.stderr)
            made, wanted = (json.loads((place / "report.json").read_text())["sections"] for place in (top, RESULTS))
        self.assertEqual(list(made), list(wanted))
        for name in made.keys() - FROM_FILES:
            for part in ("data", "worth"):
                with self.subTest(section=name, part=part):
                    found, there = (dict(standin.leaves(sections[name].get(part))) for sections in (made, wanted))
                    different = [
                        f"{path}: {found.get(path)!r}, published {there.get(path)!r}" for path in found | there
                        if path not in found or path not in there or found[path] != there[path]]
                    self.assertFalse(different, "\n".join([
                        ADVICE, f"{len(different)} of {len(there)} differ:", *different[:20]]))


if __name__ == "__main__":
    unittest.main()
