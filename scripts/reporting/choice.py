"""Which method to use: of the runs of a scene, the cheapest that met a wanted error. Reads the points of precision.py; runs nothing."""


def met(point, error, time_per_step=None):
    """Whether a point is an answer: it ended ok, no claim of it was refuted, its error is small enough even if the reference is off by
    its uncertainty, and its step is quick enough."""
    return (point["error"] is not None and point["status"] == "ok" and point["cell"]["false_claims"] == "0"
            and point["error"] + point["uncertainty"] <= error
            and (time_per_step is None or point["time_per_step"] <= time_per_step))


def family(point):
    return point["cell"].key


def choose(points, error, time_per_step=None):
    """The cheapest point that met the error, the runner-up (the cheapest of another method or solver), and what was cheaper than
    the first and did not; None, None, [] where none did."""
    timed = sorted((p for p in points if p["time"] is not None), key=lambda p: p["time"])
    good = [p for p in timed if met(p, error, time_per_step)]
    if not good:
        return None, None, []
    best = good[0]
    return best, next((p for p in good if family(p) != family(best)), None), timed[:timed.index(best)]


def nearest(points):
    """Of the points that ended ok, the one with the least error, the cheapest of those; None where there is none."""
    return min((p for p in points if met(p, float("inf"))), key=lambda p: (p["error"], p["time"]), default=None)


def apart(a, b):
    """Whether the times of two points tell them apart; None where one of them has a single repeat, so that nothing is known."""
    if min(a["repeats"], b["repeats"]) < 2:
        return None
    return a["most"] < b["least"] or b["most"] < a["least"]
