"""What a method can be recommended by, from the best evidence down, each with how far it can be trusted:

  exact        errors against a closed form
  certified    errors against a motion on which two methods agree over the whole run
  agreed       the same for as long as two methods agree
  converging   how far a method still moves when its own step is made finer, and how far methods are from each other
  residual     that contact problems are solved and energy does not grow, and the time
"""
import math
import statistics

from . import precision
from .references import ERROR
from .runs import number

CONVERGING, RESIDUAL = "converging", "residual"
TRUST = {
    "exact": "the scene has an exact answer: the error is that",
    "certified": "two methods agree over the whole run: the error is known to the uncertainty of the reference",
    "agreed": "two methods agree for the first {until:g} s, which is what was run; of what comes after nothing is known, and methods part there",
    CONVERGING: "no two methods agree: the error is how far the same method moves when its step is made finer, which says "
                "that it converges and not to what; at its step the others are up to {spread} m away",
    RESIDUAL: "nothing is known of where the bodies should be: the answer solves the contact problems that it meets, without "
              "a gain of energy, and is the cheapest that does"}


def basis_of(measure, about, wanted):
    """What errors of a measure are against. `about`: of the scene's reference; `wanted`: the seconds asked for, or
    None for all of the scene."""
    if measure != ERROR:
        return "exact"
    return "certified" if (about.get("until") or 0) >= (wanted or about["duration"]) * (1 - 1e-9) else "agreed"


def point(cell, measure, error):
    """As precision.points has them, of an error that is no column of the table."""
    duration, times = float(cell["duration"]), sorted(cell.times)
    return {
        "run": cell["run"], "scene": cell["scene"], "parameters": cell["parameters"], "step": cell["step"], "measure": measure,
        "status": cell["status"], "error": error, "worst": error, "uncertainty": 0.0, "time": cell.seconds / duration,
        "least": times[0] / duration, "most": times[-1] / duration, "time_per_step": cell.seconds / int(cell["steps"] or 1),
        "repeats": len(times), "busy": cell.busy, "cell": cell}


def finished(results, scene, parameters):
    return [c for c in results.cells(scene, precision.SWEEP, parameters=parameters) if c.finished and c.times and c["step"]]


def converging(results, scene, parameters):
    """The settings of a scene with how far each is from the finest step of its method (that one from the next), m."""
    groups = {}
    for cell in finished(results, scene, parameters):
        groups.setdefault((cell.key, cell["variant"], cell["k"], cell["epsilon"]), []).append(cell)
    points = []
    for cells in groups.values():
        cells = sorted(cells, key=lambda c: float(c["step"]))
        for cell in cells if len(cells) > 1 else ():
            distance = precision.apart(cell, cells[0] if cell is not cells[0] else cells[1])
            if not math.isnan(distance):
                points.append(point(cell, CONVERGING, distance))
    return points


def spread(results, scene, parameters, cell):
    """How far the other methods at the same step are from a run: the most and the median, m; None where there are none."""
    others = [c for c in finished(results, scene, parameters) if c["step"] == cell["step"] and c["method"] != cell["method"]]
    known = [d for d in (precision.apart(cell, c) for c in others) if not math.isnan(d)]
    return (max(known), statistics.median(known)) if known else None


def sound(results, scene, parameters):
    """The settings that came to the end, those without a refuted claim or a gain of energy first; no error."""
    def worst(p):
        gain = number(p["cell"]["max_gain_relative"])
        return (p["status"] != "ok" or p["cell"]["false_claims"] not in ("", "0"), gain > 1e-9, p["time"])

    return sorted((point(c, RESIDUAL, 0.0) for c in finished(results, scene, parameters)), key=worst)


def step_down(results, scene, parameters, error, time_per_step):
    """Where there is nothing to measure errors against: (basis, trust, best, runner-up, nearest); best is None where none
    met the error, nearest where not even one came to the end."""
    points = converging(results, scene, parameters)
    best, second, _ = precision.choose(points, error, time_per_step)
    near = best or precision.nearest(points)
    if near:
        far = spread(results, scene, parameters, near["cell"])
        return CONVERGING, TRUST[CONVERGING].format(spread=f"{far[0]:.2g}" if far else "?"), best, second, near
    points = [p for p in sound(results, scene, parameters) if time_per_step is None or p["time_per_step"] <= time_per_step]
    second = next((p for p in points[1:] if p["cell"].key != points[0]["cell"].key), None)
    return RESIDUAL, TRUST[RESIDUAL], points[0] if points else None, second, points[0] if points else None
