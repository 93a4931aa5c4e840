"""The measurements that bench/ makes in Python (small.py, overhead.py): what a time is divided by and less by, which run counts,
and what the tables say. On programs that are made up."""
import ast
import collections
import contextlib
import importlib.util
import io
import json
import sys
import types
import unittest
from pathlib import Path
from unittest import mock

BENCH = Path(__file__).resolve().parents[2] / "bench"


def module_of(name):
    spec = importlib.util.spec_from_file_location(f"bench_{name}", BENCH / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


small, overhead = module_of("small"), module_of("overhead")


def program(summary, returncode=0, stderr="", asked=None):
    """A stand-in for subprocess.run that leaves such a summary, or none."""
    def run(words, **more):
        if asked is not None:
            asked.append((words, more))
        if summary is not None:
            (Path(words[words.index("--out") + 1]) / "summary.json").write_text(json.dumps(summary))
        return types.SimpleNamespace(returncode=returncode, stderr=stderr, stdout="")

    return mock.patch("subprocess.run", run)


class Flags(unittest.TestCase):
    def test_a_flag_whose_default_is_a_number_takes_numbers(self):
        seen, wrong = 0, []
        for path in [*BENCH.glob("*.py"), *(BENCH.parent / "scripts").rglob("*.py")]:
            for call in ast.walk(ast.parse(path.read_text())):
                if not isinstance(call, ast.Call) or getattr(call.func, "attr", "") != "add_argument":
                    continue
                named = {keyword.arg: keyword.value for keyword in call.keywords}
                default = getattr(named.get("default"), "value", None)
                if isinstance(default, (int, float)) and not isinstance(default, bool):
                    seen += 1
                    if "type" not in named:
                        wrong.append(f"{path.name}: {ast.unparse(call.args[0])}")
        self.assertGreater(seen, 10)
        self.assertEqual(wrong, [])


class Small(unittest.TestCase):
    def test_a_run_takes_microseconds_without_its_writing_and_counts_where_it_ends_ok(self):
        summary = {
            "status": "ok", "reason": None, "steps": 40, "errors": {"e": 0.5}, "time": {"total_s": 3e-3, "write_s": 1e-3}}
        asked = []
        with program(summary, asked=asked):
            us, steps, errors = small.run("/b/bin/contactbench", ["s.xml", "--k", "8"])
        self.assertAlmostEqual(us, 2000, 6)
        self.assertEqual((steps, errors), (40, {"e": 0.5}))
        (words, more), = asked
        self.assertEqual(words[:-1], [
            "/b/bin/contactbench", "run", "s.xml", "--k", "8", "--record-every", "0", "--quiet", "--time-limit", "10", "--out"])
        self.assertEqual(more["env"]["CONTACTBENCH_ENGINES"], "/b/bin")
        for summary, stderr, why in ((summary | {"status": "inaccurate", "reason": "why"}, "noise", "inaccurate: why"),
                                     (None, "first\nno such flag\n", "no such flag"), (None, "", "no word")):
            with program(summary, 2, stderr):
                self.assertEqual(small.run("p", []), (None, None, why))

    def cell(self, *ends, name="ap", by=None):
        cell = small.Cell("p", [], name, by)
        with mock.patch.object(small, "run", mock.Mock(side_effect=ends)):
            for _ in ends:
                cell.turn()
        return cell

    def test_the_quickest_turn_counts_and_one_that_fails_is_said_where_none_came_through(self):
        cell = self.cell((30, 10, {"e": 1.0}), (20, 10, {"e": 2.5e-3}), (None, None, "ray: x"), (50, 10, {"e": 3.0}))
        self.assertEqual((cell.us, cell.steps, cell.said), (2, 10, {"e": 2.5e-3}))
        self.assertEqual([cell.text(error, share) for error, share in (("e", 1), ("e", 10), (None, 1), ("other", 1))],
                         ["ap 2 (2.5e-03 m)", "ap 0.2 (2.5e-03 m)", "ap 2", "ap 2"])
        # Over the steps of another, where one is given.
        self.assertEqual(self.cell((30, 10, {}), by=self.cell((8, 4, {}))).us, 7.5)
        self.assertEqual(self.cell((None, None, "ray: x"), (None, None, "late")).text("e", 1), "ap: ray: x")
        self.assertEqual(self.cell((None, None, "ray: x"), (30, 10, {"e": None})).text("e", 1), "ap 3")

    def test_who_is_as_exact_is_the_quickest_with_no_more_error_than_the_quickest_engine(self):
        engines = [self.cell((900, 100, {"e": 1e-9}), name="slow"), self.cell((800, 100, {"e": 5e-4}), name="quick"),
                   self.cell((None, None, "late"), name="late")]
        ours = [self.cell((us, 100, {"e": e}), name=name)
                for name, us, e in (("exact", 400, 1e-6), ("enough", 300, 5e-4), ("coarse", 200, 6e-4))]
        self.assertEqual([cell.name for cell in small.quickest(engines)], ["quick", "slow"])
        self.assertEqual(small.as_exact(ours, engines, "e", 1), "enough 3 (5.0e-04 m)")
        self.assertEqual(small.as_exact(ours[2:], engines, "e", 1), "none")
        self.assertEqual(small.as_exact(ours, engines[2:], "e", 1), "-")
        # An engine or a way of ours without an error is beside none.
        unknown = [self.cell((100, 100, {"e": None}), name="blind")]
        self.assertEqual(small.as_exact(ours, unknown + engines, "e", 1), "-")
        self.assertEqual(small.as_exact(unknown + ours, engines, "e", 1), "enough 3 (5.0e-04 m)")

    def test_the_kernel_s_time_is_in_microseconds_and_of_so_many_boxes(self):
        said = types.SimpleNamespace(stdout=json.dumps({"benchmarks": [{"cpu_time": 2500.0}]}))
        with mock.patch("subprocess.run", return_value=said) as run:
            self.assertEqual(small.kernel("/b", 16), 2.5)
        self.assertEqual(run.call_args.args[0][:2], ["/b/bin/bench_cone", "--benchmark_filter=^factor_and_solve/16$"])

    def test_a_row_has_each_column_s_least_times_beside_each_other(self):
        turns = collections.Counter()

        def run(path, flags):
            """Later turns take longer. With an accuracy the steps are fewer, and those of the last way count."""
            def word(flag):
                return flags[flags.index(flag) + 1]

            late, steps, error = 100 * turns[path, *flags], 100, 1e-3
            turns[path, *flags] += 1
            if "--engine" in flags:
                us, error = {
                    "si10": (900, 1e-2), "si50": (800, 5e-4), "quick": (850, 1e-2), "quick-slip": (2000, 1e-9)}[word("--variant")]
            elif "--accuracy" in flags:
                us, steps, error = 100 * (1 + small.ACCURACIES.index(word("--accuracy"))), 10, float(word("--accuracy"))
            else:
                us = {"convex": 500, "coulomb": 700}[word("--method")] + 500 * (path == "/old/program")
                us -= 100 * ("--prune" in flags)
            return us + late, steps, {"position_l2_m": error}

        kernels = iter((2.5, 1.5))
        engines = [{"name": "bullet", "unavailable": None}, {"name": "ode"}, {"name": "mujoco", "unavailable": "not here"}]
        with mock.patch.object(small, "run", run), mock.patch.object(small, "kernel", lambda *_: next(kernels)), \
                mock.patch("subprocess.run", return_value=types.SimpleNamespace(stdout=json.dumps(engines))), \
                mock.patch.object(sys, "argv", ["small.py", "/b", "--before", "/old/program", "--rounds", "2", "--only", "circle"]), \
                contextlib.redirect_stdout(io.StringIO()) as said:
            self.assertEqual(small.main(), 0)
        head, _, row = said.getvalue().splitlines()
        e = "(1.0e-03 m)"
        self.assertEqual(dict(zip(*([cell.strip() for cell in line.strip("|").split("|")] for line in (head, row)))), {
            "scene, us a step (error)": "circle", "before": f"convex 10 {e}; coulomb 12 {e}", "now": f"convex 5 {e}; coulomb 7 {e}",
            "and what rests left out": f"convex 4 {e}; coulomb 6 {e}", "to an accuracy": "coulomb to 1e-4 m 3 (1.0e-04 m)",
            "quickest engines": "bullet si50 8 (5.0e-04 m); ode quick 8.5 (1.0e-02 m)", "kernel alone": "1.5"})


class Overhead(unittest.TestCase):
    def test_an_event_costs_what_the_run_solved_for_beyond_the_solver_s_own_time(self):
        summary = {"status": "crash", "reason": "why", "time": {"solve_s": 0.011}}
        with program(summary, stderr="0.001 3\n0.002 5\n"):  # two processes were started: 3 ms of 8 problems
            over, own, problems = overhead.external("/b", "text", 4, 1)
        self.assertAlmostEqual(over, 1000, 6)
        self.assertAlmostEqual(own, 375, 6)
        self.assertEqual(problems, 8)
        with program(summary, 3), self.assertRaisesRegex(SystemExit, "overhead.py: crash: why"):
            overhead.external("/b", "text", 4, 1)

    def test_calls_are_in_microseconds_here_and_there(self):
        said = {"benchmarks": [{"name": "gen_free/ap", "real_time": 2500.0}, {"name": "gen_free/convex", "real_time": 500.0}]}
        with mock.patch("subprocess.run", return_value=types.SimpleNamespace(stdout=json.dumps(said))):
            self.assertEqual(overhead.calls("/b"), {("gen_free", "ap"): 2.5, ("gen_free", "convex"): 0.5})
        now = [7.0]

        def solve(problem, method):
            now[0] += 0.03

        module = types.SimpleNamespace(Problem=types.SimpleNamespace(read=lambda path: path), solve=solve)
        with mock.patch("time.perf_counter", lambda: now[0]):
            self.assertAlmostEqual(overhead.python(module, "gen_free", "ap"), 30000, 3)
        self.assertAlmostEqual(now[0], 7.15)  # five at least

    def test_the_tables_have_the_medians_of_rounds_and_those_of_differences(self):
        turns, inside, outside = collections.Counter(), iter((2.0, 5.0, 9.0)), iter((10.0, 6.0, 13.0))

        def external(build, encoding, boxes, duration):
            turns[encoding, boxes] += 1
            turn = turns[encoding, boxes] - 1
            return boxes + (50, 10, 30)[turn], (3, 1, 2)[turn], 100 * boxes

        with mock.patch.object(overhead, "external", external), mock.patch.object(sys, "path", list(sys.path)), \
                mock.patch.object(overhead, "calls", lambda _: {("gen_free", "ap"): next(inside)}), \
                mock.patch.object(overhead, "python", lambda *_: next(outside)), \
                mock.patch.dict(sys.modules, {"contactbench": types.ModuleType("contactbench")}), \
                mock.patch.object(sys, "argv", ["overhead.py", "/b", "--rounds", "3"]), \
                contextlib.redirect_stdout(io.StringIO()) as said:
            overhead.main()
        lines = [line.split() for line in said.getvalue().splitlines()]
        self.assertEqual(lines[1:3], [["stack", "of", "2,", "binary", "32.0", "2.0", "200"],
                                      ["stack", "of", "2,", "text", "32.0", "2.0", "200"]])
        self.assertEqual(lines[5], ["stack", "of", "8,", "binary", "38.0", "2.0", "800"])
        # 8, 1 and 4 us beyond 2, 5 and 9 us.
        self.assertEqual(lines[-1], ["gen_free", "ap", "4.0", "5.0"])


if __name__ == "__main__":
    unittest.main()
