"""What others found of engines on our scenes (docs/engines.md, "What came out"), measured again: each finding is runs,
a number of each, and what the numbers must be for it to come out. `scripts/engines.py findings` prints them and writes
findings.json; a finding that is contradicted is an outcome and no fault."""
import dataclasses
import json
import math
import tempfile
from pathlib import Path
from typing import Callable

import numpy as np

from . import program
from .runs import series

STRESS = program.ROOT / "scenarios" / "stress"
EIGHTH = "0.78539816339744831"
LOST = 0.1  # m: a box of a stack that moves further is lost
HELD = 0.01  # of the way that Coulomb's law gives, as the preflight allows: less is no sliding


@dataclasses.dataclass(frozen=True)
class Case:
    """A run, as the words after `contactbench run`, and what it is called in the table."""
    name: str
    words: tuple


@dataclasses.dataclass(frozen=True)
class Finding:
    says: str
    engine: str
    cases: tuple
    number: Callable  # of (summary, folder)
    unit: str
    comes_out: Callable  # of the numbers in the order of the cases
    lost: bool = False  # whether a run that does not finish is what the finding says; it counts as infinitely far then


def furthest(folder):
    """Way of the body that went furthest from its start, m."""
    t, *places = series(folder / "trajectory.csv", "t", "px", "py", "pz")
    if t.size == 0:
        return math.nan
    bodies = int((t == t[0]).sum())
    at = np.array(places).T
    whole = len(at) // bodies * bodies
    return float(np.max(np.linalg.norm((at[:whole].reshape(-1, bodies, 3) - at[:bodies]), axis=2)))


def moved(_, folder):
    return furthest(folder)


def way(_, folder):
    """From the first place to the last, m."""
    _, *places = series(folder / "trajectory.csv", "t", "px", "py", "pz")
    return math.dist(*([float(p[i]) for p in places] for i in (0, -1)))


def error(name):
    def of(summary, _):
        value = summary["errors"].get(name)
        return math.nan if value is None else value

    return of


def case(name, scene, engine, variant, *words):
    return Case(name, (scene, "--engine", engine, "--variant", variant, *words))


def pushed(engine, variant):
    """The pushed box at 45 degrees, and along x, where the pyramid is Coulomb's law."""
    return tuple(
        case(name, "sliding_box", engine, variant, "--step", "1e-3", "--set", f"push_angle={angle}")
        for name, angle in (("along x", "0"), ("at 45 degrees", EIGHTH)))


def held_at_45_degrees(way_along, way_across):
    return way_across <= HELD * way_along


def stacks(variant):
    return tuple(
        case(f"{n} boxes", "stack", "ode", variant, "--step", "1e-3", "--duration", "1", "--set", f"boxes={n}")
        for n in (1, 2, 4, 8, 16))


def ratios(variant):
    return tuple(
        case(f"{ratio:g}", str(STRESS /
                               "mass_ratio.xml"), "bullet", variant, "--step", "1e-3", "--set", f"ratio={ratio:g}")
        for ratio in (1, 1e2, 1e3, 1e4, 1e6))


# Of its first way of solving; the box creeps on at a constant rate, so that a way belongs to a time.
CREEP = tuple(
    case(f"h = {h} s", "sticking_box", "mujoco", "newton-elliptic", "--step", h, "--duration", "2")
    for h in ("1e-2", "1e-3", "1e-4"))

FINDINGS = (*(Finding(f"the friction pyramid of {engine} ({variant}) holds a box that is pushed at 45 degrees", engine,
                      pushed(engine, variant), way, "m", held_at_45_degrees)
              for engine, variant in (("dart", "dantzig"), ("ode", "quick"), ("ode", "world"))),
            Finding("MuJoCo at its defaults creeps by 3.8e-3 to 4e-3 m in 2 s", "mujoco", CREEP[1:],
                    error("position_linf_m"), "m", lambda *creeps: 3.75e-3 <= min(creeps) and max(creeps) <= 4.05e-3),
            Finding("that creep does not depend on the step", "mujoco", CREEP, error("creep_rate_m_per_s"), "m/s",
                    lambda *rates: max(rates) <= 1.001 * min(rates)),
            Finding(
                "MuJoCo rebounds at e = 0 in a sliding impact", "mujoco",
                (case("velocity after, error", "impacting_sphere", "mujoco", "newton-elliptic", "--step", "1e-3"), ),
                error("velocity_after_impact_m_per_s"), "m/s", lambda off: off >= 0.1),
            Finding("ODE's direct solver loses stacks from 4 to 8 boxes on", "ode", stacks("world"), moved, "m",
                    lambda *of: max(of[:2]) < 1e-3 and min(of[3:]) > LOST, lost=True),
            Finding("sequential impulses break at mass ratios of 1e2 to 1e4", "bullet", ratios("si10"), moved, "m",
                    lambda *of: of[0] < 1e-3 and min(of[3:]) > LOST, lost=True))


def measure(path, of, finding, limit):
    """(number, how it ended) of one run; infinite where it did not finish."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            ended = program.call(path, "run", *of.words, "--out", folder, "--json", "--time-limit", limit,
                                 timeout=3 * limit + 20)
        except program.Late:
            return math.inf, "did not come back"
        try:
            summary = json.loads(ended.stdout)
        except ValueError:
            return math.inf, ended.stderr.strip() or f"exit code {ended.returncode}"
        number = finding.number(summary, Path(folder)) if summary["finished"] else math.inf
        return number, summary["status"]


def outcome(path, finding, listed, limit=60):
    """A row of findings.json."""
    row = {"says": finding.says, "engine": finding.engine, "unit": finding.unit, "runs": []}
    missing = next((e["unavailable"] for e in listed["engines"] if e["name"] == finding.engine), "no such engine")
    if missing:
        return row | {"comes_out": None, "unavailable": missing}
    numbers = []
    for of in finding.cases:
        number, status = measure(path, of, finding, limit)
        numbers.append(number)
        row["runs"].append({"name": of.name, "number": number if math.isfinite(number) else None, "status": status})
    # A run without a number says nothing for a finding, and nothing against it.
    judged = all(math.isfinite(n) or finding.lost and n == math.inf for n in numbers)
    return row | {"comes_out": bool(finding.comes_out(*numbers)) if judged else None, "unavailable": None}


def verdict(row):
    """In words."""
    if row["unavailable"]:
        return f"not measured ({row['unavailable']})"
    return {None: "not measured (a run has no number)", True: "comes out again",
            False: "contradicted"}[row["comes_out"]]


def said(row):
    """In a line."""
    numbers = "; ".join(
        f"{r['name']}: {r['number']:.3g} {row['unit']}" if r["number"] is not None else f"{r['name']}: {r['status']}"
        for r in row["runs"])
    return f"{verdict(row)}: {row['says']}" + (f" ({numbers})" if numbers else "")


def write(path, listed, out):
    rows = []
    for finding in FINDINGS:
        rows.append(outcome(path, finding, listed))
        print(said(rows[-1]), flush=True)
    out.mkdir(parents=True, exist_ok=True)
    (out / "findings.json").write_text(json.dumps(rows, indent=1) + "\n")
