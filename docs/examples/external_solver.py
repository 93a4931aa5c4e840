#!/usr/bin/python3
"""A contact solver of one's own that contactbench talks to (docs/external.md): projected Gauss-Seidel in numpy.

    contactbench run stack.xml --method external --command 'python3 external_solver.py' --law coulomb
"""
import sys

import numpy as np


def problems(stream):
    """Yields (M^-1 of each block, entries of J, v, w, mu): what comes on standard input, in binary."""
    stream.readline()  # contactbench 1
    print("ready binary", flush=True)
    while line := stream.readline():
        number, contacts, velocities, blocks, entries, size = map(int, line.split()[1:])
        body = stream.read(size)
        integers = np.frombuffer(body, np.int32, blocks + 2 * entries)
        x = np.frombuffer(body, np.float64, offset=integers.nbytes)
        first = np.concatenate([[0], np.cumsum(integers[:blocks])])
        at = 0

        def take(count):
            nonlocal at
            at += count
            return x[at - count:at]

        inverse = [np.linalg.inv(take(n * n).reshape(n, n)) for n in integers[:blocks]]
        J = [(c, slice(first[b], first[b + 1]), b, take(3 * integers[b]).reshape(-1, 3).T)
             for c, b in integers[blocks:].reshape(-1, 2)]
        yield inverse, J, take(velocities).copy(), take(3 * contacts).reshape(-1, 3), take(contacts)


def project(r, mu):
    """Onto the cone |r_t| <= mu r_n."""
    t = np.hypot(r[1], r[2])
    if t <= mu * r[0]:
        return r
    if mu * t <= -r[0]:
        return np.zeros(3)
    n = (r[0] + mu * t) / (1 + mu * mu)
    return np.array([n, *(r[1:] * mu * n / t)])


def solve(inverse, J, v, w, mu, r):
    entries = [[] for _ in mu]
    for c, rows, b, block in J:
        entries[c].append((rows, block, inverse[b] @ block.T))
        v[rows] += inverse[b] @ block.T @ r[c]
    weight = [sum(np.trace(block @ change) for _, block, change in of) / 3 for of in entries]
    for sweep in range(1, 20001):
        moved = 0
        for c, of in enumerate(entries):
            u = w[c] + sum(block @ v[rows] for rows, block, _ in of)
            u[0] += mu[c] * np.hypot(u[1], u[2])
            new = project(r[c] - u / weight[c], mu[c])
            for rows, _, change in of:
                v[rows] += change @ (new - r[c])
            moved = max(moved, abs(new - r[c]).max())
            r[c] = new
        if moved <= 1e-13 * abs(r).max():
            break
    return sweep


if __name__ == "__main__":
    r = np.zeros((0, 3))
    for inverse, J, v, w, mu in problems(sys.stdin.buffer):
        if len(r) != len(mu):
            r = np.zeros((len(mu), 3))  # else from the last answer
        sweeps = solve(inverse, J, v, w, mu, r)
        print("answer ok", sweeps, r.size, flush=True)
        sys.stdout.buffer.write(r.tobytes())
        sys.stdout.buffer.flush()
