#!/usr/bin/env python3
"""A second referee, by the formulas of docs/judging.md alone and without code of the first: dense matrices, numpy. It judges the
problems and answers that second_referee_answers prints (answers.cpp), and where it finds anything else than the first one did, but
for rounding, the test has failed.

  second_referee.py PROGRAM                  stored problems, 1000 random answers, every event of four runs
  second_referee.py PROGRAM random 1000 7    only what PROGRAM prints for these arguments
"""
import dataclasses
import json
import math
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
from contactbench import start  # noqa: E402

start.need(("numpy",))
import numpy as np  # noqa: E402

ACCEPTED = 1e-9
FIRST_LOOK = 1e-12
UNITS = 128
EPS = 2.0**-52
# What the two may differ by, in parts of the 128 roundings that are excused.
NEAR = 0.1
RANDOM = ("random", "1000", "7")
RUNS = [("run", str(ROOT / "scenarios/sliding_box.xml"), "ap", "200"), ("run", str(ROOT / "scenarios/stack.xml"), "convex", "60"),
        ("run", str(ROOT / "scenarios/impacting_sphere.xml"), "mirtich", "1000"),
        ("run", str(ROOT / "scenarios/sliding_box.xml"), "coulomb", "200")]


def over(error, size):
    """An error as a ratio, elementwise."""
    error, size = np.broadcast_arrays(np.asarray(error, float), np.asarray(size, float))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(error > 0, np.where(size > 0, error / np.where(size > 0, size, 1), np.inf), 0.0)
        return np.where(np.isfinite(error) & (size < np.inf) | (error == -np.inf), ratio, np.inf)


def largest(*ratios):
    return max((float(np.max(r)) for r in ratios if np.size(r)), default=0.0)


class Problem:
    def __init__(self, line):
        self.name = line["problem"]
        sizes = [math.isqrt(len(block)) for block in line["M"]]
        first = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        self.nv, self.nc = int(first[-1]), len(line["mu"])
        self.M = np.zeros((self.nv, self.nv))
        for b, block in enumerate(line["M"]):
            self.M[first[b] : first[b + 1], first[b] : first[b + 1]] = np.reshape(block, (sizes[b], sizes[b]), order="F")
        self.J = np.zeros((3 * self.nc, self.nv))
        touched = [[] for _ in range(self.nc)]
        for entry in line["J"]:
            c, b = entry["contact"], entry["block"]
            self.J[3 * c : 3 * c + 3, first[b] : first[b + 1]] = np.reshape(entry["columns"], (3, sizes[b]), order="F")
            touched[c].append(b)
        self.v, self.w = np.array(line["v"]), np.array(line["w"])
        self.mu, self.e = np.array(line["mu"]), np.array(line["e"])
        self.MiJt = np.zeros((self.nv, 3 * self.nc))
        self.blocks = [slice(first[b], first[b + 1]) for b in range(len(sizes))]
        for rows in self.blocks:
            self.MiJt[rows] = np.linalg.solve(self.M[rows, rows], self.J[:, rows].T)
        self.W = self.J @ self.MiJt
        J3 = self.J.reshape(self.nc, 3, self.nv)
        self.limit = ~np.any(J3[:, 1:, :] != 0, axis=(1, 2)) & (self.mu == 0)
        diagonal = np.diag(self.W).reshape(self.nc, 3)
        self.weight = np.where(self.limit, diagonal[:, 0], diagonal.mean(axis=1))
        self.u_minus = (self.J @ self.v + self.w).reshape(self.nc, 3)
        self.island = islands(touched, len(sizes))
        self.islands = max(self.island, default=-1) + 1

    def sums(self, values):
        return np.bincount(self.island, weights=values, minlength=self.islands)

    def most(self, values, least=0.0):
        out = np.full(self.islands, float(least))
        np.maximum.at(out, self.island, values)
        return out


def islands(touched, blocks):
    """Of each contact; contacts are joined by the blocks that they touch."""
    parent = list(range(blocks))

    def root(b):
        while parent[b] != b:
            b = parent[b]
        return b

    for group in touched:
        for b in group[1:]:
            parent[root(b)] = root(group[0])
    numbers = {}
    return [numbers.setdefault(root(group[0]), len(numbers)) for group in touched]


def norm(x):
    return np.sqrt(np.sum(np.square(x), axis=1))


@dataclasses.dataclass
class Look:
    """What is found with the sizes of one look, and what the last bits may make of it."""

    model: float = math.inf
    tolerance: float = 0.0        # of ratios
    model_tolerance: float = 0.0  # of what gaps add to `model`
    infeasibility: float | None = None
    gap: float | None = None
    gap_tolerance: float = 0.0    # J
    holds: bool = False
    near: bool = False            # does `holds` hang on the last bits?


class Judgement:
    """One answer to one problem. `looks`: what is found with the sizes of the first look, the second, and the third."""

    def __init__(self, p, answer):
        self.p, self.answer, self.looks = p, answer, []
        r = self.vector("r", 3 * p.nc)
        self.finite = r is not None and bool(np.all((p.weight > 0) & (p.weight < np.inf)))
        if not self.finite:
            return
        self.r = r.reshape(p.nc, 3)
        self.v_plus = p.v + p.MiJt @ r
        self.u = (p.J @ self.v_plus + p.w).reshape(p.nc, 3)
        self.root = np.sqrt(p.weight)
        self.elastic = p.most(p.e != 0) > 0  # by islands
        self.two_phases = self.elastic[p.island]
        self.find_terms()
        self.first_sizes()
        self.finite = bool(np.all(np.isfinite(self.S_g)))
        if not self.finite:
            return
        self.observe()
        self.looks.append(self.judge())
        self.second_sizes()
        self.looks.append(self.judge())
        self.third_sizes()
        self.looks.append(self.judge())

    def expected(self):
        """The look that counts; those that may, where it hangs on the last bits whether there is another one."""
        may = []
        for look in self.looks[:-1]:
            limit = ACCEPTED if look.gap is not None else FIRST_LOOK
            value = look.model if look.gap is None else look.infeasibility
            near = abs(value - limit) <= look.tolerance or look.near
            passes = look.model <= FIRST_LOOK
            if look.gap is not None:
                near = near or abs(look.model - ACCEPTED) <= look.tolerance + look.model_tolerance
                passes = look.holds and look.model <= ACCEPTED
            if near or passes:
                may.append(look)
            if passes and not near:
                return may
        return [*may, self.looks[-1]]

    def vector(self, name, count):
        values = self.answer[name]
        if len(values) != count or any(x is None for x in values):
            return None
        return np.array(values, float)

    def observe(self):
        """What is true of any answer."""
        p, r, u = self.p, self.r, self.u
        slip = norm(u[:, 1:])
        self.approach = largest(-u[:, 0], 0.0)
        self.cone_violation = largest(norm(r - on_cone(r, p.mu)), 0.0)
        self.dissipation_gap = largest(p.mu * r[:, 0] * slip + np.sum(r[:, 1:] * u[:, 1:], axis=1), 0.0)
        w = p.w.reshape(p.nc, 3)
        self.energy_gain = float(np.sum(r * (u + p.u_minus - 2 * w)) / 2)
        self.energy_before = float(p.v @ p.M @ p.v / 2)
        self.law = None
        if not np.any(self.elastic):
            changed = u.copy()
            changed[:, 0] += p.mu * slip
            e = r - on_cone(r - changed / p.weight[:, None], p.mu)
            self.law_tolerance = self.noise(self.S_g[p.island]) * math.sqrt(p.nc)
            self.law = largest(over(np.sqrt(p.sums(p.weight * norm(e) ** 2)), self.S_g))

    def find_terms(self):
        """What velocities are sums of, and what their rounding leaves open of them."""
        p = self.p
        loads = np.abs(self.r)
        f = self.answer["f"]
        if len(f) == p.nc and self.answer["bounded"]:
            loads[:, 0] += [abs(x) if x is not None and not two_phases else 0.0 for x, two_phases in zip(f, self.two_phases)]
        self.d = (np.abs(p.J) @ (np.abs(p.MiJt) @ loads.ravel())).reshape(p.nc, 3)
        moved = p.MiJt @ self.r.ravel()
        momenta = np.maximum(np.abs(p.M) @ np.abs(moved), np.abs(p.J).T @ loads.ravel())
        m = np.zeros(3 * p.nc)
        for rows in p.blocks:
            energy = max(float(moved[rows] @ p.M[rows, rows] @ moved[rows]), 0.0)
            largest_entries = np.sqrt(energy * np.maximum(np.sum(p.J[:, rows] * p.MiJt[rows].T, axis=1), 0.0))
            m += np.maximum(np.abs(p.MiJt[rows]).T @ momenta[rows], largest_entries)
        before = (np.abs(p.J) @ np.abs(p.v) + np.abs(p.w)).reshape(p.nc, 3)
        rho = UNITS * EPS * np.maximum(norm(self.d + before), norm(m.reshape(p.nc, 3)))
        stop = np.maximum(np.abs(self.u), np.abs(p.u_minus)) / p.weight[:, None]
        self.stops = (np.abs(p.J) @ (np.abs(p.MiJt) @ stop.ravel())).reshape(p.nc, 3)
        self.terms_rho = np.where(p.limit, rho, p.most(np.where(p.limit, 0.0, rho))[p.island])

    def first_sizes(self):
        p = self.p
        parts = [self.root * norm(self.r), norm(self.u) / self.root, norm(p.u_minus) / self.root]
        self.S_g = np.sqrt(np.maximum.reduce([p.sums(part**2) for part in parts]))
        self.S = np.maximum.reduce(parts)
        self.Q_g = np.sqrt(p.sums(parts[2] ** 2))
        self.rho = np.zeros(p.nc)

    def second_sizes(self):
        p = self.p
        U = p.most(np.where(p.limit, 0.0, np.maximum(norm(self.u), norm(p.u_minus))))
        shared = np.where(p.limit, 0.0, np.minimum(self.S_g[p.island], U[p.island] / self.root))
        self.S = np.maximum(self.S, shared)

    def third_sizes(self):
        p = self.p
        self.rho = self.terms_rho
        F = self.rho / (ACCEPTED * self.root)
        stopped = np.where(p.limit, np.minimum(self.S_g[p.island], norm(self.stops) / self.root), 0.0)
        self.S = np.maximum.reduce([self.S, norm(self.d) / self.root, stopped, F])
        floor = np.sqrt(p.sums(F**2))
        self.S_g, self.Q_g = np.maximum(self.S_g, floor), np.maximum(self.Q_g, floor)

    def noise(self, *sizes):
        """What rounding may make of a ratio: some roundings of a velocity over the size of its contact."""
        base = NEAR * (1 + self.p.mu) * self.terms_rho / self.root
        return largest(*(over(base, size) for size in sizes))

    def judge(self):
        law = self.answer["law"]
        if law == "convex" and not (self.p.islands and np.all(self.elastic)):
            return self.convex()
        model = {"coulomb": self.coulomb, "ap": self.polygon, "soft": self.soft}.get(law, lambda: self.impact(law))()
        look = Look(model=model, tolerance=self.noise(self.S_g[self.p.island] if law == "convex" else self.S))
        if law != "newton":
            gaining = self.elastic if law in ("convex", "soft") else np.ones(self.p.islands, bool)
            look.model = largest(look.model, self.gains()[gaining])
            look.tolerance += self.gain_noise(gaining)
        if law != "soft":
            look.model = largest(look.model, self.approaching())
            look.tolerance += self.noise(self.before())
        look.holds = look.model <= ACCEPTED
        look.near = abs(look.model - ACCEPTED) <= look.tolerance
        return look

    def work(self, r, u):
        """Of impulses r after which contacts move with u, on each island, as seen from the stops."""
        return self.p.sums(np.sum(r * (u + self.p.u_minus), axis=1) / 2)

    def gains(self):
        """Energy that restitution gains."""
        return over(self.work(self.r, self.u), self.gain_size())

    def gain_size(self):
        p, r = self.p, self.r
        before = np.abs(p.sums(np.sum(r * p.u_minus, axis=1))) / 4
        allowed = np.minimum(self.answer["epsilon"] / ACCEPTED, self.S_g**2)
        return np.maximum(np.maximum(before, self.open_work(r, self.u, self.rho) / ACCEPTED), allowed)

    def open_work(self, r, u, rho):
        return self.p.sums(rho * (norm(r) + (norm(u) + norm(self.p.u_minus) + rho) / self.p.weight))

    def gain_noise(self, islands):
        return NEAR * largest(over(self.open_work(self.r, self.u, self.terms_rho), self.gain_size())[islands])

    def feasible(self, S, gives=0.0):
        p, r = self.p, self.r
        return (over(-(self.u[:, 0] + gives) / self.root, S), over(-r[:, 0] * self.root, S),
                over((norm(r[:, 1:]) - p.mu * r[:, 0]) * self.root, S))

    def impact(self, law):
        p, r, u = self.p, self.r, self.u
        S = self.S_g[p.island] if law == "convex" else self.S
        out = largest(*self.feasible(S))
        if law == "newton":
            alone = p.sums(np.ones(p.nc))[p.island] == 1
            wrong = np.where(p.u_minus[:, 0] < 0, np.abs(u[:, 0] + p.e * p.u_minus[:, 0]) / self.root, self.root * norm(r))
            out = largest(out, over(wrong, self.S)[alone])
        if law == "mirtich":
            stored, returned, friction = (self.vector(part, p.nc) for part in ("compression", "restitution", "friction"))
            if stored is None or returned is None or friction is None:
                return math.inf
            energy = self.S_g**2
            balance = stored + returned + friction - np.sum(r * (u + p.u_minus), axis=1) / 2
            out = largest(out, over(np.abs(returned + p.e**2 * stored), energy[p.island]), *(over(taken, energy[p.island]) for taken in (stored, -returned, friction)),
                          over(np.abs(p.sums(balance)), energy))
        return out

    def coulomb(self):
        p = self.p
        changed = self.u.copy()
        changed[:, 0] += p.mu * norm(self.u[:, 1:])
        e = self.r - on_cone(self.r - changed / p.weight[:, None], p.mu)
        F = self.rho / (ACCEPTED * self.root)
        law = over(norm(self.root[:, None] * e), np.maximum(self.S, (1 + p.mu) * F))
        return self.by_phases(law, self.feasible(self.S))

    def by_phases(self, law, feasible):
        """The law itself on islands without restitution, feasibility on the others."""
        return largest(law[~self.two_phases], *(ratio[self.two_phases] for ratio in feasible))

    def before(self):
        """Q_g, or what rounding makes of a contact."""
        return np.maximum(self.Q_g[self.p.island], self.rho / (ACCEPTED * self.root))

    def approaching(self):
        return over(-self.u[:, 0] / self.root, self.before())

    def given_way(self):
        """R of each contact, of n, t1 and t2."""
        p, soft = self.p, self.answer["softness"]
        blocks = np.array([p.W[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] for c in range(p.nc)]).reshape(p.nc, 3, 3)
        if soft["rule"] == "mujoco":
            normal = blocks[:, 0, 0] * (1 / soft["impedance"] - 1)
            along = normal / soft["impratio"]
        else:
            w = np.where(p.limit, blocks[:, 0, 0], np.sqrt(np.sum(blocks**2, axis=(1, 2))) / 3)
            normal = np.maximum(w * (soft["beta"] / (2 * math.pi)) ** 2, soft["compliance"])
            along = soft["sigma"] * w
        return np.stack([normal, along, along], axis=1)

    def soft(self):
        """The natural map of the regularised law."""
        p = self.p
        gives = self.given_way() * self.r
        law = over(self.root * norm(self.r - on_cone(self.r - (self.u + gives) / p.weight[:, None], p.mu)), self.S)
        return self.by_phases(law, self.feasible(self.S, gives[:, 0]))

    def polygon(self):
        p, k = self.p, self.answer["k"]
        unknowns = (k + 2) * p.nc
        z = self.vector("z", unknowns * (2 if np.any(self.elastic) else 1))
        if z is None:
            return math.inf
        angles = 2 * math.pi * np.arange(k) / k
        d = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        given_back, total, squares, share = np.zeros(p.nc), np.zeros((p.nc, 3)), np.zeros(p.nc), 0.0
        phases = z.reshape(-1, unknowns)
        for i, phase in enumerate(phases):
            c_n, c_t, lam = phase[: p.nc], phase[p.nc : (k + 1) * p.nc].reshape(p.nc, k), phase[(k + 1) * p.nc :]
            total[:, 0] += c_n + given_back
            total[:, 1:] += c_t @ d
            u = self.u if i == len(phases) - 1 else (p.J @ (p.v + p.MiJt @ total.ravel()) + p.w).reshape(p.nc, 3)
            w = p.weight
            squares += np.minimum(c_n, u[:, 0] / w) ** 2
            squares += np.sum(np.minimum(c_t, (u[:, 1:] @ d.T + lam[:, None]) / w[:, None]) ** 2, axis=1)
            squares += np.minimum(lam / w, p.mu * (c_n + given_back) - c_t.sum(axis=1)) ** 2
            if i < len(phases) - 1:
                given_back, share = self.given_back(p.e * c_n, c_n + phases[1][: p.nc], total, u)
        squares += np.sum((total - self.r) ** 2, axis=1)
        return largest(over(self.root * np.sqrt(squares), self.S), share)

    def given_back(self, asked, phases, compression, u):
        """theta e c_n by what r is beside both phases, and how far theta is from 1, and from what leaves E = 0."""
        p = self.p
        squares = p.sums(p.weight * asked**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            theta = np.where(squares > 0, p.sums(p.weight * asked * (self.r[:, 0] - phases)) / squares, 1.0)
        given = theta[p.island] * asked
        r = compression + np.stack([given, 0 * given, 0 * given], axis=1)
        after = (p.J @ (p.v + p.MiJt @ r.ravel()) + p.w).reshape(p.nc, 3)
        E_0, E = self.work(compression, u), self.work(r, after)
        size = np.maximum(np.abs(E_0) + np.abs(E - E_0), self.open_work(r, after, self.rho) / ACCEPTED)
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.where(size > 0, np.abs(E) / size, 0.0)
            missing = np.abs(np.where(self.S_g > 0, (1 - theta) * np.sqrt(squares) / self.S_g, 0.0))
        some = (theta > -ACCEPTED) & (theta < 1 + ACCEPTED)
        return given, largest(np.where(some, np.minimum(missing, left), missing))

    def convex(self):
        p, r, u, root, bounded = self.p, self.r, self.u, self.root, self.answer["bounded"]
        eta = self.vector("eta", p.nc)
        if eta is None:
            return Look(model=math.inf, infeasibility=math.inf, gap=math.inf)
        S, optimal = self.S_g[p.island], ~self.two_phases
        y = u - (p.W[:, ::3] @ eta).reshape(p.nc, 3)
        short_of = p.mu * norm(y[:, 1:]) - y[:, 0]
        ratios = [*self.feasible(S), over(-eta * root, S)[optimal], self.gains()[self.elastic]]
        free = ~p.limit & bounded & optimal  # where the bound's multiplier helps
        F = self.rho / (ACCEPTED * root)
        ratios.append(self.approaching())
        ratios.append(over(np.where(free, 0, short_of / root), np.maximum(S, (1 + p.mu) * F))[optimal])
        s = p.most(np.where(free, short_of, 0.0))
        kappa = np.zeros(p.islands)
        if bounded:
            kappa, proof = self.least_sum()
            ratios += proof
        s_c = np.where(p.limit, 0.0, s[p.island])
        total = p.sums(np.where(p.limit, 0.0, r[:, 0]))
        gaps = p.sums(eta * np.maximum(u[:, 0], 0) + np.sum(r * y, axis=1)) + s * np.maximum(kappa, total)
        gaps[self.elastic] = 0

        def rounding(rho):
            return p.sums(rho * (norm(r) + np.abs(eta) + (norm(y) + s_c) / p.weight)) + p.most((1 + p.mu) * rho) * np.abs(kappa)

        energy = self.S_g**2
        beyond = float(np.sum(np.maximum(np.abs(gaps) - np.minimum(rounding(self.rho), ACCEPTED * energy), 0)))
        epsilon = self.answer["epsilon"]
        noise = NEAR * rounding(self.terms_rho)  # of a gap
        look = Look(infeasibility=largest(*ratios), gap=float(np.sum(gaps)), gap_tolerance=float(np.sum(noise)))
        look.tolerance = self.noise(S, self.Q_g[p.island], self.before()) + (self.proof_noise() if bounded else 0) + self.gain_noise(self.elastic)
        look.model = largest(look.infeasibility, over(np.abs(gaps), energy))
        look.model_tolerance = largest(over(noise, energy))
        look.holds = look.infeasibility <= ACCEPTED and beyond <= epsilon
        look.near = abs(look.infeasibility - ACCEPTED) <= look.tolerance or abs(beyond - epsilon) <= 1e-6 * epsilon + look.gap_tolerance
        return look

    def proof_noise(self):
        """Of N z, which is about 1."""
        z = self.vector("kappa_dual", self.p.nv)
        return 0.0 if z is None else NEAR * UNITS * EPS * largest(np.abs(self.p.J[::3]) @ np.abs(z), 1.0)

    def least_sum(self):
        """kappa of each island, and the errors of its proof."""
        p, root = self.p, self.root
        f, z = self.vector("f", p.nc), self.vector("kappa_dual", p.nv)
        if f is None or z is None:
            return np.zeros(p.islands), [np.inf]
        u_f = (p.u_minus + (p.W[:, ::3] @ f).reshape(p.nc, 3))[:, 0] / root
        load, a, one, Q, optimal = f * root, (p.J @ z)[::3], np.where(p.limit, 0.0, 1.0), self.Q_g[p.island], ~self.two_phases
        touches = ACCEPTED * Q
        if np.any(self.rho > 0):
            miss = p.most(np.maximum(-u_f, np.minimum(load, u_f)))
            touches = np.minimum(touches, self.rho / root + miss[p.island])
        kappa = p.sums(np.where(optimal, one * f, 0.0))
        K = np.maximum(np.abs(kappa), p.sums((np.abs(p.u_minus[:, 0]) + self.rho / ACCEPTED) / p.weight))
        total = p.sums(one * self.r[:, 0])
        proof = [over(-load, Q), over(-u_f, Q), over(np.minimum(load, u_f), Q), over(np.minimum((one - a) * Q, load), Q),
                 over(np.where(u_f <= touches, a - one, 0), 1)]
        return kappa, [*(ratio[optimal] for ratio in proof), over(total - kappa, K)[~self.elastic]]


def on_cone(x, mu):
    """Projection on |x_t| <= mu x_n, row by row."""
    n, t = x[:, 0], norm(x[:, 1:])
    out = x.copy()
    along = (n + mu * t) / (1 + mu**2)
    outside, polar = t > mu * n, mu * t <= -n
    out[outside, 0] = along[outside]
    with np.errstate(divide="ignore", invalid="ignore"):
        shrink = np.where(t > 0, mu * along / t, 0)
    out[outside, 1:] = x[outside, 1:] * shrink[outside, None]
    out[polar] = 0
    return out


def same(a, b, relative, absolute=0.0):
    a, b = (math.inf if x is None or math.isnan(x) else x for x in (a, b))
    return a == b or abs(a - b) <= relative * max(abs(a), abs(b)) + absolute


def unlike(look, first):
    """What of a look the first referee found differently."""
    out = []
    for name in ("gap", "infeasibility"):
        if (first[name] == "none") != (getattr(look, name) is None):
            return [f"{name} is not given by both"]
    if not same(first["model"], look.model, 1e-6, look.tolerance + look.model_tolerance):
        out.append(f"residual {first['model']} and {look.model}")
    if look.gap is not None:
        if not same(first["gap"], look.gap, 1e-6, look.gap_tolerance):
            out.append(f"gap {first['gap']} and {look.gap}")
        if not same(first["infeasibility"], look.infeasibility, 1e-6, look.tolerance):
            out.append(f"infeasibility {first['infeasibility']} and {look.infeasibility}")
    return out


def differences(judgement, first):
    """What the two find differently, and whether a verdict hangs on the last bits."""
    if first["finite"] != judgement.finite:
        return ["finite"], False
    if not judgement.finite:
        return (["holds"] if first["holds"] else []), False
    out = min((unlike(look, first) for look in judgement.expected()), key=len)
    holds = any(look.holds for look in judgement.looks)  # sizes of a later look excuse more, not less
    near = any(look.near for look in judgement.looks)
    if first["holds"] != holds and not near:
        out.append(f"holds: {first['holds']} and {holds}")
    p, rho = judgement.p, NEAR * judgement.terms_rho
    work = float(np.sum(rho * norm(judgement.r) * (1 + p.mu)))
    for name, rounding in {"approach": np.max(rho), "cone_violation": UNITS * EPS * np.max(np.abs(judgement.r)), "dissipation_gap": work, "energy_gain": work,
                           "energy_before": 0.0}.items():
        if math.isfinite(rounding) and not same(first[name], getattr(judgement, name), 1e-9, rounding):
            out.append(f"{name} {first[name]} and {getattr(judgement, name)}")
    if (judgement.law is None) != (first["law"] == "none"):
        out.append("law residual is not given by both")
    elif judgement.law is not None and not same(first["law"], judgement.law, 1e-6, judgement.law_tolerance):
        out.append(f"law residual {first['law']} and {judgement.law}")
    return out, first["holds"] != holds and near


def compare(program, arguments, counts):
    process = subprocess.Popen([program, *arguments], stdout=subprocess.PIPE, text=True)
    problem = None
    for text in process.stdout:
        line = json.loads(text)
        if "problem" in line:
            problem = Problem(line)
            continue
        judgement = Judgement(problem, line)
        found, near = differences(judgement, line["first"])
        counts["answers"] += 1
        counts["right"] += bool(line["first"]["holds"])
        counts["at the threshold"] += near
        if found:
            counts["different"] += 1
            print(f"{problem.name}: {line['answer']}: first and second referee differ: " + "; ".join(found))
    if process.wait() != 0:
        counts["different"] += 1
        print(f"{program} {' '.join(arguments)}: exit code {process.returncode}")


def main():
    np.seterr(over="ignore", invalid="ignore")  # an answer may be anything
    program, asked = sys.argv[1], tuple(sys.argv[2:])
    files = sorted(str(f) for folder in ("test/data", "scenarios/stress/problems") for f in (ROOT / folder).rglob("*")
                   if f.suffix in (".hdf5", ".dat") and "broken" not in f.parts)
    status = 0
    for arguments in [asked] if asked else [("stored", *files), RANDOM, *RUNS]:
        counts = dict.fromkeys(("answers", "right", "at the threshold", "different"), 0)
        compare(program, arguments, counts)
        what = f"stored ({len(files)} files)" if arguments[0] == "stored" else " ".join(Path(a).name for a in arguments)
        print(f"{what}: " + ", ".join(f"{value} {name}" for name, value in counts.items()))
        if counts["different"] or not counts["answers"] or counts["at the threshold"] > counts["answers"] / 50:
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
