"""From which value of a parameter on a structure stands, and from which step on a scene without contacts blows up: by
bisection."""
import json
import math
from dataclasses import dataclass
from pathlib import Path

from . import program

STEPS = 2000  # of a run without contacts: a mode that grows by 3.5 % a step is seen
NEARNESS = 0.005  # of the bisection over steps
SEVERITY, FAILED = {"ok": 0, "inaccurate": 1, "crash": 3}, 2  # of what a trial ended with; others are failures


@dataclass
class Found:
    status: str  # the worst that a trial ended with: anything but ok and inaccurate ends the search
    residual: float | None  # the largest of the trials
    value: float | None  # None where it stands everywhere, or nowhere, or where a trial failed
    note: str


def bisect(trial, low, high, nearness):
    """`trial(value)` -> (status, checked residual, does it stand?). It should fall at `low` and stand at `high`; the
    answer is within the fraction `nearness`."""
    found = Found("ok", 0.0, None, "")

    def stands(value):
        status, residual, answer = trial(value)
        found.residual = max(found.residual, residual or 0.0)
        if SEVERITY.get(status, FAILED) >= SEVERITY.get(found.status, FAILED):
            found.status = status
        return answer if status in ("ok", "inaccurate") else None

    at_low, at_high = stands(low), stands(high)
    while None not in (at_low, at_high) and not at_low and at_high:
        middle = (low + high) / 2
        if high - low <= nearness * high:
            found.value, found.note = middle, f"stands from {middle:.6g} on"
            return found
        answer = stands(middle)
        if answer is None:
            at_low = None
        low, high = (low, middle) if answer else (middle, high)
    found.note = "a trial failed" if None in (
        at_low, at_high) else "falls at either end" if not at_high else "stands at either end"
    return found


def stable_step(path, scene, flags, folder):
    """(largest stable step by trying, the program's own estimate), both s."""
    def run(step):
        program.call(path, "run", scene, "--method", "newton", *flags, "--step", repr(step), "--duration",
                     repr(STEPS * step), "--record-every", "0", "--out", folder, "--quiet")
        return json.loads((Path(folder) / "summary.json").read_text())

    least, most = 1e-7, 1e2
    estimate = run(least)["control"]["largest_stable_step"]
    while most > least * (1 + NEARNESS):
        middle = math.sqrt(least * most)
        status = run(middle)["status"]
        if status not in ("ok", "energy_blowup"):
            raise ValueError(f"{status} at a step of {middle:g} s")
        least, most = (middle, most) if status == "ok" else (least, middle)
    return math.sqrt(least * most), estimate
