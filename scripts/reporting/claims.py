"""The paper's claims C1 to C10 as questions to the result files: reproduced, not reproduced, or cannot be told.

Each claim is cut into parts that one number can decide; the bounds stand in the part's own words and follow those of the
paper ("alike": 1 %; "about seven orders": six to eight). A claim is reproduced when all its parts are. Where a part is about Newton's model it is answered for
both variants, and so is then the claim. `why` stands beside a part only where the answer is "not reproduced".
"""
import dataclasses
import math
from dataclasses import dataclass, field

import numpy as np

from . import fits
from .results import number

YES, NO, UNKNOWN = "reproduced", "not reproduced", "cannot be told"
VARIANTS = ("uncapped", "stick-tested")
EPS = "1e-12"  # J, the convex method where the paper means a solved problem
EXACT_X = 0.16326530612244897  # m, sliding box at 8 s
RADIUS = math.sqrt(0.4**2 - (0.02 * 9.8)**2)  # m, of the circle on which the box slides in the end


@dataclass
class Part:
    text: str                 # what is asked, with its bound
    verdict: str
    numbers: dict             # {what: value}
    why: str = ""
    variant: str = ""         # of Newton's model; empty where the part is not about it
    timing: bool = False      # depends on the machine
    cells: list = field(default_factory=list)


@dataclass
class Claim:
    id: str
    scene: str
    text: str
    parts: list

    def answer(self, variant=""):
        verdicts = [p.verdict for p in self.parts if p.variant in ("", variant)]
        return NO if NO in verdicts else UNKNOWN if UNKNOWN in verdicts or not verdicts else YES

    @property
    def answers(self):
        """One answer, or one a variant of Newton's model."""
        if any(p.variant for p in self.parts):
            return {f"Newton {v}": self.answer(v) for v in VARIANTS}
        return {"": self.answer()}


def part(text, holds, numbers, cells=(), why="", variant="", timing=False):
    """`holds` is None where the results do not decide it."""
    verdict = UNKNOWN if holds is None else YES if holds else NO
    return Part(text, verdict, numbers, why if verdict == NO else "", variant, timing, list(cells))


def unknown(results, scene, text, variant=""):
    return Part(text, UNKNOWN, {}, f"no run of {scene}: {results.missing(scene)}" if results.missing(scene) else
                "a run that it needs is not there, or did not reach the end", variant)


def outcome(cell, came_to=""):
    """How a run ended and what it came to; of one that a limit cut just that."""
    return cell.cut or (cell.how_it_ended or "finished") + came_to


def find(cells, method, choice="", **more):
    """The one cell of a method with that solver or variant; None where there is none."""
    for c in cells:
        if c["method"] == method and (not choice or choice in (c["solver"], c["variant"])) and all(c[n] == v for n, v in more.items()):
            return c
    return None


def named(cells, value):
    return {c.label: value(c) for c in cells}


def newton(cells, variant):
    return find(cells, "newton", variant)


def others(cells):
    """Every method but Newton's; the convex one solved to 1e-12 J."""
    return [c for c in cells if c["method"] != "newton" and c["epsilon"] in ("", EPS)]


def c1(results):
    cells = results.cells("impacting_sphere", knobs="", parameters="")
    rise = lambda c: c.error("energy_rise_relative")  # noqa: E731
    parts = []
    for v in VARIANTS:
        cell, text = newton(cells, v), f"Newton {v} gains more than 1e-9 of the kinetic energy at the impact"
        parts.append(unknown(results, "impacting_sphere", text, v) if cell is None or math.isnan(rise(cell)) else
                     part(text, rise(cell) > 1e-9, named([cell], rise), [cell], variant=v,
                          why="friction that stops the slip where that lies in the cone cannot add energy: 1 + (3.5 mu^2 - 1 - 2 mu rho)"
                              " / (1 + rho^2) holds only for friction at full strength, which drives the slip backwards"))
    rest = [c for c in cells if c["method"] != "newton"]
    known = rest and not any(math.isnan(rise(c)) for c in rest)
    text = "no other model gains more than 1e-9"
    parts.append(part(text, all(rise(c) <= 1e-9 for c in rest), named(rest, rise), rest) if known else
                 unknown(results, "impacting_sphere", text))
    return Claim("C1", "impacting sphere", "Newton's model gains kinetic energy at the impact; the other models do not (Fig. 1)", parts)


def displacement(cell):
    """Along the push, at the end; nan for a run that did not get there."""
    (x,) = cell.series("trajectory.csv", "px")
    return float(x[-1] - x[0]) if cell.finished and len(x) else math.nan


def c2(results):
    cells = results.cells("sliding_box", knobs="", parameters="")
    x = {id(c): displacement(c) for c in cells}
    far = lambda c: x[id(c)]  # noqa: E731
    alike = [c for c in others(cells) if c["solver"] != "ynl"]
    parts, texts = [], {"alike": "Mirtich, A-P Lemke, A-P PATH and convex end within 1 % of each other",
                        "ynl": "A-P YNL ends more than 1 % away from them", "early": "convex at 1e-2 J ends more than 1 % beyond them"}
    if not alike or any(math.isnan(far(c)) for c in alike):
        return Claim("C2", "sliding box", C2, [unknown(results, "sliding_box", t) for t in texts.values()])
    middle = float(np.median([far(c) for c in alike]))
    spread = (max(map(far, alike)) - min(map(far, alike))) / middle
    parts.append(part(texts["alike"], spread <= 0.01, {**named(alike, far), "spread": spread, "exact": EXACT_X}, alike,
                      why="contact by contact, Mirtich's micro-impacts spend friction on four corners one after the other, which is not"
                          " the friction of the box as a whole; the others agree with the exact answer"))
    for v in VARIANTS:
        cell, text = newton(cells, v), f"Newton {v} lets it go more than 1 % farther than their median"
        ok = cell is not None and not math.isnan(far(cell))
        parts.append(part(text, far(cell) > 1.01 * middle, {**named([cell], far), "median of the others": middle}, [cell], variant=v)
                     if ok else unknown(results, "sliding_box", text, v))
    cell = find(cells, "ap", "ynl")
    parts.append(unknown(results, "sliding_box", texts["ynl"]) if cell is None or math.isnan(far(cell)) else
                 part(texts["ynl"], abs(far(cell) / middle - 1) > 0.01, {**named([cell], far), "median of the others": middle}, [cell],
                      why="an LCP solver that solves the same problem gives the same motion; in the paper the solver's code must have failed to"))
    cell = find(cells, "convex", epsilon="1e-2")
    parts.append(unknown(results, "sliding_box", texts["early"]) if cell is None or math.isnan(far(cell)) else
                 part(texts["early"], far(cell) > 1.01 * middle, {**named([cell], far), "median of the others": middle}, [cell]))
    return Claim("C2", "sliding box", C2, parts)


C2 = ("most models move the box alike; Newton's lets it go farther; A-P with YNL differs; convex stopped at 1e-2 goes too far (Fig. 3)")


def c3(results):
    cells = results.cells("sticking_box", knobs="", parameters="")
    eight = [c for c in cells if c["k"] in ("", "8")]
    creep = lambda c: c.error("displacement_linf_m")  # noqa: E731
    parts = []
    for v in VARIANTS:
        cell, text = newton(eight, v), f"Newton {v} moves the box by 1 mm within 2 s"
        parts.append(unknown(results, "sticking_box", text, v) if cell is None or math.isnan(creep(cell)) else
                     part(text, cell.error("first_past_1mm_s") <= 2.0,
                          {"time of 1 mm, s": cell.error("first_past_1mm_s"), "largest displacement, m": creep(cell)}, [cell], variant=v))
    # Below this, the rounding of a position of size 1 m, a box does not move.
    rounding = float(np.finfo(float).eps)
    held = [c for c in others(eight) if not math.isnan(creep(c))]
    texts = ["the others creep, A-P Lemke least (within a factor of 2; less than 2e-16 m is no creep)", "A-P PATH creeps most of them",
             "between the best and the worst of them lie six to eight orders of magnitude (A-P Lemke against A-P PATH)"]
    lemke, path = find(held, "ap", "lemke"), find(held, "ap", "path")
    if lemke and path:
        floored = {id(c): max(creep(c), rounding) for c in held}
        orders = math.log10(floored[id(path)] / floored[id(lemke)])
        parts += [part(texts[0], floored[id(lemke)] <= 2 * min(floored.values()), named(held, creep), held),
                  part(texts[1], floored[id(path)] >= 0.5 * max(floored.values()) and floored[id(path)] > rounding,
                       named(held, creep), held, why="solved to rounding, the same LCP gives the same rest with every solver; what creeps"
                       " most here is a model, not a solver"),
                  part(texts[2], 6 <= orders <= 8, {"orders, PATH over Lemke": orders, **named([lemke, path], creep)}, [lemke, path],
                       why="every A-P solver here holds the box to rounding")]
    else:
        parts += [unknown(results, "sticking_box", t) for t in texts]
    for text, cell in (("Mirtich does not finish", find(eight, "mirtich")),
                       ("A-P PATH with 16 edges does not finish", find(cells, "ap", "path", k="16"))):
        parts.append(unknown(results, "sticking_box", text) if cell is None else
                     part(text, not cell.finished, {cell.label: outcome(cell)}, [cell],
                          why="the paper lays it to robustness; nothing in the model stops this scene"))
    return Claim("C3", "sticking box", "Newton's model does not hold for much over 1 s; the others creep, with about seven orders of "
                 "magnitude between the best (A-P/Lemke) and the worst (A-P/PATH); Mirtich and A-P/PATH with 16 edges do not finish "
                 "(Fig. 4)", parts)


def path_of(cell):
    t, x, z = cell.series("trajectory.csv", "t", "px", "pz")
    return t, np.column_stack([x, z])


def c4(results):
    cells = [c for c in results.cells("circular_sliding", sweep=None, parameters="start=rest") if c["knobs"] == ""]
    end = lambda c: c.error("position_final_m")  # noqa: E731
    parts = []
    text = "from rest, A-P's distance to the convex answer at 60 s falls with k at least as k^-1.5 from 4 to 64 edges"
    convex = find(cells, "convex", epsilon=EPS)
    polygons = sorted((c for c in cells if c["method"] == "ap"), key=lambda c: int(c["k"]))
    if convex is None or len(polygons) < 3 or not all(c.finished for c in [convex, *polygons]):
        parts.append(unknown(results, "circular_sliding", text))
    else:
        final = path_of(convex)[1][-1]
        apart = [float(np.linalg.norm(path_of(c)[1][-1] - final)) for c in polygons]
        slope = fits.slope([int(c["k"]) for c in polygons], [max(a, 1e-300) for a in apart])
        parts.append(part(text, slope <= -1.5 and all(b < a for a, b in zip(apart, apart[1:])),
                          {**{f"k = {c['k']}, m": a for c, a in zip(polygons, apart)}, "slope": slope}, [convex, *polygons]))
    cell = find(cells, "mirtich")
    texts = ["Mirtich's last turn is a circle (best fit within 5 % rms)", f"it is not the predicted one: off by more than a tenth of its "
             f"radius ({RADIUS:.4f} m) at some time"]
    if cell is None or not cell.finished:
        parts += [unknown(results, "circular_sliding", t) for t in texts]
    else:
        t, p = path_of(cell)
        radius, deviation = fits.circle(p[t >= t[-1] - 2 * math.pi])
        parts += [part(texts[0], deviation <= 0.05, {"radius, m": radius, "deviation": deviation}, [cell]),
                  part(texts[1], cell.error("position_linf_m") > 0.1 * RADIUS,
                       {"largest distance from the exact place, m": cell.error("position_linf_m")}, [cell])]
    for v in VARIANTS:
        cell, text = newton(cells, v), f"Newton {v} slides almost in one direction: net displacement at least 0.9 of the way"
        if cell is None or not cell.finished:
            parts.append(unknown(results, "circular_sliding", text, v))
            continue
        p = path_of(cell)[1]
        way = float(np.sum(np.linalg.norm(np.diff(p, axis=0), axis=1)))
        straight = float(np.linalg.norm(p[-1] - p[0])) / way
        parts.append(part(text, straight >= 0.9, {"displacement over way": straight, "way, m": way,
                                                  "largest distance from the exact place, m": cell.error("position_linf_m")}, [cell],
                          variant=v, why="both readings of Hahn's friction oppose the slip that there is, and follow the circle with an"
                                         " error; the paper's code presumably held on to one direction"))
    return Claim("C4", "circular sliding", "convex gives what A-P converges to as k grows; Mirtich draws a circle, but not the predicted "
                 "one; Newton slides almost in one direction (Fig. 5)", parts)


def stacks(results):
    """{boxes: cells}."""
    out = {}
    for c in results.cells("stack", knobs=""):
        out.setdefault(int(c["parameters"].removeprefix("boxes=")), []).append(c)
    return dict(sorted(out.items()))


def seconds(cell):
    """Processing time; infinite where the run did not finish, nan where there is no run."""
    return math.nan if cell is None else cell.seconds if cell.finished else math.inf


def c5(results):
    by_size = stacks(results)
    parts = []
    if not by_size:
        return Claim("C5", "stack", C5, [unknown(results, "stack", "convex and Newton are the two fastest at every size")])
    for v in VARIANTS:
        text = f"at every size convex (1e-12 J) and Newton {v} are the two fastest of the six"
        ranks, used = {}, []
        for n, cells in by_size.items():
            field_ = others(cells) + [c for c in [newton(cells, v)] if c is not None]
            used += field_
            order = sorted((c for c in field_ if c.finished), key=seconds)
            for c in (find(field_, "convex"), newton(field_, v)):
                if c is not None:
                    ranks[f"{n} boxes, {c.name}"] = order.index(c) + 1 if c in order else c.how_it_ended
        parts.append(part(text, all(r in (1, 2) for r in ranks.values()), ranks, used, variant=v, timing=True,
                          why="sweeps over single contacts need many rounds for a stack, and do not converge for a high one; a pivoting"
                              " solver with a sparse factorisation is fast"))
    big = {n: cells for n, cells in by_size.items() if n >= 8}
    used = [c for cells in big.values() for c in others(cells) if c["method"] in ("ap", "convex")]
    text = "at 8 and 16 boxes every A-P solver is slower than convex"
    slower = [seconds(c) > seconds(find(cells, "convex", epsilon=EPS)) for cells in big.values() for c in cells if c["method"] == "ap"]
    parts.append(part(text, all(slower), {f"{c['parameters']}, {c.name}": seconds(c) for c in used}, used, timing=True,
                      why="A-P's LCP, solved sparsely, costs about as much as the convex program") if slower else
                 unknown(results, "stack", text))
    text = "Mirtich is slower than convex at every size from 2 boxes on"
    pairs = [(n, find(c, "mirtich"), find(c, "convex", epsilon=EPS)) for n, c in by_size.items() if n >= 2]
    pairs = [(n, m, c) for n, m, c in pairs if m and c]
    parts.append(part(text, all(seconds(m) > seconds(c) for _, m, c in pairs),
                      {f"{n} boxes": f"{m.how_it_ended or f'{seconds(m):.3g} s'} against {seconds(c):.3g} s" for n, m, c in pairs},
                      [x for _, m, c in pairs for x in (m, c)], timing=True) if pairs else unknown(results, "stack", text))
    return Claim("C5", "stack", C5, parts)


C5 = "convex and Newton are fastest; A-P is among the slowest; Mirtich is slow (Fig. 7)"


def c6(results):
    cells = [c for c in results.cells("mobile_robot", knobs="", parameters="") if c["epsilon"] in ("", EPS)]
    off = lambda c: c.error("cross_track_rms_m")  # noqa: E731
    drives = lambda c: c.finished and off(c) <= 2 * c.error("no_slip_cross_track_rms_m")  # noqa: E731
    how = lambda c: outcome(c, f", off by {said(off(c))} m rms, without slip {said(c.error('no_slip_cross_track_rms_m'))}")  # noqa: E731
    drive = "drives the figure eight: to the end, off its path by at most twice what a robot without slip is (rms)"
    convex, lemke = find(cells, "convex"), find(cells, "ap", "lemke")
    parts = [unknown(results, "mobile_robot", f"convex {drive}") if convex is None else
             part(f"convex {drive}", drives(convex), named([convex], how), [convex], why="the solver's failure, not the model's: see its status")]
    finer = [c for c in results.cells("mobile_robot", None, knobs="step=5e-5 duration=10") + results.cells("mobile_robot", None, knobs="step=5e-5")
             if c["method"] == "ap"]
    for v in VARIANTS:
        rest = [c for c in cells if c["method"] != "convex" and c["variant"] in ("", v)]
        text = f"no other model does (Newton: {v})"
        parts.append(part(text, not any(drives(c) for c in rest), named(rest + finer, how), rest + finer, variant=v,
                          why="a correct answer to the contact problem drives the robot, whichever model finds it") if rest else
                     unknown(results, "mobile_robot", text, v))
    text = "A-P Lemke leaves one of the wheels without load in at least 90 % of the steps"
    unloaded = lemke.error("unloaded_left_relative") + lemke.error("unloaded_right_relative") if lemke else math.nan
    parts.append(unknown(results, "mobile_robot", text) if math.isnan(unloaded) else
                 part(text, unloaded >= 0.9, {"share of steps": unloaded, "left": lemke.error("unloaded_left_relative"),
                                              "right": lemke.error("unloaded_right_relative"),
                                              "mean load asymmetry": lemke.error("load_asymmetry_mean_relative")}, [lemke],
                      why="the two loads are redundant: how they are shared is an accident of the pivots, not of the model"))
    caster = find(results.cells("mobile_robot_caster", None), "ap", "lemke")
    text = "with a caster in place of the counterweight A-P Lemke still shares the load unequally (mean asymmetry above 0.5)"
    asymmetry = caster.error("load_asymmetry_mean_relative") if caster else math.nan
    parts.append(unknown(results, "mobile_robot_caster", text) if math.isnan(asymmetry) else
                 part(text, asymmetry > 0.5, {"mean load asymmetry": asymmetry}, [caster],
                      why="on three supports the loads are statically determinate, and every solver that solves the problem finds them"))
    return Claim("C6", "mobile robot", "only convex drives the figure eight; A-P loads one wheel at a time (Fig. 8)", parts)


def c7(results):
    cells = [c for c in results.cells("grasp", knobs="", parameters="") if c["epsilon"] in ("", EPS)]
    holds = lambda c: c.finished and math.isnan(c.error("dropped_s")) and c.error("creep_linf_m") <= 5e-3  # noqa: E731
    how = lambda c: outcome(c, f", creep {said(c.error('creep_linf_m'))} m" + (  # noqa: E731
        "" if math.isnan(c.error("dropped_s")) else f", dropped at {said(c.error('dropped_s'))} s"))
    text, convex = "convex holds the box to the end (not dropped, creep at most 5 mm)", find(cells, "convex")
    parts = [unknown(results, "grasp", text) if convex is None else part(text, holds(convex), named([convex], how), [convex])]
    for who, cell, v in (*((f"Newton {v}", newton(cells, v), v) for v in VARIANTS), ("Mirtich", find(cells, "mirtich"), "")):
        text = f"{who} does not hold it"
        parts.append(unknown(results, "grasp", text, v) if cell is None else
                     part(text, not holds(cell), named([cell], how), [cell], variant=v,
                          why="swept to convergence, contact by contact, friction reaches what the load needs"))
    text, rest = "A-P's LCP cannot be solved: no A-P solver reaches the end", [c for c in cells if c["method"] == "ap"]
    parts.append(part(text, not any(c.finished for c in rest), named(rest, how), rest,
                      why="the LCP always has a solution that Lemke's method can reach; failing is a code's, not the model's. Which of the"
                      " many solutions a solver returns decides whether the box is held") if rest else unknown(results, "grasp", text))
    return Claim("C7", "grasp", "only convex holds the box; Newton and Mirtich drop it; A-P's LCP cannot be solved (Figs. 10, 11)", parts)


def pairs(results, solver):
    """(cell with Lemke, the same with the other solver) over every scene and knob."""
    lemke = {tuple(c[n] for n in ("scene", "parameters", "k", "knobs")): c for c in results.cells(sweep=None, method="ap", solver="lemke")}
    both = [(lemke.get(tuple(c[n] for n in ("scene", "parameters", "k", "knobs"))), c)
            for c in results.cells(sweep=None, method="ap", solver=solver)]
    return [(a, b) for a, b in both if a is not None]


def c8(results):
    parts, text = [], "over all runs of both, PATH fails (not finished, or an answer refuted) more often than Lemke, and in at least 5 %"
    both = pairs(results, "path")
    bad = lambda c: c["status"] != "ok"  # noqa: E731
    if both:
        lemke, path = sum(bad(a) for a, _ in both), sum(bad(b) for _, b in both)
        parts.append(part(text, path > lemke and path >= 0.05 * len(both), {"runs of each": len(both), "Lemke failed": lemke, "PATH failed": path},
                          [c for pair in both for c in pair if bad(c)],
                          why="path is an implementation of our own (restarts, proximal steps, checked answers), not the library of 2011"))
    else:
        parts.append(unknown(results, "stack", text))
    text = "YNL runs out of memory, or needs more than ten times Lemke's, on a scene of the paper"
    both = pairs(results, "ynl")
    if both:
        ratio = {b.label + ", " + b["scene"] + (" " + b["parameters"] if b["parameters"] else ""):
                 number(b["peak_memory_mb"]) / number(a["peak_memory_mb"]) for a, b in both}
        out = [b for _, b in both if b["status"] == "memory_limit"]
        worst = max(ratio, key=ratio.get)
        parts.append(part(text, bool(out) or ratio[worst] > 10,
                          {"runs": len(both), "ended by memory": len(out), "largest memory over Lemke's": ratio[worst], "there": worst}, out,
                          timing=True, why="its stored candidates are bounded here, and the resting scenes need few of them"))
    else:
        parts.append(unknown(results, "stack", text))
    return Claim("C8", "all", "Lemke is far more robust than PATH; YNL uses too much memory for scenes of moderate size", parts)


def c9(results):
    parts = []
    for scene, parameters, k in (("impacting_sphere", "", "8"), ("sliding_box", "", "16"), ("sticking_box", "", "8"),
                                 ("circular_sliding", "", "8"), ("stack", "boxes=1", "4"), ("mobile_robot", "", "4")):
        cells = [c for c in others(results.cells(scene, parameters=parameters, knobs="")) if c["k"] in ("", k)]
        lemke = find(cells, "ap", "lemke")
        text = f"{scene.replace('_', ' ')}: A-P Lemke is faster than every model but Newton's (whose accuracy the paper itself doubts)"
        if lemke is None or len(cells) < 2:
            parts.append(unknown(results, scene, text))
            continue
        parts.append(part(text, lemke.finished and all(seconds(lemke) <= seconds(c) for c in cells), named(cells, seconds), cells, timing=True,
                          why="on so few contacts the methods lie close together, and the interior point method's active-set finish"
                              " or a single impact integrated in closed steps can win"))
    return Claim("C9", "few contacts", "A-P with Lemke is the fastest choice where a pyramid is good enough", parts)


def c10(results):
    parts, text = [], "convex (1e-12 J) ends every run ok"
    cells = [c for c in results.cells(sweep=None, method="convex", epsilon=EPS)]
    bad = [c for c in cells if c["status"] != "ok"]
    parts.append(part(text, not bad, {"runs": len(cells), **{f"{c['scene']} {c.label}": outcome(c) for c in bad}}, bad,
                      why="see the reasons in runs.csv") if cells else unknown(results, "stack", text))
    by_size = stacks(results)
    growth = {}
    for n, some in by_size.items():
        if n >= 4:
            for c in [*others(some), *[newton(some, v) for v in VARIANTS]]:
                if c is not None:
                    growth.setdefault(c.name, {})[n] = seconds(c)
    name = next((n for n in growth if n.startswith("convex")), None)
    texts = ["convex is the fastest at 16 boxes", "from 4 to 16 boxes its time grows with the least power of n, at most n^1.5"]
    if name is None or len(growth[name]) < 2 or 16 not in growth[name]:
        parts += [unknown(results, "stack", t) for t in texts]
    else:
        last = {n: t.get(16, math.nan) for n, t in growth.items()}
        parts.append(part(texts[0], last[name] <= min(last.values()), {n: t if math.isfinite(t) else "did not finish" for n, t in last.items()},
                          by_size[16], timing=True))
        powers = {n: fits.slope(t, t.values()) for n, t in growth.items()
                  if len(t) > 1 and all(math.isfinite(s) and s > 0 for s in t.values())}
        parts.append(part(texts[1], name in powers and powers[name] <= min(min(powers.values()), 1.5), powers,
                          [c for n, some in by_size.items() if n >= 4 for c in some], timing=True))
    grasp = find(results.cells("grasp", knobs="", parameters=""), "convex", epsilon=EPS)
    text = "closed loops: convex gets through the grasp"
    parts.append(unknown(results, "grasp", text) if grasp is None else
                 part(text, grasp.finished, {grasp.label: outcome(grasp)}, [grasp]))
    return Claim("C10", "many contacts, loops, cones", "convex is robust and fast with good worst-case growth", parts)


ALL = (c1, c2, c3, c4, c5, c6, c7, c8, c9, c10)


def all_claims(results):
    """Result files that cannot be read leave their claim open and stop nothing."""
    out = []
    for make in ALL:
        try:
            out.append(make(results))
        except (ValueError, LookupError, OSError) as error:
            name = make.__name__.upper()
            out.append(Claim(name, "", "", [Part("its result files can be read", UNKNOWN, {}, f"{type(error).__name__}: {error}")]))
    return out


def said(value):
    if isinstance(value, float):
        return "none" if math.isnan(value) else "did not finish" if math.isinf(value) else f"{value:.4g}"
    return str(value)


def as_data(claim):
    """For report.json: what does not depend on the machine, and what does."""
    def plain(p):
        return {f.name: getattr(p, f.name) for f in dataclasses.fields(p) if f.name in ("text", "verdict", "why", "variant", "numbers")}
    data = {"scene": claim.scene, "claim": claim.text, "parts": [plain(p) for p in claim.parts if not p.timing]}
    timing = {"answers": claim.answers, "parts": [plain(p) for p in claim.parts if p.timing]}
    if not timing["parts"]:
        data["answers"] = timing.pop("answers")
        return data, {}
    return data, timing


def commands(claim):
    """The runs behind the numbers of a claim."""
    return list(dict.fromkeys(c.command for p in claim.parts for c in p.cells))
