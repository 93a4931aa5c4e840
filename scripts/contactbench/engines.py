"""Engines beside the methods (docs/engines.md): what each does with the simplest scenes, knobs searched for, and what
the report says of them.

  scripts/engines.py preflight --out results/engines     every engine that is here: preflight.json
  scripts/engines.py findings --out results/engines      what others found of engines, measured again: findings.json
  scripts/engines.py tune [--engine NAME]                tuned.json in scenarios/engines, by the search of tuning.toml
"""
import functools
import json
import math
import statistics
import sys
import tempfile
import tomllib
from pathlib import Path

from . import findings, isolated, precision, program, worth
from .gather import number
from .runs import Runs

SWEEP = "engines"
SETTINGS = ("default", "tuned")
HERE = program.ROOT / "scenarios" / "engines"
ANSWER = 0.1  # m: an error beyond is no answer, however cheap
LEAST, FAILED = -9.0, 3.0  # log10 of an error in m: none counts as less; of a run that does not finish


def available(listed):
    return [engine for engine in listed["engines"] if not engine["unavailable"]]


# Preflight.


def checked(path, engine, setting):
    """What `check` says of an engine; where it says nothing, each variant has that for a fault."""
    try:
        ended = program.call(path, "check", "--engine", engine["name"], "--setting", setting, "--json", timeout=900)
        fault = (ended.stderr.strip().splitlines() or [f"exit code {ended.returncode}, without a word"])[-1]
        return json.loads(ended.stdout)
    except program.Late:
        fault = "did not come back"
    except ValueError:
        pass
    return [{"engine": engine["name"], "variant": variant["name"], "setting": setting, "fault": fault, "lines": []}
            for variant in engine["variants"]]


def preflight(path, listed, settings=SETTINGS):
    """Rows of every variant and some settings of every engine that is here: lines, or a fault."""
    def rows_of(engine, setting):
        about = {"version": engine["version"], "precision": engine["precision"]}
        some = checked(path, engine, setting)
        return [row | about for row in some if setting == "default" or known(engine["name"], row["variant"])]

    def missing(engine):
        return [{
            "engine": engine["name"], "variant": "", "fault": f"unavailable: {engine['unavailable']}", "lines": []}]

    tasks = []
    for engine in listed["engines"]:
        if engine["unavailable"]:
            tasks.append(functools.partial(missing, engine))
        else:
            tasks += [functools.partial(rows_of, engine, setting) for setting in settings]
    return [row for some in program.together(tasks) for row in some]


def tuned():
    return program.read_json(HERE / "tuned.json") or {}


def known(engine, variant):
    return f"{engine}/{variant}" in tuned()


def apart(measured, expected):
    """Where the digits of a number do not tell it from what was expected, how far it is off."""
    shown = f"{measured:.6g}"
    if shown != f"{expected:.6g}":
        return f"{shown}, not {expected:g}"
    return f"{expected:g} but for {measured - expected:.2g}"


def failing(row):
    """What of a preflight's row stands beside the engine's numbers, in words."""
    if row["fault"]:
        return [row["fault"]]
    return [
        f"{line['name']}: {line['note']}"
        if line.get("unsupported") else f"{line['name']}: {apart(line['measured'], line['expected'])}"
        if line["measured"] is not None else f"{line['name']}: no number" for line in row["lines"]
        if not line["passed"]]


# Search for knobs.


def errors_of(path, engine, variant, knobs, of):
    """log10 of the error of each scene of tuning.toml, at one setting of the knobs."""
    out = []
    for scene in of["scenes"]:
        sets = [f"{name}={value}" for name, value in scene.get("set", {}).items()]
        words = [path, "run", scene["scene"], "--engine", engine, "--variant", variant, "--step", of["step"], "--json"]
        words += ["--duration", scene["duration"]] if "duration" in scene else []
        words += [w for name, value in knobs.items() for w in ("--knob", f"{name}={value:.17g}")]
        words += ["--time-limit", of["time_limit_s"], "--record-every", "0", *program.settings(sets)]
        with tempfile.TemporaryDirectory() as folder:
            ended = program.call(*words, "--out", folder)
        try:
            summary = json.loads(ended.stdout)
        except ValueError:
            raise program.ProgramError(f"{engine}/{variant}: {ended.stderr.strip()}") from None
        error = next((summary["errors"][m] for m in precision.MEASURES if m in summary["errors"]), None)
        fits = summary["finished"] and error is not None and math.isfinite(error)
        out.append(min(max(math.log10(max(error, 1e-300)), LEAST), FAILED) if fits else FAILED)
    return out


def search(path, engine, variant, defaults, of):
    """The best knobs that the search finds within its tries."""
    choices = {name: some for name, some in of[engine].items() if name in defaults}
    best, tries = {}, 1
    score = first = statistics.fmean(errors_of(path, engine, variant, {}, of))
    improved = True
    while improved and tries < of["tries"]:
        improved = False
        for name, some in choices.items():
            for value in some:
                if value == best.get(name, defaults[name]) or tries >= of["tries"]:
                    continue
                tries += 1
                trial = best | {name: value}
                got = statistics.fmean(errors_of(path, engine, variant, trial, of))
                if got < score - 1e-3:
                    best, score, improved = trial, got, True
    return {"knobs": {k: float(v) for k, v in best.items()}, "tries": tries, "score": score, "default_score": first}


def tune(path, listed, wanted):
    """Searches for the engines named (all that are here), keeps what is known of the others."""
    with open(HERE / "tuning.toml", "rb") as file:
        of = tomllib.load(file)
    found = tuned()
    for engine in available(listed):
        name = engine["name"]
        if wanted and name not in wanted or name not in of:
            continue
        for variant in engine["variants"]:
            key = f"{name}/{variant['name']}"
            found[key] = search(path, name, variant["name"], variant["knobs"], of)
            print(f"{key}: {found[key]}", flush=True)
            (HERE / "tuned.json").write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")


# What the report says. The sweep has a folder of its own, RESULTS/engines: its rows are no rows of the methods' tables.


def drift(cell):
    """Of scenes in which nothing moves and that have no closed form, m."""
    return findings.furthest(cell.folder)


def rows(results):
    """Per scene and cell: who, error, time a step, how it ended."""
    out = []
    for scene, parameters in dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=SWEEP)):
        measure = precision.measure(results, scene, parameters, SWEEP)
        for cell in results.cells(scene, SWEEP, parameters=parameters):
            error = math.nan
            if cell.finished:
                error = cell.error(measure) if measure else drift(cell)
            steps = number(cell["steps"])
            out.append({
                "scene": scene, "parameters": parameters, "measure": measure or "drift_m", "engine": cell["engine"],
                "variant": cell["variant"], "who": cell.name, "setting": cell["setting"], "precision": cell["precision"]
                or "double", "knobs": cell["knobs"], "step": cell["step"], "status": cell["status"],
                "reason": cell["reason"], "run": cell.unrepeated, "error": None if math.isnan(error) else error,
                "worst": error, "time": cell.seconds if cell.finished else None,
                "us_a_step": 1e6 * cell.seconds / steps if cell.finished and steps else None, "busy": cell.busy})
    return out


def columns(some):
    """Engine times variant of those that are here."""
    return sorted({(r["engine"], r["variant"]) for r in some if r["engine"] and r["status"] != "unavailable"})


def fronts(some):
    """{(scene, parameters): what no other beats in error and time, of what is off by less than a tenth of a unit box}.
    An engine on it is a finding: there our methods are behind at that error."""
    out = {}
    for row in some:
        out.setdefault((row["scene"], row["parameters"]), []).append(row)

    def answers(row):
        return row["time"] is not None and row["error"] is not None and row["error"] < ANSWER

    return {scene: precision.pareto(list(filter(answers, of))) for scene, of in out.items()}


def said(world):
    """What the report says: None where there is no sweep of engines. `world`: of the report's results."""
    folder = world.folder / "engines"
    if not (folder / "runs.csv").exists():
        return None
    results = worth.beside(Runs(folder), world)
    world.lacking = True  # no member makes any of it
    checks = program.read_json(folder / "preflight.json") or []
    notes = {(c["engine"], c["variant"], c.get("setting", "")): failing(c) for c in checks}
    some = rows(results)
    on = fronts(some)
    for row in some:
        row["front"] = row in on[row["scene"], row["parameters"]]
        row["fails"] = notes.get((row["engine"], row["variant"], row["setting"]), []) if row["engine"] else []
    scenes = {}
    for row in some:
        scenes.setdefault(f"{row['scene'].replace('_', ' ')} {row['parameters']}".strip(), []).append(row)
    own = {"own": isolated.own_answers(folder), "beside": isolated.BESIDE}
    return own | {
        "scenes": scenes, "findings": [
            f | {"verdict": findings.verdict(f)} for f in program.read_json(folder / "findings.json") or []
        ], "columns": columns(some), "profile": results.profile, "preflight": [
            c | {"fails": failing(c)} for c in checks], "tuned": tuned(), "ahead": {
                name: [r["who"] + f", {r['setting']}" for r in of if r["front"] and r["engine"]]
                for name, of in scenes.items()}}


def main():
    parser = program.flags(__doc__)
    parser.add_argument("command", choices=("preflight", "findings", "tune"))
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--engine", action="append", default=[], help="of tune: these alone [all that are here]")
    parser.add_argument("--setting", action="append", default=[], choices=SETTINGS,
                        help="of preflight: these alone [both]")
    parser.add_argument("--out", type=Path, default=program.ROOT / "results" / "engines",
                        help="of preflight.json and findings.json")
    options = parser.parse_args()
    listed = program.listed(options.program)
    if options.command == "tune":
        tune(options.program, listed, options.engine)
        return
    if options.command == "findings":
        findings.write(options.program, listed, options.out)
        return
    found = preflight(options.program, listed, options.setting or SETTINGS)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "preflight.json").write_text(json.dumps(found, indent=1) + "\n")
    for row in found:
        name = " ".join(filter(None, [row["engine"], row["variant"], row.get("setting")]))
        print(f"{name}: {'; '.join(failing(row)) or 'all lines hold'}")
    sys.stdout.flush()
