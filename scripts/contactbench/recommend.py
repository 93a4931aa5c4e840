"""Which method for a scene? Of all runs in the table of the sweep error_time, the cheapest that met a wanted error:
method, solver and knobs, with the run that shows it and the runner-up.

  scripts/recommend.py sliding_box --error 1e-3
  scripts/recommend.py stack --set boxes=4 --error 1e-6 --time-per-step 1e-4 --verify
  scripts/recommend.py my.xml --error 1e-3 --duration 2 --out my      first runs a small sweep of it into the folder my

Of a scene without an exact answer it steps down: to a reference on which two methods agree, over the whole run or for as
long as they do; to how each converges and how far methods are apart; to residuals, energy and time. It names the step and
how far it can be trusted (ladder.py).

Exit codes: 0 there is an answer (and it was confirmed, with --verify); 1 --verify could not confirm it; 2 wrong flags
or input; 3 no run met the error: the nearest is named.
"""
import contextlib
import json
import math
import os
import sys
import tempfile
from pathlib import Path

from . import ladder, precision, program, references, sweep
from .plan import Run
from .runs import Runs, row_of
from .templates import render

# The small sweep of a user's own scene: multiples of its step, all methods, a few polygons and tolerances.
STEPS = (4, 1, 0.25)
DEAR = 1.0  # s that a run at the scene's own step takes, from which on the sweep is the smallest one
FRAMES = 200  # moments that are kept of a run that is looked at


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


def kept_every(known):
    """Simulated seconds between the moments of a run to look at: about FRAMES of them, those of its reference among
    them."""
    parts = references.INTERVAL / (STEPS[0] * known["own_step"])
    fit = [n for n in range(1, round(parts) + 1) if parts / n == round(parts / n, 9) and round(parts) % n == 0]
    wanted = known["duration"] / FRAMES
    return min((references.INTERVAL / n for n in fit or [1]), key=lambda interval: abs(math.log(interval / wanted)))


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
    # What is measured is run for as long as it can be, what is looked at to the end.
    until = known["until"] if known["accepted"] and not contacts else known["duration"]
    toml = options.out / f"{precision.SWEEP}.toml"
    interval = kept_every(known) if contacts else references.INTERVAL
    toml.write_text(
        render("small_sweep.toml", interval=interval, duration=min(until, known["duration"]), limit=options.limit,
               scene=file, steps=steps, contacts=contacts, sets=[p.partition("=") for p in options.set],
               dear=known["took_s"] > DEAR))
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
    results = Runs(options.results, options.results / "runs")
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


def show(title, point, measure):
    print(f"{title}: {point['label']}")
    noise = "one run: noise unknown"
    if point["repeats"] > 1:
        noise = f"{point['time_least']:.3g} to {point['time_most']:.3g} in {point['repeats']} runs"
    busy = ", machine busy" if point["busy"] else ""
    error = "" if measure == ladder.RESIDUAL else f"{measure} = {point['error']:.3g}; "
    print(f"  {error}{point['time_per_simulated_second']:.3g} s a simulated second "
          f"({noise}{busy}), {point['time_per_step']:.3g} s a step")
    print(f"  run {point['run']}\n  {point['command']}")


def again(point, options, results):
    """Does the run of a point once more, in a process and a folder of its own: (status, error, s a simulated
    second)."""
    run, file = Run.of(point["cell"].row), scene_file(options.program, options.scene)
    # Recorded as in the sweep: a certified error needs the moments of its reference.
    every = max(1, round(references.INTERVAL / float(point["step"]))) if point["step"] else 1
    with tempfile.TemporaryDirectory() as runs:
        scene, statuses = file if Path(options.scene).is_file() else f"{run.scene}.xml", program.statuses_of(
            listed(options.program))
        record = program.do(
            program.job_of(run, options.program, scene, runs, statuses, options.limit, record_every=every),
            program.Load())
        folder, parameters = Path(runs) / run.name, run.asked()["parameters"]
        certified = references.read(results.folder / "references", run.scene, parameters,
                                    program.files_of(options.program, file, parameters))
        row = row_of(run, record, program.read_json(folder / "summary.json") or {}, folder, certified)
    error, took = (row.get(f"error_{point['measure']}") or None), row["processing_s"] or None
    return row["status"], error and float(error), took and float(took) / float(row["duration"])


def verify(best, cheaper, options, results):
    """Whether new runs say the same: the chosen one meets the error, and none of the cheaper ones does."""
    faults, runs = [], []
    for point in [best, *cheaper]:
        status, error, took = again(point, options, results)
        meets = status == "ok" and error is not None and error + point["uncertainty"] <= options.error
        late = options.time_per_step is not None and point["time_per_step"] > options.time_per_step
        runs.append({"run": point["run"], "status": status, "error": error, "time_per_simulated_second": took})
        if point is best and not meets:
            faults.append(f"{point['run']} does not meet the error: {status}, {error}")
        missed = point["error"] + point["uncertainty"] > options.error  # and not only in a member of its ensemble
        if point is not best and meets and missed and not late and point["cell"]["false_claims"] == "0":
            faults.append(f"{point['run']} is cheaper in the table and meets the error: {error}")
    return {"runs": runs, "faults": faults}


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
    if not measure:
        basis, trust, best, second, near = ladder.step_down(results, scene, parameters, options.error,
                                                            options.time_per_step)
        made |= {"basis": basis, "trust": trust, "measure": basis, "reference": "missing", "why": about.get("reason", "")}
        made |= {"runs": len(results.cells(scene, precision.SWEEP, parameters=parameters)), "best": said(best)}
        return made | {"runner_up": said(second), "nearest": said(near), "told_apart": best and second and
                       precision.told_apart(best, second)}
    points = precision.points(results, scene, parameters, measure)
    made["reference"], made["basis"] = precision.reference_of(
        results, scene, parameters, measure), ladder.basis_of(measure, about, options.duration)
    made["trust"] = ladder.TRUST[made["basis"]].format(until=about.get("until") or 0)
    made["runs"] = len(points)
    best, second, cheaper = precision.choose(points, options.error, options.time_per_step)
    if best is None:
        return made | {"nearest": said(precision.nearest(points))}
    made |= {
        "best": said(best), "runner_up": said(second), "cheaper_that_missed": len(cheaper),
        "told_apart": precision.told_apart(best, second) if second else None}
    if options.verify:
        made["verified"] = verify(best, cheaper, options, results)
    return made


def show_all(made):
    late = f" and at most {made['time_per_step']:g} s a step" if made["time_per_step"] else ""
    wanted = f"{made['measure']} <= {made['wanted']:g}{late}"
    scene = f"{made['scene']} {made['parameters']}".strip()
    print(f"{scene}, {wanted} (reference {made['reference']}, {made['runs']} settings in the table)")
    print(f"by what: {made['basis']}: {made['trust']}" + (f" ({made['why']})" if made.get("why") else ""))
    on = made["measured_on"]
    print(f"times are those of {on['cpu'] or 'an unnamed CPU'}, {on['cores']} cores, " +
          ("as this machine has" if on["this_machine"] else
           "not of this machine: --verify runs the answer here, scripts/reproduce.sh measures all of it here"))
    if made["best"] is None:
        print("none did" if made["nearest"] else "no run of it came to the end")
        if made["nearest"]:
            show("least error", made["nearest"], made["measure"])
        return
    show("cheapest", made["best"], made["measure"])
    if made["runner_up"]:
        unsure = {None: " (too few repeats to tell them apart)", False: " (times overlap: not told apart)",
                  True: ""}[made["told_apart"]]
        show(f"runner-up{unsure}", made["runner_up"], made["measure"])
    else:
        print("runner-up: no other method or solver met it")
    if "verified" in made:
        for fault in made["verified"]["faults"]:
            print(f"not confirmed: {fault}")
        if not made["verified"]["faults"]:
            missed = made["cheaper_that_missed"]
            others = f"the {missed} cheaper in the table do not, run again"
            others = others if missed else "nothing in the table is cheaper"
            print(f"confirmed: run again, it meets the error; {others}")


def main():
    parser = program.flags(__doc__)
    parser.add_argument("scene", help="a scene of the table, or a file of your own")
    parser.add_argument("--error", type=float, required=True, help="wanted error, in the unit of the measure")
    parser.add_argument(
        "--measure",
        help="which error (`contactbench list references`; certified_linf_m) [the scene's largest of position]")
    parser.add_argument("--time-per-step", type=float, metavar="S", help="processing time that a step may take, s")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the scene")
    parser.add_argument("--verify", action="store_true", help="run the answer and all that is cheaper again")
    parser.add_argument("--json", action="store_true", help="the answer as JSON")
    parser.add_argument("--results", type=Path, default=program.ROOT / "results", help="folder of runs.csv [results]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, help="folder for the small sweep of a scene that is not in the table")
    parser.add_argument("--duration", type=float, help="simulated seconds of the small sweep [the scene's]")
    parser.add_argument("--limit", type=float, default=60, help="seconds for one run [60]")
    options = parser.parse_args()
    for name in ("error", "time_per_step", "duration", "limit"):
        value = getattr(options, name)
        if value is not None and not 0 < value < float("inf"):
            parser.error(f"--{name.replace('_', '-')} must be a positive number")
    try:
        made = answer(options)
    except WrongInput as error:
        print(f"recommend: {error}", file=sys.stderr)
        return 2
    if options.json:
        print(json.dumps(made, indent=1))
    else:
        show_all(made)
    return 3 if made["best"] is None else 1 if made.get("verified", {}).get("faults") else 0
