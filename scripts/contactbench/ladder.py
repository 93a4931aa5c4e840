"""What a method can be recommended by, from the best evidence down, each with how far it can be trusted:

  exact        errors against a closed form
  certified    errors against a motion on which two methods agree over the whole run
  agreed       the same for as long as two methods agree
  alike        a motion that two methods share to the wanted error, for as long as they do
  converging   how far a method still moves when its own step is made finer, and how far methods are from each other
  residual     that contact problems are solved and energy does not grow, and the time
"""
import itertools
import math
import statistics

from . import precision
from .gather import number
from .references import ERROR

ALIKE, CONVERGING, RESIDUAL = "alike", "converging", "residual"
TOGETHER = ("ap", "convex", "coulomb")  # what solves contacts together: that two of the others agree says less
TRUST = {
    "exact": "the scene has an exact answer: the error is that",
    "certified": "two methods agree over the whole run: the error is known to the uncertainty of the reference",
    "agreed": "two methods agree for the first {until:g} s, which is what was run; of what comes after nothing is "
    "known, and methods part there",
    ALIKE: "{first} and {second} at their finest step stay within {error:g} m of each other for {until}, and the error "
    "is the largest of the distances from them and from the method's own finest step",
    CONVERGING: "no two methods agree: the error is how far the same method moves when its step is made finer, which "
    "says that it converges and not to what; at its step the others are up to {spread} m away",
    RESIDUAL: "nothing is known of where the bodies should be: the answer solves the contact problems that it meets, "
    "of exact Coulomb friction where a setting does, without a gain of energy, and is the cheapest that does"}


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
        "run": cell["run"], "scene": cell["scene"], "parameters": cell["parameters"], "step": cell["step"],
        "measure": measure, "status": cell["status"], "error": error, "worst": error, "uncertainty": 0.0,
        "time": cell.seconds / duration, "least": times[0] / duration, "most": times[-1] / duration,
        "time_per_step": cell.seconds / int(cell["steps"] or 1), "repeats": len(times), "busy": cell.busy, "cell": cell}


def finished(results, scene, parameters, sweep=precision.SWEEP):
    return [c for c in results.cells(scene, sweep, parameters=parameters) if c.finished and c.times and c["step"]]


def own_steps(results, scene, parameters, until=math.inf, sweep=precision.SWEEP):
    """{run: how far a setting is, up to a time, from the finest step of its method (that one from the next), m}."""
    groups, far = {}, {}
    for cell in finished(results, scene, parameters, sweep):
        groups.setdefault((cell.key, cell.setting), []).append(cell)
    for cells in groups.values():
        cells = sorted(cells, key=lambda c: float(c["step"]))
        for cell in cells if len(cells) > 1 else ():
            distance = precision.apart(cell, cells[0] if cell is not cells[0] else cells[1], until)
            if not math.isnan(distance):
                far[cell["run"]] = distance
    return far


def spread(results, scene, parameters, cell):
    """How far the other methods at the same step are from a run: the most and the median, m; None without others."""
    others = [
        c for c in finished(results, scene, parameters) if c["step"] == cell["step"] and c["method"] != cell["method"]]
    known = [d for d in (precision.apart(cell, c) for c in others) if not math.isnan(d)]
    return (max(known), statistics.median(known)) if known else None


def sound(results, scene, parameters):
    """The settings that came to the end, those without a refuted claim or a gain of energy first, of these the ones
    that solve exact Coulomb friction; no error."""
    def worst(p):
        law = number(p["cell"]["law_residual_max"])
        return (not good(p["cell"]), gains(p["cell"]), law > precision.EXACT_LAW, p["time"])

    return sorted((point(c, RESIDUAL, 0.0) for c in finished(results, scene, parameters)), key=worst)


def alike(results, scene, parameters, error):
    """For how long two methods that solve contacts together, at their finest steps, stay within an error of each other:
    (s, in words, those two); no two where none do from the start."""
    cells = [c for c in finished(results, scene, parameters) if c["method"] in TOGETHER and good(c)]
    least = min((float(c["step"]) for c in cells), default=0.0)
    best = 0.0, "", ()
    for a, b in itertools.combinations((c for c in cells if float(c["step"]) == least), 2):
        if a["method"] != b["method"]:
            of = precision.distances(a, b)
            until = max(itertools.takewhile(lambda t, of=of: of[t] <= error, of), default=0.0)
            whole = until == max(of, default=math.inf)
            words = f"the whole run, {until:g} s" if whole else f"the first {until:g} s, and part then"
            best = max(best, (until, words, (a, b)), key=lambda found: found[0])
    return best


def good(cell):
    return cell["status"] == "ok" and cell["false_claims"] in ("", "0")


def gains(cell):
    """Whether an event gained energy, which a belt puts in, too."""
    return number(cell["max_gain_relative"]) > 1e-9


def steps_down(results, scene, parameters, error, time_per_step):
    """Where there is nothing to measure errors against: a row a step, from the best evidence down, each {basis, trust,
    best, runner-up, nearest}; best is None where none met the error, nearest where not even one came to the end."""
    rows = []

    def add(basis, points, **said):
        best, second, _ = precision.choose(points, error, time_per_step)
        near = best or precision.nearest(points)
        if near:
            if basis == CONVERGING:
                far = spread(results, scene, parameters, near["cell"])
                said["spread"] = f"{far[0]:.2g}" if far else "?"
            rows.append({
                "basis": basis, "trust": TRUST[basis].format(**said), "best": best, "runner_up": second,
                "nearest": near})

    cells = finished(results, scene, parameters)
    until, words, two = alike(results, scene, parameters, error)
    if two:
        # Two methods at the same step may share its error: how far a method's steps are apart counts too.
        steps = own_steps(results, scene, parameters, until)
        far = {
            c["run"]: [steps[c["run"]], *(precision.apart(c, of, until) for of in two)] for c in cells
            if c["run"] in steps}
        points = [
            point(c, ALIKE, max(far[c["run"]])) for c in cells
            if c["run"] in far and not any(map(math.isnan, far[c["run"]]))]
        add(ALIKE, points, first=two[0].name, second=two[1].name, error=error, until=words)
    steps = own_steps(results, scene, parameters)
    add(CONVERGING, [point(c, CONVERGING, steps[c["run"]]) for c in cells if c["run"] in steps])
    points = [
        p for p in sound(results, scene, parameters) if time_per_step is None or p["time_per_step"] <= time_per_step]
    near = points[0] if points else None
    answers = [p for p in points if good(p["cell"]) and not gains(p["cell"])]
    best = answers[0] if answers else None
    second = next((p for p in answers if p["cell"].key != best["cell"].key), None)
    rows.append({"basis": RESIDUAL, "trust": TRUST[RESIDUAL], "best": best, "runner_up": second, "nearest": near})
    return rows


def furthest(results, scene, parameters):
    """Of a scene that no setting got through, the one that came furthest, in words; empty where nothing was run."""
    cells = results.cells(scene, precision.SWEEP, parameters=parameters)
    cell = max(cells, key=lambda c: number(c["t_reached"] or "0"), default=None)
    return f"{cell.label}: {cell.how_it_ended}, {cell.command}" if cell else ""
