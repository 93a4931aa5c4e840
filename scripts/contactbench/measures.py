"""How far a run is from what its case expects: one function a measure, each (run, case) -> (error, note).

They read the files of a run and nothing else. Exact answers are those of the law under the program's own explicit Euler
step (velocities first, then positions), so that the step's error is not laid to a solver; of a run by a wanted accuracy
those of steps that are too short to tell from none. The note is for people.
"""
import csv
import math

VERDICTS = {
    "right": "within the case's bound", "model": "what the method's model says, for a reason that is named",
    "typed": "the program says itself that it has no accurate answer",
    "engine": "an engine is off, crashes, hangs or ends in NaN, which is its own and no fault of the program",
    "wrong": "off without a known reason", "silent": "ok beside a checked residual above 1e-6",
    "defect": "crash, no return, NaN"}
BAD = ("wrong", "silent", "defect")
BY_STEPS = ("painleve", "scene_error")  # measures that say something of runs by steps only
NO_STEP = 1e9  # steps of a run that has none: a g h t / 2 is rounding
G = 9.8


class Run:
    """The files of one run."""
    def __init__(self, summary, folder):
        self.summary, self.folder = summary, folder
        self.parameters = summary["parameters"]
        self.bodies = {}
        try:
            with open(folder / "trajectory.csv") as file:
                rows = csv.reader(file)
                next(rows)
                for row in rows:
                    self.bodies.setdefault(row[1], []).append([float(row[0])] + [float(x) for x in row[2:]])
        except (OSError, StopIteration):
            pass
        end = max((rows[-1][0] for rows in self.bodies.values()), default=0.0)
        self.h = summary["options"]["step"] or end / NO_STEP

    def has_nan(self):
        return any(not math.isfinite(x) for rows in self.bodies.values() for row in rows for x in row)

    def start(self, body):
        return self.bodies[body][0][1:4]

    def end(self, body):
        return self.bodies[body][-1][1:4]

    def moved(self, body):
        return [b - a for a, b in zip(self.start(body), self.end(body))]

    def steps(self):
        return round(self.bodies[next(iter(self.bodies))][-1][0] / self.h)


def norm(x):
    return math.sqrt(sum(a * a for a in x))


def pulled(a, n, h):
    """Way of n steps from rest with acceleration a: velocities first."""
    return a * h * h * n * (n + 1) / 2


def slowed(v, a, n, h):
    """Way of n steps from speed v with deceleration a, at rest once it is used up."""
    moving = min(n, math.ceil(v / (a * h)) - 1) if a * h > 0 else n
    return h * (moving * v - a * h * moving * (moving + 1) / 2)


def displacement(run, case):
    return max(norm([b - a for a, b in zip(rows[0][1:4], at[1:4])]) for rows in run.bodies.values() for at in rows), ""


def total_rise(run):
    """Largest rise of kinetic plus potential energy over what was there, J; it includes what the explicit step adds in
    flight."""
    try:
        with open(run.folder / "steps.csv") as file:
            energy = [float(r["kinetic_energy"]) + float(r["potential_energy"]) for r in csv.DictReader(file)]
    except OSError:
        return None
    return max(energy) - energy[0] if energy else None


def bounded(run, case):
    """Does what oscillates stay within ten times its first amplitude?"""
    moved, _ = displacement(run, case)
    return moved / (10 * run.start("first")[0]), ""


def event_gain(run, case):
    gain = run.summary["energy"]["max_gain_relative"]
    if gain is None and "engine" in run.summary:
        return None, "an engine's events are not seen"
    rise = total_rise(run)
    return max(0.0, gain or 0.0), "" if rise is None else f"total energy rises by {rise:.3g} J"


def slides(run, case):
    a = case["arguments"]
    moved = run.moved(a["body"])
    x = slowed(run.parameters[a["v"]], a["mu"] * G, run.steps(), run.h)
    return norm([moved[0] - x, moved[1], moved[2]]), ""


def rolls(run, case):
    a = case["arguments"]
    v, push, n = run.parameters[a["v"]], run.parameters["mu"] * G * run.h, run.steps()
    # Each step takes 7/2 of the push from the slip while that is left of it, and the next one the rest.
    slips = min(n, max(0, math.floor(v / (3.5 * push)))) if push > 0 else n
    last = v - slips * push if slips == n else v - slips * push - 2 / 7 * (v - 3.5 * push * slips)
    x = run.h * (slips * v - push * slips * (slips + 1) / 2 + (n - slips) * last)
    moved = run.moved(a["body"])
    return norm([moved[0] - x, moved[1], moved[2]]), ""


def groove(run, case):
    p = run.parameters
    s, t = math.sin(p["half_angle"]), p["slope"]
    n = run.steps()
    rolling = pulled(G * math.sin(t) * s * s / (s * s + 0.4), n, run.h)
    slipping = pulled(G * (math.sin(t) - p["mu"] * math.cos(t) / s), n, run.h)
    needed = math.tan(t) * 0.4 * s / (s * s + 0.4)  # friction along the groove over weight / (2 s)
    grip = p["mu"] / math.tan(p["half_angle"])
    enough = p["mu"] >= needed
    squeezable = grip >= 1 or p["mu"] >= needed * math.sqrt(1 - grip * grip)
    moved = run.moved("ball")
    of = {"rolls": abs(moved[2] - rolling), "slips": abs(moved[2] - slipping)}
    allowed = ["rolls"] if enough else ["slips", "rolls"] if squeezable else ["slips"]
    nearest = min(of, key=of.get)
    return max(min(of[a] for a in allowed), norm(moved[:2])), nearest


def pulled_free(run, case):
    a = run.parameters["pull"] - G
    n = run.steps() - round(0.1 / run.h)
    moved = run.moved("ball")
    return norm([moved[0], moved[1] - pulled(a, n, run.h), moved[2]]), ""


def squeezed(run, case):
    p = run.parameters
    excess = max(0.0, p["pull"] - 2 * p["mu"] * p["press"])
    moved = run.moved("box")
    return norm([moved[0], moved[1] - pulled(excess, run.steps(), run.h),
                 moved[2]]), "held" if abs(moved[1]) < 1e-9 else "slides"


def driven(run, case):
    """A run that goes on although the wall is reached has done what cannot be."""
    p = run.parameters
    way = p["speed"] * run.steps() * run.h
    moved = run.moved("cube")
    if way > p["gap"]:
        return math.inf, "went on, although no velocity is feasible"
    return norm([moved[0] - way, moved[1], moved[2]]), ""


def card_house(run, case):
    p = run.parameters
    critical = (math.tan(p["lean"]) - 0.01) / 2
    moved, _ = displacement(run, case)
    if p["mu"] >= critical:
        return moved, "stands" if moved < 1e-6 else "moves"
    return (0.0, "falls") if moved > 1e-5 else (1.0, "stands")


def ramp_way(run):
    p = run.parameters
    a = G * (math.sin(p["tilt"]) - p["mu"] * math.cos(p["tilt"]))
    n, moved = run.steps(), run.moved("box")
    along = [math.cos(p["tilt"]), -math.sin(p["tilt"]), 0.0]
    return a, n, moved, along


def ramp(run, case):
    a, n, moved, along = ramp_way(run)
    way = pulled(max(0.0, a), n, run.h)
    return norm([m - way * d for m, d in zip(moved, along)]), "slides" if a > 0 else "sticks"


def ramp_verdict(run, case):
    a, n, moved, along = ramp_way(run)
    way = pulled(abs(a), n, run.h)
    got = sum(m * d for m, d in zip(moved, along))
    error = abs(got - (way if a > 0 else 0.0)) / way if way > 0 else norm(moved)
    return error, f"{got / way:.3g} of the way that it would slide"


def pulled_pair(run, case):
    p = run.parameters
    way = pulled(max(0.0, p["pull"] - 2 * p["mu"] * G) / 2, run.steps(), run.h)
    return max(norm([m[0] - way, m[1], m[2]]) for m in (run.moved("lower"), run.moved("upper"))), ""


def pushed(run, case):
    """Against the exact box under this step (lib/evaluation/slider.h; 0.16326542 at h = 1e-3)."""
    angle, way = run.parameters["push_angle"], 0.16326542
    moved = run.moved("box")
    got = math.hypot(moved[0], moved[2])
    return (norm([moved[0] - way * math.cos(angle), moved[1], moved[2] + way * math.sin(angle)]),
            f"{got / way:.6g} of the way, turned by {math.degrees(math.atan2(-moved[2], moved[0]) - angle):.3g} deg")


def scene_error(run, case):
    a = case["arguments"]
    error = run.summary["errors"].get(a["error"])
    if error is None:
        return None, f"no {a['error']}"
    return error / (a["per_step"] * run.h) if "per_step" in a else error, f"{a['error']} {error:.3g}"


def same_as_first(run, case):
    """Places without units, in the frame that is not turned; compared with the case's first row by the caller."""
    p = run.parameters
    c, s = math.cos(p["heading"]), math.sin(p["heading"])
    place = []
    for body in sorted(run.bodies):
        x, y, z = (a / p["metre"] for a in run.end(body))
        place += [c * x - s * z, y, s * x + c * z]
    return place, ""


def bounces(run, case):
    """First peak against e^2 of the height. An impact's speed is known to g h of it, hence 1 %; no event may gain
    energy."""
    height = [row[2] - 0.1 for row in run.bodies["ball"]]
    e = run.parameters["e"]
    inner = range(1, len(height) - 1)
    touch = next((i for i in inner if height[i] <= height[i - 1] and height[i] < height[i + 1]), None)
    if touch is None:
        return (0.0 if e < 0.02 else math.inf), "never rises"
    peak = next((height[i] for i in inner if i > touch and height[i] >= height[i + 1]), height[-1])
    gain = run.summary["energy"]["max_gain_relative"] or 0
    if gain > 1e-12:
        return math.inf, f"an event gains {gain:.3g}"
    error = abs(peak / height[0] - e * e) / 0.01
    return error, f"first peak {peak:.4g} of {height[0]:.4g} m, {run.summary['events']} events"


def cradle(run, case):
    v = [rows[-1][8:11] for rows in run.bodies.values()]
    momentum = norm([sum(x[i] for x in v) - (1, 0, 0)[i] for i in range(3)])
    energy = sum(norm(x)**2 for x in v) - 1
    return max(momentum, abs(energy)), "leave with " + " ".join(f"{x[0]:.3g}" for x in v)


def stopped(run, case):
    return abs(run.end(case["arguments"]["body"])[0] - case["arguments"]["x"]), ""


def far_away(run, case):
    way = slowed(run.parameters["vx"], 0.5 * G, run.steps(), run.h)
    slider = run.moved("slider")
    return max(norm(run.moved("rest")), norm([slider[0] - way, slider[1], slider[2]])), ""


def painleve(run, case):
    """How far from where the paradox begins, rad, does the impact without collision come: a step that takes more slip
    than a hundred of sliding friction? An indeterminate rod (spin) may lift off instead."""
    half, p = (1.0, 0.5e-3), run.parameters
    gain = run.summary["energy"]["max_gain_relative"] or 0
    if gain > 1e-9:
        return math.inf, f"an event gains {gain:.3g} of the energy"
    begins = p["angle"] if p["angle"] > math.pi / 4 else math.pi / 4
    before = None
    for t, _, py, _, qw, _, _, qz, vx, _, _, _, _, wz in run.bodies["rod"]:
        angle = 2 * math.atan2(qz, qw)
        c, s = math.cos(angle), math.sin(angle)
        arm = (-half[0] * c + half[1] * s, -half[0] * s - half[1] * c)
        slip, gap = vx - wz * arm[1], py + arm[1]
        if before is not None and abs(slip - before[0]) > 100 * p["mu"] * 10 * run.h:
            return abs(before[1] - begins), (
                f"an impact at {math.degrees(before[1]):.2f} deg, t = {before[2]:.4f} s, takes the slip from "
                f"{before[0]:.3g} to {slip:.3g} m/s")
        if gap > 1e-6:
            return (0.0 if p["spin"] > 0 else math.inf
                    ), f"lifts off at {math.degrees(angle):.2f} deg, t = {t:.4f} s, slipping with {slip:.3g} m/s"
        before = slip, angle, t
    return math.inf, f"slides on with {before[0]:.3g} m/s at {math.degrees(before[1]):.1f} deg"
