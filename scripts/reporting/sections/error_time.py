"""Error against run time on the scenes with an exact or certified answer: the picture, the Pareto fronts, the error budget."""
import math

from .. import precision
from ..section import Section, esc, table
from . import figures

TITLE = "Error against run time"
SWEEP = precision.SWEEP


def said(value):
    return "" if value is None or math.isnan(value) else f"{value:.3g}"


def scene_name(scene, parameters):
    return f"{scene.replace('_', ' ')} {parameters}".strip()


def method(cell):
    """With the polygon's edges; its step stands in a column of its own."""
    return cell.name + (f", k = {cell['k']}" if cell["k"] else "")


def timed(point):
    """Time of a point with its range over the repeats; a star where others used the machine."""
    text = f"{point['time']:.3g}{'*' if point['busy'] else ''}"
    return text + (f" ({point['least']:.3g} to {point['most']:.3g})" if point["repeats"] > 1 else " (one run)")


def against(results, scenes):
    """What the error of each scene is, and against which reference."""
    rows = [[esc(scene_name(*scene)), esc(precision.measure(results, *scene)),
             esc(precision.reference_of(results, *scene, precision.measure(results, *scene)))] for scene in scenes]
    rows += [[esc(name), "", esc(f"missing: {about['reason']}")] for name, about in results.manifest.get("references", {}).items()
             if not about["accepted"]]
    return "<p>What the error of a scene is, and against what. A certified reference is a run at 1/64 of the scene's step on which two " \
        "methods agree; its uncertainty is what they differ by, or what halving the step changed, whichever is more.</p>" \
        + table(["scene", "error", "reference"], rows)


def build(results):
    picture, about, digest = figures.shown(results, figures.PLOTS / "error_time.py", SWEEP)
    parts, data, timing = figures.shown(results, figures.PLOTS / "error_budget.py", SWEEP)
    scenes = precision.scenes(results)
    html, points, fronts, budgets = [picture, against(results, scenes)], [], {}, {}
    html.append("<h3>None cheaper with less error</h3><p>The Pareto front of each scene, the cheapest first: whoever wants less error "
                "than a row has must pay the next one. Errors within 1 %, and all below 1e-12 m, are taken as equal. Times are medians, "
                "with the least and the most of the repeats, each after a warm-up; * others used the machine meanwhile.</p>")
    for scene in scenes:
        some = precision.points(results, *scene)
        points += some
        front = precision.pareto(some)
        name = scene_name(*scene)
        fronts[name] = [p["run"] for p in front]
        html.append(f"<h4>{esc(name)}</h4>" + table(
            ["method", "step, s", "time, s a simulated second", "largest error, m", "run"],
            [[esc(method(p["cell"])), esc(p["step"]), timed(p), f"{p['error']:.3g}", f"<code>{esc(p['run'])}</code>"] for p in front]))
    html.append("<h3>Error budget</h3>" + parts)
    for scene in scenes:
        rows = precision.budget(results, *scene)
        name = scene_name(*scene)
        budgets[name] = {r["cell"].unrepeated: {k: r[k] for k in ("solver", "model", "step_error", "total", "dominates")} for r in rows}
        html.append(f"<details><summary>{esc(name)}: every run</summary>" + table(
            ["method", "step, s", "solver, m", "model, m", "step, m", "largest", "against the reference, m", "run"],
            [[esc(method(r["cell"])), esc(r["cell"]["step"]), said(r["solver"]), said(r["model"]), said(r["step_error"]), esc(r["dominates"]),
              said(r["total"]), f"<code>{esc(r['cell']['run'])}</code>"] for r in rows]) + "</details>")
    keep = ("scene", "parameters", "step", "measure", "status", "error")
    return Section("\n".join(html), {"figure": about, "points": [{"run": p["cell"].unrepeated, **{k: p[k] for k in keep}} for p in points], "budget": budgets},
                   {"sha256": [digest, timing], "points": [{k: p[k] for k in ("run", "time", "least", "most", "repeats", "busy")} for p in points],
                    "pareto": fronts})
