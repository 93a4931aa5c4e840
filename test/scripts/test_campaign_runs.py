"""The campaign of random scenes: what is made of a run and the look at it, what is kept of one that fails, and the tables.
On runs that are made up; test_campaign.py has the scenes and the look itself."""
import contextlib
import csv
import io
import itertools
import json
import types
import unittest
from unittest import mock

from contactbench import campaign, look, program, reduce, scenes
from folder import Folder

FAMILY, OTHER = list(scenes.FAMILIES)[:2]
TAME, WILD = scenes.KINDS
SUMMARY = {"residuals": {"max": 2e-13, "false_claims": 0}, "versions": {"git": "12ab"}, "t_reached": 0.25, "events": 31}


class Looking(unittest.TestCase):
    def examine(self, status="ok", reason="", hung=False, took=1.0, faults=(), method="ap/lemke", summary=None, claims=0):
        asked = []

        def watched(*words):
            asked.append(words)
            made = SUMMARY | {"residuals": SUMMARY["residuals"] | {"false_claims": claims}}
            return status, reason, hung, made if summary is None else summary

        seen = look.Look()
        seen.faults = list(faults)
        seen.penetration, seen.penetration_relative, seen.where = 1e-7, 2e-7, "b1 p1 at 0.1 s"
        seen.energy_gain, seen.event_gain, seen.momentum = 3e-12, 4e-12, 0.5
        job = {"program": "p", "flags": ["--method", "x"], "statuses": ["ok"], "time_limit": 4.0, "method": method}
        with mock.patch.object(program, "watched", watched), \
                mock.patch.object(look, "look", lambda *of: asked.append(of) or seen), \
                mock.patch.object(campaign.time, "monotonic", side_effect=[100.0, 100.0 + took]):
            row, found = campaign.examine(job, "scene.xml", "model", "folder")
        self.asked, self.found = asked, found
        return row

    def test_each_number_of_the_look_and_of_the_run_is_in_its_column(self):
        self.assertEqual(
            self.examine(took=1.2346), {
                "status": "ok", "reason": "", "faults": [], "departures": [], "false_claims": 0, "run_s": 1.235,
                "penetration_m": 1e-7, "penetration_of_size": 2e-7, "where": "b1 p1 at 0.1 s", "energy_gain": 3e-12,
                "event_energy_gain": 4e-12, "momentum_of_bound": 0.5, "residual": 2e-13, "git": "12ab", "t_reached": 0.25,
                "events": 31, "verdict": "ok"})
        self.assertEqual(self.asked, [("p", "scene.xml", ["--method", "x", "--time-limit", "4"], "folder", ["ok"], 11.0, 2000),
                                      ("folder", "model", SUMMARY)])
        self.assertEqual(self.found, SUMMARY)

    def verdict(self, **of):
        row = self.examine(**of)
        return row["verdict"], row["faults"], row["departures"]

    def test_what_the_look_finds_is_a_defect_of_a_run_that_says_ok(self):
        self.assertEqual(self.verdict(faults=["energy: x", "limits: y"]), ("defect", ["energy: x", "limits: y"], []))
        # What says that it failed may have left anything but damaged files.
        self.assertEqual(self.verdict(status="ray", faults=["energy: x", "files: z"]), ("defect", ["files: z"], []))
        self.assertEqual(self.verdict(status="ray", faults=["energy: x"], claims=3), ("typed", [], []))
        self.assertEqual(self.verdict(status="inaccurate"), ("typed", [], []))
        self.assertEqual(self.verdict(claims=3), ("defect", ["claims: 3 claims of success were refuted"], []))

    def test_what_a_method_s_own_law_allows_is_no_defect(self):
        self.assertEqual(self.verdict(method="newton/uncapped", faults=["energy: x"]), ("model", [], ["energy: x"]))
        self.assertEqual(self.verdict(method="newton/stick-tested", faults=["energy: x"])[0], "defect")
        self.assertEqual(self.verdict(method="soft/sap", faults=["limits: x", "energy: y"]),
                         ("defect", ["energy: y"], ["limits: x"]))
        self.assertEqual(self.verdict(method="soft/mujoco", faults=["limits: x"])[0], "model")

    def test_a_crash_a_hang_and_a_late_return_are_defects_whatever_was_said(self):
        self.assertEqual(self.verdict(status="crash", reason="SIGSEGV", summary={}), ("defect", ["crash: SIGSEGV"], []))
        self.assertEqual(
            self.verdict(status="input_error", reason="x" * 300, summary={})[1], [("input_error: " + "x" * 300)[:200]])
        self.assertEqual(self.verdict(status="time_limit", hung=True, took=30, summary={})[1], ["hang: stopped from outside"])
        self.assertEqual(self.verdict(status="time_limit", took=6.3, summary={})[1], ["late: came back 2.3 s after its limit"])
        self.assertEqual(self.verdict(status="time_limit", took=5.9, summary={}), ("typed", [], []))

    def test_a_label_is_the_kind_of_the_first_fault_or_the_status(self):
        self.assertEqual(campaign.label({"faults": ["energy: a: b", "limits: c"], "status": "ok"}), "energy")
        self.assertEqual(campaign.label({"faults": [], "status": "ray"}), "ray")


class Keeping(Folder):
    def job(self, **more):
        scene = self.top / "scenes/r1_7.xml"
        scene.parent.mkdir(exist_ok=True)
        scene.write_text("the scene")
        (self.top / "scenes/r1_7.urdf").write_text("the robot")
        return {
            "path": str(scene), "files": ["r1_7.urdf"], "scene": "r1_7",
            "family": FAMILY, "kind": WILD, "method": "ap/lemke", "prune": "off", "key": "k", "flags": [
                "--method", "ap", "--prune", "off"], "failing": str(self.top / "failing"), "program": "prog"} | more

    row = {"status": "ray", "reason": "no way on", "faults": ["late: x", "files: y"], "command": "contactbench run r1_7.xml"}

    def test_a_failing_run_is_kept_with_its_scene_its_problem_and_its_commands(self):
        run = self.top / "run"
        run.mkdir()
        (run / "hard.hdf5").write_text("the problem")
        summary = {"hard_problem": "hard.hdf5", "hard_problem_command": f"contactbench solve {run}/hard.hdf5 --k 4"}
        place = self.top / "failing/r1_7__ap-lemke__prune-off"
        for solved, again in ((False, "yes"), (True, "no")):
            with mock.patch.object(campaign, "solves", return_value=solved) as asked:
                self.assertEqual(campaign.keep(self.job(), self.row, run, summary), again)
            self.assertEqual(asked.call_args.args, ("prog", "contactbench solve hard.hdf5 --k 4", place))
            self.assertEqual({path.name: path.read_text() for path in place.iterdir()}, {
                "r1_7.xml": "the scene", "r1_7.urdf": "the robot", "hard.hdf5": "the problem",
                "how.txt": "ray: no way on\nlate: x\nfiles: y\ncontactbench run r1_7.xml\ncontactbench solve hard.hdf5 --k 4\n"})
            campaign.shutil.rmtree(place)
        for summary in (None, {}, {"hard_problem": "gone.hdf5", "hard_problem_command": "x"}, {"hard_problem": "hard.hdf5"}):
            self.assertEqual(campaign.keep(self.job(), self.row, run, summary), "")
            self.assertEqual((place / "hard.hdf5").exists(), summary == {"hard_problem": "hard.hdf5"})
            self.assertTrue((place / "how.txt").read_text().endswith("contactbench run r1_7.xml\n"))
            campaign.shutil.rmtree(place)

    def test_a_kept_problem_is_solved_where_the_program_says_ok(self):
        (self.top / "hard.hdf5").touch()
        for code, stdout, solved in ((0, "  kind  contact\n  status   ok\n", True), (3, "  status   ok\n", False),
                                     (0, "  status   okay\n", False), (0, "  status   ray\n", False), (0, "nothing", False)):
            ended = types.SimpleNamespace(returncode=code, stdout=stdout)
            with mock.patch.object(program, "call", return_value=ended) as call:
                self.assertEqual(campaign.solves("prog", "contactbench solve hard.hdf5 --why 'a b'", self.top), solved, stdout)
            self.assertEqual(call.call_args, mock.call("prog", "solve", self.top / "hard.hdf5", "--why", "a b", timeout=60))
        with mock.patch.object(program, "call", side_effect=program.Late("p", 1)):
            self.assertFalse(campaign.solves("prog", "contactbench solve hard.hdf5", self.top))

    def test_a_row_says_what_was_run_and_only_what_fails_is_kept(self):
        for verdict, kept in (("ok", ""), ("model", ""), ("typed", "yes"), ("defect", "yes")):
            row = self.row | {"verdict": verdict}
            if verdict != "model":  # of a run that never failed nothing is there
                (self.top / "failing/r1_7__ap-lemke__prune-off/old").mkdir(parents=True)
            with mock.patch.object(campaign, "examine", lambda *_: (dict(row), SUMMARY)), \
                    mock.patch.object(look, "Model", lambda path: path), \
                    mock.patch.object(campaign, "keep", lambda *_: "yes"):
                made = campaign.do(self.job())
            self.assertEqual(
                made, row | {
                    "scene": "r1_7", "family": FAMILY, "kind": WILD, "method": "ap/lemke", "prune": "off", "key": "k",
                    "command": "contactbench run r1_7.xml --method ap --prune off", "again": kept})
            self.assertFalse((self.top / "failing/r1_7__ap-lemke__prune-off").exists())

    def test_every_method_runs_on_every_scene_with_and_without_pruning(self):
        (self.top / "prog").write_text("program")
        options = types.SimpleNamespace(program=str(self.top / "prog"), out=self.top, prune=None, method=[], time_limit=9.0)
        some = [scenes.make(1, n) for n in range(2)]

        def jobs(**more):
            with mock.patch.object(program, "listed", lambda _: {"statuses": [{"name": "ok"}]}):
                return list(campaign.jobs_of(some, types.SimpleNamespace(**vars(options) | more)))

        all_jobs = jobs()
        self.assertEqual([(j["scene"], j["method"], j["prune"]) for j in all_jobs], [(scene.name, m, p) for scene in some
                                                                                     for m in campaign.METHODS
                                                                                     for p in ("on", "off")])
        job = all_jobs[3]
        self.assertEqual({k: v for k, v in job.items() if k != "key"}, {
            "scene": "r1_0", "family": some[0].family, "kind": some[0].kind, "method": "ap/path", "prune": "off", "path": str(
                self.top / "scenes/r1_0.xml"), "files": list(some[0].files), "flags": [
                    "--method", "ap", "--solver", "path", "--prune", "off"], "program": str(self.top / "prog"), "time_limit": 9.0,
            "statuses": ["ok"], "failing": str(self.top / "failing")})
        self.assertEqual((self.top / "scenes/r1_0.xml").read_text(), some[0].xml())
        one = jobs(prune=["off"], method=["ap/path"])
        self.assertEqual([(j["scene"], j["key"]) for j in one], [("r1_0", job["key"]),
                                                                 ("r1_1", all_jobs[3 + 2 * len(campaign.METHODS)]["key"])])
        # Another run is another key: of each method, scene, way to prune, limit and program.
        keys = {j["key"] for j in [*all_jobs, *jobs(time_limit=8.0)]}
        self.assertEqual(len(keys), 2 * len(all_jobs))
        (self.top / "prog").write_text("another")
        self.assertEqual(len(keys | {j["key"] for j in jobs()}), 3 * len(all_jobs))
        # So are those of a scene whose robot is another, and all of them by another look.
        before = {j["key"] for j in jobs()}
        some[1].files["arm.urdf"] = "another robot"
        self.assertEqual(len(before & {j["key"] for j in jobs()}), len(all_jobs) // 2)
        (self.top / "look.py").write_text("another look")
        with mock.patch.object(look, "__file__", str(self.top / "look.py")):
            self.assertEqual(before & {j["key"] for j in jobs()}, set())
        flags = {name: " ".join(flags) for name, flags in campaign.METHODS.items()}
        self.assertEqual({name for name, words in flags.items() if not words.startswith(f"--method {name.split('/')[0]}")}, set())
        self.assertEqual(len(set(flags.values())), len(flags))


def row(scene="r1_0", method="ap/lemke", prune="on", status="ok", verdict="ok", family=FAMILY, kind=TAME, **more):
    return {
        "scene": scene, "family": family, "kind": kind, "method": method, "prune": prune, "status": status, "verdict": verdict,
        "faults": [], "departures": [], "again": "", "where": "somewhere", "reason": ""} | more


class Tables(Folder):
    manifest = {"command": "the command", "runs": 9, "git": "12ab"}

    def test_runs_that_were_written_whole_are_known(self):
        (self.top / "runs").write_text('{"key": "a", "n": 1}\n{"n": 2}\n{"key": "b", "n": 3}\n{"key": "a", "n": 4}\n{"key": "c"')
        self.assertEqual({key: of["n"] for key, of in campaign.finished(self.top / "runs").items()}, {"a": 4, "b": 3})
        self.assertEqual(campaign.finished(self.top / "none"), {})

    def test_pruning_may_change_no_end_but_that_of_a_limit_of_time(self):
        for on, off, differ in (("ok", "ray", True), ("ray", "inaccurate", True), ("ok", "ok", False),
                                ("time_limit", "ok", False), ("ok", "time_limit", False)):
            rows = [
                row(status=on, faults=["energy: x"]),
                row(status=off, prune="off"),
                row("r1_1", status="crash"),
                row(method="mirtich", status="crash")]
            campaign.disagreements(rows)
            said = [f"pruning: {on} with it, {off} without"] * differ
            self.assertEqual([r["faults"] for r in rows], [["energy: x", *said], said, [], []])
            self.assertEqual([r["verdict"] for r in rows[:2]], ["defect" if differ else "ok"] * 2)

    def lines(self, *rows, **manifest):
        return campaign.page(list(rows), self.manifest | manifest).split("\n")

    def test_shares_are_of_each_family_and_kind_and_method(self):
        rows = [
            row(),
            row(prune="off", status="ray", verdict="typed"),
            row(method="mirtich"),
            row("r1_1", family=OTHER, kind=WILD, method="mirtich"),
            row("r1_2", kind=WILD, method="mirtich", status="ray", verdict="typed")]
        page = self.lines(*rows)
        at = next(n for n, line in enumerate(page) if line.startswith("| family "))
        self.assertEqual(page[at], "| family | kind | ap/lemke | mirtich |")
        self.assertEqual(page[at + 2:at + 7], [
            f"| {FAMILY} | {TAME} | 1/2 | 1/1 |", f"| {FAMILY} | {WILD} |  | 0/1 |", f"| {OTHER} | {WILD} |  | 1/1 |",
            f"| all | {TAME} | 1/2 | 1/1 |", f"| all | {WILD} |  | 1/2 |"])
        self.assertIn("3 scenes, 5 runs of 9 (interrupted) of contactbench 12ab", page[2])
        self.assertNotIn("interrupted", self.lines(*rows, runs=5)[2])

    def test_ends_defects_and_departures_are_counted_by_method(self):
        rows = [
            row(faults=["energy: a", "energy: b", "limits: c"], verdict="defect"),
            row(faults=["energy: d"], verdict="defect", status="ray"),
            row(method="soft/sap", departures=["limits: e"], verdict="model"),
            row("r1_1", "soft/sap", departures=["limits: f"], verdict="model"),
            row(method="soft/mujoco", status="time_limit", verdict="typed", again="no"),
            row(status="ray", verdict="typed", again="yes"),
            row(status="ray", verdict="defect", faults=["late: x"], again="yes")]
        page = self.lines(*rows)
        at = next(n for n, line in enumerate(page) if line.startswith("| how runs end "))
        self.assertEqual(page[at], "| how runs end | ap/lemke | soft/sap | soft/mujoco |")
        self.assertEqual(set(page[at + 2:at + 5]), {"| ok | 1 | 2 | 0 |", "| ray | 3 | 0 | 0 |", "| time_limit | 0 | 0 | 1 |"})
        at = next(n for n, line in enumerate(page) if line.startswith("| defects "))
        # A run of two faults of a kind is one of that kind.
        self.assertEqual(page[at + 2:at + 5], ["| energy | 2 | 0 | 0 |", "| limits | 1 | 0 | 0 |", "| late | 1 | 0 | 0 |"])
        said = [line for line in page if line.startswith("No defect")]
        self.assertEqual(said,
                         [f"No defect of the program: limits of `soft/sap` in 2 runs, because {campaign.GIVES_WAY['limits']}."])
        # Of kept problems those of typed ends count.
        self.assertIn("Of 2 kept problems 1 fail again by the command that is kept with them.", page)
        self.assertIn("| none | 0 |", self.lines(row()))

    def test_which_scenes_fail_how_is_listed_by_method(self):
        rows = [
            row("r1_5", "mirtich", status="ray", verdict="typed"),
            row("r1_3", faults=["energy: a", "late: b"], verdict="defect"),
            row("r1_4", family=OTHER, faults=["energy: a"], verdict="defect"),
            row("r1_3", prune="off", faults=["energy: a"], verdict="defect"),
            row("r1_6", "soft/sap", verdict="model", departures=["limits: x"])]
        wanted = [("ap/lemke", "energy", f"r1_3 ({FAMILY}), r1_4 ({OTHER})"), ("ap/lemke", "late", f"r1_3 ({FAMILY})"),
                  ("mirtich", "*ray*", f"r1_5 ({FAMILY})")]
        self.assertEqual(campaign.listing(rows, ["ap/lemke", "mirtich", "soft/sap"]), wanted)
        self.assertIn(f"| mirtich | *ray* | r1_5 ({FAMILY}) |", self.lines(*rows))

    def test_the_deepest_is_that_by_size_of_runs_that_end_ok(self):
        rows = [
            row("r1_1", penetration_of_size=1e-7, penetration_m=9.0),
            row("r1_2", penetration_of_size=3e-7, penetration_m=0.125),
            row("r1_3", penetration_of_size=2e-7, penetration_m=9.0),
            row("r1_4", status="inaccurate", penetration_of_size=9.0, penetration_m=9.0),
            row("r1_5", penetration_of_size=None)]
        self.assertIn("Deepest penetration with `ok`: 3e-07 of the size, 0.125 m (r1_2, ap/lemke, somewhere).", self.lines(*rows))

    def test_a_table_has_a_column_of_each_number(self):
        of = {column: f"<{column}>" for column in campaign.COLUMNS} | {
            "faults": ["a: b", "c: d"], "departures": ["e: f", "g: h"], "more": 1, "scene": "r1_0", "family": FAMILY,
            "kind": TAME, "method": "mirtich"}
        of |= {"penetration_of_size": 0.0, "penetration_m": 0.0, "verdict": "ok", "status": "ok"}
        campaign.write_tables([of], self.top, self.manifest)
        with open(self.top / "random.csv", newline="") as file:
            (made, ) = csv.DictReader(file)
        self.assertEqual(made, {c: str(of[c]) for c in campaign.COLUMNS} | {"faults": "a: b; c: d", "departures": "e: f; g: h"})
        self.assertTrue((self.top / "random.md").exists())

    def main(self, *verdicts, reduces=False, left=0, **more):
        """Exit code, what was said, the manifest of the table, and the rows that were reduced."""
        options = types.SimpleNamespace(
            **{
                "first": 0, "random": len(verdicts) + left, "seed": 5, "shapes": False, "family": None, "kind": None,
                "write_scenes": None, "method": [], "prune": None, "time_limit": None, "out": self.top /
                "out", "jobs": 1, "reduce": reduces, "program": "p"} | more)

        def jobs_of(some, _):
            return [{"key": scene.name} for scene in some]

        def run_all(todo, known, record, count):
            for job, verdict in itertools.islice(zip(todo, verdicts), len(verdicts)):
                if verdict is not None:  # it was interrupted
                    known[job["key"]] = row(job["key"], verdict=verdict, git="34cd")

        tables, reduced = [], []
        with mock.patch.object(campaign, "jobs_of", jobs_of), mock.patch.object(campaign, "run_all", run_all), \
                mock.patch.object(campaign, "write_tables", lambda *of: tables.append(of)), \
                mock.patch.object(campaign, "reduce_all", lambda *of: reduced.append(of)), \
                contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(io.StringIO()):
            code = campaign.main(options)
        return code, said.getvalue(), tables, reduced, options

    def test_a_campaign_ends_bad_with_a_defect_and_unfinished_with_runs_that_are_left(self):
        code, said, ((rows, out, manifest), ), reduced, options = self.main("ok", "model", "typed", "ok", "defect", reduces=True)
        self.assertEqual((code, said), (3, f"5 runs: 2 ok, 1 as their law allows, 1 typed, 1 defects; {out}/random.md\n"))
        self.assertEqual(manifest, {"git": "34cd", "command": "scripts/stress.py --random 5 --seed 5", "runs": 5})
        self.assertEqual([r["scene"] for r in rows], [f"r5_{n}" for n in range(5)])
        (pairs, where), = reduced
        self.assertEqual((options.time_limit, [row for row, _ in pairs], where), (10.0, rows, self.top / "out"))
        self.assertEqual([job["key"] for _, job in pairs], [f"r5_{n}" for n in range(5)])
        self.assertEqual(self.main("ok", "typed", "model")[0], 0)
        code, _, ((_, _, manifest), ), reduced, options = self.main("defect", left=1, first=2, time_limit=3.0)
        self.assertEqual((code, manifest["runs"], manifest["command"], reduced, options.time_limit),
                         (1, 2, "scripts/stress.py --random 2 --seed 5 --first 2 --time-limit 3", [], 3.0))
        (_, _, manifest), = self.main("ok", shapes=True)[2]
        self.assertEqual(manifest["command"], "scripts/stress.py --random 1 --seed 5 --shapes")
        # All that says which runs there are; as reproduce.sh asks for in the quick profile, and some more.
        (_, _, manifest), = self.main("ok", "ok", method=["mirtich", "ap/lemke"], prune=["on"], family=[FAMILY], kind=TAME,
                                      time_limit=5.0)[2]
        self.assertEqual(manifest["command"], f"scripts/stress.py --random 2 --seed 5 --family {FAMILY} --method mirtich "
                         f"--method ap/lemke --prune on --kind {TAME} --time-limit 5")

    def test_scenes_none_of_which_is_of_the_family_are_named(self):
        options = types.SimpleNamespace(first=3, random=2, seed=5, shapes=False, family=["none"], kind=None)
        with contextlib.redirect_stderr(io.StringIO()) as said:
            self.assertEqual(campaign.main(options), 2)
        self.assertEqual(said.getvalue().partition(" is of")[0], "none of the scenes 3 to 4")

    def test_after_an_interruption_a_defect_is_reduced_as_its_own_run(self):
        code, _, _, ((pairs, _), ), _ = self.main("ok", None, "defect", reduces=True)
        self.assertEqual((code, [(row["scene"], job["key"]) for row, job in pairs]), (1, [("r5_0", "r5_0"), ("r5_2", "r5_2")]))

    def test_scenes_of_a_family_or_a_kind_alone_are_run_or_written(self):
        count = len(scenes.FAMILIES)
        rows = self.main(*["ok"] * 2 * count, family=[FAMILY])[2][0][0]
        self.assertEqual([scenes.make(5, int(r["scene"].split("_")[1])).family for r in rows], [FAMILY] * 2)
        rows = self.main(*["ok"] * 4, kind=WILD)[2][0][0]
        self.assertEqual([r["scene"] for r in rows], ["r5_1", "r5_3"])
        # What is of another collection, or of none of so few, is said, and stands for no table that is there.
        for more in ({"family": list(scenes.SHAPES)[:1]}, {"family": [list(scenes.FAMILIES)[-1]]}):
            code, _, tables, *_ = self.main("ok", "ok", **more)
            self.assertEqual((code, tables), (2, []), more)
        code, said, tables, *_ = self.main(*["ok"] * 2, first=3, write_scenes=self.top / "written")
        self.assertEqual((code, tables), (0, []))
        self.assertEqual(said.splitlines(), [str(self.top / f"written/r5_{n}.xml") for n in (3, 4)])


class Running(Folder):
    """Many runs at a time; here by threads."""
    def run_all(self, rows, known=None):
        """What is known after these, what was written, and what was said."""
        known = {} if known is None else known
        record = self.top / "runs.jsonl"
        record.write_text("before\n")
        rows = {r["key"]: r for r in rows}

        def do(job):
            if rows[job]["verdict"] is None:
                raise KeyboardInterrupt
            return rows[job]

        pool = lambda count, initializer: campaign.concurrent.futures.ThreadPoolExecutor(1)
        clock = itertools.count(0, 10)
        with mock.patch.object(campaign, "do", do), mock.patch.object(campaign.concurrent.futures, "ProcessPoolExecutor", pool), \
                mock.patch.object(campaign.time, "monotonic", lambda: next(clock)), \
                contextlib.redirect_stdout(io.StringIO()) as out, \
                contextlib.redirect_stderr(io.StringIO()) as errors:
            campaign.run_all(list(rows), known, record, 1)
        return known, record.read_text().splitlines(), out.getvalue(), errors.getvalue()

    def test_each_run_is_a_line_at_once_and_a_defect_is_printed(self):
        rows = [
            row("r1_0", key="a"),
            row("r1_1", "mirtich", "off", "crash", "defect", OTHER, WILD, key="b", faults=["crash: x", "late: y"])]
        known, lines, out, errors = self.run_all(rows, {"z": 1})
        self.assertEqual(known, {"z": 1, "a": rows[0], "b": rows[1]})
        self.assertEqual((lines[0], [json.loads(line) for line in lines[1:]]), ("before", rows))
        self.assertEqual((out, errors), (f"r1_1 {OTHER} {WILD} mirtich prune off: crash; crash: x; late: y\n", ""))

    def test_an_interruption_leaves_what_is_finished_and_says_how_it_goes_on(self):
        rows = [row("r1_0", key="a"), row("r1_1", key="b", verdict=None), row("r1_2", key="c")]
        known, lines, _, errors = self.run_all(rows)
        self.assertEqual((known, lines[0], [json.loads(line) for line in lines[1:]]), ({"a": rows[0]}, "before", rows[:1]))
        self.assertEqual(errors, "interrupted; the same command goes on\n")

    def test_how_long_the_rest_takes_is_said_every_fifty_runs(self):
        *_, errors = self.run_all([row(f"r1_{n}", key=str(n)) for n in range(120)])
        self.assertEqual(errors, "50 of 120, 14 s left\n100 of 120, 4 s left\n")


class Reducing(Folder):
    def test_the_first_of_each_end_family_and_method_is_reduced_to_what_still_ends_so(self):
        rows = [
            row("r1_0"),
            row("r1_1", verdict="defect", faults=["energy: a"]),
            row("r1_2", verdict="defect", faults=["energy: b"]),
            row("r1_3", verdict="typed", status="ray"),
            row("r1_4", "mirtich", verdict="typed", status="ray"),
            row("r1_5", family=OTHER, verdict="typed", status="ray"),
            row("r1_6", verdict="typed", status="time_limit"),
            row("r1_7", verdict="model", departures=["limits: x"]),
            row("r1_8", verdict="defect", faults=["pruning: x"])]
        jobs = [{"path": f"/s/{r['scene']}.xml", "n": n} for n, r in enumerate(rows)]
        done, answers = [], {}

        def smaller(path, target, same):
            done.append((path.name, target))
            answers[path.stem] = same(path)
            return target

        said = {"penetrates": 0.0, "row": None, "fails": False}

        def model(path):
            if said["fails"]:
                raise ValueError
            return path

        examined = []

        def examine(job, path, *_):
            examined.append((job["n"], path.name))
            return said["row"], None

        for penetrates, of, fails, wanted in ((0.5e-9, row(status="ray"), False, {
                "r1_1": False, "r1_3": True, "r1_4": True, "r1_5": True}), (0.0, row(faults=["energy: other"]), False, {
                    "r1_1": True, "r1_3": False, "r1_4": False,
                    "r1_5": False}), (2e-9, row(status="ray"), False, dict.fromkeys(
                        ("r1_1", "r1_3", "r1_4", "r1_5"),
                        False)), (0.5e-9, row(status="ray"), True, dict.fromkeys(("r1_1", "r1_3", "r1_4", "r1_5"), False))):
            said |= {"penetrates": penetrates, "row": of, "fails": fails}
            done.clear()
            with mock.patch.object(reduce, "reduce", smaller), mock.patch.object(look, "Model", model), \
                    mock.patch.object(look, "initial_penetration", lambda _: said["penetrates"]), \
                    mock.patch.object(campaign, "examine", examine), \
                    contextlib.redirect_stdout(io.StringIO()):
                campaign.reduce_all(list(zip(rows, jobs)), self.top)
            self.assertEqual(answers, wanted)
        names = ("r1_1__ap-lemke__energy", "r1_3__ap-lemke__ray", "r1_4__mirtich__ray", "r1_5__ap-lemke__ray")
        self.assertEqual(done, [(f"{name.split('__')[0]}.xml", self.top / f"reduced/{name}.xml") for name in names])
        self.assertEqual(examined[:4], [(1, "r1_1.xml"), (3, "r1_3.xml"), (4, "r1_4.xml"), (5, "r1_5.xml")])


if __name__ == "__main__":
    unittest.main()
