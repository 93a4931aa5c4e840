"""What a number is worth: found by other last bits, another order of contacts, other repeats and another clock, and known of every
number of the report."""
import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
import types
import unittest
from pathlib import Path

import pandas
import standin
from contactbench import claims, gather, plan, precision, sections, worth
from contactbench.runs import Clock, Runs

ROOT = Path(__file__).resolve().parents[2]
SWEEPS = ("paper", "error_time")
CHAOTIC, STEADY = "impacting_sphere", "sliding_box"


def script(name, *words, **fakes):
    ended = subprocess.run([sys.executable, "-B", str(ROOT / "scripts" / name), *map(str, words)], capture_output=True, text=True,
                           timeout=600, env=standin.environment(FAKE=json.dumps(fakes)))
    if ended.returncode != 0:
        raise AssertionError(ended.stdout + ended.stderr)
    return ended.stdout


def setUpModule():
    """The sphere's errors depend on the seed; those of the boxes fall with the step."""
    global MADE, SAID
    MADE = Path(tempfile.mkdtemp())
    unittest.addModuleCleanup(shutil.rmtree, MADE, ignore_errors=True)
    program = standin.write(MADE / "program")
    files = [MADE / f"{name}.toml" for name in SWEEPS]
    for file in files:  # three members, however many the profile has
        text = (ROOT / "scenarios/sweeps" / file.name).read_text()
        file.write_text(re.sub(r"(\[profiles.quick\]\n)members = \d", r"\1members = 3", text))
    SAID = script("sweep.py", *files, "--profile", "quick", "--program", program, "--runs", MADE / "runs", "--out", MADE, "--jobs",
                  "0", **{CHAOTIC: "chaos", STEADY: "error", "stack": "silent"})
    script("report.py", "--results", MADE, "--runs", MADE / "runs", "--no-draw")


def class_at(classes, path):
    """The class that stands for a place, or nothing."""
    for key in path:
        if worth.is_class(classes):
            break
        classes = classes[key] if isinstance(classes, list) else classes.get(key)
        if classes is None:
            return None
    return classes if worth.is_class(classes) else None


class Classes(unittest.TestCase):
    def of(self, value, others=(), timed=None, turned=None):
        return worth.worth_of(value, [value, *others], timed or [value], [value if turned is None else turned])

    def test_what_all_members_have_repeats_exactly(self):
        for value in (0.1, 7, "ok", None, True):
            self.assertEqual(self.of(value, [value] * 5), worth.EXACT)

    def test_what_members_have_to_a_billionth_is_rounding_and_beyond_it_a_sample(self):
        self.assertEqual(self.of(2.0, [2.0 * (1 + 0.9e-9)]), worth.ROUNDED)
        self.assertEqual(self.of(2.0, [2.0 * (1 + 1.1e-9)])["sample"], 2)
        # A length of 1e-12 m is as far from 0 as rounding takes a body of size 1 m in a run.
        self.assertEqual(self.of(1e-12, [3e-15]), worth.ROUNDED)
        self.assertEqual(self.of(1e-8, [3e-15])["sample"], 2)

    def test_a_sample_has_its_median_and_spread(self):
        self.assertEqual(self.of(9.0, [1.0, 3.0, 16.0, 4.0]), {"sample": 5, "median": 4.0, "least": 1.0, "most": 16.0})
        self.assertEqual(self.of("solver", ["model", "model"]), {"sample": 3, "words": {"model": 2, "solver": 1}})
        self.assertEqual(self.of(2.0, [None])["numbers"], [2.0])

    def test_what_follows_the_clock_is_a_sample_of_as_many_as_were_timed(self):
        self.assertEqual(self.of(0.5, turned=7.0), {"sample": 1})
        self.assertEqual(self.of(0.5, timed=[0.4, 0.5, 0.9], turned=7.0), {"sample": 3, "median": 0.5, "least": 0.4, "most": 0.9})

    def test_one_clock_of_several_that_says_otherwise_is_enough_and_without_members_nothing_is_known(self):
        self.assertEqual(worth.worth_of(True, [True], [True], [True, True, False]), {"sample": 1})
        self.assertEqual(worth.worth_of(True, [True], [True], [True, True]), worth.EXACT)
        self.assertEqual(worth.worth_of(0.5, [], [0.5], [0.5]), {"sample": 1})

    def test_of_two_times_either_comes_first_by_one_of_two_clocks_and_a_busy_machine_is_an_idle_one_by_the_other(self):
        for pair in range(0, worth.DRAWS, 2):
            a, b = Clock(pair), Clock(pair + 1)
            for word in ("one", "other"):
                self.assertAlmostEqual(a.factor(word) * b.factor(word), 1.0)
            self.assertEqual([c.turned(cell, "") for c in (a, b) for cell in ("true", "false", "False", "")],
                             ["true", "true", "True", "", "false", "false", "False", ""])
        self.assertEqual(len({Clock(draw).factor("word") for draw in range(worth.DRAWS)}), worth.DRAWS)

    def test_infinite_and_missing_numbers_are_no_others(self):
        self.assertFalse(gather.close(math.inf, 1.0))
        self.assertTrue(gather.close(math.inf, math.inf))
        self.assertEqual(worth.worth({"a": math.nan}, [{"a": math.nan}], [], [{"a": math.nan}]), worth.EXACT)

    def test_rows_are_compared_by_what_they_are_about(self):
        tree = [{"run": "a", "error": 1.0}, {"run": "b", "error": 2.0}]
        self.assertEqual(worth.worth(tree, [tree, tree[1:]], [tree], [tree])[1], worth.EXACT)
        self.assertEqual(worth.worth(tree, [tree, tree[1:]], [tree], [tree])[0]["error"]["sample"], 2)

    def test_a_page_shows_a_sample_as_median_and_spread_and_all_else_as_it_is(self):
        shown = worth.carried({"a": 9.0, "b": 0.5, "c": "ok"}, [{"a": 9.0, "b": 0.5, "c": "ok"}, {"a": 1.0, "b": 0.5, "c": "ray"},
                                                                {"a": 4.0, "b": 0.5, "c": "ok"}])
        self.assertEqual(f"{shown['a']:.3g} m", "4 [1 to 9] m")
        self.assertEqual(f"{shown['b']:.3g}", "0.5")
        self.assertEqual(str(shown["c"]), "ok in 2 of 3, ray in 1 of 3")
        self.assertEqual(shown["c"], "ok")
        self.assertEqual(json.dumps([worth.published(v) for v in shown.values()]), '[9.0, 0.5, "ok"]')

    def test_what_is_about_another_run_is_not_compared(self):
        own, other = {"best": {"run": "a", "time": 2.0}}, {"best": {"run": "b", "time": 9.0}}
        self.assertEqual(worth.carried(own, [own, other]), own)
        rows, others = [{"run": "a", "time": 2.0}, {"run": "b", "time": 3.0}], [{"run": "b", "time": 4.0}, {"run": "c", "time": 8.0}]
        shown = worth.carried(rows, [rows, others])
        self.assertEqual((str(shown[0]["time"]), str(shown[1]["time"])), ("2.0", "3.5 [3 to 4]"))

    def test_another_repeat_is_the_same_cell_and_the_same_repeat_comes_first(self):
        tree, slower = ([{"run": f"a__r{n}", "time": time, "repeats": 2}] for n, time in ((2, 2.0), (1, 3.0)))
        self.assertEqual(worth.worth(tree, [tree], [slower, tree], [slower])[0]["repeats"], worth.EXACT)
        self.assertEqual(worth.worth(tree, [tree], [slower, tree], [slower])[0]["time"]["sample"], 2)
        self.assertEqual(worth.child(slower + tree, 0, tree), tree[0])
        self.assertEqual(worth.child([{"run": "b__r2"}], 0, tree), worth.OTHER)

    def test_a_sentence_has_the_range_of_its_numbers_and_how_many_say_something_else(self):
        text = "Of 70 cases by method so and so many are right, which are 62 of them, k = 8."
        shown = worth.carried(text, [text, text.replace("62", "60"), "Something else altogether, which is as long as the other one is."])
        self.assertEqual(str(shown), text.replace("62", "62 [60 to 62]") + " (otherwise in 1 of 3 runs of the ensemble)")
        self.assertEqual(str(worth.carried(worth.Whole(text), ["x"])), text)

    def test_cells_of_stiff_cases_are_compared_with_their_own_whatever_columns_the_others_have(self):
        def suite(number, *methods):
            of_member = " ".join(["", *plan.member_flags(number)])
            table = pandas.DataFrame([{"id": "M1", "scene": "mass_ratio", "row": row, "method": method, "verdict": "right",
                                       "command": f"contactbench run --set {row} --shuffle-contacts 2{of_member}"}
                                      for row in ("ratio=1e-3", "ratio=1e+3") for method in methods])
            return sections.stiff_cases(types.SimpleNamespace(read=lambda _: table, aside=number)).shown

        shown = worth.carried(suite(0, "ode/quick", "convex"), [suite(0, "ode/quick", "convex"), suite(1, "convex")])
        for places in shown["map"].values():
            cell = shown["cells"][places["convex"]]
            self.assertEqual([str(cell[key]) for key in ("id", "method", "verdict")], ["M1", "convex", "right"])
            self.assertEqual(str(cell["command"]), f"contactbench run --set {cell['row']} --shuffle-contacts 2")
            self.assertIn("absent in 1 of 2", str(shown["cells"][places["ode/quick"]]["verdict"]))
        self.assertEqual(len(shown["cells"]), 4)


class Ensemble(unittest.TestCase):
    def setUp(self):
        self.results = Runs(MADE, MADE / "runs")
        self.report = json.loads((MADE / "report.json").read_text())

    def test_only_what_the_first_member_does_not_settle_has_further_ones(self):
        count = {}
        for row in self.results.ensemble:
            count.setdefault(row["scene"], {}).setdefault(row["member"], 0)
            count[row["scene"]][row["member"]] += 1
        self.assertEqual(set(count[CHAOTIC]), set("123"))
        self.assertEqual(len(set(count[CHAOTIC].values())), 1)
        for scene in (STEADY, "sticking_box", "stack"):
            self.assertEqual(set(count[scene]), {"1"}, scene)

    def test_a_member_has_other_last_bits_and_another_order_of_contacts_and_is_not_timed(self):
        row = next(r for r in self.results.ensemble if r["member"] == "3")
        record = json.loads((MADE / "runs" / row["run"] / "run.json").read_text())
        words = " ".join(record["flags"])
        self.assertIn("--perturb 1e-15 --seed 3 --shuffle-contacts 3", words)
        self.assertEqual(row["busy"], "")

    def test_the_published_runs_stand_in_the_table_by_themselves(self):
        self.assertEqual(self.results.table["run"].str.contains(r"__m\d").sum(), 0)
        self.assertEqual(len(self.results.ensemble), json.loads((MADE / "manifest.json").read_text())["members"])

    def test_every_number_of_the_report_has_its_class(self):
        count = {}
        for name, section in self.report["sections"].items():
            for part, classes in (("data", "worth"), ("timing", "worth_of_timing")):
                for path, leaf in standin.leaves(section[part]):
                    found = class_at(section[classes], path)
                    self.assertIsNotNone(found, f"{name}, {part}: {path}")
                    if isinstance(leaf, (int, float)) and not isinstance(leaf, bool):
                        kind = found if isinstance(found, str) else "sample"
                        count[kind] = count.get(kind, 0) + 1
        self.assertIn(worth.EXACT, count)
        self.assertIn("sample", count)
        # The page counts the same.
        page = " ".join((MADE / "report.html").read_text().split())
        self.assertEqual(page.count(f"Of the {sum(count.values())} numbers"), 1)
        self.assertIn("not those of ways of stepping, of motion and of engines, which were made once", page)

    def test_a_number_without_a_class_is_found(self):
        some = {"a": {"b": 1.0, "c": [2.0]}}
        self.assertEqual(class_at({"a": {"b": "exact"}}, ("a", "c", 0)), None)
        self.assertEqual([class_at("exact", path) for path, _ in standin.leaves(some)], ["exact"] * 2)

    def test_errors_that_follow_the_seed_are_samples_and_the_others_are_not(self):
        section = self.report["sections"]["error_time"]
        for number, point in enumerate(section["data"]["points"]):
            found = class_at(section["worth"], ("points", number, "error"))
            if point["scene"] == CHAOTIC:
                self.assertEqual((found["sample"], found["least"], found["most"]), (4, 0.1, 0.4))
            else:
                self.assertEqual(found, worth.EXACT)

    def test_times_are_samples(self):
        section = self.report["sections"]["table_one"]
        for number, row in enumerate(section["timing"]["rows"]):
            if row["median_s"] != "":
                self.assertEqual(class_at(section["worth_of_timing"], ("rows", number, "median_s")), {"sample": 1})

    def test_a_verdict_on_which_the_ensemble_does_not_agree_is_none(self):
        claim = claims.answered("C1", self.results)
        self.assertEqual(set(claim.answers.values()), {claims.DIFFERS})
        self.assertIn("not reproduced 2, reproduced 2", claim.parts[0].why)
        alone = claims.asked("C1", self.results)
        self.assertEqual(alone.parts[0].verdict, claims.NO)

    def test_no_method_is_advised_whose_ensemble_misses_the_error(self):
        points = precision.points(self.results, CHAOTIC, "")
        self.assertEqual({(p["error"], p["worst"]) for p in points}, {(0.1, 0.4)})
        self.assertIsNone(precision.choose(points, 0.3)[0])
        self.assertIsNotNone(precision.choose(points, 0.7)[0])

    def test_what_was_made_once_beside_the_runs_is_a_sample_of_one_but_for_what_was_asked(self):
        table = ("id,scene,row,method,verdict,error,note,command\n"
                 "A1,box,,ap,right,0,,contactbench run a1\nA2,box,,ap,model,2.5,,contactbench run a2\n")
        folder = Path(tempfile.mkdtemp(dir=MADE))
        for file in ("runs.csv", "ensemble.csv", "manifest.json"):
            shutil.copy(MADE / file, folder)
        (folder / "stress").mkdir()
        (folder / "stress/stress.csv").write_text(table)
        once = worth.Worlds(Runs(folder, MADE / "runs")).build(sections.stiff_cases, Runs(folder, MADE / "runs"))
        self.assertEqual(once[1], worth.EXACT)
        self.assertEqual(once[2]["verdicts"]["right"], {"sample": 1})
        # With the same of a member: what it has too stays, what it has not is a sample of two, however many members the runs have.
        (folder / "members/1/stress").mkdir(parents=True)
        (folder / "members/1/stress/stress.csv").write_text(table.replace("right", "model"))
        results = Runs(folder, MADE / "runs")
        twice = worth.Worlds(results).build(sections.stiff_cases, results)
        self.assertEqual(twice[1], worth.EXACT)
        self.assertEqual(twice[2]["verdicts"]["right"], {"sample": 2, "median": 0.5, "least": 0, "most": 1})

    def test_which_of_two_is_faster_and_whether_others_used_the_machine_are_measured(self):
        def section(results):
            cells = results.cells(sweep=None)
            pairs = [(a["run"], a.seconds < b.seconds) for a, b in zip(cells, cells[1:]) if a.times and b.times and a["run"] != b["run"]]
            busy = sum(c.busy for c in cells)
            return sections.Section("", {}, {"error": cells[0].error("final_m")}, {"first": dict(pairs), "busy": busy})

        self.results.table["busy"] = ["true", "false"] * (len(self.results.table) // 2) + ["true"] * (len(self.results.table) % 2)
        _, of_data, of_timing = worth.Worlds(self.results).build(section, self.results)
        self.assertEqual(of_data, worth.EXACT)
        self.assertTrue(worth.is_class(of_timing["busy"]) and of_timing["busy"] not in (worth.EXACT, worth.ROUNDED), of_timing["busy"])
        for name, found in of_timing["first"].items() if not worth.is_class(of_timing["first"]) else [("all", of_timing["first"])]:
            self.assertIn("sample", found, name)

    def test_a_cell_that_never_had_a_member_is_a_sample_of_one_and_what_was_asked_of_it_is_not(self):
        def section(results):
            return sections.Section("", {}, {c.unrepeated: {"step": c["step"], "steps": c["steps"], "error": c.error("position_linf_m"),
                                                       "solves": int(c["solves"] or 0)}
                                             for c in results.cells(STEADY, None)})

        results = Runs(MADE, MADE / "runs")
        own = results.cells(STEADY, None)[0]
        results.ensemble = [row for row in results.ensemble if any(row[c] != own[c] for c in gather.CELL)]
        _, found, _ = worth.Worlds(results).build(section, results)
        self.assertEqual([found[own.unrepeated][key] for key in ("step", "error")], [worth.EXACT, {"sample": 1}])
        self.assertEqual({json.dumps(classes) for run, classes in found.items() if run != own.unrepeated}, {'"exact"'})

    def test_engines_have_no_members_and_their_times_follow_the_clock(self):
        folder = Path(tempfile.mkdtemp(dir=MADE))
        for file in ("runs.csv", "ensemble.csv", "manifest.json"):
            shutil.copy(MADE / file, folder)
        (folder / "engines").mkdir()
        table = pandas.read_csv(MADE / "runs.csv", dtype=str, keep_default_na=False)
        table = table[table["scene"] == STEADY].assign(sweeps="engines")
        table["processing_s"] = [repr(float(t) * float(n)) for t, n in zip(table["processing_s"], table["repeat"])]
        table.to_csv(folder / "engines/runs.csv", index=False)
        results = Runs(folder, MADE / "runs")
        section, of_data, of_timing = worth.Worlds(results).build(sections.engines, results)
        self.assertTrue(section.data["scenes"])
        self.assertEqual(of_data, {"sample": 1})
        some = class_at(of_timing, ("scenes", ))
        self.assertIsNone(some, "one class for all")
        repeats = {c.unrepeated: len(c.times) for c in results.cells(STEADY, None)}
        name = next(iter(section.timing["scenes"]))
        for run, row in section.timing["scenes"][name].items():
            if row["us_a_step"] is not None:
                self.assertEqual(class_at(of_timing, ("scenes", name, run, "us_a_step"))["sample"], repeats[run])
        self.assertEqual(set(repeats.values()), {1, 2})

    def test_without_an_ensemble_nothing_is_known(self):
        shutil.copytree(MADE, MADE / "alone", ignore=shutil.ignore_patterns("ensemble.csv", "alone", "runs"))
        script("report.py", "--results", MADE / "alone", "--runs", MADE / "runs", "--no-draw")
        for section in json.loads((MADE / "alone/report.json").read_text())["sections"].values():
            self.assertIn(section["worth"], ({"sample": 1}, {}))


if __name__ == "__main__":
    unittest.main()
