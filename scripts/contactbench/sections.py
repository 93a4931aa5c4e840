"""The sections of the report, in their order: each a function of the results -> Section, whose page is the file of the
same name in templates/sections/. What the page shows, what report.json says the same whenever the same is run, and
what depends on the machine."""
import collections
import hashlib
import math
import shlex
import statistics
from dataclasses import dataclass, field

from . import claims, precision, repose, scenery, solve_all, stepping, table1, today, worth
from . import engines as engines_beside
from . import found as found_out
from .figures import FIGURES, SAYS
from .gather import LIMITS
from .looks import look_of
from .measures import BAD, VERDICTS
from .plan import without_member
from .templates import TEMPLATES

FIRST_LOOK = "statuses, errors and claims hold, times are a first look"
PROFILES = {
    "quick": f"one run a cell (two of the sliding box) and limits of some seconds a run: {FIRST_LOOK}",
    "paper": "the paper's durations, three interleaved repeats, limits of ten minutes a run"}
ERRORS = (1e-2, 1e-4, 1e-6, 1e-9)  # m, for which a method is advised
TIMES = ("median_s", "minimum_s", "maximum_s", "ratio", "busy")
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a6d3b", "#7a7a7a", "#b2182b", "#5e3c99")
SAY = TEMPLATES.get_template("advice.html").module


class Plain(dict):
    """What the page shows of the published runs alone, without the spread of the others."""
    alone = True


@dataclass
class Section:
    title: str
    shown: dict
    data: dict = field(default_factory=dict)
    timing: dict = field(default_factory=dict)


def picked(row, keys):
    return {key: row[key] for key in keys}


def of_paper(results):
    """Whether these are the paper's scenes, of which it claims something."""
    return "paper" in results.manifest.get("sweeps", [])


def scene_name(scene, parameters):
    return f"{scene.replace('_', ' ')} {parameters}".strip()


def lasts(results, scene):
    """The simulated time of a scene in error against run time."""
    durations = {
        float(c["duration"]) for c in results.cells(scene[0], precision.SWEEP, parameters=scene[1]) if c["duration"]}
    return " or ".join(f"{d:g} s" for d in sorted(durations))


def figure(results, name, sweep="paper", made_by=None):
    """One figure with what the paper's shows and the commands that made its data: of the runs of a sweep, or of what
    the command `made_by` writes. For the page, for report.json, and the picture's digest."""
    scene, text = FIGURES[name].scene, SAYS[name]
    title, _, rest = text.partition(": ")
    image = results.folder / "figures" / f"{name}.png"
    cells = results.cells(scene) if scene else []
    profile = "" if results.profile == "default" else results.profile
    if (results.folder / f"{sweep}.toml").exists():  # of one scene, as compare.py and recommend.py make it
        folder = results.folder.resolve().name
        made = [
            shlex.join(["scripts/sweep.py", f"{folder}/{sweep}.toml", "--runs", f"{folder}/runs", "--out", folder]),
            shlex.join([f"scripts/plots/{name}.py", "--results", folder, "--runs", f"{folder}/runs"])]
    else:
        made = [made_by or f"scripts/sweep.py scenarios/sweeps/{sweep}.toml" + (profile and f" --profile {profile}")]
        made += [f"scripts/plots/{name}.py --results results --runs results/runs" + (profile and f"/{profile}")]
    runs = [cell.command for cell in cells]
    shown = {
        "name": name, "title": title, "rest": rest[:1].upper() + rest[1:], "scene": scene, "made": made, "runs": runs,
        "missing": results.missing(scene) if scene else "", "image": image if image.exists() else None,
        "busy": not made_by and any(c.busy for c in cells or results.cells(sweep=sweep))}
    digest = hashlib.sha256(image.read_bytes()).hexdigest() if image.exists() else None
    return shown, {"says": text, "scene": scene, "commands": made + runs}, digest


def found(results):
    """What was found, in ten lines."""
    lines = found_out.lines(results, of_paper(results))
    return Section("What was found", {"lines": lines}, {}, {"text": [text for text, _ in lines]})


def reading(results):
    manifest = results.manifest
    machine, versions, timing = manifest.get("machine") or {}, manifest.get("versions") or {}, manifest.get(
        "timing", {})
    runs, python = manifest.get("runs", 0), manifest.get("python")
    ratios = [max(c.times) / min(c.times) for c in results.cells(sweep=None) if len(c.times) > 1]
    apart = {"cells": len(ratios), "median": statistics.median(ratios), "worst": max(ratios)} if ratios else None
    if isinstance(machine, dict) and isinstance(versions, dict):
        made_with = [*{**machine, **versions, "python": python or ""}.items()]
    else:
        made_with = [("machine", machine), ("versions", versions)]
    made_with += [("sweeps", ", ".join(manifest.get("sweeps", []))),
                  ("runs", ", ".join([f"{runs}"] + [f"{n} {s}" for s, n in manifest.get("statuses", {}).items()]))]
    made_with += [(f"left out: {name}", why) for name, why in manifest.get("missing", {}).items()]
    if manifest.get("runs_not_done_yet"):
        made_with.append(("not done yet", manifest["runs_not_done_yet"]))
    shown = {
        "paper": of_paper(results), "profile_means": PROFILES.get(results.profile, ""), "busy": timing.get(
            "runs_on_a_busy_machine", 0), "runs": runs, "apart": apart, "made_with": made_with}
    # The repeat count and limits of a cell are in runs.csv; the machine itself is what times depend on.
    return Section("How to read this", shown,
                   {key: manifest.get(key) for key in ("profile", "sweeps", "runs", "members", "missing", "statuses")},
                   {"machine": machine, "versions": versions, "python": python, "busy": timing, "spread": apart})


def table_one(results):
    found = table1.entries(results)
    rows, shown = [row for _, row in found], table1.grid(results, found)

    def changes(row, key):  # with the machine: a run that a limit cut is cut elsewhere next time
        return key in TIMES or row["status"] in LIMITS and key in ("reason", "t_reached")

    return Section("Table I: processing time", shown,
                   {"rows": [{k: v for k, v in row.items() if not changes(row, k)} for row in rows]},
                   {"rows": [picked(row, TIMES) for row in rows]})


def claim_table(results):
    answers = [claims.answered(name, results) for name in claims.ALL]
    parts = {claim.id: claim.as_data() for claim in answers}
    return Section("The paper's claims", {"claims": answers, "said": claims.said},
                   {name: data for name, (data, _) in parts.items()},
                   {name: timing for name, (_, timing) in parts.items() if timing})


def figures(results):
    # figure01 ... figure11 first, then the other pictures; those of other sections stand there.
    names = sorted((n for n, of in FIGURES.items() if not of.elsewhere), key=lambda n: (not n.startswith("figure"), n))
    found = {name: figure(results, name) for name in names}
    return Section("Figures", {"figures": [shown for shown, _, _ in found.values()]},
                   {name: data for name, (_, data, _) in found.items()},
                   {name: {"sha256": digest} for name, (_, _, digest) in found.items()})


def error_time(results):
    picture, about, digest = figure(results, "error_time", precision.SWEEP)
    parts, _, digest_of_parts = figure(results, "error_budget", precision.SWEEP)
    against, points, fronts, budgets = [], [], {}, {}
    for scene in precision.scenes(results):
        name, measure, some = scene_name(*scene), precision.measure(results, *scene), precision.points(results, *scene)
        against.append((name, measure, lasts(results, scene), precision.reference_of(results, *scene, measure)))
        points += some
        front = precision.pareto(some)
        fronts[name] = [p | {"spread": precision.spread(p)} for p in front]
        budgets[name] = precision.budget(results, *scene)
    against += [(name, "", "", f"missing: {about['reason']}")
                for name, about in results.manifest.get("references", {}).items() if not about["accepted"]]
    fixed = ("scene", "parameters", "step", "measure", "status", "error")
    parts_of = ("solver", "model", "step_error", "total", "dominates")
    data = {"figure": about, "points": [{"run": p["cell"].unrepeated, **picked(p, fixed)} for p in points]}
    data["budget"] = {name: {r["cell"].unrepeated: picked(r, parts_of) for r in rows} for name, rows in budgets.items()}
    timed = ("run", "time", "least", "most", "repeats", "busy")
    timing = {"sha256": [digest, digest_of_parts], "points": [picked(p, timed) for p in points]}
    timing["pareto"] = {name: [p["run"] for p in front] for name, front in fronts.items()}
    shown = {"picture": picture, "parts": parts, "against": against, "fronts": Plain(fronts), "budgets": budgets}
    shown["hover"] = hover(points)
    return Section("Error against run time", shown, data, timing)


def hover(points):
    """What the page's script draws: the points of each scene as plain numbers."""
    scenes, looks = {}, {}
    for p in (p for p in points if p["error"] is not None):
        cell, plain = p["cell"], picked(p,
                                        ("run", "error", "time", "least", "most", "repeats", "uncertainty", "status"))
        plain |= {"label": f"{cell.with_k}, {cell.way}", "key": cell.name.partition(",")[0], "command": cell.command}
        plain |= {"good": precision.met(p, math.inf), "worst": p["worst"] if math.isfinite(p["worst"]) else 1e300}
        ended = [e for e in p["errors"] if math.isfinite(e)]
        plain |= {"error": max(ended), "few": min(ended)}  # of the ensemble, as in the front and in the advice
        looks[plain["key"]] = look_of(cell.key, ("", ""))[1]
        scenes.setdefault(scene_name(p["scene"], p["parameters"]), []).append(plain)
    return Plain({
        "scenes": scenes, "colours": {
            key: colour or COLOURS[n % len(COLOURS)] for n, (key, colour) in enumerate(looks.items())}})


def scenes(results):
    """Every scene with its picture and its motion, which report.py writes beside the report."""
    found = scenery.motions(results) if results.whole else {}
    shown = {name.partition(" ")[0] for name in found}
    without = [s for s in dict.fromkeys(results.table["scene"]) if s not in shown]
    if not of_paper(results) or not repose.cells(results):
        return Section("The scenes", Plain(scenes=found, without=without, repose=None))
    picture, about, digest = figure(results, repose.FIGURE, repose.SWEEP)
    shown = Plain(scenes=found, without=without, repose=picture)
    return Section("The scenes", shown, {"repose": about}, {"repose_sha256": digest})


def differences(results):
    """Of any scenes: every setting, and how far methods are from each other."""
    tables, far = {}, {}
    for scene in scenery.scenes(results):
        tables[scene_name(*scene)], far[scene_name(*scene)] = scenery.table(results, *scene), scenery.apart(
            results, *scene)
    # How each ended and what it came to; when is the machine's.
    fixed = {name: [{k: v for k, v in row.items() if k != "time"} for row in of["rows"]] for name, of in tables.items()}
    return Section("Settings and differences", {"tables": tables, "apart": far}, {"rows": fixed, "apart": far},
                   {name: [picked(row, ("run", "time")) for row in of["rows"]] for name, of in tables.items()})


def wins(chosen):
    """Of the answers, how many are whose: one sentence."""
    return SAY.wins(len(chosen),
                    collections.Counter(
                        best["cell"].name.partition(",")[0] for best in chosen).most_common()) if chosen else ""


def knob(results, scenes, model, name, coarse, fine):
    """What a finer knob bought at the same step, or to the same accuracy, over the scenes: one sentence."""
    less = more = 0
    ratios = []
    for scene in scenes:
        points = {}
        for p in precision.points(results, *scene):
            if p["cell"]["method"] == model and p["error"] is not None:
                points[p["cell"]["solver"], p["cell"].step_or_accuracy, p["cell"][name]] = p
        for (solver, step, value), a in points.items():
            b = points.get((solver, step, fine))
            if value == coarse and b:
                low = max(a["uncertainty"], precision.TINY)
                less += b["error"] < 0.9 * a["error"] and a["error"] > low
                more += a["error"] < 0.9 * b["error"] and b["error"] > low
                ratios.append(b["time"] / a["time"])
    return SAY.knob(model, name, coarse, fine, less, more, len(ratios), statistics.median(ratios)) if ratios else ""


def limit(results, scene):
    """What is left at the best answer of a scene: one sentence."""
    close = precision.nearest(precision.points(results, *scene))
    row = next((r for r in precision.budget(results, *scene) if close and r["cell"]["run"] == close["run"]), {})
    rest = row.get("dominates", "")
    return SAY.limit(scene_name(*scene), close, rest if rest in ("solver", "model", "step") else "")


def forbidden(chosen):
    """What convex, where it is advised, can't do in other scenes than these: one sentence."""
    return SAY.forbidden() if any(best["cell"]["method"] == "convex" for best in chosen) else ""


def advice(results):
    """For each scene and wanted error the cheapest that met it, and what of that holds over all scenes."""
    scenes, rows, chosen, data = precision.scenes(results), {}, [], {}
    for scene in scenes:
        points, name = precision.points(results, *scene), scene_name(*scene)
        for error in ERRORS:
            best, second, _ = precision.choose(points, error)
            near = None if best else precision.nearest(points)
            rows.setdefault(f"{name}, {lasts(results, scene)}", []).append(
                (best, second, second and precision.told_apart(best, second), near))
            if best:
                chosen.append(best)
                data[f"{name} {error:g}"] = {"best": best["run"], "runner_up": second and second["run"]}
    if not scenes:
        return Section("Which method to use", {"rows": {}, "sweep": precision.SWEEP})
    # A polygon costs most where its corners do not lie along the motion, as they do in most scenes.
    turned = [SAY.turned(r) for r in precision.polygons(results) if r["turned"] == "turned by pi/k"]
    finer = [
        knob(results, scenes, *of)
        for of in (("convex", "epsilon", "1e-6", "1e-12"), ("convex", "epsilon", "1e-2", "1e-6"), ("ap", "k", "4", "8"),
                   ("ap", "k", "8", "32"))]
    left = [limit(results, scene) for scene in scenes]
    text = [
        "<ul>",
        worth.Whole(wins(chosen)), *map(str, [*finer, *turned]), *map(worth.Whole, left),
        forbidden(chosen), "</ul>"]
    # Who is cheapest depends on the machine.
    return Section("Which method to use",
                   {"rows": Plain(rows), "heads": [f"{error:g} m" for error in ERRORS], "text": text}, {},
                   {"answers": data, "text": text})


def models_today(results):
    """What each model does wrong, from the paper's to those of today: against exact Coulomb friction at the same
    step, so that the error of the step is none of a model's."""
    title, rows = "From the paper to today", today.rows_of(results)
    if not rows:
        return Section(title, {"rows": None})
    lines, good = today.budget(rows), today.advice(rows)
    fixed = ("column", "status", "apart", "law", "error", "agree")
    shown = {
        "rows": rows, "columns": today.COLUMNS,
        "lines": [(f"{scene_name(*key[:2])}, step {key[2]} s", line) for key, line in lines.items()], "good": [
            (f"{scene_name(*key[:2])}, step {key[2]} s", good.get(key, [])) for key in lines], "sweep": today.SWEEP}
    data = {"runs": {r["cell"].unrepeated: picked(r, fixed) for r in rows}}
    timing = {r["cell"].unrepeated: r["time_per_step"] for r in rows}
    return Section(title, shown, data, {
        "time_per_step": timing, "cheapest": {name: some[0]["cell"].unrepeated
                                              for name, some in shown["good"] if some}})


def convergence(results):
    """Observed order in the step, and the friction polygon's error against its number of edges."""
    shown = {"orders": precision.orders(results), "polygons": precision.polygons(results)}
    data = {
        name: [{k: v for k, v in r.items() if k != "cells"} | {"runs": [c["run"] for c in r["cells"]]} for r in rows]
        for name, rows in shown.items()}
    return Section("Order in the step and in the polygon", shown, data)


def ways_of_stepping(results):
    """Steps to a wanted accuracy: wanted against reached, what each order costs, the steps over time."""
    picture, about, digest = figure(results, stepping.FIGURE, stepping.SWEEP)
    rows, cost = stepping.wanted(results), stepping.cost(results)
    fixed = ("scene", "parameters", "method", "wanted", "status", "reached", "switches", "impacts", "first_order_steps",
             "solves")
    data = {"figure": about, "wanted": {r["run"]: picked(r, fixed) for r in rows}, "cost": cost}
    return Section("Steps to a wanted accuracy", {"picture": picture, "rows": rows, "cost": cost}, data,
                   {"sha256": digest})


def performance(results):
    """Performance profiles, and how often a claim of success is true."""
    picture, about, digest = figure(results, "performance", precision.SWEEP)
    rows = precision.truthfulness(results)
    shares = {
        name: r | {
            "ok_percent": 100 * r["ok"] / r["runs"], "true_percent": 100 *
            (1 - r["false_claims"] / r["solves"]) if r["solves"] else None} for name, r in rows.items()}
    # How far a run comes before a limit is the machine's, and with it the number of solves.
    limited = results.table["status"].isin(LIMITS).any()
    return Section("How often, how fast, how truthfully", {"picture": picture, "truth": shares},
                   {"figure": about, "truth": {} if limited else rows},
                   {"sha256": digest, "truth": rows if limited else {}})


def left_out(results):
    """What each thing that runs leave out saves where it applies, and costs where it does not (bench_prune)."""
    table = results.read("left_out.csv")
    rows = None if table is None else table.to_dict("records")
    return Section("What is left out", {"rows": rows}, {}, {} if rows is None else {"rows": rows})


def stored_problems(results):
    """Every solver over the same problems: stored ones, and frozen streams of what one run met; without a simulation
    around them."""
    shown, data, timing = {
        "collection": "scripts/solve_all.py --out results/solve_all",
        "replayed": "scripts/replay.py --out results/replay", "counts": None, "streams": None}, {}, {}

    def parts(counts):
        fixed = {
            f"{kind} {name}": {k: v for k, v in c.items() if k not in ("time", "busy")}
            for (kind, name), c in counts.items()}
        return {"solvers": fixed, "median_time_s": {f"{kind} {name}": c["time"] for (kind, name), c in counts.items()}}

    some = solve_all.rows_of(results)
    if some:
        made_by = shown["collection"]
        shown["picture"], data["figure"], timing["sha256"] = figure(results, "stored_problems", made_by=made_by)
        shown["counts"] = solve_all.summary(some)
        timing |= parts(shown["counts"])
    streams = solve_all.streams(results)
    if streams:
        made_by = shown["replayed"]
        shown["streamed"], data["streams"], timing["streams_sha256"] = figure(results, "streams", made_by=made_by)
        shown["streams"] = {scene: solve_all.summary(rows) for scene, rows in streams.items()}
        timing["streams"] = {scene: parts(counts) for scene, counts in shown["streams"].items()}
    return Section("The same problems for every solver", shown, data, timing)


def stiff_cases(results):
    """Stiff and extreme cases (results/stress, made by scripts/stress.py): where each method breaks, and whether it
    says so."""
    title, cells = "Stiff and extreme cases", results.read("stress/stress.csv")
    if cells is None:
        return Section(title, {"cells": None})
    methods = list(dict.fromkeys(cells["method"]))
    count = {v: {m: int(((cells["verdict"] == v) & (cells["method"] == m)).sum()) for m in methods} for v in VERDICTS}
    rows, places = {}, {}  # by names: by number they would be others' in an ensemble with other columns
    for row in cells.to_dict("records"):
        case = f"{row['id']} {row['scene']}: {row['row']}"
        place = "".join(c if c.isalnum() or c in "+-.=/" else "_" for c in f"{case} {row['method']}")
        rows[place] = row | {"command": without_member(row["command"], results.aside)}
        places.setdefault(case, dict.fromkeys(methods))[row["method"]] = place
    # Which cells end at their limit of time depends on the machine; none of these may.
    return Section(title, {"cells": rows, "meaning": VERDICTS, "methods": methods, "count": count, "map": places},
                   {"cells": len(cells), "faults": picked(count, BAD)}, {"verdicts": count})


def engines(results):
    """Engines beside the methods: their preflights, error and time on each scene, where one is ahead of us."""
    said, title = engines_beside.said(results), "Engines"
    if said is None:
        return Section(title, {"scenes": None})
    fixed = ("who", "setting", "precision", "step", "knobs", "measure", "status", "error", "fails")
    data = {
        name: {r["run"]: picked(r, fixed) for r in some if r["status"] not in LIMITS}
        for name, some in said["scenes"].items()}
    timing = {
        name: {r["run"]: picked(r, ("us_a_step", "front", "busy", "status")) for r in some}
        for name, some in said["scenes"].items()}
    same = picked(said, ("preflight", "findings", "own"))
    return Section(title, said, {"scenes": data} | same, {"scenes": timing, "ahead": said["ahead"]})


def unfinished(results):
    """Every run that did not end well, with its reason."""
    bad = results.table[(results.table["status"] != "ok") |
                        ~results.table["false_claims"].isin(["", "0"])].to_dict("records")
    # What a limit cut may come through on another machine.
    ends = [
        {r["run"]: [r["status"], r["reason"]] for r in bad if (r["status"] in LIMITS) == cut} for cut in (False, True)]
    shown = [r | {"t_reached": float(r["t_reached"]) if r["t_reached"] else None} for r in bad]
    return Section("Runs that did not end well", {"bad": shown}, *ends)


# Groups of the table of contents. A section that others do not build on is added at the end of its group.
GROUPS = {
    "Which method": (found, advice, error_time, models_today, scenes), "The paper": (claim_table, table_one, figures),
    "Accuracy and cost": (convergence, ways_of_stepping, performance, stored_problems, left_out),
    "Other programs": (engines, ), "Where it gets hard": (stiff_cases, unfinished), "About": (reading, )}
# Of scenes of which the paper claims nothing.
OTHERS = {
    "What was found": (found, scenes, differences), "Which method": (advice, error_time),
    "About": (unfinished, reading)}


def groups(results):
    """The groups of a report of these results."""
    if of_paper(results):
        return GROUPS
    known = bool(precision.scenes(results))  # is there an error to speak of?
    return {title: of for title, of in OTHERS.items() if known or error_time not in of}
