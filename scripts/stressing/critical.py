"""The value of a parameter from which on a structure stands, by bisection."""
from dataclasses import dataclass


@dataclass
class Found:
    status: str  # the worst that a trial ended with: anything but ok and inaccurate ends the search
    residual: float | None  # the largest of the trials
    value: float | None  # None where it stands everywhere, or nowhere, or where a trial failed
    note: str


def bisect(trial, low, high, nearness):
    """`trial(value)` -> (status, checked residual, does it stand?). It should fall at `low` and stand at `high`; the answer is within
    the fraction `nearness`."""
    found = Found("ok", 0.0, None, "")

    def stands(value):
        status, residual, answer = trial(value)
        found.residual = max(found.residual, residual or 0.0)
        if status != "ok":
            found.status = status
        return answer if status in ("ok", "inaccurate") else None

    at_low, at_high = stands(low), stands(high)
    while None not in (at_low, at_high) and not at_low and at_high:
        if high - low <= nearness * high:
            found.value = (low + high) / 2
            found.note = f"stands from {found.value:.6g} on"
            return found
        middle = (low + high) / 2
        answer = stands(middle)
        if answer is None:
            at_low = at_high = None
        elif answer:
            high = middle
        else:
            low = middle
    found.note = "a trial failed" if None in (at_low, at_high) else "falls at either end" if not at_high else "stands at either end"
    return found
