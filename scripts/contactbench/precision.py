"""What error against run time is made of: the points of a scene, the choice of a method among them, its Pareto front,
the error budget, the observed order in the step, and performance profiles. Reads result files of the sweeps error_time,
orders and polygons; runs nothing.

Least squares are in closed form: numpy's come from whatever LAPACK is installed, and their last digits with it, so that
the report made on another machine would differ."""
import functools
import math
import statistics

import numpy as np

from . import worth
from .gather import number
from .references import ERROR, name_of
from .runs import Cell, Runs, series

SWEEP = "error_time"
# The error that stands for a scene: the first of these that it has, largest over time. Closed forms come before
# certified ones.
MEASURES = ("position_linf_m", "displacement_linf_m", ERROR, "creep_linf_m")
EXACT_LAW = 1e-8  # law residual up to which a convex run solves exact Coulomb friction
TINY = 1e-12  # m; differences below are rounding
DIFFERS = "differs"  # a word on which an ensemble does not agree


def slope(x, y):
    """Least squares of log y over log x."""
    return statistics.linear_regression([math.log(a) for a in x], [math.log(b) for b in y]).slope


def circle(points):
    """Radius and relative root mean square deviation of the best circle through points (x, y): algebraic least squares,
    after I. Kasa, IEEE Transactions on Instrumentation and Measurement 25 (1976). Of points on a line: nan."""
    n = len(points)
    centroid = [math.fsum(p[i] for p in points) / n for i in (0, 1)]
    u, v = ([float(p[i] - centroid[i]) for p in points] for i in (0, 1))
    w = [a * a + b * b for a, b in zip(u, v)]
    uu, uv, vv, uw, vw = (math.fsum(map(float.__mul__, a, b)) for a, b in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    determinant = 2 * (uu * vv - uv * uv)
    if not determinant > 0:
        return math.nan, math.nan
    a, b = (uw * vv - vw * uv) / determinant, (vw * uu - uw * uv) / determinant
    radius = math.sqrt(a * a + b * b + (uu + vv) / n)
    return radius, math.sqrt(math.fsum((math.hypot(x - a, y - b) - radius)**2 for x, y in zip(u, v)) / n) / radius


def scenes(results: Runs) -> list[tuple[str, str]]:
    """(scene, parameters) in the order of the table, of those with an exact answer."""
    found = dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=SWEEP))
    return [s for s in found if measure(results, *s)]


def measure(results, scene, parameters, sweep=SWEEP):
    cells = results.cells(scene, sweep, parameters=parameters)
    return next((m for m in MEASURES if any(not math.isnan(c.error(m)) for c in cells)), "")


def reference_of(results, scene, parameters, name):
    """What an error is against, in words: analytic; certified, with its uncertainty; or missing, with the reason."""
    if name == ERROR:
        return f"certified to {uncertainty(results, scene, parameters):.1g} m"
    if name:
        return next(
            c["reference"] for c in results.cells(scene, None, parameters=parameters) if not math.isnan(c.error(name)))
    refused = results.manifest.get("references", {}).get(name_of(scene, parameters))
    return "missing" + (f": {refused['reason']}" if refused else "")


def uncertainty(results, scene, parameters):
    """Of the certified reference that the errors of a scene are against, m."""
    return results.manifest["references"][name_of(scene, parameters)]["uncertainty_m"]


def points(results, scene, parameters, name=None, sweep=SWEEP):
    """Per cell: time (median, least and most, s a simulated second; s a step), error (of the scene's measure, or the
    named one), None where the run did not finish or has none, all of its ensemble (`errors`, infinite where a member
    did not end ok), the worst of them, and the uncertainty of the reference that it is against."""
    name = name or measure(results, scene, parameters, sweep)
    out, unsure = [], uncertainty(results, scene, parameters) if name == ERROR else 0.0
    for cell in results.cells(scene, sweep, parameters=parameters):
        times = [time / float(cell["duration"] or "nan") for time in (cell.seconds, *cell.times)]
        point = {"run": cell["run"], "scene": scene, "parameters": parameters, "step": cell["step"], "measure": name}
        point |= {"status": cell["status"] if cell.finished else cell.how_it_ended.split(" at ")[0]}
        point |= dict.fromkeys(
            ("error", "worst", "time", "least", "most", "time_per_step")) | {"errors": [], "uncertainty": unsure}
        if cell.finished and cell.times and not math.isnan(cell.error(name)):
            errors = [c.error(name) if c["status"] == "ok" else math.inf for c in cell.members]
            point |= {"error": cell.error(name), "errors": [cell.error(name), *errors]}
            point["worst"] = max(point["errors"])
            point |= {"time": times[0], "least": min(times[1:]), "most": max(times[1:])}
            point |= {"time_per_step": cell.seconds / int(cell["steps"])}
        out.append(point | {"repeats": len(cell.times), "busy": cell.busy, "cell": cell})
    return out


def spread(point):
    """The error of a point as a page shows it: a sample where its ensemble has several."""
    same = all(worth.close(point["error"], e) for e in point["errors"])
    return point["error"] if same else worth.Number(point["error"],
                                                    [e if math.isfinite(e) else None for e in point["errors"]])


def pareto(some: list[dict]) -> list[dict]:
    """Of points with time and error: those that none beats in both, the cheapest first. The error is the largest of the
    ensemble; it counts as less from 1 % on, and below TINY none does."""
    front, best = [], math.inf
    for point in sorted((p for p in some if p["error"] is not None), key=lambda p: (p["time"], p["worst"])):
        if max(point["worst"], TINY) < 0.99 * best:
            best = max(point["worst"], TINY)
            front.append(point)
    return front


# Which method to use: the cheapest that met a wanted error.


def met(point, error, time_per_step=None):
    """Whether a point is an answer: it ended ok, no claim of it was refuted, its error is small enough in the whole
    ensemble and even if the reference is off by its uncertainty, and its step is quick enough."""
    return (point["error"] is not None and point["status"] == "ok" and point["cell"]["false_claims"] == "0"
            and point["worst"] + point["uncertainty"] <= error
            and (time_per_step is None or point["time_per_step"] <= time_per_step))


def choose(points, error, time_per_step=None):
    """The cheapest point that met the error, the runner-up (the cheapest of another method or solver), and what was
    cheaper than the first and did not; None, None, [] where none did."""
    timed = sorted((p for p in points if p["time"] is not None), key=lambda p: p["time"])
    good = [p for p in timed if met(p, error, time_per_step)]
    if not good:
        return None, None, []
    best = good[0]
    return best, next((p for p in good if p["cell"].key != best["cell"].key), None), timed[:timed.index(best)]


def nearest(points):
    """Of the points that ended ok, the one with the least error, the cheapest of those; None where there is none."""
    return min((p for p in points if met(p, float("inf"))), key=lambda p: (p["worst"], p["time"]), default=None)


def told_apart(a, b):
    """Whether the times of two points tell them apart; None where one of them has a single repeat, so that nothing is
    known."""
    if min(a["repeats"], b["repeats"]) < 2:
        return None
    return a["most"] < b["least"] or b["most"] < a["least"]


# Error budget.


@functools.cache
def moments(folder):
    """{t: places of the bodies} of a run, in a fixed order; times are n h, so rounding tells equal ones."""
    t, *places = series(folder / "trajectory.csv", "t", "px", "py", "pz")
    of = {}
    for key, *p in zip(np.round(t, 9), *places):
        of.setdefault(key, []).append(p)
    return of


def distances(a: Cell, b: Cell) -> dict[float, float]:
    """{t: largest distance of a body} between two runs of the same scene at the times that both recorded, in order."""
    return distances_of(a.folder, b.folder)


@functools.cache
def distances_of(*folders):
    places = [moments(folder) for folder in folders]
    return {
        t: float(np.max(np.linalg.norm(np.subtract(places[0][t], places[1][t]), axis=1)))
        for t in sorted(set(places[0]) & set(places[1]))}


def apart(a: Cell, b: Cell, until: float = math.inf) -> float:
    """The largest of them up to a time; nan where they share no moment but the start, at which all runs are alike."""
    known = {t: d for t, d in distances(a, b).items() if t <= until}
    return max(known.values()) if any(t > 0 for t in known) else math.nan


def twin(cells: list[Cell], cell: Cell) -> Cell | None:
    """The same model at the same step solved as well as this program can; None for models that are no such problem."""
    if cell["method"] == "ap":
        return next((c for c in cells if c["method"] == "ap" and c["solver"] == "lemke" and c["k"] == cell["k"]
                     and c["step"] == cell["step"] and c["status"] == "ok"), None)
    if cell["method"] in ("convex", "coulomb"):
        return coulomb(cells, cell["step"])
    return None


def coulomb(cells, step):
    """Exact Coulomb friction at a step: `coulomb`, else convex at 1e-12 J, where its law residual says that it is
    that."""
    exact = [
        c for c in cells if (c["method"] == "coulomb" or c["method"] == "convex" and c["epsilon"] == "1e-12")
        and c["step"] == step and c["status"] == "ok" and number(c["law_residual_max"]) <= EXACT_LAW]
    return min(exact, key=lambda c: c["method"] != "coulomb", default=None)


def budget(results: Runs, scene: str, parameters: str) -> list[dict]:
    """Per finished cell: error of the solver (against the same model solved tightly, same step), of the model (that
    against exact Coulomb friction, same step) and of the step (the same law against its exact answer), nan where it is
    not known; and which dominates, where the whole ensemble says the same."""
    rows = [dict(row) for row in parts_of_error(results, scene, parameters)]
    others = [{r["cell"].unrepeated: r["dominates"] for r in parts_of_error(w, scene, parameters)}
              for w in worth.members(results)]
    for row in rows:
        said = [of[row["cell"].unrepeated] for of in others if row["cell"].unrepeated in of]
        row["dominates"] = worth.agreed([row["dominates"], *said], DIFFERS)
    return rows


@functools.cache
def parts_of_error(results, scene, parameters):
    """The rows of the budget, as one world has them."""
    # What steps to an accuracy has no step to share with others.
    cells = [c for c in results.cells(scene, SWEEP, parameters=parameters) if c.finished and c["step"]]
    name = measure(results, scene, parameters)
    rows = []
    for cell in cells:
        tight, law = twin(cells, cell), coulomb(cells, cell["step"])
        solver = model = step = math.nan
        if cell["method"] in ("newton", "mirtich"):
            # What they solve has no tolerance: contact by contact, the answer is the model.
            model = apart(cell, law) if law else math.nan
            step = law.error(name) if law else math.nan
        elif tight:
            solver = 0.0 if tight["run"] == cell["run"] else apart(cell, tight)
            model = 0.0 if law and tight["run"] == law["run"] else apart(tight, law) if law else math.nan
            # The polygon's own exact answer, where the scene has one; the exact one, where the polygon moves as the
            # circle does.
            own = tight.error(f"polygon_{name}") if cell["method"] == "ap" else math.nan
            exact = cell["method"] in ("convex", "coulomb") or model <= TINY
            step = own if not math.isnan(own) else tight.error(name) if exact else math.nan
        known = {k: v for k, v in (("solver", solver), ("model", model), ("step", step)) if not math.isnan(v)}
        worst = max(known, key=known.get) if known and max(known.values()) > TINY else "none" if known else ""
        rows.append({
            "cell": cell, "solver": solver, "model": model, "step_error": step, "dominates": worst,
            "total": cell.error(name)})
    return rows


# Order in the step.


def orders(results):
    """Per scene and method of the sweep orders: error at each step, order from each halving, and the order claimed
    (least squares), None where there are fewer than three halvings, they differ by more than 0.5, or nothing is left to
    converge."""
    groups = {}
    for cell in results.cells(sweep="orders"):
        if cell.finished and cell["step"]:
            groups.setdefault((cell["scene"], cell["parameters"], cell.key, cell["k"], cell["epsilon"]),
                              []).append(cell)
    rows = []
    for (scene, parameters, key, k, _), cells in groups.items():
        cells = sorted(cells, key=lambda c: -float(c["step"]))
        of_scene = measure(results, scene, parameters, "orders")
        for name in (of_scene, f"polygon_{of_scene}") if key[0] == "ap" else (of_scene, ):
            h, error = np.array([float(c["step"]) for c in cells]), np.array([c.error(name) for c in cells])
            if len(h) < 3 or np.any(np.isnan(error)):
                continue
            row = {
                "scene": scene, "parameters": parameters, "method": cells[0].name + (f", k = {k}" if k else ""),
                "against": "the polygon's exact answer"
                if name.startswith("polygon") else "the certified reference" if name == ERROR else "the exact answer",
                "steps": h.tolist(), "errors": error.tolist(), "halvings": [], "order": None, "cells": cells}
            if np.all(error > TINY):
                halvings = np.diff(np.log(error)) / np.diff(np.log(h))
                row["halvings"] = halvings.tolist()
                if len(halvings) >= 3 and halvings.max() - halvings.min() <= 0.5:
                    row["order"] = slope(h, error)
            rows.append(row)
    return rows


def polygons(results):
    """Per scene of the sweep polygons: model error of ap over k, and the slope of its logarithm over that of 1 -
    cos(pi/k)."""
    groups = {}
    for cell in results.cells(sweep="polygons", method="ap", solver="lemke"):
        if cell.finished:
            # The turned polygons of a scene differ in their angle, which follows from k: pi/k or half of it.
            angle = next(
                (float(p.partition("=")[2]) for p in cell["parameters"].split() if p.startswith("rotate_cone=")), 0.0)
            turned = {0.0: "an edge's corner on the axes", 1.0: "turned by pi/k", 0.5: "turned by pi/2k"}.get(
                round(angle * int(cell["k"]) / math.pi, 9), f"turned by {angle:g}")
            rest = " ".join(p for p in cell["parameters"].split() if not p.startswith("rotate_cone="))
            groups.setdefault((cell["scene"], rest, turned), []).append(cell)
    rows = []
    for (scene, parameters, turned), cells in groups.items():
        cells = sorted(cells, key=lambda c: int(c["k"]))
        k, error = [int(c["k"]) for c in cells], [c.error("position_linf_m") for c in cells]
        own = [c.error("polygon_position_linf_m") for c in cells]
        # The step's share, which the polygon's own exact answer shows, is no error of the model.
        fit = [(n, e) for n, e, s in zip(k, error, own) if e > 3 * s and e > TINY and n >= 8]
        followed = slope([1 - math.cos(math.pi / n) for n, _ in fit], [e for _, e in fit]) if len(fit) >= 3 else None
        rows.append({
            "scene": scene, "parameters": parameters, "turned": turned, "k": k, "errors": error, "step_errors": own,
            "loss": [1 - math.cos(math.pi / n) for n in k], "slope": followed, "cells": cells})
    return rows


# Performance profiles.


def contenders(results):
    """{method: {problem: cell}}: one setting a method (k = 8, 1e-12 J), a problem is a scene with a step."""
    out = {}
    for scene, parameters in scenes(results):
        for cell in results.cells(scene, SWEEP, parameters=parameters):
            if cell["step"] and cell["k"] in ("", "8") and cell["epsilon"] in ("", "1e-12"):
                out.setdefault(cell.name, {})[scene, parameters, cell["knobs"]] = cell
    return out


def profiles(results):
    """{method: sorted ratios of its time to the least}, a failure counting as infinite: of runs that end ok, and of
    those whose error is besides at most twice the least of all methods on the problem (or 1e-9 m). Of the problems that
    every method was run on: what nobody tried is no failure."""
    methods = contenders(results)
    problems = [p for p in next(iter(methods.values()), ()) if all(p in cells for cells in methods.values())]
    ended, right = {m: [] for m in methods}, {m: [] for m in methods}
    for problem in problems:
        cells = {m: c[problem] for m, c in methods.items()}
        name = measure(results, *problem[:2])
        ok = {m: c for m, c in cells.items() if c["status"] == "ok"}
        errors = [c.error(name) for c in cells.values() if c.finished]
        least = min((e for e in errors if not math.isnan(e)), default=math.nan)
        good = {m: c for m, c in ok.items() if c.error(name) <= max(2 * least, 1e-9)}
        for solved, table in ((ok, ended), (good, right)):
            times = {m: c.seconds for m, c in solved.items()}
            fastest = min(times.values(), default=math.nan)
            for m in methods:
                table[m].append(times[m] / fastest if m in times else math.inf)
    return {m: sorted(r) for m, r in ended.items()}, {m: sorted(r) for m, r in right.items()}


def truthfulness(results):
    """Per method over all runs of all sweeps: runs, ended ok, solves, claims of success that the referee refuted."""
    rows = {}
    for cell in results.cells(sweep=None):
        row = rows.setdefault(cell.name, {"runs": 0, "ok": 0, "inaccurate": 0, "solves": 0, "false_claims": 0})
        for r in cell.rows:
            row["runs"] += 1
            row["ok"] += r["status"] == "ok"
            row["inaccurate"] += r["status"] == "inaccurate"
            row["solves"] += int(r["solves"] or 0)
            row["false_claims"] += int(r["false_claims"] or 0)
    return rows
