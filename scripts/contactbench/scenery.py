"""Scenes in the report: their pictures, the page of their motion, and how far methods differ on them."""
import math

from . import ladder, precision, program, still, view

FRAMES, ROOM = 120, 280_000  # of a scene on the page of all motions
LIKED = ("convex", "ap")  # whose run is drawn, in this order


def scenes(results):
    """(scene, parameters) in the order of the table."""
    return list(dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=None)))


def drawable(cell):
    """Whether a run kept its contacts and has a moment: one that died at once may have left its shapes alone."""
    return not any(view.table(cell.folder / file).empty for file in ("shapes.csv", "trajectory.csv"))


def to_look_at(results, scene, parameters):
    """Up to two runs of different methods that kept their contacts; those that came to the end first."""
    def liked(cell):
        rank = LIKED.index(cell["method"]) if cell["method"] in LIKED else len(LIKED)
        return not cell.finished, rank, float(cell["step"] or 0), float(cell["epsilon"] or 0), -int(cell["k"] or 0)

    cells = sorted(results.cells(scene, None, parameters=parameters), key=liked)
    first = next(filter(drawable, cells), None)
    other = next((c for c in cells if first and c["method"] != first["method"] and drawable(c)), None)
    return [c for c in (first, other) if c]


def motions(results):
    """{"scene parameters": {cells, picture, title}} of what has a run that kept its contacts."""
    found = {}
    for scene in scenes(results):
        cells = to_look_at(results, *scene)
        if cells:
            motion = view.Motion(cells[0].folder, cells[0].with_k, 2)
            found[" ".join(filter(None, scene))] = {
                "cells": cells, "picture": still.svg(motion), "title": motion.summary.get("title") or ""}
    return found


def write_motions(results):
    """The page of all motions, motion.html beside the report; why there is none, else nothing."""
    page = results.folder / "motion.html"
    page.unlink(missing_ok=True)
    parts = []
    for name, found in motions(results).items():
        cells = found["cells"]
        part = view.scene_of([c.folder for c in cells], labels=[f"{c.with_k}, {c.way}" for c in cells], frames=FRAMES,
                             room=ROOM)
        parts.append(part | {"name": name})
    if not parts:
        return "no run kept its contacts"
    try:
        page.write_text(view.page(parts))
    except program.ProgramError as error:
        return str(error)
    return ""


def apart(results, scene, parameters):
    """How far methods are from each other: the step, the names, and {name: [distance to each, m]} at the finest step at
    which the most came to the end; nan where two have no moment in common."""
    steps = {}
    for cell in results.cells(scene, None, parameters=parameters):
        if cell.finished and cell["step"]:
            steps.setdefault(cell["step"], {})[cell.setting] = cell
    if not steps:
        return None
    most = max(map(len, steps.values()))
    step = min((s for s, of in steps.items() if len(of) == most), key=float)
    of = steps[step]
    return {"step": step, "rows": {a: [0.0 if a == b else precision.apart(of[a], of[b]) for b in of] for a in of}}


def table(results, scene, parameters):
    """A row a setting: how it ended, time, error (without a reference how far it is from its method's finest step),
    residual, energy."""
    name = precision.measure(results, scene, parameters, None)
    steps = {} if name else ladder.own_steps(results, scene, parameters, sweep=None)
    rows = []
    for cell in results.cells(scene, None, parameters=parameters):
        error = cell.error(name) if name else steps.get(cell["run"], math.nan)
        time = cell.seconds / float(cell["duration"]) if cell.finished and cell.times else math.nan
        rows.append({
            "method": cell.setting, "step": cell.step_or_accuracy, "ended": cell.how_it_ended or "ok", "error": error,
            "time": time, "residual": cell["residual_max"], "gain": cell["max_gain_relative"], "command": cell.command,
            "run": cell.unrepeated})
    return {"measure": name, "reference": precision.reference_of(results, scene, parameters, name), "rows": rows}
