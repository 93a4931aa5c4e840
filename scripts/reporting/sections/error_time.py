"""Error against run time on the scenes with an exact answer: the picture, the Pareto fronts, the error budget."""
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


def build(results):
    picture, about, digest = figures.shown(results, figures.PLOTS / "error_time.py", SWEEP)
    parts, data, timing = figures.shown(results, figures.PLOTS / "error_budget.py", SWEEP)
    html, points, fronts, budgets = [picture], [], {}, {}
    html.append("<h3>None cheaper with less error</h3><p>The Pareto front of each scene, the cheapest first: whoever wants less error "
                "than a row has must pay the next one. Errors within 1 %, and all below 1e-12 m, are taken as equal.</p>")
    for scene in precision.scenes(results):
        some = precision.points(results, *scene)
        points += some
        front = precision.pareto(some)
        name = scene_name(*scene)
        fronts[name] = [p["run"] for p in front]
        html.append(f"<h4>{esc(name)}</h4>" + table(
            ["method", "step, s", "time, s a simulated second (least)", "largest error, m", "run"],
            [[esc(p["cell"].name + (f", k = {p['cell']['k']}" if p["cell"]["k"] else "")), esc(p["step"]),
              f"{p['time']:.3g}{'*' if p['busy'] else ''} ({p['least']:.3g})", f"{p['error']:.3g}",
              f"<code>{esc(p['run'])}</code>"] for p in front]))
    html.append("<h3>Error budget</h3>" + parts)
    for scene in precision.scenes(results):
        rows = precision.budget(results, *scene)
        name = scene_name(*scene)
        budgets[name] = {r["cell"]["run"]: {k: r[k] for k in ("solver", "model", "step_error", "total", "dominates")} for r in rows}
        html.append(f"<details><summary>{esc(name)}: every run</summary>" + table(
            ["method", "step, s", "solver, m", "model, m", "step, m", "largest", "against the exact answer, m"],
            [[esc(r["cell"].name + (f", k = {r['cell']['k']}" if r["cell"]["k"] else "")), esc(r["cell"]["step"]), said(r["solver"]),
              said(r["model"]), said(r["step_error"]), esc(r["dominates"]), said(r["total"])] for r in rows]) + "</details>")
    keep = ("run", "scene", "parameters", "step", "measure", "status", "error")
    return Section("\n".join(html), {"figure": about, "points": [{k: p[k] for k in keep} for p in points], "budget": budgets},
                   {"sha256": [digest, timing], "points": [{"run": p["run"], "time": p["time"], "least": p["least"]} for p in points],
                    "pareto": fronts})
