"""The Python module from outside: problems from arrays and files, methods and functions of our own on them, runs."""
import glob
import importlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

import contactbench as cb

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
PROBLEMS = os.path.join(ROOT, "test", "data", "problems")
PROGRAM = os.environ.get("PROGRAM")
sys.path.insert(0, os.path.join(ROOT, "docs", "examples"))
gauss_seidel = importlib.import_module("judge_your_own").mine  # Coulomb's law contact after contact: no line of ours


def ball(mu=0.5, v=(1.0, -2.0, 0.0), e=0.0):
    """A ball of 1 kg and inertia 1 at its centre that meets the ground: the contact does not turn it."""
    J = np.zeros((3, 6))
    J[0, 1] = J[1, 0] = J[2, 2] = 1
    return cb.Problem(M=np.eye(6), J=J, v=[*v, 0, 0, 0], mu=mu, e=e)


class Problems(unittest.TestCase):

    def test_arrays_come_back_as_they_were_given(self):
        generator = np.random.default_rng(1)
        # Two bodies whose unknowns alternate: inside they are put together, outside nobody sees that.
        blocks = [(lambda A: A @ A.T + 3 * np.eye(3))(generator.normal(size=(3, 3))) for _ in range(2)]
        M, J = np.zeros((6, 6)), np.zeros((6, 6))
        for b, block in enumerate(blocks):
            M[b::2, b::2] = block
            J[3 * b:3 * b + 3, b::2] = generator.normal(size=(3, 3))
        v, offset = generator.normal(size=6), generator.normal(size=6)
        p = cb.Problem(M=M, J=J, v=v, mu=[0.1, 0.2], e=0.5, offset=offset)
        for given, back in ((M, p.M), (J, p.J), (v, p.v), (offset, p.offset), ([0.1, 0.2], p.mu), ([0.5, 0.5], p.e)):
            np.testing.assert_array_equal(given, back)
        np.testing.assert_allclose(p.W, J @ np.linalg.inv(M) @ J.T, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(p.q, J @ v + offset, rtol=1e-14)
        r = generator.normal(size=(2, 3))
        np.testing.assert_allclose(p.velocity(r).ravel(), J @ (v + np.linalg.inv(M) @ J.T @ r.ravel()) + offset, rtol=1e-12)
        np.testing.assert_allclose(cb.judge(p, r, "newton").v, v + np.linalg.inv(M) @ J.T @ r.ravel(), rtol=1e-12)

    def test_sparse_matrices_are_the_same_problem(self):
        try:
            from scipy import sparse
        except ImportError:
            self.skipTest("no scipy")
        dense = ball()
        p = cb.Problem(M=sparse.csr_matrix(dense.M), J=sparse.csc_matrix(dense.J), v=dense.v, mu=0.5)
        np.testing.assert_array_equal(p.W, dense.W)

    def test_a_problem_given_by_W_and_q_has_the_same_answer(self):
        p = ball()
        local = cb.Problem(W=p.W, q=p.q, mu=p.mu)
        np.testing.assert_allclose(cb.solve(local, "convex").impulses, cb.solve(p, "convex").impulses, atol=1e-12)

    def test_a_problem_goes_through_a_file_unchanged(self):
        with tempfile.TemporaryDirectory() as folder:
            p = ball(e=0.25)
            p.write(os.path.join(folder, "p.hdf5"))
            back = cb.Problem.read(os.path.join(folder, "p.hdf5"))
            for name in ("M", "J", "v", "mu", "e", "offset", "W", "q"):
                np.testing.assert_array_equal(getattr(p, name), getattr(back, name))

    def test_a_file_has_the_unknowns_in_the_order_in_which_they_were_given(self):
        # Two bodies, whose unknowns alternate.
        generator = np.random.default_rng(2)
        M, J = np.zeros((6, 6)), np.zeros((6, 6))
        for b in range(2):
            A = generator.normal(size=(3, 3))
            M[b::2, b::2] = A @ A.T + 3 * np.eye(3)
            J[3 * b:3 * b + 3, b::2] = generator.normal(size=(3, 3))
        p = cb.Problem(M=M, J=J, v=generator.normal(size=6), mu=[0.1, 0.2])
        with tempfile.TemporaryDirectory() as folder:
            p.write(os.path.join(folder, "p.hdf5"))
            back = cb.Problem.read(os.path.join(folder, "p.hdf5"))
        for name in ("M", "J", "v", "mu"):
            np.testing.assert_allclose(getattr(back, name), getattr(p, name), rtol=1e-12, atol=1e-12)

    def test_every_property_can_be_read(self):
        p = ball()
        a = cb.solve(p, "ap", k=4)
        for thing in (p, a, cb.judge(p, a.impulses, "anitescu_potra", k=4)):
            for name in dir(thing):
                if not name.startswith("_"):
                    getattr(thing, name)
        self.assertEqual(p.notes, [])

    def test_what_is_wrong_with_an_argument_is_one_line_that_names_it(self):
        M, J, v = np.eye(6), ball().J, np.zeros(6)
        for call, words in (
            (lambda: cb.Problem(), ["give M, J, v, mu"]),
            (lambda: cb.Problem(M=M, J=J, v=v, W=np.eye(3), q=v, mu=1), ["or W, q, mu"]),
            (lambda: cb.Problem(M=M, J=J, v=v), ["mu is missing"]),
            (lambda: cb.Problem(M=M, J=J, v=v[:5], mu=1), ["v:", "5", "6"]),
            (lambda: cb.Problem(M=M, J=J.T, v=v, mu=1), ["J:", "6 x 3"]),
            (lambda: cb.Problem(M=M, J=J[:2], v=v, mu=1), ["J:", "2 rows"]),
            (lambda: cb.Problem(M=-M, J=J, v=v, mu=1), ["M:", "positive definite"]),
            (lambda: cb.Problem(M=M + np.eye(6, k=1), J=J, v=v, mu=1), ["M is not symmetric"]),
            (lambda: cb.Problem(M=M, J=J, v=v * np.nan, mu=1), ["v:", "finite"]),
            (lambda: cb.Problem(M=M, J=J, v=v, mu=-1), ["mu of contact 0"]),
            (lambda: cb.Problem(M=M, J=J, v=v, mu=1, e=2), ["restitution of contact 0"]),
            (lambda: cb.Problem(M="a", J=J, v=v, mu=1), ["M:", "numbers"]),
            (lambda: cb.Problem(W=np.eye(3) + np.eye(3, k=1), q=v[:3], mu=1), ["W is not symmetric"]),
            (lambda: cb.Problem(M=M[:5], J=J, v=v, mu=1), ["M: is 5 x 6", "square"]),
            (lambda: cb.Problem(M=v, J=J, v=v, mu=1), ["M: has 1 dimensions", "2"]),
            (lambda: cb.Problem(M=M, J=J, v=[0, 0, np.inf, 0, 0, 0], mu=1), ["v: entry 2 is not"]),
            (lambda: cb.Problem(W=np.eye(3)[:2], q=v[:3], mu=1), ["W: is 2 x 3", "square"]),
            (lambda: cb.Problem(W=np.eye(3), q=v[:3], mu=1, offset=v[:3]), ["offset: belongs to M, J, v"]),
            (lambda: cb.Problem(M=M, J=J, v=v, mu=[1, 1]), ["mu: holds 2 numbers", "1 belong"]),
            (lambda: cb.Problem.read("no such file"), ["no such file", "cannot be opened"]),
            (lambda: cb.solve(ball(), "app"), ["method app", "ap"]),
            (lambda: cb.solve(ball(), "ap", k=7), ["k 7", "even"]),
            (lambda: cb.solve(ball(), "convex", compression_bound=np.array([True, False])), ["compression_bound", "True or False"]),
            (lambda: cb.solve(ball(), "newton", k=8), ["k 8", "no use"]),
            (lambda: cb.solve(ball(), "newton", epsilon_relative=1e-9), ["epsilon_relative 1e-09", "no use"]),
            (lambda: cb.solve(ball(), "ap", kk=8), ["kk: no such option"]),
            (lambda: cb.solve(ball(), "ap", k=[8]), ["k: must be a number"]),
            (lambda: cb.solve(ball(), "ap", law="newton"), ["law: ap has its own"]),
            (lambda: cb.solve(ball(), gauss_seidel), ["law is missing"]),
            (lambda: cb.solve(ball(), 3), ["method:", "function"]),
            (lambda: cb.judge(ball(), np.zeros((2, 3)), "newton"), ["impulses", "(2, 3)", "(1, 3)"]),
            (lambda: cb.judge(ball(), np.zeros(3), "newto"), ["law newto", "newton"]),
            (lambda: cb.run("no_such_scene", "ap"), ["no_such_scene"]),
            (lambda: cb.run("stack.xml", "ap", duration=-1), ["duration"]),
            (lambda: cb.run("stack.xml", "ap", step=1e-300), ["step", "1e12"]),
            (lambda: cb.run("stack.xml", "ap", step=0), ["step: must be positive"]),
            (lambda: cb.run("stack.xml", "ap", duration="a"), ["duration: must be a finite number"]),
            (lambda: cb.run("stack.xml", "ap", friction=-0.1), ["friction: is -0.1", "at least 0"]),
            (lambda: cb.run("stack.xml", "ap", restitution=1.1), ["restitution: is 1.1", "from 0 to 1"]),
            (lambda: cb.run("stack.xml", "ap", restitution=-0.1), ["restitution: is -0.1", "from 0 to 1"]),
            (lambda: cb.run("stack.xml", "ap", record_every=0), ["record_every: is 0", "from 1"]),
            (lambda: cb.run("stack.xml", "ap", stepping="leaps"), ["stepping: is 'leaps'", "'events' or 'steps'"]),
            (lambda: cb.run("stack.xml", "ap", set=3), ["set: must be a dict"]),
            (lambda: cb.run("stack.xml", "ap", prune="of"), ["prune", "of"]),
            (lambda: cb.run("stack.xml", "ap", record_every=1.5), ["record_every", "whole"]),
            (lambda: cb.solve(ball(), "ap", time_limit=-5), ["time_limit", "positive"]),
            (lambda: cb.judge(ball(), np.zeros(3), "newton", tolerance=0), ["tolerance", "positive"]),
            (lambda: cb.run("stack.xml", "ap", set={"boxs": 2}), ["boxs"]),
        ):
            with self.assertRaises(cb.Error) as raised:
                call()
            message = str(raised.exception)
            self.assertNotIn("\n", message)
            self.assertNotIn("--", message)
            for word in words:
                self.assertIn(word, message)

    def test_a_file_that_is_not_there_is_named_as_it_was_given(self):
        for name in ("no--such.hdf5", "no such--file.hdf5"):
            with self.assertRaises(cb.Error) as raised:
                cb.Problem.read(name)
            self.assertIn(name, str(raised.exception))


class Answers(unittest.TestCase):

    def test_a_sliding_ball_by_hand(self):
        # It stops falling, r_n = 2, and friction takes mu r_n of what it slides with: u_t = 1 - 0.1 * 2 = 0.8.
        for method in ("newton", "ap", "convex", "coulomb"):
            a = cb.solve(ball(mu=0.1), method)
            self.assertTrue(a, a)
            self.assertEqual((a.status, a.reason), ("ok", ""))
            np.testing.assert_allclose(a.impulses, [[2, -0.2, 0]], atol=1e-9)
            np.testing.assert_allclose(a.velocities, [[0, 0.8, 0]], atol=1e-9)
            self.assertAlmostEqual(a.energy_change, (0.8**2 - 5) / 2, places=9)
            self.assertGreater(a.seconds, 0)

    @unittest.skipUnless(PROGRAM, "no program to compare with")
    def test_the_numbers_are_those_of_the_program(self):
        for path in sorted(glob.glob(PROBLEMS + "/gen_*_b[24]_*.hdf5"))[:8]:
            for method, options in (("newton", {}), ("ap", {"k": 8}), ("convex", {"compression_bound": False})):
                flags = []
                for key, value in options.items():
                    flags += ["--" + key.replace("_", "-"), {True: "on", False: "off"}.get(value, str(value))]
                out = subprocess.run([PROGRAM, "solve", path, "--kind", "contact", "--json", "--method", method, *flags],
                                     capture_output=True, text=True).stdout
                theirs, ours = json.loads(out), cb.solve(cb.Problem.read(path), method, **options)
                for name in ("status", "residual", "law_residual", "iterations", "claimed_residual", "gap", "infeasibility",
                             "solver_status", "solver_reason"):
                    self.assertEqual(getattr(ours, name), theirs[name], (name, path, method))

    def test_the_referee_says_the_same_whoever_answered(self):
        for path in sorted(glob.glob(PROBLEMS + "/gen_free_*.hdf5")):
            p = cb.Problem.read(path)
            for method, law, options in (("newton", "newton", {}), ("ap", "anitescu_potra", {"k": 8}), ("convex", "convex", {})):
                a = cb.solve(p, method, **options)
                verdict = cb.judge(p, a.impulses, law, **options)
                self.assertTrue(verdict, (path, law, verdict))
                self.assertEqual((verdict.law_residual, verdict.energy_change), (a.law_residual, a.energy_change))
                wrong = a.impulses
                wrong[0, 1] += 10 * (1 + abs(wrong[0]).max())
                verdict = cb.judge(p, wrong, law, **options)
                self.assertFalse(verdict)
                self.assertEqual(verdict.status, "inaccurate")
                self.assertIn("beyond" if method != "convex" else "allowed", verdict.reason)

    def test_what_cannot_be_judged_is_said(self):
        verdict = cb.judge(ball(e=0.5), [[3, 0, 0]], "ap")
        self.assertEqual((bool(verdict), verdict.status), (False, "unsupported"))
        self.assertIsNone(verdict.residual)
        self.assertEqual(cb.judge(ball(), [[np.nan, 0, 0]], "newton").status, "not_finite")

    def test_a_function_answers_like_a_method(self):
        for path in sorted(glob.glob(PROBLEMS + "/gen_free_*.hdf5")):
            a = cb.solve(cb.Problem.read(path), gauss_seidel, law="coulomb")
            self.assertTrue(a, (path, a))
            self.assertEqual(a.solver_status, "ok")
            self.assertLess(a.law_residual, 1e-9)

    def test_a_program_answers_like_a_method(self):
        command = f"{sys.executable} {os.path.join(ROOT, 'docs', 'examples', 'external_solver.py')}"
        a = cb.solve(ball(mu=0.1), "external", command=command, law="coulomb")
        self.assertEqual((a.status, a.reason, a.solver_status), ("ok", "", "ok"))
        np.testing.assert_allclose(a.impulses, [[2, -0.2, 0]], atol=1e-9)

    def test_however_a_function_fails_its_answer_is_typed(self):
        def raises(problem):
            raise ValueError("no answer\nat all")

        def inner():
            raise KeyError("k")

        def deep(problem):
            return inner()

        def hangs(problem):
            while True:
                pass

        def sleeps(problem):
            try:
                time.sleep(1000)
            except Exception:  # a limit is no exception that a solver may take
                pass

        for function, status, words in ((raises, "crash", "ValueError: no answer (test_module.py:"),
                                        # Where it was raised, not where the function called what raised it.
                                        (deep, "crash", f"KeyError: 'k' (test_module.py:{inner.__code__.co_firstlineno + 1})"),
                                        (lambda p: np.full((1, 3), np.nan), "not_finite", "NaN"),
                                        (lambda p: np.zeros((2, 3)), "input_error", "shape (2, 3)"),
                                        (lambda p: np.zeros((3, 1)), "input_error", "shape (3, 1)"),
                                        (lambda p: [1.0], "input_error", "shape (1,)"),
                                        (lambda p: None, "input_error", "NoneType"),
                                        (lambda p: "impulses", "input_error", "numbers"),
                                        (lambda p, q: None, "crash", "TypeError"),
                                        (hangs, "time_limit", "0.2 s"), (sleeps, "time_limit", "0.2 s"),
                                        (lambda p: np.zeros((1, 3)), "inaccurate", "checked residual")):
            start = time.monotonic()
            a = cb.solve(ball(), function, law="newton", time_limit=0.2)
            self.assertEqual(a.status, status, a)
            self.assertIn(words, a.reason)
            self.assertNotIn("\n", a.reason)
            self.assertFalse(a)
            self.assertLess(time.monotonic() - start, 10)
        self.assertTrue(cb.solve(ball(), "ap"))  # and nothing of it stays

    def test_a_limit_of_time_leaves_alarms_as_they_were(self):
        import signal
        heard = []
        before = signal.signal(signal.SIGALRM, lambda *_: heard.append(1))
        try:
            self.assertTrue(cb.solve(ball(), "ap", time_limit=5))
            signal.raise_signal(signal.SIGALRM)
            self.assertEqual(heard, [1])
        finally:
            signal.signal(signal.SIGALRM, before)

    def test_control_c_ends_a_function_and_a_method(self):
        for body in ("lambda p: time.sleep(1000)", "'ap'"):
            code = ("import contactbench as cb, os, subprocess, time\n"
                    "cb.run('stack.xml', 'ap', duration=0.01)\n"  # so that all imports are done
                    # From outside, as a terminal does: a thread of ours would wait for the end of the call.
                    "subprocess.Popen(['sh', '-c', f'sleep 0.3; kill -INT {os.getpid()}'])\n"
                    f"method = {body}\n"
                    "try:\n"
                    "    cb.run('stack.xml', method, duration=1e6, record_every=1000000,"
                    " **({} if isinstance(method, str) else {'law': 'newton'}))\n"
                    "except KeyboardInterrupt:\n"
                    "    print('heard')\n")
            done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
            self.assertEqual((done.stdout, done.returncode), ("heard\n", 0), done.stderr)


class Runs(unittest.TestCase):

    @unittest.skipUnless(PROGRAM, "no program to compare with")
    def test_what_a_scene_says_of_its_joints_is_heard(self):
        # Joint forces of the end of a step.
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([PROGRAM, "run", "quadruped.xml", "--method", "convex", "--duration", "0.02", "--out", folder, "--quiet"],
                           check=True)
            with open(os.path.join(folder, "summary.json")) as file:
                theirs = json.load(file)
            rows = np.genfromtxt(os.path.join(folder, "trajectory.csv"), delimiter=",", names=True, dtype=None, encoding="utf8")
        r = cb.run("quadruped.xml", "convex", duration=0.02)
        for key in ("status", "events", "errors", "control"):
            self.assertEqual(r.summary[key], theirs[key], key)
        self.assertEqual(r.summary["options"]["joint_forces"], "implicit")
        for body, name in enumerate(r.bodies):
            np.testing.assert_array_equal(r.position[:, body, 1], rows["py"][rows["body"] == name])

    @unittest.skipUnless(PROGRAM, "no program to compare with")
    def test_a_run_is_the_one_of_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([PROGRAM, "run", "stack.xml", "--method", "ap", "--set", "boxes=2", "--duration", "0.05", "--out",
                            folder, "--quiet"], check=True)
            with open(os.path.join(folder, "summary.json")) as file:
                theirs = json.load(file)
            rows = np.genfromtxt(os.path.join(folder, "trajectory.csv"), delimiter=",", names=True, dtype=None, encoding="utf8")
        r = cb.run("stack.xml", "ap", set={"boxes": 2}, duration=0.05)
        self.assertTrue(r)
        for key in ("status", "events", "steps", "iterations_total", "errors", "left_out", "t_reached", "contacts_max"):
            self.assertEqual(r.summary[key], theirs[key], key)
        for key in ("max", "median", "law_max", "false_claims"):
            self.assertEqual(r.summary["residuals"][key], theirs["residuals"][key])
        self.assertEqual(r.position.shape, (51, 2, 3))
        np.testing.assert_array_equal(r.position[:, 1, 1], rows["py"][rows["body"] == r.bodies[1]])
        np.testing.assert_array_equal(r.velocity[:, 0, 2], rows["vz"][rows["body"] == r.bodies[0]])
        np.testing.assert_allclose(np.linalg.norm(r.orientation, axis=2), 1, rtol=1e-12)
        self.assertEqual(len(r.steps["status"]), 50)

    def test_a_run_says_how_it_ended_and_is_true_where_it_came_to_its_end(self):
        whole = cb.run("stack.xml", "ap", set={"boxes": 2}, duration=0.003)
        self.assertEqual((bool(whole), whole.status, whole.errors), (True, "ok", whole.summary["errors"]))
        self.assertEqual(repr(whole), "<contactbench.Run: stack, ap, 4 times, ok>")
        # Answers that the referee refuses end no run.
        wrong = cb.run("stack.xml", lambda p: np.zeros((p.nc, 3)), law="coulomb", set={"boxes": 2}, duration=0.003)
        self.assertEqual((bool(wrong), wrong.status, len(wrong.t)), (True, "inaccurate", 4))
        calls = iter((True, False))
        part = cb.run("stack.xml", lambda p: gauss_seidel(p) if next(calls) else 1 / 0, law="coulomb", set={"boxes": 2},
                      duration=0.003)
        self.assertEqual((bool(part), part.status, part.reason), (False, part.summary["status"], part.summary["reason"]))
        self.assertEqual(repr(part), f"<contactbench.Run: stack, python, 2 times, crash: {part.reason}>")

    def test_a_switch_is_one_of_python_or_of_the_program(self):
        def pruned(value):
            return cb.run("sticking_box.xml", "ap", duration=0.002, prune=value).summary["options"]["prune"]

        for on in (True, 1, np.True_, "on", None):
            self.assertEqual(pruned(on), "on")
        for off in (False, 0, np.False_, "off"):
            self.assertEqual(pruned(off), "off")
        self.assertEqual(pruned("rest"), "rest")

    def test_a_function_does_a_whole_run_with_the_rows_of_a_method(self):
        inside = cb.run("stack.xml", "coulomb", set={"boxes": 2}, duration=0.02)
        r = cb.run("stack.xml", gauss_seidel, law="coulomb", set={"boxes": 2}, duration=0.02)
        self.assertTrue(r, r)
        self.assertEqual(r.status, "ok")
        self.assertEqual((r.summary["events"], r.summary["steps"]), (inside.summary["events"], inside.summary["steps"]))
        self.assertLessEqual(r.summary["residuals"]["max"], 1e-9)
        self.assertLessEqual(r.summary["residuals"]["law_max"], 1e-9)
        self.assertEqual(r.summary["method"], "python")

    def test_a_stack_stands_for_its_whole_run_on_impulses_from_a_function(self):
        # What stops every contact is an answer of a stack at rest; least squares share the load of four corners evenly.
        r = cb.run("stack.xml", lambda p: np.linalg.lstsq(p.W, -p.q, rcond=1e-12)[0], law="coulomb", set={"boxes": 4})
        inside = cb.run("stack.xml", "coulomb", set={"boxes": 4})
        self.assertEqual((r.status, r.reason, len(r.t)), ("ok", None, 1001))
        for key in ("events", "steps", "t_reached", "contacts_max"):
            self.assertEqual(r.summary[key], inside.summary[key], key)
        self.assertEqual(r.summary["residuals"].keys(), inside.summary["residuals"].keys())
        for residual in ("max", "law_max"):
            self.assertLessEqual(r.summary["residuals"][residual], 1e-9)
        self.assertEqual(r.errors.keys(), inside.errors.keys())
        self.assertLess(r.errors["displacement_linf_m"], 1e-11)

    def test_however_a_function_fails_the_run_keeps_what_it_has(self):
        def after(count, then):
            calls = iter(range(10**9))
            return lambda p: gauss_seidel(p) if next(calls) < count else then(p)

        def hang(problem):
            while True:
                pass

        for then, status in ((lambda p: 1 / 0, "crash"), (lambda p: gauss_seidel(p) * np.nan, "not_finite"),
                             (lambda p: gauss_seidel(p)[1:], "input_error"), (hang, "time_limit")):
            r = cb.run("stack.xml", after(5, then), law="newton", set={"boxes": 2}, time_limit=2)
            self.assertEqual((r.status, r.finished), (status, False), r)
            self.assertEqual(len(r.t), 6)
            self.assertEqual(r.summary["steps"], 5)

    def test_problems_of_a_run_come_one_by_one(self):
        events = list(cb.problems("stack.xml", "ap", set={"boxes": 2}, duration=0.01))
        self.assertEqual(len(events), cb.run("stack.xml", "ap", set={"boxes": 2}, duration=0.01).summary["events"])
        self.assertTrue(all(a.t <= b.t for a, b in zip(events, events[1:])))
        self.assertTrue(all(cb.solve(p, "ap", k=4) for p in events))
        first = next(iter(cb.problems("stack.xml", "ap", duration=1e6)))  # nobody waits for the others
        self.assertGreater(first.nc, 0)
        before = time.monotonic()
        some = sum(1 for _ in cb.problems("stack.xml", "ap", set={"boxes": 2}, duration=1e5, time_limit=0.2))
        self.assertGreater(some, 0)
        self.assertLess(time.monotonic() - before, 60)  # of 1e8 steps

    def test_the_scenes_are_found_by_name(self):
        names = [os.path.basename(path) for path in cb.scenes()]
        self.assertEqual(set(names), {os.path.basename(path) for path in glob.glob(os.path.join(ROOT, "scenarios", "*.xml"))})
        for scene in ("sliding_box", "sliding_box.xml", os.path.join(ROOT, "scenarios", "sliding_box.xml")):
            self.assertEqual(cb.run(scene, "ap", duration=0.002).summary["scenario"], "sliding_box")

    def test_an_installed_module_has_the_scenes_of_its_prefix(self):
        with tempfile.TemporaryDirectory() as prefix:
            packages, scenes = (os.path.join(prefix, *of) for of in (("lib", "python3", "dist-packages"),
                                                                     ("share", "contactbench", "scenarios")))
            shutil.copytree(os.path.dirname(cb.__file__), os.path.join(packages, "contactbench"))
            os.makedirs(scenes)
            shutil.copy(os.path.join(ROOT, "scenarios", "sticking_box.xml"), os.path.join(scenes, "only.xml"))
            code = ("import contactbench as cb\n"
                    "print(cb.scenes(), cb.run('only', 'ap', duration=0.01).status, cb.__file__)")
            done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=prefix,
                                  env=os.environ | {"PYTHONPATH": packages})
            self.assertEqual(done.stdout.split(), [f"['{scenes}/only.xml']", "ok", f"{packages}/contactbench/__init__.py"],
                             done.stderr)


class Examples(unittest.TestCase):

    def test_a_performance_profile_is_the_share_of_all_problems_within_a_factor_of_the_fastest(self):
        # The fourth problem nobody answers; `wide` fails the third.
        axes = cb.performance_profile({"quick": [1.0, 2.0, 6.0, None], "wide": [3.0, 1.0, float("inf"), None]})
        curves = {line.get_label(): line.get_xydata() for line in axes.get_lines()}

        def share(name, tau):
            x, y = curves[name].T
            return y[np.searchsorted(x, tau, side="right") - 1]

        for name, tau, expected in (("quick", 1.5, 2 / 4), ("quick", 2.5, 3 / 4), ("wide", 1.5, 1 / 4), ("wide", 2.9, 1 / 4), ("wide", 3.1, 2 / 4),
                                    ("wide", 9, 2 / 4), ("quick", 9, 3 / 4)):
            self.assertEqual(share(name, tau), expected, (name, tau))

    def test_a_performance_profile_is_drawn_over_all_problems_and_from_the_fastest_on(self):
        # Three problems of which nobody answers the last; times over the fastest: 1 and 20, 4 and 1, none.
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "profile.png")
            axes = cb.performance_profile({"one": [2.0, 40.0, None], "other": [8.0, 2.0, None], "none": [None] * 3}, path)
            with open(path, "rb") as file:
                self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")
        lines = axes.get_lines()
        self.assertEqual([(line.get_label(), line.get_drawstyle()) for line in lines],
                         [(name, "steps-post") for name in ("one", "other", "none")])
        for line, curve in zip(lines, ([(1, 0), (1, 1 / 3), (20, 2 / 3), (40, 2 / 3)],
                                       [(1, 0), (1, 1 / 3), (4, 2 / 3), (40, 2 / 3)], [(1, 0), (40, 0)])):
            np.testing.assert_allclose(line.get_xydata(), curve)
        self.assertEqual((axes.get_xscale(), axes.get_yscale(), axes.get_xlim(), axes.get_title()),
                         ("log", "linear", (1, 40), "3 problems"))
        self.assertEqual((axes.get_xlabel(), axes.get_ylabel()), ("time over that of the fastest", "share of problems"))
        self.assertEqual([text.get_text() for text in axes.get_legend().get_texts()], ["one", "other", "none"])
        # What is close together is drawn up to ten times the fastest, and so is what nobody answers.
        for seconds, share in (({"a": [1.0], "b": [1.5]}, 1), ({"a": [None]}, 0)):
            axes = cb.performance_profile(seconds, title="of mine")
            self.assertEqual((axes.get_xlim(), axes.get_title(), axes.get_lines()[0].get_ydata()[-1]),
                             ((1, 10), "of mine", share))

    def test_a_solver_of_ones_own_is_judged_beside_all_of_ours(self):
        with tempfile.TemporaryDirectory() as folder:
            few = os.path.join(folder, "problems")
            os.mkdir(few)
            for path in glob.glob(PROBLEMS + "/gen_sphereslide_*.hdf5") + glob.glob(PROBLEMS + "/gen_free_b2_*.hdf5"):
                os.symlink(path, os.path.join(few, os.path.basename(path)))
            picture = os.path.join(folder, "profile.png")
            done = subprocess.run([sys.executable, os.path.join(ROOT, "docs", "examples", "judge_your_own.py"), few, picture],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            answered = {line.split()[0]: line.split()[2:] for line in done.stdout.splitlines()}
            count = str(len(os.listdir(few)))
            for name in ("mine", *cb.methods):
                self.assertEqual(answered[name], [count, "of", count], done.stdout)
            with open(picture, "rb") as file:
                self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")

    @unittest.skipUnless(PROGRAM, "no program to talk to")
    def test_the_program_of_the_docs_answers_a_run(self):
        with tempfile.TemporaryDirectory() as folder:
            command = f"{sys.executable} {os.path.join(ROOT, 'docs', 'examples', 'external_solver.py')}"
            subprocess.run([PROGRAM, "run", "stack.xml", "--set", "boxes=2", "--duration", "0.01", "--method", "external", "--command",
                            command, "--law", "coulomb", "--out", folder, "--quiet"], check=True)
            with open(os.path.join(folder, "summary.json")) as file:
                summary = json.load(file)
            self.assertEqual(summary["status"], "ok")
            self.assertLessEqual(summary["residuals"]["law_max"], 1e-9)

    @unittest.skipUnless(PROGRAM, "no program to run")
    def test_a_trajectory_as_npz_is_that_of_the_rows(self):
        with tempfile.TemporaryDirectory() as folder:
            for form in ("csv", "npz"):
                subprocess.run([PROGRAM, "run", "stack.xml", "--set", "boxes=2", "--duration", "0.02", "--method", "ap", "--format",
                                form, "--out", os.path.join(folder, form), "--quiet"], check=True)
            rows = np.genfromtxt(os.path.join(folder, "csv", "trajectory.csv"), delimiter=",", names=True, dtype=None,
                                 encoding="utf8")
            self.assertFalse(os.path.exists(os.path.join(folder, "npz", "trajectory.csv")))
            with np.load(os.path.join(folder, "npz", "trajectory.npz")) as arrays:
                self.assertEqual(arrays["position"].shape, (21, 2, 3))
                np.testing.assert_array_equal(np.repeat(arrays["t"], 2), rows["t"])
                np.testing.assert_array_equal(np.tile(arrays["bodies"], 21), rows["body"])
                for name, columns in (("position", ("px", "py", "pz")), ("orientation", ("qw", "qx", "qy", "qz")),
                                      ("velocity", ("vx", "vy", "vz")), ("angular_velocity", ("wx", "wy", "wz"))):
                    np.testing.assert_array_equal(arrays[name].reshape(42, -1), np.stack([rows[c] for c in columns], axis=1))


if __name__ == "__main__":
    unittest.main()
