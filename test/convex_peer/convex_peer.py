#!/usr/bin/env python3
"""The convex method against CVXOPT, a cone solver that shares no code with ours.

A handful of contact problems is made here (random systems, two islands, more contacts than a body can tell apart, a box
that slides and spins, a stack), written in Siconos' text form (W, q, mu) and solved twice: by `contactbench solve
--method convex` and by CVXOPT's interior point method as the program of lib/methods/drumwright_shell.cpp,

    min 1/2 r.W r + q.r,   u_n = (W r + q)_n >= 0,   |r_t| <= mu r_n,   sum of r_n of an island <= kappa,

with kappa the least sum of the frictionless normal impulses, found by trying every set of contacts. The impulses need
not be unique; the velocities u after the event and the change of kinetic energy are, and must agree.
Exit code: 0 agreement, 1 disagreement. Needs CVXOPT and numpy (Debian: python3-cvxopt).

usage: convex_peer.py PROGRAM [--tolerance 1e-6]
"""
import argparse
import itertools
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cvxopt
import cvxopt.solvers
import numpy as np

cvxopt.solvers.options.update(show_progress=False, maxiters=100)

# Problems: M (block diagonal), J (rows n, t1, t2 a contact), v_minus, mu.


def frame(rng):
    """Three orthonormal rows: n, t1, t2."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q


def rows(axes, arm):
    """Velocity of the point at `arm` along the axes, from (velocity, angular velocity) of its body."""
    x, y, z = arm
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.hstack([axes, -axes @ skew])


def random_system(seed, bodies, pairs):
    """Contacts at random places of bodies with random inertias; body -1 is the ground."""
    rng = np.random.default_rng(seed)
    M = np.zeros((6 * bodies, 6 * bodies))
    for b in range(bodies):
        inertia = rng.normal(size=(3, 3))
        M[6 * b:6 * b + 3, 6 * b:6 * b + 3] = rng.uniform(0.5, 2) * np.eye(3)
        M[6 * b + 3:6 * b + 6, 6 * b + 3:6 * b + 6] = 0.1 * (inertia @ inertia.T + np.eye(3))
    J = np.zeros((3 * len(pairs), 6 * bodies))
    for c, (first, second) in enumerate(pairs):
        axes = frame(rng)
        for body, sign in ((first, -1), (second, 1)):
            if body >= 0:
                J[3 * c:3 * c + 3, 6 * body:6 * body + 6] = sign * rows(axes, rng.uniform(-0.5, 0.5, 3))
    return M, J, rng.normal(size=6 * bodies), rng.uniform(0.2, 0.9, len(pairs))


def stack(boxes, mu, velocity):
    """Unit cubes of 1 kg on each other, four contacts an interface; `velocity` (6 a box): x, y up, z, then spin."""
    axes = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
    M = np.kron(np.eye(boxes), np.diag([1, 1, 1, 1 / 6, 1 / 6, 1 / 6]))
    J = np.zeros((12 * boxes, 6 * boxes))
    for b in range(boxes):
        for i, (x, z) in enumerate(((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))):
            at = slice(12 * b + 3 * i, 12 * b + 3 * i + 3)
            J[at, 6 * b:6 * b + 6] = rows(axes, (x, -0.5, z))
            if b > 0:
                J[at, 6 * b - 6:6 * b] = -rows(axes, (x, 0.5, z))
    return M, J, np.asarray(velocity, float), np.full(4 * boxes, mu)


def beside(first, second):
    """Two systems that do not touch."""
    def diagonal(a, b):
        return np.block([[a, np.zeros((a.shape[0], b.shape[1]))], [np.zeros((b.shape[0], a.shape[1])), b]])

    return (diagonal(first[0], second[0]), diagonal(first[1], second[1]), np.concatenate([
        first[2], second[2]]), np.concatenate([first[3], second[3]]))


def problems():
    rng = np.random.default_rng(7)
    one_body = random_system(3, 1, [(-1, 0)] * 2)
    yield "two bodies, three contacts", random_system(1, 2, [(-1, 0), (0, 1), (-1, 1)])
    yield "three bodies, six contacts", random_system(2, 3, [(-1, 0), (0, 1), (1, 2), (-1, 2), (0, 2), (-1, 1)])
    yield "two islands", beside(one_body, random_system(4, 2, [(-1, 0), (0, 1), (0, 1)]))
    # Little friction: where everything stops, the gap that CVXOPT can prove leaves u uncertain by its square root.
    M, J, v_minus, mu = random_system(5, 1, [(-1, 0)] * 8)
    yield "more contacts than a body tells apart", (M, J, v_minus, 0.2 * mu)
    yield "a box that slides", stack(1, 0.3, [0.5, -0.1, 0.2, 0, 0, 0])
    yield "a box that slides and spins", stack(1, 0.5, [0.5, -0.1, 0.2, 0.1, 1, -0.3])
    yield "a stack of two, perturbed", stack(2, 0.5, 0.05 * rng.normal(size=12) + np.tile([0, -0.01, 0, 0, 0, 0], 2))


# The program, with CVXOPT.


def matrix(a):
    return cvxopt.matrix(np.ascontiguousarray(a, dtype=float))


def islands(W):
    """Sets of contacts that W couples."""
    nc = len(W) // 3
    coupled = np.abs(W).reshape(nc, 3, nc, 3).max(axis=(1, 3)) > 1e-12 * np.abs(W).max()
    left, found = set(range(nc)), []
    while left:
        island, front = set(), {min(left)}
        while front:
            island |= front
            front = {j for i in front for j in np.flatnonzero(coupled[i])} - island
        found.append(sorted(island))
        left -= island
    return found


def least_sum(W, q):
    """kappa: the least sum of normal impulses that solve the frictionless problem of one island. It is attained at a
    vertex of the solutions, whose contacts with an impulse have a regular matrix: every set of contacts is tried."""
    Wn, qn = W[::3, ::3], q[::3]
    scale, least = np.abs(qn).max(), np.inf
    for count in range(len(qn) + 1):
        for pressed in itertools.combinations(range(len(qn)), count):
            at = list(pressed)
            if np.linalg.matrix_rank(Wn[np.ix_(at, at)], 1e-9, hermitian=True) < count:
                continue
            f = np.zeros(len(qn))
            f[at] = np.linalg.solve(Wn[np.ix_(at, at)], -qn[at])
            if f.min() > -1e-12 * scale / Wn.max() and (Wn @ f + qn).min() > -1e-12 * scale:
                least = min(least, f.sum())
    return least


def attempts():
    """CVXOPT's settings, strictest first: the first that it calls optimal is the reference. With kappa exact a flat
    scene has no strictly feasible impulses, which an interior point method may not survive; 1e-8 more of kappa changes
    the answer by about as much."""
    for tolerance in (1e-14, 1e-13, 1e-12, 1e-11):
        for kkt_solver in ("ldl", "chol"):
            for widening in (0, 1e-8):
                yield tolerance, kkt_solver, widening


def reference(W, q, mu, bounded):
    """u after the event, the change of kinetic energy, and the tolerance that CVXOPT met."""
    nc, n = len(mu), len(q)
    # Unknowns (y, r) with W = B B^T, y = B^T r: the objective 1/2 y.y + y.B^+ q is strictly convex in y.
    values, vectors = np.linalg.eigh(W)
    kept = values > 1e-10 * values[-1]
    B = vectors[:, kept] * np.sqrt(values[kept])
    rank = B.shape[1]
    # Velocities in units of the fastest: CVXOPT's tolerances are absolute.
    scale = np.abs(q).max()
    linear, limit = [np.hstack([-B[::3], np.zeros((nc, n))])], [q[::3] / scale]
    kappa = np.zeros(0)
    if bounded:
        for island in islands(W):
            at = [3 * c + i for c in island for i in range(3)]
            row = np.zeros((1, rank + n))
            row[0, [rank + 3 * c for c in island]] = 1
            linear.append(row)
            kappa = np.append(kappa, least_sum(W[np.ix_(at, at)], q[at]) / scale)
    cones = np.zeros((n, rank + n))
    cones[:, rank:] = -np.diag(np.column_stack([mu, np.ones(nc), np.ones(nc)]).ravel())
    objective = np.concatenate([np.linalg.lstsq(B, q / scale, rcond=None)[0], np.zeros(n)])
    square = np.diag(np.concatenate([np.ones(rank), np.zeros(n)]))
    for tolerance, kkt_solver, widening in attempts():
        cvxopt.solvers.options.update(abstol=tolerance, reltol=tolerance, feastol=max(1e-11, 10 * tolerance),
                                      refinement=3)
        try:
            bound = np.concatenate([*limit, kappa * (1 + widening), np.zeros(n)])
            solution = cvxopt.solvers.coneqp(matrix(square), matrix(objective), matrix(np.vstack([*linear, cones])),
                                             matrix(bound), {"l": nc + len(kappa), "q": [3] * nc, "s": []},
                                             matrix(np.hstack([np.eye(rank), -B.T])), matrix(np.zeros(rank)),
                                             kktsolver=kkt_solver)
        except (ArithmeticError, ValueError):  # a singular system on the way
            continue
        if solution["status"] == "optimal":
            r = scale * np.array(solution["x"]).ravel()[rank:]
            return W @ r + q, q @ r + r @ W @ r / 2, tolerance
    raise ArithmeticError("CVXOPT finds no answer that it calls optimal")


# The same, with the program under test.


def write(path, W, q, mu):
    """Siconos' text form: dimension, contacts, storage (0: dense), size twice, W, q, mu."""
    n = len(q)
    lines = ["3", str(len(mu)), "0", str(n), str(n), f"{n} {n}"]
    lines += [" ".join(f"{x:.17e}" for x in row) for row in (*W, q, mu)]
    path.write_text("\n".join(lines) + "\n")


def ours(path, W, q, mu, bounded, folder):
    problem, out = folder / "problem.dat", folder / "r.mtx"
    write(problem, W, q, mu)
    out.unlink(missing_ok=True)
    run = subprocess.run([path, "solve", problem, "--kind", "contact", "--method", "convex", "--epsilon-relative", "1e-13",
                          "--compression-bound", "on" if bounded else "off", "--json", "--out", out], capture_output=True,
                         text=True, timeout=60)
    if not out.exists():
        raise ArithmeticError(f"exit code {run.returncode}: {(run.stderr or run.stdout).strip()[:300]}")
    r = np.loadtxt(out, comments="%", skiprows=2)
    return W @ r + q, q @ r + r @ W @ r / 2, json.loads(run.stdout)["status"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, help="contactbench")
    parser.add_argument(
        "--tolerance", type=float, default=1e-6,
        help="accepted difference of u as a fraction of the fastest u before, of the energy change as a "
        "fraction of the energy of the event [1e-6]")
    args = parser.parse_args()
    failures = 0
    print(f"{'problem':40} {'bound':6} {'dKE, J':>14} {'error of u':>11} {'of dKE':>9}  status, CVXOPT's tolerance")
    with tempfile.TemporaryDirectory() as folder:
        for name, (M, J, v_minus, mu) in problems():
            W = J @ np.linalg.solve(M, J.T)
            W, q = (W + W.T) / 2, J @ v_minus
            energy = v_minus @ M @ v_minus / 2
            for bounded in (True, False):
                try:
                    u, change, met = reference(W, q, mu, bounded)
                    u_ours, change_ours, status = ours(args.program, W, q, mu, bounded, Path(folder))
                except (ArithmeticError, subprocess.TimeoutExpired) as error:
                    print(f"{name:40} {'on' if bounded else 'off':6} FAILS: {error}")
                    failures += 1
                    continue
                error_u = np.abs(u - u_ours).max() / np.abs(q).max()
                error_change = abs(change - change_ours) / energy
                good = status == "ok" and error_u <= args.tolerance and error_change <= args.tolerance
                failures += not good
                bound, fails = "on" if bounded else "off", "" if good else "  FAILS"
                print(f"{name:40} {bound:6} {change_ours:14.6e} {error_u:11.1e} {error_change:9.1e}  "
                      f"{status}, {met:.0e}{fails}")
    print("agreement" if failures == 0 else f"{failures} disagreements")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
