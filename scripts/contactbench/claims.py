"""Prints the answers to the paper's claims from the result files, with the numbers and the commands that made them.

  scripts/claims.py                  all, one line each
  scripts/claims.py C3 C4            these, with every number and every run
"""
# A claim of claims.toml is a question to the result files: reproduced, not reproduced, or cannot be told. It is
# reproduced when all its parts are. Where a part is about Newton's model it is answered for both variants, and so is
# then the claim. A part is asked of every member of the ensemble and of every repeat; where they do not agree, it is
# neither.
import collections
import dataclasses
import functools
import math
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import program, worth
from .gather import number
from .precision import circle, slope
from .runs import Runs

YES, NO, UNKNOWN, DIFFERS = "reproduced", "not reproduced", "cannot be told", "differs in the ensemble"
VARIANTS = ("uncapped", "stick-tested")
EPS = "1e-12"  # J, the convex method where the paper means a solved problem
EXACT_X = 0.16326530612244897  # m, sliding box at 8 s
RADIUS = math.sqrt(0.4**2 - (0.02 * 9.8)**2)  # m, of the circle on which the box slides in the end
ROUNDING = float(np.finfo(float).eps)  # m, of a position of size 1 m: below this a box does not move
WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text())


@dataclass
class Part:
    text: str  # what is asked, with its bound
    verdict: str
    numbers: dict  # {what: value}, flat; samples as such (worth.Number)
    why: str = ""
    variant: str = ""  # of Newton's model; empty where the part is not about it
    timing: bool = False  # depends on the machine
    cells: list = field(default_factory=list)

    def plain(self):
        data = {name: getattr(self, name) for name in ("text", "verdict", "numbers", "why", "variant")}
        return data | {"numbers": {what: worth.published(value) for what, value in self.numbers.items()}}


class Claim:
    def __init__(self, name, results=None):
        self.id, self.results, self.parts, self.words = name, results, [], WORDS[name]
        self.scene, self.text = self.words["scene"], self.words["text"]

    def ask(self, key, holds, numbers=None, cells=(), variant="", timing=False, scene="", **said):
        """Adds a part; `holds` is None where the results do not decide it, for want of runs of `scene`."""
        part = self.words[key]
        text = part["text"].format(variant=variant, **said)
        if holds is None:
            scene = scene or self.words["of"]
            missing = self.results.missing(scene)
            why = f"no run of {scene}: {missing}"
            why = why if missing else "a run that it needs is not there, or did not reach the end"
            self.parts.append(Part(text, UNKNOWN, {}, why, variant))
        else:
            self.parts.append(
                Part(text, YES if holds else NO, flat(numbers), "" if holds else part.get("why", ""), variant, timing,
                     list(cells)))

    def ask_of(self, key, cells, value, holds, numbers=None, **more):
        """A part that needs a value of each of some cells, and cannot be told without; `numbers` of them, or the values
        themselves."""
        if not cells or any(c is None or isinstance(value(c), float) and math.isnan(value(c)) for c in cells):
            self.ask(key, None, **more)
        else:
            self.ask(key, holds(*cells), numbers(*cells) if numbers else named(cells, value), cells, **more)

    def answer(self, variant=""):
        verdicts = [p.verdict for p in self.parts if p.variant in ("", variant)]
        return next((v for v in (NO, DIFFERS, UNKNOWN) if v in verdicts), YES if verdicts else UNKNOWN)

    @property
    def answers(self):
        """One answer, or one a variant of Newton's model."""
        if any(p.variant for p in self.parts):
            return {f"Newton {v}": self.answer(v) for v in VARIANTS}
        return {"": self.answer()}

    @property
    def grade(self):
        """Of all its parts: reproduced, in part, contradicted; or that the runs do not tell, or do not agree."""
        verdicts = {p.verdict for p in self.parts}
        if verdicts <= {UNKNOWN}:
            return UNKNOWN
        return YES if verdicts == {
            YES} else "in part" if YES in verdicts else "contradicted" if NO in verdicts else DIFFERS

    @property
    def because(self):
        """Why the parts that are not reproduced are not."""
        return list(dict.fromkeys(p.why for p in self.parts if p.why and p.verdict != YES))

    @property
    def commands(self):
        """The runs behind the numbers."""
        return list(dict.fromkeys(c.command for p in self.parts for c in p.cells))

    def as_data(self):
        """For report.json: what does not depend on the machine, and what does."""
        data = {"scene": self.scene, "claim": self.text, "parts": [p.plain() for p in self.parts if not p.timing]}
        timed = [p.plain() for p in self.parts if p.timing]
        return (data, {"answers": self.answers, "parts": timed}) if timed else (data | {"answers": self.answers}, {})


def outcome(cell, **came_to):
    """How a run ended and what it came to; of one that a limit cut just that."""
    return {"": cell.cut} if cell.cut else {"": cell.how_it_ended or "finished", **came_to}


def flat(numbers):
    """Of {what: {more: value}} one dictionary."""
    out = {}
    for what, value in numbers.items():
        parts = value if isinstance(value, dict) else {"": value}
        out |= {f"{what}: {more}" if more else what: v for more, v in parts.items()}
    return out


def find(cells, method, choice="", **more):
    """The one cell of a method with that solver or variant; None where there is none."""
    return next(
        (c for c in cells if c["method"] == method and (not choice or choice in (c["solver"], c["variant"])) and all(
            c[n] == v for n, v in more.items())), None)


def newton(cells, variant):
    return find(cells, "newton", variant)


def named(cells, value):
    return {c.label: value(c) for c in cells}


def error(name):
    return lambda cell: cell.error(name)


def others(cells):
    """Every method but Newton's; the convex one solved to 1e-12 J."""
    return [c for c in cells if c["method"] != "newton" and c["epsilon"] in ("", EPS)]


def seconds(cell):
    """Processing time; infinite where the run did not finish, nan where there is no run."""
    return math.nan if cell is None else cell.seconds if cell.finished else math.inf


def c1(claim, results):
    cells, rise = results.cells("impacting_sphere", knobs="", parameters=""), error("energy_rise_relative")
    for v in VARIANTS:
        claim.ask_of("newton", [newton(cells, v)], rise, lambda c: rise(c) > 1e-9, variant=v)
    claim.ask_of("others", [c for c in cells if c["method"] != "newton"], rise,
                 lambda *rest: all(rise(c) <= 1e-9 for c in rest))


@functools.cache
def displacement(cell):
    """Along the push, at the end; nan for a run that did not get there."""
    (x, ) = cell.series("trajectory.csv", "px")
    return float(x[-1] - x[0]) if cell.finished and len(x) else math.nan


def c2(claim, results):
    cells, far = results.cells("sliding_box", knobs="", parameters=""), displacement
    alike = [c for c in others(cells) if c["solver"] != "ynl"]
    if not alike or any(math.isnan(far(c)) for c in alike):
        for key in ("alike", "ynl", "early"):
            claim.ask(key, None)
        return
    middle = float(np.median([far(c) for c in alike]))
    spread = (max(map(far, alike)) - min(map(far, alike))) / middle
    claim.ask("alike", spread <= 0.01, {**named(alike, far), "spread": spread, "exact": EXACT_X}, alike)

    def beside(cell):
        return {**named([cell], far), "median of the others": middle}

    for v in VARIANTS:
        claim.ask_of("newton", [newton(cells, v)], far, lambda c: far(c) > 1.01 * middle, beside, variant=v)
    claim.ask_of("ynl", [find(cells, "ap", "ynl")], far, lambda c: abs(far(c) / middle - 1) > 0.01, beside)
    claim.ask_of("early", [find(cells, "convex", epsilon="1e-2")], far, lambda c: far(c) > 1.01 * middle, beside)


def c3(claim, results):
    cells, creep, past = results.cells("sticking_box", knobs="",
                                       parameters=""), error("displacement_linf_m"), error("first_past_1mm_s")
    eight = [c for c in cells if c["k"] in ("", "8")]
    for v in VARIANTS:
        claim.ask_of("newton", [newton(eight, v)], creep, lambda c: past(c) <= 2.0,
                     lambda c: {"time of 1 mm, s": past(c), "largest displacement, m": creep(c)}, variant=v)
    held = [c for c in others(eight) if not math.isnan(creep(c))]
    lemke, path = find(held, "ap", "lemke"), find(held, "ap", "path")
    if lemke and path:
        floored = {c: max(creep(c), ROUNDING) for c in held}
        orders = math.log10(floored[path] / floored[lemke])
        claim.ask("least", floored[lemke] <= 2 * min(floored.values()), named(held, creep), held)
        claim.ask("most", floored[path] >= 0.5 * max(floored.values()) and floored[path] > ROUNDING, named(held, creep),
                  held)
        claim.ask("orders", 6 <= orders <= 8, {"orders, PATH over Lemke": orders, **named([lemke, path], creep)},
                  [lemke, path])
    else:
        for key in ("least", "most", "orders"):
            claim.ask(key, None)
    for key, cell in (("mirtich", find(eight, "mirtich")), ("sixteen", find(cells, "ap", "path", k="16"))):
        claim.ask_of(key, [cell], outcome, lambda c: not c.finished)


def path_of(cell):
    t, x, z = cell.series("trajectory.csv", "t", "px", "pz")
    return t, np.column_stack([x, z])


def c4(claim, results):
    cells = [c for c in results.cells("circular_sliding", sweep=None, parameters="start=rest") if c["knobs"] == ""]
    farthest = error("position_linf_m")
    convex = find(cells, "convex", epsilon=EPS)
    polygons = sorted((c for c in cells if c["method"] == "ap"), key=lambda c: int(c["k"]))
    if convex is None or len(polygons) < 3 or not all(c.finished for c in [convex, *polygons]):
        claim.ask("converges", None)
    else:
        final = path_of(convex)[1][-1]
        apart = [float(np.linalg.norm(path_of(c)[1][-1] - final)) for c in polygons]
        power = slope([int(c["k"]) for c in polygons], [max(a, 1e-300) for a in apart])
        claim.ask("converges", power <= -1.5 and all(b < a for a, b in zip(apart, apart[1:])),
                  {**{f"k = {c['k']}, m": a for c, a in zip(polygons, apart)}, "slope": power}, [convex, *polygons])
    cell = find(cells, "mirtich")
    if cell is None or not cell.finished:
        claim.ask("circle", None)
        claim.ask("another", None, radius=RADIUS)
    else:
        t, p = path_of(cell)
        radius, deviation = circle(p[t >= t[-1] - 2 * math.pi])
        claim.ask("circle", deviation <= 0.05, {"radius, m": radius, "deviation": deviation}, [cell])
        claim.ask("another",
                  farthest(cell) > 0.1 * RADIUS, {"largest distance from the exact place, m": farthest(cell)}, [cell],
                  radius=RADIUS)
    for v in VARIANTS:
        cell = newton(cells, v)
        if cell is None or not cell.finished:
            claim.ask("newton", None, variant=v)
            continue
        p = path_of(cell)[1]
        way = float(np.sum(np.linalg.norm(np.diff(p, axis=0), axis=1)))
        straight = float(np.linalg.norm(p[-1] - p[0])) / way
        claim.ask("newton", straight >= 0.9, {
            "displacement over way": straight, "way, m": way, "largest distance from the exact place, m": farthest(cell)
        }, [cell], variant=v)


def stacks(results):
    """{boxes: cells}."""
    out = {}
    for c in results.cells("stack", knobs=""):
        out.setdefault(int(c["parameters"].removeprefix("boxes=")), []).append(c)
    return dict(sorted(out.items()))


def c5(claim, results):
    by_size = stacks(results)
    if not by_size:
        claim.ask("none", None)
        return
    for v in VARIANTS:
        ranks, used = {}, []
        for n, cells in by_size.items():
            compared = others(cells) + [c for c in [newton(cells, v)] if c is not None]
            used += compared
            order = sorted((c for c in compared if c.finished), key=seconds)
            for c in (find(compared, "convex"), newton(compared, v)):
                if c is not None:
                    ranks[f"{n} boxes, {c.name}"] = order.index(c) + 1 if c in order else c.how_it_ended
        fastest = all(r in (1, 2) for r in ranks.values()) if ranks else None
        claim.ask("fastest", fastest, ranks, used, v, timing=True)
    big = [cells for n, cells in by_size.items() if n >= 8]
    used = [c for cells in big for c in others(cells) if c["method"] in ("ap", "convex")]
    both = [(c, find(cells, "convex", epsilon=EPS)) for cells in big for c in cells if c["method"] == "ap"]
    slower = [seconds(a) > seconds(convex) for a, convex in both if convex is not None]
    claim.ask("slower",
              all(slower) if slower else None, {f"{c['parameters']}, {c.name}": seconds(c) for c in used}, used,
              timing=True)
    pairs = [(n, find(c, "mirtich"), find(c, "convex", epsilon=EPS)) for n, c in by_size.items() if n >= 2]
    pairs = [(n, m, c) for n, m, c in pairs if m and c]
    against = {
        f"{n} boxes": f"{m.how_it_ended or f'{seconds(m):.3g} s'} against {seconds(c):.3g} s" for n, m, c in pairs}
    slow = all(seconds(m) > seconds(c) for _, m, c in pairs) if pairs else None
    claim.ask("mirtich", slow, against, [x for _, m, c in pairs for x in (m, c)], timing=True)


def drives(cell):
    """Whether the mobile robot drives its figure eight: at most twice as far off as one whose wheels never slip."""
    return cell.finished and cell.error("cross_track_rms_m") <= 2 * cell.error("no_slip_cross_track_rms_m")


def holds(cell):
    """Whether the grasped box stays where it is."""
    return cell.finished and math.isnan(cell.error("dropped_s")) and cell.error("creep_linf_m") <= 5e-3


def c6(claim, results):
    cells = [c for c in results.cells("mobile_robot", knobs="", parameters="") if c["epsilon"] in ("", EPS)]
    off, without_slip, asymmetry = map(
        error, ("cross_track_rms_m", "no_slip_cross_track_rms_m", "load_asymmetry_mean_relative"))
    left, right = error("unloaded_left_relative"), error("unloaded_right_relative")

    def how(c):
        return outcome(c, **{"off by, m rms": off(c), "without slip, m rms": without_slip(c)})

    claim.ask_of("convex", [find(cells, "convex")], how, drives)
    finer = [
        c for knobs in ("step=5e-5 duration=10", "step=5e-5") for c in results.cells("mobile_robot", None, knobs=knobs)
        if c["method"] == "ap"]
    for v in VARIANTS:
        rest = [c for c in cells if c["method"] != "convex" and c["variant"] in ("", v)]
        claim.ask("others", not any(drives(c) for c in rest) if rest else None, named(rest + finer, how), rest + finer,
                  v)

    def shares(c):
        return {
            "share of steps": left(c) + right(c), "left": left(c), "right": right(c),
            "mean load asymmetry": asymmetry(c)}

    claim.ask_of("unloaded", [find(cells, "ap", "lemke")], lambda c: left(c) + right(c),
                 lambda c: left(c) + right(c) >= 0.9, shares)
    # At the scene's own settings: the run that motion.html shows is a short one.
    caster = find(results.cells("mobile_robot_caster", None, knobs=""), "ap", "lemke")
    claim.ask_of("caster", [caster], asymmetry, lambda c: asymmetry(c) > 0.5,
                 lambda c: {"mean load asymmetry": asymmetry(c)}, scene="mobile_robot_caster")


def c7(claim, results):
    cells = [c for c in results.cells("grasp", knobs="", parameters="") if c["epsilon"] in ("", EPS)]
    dropped, creep = error("dropped_s"), error("creep_linf_m")

    def how(c):
        fell = {} if math.isnan(dropped(c)) else {"dropped, s": dropped(c)}
        return outcome(c, **{"creep, m": creep(c)}, **fell)

    claim.ask_of("convex", [find(cells, "convex")], how, holds)
    dropping = [(f"Newton {v}", newton(cells, v), v) for v in VARIANTS]
    for who, cell, v in [*dropping, ("Mirtich", find(cells, "mirtich"), "")]:
        claim.ask_of("drops", [cell], how, lambda c: not holds(c), variant=v, who=who)
    claim.ask_of("ap", [c for c in cells if c["method"] == "ap"], how, lambda *rest: not any(c.finished for c in rest))


def pairs_of(results, solver):
    """(cell with Lemke, the same with the other solver) over every scene and knob."""
    def same(c):
        return tuple(c[n] for n in ("scene", "parameters", "k", "knobs"))

    lemke = {same(c): c for c in results.cells(sweep=None, method="ap", solver="lemke")}
    return [(lemke[same(c)], c) for c in results.cells(sweep=None, method="ap", solver=solver) if same(c) in lemke]


def c8(claim, results):
    both = pairs_of(results, "path")
    bad = [c for pair in both for c in pair if c["status"] != "ok"]
    lemke, path = (sum(pair[i]["status"] != "ok" for pair in both) for i in (0, 1))
    claim.ask("path", path > lemke and path >= 0.05 * len(both) if both else None,
              {"runs of each": len(both), "Lemke failed": lemke, "PATH failed": path}, bad)
    both = pairs_of(results, "ynl")
    ratio = {
        b.label + ", " + b["scene"] + (" " + b["parameters"] if b["parameters"] else ""):
        number(b["peak_memory_mb"]) / number(a["peak_memory_mb"]) for a, b in both
        if all(c["peak_memory_mb"] for c in (a, b))}
    out = [b for _, b in both if b["status"] == "memory_limit"]
    worst = max(ratio, key=ratio.get, default="")
    claim.ask("ynl", True if out else ratio[worst] > 10 if ratio else None, {
        "runs": len(both), "ended by memory": len(out), "largest memory over Lemke's": ratio.get(worst), "there": worst
    }, out, timing=True)


def c9(claim, results):
    for scene, parameters, k in (("impacting_sphere", "", "8"), ("sliding_box", "", "16"), ("sticking_box", "", "8"),
                                 ("circular_sliding", "", "8"), ("stack", "boxes=1", "4"), ("mobile_robot", "", "4")):
        cells = [c for c in others(results.cells(scene, parameters=parameters, knobs="")) if c["k"] in ("", k)]
        lemke = find(cells, "ap", "lemke")
        first = all(seconds(lemke) <= seconds(c) for c in cells) and bool(lemke and lemke.finished)
        claim.ask("lemke", first if lemke and len(cells) > 1 else None, named(cells, seconds), cells, timing=True,
                  scene=scene, words=scene.replace("_", " "))


def c10(claim, results):
    cells = results.cells(sweep=None, method="convex", epsilon=EPS)
    bad = [c for c in cells if c["status"] != "ok"]
    claim.ask("ok", not bad if cells else None,
              {"runs": len(cells), **{f"{c['scene']} {c.label}": outcome(c) for c in bad}}, bad)
    by_size, growth = stacks(results), {}
    for n, some in by_size.items():
        for c in [*others(some), *[newton(some, v) for v in VARIANTS]] if n >= 4 else []:
            if c is not None:
                growth.setdefault(c.name, {})[n] = seconds(c)
    name = next((n for n in growth if n.startswith("convex")), None)
    if name is None or len(growth[name]) < 2 or 16 not in growth[name]:
        claim.ask("fastest", None)
        claim.ask("growth", None)
    else:
        last = {n: t[16] for n, t in growth.items() if 16 in t}
        claim.ask("fastest",
                  math.isfinite(last[name]) and last[name] <= min(last.values()),
                  {n: t if math.isfinite(t) else "did not finish" for n, t in last.items()}, by_size[16], timing=True)
        powers = {
            n: slope(t, t.values()) for n, t in growth.items()
            if len(t) > 1 and all(math.isfinite(s) and s > 0 for s in t.values())}
        claim.ask("growth", name in powers and powers[name] <= min(*powers.values(), 1.5), powers,
                  [c for n, some in by_size.items() if n >= 4 for c in some], timing=True)
    claim.ask_of("loops", [find(results.cells("grasp", knobs="", parameters=""), "convex", epsilon=EPS)], outcome,
                 lambda c: c.finished, scene="grasp")


ALL = {"C1": c1, "C2": c2, "C3": c3, "C4": c4, "C5": c5, "C6": c6, "C7": c7, "C8": c8, "C9": c9, "C10": c10}


def answered(name, results):
    """A claim with its parts, each answered by the whole ensemble: where not all say the same, how many say what."""
    claim = asked(name, results)
    members, repeats = ([asked(name, world) for world in worlds(results)] for worlds in (worth.members, worth.repeats))
    for place, part in enumerate(claim.parts):
        others = members + repeats if part.timing else members
        of = [p for p in (next((p for p in o.parts if p.text == part.text), None) for o in others) if p]
        if any(p.verdict != part.verdict for p in of):
            count = collections.Counter(p.verdict for p in of)
            why = "among its runs: " + ", ".join(f"{word} {n}" for word, n in sorted(count.items()))
            claim.parts[place] = dataclasses.replace(part, verdict=DIFFERS, why=why)
        claim.parts[place].numbers = worth.carried(part.numbers, [p.numbers for p in of])
    return claim


def asked(name, results):
    """The same of these runs alone. Result files that cannot be read leave it open and stop nothing."""
    claim = Claim(name, results)
    try:
        ALL[name](claim, results)
    except (ValueError, LookupError, OSError) as fault:
        claim.scene = claim.text = ""
        claim.parts = [Part("its result files can be read", UNKNOWN, {}, f"{type(fault).__name__}: {fault}")]
    return claim


def said(value):
    if isinstance(value, worth.Number):
        return str(value)
    if isinstance(value, float):
        return "none" if math.isnan(value) else "did not finish" if math.isinf(value) else f"{value:.4g}"
    return str(value)


def main():
    parser = program.flags(__doc__)
    parser.add_argument("claims", nargs="*", metavar="ID", help="C1 ... C10")
    parser.add_argument("--results", type=Path, default=program.ROOT / "results", help="folder of runs.csv")
    parser.add_argument("--runs", type=Path, help="folder of the runs [results/runs/PROFILE]")
    options = parser.parse_args()
    for wanted in options.claims:
        if wanted not in ALL:
            sys.exit(f"claims: no claim {wanted}; there are {', '.join(ALL)}")
    results = Runs(options.results, options.runs)
    for claim in [answered(name, results) for name in options.claims or ALL]:
        verdict = "; ".join(f"{who}: {what}" if who else what for who, what in claim.answers.items())
        print(f"{claim.id} {claim.scene}: {claim.text}\n  {verdict}")
        for part in claim.parts if options.claims else []:
            print(f"  * {part.verdict}: {part.text}" + (f" ({part.why})" if part.why else ""))
            for what, value in part.numbers.items():
                print(f"      {what}: {said(value)}")
        for command in claim.commands if options.claims else []:
            print(f"  {command}")
