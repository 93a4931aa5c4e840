"""Which method to use: for each scene and wanted error the cheapest that met it, and what of that holds over all scenes."""
import collections
import statistics

from .. import choice, precision
from ..section import Section, esc, table
from .error_time import method, scene_name, timed

TITLE = "Which method to use"
ERRORS = (1e-2, 1e-4, 1e-6, 1e-9)  # m


def setting(point):
    return f"{method(point['cell'])}, step {point['step']} s"


def wins(chosen):
    """Of the answers, how many are whose: one sentence."""
    count = collections.Counter(best["cell"].name.partition(",")[0] for best in chosen)
    said = ", ".join(f"{esc(name)} in {n}" for name, n in count.most_common())
    return f"<li>Of {len(chosen)} answers to a scene and an error, the cheapest is {said}.</li>" if chosen else ""


def knob(results, scenes, model, name, coarse, fine):
    """What a finer knob bought at the same step, over the scenes: one sentence."""
    less = more = 0
    ratios = []
    for scene in scenes:
        points = {(p["cell"]["solver"], p["step"], p["cell"][name]): p for p in precision.points(results, *scene)
                  if p["cell"]["method"] == model and p["error"] is not None}
        for (solver, step, value), a in points.items():
            b = points.get((solver, step, fine))
            if value == coarse and b:
                low = max(a["uncertainty"], precision.TINY)
                less += b["error"] < 0.9 * a["error"] and a["error"] > low
                more += a["error"] < 0.9 * b["error"] and b["error"] > low
                ratios.append(b["time"] / a["time"])
    if not ratios:
        return ""
    return (f"<li>{esc(model)}: {esc(name)} = {esc(fine)} in place of {esc(coarse)} lowered the error by more than a tenth in {less} of "
            f"{len(ratios)} cases and raised it in {more}, at {statistics.median(ratios):.2g} times the cost (median).</li>")


def turned(results):
    """What a polygon costs where its corners do not lie along the motion, as they do in most scenes: one sentence a scene."""
    return [f"<li>Where bodies slide, ap is as good as the cone only along the corners of its polygon: {esc(r['scene'].replace('_', ' '))} "
            f"with the polygon {esc(r['turned'])} errs by {r['errors'][0]:.2g} m at k = {r['k'][0]} and by {r['errors'][-1]:.2g} m at "
            f"k = {r['k'][-1]}.</li>" for r in precision.polygons(results) if r["turned"] == "turned by pi/k"]


def limits(results, scenes):
    """Per scene what is left at the best answer: one sentence each."""
    out = []
    for scene in scenes:
        close = choice.nearest(precision.points(results, *scene))
        if close is None:
            out.append(f"<li>{esc(scene_name(*scene))}: no run ended ok with an error to judge it by.</li>")
            continue
        row = next((r for r in precision.budget(results, *scene) if r["cell"]["run"] == close["run"]), None)
        rest = f"; what is left is mostly of the {row['dominates']}" if row and row["dominates"] in ("solver", "model", "step") else ""
        unsure = f" (the reference is known to {close['uncertainty']:.1g} m)" if close["uncertainty"] else ""
        out.append(f"<li>{esc(scene_name(*scene))}: the least error is {close['error']:.2g} m{unsure}, by {esc(setting(close))}{rest}.</li>")
    return out


def forbidden(chosen):
    """What convex, where it is advised, can't do in other scenes than these: one sentence."""
    if not any(best["cell"]["method"] == "convex" for best in chosen):
        return ""
    return ("<li>What holds for convex here does not where friction adds load: with the compression bound a box that should tip slides, and a "
            "block that another body pushes is held by no more friction than the pusher's own (scenes <code>tipping_box</code>, "
            "<code>pushed_block</code>; <code>contactbench check SCENE --method convex</code> says where a scene shows it). There take ap, or "
            "<code>--compression-bound off</code> where nothing slides.</li>")


def build(results):
    scenes = precision.scenes(results)
    if not scenes:
        return Section(f"<p class='open'>Not made: the sweep {esc(precision.SWEEP)} has no runs.</p>")
    rows, chosen, data = [], [], {}
    for scene in scenes:
        points = precision.points(results, *scene)
        cells = [esc(scene_name(*scene))]
        for error in ERRORS:
            best, second, _ = choice.choose(points, error)
            if best is None:
                cells.append("<span class='open'>none did</span>")
                continue
            chosen.append(best)
            data[f"{scene_name(*scene)} {error:g}"] = {"best": best["run"], "runner_up": second and second["run"]}
            behind = "" if second is None else f"<br><small>then {esc(setting(second))}: {second['time'] / best['time']:.2g} times the cost" \
                + ("" if choice.apart(best, second) else ", not told apart") + "</small>"
            cells.append(f"{esc(setting(best))}<br>{timed(best)}{behind}")
        rows.append(cells)
    html = ["<p>For each scene and wanted error (of the table of references above), the cheapest setting of the sweep that met it, its time in s for "
            "a simulated second, and the next of another method or solver. <code>scripts/recommend.py SCENE --error E</code> answers for any error, "
            "another measure, a limit of time for a step, and a scene of your own.</p>",
            table(["scene"] + [f"{error:g} m" for error in ERRORS], rows), "<ul>", wins(chosen),
            knob(results, scenes, "convex", "epsilon", "1e-6", "1e-12"), knob(results, scenes, "convex", "epsilon", "1e-2", "1e-6"),
            knob(results, scenes, "ap", "k", "4", "8"), knob(results, scenes, "ap", "k", "8", "32"), *turned(results), *limits(results, scenes), forbidden(chosen), "</ul>"]
    # Who is cheapest depends on the machine.
    return Section("\n".join(html), {}, {"answers": data, "text": html[2:]})
