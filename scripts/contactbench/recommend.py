"""Which method for a scene? Of all runs in the table of the sweep error_time, the cheapest that met a wanted error:
method, solver and knobs, with the run that shows it and the runner-up.

  scripts/recommend.py sliding_box --error 1e-3
  scripts/recommend.py stack --set boxes=4 --error 1e-6 --time-per-step 1e-4 --verify
  scripts/recommend.py my.xml --error 1e-3 --duration 2 --out my      first runs a small sweep of it into the folder my

Of a scene without an exact answer it steps down: to a reference on which two methods agree, over the whole run or for
as long as they do; to how each converges and how far methods are apart; to residuals, energy and time. It names the
step and how far it can be trusted (ladder.py).

Exit codes: 0 there is an answer (and it was confirmed, with --verify); 1 --verify could not confirm it; 2 wrong flags
or input; 3 no run is known to meet the error: the nearest is named, or the cheapest that solves its contact problems.
"""
import contextlib
import json
import math
import os
import sys
import tempfile
from pathlib import Path

from . import engines, ladder, precision, program, references, sweep
from .gather import close, row_of
from .plan import Run
from .runs import Runs
from .templates import render

# The small sweep of a user's own scene: multiples of its step, all methods, a few polygons and tolerances.
STEPS = (4, 1, 0.25)
DEAR = 1.0  # s that a run at the scene's own step takes, from which on the sweep is the smallest one
LONG = 0.5  # of the run: how long two methods agree where what is measured is no longer than that
FRAMES = 200  # moments that are kept of a run that is looked at
TENTHS = 5  # of a second, at most, between moments of a reference that are whole steps


class WrongInput(Exception):
    """Flags or input that cannot be answered: says what would be right."""


def listed(path):
    try:
        return program.listed(path)
    except program.ProgramError as error:
        raise WrongInput(f"{error}; --program names another one") from None


def scene_file(path, scene):
    """File of a scene: a path, or the name of one that comes with the program."""
    if Path(scene).is_file():
        return str(Path(scene).resolve())
    found = program.scenes_of(listed(path)).get(scene.removesuffix(".xml"))
    if not found:
        raise WrongInput(f"no scene '{scene}': a file, or a name of `contactbench list scenarios`")
    return found["file"]


def this_machine():
    """CPU and cores as the program names them in a summary."""
    return {"cpu": program.cpu(), "cores": os.cpu_count()}


def measured_on(results):
    """The machine whose times the table holds, and whether it is this one, as far as its names tell."""
    there, here = results.manifest.get("machine") or {}, this_machine()
    if isinstance(there, list):
        there = {"cpu": "several machines, as " + ", ".join(dict.fromkeys(str(m.get("cpu")) for m in there))}
    return {**{k: there.get(k) for k in ("cpu", "cores", "os")}, "this_machine": here.items() <= there.items()}


def whole(step, duration=math.inf):
    """Simulated seconds that are whole steps, and how many: the distance of a reference's moments, or some of it; where
    none fits, about as many or a tenth of the run, so that runs whose steps divide this one share moments."""
    for n in range(1, TENTHS + 1):
        steps = round(n * references.INTERVAL / step)
        fits = math.isclose(steps * step, n * references.INTERVAL, rel_tol=1e-9)
        if fits and n * references.INTERVAL <= duration * (1 + 1e-9):
            return round(n * references.INTERVAL, 9), steps
    steps = max(1, round(min(references.INTERVAL, duration / 10) / step))
    return steps * step, steps


def kept_every(known):
    """Simulated seconds between the moments of a run to look at: about FRAMES of them, those that the steps share with
    each other and the reference among them."""
    interval, steps = whole(STEPS[0] * known["own_step"], known["duration"])
    wanted = known["duration"] / FRAMES
    fit = [interval / n for n in range(1, steps + 1) if steps % n == 0]
    return min(fit, key=lambda some: abs(math.log(some / wanted)))


def sweep_of(options, contacts=False):
    """Runs a scene over methods and knobs in the folder --out, for what is not there yet, after what it can be measured
    against; its table."""
    file = scene_file(options.program, options.scene)
    # Made for a scene with an exact answer too: the one is a check on the other.
    try:
        known = references.make(options.program, file, options.set, options.duration, options.out / "references",
                                options.limit).about
    except program.ProgramError as error:
        raise WrongInput(str(error)) from None
    steps = [f"{known['own_step'] * m:.12g}" for m in STEPS]
    # What is measured is run for as long as it can be, if that says something of the run; what is looked at to the end.
    until = known["until"] if known["accepted"] and not contacts else 0.0
    until = until if until >= LONG * known["duration"] else known["duration"]
    toml = options.out / f"{precision.SWEEP}.toml"
    interval = kept_every(known) if contacts else whole(STEPS[0] * known["own_step"], until)[0]
    toml.write_text(
        render("small_sweep.toml", interval=interval, duration=min(until, known["duration"]),
               limit=options.limit, scene=file, steps=steps, contacts=contacts, sets=[
                   p.partition("=") for p in options.set], dear=known["took_s"] > DEAR))
    words = [toml, "--program", options.program, "--runs", options.out / "runs", "--out", options.out]
    try:
        with contextlib.redirect_stdout(sys.stderr):
            sweep.sweep(sweep.arguments([str(word) for word in words]))
    except (program.ProgramError, SystemExit) as error:
        print(f"sweep: {error}", file=sys.stderr)
        raise WrongInput("the sweep of it could not be done") from None
    return Runs(options.out, options.out / "runs")


def small_sweep(options):
    if options.out is None:
        raise WrongInput(
            f"{options.scene} is not in the table: --out names a folder for the small sweep that it needs first")
    return sweep_of(options)


def table(options):
    """The results that hold the scene."""
    name, parameters = Path(options.scene).stem, " ".join(options.set)
    if Path(options.scene).is_file() or options.out is not None:
        return small_sweep(options)
    if not (options.results / "runs.csv").exists():
        raise WrongInput(
            f"{options.results} has no runs.csv: scripts/reproduce.sh makes it; --results names another folder")
    results = Runs(options.results)
    there = dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=precision.SWEEP))
    if name in {scene for scene, _ in there} and (name, parameters) not in there:
        raise WrongInput(f"the table has no runs of '{name} {parameters}'; it has " +
                         ", ".join(" --set ".join(filter(None, s))
                                   for s in there) + "; --out names a folder for a small sweep of others")
    return results if (name, parameters) in there else small_sweep(options)


def said(point):
    """A point for --json and for the text; None of none."""
    if point is None:
        return None
    cell = point["cell"]
    return {
        "run": point["run"],
        **{c: cell[c] for c in ("method", "solver", "variant", "k", "epsilon", "knobs")}, "label": cell.label,
        "error": point["error"], "worst_of_ensemble": None if point["worst"] == math.inf else point["worst"],
        "uncertainty": point["uncertainty"], "time_per_simulated_second": point["time"], "time_least": point["least"],
        "time_most": point["most"], "time_per_step": point["time_per_step"], "repeats": point["repeats"],
        "busy": point["busy"], "command": cell.command}


def worst_of(point):
    """What the choice went by, where that is not the error of the published run itself."""
    worst = point["worst_of_ensemble"]
    if worst is None:
        return " (a run of its ensemble does not end ok)"
    return "" if close(point["error"], worst) else f" (up to {worst:.3g} in its ensemble)"


def show(title, point, measure):
    print(f"{title}: {point['label']}")
    noise = "one run: noise unknown"
    if point["repeats"] > 1:
        noise = f"{point['time_least']:.3g} to {point['time_most']:.3g} in {point['repeats']} runs"
    busy = ", machine busy" if point["busy"] else ""
    error = "" if measure == ladder.RESIDUAL else f"{measure} = {point['error']:.3g}{worst_of(point)}; "
    print(f"  {error}{point['time_per_simulated_second']:.3g} s a simulated second "
          f"({noise}{busy}), {point['time_per_step']:.3g} s a step")
    print(f"  run {point['run']}\n  {point['command']}")


def once(run, step, measure, options, results):
    """Does a run in a process and a folder of its own: (status, error, s a simulated second)."""
    file = scene_file(options.program, options.scene)
    # Recorded as in the sweep: a certified error needs the moments of its reference.
    every = whole(float(step))[1] if step else 1
    with tempfile.TemporaryDirectory() as runs:
        scene, statuses = file if Path(options.scene).is_file() else f"{run.scene}.xml", program.statuses_of(
            listed(options.program))
        record = program.do(
            program.job_of(run, options.program, scene, file, runs, statuses, options.limit, record_every=every),
            program.Load())
        folder, parameters = Path(runs) / run.name, run.asked()["parameters"]
        certified = references.read(results.folder / "references", run.scene, parameters,
                                    program.files_of(options.program, file, parameters))
        row = row_of(run, record, program.read_json(folder / "summary.json") or {}, folder, certified)
    error, took = (row.get(f"error_{measure}") or None), row["processing_s"] or None
    return row["status"], error and float(error), took and float(took) / float(row["duration"])


def again(point, options, results):
    """Does the run of a point once more, as `once`."""
    return once(Run.of(point["cell"].row), point["step"], point["measure"], options, results)


ROUNDS = 3  # of what is compared with engines, in turns


def engine_runs(best, points, options):
    """The runs of the engines that are asked for: every variant, as it is and tuned where somebody searched for its
    knobs, at every step of the table and over the seconds of the answer."""
    said = listed(options.program)["engines"]
    for name in options.against:
        if name not in [engine["name"] for engine in said]:
            raise WrongInput(f"--against {name}: no such engine; there are {', '.join(e['name'] for e in said)}")
    own = Run.of(best["cell"].row)
    kept = tuple((knob, value) for knob, value in own.knobs if knob in ("duration", "restitution", "friction"))
    steps = dict.fromkeys(p["step"] for p in points if p["step"])
    for engine in said:
        if engine["name"] not in options.against or engine["unavailable"]:
            continue
        for variant in engine["variants"]:
            for setting in engines.SETTINGS:
                if setting == "default" or engines.known(engine["name"], variant["name"]):
                    for step in steps:
                        knobs = (("step", step), *kept, ("setting", setting))
                        yield Run(own.scene, own.sets, engine["name"], variant["name"], "", knobs, 1, engine=True), step


def against(best, points, options, results):
    """The answer and the engines, run here in turns: the least time of each, and who is the cheapest to meet the
    error."""
    measure = best["measure"]
    todo = [("", Run.of(best["cell"].row), best["step"]),
            *((r.method, r, s) for r, s in engine_runs(best, points, options))]
    rows = [{
        "engine": engine, "run": run.name, "variant": run.variant, "knobs": run.asked()["knobs"], "status": "",
        "error": None, "time_per_simulated_second": None, "meets": False} for engine, run, _ in todo]
    for turn in range(ROUNDS):
        for row, (_, run, step) in zip(rows, todo):
            if turn and not row["meets"]:
                continue  # what misses the error is not timed again
            row["status"], row["error"], took = once(run, step, measure, options, results)
            met = row["status"] == "ok" and row["error"] is not None and took is not None
            row["meets"] = met and row["error"] + best["uncertainty"] <= options.error
            if took is not None:
                row["time_per_simulated_second"] = min(took, row["time_per_simulated_second"] or took)
    good = [row for row in rows if row["meets"]]
    return {
        "rows": rows, "cheapest": min(good, key=lambda row: row["time_per_simulated_second"], default=None),
        "unavailable": [
            e["name"] for e in listed(options.program)["engines"] if e["name"] in options.against and e["unavailable"]]}


def verify(best, cheaper, options, results):
    """Whether new runs say the same: the chosen one meets the error, and none of the cheaper ones does."""
    faults, runs, unfit = [], [], 0
    for point in [best, *cheaper]:
        status, error, took = again(point, options, results)
        meets = status == "ok" and error is not None and error + point["uncertainty"] <= options.error
        late = options.time_per_step is not None and point["time_per_step"] > options.time_per_step
        runs.append({"run": point["run"], "status": status, "error": error, "time_per_simulated_second": took})
        if point is best and not meets:
            faults.append(f"{point['run']} does not meet the error: {status}, {error}")
        missed = point["error"] + point["uncertainty"] > options.error  # and not only in a member of its ensemble
        judged = missed and not late and point["cell"]["false_claims"] == "0"
        unfit += point is not best and not judged
        if point is not best and meets and judged:
            faults.append(f"{point['run']} is cheaper in the table and meets the error: {error}")
    return {"runs": runs, "faults": faults, "missed": len(cheaper) - unfit, "unfit": unfit}


def lasts(points, options):
    """The seconds that an answer is about: of the published table those that were run; None of all of the scene, of
    which a small sweep runs what is known."""
    if options.out is not None or Path(options.scene).is_file():
        return None
    return max((float(p["cell"]["duration"]) for p in points if p["error"] is not None), default=None)


def answer(options):
    """What --json prints; `best` is None where none met the error, or `reference` is missing."""
    scene, parameters = Path(options.scene).stem, " ".join(options.set)
    made = {
        "scene": scene, "parameters": parameters, "measure": options.measure, "wanted": options.error,
        "time_per_step": options.time_per_step, "best": None, "runner_up": None}
    results = table(options)
    of_scene = results.table[(results.table["scene"] == scene) & (results.table["parameters"] == parameters)]
    measures = [c.removeprefix("error_") for c in of_scene if c.startswith("error_") and of_scene[c].any()]
    if options.measure and options.measure not in measures:
        raise WrongInput(f"{scene} has no error '{options.measure}'; it has {', '.join(measures)}")
    measure = made["measure"] = options.measure or precision.measure(results, scene, parameters)
    made["measured_on"] = measured_on(results)
    about = results.manifest.get("references", {}).get(references.name_of(scene, parameters)) or {}
    # A reference that is known no better than the wanted error cannot say who meets it.
    unsure = precision.uncertainty(results, scene, parameters) if measure == references.ERROR else 0.0
    if not measure or unsure >= options.error:
        for flag, asked in (("--against", options.against), ("--verify", options.verify)):
            if asked:
                raise WrongInput(
                    f"{flag} compares errors, and where the bodies of this scene should be is not known so well")
        rows = ladder.steps_down(results, scene, parameters, options.error, options.time_per_step)
        row = next((r for r in rows if r["best"]), rows[0])
        made |= {key: row[key] for key in ("basis", "trust")} | {
            "measure": row["basis"], "reference": precision.reference_of(results, scene, parameters, measure)
            if measure else "missing", "why": about.get("reason", "")}
        made |= {"runs": len(results.cells(scene, precision.SWEEP, parameters=parameters))}
        made |= {key: said(row[key]) for key in ("best", "runner_up")} | {"nearest": said(rows[0]["nearest"])}
        made |= {"told_apart": precision.told_apart(row["best"], row["runner_up"]) if row["runner_up"] else None}
        made |= {"steps": [{key: r[key] if key in ("basis", "trust") else said(r[key]) for key in r} for r in rows]}
        return made | {"furthest": ladder.furthest(results, scene, parameters) if not rows[-1]["nearest"] else ""}
    points = precision.points(results, scene, parameters, measure)
    made["reference"] = precision.reference_of(results, scene, parameters, measure)
    made["basis"] = ladder.basis_of(measure, about, options.duration or lasts(points, options))
    made["trust"] = ladder.TRUST[made["basis"]].format(until=about.get("until") or 0)
    made["runs"] = len(points)
    best, second, cheaper = precision.choose(points, options.error, options.time_per_step)
    if best is None:
        near = precision.nearest(points)
        beside = {"against": against(near, points, options, results)} if near and options.against else {}
        return made | {"nearest": said(near)} | beside
    made |= {
        "best": said(best), "runner_up": said(second), "cheaper_that_missed": len(cheaper),
        "told_apart": precision.told_apart(best, second) if second else None}
    if options.verify:
        made["verified"] = verify(best, cheaper, options, results)
    if options.against:
        made["against"] = against(best, points, options, results)
    return made


def show_all(made):
    late = f" and at most {made['time_per_step']:g} s a step" if made["time_per_step"] else ""
    scene = f"{made['scene']} {made['parameters']}".strip()
    wanted = "" if made["basis"] == ladder.RESIDUAL else f" <= {made['wanted']:g}"
    print(f"{scene}, {made['measure']}{wanted}{late} "
          f"(reference {made['reference']}, {made['runs']} settings in the table)")
    for row in made.get("steps", ()):  # those above the one that answers
        if row["basis"] == made["basis"]:
            break
        near = row["nearest"]
        least = f"{near['error']:.3g} m{worst_of(near)}"
        print(f"not by {row['basis']}: the least is {least}, by {near['label']}; {row['trust']}")
    print(f"by what: {made['basis']}: {made['trust']}" + (f" ({made['why']})" if made.get("why") else ""))
    on = made["measured_on"]
    print(f"times are those of {on['cpu'] or 'an unnamed CPU'}, {on['cores']} cores, " +
          ("as this machine has" if on["this_machine"] else
           "not of this machine: --verify runs the answer here, scripts/reproduce.sh measures all of it here"))
    if made["best"] is None:
        nobody = "none ended ok"
        if "furthest" in made:
            nobody = f"no run of it came to the end; furthest: {made['furthest']}"
        print("none did" if made["nearest"] else nobody)
        if made["nearest"]:
            show("least error", made["nearest"], made["measure"])
        if "against" in made:
            show_against(made["against"])
        return
    show("cheapest", made["best"], made["measure"])
    if made["runner_up"]:
        apart = {None: " (too few repeats to tell them apart)", False: " (times overlap: not told apart)",
                 True: ""}[made["told_apart"]]
        show(f"runner-up{apart}", made["runner_up"], made["measure"])
    else:
        print("runner-up: no other method or solver met it")
    if "verified" in made:
        for fault in made["verified"]["faults"]:
            print(f"not confirmed: {fault}")
        if not made["verified"]["faults"]:
            missed, unfit = made["verified"]["missed"], made["verified"]["unfit"]
            others = [f"the {missed} cheaper in the table do not, run again"] * (missed > 0)
            others += [f"{unfit} cheaper are no answer by their step, their ensemble or a refuted claim"] * (unfit > 0)
            others = "; ".join(others) or "nothing in the table is cheaper"
            print(f"confirmed: run again, it meets the error; {others}")
    if "against" in made:
        show_against(made["against"])


def show_against(made):
    print("here, in turns, the answer and the engines (docs/engines.md: what each does with the simplest scenes):")
    for row in made["rows"]:
        who = " ".join(filter(None, (row["engine"] or "the answer", row["variant"], row["knobs"])))
        error = "no error" if row["error"] is None else f"{row['error']:.3g}"
        time = "" if row[
            "time_per_simulated_second"] is None else f", {row['time_per_simulated_second']:.3g} s a simulated second"
        print(f"  {who}: {row['status']}, {error}{' (meets it)' if row['meets'] else ''}{time}")
    for name in made["unavailable"]:
        print(f"  {name}: unavailable")
    best = made["cheapest"]
    print("cheapest of them: " +
          ("none met it here" if best is None else f"{best['engine'] or 'the answer'} ({best['run']})"))


def main():
    parser = program.flags(__doc__)
    parser.add_argument("scene", help="a scene of the table, or a file of your own")
    parser.add_argument("--error", type=program.positive, required=True,
                        help="wanted error, in the unit of the measure")
    parser.add_argument(
        "--measure",
        help="which error (`contactbench list references`; certified_linf_m) [the scene's largest of position]")
    parser.add_argument("--time-per-step", type=program.positive, metavar="S",
                        help="processing time that a step may take, s")
    parser.add_argument("--set", action="append", default=[], type=program.setting, metavar="NAME=VALUE",
                        help="a parameter of the scene")
    parser.add_argument("--verify", action="store_true", help="run the answer and all that is cheaper again")
    parser.add_argument("--against", action="append", default=[], metavar="ENGINE",
                        help="an engine to run beside the answer (`contactbench list engines`); more by more of these")
    parser.add_argument("--json", action="store_true", help="the answer as JSON")
    parser.add_argument("--results", type=Path, default=program.ROOT / "results", help="folder of runs.csv [results]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, help="folder for the small sweep of a scene that is not in the table")
    parser.add_argument("--duration", type=program.positive, help="simulated seconds of the small sweep [the scene's]")
    parser.add_argument("--limit", type=program.positive, default=60, help="seconds for one run [60]")
    options = parser.parse_args()
    try:
        made = answer(options)
    except WrongInput as error:
        print(f"recommend: {error}", file=sys.stderr)
        return 2
    if options.json:
        print(json.dumps(made, indent=1))
    else:
        show_all(made)
    if made["best"] is None or made["basis"] == ladder.RESIDUAL:
        return 3
    return 1 if made.get("verified", {}).get("faults") else 0
