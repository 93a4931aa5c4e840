"""scripts/contactbench/solve_all.py: every problem of a folder with every solver, what each answer errs by, and the tables
of it. On a program whose answers are made up, each field another number."""
import contextlib
import csv
import io
import json
import math
import tempfile
import types
import unittest
from pathlib import Path
from unittest import mock

from contactbench import program, solve_all
from contactbench.runs import Runs
from folder import Folder

LISTED = {
    "methods": [{"name": "newton", "solvers": [], "variants": ["uncapped", "stick-tested"], "options": []},
                {"name": "ap", "solvers": ["lemke", "path-lib"], "variants": [],
                 "options": [{"flag": "k"}, {"flag": "regularise"}]},
                {"name": "convex", "solvers": ["ipm"], "variants": [], "options": [{"flag": "compression-bound"}]}],
    "solvers": [{"method": method, "name": name, "unavailable": why} for method, name, why in
                (("ap", "lemke", None), ("ap", "path-lib", "why"), (None, "pivots", None), ("convex", "ipm", None))]}

ANSWER = {
    "status": "ok", "reason": None, "size": 12, "contacts": 4, "iterations": 9, "claimed_residual": 1e-15, "residual": 2e-15,
    "law_residual": 3e-3, "gap": 4e-12, "infeasibility": 5e-14, "false_claim": False, "energy_change_j": -2.5, "time_min_s": 6e-6,
    "time_median_s": 7e-6, "notes": ["one", "two"], "weight_max_per_kg": 1.5, "speed_before_m_per_s": 2.0}


def ended(stdout="", stderr="", code=0):
    return types.SimpleNamespace(returncode=code, stdout=stdout, stderr=stderr)


class Asking(unittest.TestCase):
    def ask(self, end):
        with mock.patch.object(program, "call", side_effect=[end]) as call:
            said = solve_all.ask("prog", ["a.dat", "--k", "4"], 7.5)
        self.assertEqual(call.call_args, mock.call("prog", "solve", "--json", "a.dat", "--k", "4", timeout=7.5))
        return said

    def test_what_a_solve_prints_counts_and_else_how_it_ended(self):
        for code in (0, 3):
            self.assertEqual(self.ask(ended('{"status": "ray"}', "noise", code)), {"status": "ray"})
        self.assertEqual(self.ask(ended("{}", "first\nlast\n", 2)), {"status": "input_error", "reason": "last"})
        self.assertEqual(self.ask(ended("{}", "first\nlast\n", -6)), {"status": "crash", "reason": "last"})
        self.assertEqual(self.ask(ended("", "", 0)), {"status": "crash", "reason": "ended without a word"})
        self.assertEqual(self.ask(program.Late("p", 1)), {"status": "time_limit", "reason": "more than 7.5 s"})

    def test_every_solver_has_its_flags_for_linear_problems_and_for_contacts(self):
        lcp, contact = solve_all.choices(LISTED, [4, 8], "1e-9")
        self.assertEqual(lcp, [{"solver": "lemke"}, {"solver": "path-lib"}, {"solver": "pivots"}])
        self.assertEqual(
            contact,
            [{"method": "newton", "variant": "uncapped"}, {"method": "newton", "variant": "stick-tested"},
             *({"method": "ap", "solver": solver, "k": k} for solver in ("lemke", "path-lib")
               for k in (4, 8)), *({"method": "convex", "solver": "ipm", "compression-bound": bound, "epsilon-relative": "1e-9"}
                                   for bound in ("on", "off"))])

    def test_a_folder_s_problems_are_told_by_the_ends_of_their_names(self):
        with tempfile.TemporaryDirectory() as folder:
            top = Path(folder)
            for name in ("d.hdf5", "a.M.mtx", "a.q.mtx", "a.ref.json", "lcp_b.dat", "c.dat", "e.h5", "notes.txt"):
                (top / name).touch()
            found = list(solve_all.problems([top], ""))
            self.assertEqual(found, [("a", "lcp", ["--matrix", str(top / "a.M.mtx"), "--vector",
                                                   str(top / "a.q.mtx")], top / "a.ref.json"),
                                     ("c", "contact", [str(top / "c.dat")], top / "c.ref.json"),
                                     ("d", "contact", [str(top / "d.hdf5")], top / "d.ref.json"),
                                     ("e", "contact", [str(top / "e.h5")], top / "e.ref.json"),
                                     ("lcp_b", "lcp", [str(top / "lcp_b.dat")], top / "lcp_b.ref.json")])
            self.assertEqual([name for name, *_ in solve_all.problems([top], "_b")], ["lcp_b"])
            for name in ("first", "second"):
                (top / name).mkdir()
                (top / name / "p.dat").touch()
            found = solve_all.problems([top / "first", top / "second"], "")
            self.assertEqual([(flags, reference) for _, _, flags, reference in found],
                             [([str(top / name / "p.dat")], top / name / "p.ref.json") for name in ("first", "second")])

    def test_settings_are_the_usual_ones_where_none_is_given(self):
        usual = solve_all.arguments(["--program", "p"])
        root = program.ROOT
        self.assertEqual((usual.folder, usual.out, usual.program),
                         ([root / "test/data/problems", root / "test/data/stacks"], root / "results/solve_all", Path("p")))
        self.assertEqual((usual.k, usual.epsilon_relative, usual.repeat, usual.limit, usual.only), ([4, 8], "1e-12", 5, 60, ""))
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(program, "ROOT", Path(folder)):
            with self.assertRaisesRegex(SystemExit, "no built program below build"):
                solve_all.arguments([])
            for name in ("build/release/bin", "build-b/bin", "build/bin"):
                (Path(folder) / name).mkdir(parents=True)
                (Path(folder) / name / "contactbench").touch()
                self.assertEqual(
                    solve_all.arguments([]).program,
                    Path(folder) / name / "contactbench")


class Judging(unittest.TestCase):
    def judge(self, choice, reference, velocities=(), kind="contact", energy=-2.5, **solved):
        row = {"kind": kind, "energy_change_j": energy}
        solve_all.judge(row, choice, reference, list(velocities), {**ANSWER, **solved})
        return row

    def test_an_energy_is_held_against_the_program_with_or_without_the_bound(self):
        reference = {"KE_before": 50.0, "ds_kappa": {"dKE": -2.0}, "ccp_nocap": {"dKE": -4.0}}
        for bound, answer, error in (("on", -2.0, 0.25), ("off", -4.0, 0.375)):
            row = self.judge({"compression-bound": bound}, reference)
            self.assertEqual((row["reference"], row["reference_error"]), (answer, error))
        # What loses nothing but rounding is measured by the energy that is there.
        row = self.judge({"compression-bound": "on"}, {"KE_before": -50.0, "ds_kappa": {"dKE": 1e-16}}, energy=6e-13)
        self.assertAlmostEqual(row["reference_error"], 6e-13 / 50e-14, delta=1e-3)
        row = self.judge({"compression-bound": "on"}, {"ds_kappa": {"dKE": 0.0}}, energy=0.5)
        self.assertEqual(row["reference_error"], 0.5)

    def test_what_has_no_reference_has_no_error(self):
        reference = {"ds_kappa": {"dKE": -2.0, "u": [1.0]}}
        for choice, of, energy in (({"k": 4}, reference, -2.5), ({"compression-bound": "off"}, reference, -2.5), ({
                "compression-bound": "on"}, None, -2.5), ({"compression-bound": "on"}, reference, None), ({
                    "compression-bound": "on"}, {"ds_kappa": {"dKE": None}}, -2.5)):
            self.assertEqual(set(self.judge(choice, of, [1.0], energy=energy)), {"kind", "energy_change_j"})

    def test_of_a_linear_problem_the_reference_is_how_exact_pivoting_ends(self):
        self.assertEqual(self.judge({"solver": "lemke"}, {"exact_lemke": "ray"}, kind="lcp")["reference"], "ray")
        self.assertEqual(self.judge({"solver": "lemke"}, {"other": 1}, kind="lcp")["reference"], "")

    def test_velocities_err_by_their_worst_over_the_fastest_and_both_gaps_allow_it(self):
        answer = {"dKE": -2.0, "u": [0.5, -3.0, 1.0], "gap": -8e-12}
        for before, velocities, fastest, worst in ((2.0, [0.5, -2.7, 1.1], 3.0, 0.3), (6.0, [0.7, -3.0, 0.9], 6.0, 0.2)):
            row = self.judge({"compression-bound": "on"}, {"ds_kappa": answer}, velocities, speed_before_m_per_s=before)
            self.assertAlmostEqual(row["velocity_error"], worst / fastest, delta=1e-15)
            self.assertAlmostEqual(row["velocity_allowed"], math.sqrt(6 * 1.5 * 12e-12) / fastest, delta=1e-18)
        # Where all rests there is nothing to divide by.
        row = self.judge({"compression-bound": "on"}, {"ds_kappa": answer | {"u": [0.0], "gap": None}}, [0.25],
                         speed_before_m_per_s=0.0)
        self.assertEqual((row["velocity_error"], row["velocity_allowed"]), (0.25, 0))
        row = self.judge({"compression-bound": "on"}, {"ds_kappa": answer}, [])
        self.assertNotIn("velocity_error", row)


class Table(Folder):
    def setUp(self):
        super().setUp()
        self.stored = self.top / "stored"
        self.stored.mkdir()

    def solve(self, *flags):
        """The rows of the table, its page, and what the program was called with."""
        calls = []

        def call(*words, timeout=None):
            calls.append(([str(w) for w in words], timeout))
            if "--velocities" in words and "on" in words:  # without the bound it left none
                Path(words[words.index("--velocities") + 1]).write_text("%%MatrixMarket\n2 1\n1.0\n-2.75\n")
            if "uncapped" in words:
                return ended(json.dumps(ANSWER | {"status": "nonconverged", "reason": "a | b", "iterations": None}), code=3)
            if "lcp" in words:
                plain = {key: value for key, value in ANSWER.items() if key not in ("iterations", "notes")}
                return ended(json.dumps(plain | {"pivots": 31}))
            return ended(json.dumps(ANSWER))

        loads = iter([0.3, 0.2, None] * 9)
        with mock.patch.object(program, "call", call), mock.patch.object(program, "listed", lambda _: LISTED), \
                mock.patch.object(program, "Load", lambda: types.SimpleNamespace(others=lambda _: next(loads))), \
                contextlib.redirect_stdout(io.StringIO()):
            solve_all.main([str(self.stored), "--program", "prog", "--out", str(self.top / "out"), "--quiet", *flags])
        with open(self.top / "out/solve_all.csv", newline="") as file:
            return list(csv.DictReader(file)), (self.top / "out/solve_all.md").read_text(), calls

    def test_every_field_of_an_answer_is_in_its_column(self):
        (self.stored / "a.dat").touch()
        of = {"u": [1.0, -2.5], "gap": 1e-12}
        reference = {"KE_before": 9.0, "ds_kappa": of | {"dKE": -2.0}, "ccp_nocap": of | {"dKE": -5.0}}
        (self.stored / "a.ref.json").write_text(json.dumps(reference))
        (self.stored / "b.M.mtx").touch()
        rows, page, calls = self.solve("--k", "6", "--repeat", "3", "--limit", "11", "--epsilon-relative", "1e-10")
        self.assertEqual(len(rows), 6 + 3)
        bound = rows[4]
        self.assertEqual({c: bound[c] for c in solve_all.COLUMNS if c not in ("velocity_error", "velocity_allowed")}, {
            "problem": "a", "kind": "contact", "method": "convex", "solver": "ipm", "variant": "", "k": "", "epsilon": "1e-10",
            "compression_bound": "on", "size": "12", "contacts": "4", "status": "ok", "reason": "", "iterations": "9",
            "claimed_residual": "1e-15", "residual": "2e-15", "law_residual": "0.003", "gap": "4e-12", "infeasibility": "5e-14",
            "false_claim": "False", "energy_change_j": "-2.5", "reference": "-2.0", "reference_error": "0.25",
            "time_min_s": "6e-06", "time_median_s": "7e-06", "busy": "False", "notes": "one; two"})
        self.assertAlmostEqual(float(bound["velocity_error"]), 0.25 / 2.5)
        self.assertAlmostEqual(float(bound["velocity_allowed"]), math.sqrt(6 * 1.5 * 5e-12) / 2.5)
        # Only what is convex has such velocities, and those of one solve are not another's.
        self.assertEqual(rows[5]["reference_error"], "0.5")
        self.assertEqual([row["velocity_error"] != "" for row in rows], [False] * 4 + [True] + [False] * 4)
        self.assertEqual([row["busy"] for row in rows[:3]], ["True", "False", ""])
        self.assertEqual([(row["variant"], row["k"], row["solver"]) for row in rows[:4]], [("uncapped", "", ""),
                                                                                           ("stick-tested", "", ""),
                                                                                           ("", "6", "lemke"),
                                                                                           ("", "6", "path-lib")])
        self.assertEqual([(row["problem"], row["kind"], row["solver"], row["iterations"], row["notes"]) for row in rows[6:]],
                         [("b", "lcp", solver, "31", "") for solver in ("lemke", "path-lib", "pivots")])
        words, timeout = calls[2]
        self.assertEqual((words, timeout), ([
            "prog", "solve", "--json",
            str(self.stored / "a.dat"), "--kind", "contact", "--repeat", "3", "--method", "ap", "--solver", "lemke", "--k", "6"
        ], 11))
        self.assertEqual([words[words.index("--epsilon-relative") + 1] for words, _ in calls if "convex" in words], ["1e-10"] * 2)
        self.assertIn("| a | newton uncapped | nonconverged |  | a / b |", page)

    def test_the_page_counts_by_solver_and_shows_the_worst_of_those_that_ended_ok(self):
        def row(problem, status="ok", claim="False", **more):
            return {
                **dict.fromkeys(solve_all.COLUMNS, ""), "problem": problem, "kind": "contact", "method": "convex",
                "solver": "ipm", "compression_bound": "on", "status": status, "false_claim": claim, **more}

        rows = [
            row("a", residual="3e-9", law_residual="1e-3", reference_error="0.02", velocity_error="0.25", velocity_allowed="0.01",
                time_median_s="1e-5", busy="True"),
            row("b", residual="1e-9", law_residual="4e-3", reference_error="0.07", velocity_error="0.5", velocity_allowed="0.002",
                time_median_s="4e-5"),
            row("c", residual="2e-9", law_residual="2e-3", time_median_s="2e-5", busy="False"),
            row("d", "ray", "True", residual="9", reference_error="9", velocity_error="9", velocity_allowed="9",
                time_median_s="9"),
            row("e", "inaccurate", "True", reason="why"),
            row("f", "ray", reason="x|y", reference="ok"),
            row("g", method="", solver="lemke", k="", compression_bound="", kind="lcp")]
        page = solve_all.markdown(rows)
        self.assertIn("| convex ipm bound on | 6 | 3 | inaccurate 1, ray 2 | 2 | 3e-09 | 0.07 | 0.5 | 0.002 | 20 |\n", page)
        self.assertIn("| LCP lemke | 1 | 1 |  | 0 |  |  |  |  |  |\n", page)
        self.assertIn("| e | convex ipm bound on | inaccurate |  | why |\n| f | convex ipm bound on | ray | ok | x/y |\n", page)
        self.assertNotIn("| a |", page)
        counts = solve_all.summary(rows)["contact", "convex ipm bound on"]
        self.assertEqual(
            counts, {"problems": 6, "ok": 3, "false_claims": 2, "busy": 1, "residual": 3e-9, "law_residual": 2e-3, "time": 2e-5})

    def test_a_folder_that_is_not_there_or_has_no_problem_is_refused(self):
        with self.assertRaises(SystemExit) as refused:
            self.solve()
        self.assertIn("no problems found", str(refused.exception))
        self.stored.rmdir()
        with self.assertRaises(SystemExit) as refused:
            self.solve()
        self.assertIn("stored: no such folder", str(refused.exception))
        self.assertFalse((self.top / "out").exists())

    def test_a_solver_is_named_by_all_that_tells_it_from_others(self):
        row = {"method": "ap", "solver": "lemke", "variant": "", "k": "8", "compression_bound": ""}
        self.assertEqual(solve_all.solver(row), "ap lemke k = 8")
        self.assertEqual(solve_all.solver(row | {"method": "soft", "solver": "", "variant": "sap", "k": ""}), "soft sap")
        self.assertEqual(solve_all.solver(row | {"method": "convex", "solver": "ipm", "k": "", "compression_bound": "off"}),
                         "convex ipm bound off")

    def test_what_is_not_installed_has_no_place_among_the_solves(self):
        (self.top / "solve_all").mkdir()
        (self.top / "runs.csv").write_text("run\n")
        (self.top / "solve_all/solve_all.csv").write_text("problem,status\na,ok\nb,unavailable\nc,ray\n")
        results = Runs(self.top, self.top)
        self.assertEqual([row["problem"] for row in solve_all.rows_of(results)], ["a", "c"])
        self.assertEqual(solve_all.rows_of(results, "replay/none"), [])


if __name__ == "__main__":
    unittest.main()
