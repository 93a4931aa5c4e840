"""What was found, in ten lines with numbers from the runs: one function a line, which returns a sentence for the page
and the section that it is from, or nothing where its runs are not there."""
import math

from . import claims, measures, precision, solve_all, worth
from .claims import EPS, drives, holds, stacks
from .gather import number


def some(x):
    return "?" if x is None or math.isnan(x) else f"{x:.2g}"


def how_many(results):
    truth = precision.truthfulness(results).values()
    ok, runs, solves, refuted = (sum(r[k] for r in truth) for k in ("ok", "runs", "solves", "false_claims"))
    return f"{ok} of {runs} runs ended ok. Of the answers to {solves} contact problems in them that their solver " \
           f"called right, the referee refuted {refuted}.", "performance"


def of_the_paper(results):
    answers = [claims.asked(name, results) for name in claims.ALL]
    grades = [c.grade for c in answers]
    parts = [p.verdict for c in answers for p in c.parts]
    return f"Of the paper's {len(answers)} claims {grades.count(claims.YES)} are reproduced whole, " \
           f"{grades.count('in part')} in part, {grades.count('contradicted')} not at all; of their {len(parts)} " \
           f"parts {parts.count(claims.YES)}.", "claim_table"


def which_method(results):
    best = [
        precision.choose(precision.points(results, *scene), error)[0] for scene in precision.scenes(results)
        for error in (1e-2, 1e-4, 1e-6)]
    names = [b["cell"].name.partition(",")[0] for b in best if b]
    if not names:
        return None
    count = sorted({n: names.count(n) for n in names}.items(), key=lambda of: -of[1])
    return worth.Whole(f"Asked for 1e-2, 1e-4 and 1e-6 m on {len(best) // 3} scenes, a setting of the sweep answers in "
                       f"{len(names)} of {len(best)} cases; the cheapest is " +
                       ", ".join(f"{n} in {k}" for n, k in count) + "."), "advice"


def one_at_a_time(results):
    """What treating contacts one after the other costs."""
    rows = [
        r for scene in precision.scenes(results) if scene[0] == "sliding_box"
        for r in precision.budget(results, *scene)]
    model = {
        r["cell"].name: r["total"] for r in sorted(rows, key=lambda r: -float(r["cell"]["step"] or 0))
        if r["cell"]["method"] in ("newton", "mirtich")}
    exact = [r["total"] for r in rows if r["cell"]["method"] in ("ap", "convex")]
    if not model or not exact:
        return None
    return "Contacts one after the other are another model: a sliding box ends " + ", ".join(
        f"{some(e)} m off with {n}" for n, e in model.items()) + \
        f" at the finest step, and {some(min(exact))} m with what solves them together.", "error_time"


def polygon(results):
    rows = [r for r in precision.polygons(results) if r["turned"] == "turned by pi/k"]
    if not rows:
        return None
    r = rows[0]
    cone = [
        p["error"] for scene in precision.scenes(results) if scene == (r["scene"], r["parameters"])
        for p in precision.points(results, *scene) if p["cell"]["method"] == "convex" and precision.met(p, math.inf)]
    return f"A friction polygon costs accuracy where bodies slide across its edges: {r['scene'].replace('_', ' ')}, " \
           f"turned by pi/k, errs by {some(r['errors'][0])} m with {r['k'][0]} edges and {some(r['errors'][-1])} m " \
           f"with {r['k'][-1]}" + (f"; the least error with a cone is {some(min(cone))} m" if cone else "") + ".", \
        "convergence"


def growth(results):
    cells = stacks(results).get(16)
    of = [c for c in cells or () if c["epsilon"] in ("", EPS)]
    if not of:
        return None
    told = sorted(((c.seconds / float(c["duration"]), c.name) for c in of if c.finished))
    late = [f"{c.name} ({c.how_it_ended})" for c in of if not c.finished]
    return "A stack of 16 boxes costs, a simulated second: " + ", ".join(f"{n} {some(t)} s" for t, n in told) + \
        (f". Not to the end: {', '.join(late)}" if late else "") + ".", "table_one"


def robot(results):
    cells = [c for c in results.cells("mobile_robot", knobs="", parameters="") if c["epsilon"] in ("", EPS)]

    if not cells:
        return None
    there, not_there = [c.name for c in cells if drives(c)], [c for c in cells if not drives(c)]
    return "The figure eight at the paper's step is driven by " + ", ".join(
        there or ["nobody"]) + ("; not by " + ", ".join(f"{c.name} ({c.how_it_ended or 'off its path'})"
                                                        for c in not_there) if not_there else "") + ".", "C6"


def grasp(results):
    cells = [c for c in results.cells("grasp", knobs="", parameters="") if c["epsilon"] in ("", EPS)]

    if not cells:
        return None

    def lost_by(c):
        fell = c.error("dropped_s")
        return c.how_it_ended or (f"dropped at {some(fell)} s"
                                  if not math.isnan(fell) else f"creeps {some(c.error('creep_linf_m'))} m")

    lost = [f"{c.name} ({lost_by(c)})" for c in cells if not holds(c)]
    return "The grasped box is held by " + ", ".join(c.name for c in cells if holds(c)) + \
        (f"; not by {', '.join(lost)}" if lost else "") + ".", "C7"


def hard(results):
    cells = results.read("stress/stress.csv")
    if cells is None:
        return None
    count = cells["verdict"].value_counts()
    return f"Of {len(cells)} stiff and extreme cases by method {count.get('right', 0)} are right, " \
           f"{count.get('model', 0)} are what the method's model says, {count.get('typed', 0)} end with a typed " \
           f"status, {count.get('engine', 0)} are engines that are off, " \
           f"{sum(count.get(v, 0) for v in measures.BAD)} are wrong, silent or a defect.", "stiff_cases"


def stored(results):
    counts = solve_all.summary(solve_all.rows_of(results)) if solve_all.rows_of(results) else {}
    of = {name: (c["ok"], c["problems"]) for (kind, name), c in counts.items() if kind == "contact"}
    if not of:
        return None
    whole = [n for n, (a, b) in of.items() if a == b]
    rest = sorted(((n, a, b) for n, (a, b) in of.items() if a < b), key=lambda o: o[1] / o[2])
    return f"Of the stored contact problems {len(whole)} of {len(of)} solvers solve all" + \
        (f": {', '.join(whole[:6])}" if whole else "") + \
        (f"; fewest by {rest[0][0]} ({rest[0][1]} of {rest[0][2]})" if rest else "") + ".", "stored_problems"


def apart(results):
    """Of scenes without the paper: how far methods differ."""
    told = []
    for scene in dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=None)):
        cells = [c for c in results.cells(scene[0], None, parameters=scene[1]) if c.finished]
        ended = len(cells), len(results.cells(scene[0], None, parameters=scene[1]))
        worst = max((number(c["max_gain_relative"] or "0") for c in cells), default=0.0)
        told.append(f"{' '.join(scene).strip()}: {ended[0]} of {ended[1]} settings came to the end" +
                    (f", an event gains up to {some(worst)} of the energy" if worst > 1e-9 else ""))
    return "; ".join(told) + ".", "differences"


OF_THE_PAPER = (how_many, which_method, of_the_paper, one_at_a_time, polygon, growth, robot, grasp, hard, stored)
OF_OTHERS = (how_many, apart, which_method)


def lines(results, of_paper):
    """[(sentence, section that it comes from)]."""
    return [line for line in (find_out(results) for find_out in (OF_THE_PAPER if of_paper else OF_OTHERS)) if line]
