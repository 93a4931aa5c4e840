#!/usr/bin/python3
"""What it costs to be asked from outside: microseconds an event beyond the solver's own time (--method external), and a
call beyond the method and the check in C++ (the Python module). Medians of runs that take turns.

    bench/overhead.py BUILD [--rounds N]
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def external(build, encoding, boxes, duration):
    """us an event: the run's time of solving less the solver's own, over the problems that it got."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([
            os.path.join(build, "bin", "contactbench"), "run", "stack.xml", "--set", f"boxes={boxes}", "--duration", str(duration),
            "--method", "external", "--law", "coulomb", "--record-every", "0", "--quiet", "--out", folder, "--command",
            f"exec {os.path.join(build, 'bin', 'toy_solver')} {encoding} time"], capture_output=True, text=True)
        with open(os.path.join(folder, "summary.json")) as file:
            summary = json.load(file)
        if done.returncode != 0:
            sys.exit(f"overhead.py: {summary['status']}: {summary['reason']}")
        own, problems = done.stderr.split()
        return 1e6 * (summary["time"]["solve_s"] - float(own)) / int(problems), 1e6 * float(own) / int(problems), int(problems)


def python(module, path, method, repeats):
    """us a call beyond what the method and the check take."""
    problem = module.Problem.read(path)
    module.solve(problem, method)
    inside, start = 0.0, time.perf_counter()
    for _ in range(repeats):
        answer = module.solve(problem, method)
        inside += answer.seconds + answer.check_seconds
    return 1e6 * (time.perf_counter() - start - inside) / repeats, 1e6 * inside / repeats


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=5)
    asked = parser.parse_args()
    build = os.path.abspath(asked.build)
    print("external: us an event           beyond its own     its own   events")
    cases = [(encoding, boxes) for boxes in (2, 16) for encoding in ("binary", "text")]
    rounds = [[external(build, *case, 0.2) for case in cases] for _ in range(asked.rounds)]
    for i, (encoding, boxes) in enumerate(cases):
        over, own, events = (statistics.median(r[i][k] for r in rounds) for k in range(3))
        print(f"  stack of {boxes:2}, {encoding:6} {over:24.1f} {own:11.1f} {events:8.0f}")
    sys.path.insert(0, os.path.join(build, "python"))
    try:
        import contactbench
    except ImportError as error:
        sys.exit(f"overhead.py: the Python module is not built: {error}")
    print("python: us a call                   beyond C++  in C++")
    problems = os.path.join(ROOT, "test", "data", "problems")
    for name in ("gen_free_b2_c1_s1", "gen_boxplane_b1_c4_s2", "gen_stack_b4_c16_s1", "gen_stack_b16_c64_s0"):
        for method in ("newton", "ap", "convex"):
            path = os.path.join(problems, name + ".hdf5")
            over, own = zip(*(python(contactbench, path, method, 50) for _ in range(asked.rounds)))
            print(f"  {name:24} {method:7} {statistics.median(over):10.1f} {statistics.median(own):9.1f}")


if __name__ == "__main__":
    main()
