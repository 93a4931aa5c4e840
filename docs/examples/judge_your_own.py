#!/usr/bin/python3
"""Your own solver on every stored problem, beside all of ours: judged by the same referee, drawn as a performance profile.

    PYTHONPATH=build/python python3 docs/examples/judge_your_own.py test/data/problems profile.png
"""
import glob
import sys

import numpy as np

import contactbench as cb


def mine(problem):
    """Problem -> impulses (nc, 3), N s. Here: projected Gauss-Seidel on Coulomb's law, contact after contact."""
    W, q, r = problem.W, problem.q, np.zeros((problem.nc, 3))
    for _ in range(20000):
        before = r.copy()
        for c, mu in enumerate(problem.mu):
            rows = slice(3 * c, 3 * c + 3)
            u = q[rows] + W[rows] @ r.ravel()
            x = r[c] - 3 * (u + [mu * np.hypot(*u[1:]), 0, 0]) / np.trace(W[rows, rows])
            t = np.hypot(*x[1:])
            n = x[0] if t <= mu * x[0] else max(0.0, (x[0] + mu * t) / (1 + mu * mu))
            r[c] = [n, *(x[1:] * min(1.0, mu * n / t if t > 0 else 1.0))]
        if abs(r - before).max() <= 1e-14 * abs(r).max():
            break
    return r


if __name__ == "__main__":
    solvers = {"mine": {"method": mine, "law": "coulomb"}, **{name: {"method": name} for name in cb.methods}}
    seconds = {name: [] for name in solvers}
    for path in sorted(glob.glob(sys.argv[1] + "/*.hdf5")):
        problem = cb.Problem.read(path)
        for name, how in solvers.items():
            answer = cb.solve(problem, time_limit=5, **how)
            seconds[name].append(answer.seconds if answer else None)
    cb.performance_profile(seconds, sys.argv[2])
    for name, row in seconds.items():
        print(f"{name:12} answered {sum(s is not None for s in row)} of {len(row)}")
