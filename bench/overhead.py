#!/usr/bin/python3
"""What it costs to be asked from outside: microseconds an event beyond the processor's time of the solver's program
(--method external), and a call beyond the same in C++ (the Python module). Medians of runs that take turns.

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
            os.path.join(build, "bin", "contactbench"), "run", "stack.xml", "--set", f"boxes={boxes}",
            "--duration", str(duration), "--method", "external", "--law", "coulomb", "--record-every", "0", "--quiet",
            "--out", folder, "--command",
            f"exec {os.path.join(build, 'bin', 'toy_solver')} {encoding} time"], capture_output=True, text=True)
        with open(os.path.join(folder, "summary.json")) as file:
            summary = json.load(file)
        if done.returncode != 0:
            sys.exit(f"overhead.py: {summary['status']}: {summary['reason']}")
        # A line of each process that was started.
        own, problems = map(sum, zip(*((float(s), int(n)) for s, n in map(str.split, done.stderr.splitlines()))))
        return 1e6 * (summary["time"]["solve_s"] - own) / problems, 1e6 * own / problems, problems


def calls(build):
    """{(problem, method): us a call in C++}, method made, answer checked."""
    program = os.path.join(build, "bin", "bench_one_call")
    said = subprocess.run([program, "--benchmark_format=json", "--benchmark_min_time=0.1"], check=True,
                          capture_output=True, text=True).stdout
    return {tuple(b["name"].split("/")): b["real_time"] / 1e3 for b in json.loads(said)["benchmarks"]}


def python(module, name, method):
    """us a call from Python."""
    problem = module.Problem.read(os.path.join(ROOT, "test", "data", "problems", name + ".hdf5"))
    repeats, start = 0, time.perf_counter()
    while time.perf_counter() - start < 0.1 or repeats < 5:
        module.solve(problem, method)
        repeats += 1
    return 1e6 * (time.perf_counter() - start) / repeats


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=5)
    asked = parser.parse_args()
    build = os.path.abspath(asked.build)
    print("external: us an event           beyond its own     its own   events")
    cases = [(encoding, boxes, s) for boxes, s in ((2, 1), (4, 1), (8, 0.2)) for encoding in ("binary", "text")]
    rounds = [[external(build, *case) for case in cases] for _ in range(asked.rounds)]
    for i, (encoding, boxes, _) in enumerate(cases):
        over, own, events = (statistics.median(r[i][k] for r in rounds) for k in range(3))
        print(f"  stack of {boxes:2}, {encoding:6} {over:24.1f} {own:11.1f} {events:8.0f}")
    sys.path.insert(0, os.path.join(build, "python"))
    try:
        import contactbench
    except ImportError as error:
        sys.exit(f"overhead.py: the Python module is not built: {error}")
    print("python: us a call             beyond C++    in C++")
    rounds = [(inside, {case: python(contactbench, *case) for case in inside})
              for inside in (calls(build) for _ in range(asked.rounds))]
    for case in rounds[0][0]:
        over = statistics.median(outside[case] - inside[case] for inside, outside in rounds)
        print(f"  {case[0]:22} {case[1]:7} {over:6.1f} {statistics.median(inside[case] for inside, _ in rounds):9.1f}")


if __name__ == "__main__":
    main()
