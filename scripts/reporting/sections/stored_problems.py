"""Every solver over the same problems: stored ones, and frozen streams of what one run met; without a simulation around them."""
import math

from .. import stored
from ..section import Section, esc, table
from . import figures

TITLE = "The same problems for every solver"
COLLECTION, STREAMS = "scripts/solve_all.py --out results/solve_all", "scripts/replay.py --out results/replay"


def said(value, factor=1.0, digits=2):
    return "" if math.isnan(value) else f"{factor * value:.{digits}g}"


def counted(counts, first, kind_of):
    return table([first, "solver", "number", "ok", "claims refuted", "worst checked residual", "median residual against Coulomb",
                  "median time, us"],
                 [[esc(kind_of(kind)), esc(name), c["problems"], f"{c['ok']} ({100 * c['ok'] / c['problems']:.0f} %)", c["false_claims"],
                   said(c["residual"]), said(c["law_residual"]), said(c["time"], 1e6, 3) + ("*" if c["busy"] and c["ok"] else "")] for (kind, name), c in counts.items()])


def fixed(counts):
    return {f"{kind} {name}": {k: v for k, v in c.items() if k not in ("time", "busy")} for (kind, name), c in counts.items()}


def times(counts):
    return {f"{kind} {name}": c["time"] for (kind, name), c in counts.items()}


def build(results):
    html, data, timing = [], {}, {}
    some = stored.rows(results)
    if some:
        picture, data["figure"], timing["sha256"] = figures.shown(results, figures.PLOTS / "stored_problems.py", made_by=COLLECTION)
        counts = stored.summary(some)
        html += [picture, counted(counts, "problems", lambda kind: "contact" if kind == "contact" else "LCP"),
                 "<p>Residual and time are over the ones that ended ok; * others used the machine meanwhile. Endings, one by one: <code>solve_all/solve_all.md</code>.</p>"]
        timing |= {"solvers": fixed(counts), "median_time_s": times(counts)}
    else:
        html.append(f"<p class='open'>Not made: <code>{COLLECTION}</code>.</p>")
    streams = stored.streams(results)
    if streams:
        picture, data["streams"], timing["streams_sha256"] = figures.shown(results, figures.PLOTS / "streams.py", made_by=STREAMS)
        counts = {scene: stored.summary(rows) for scene, rows in streams.items()}
        html.append(picture)
        for scene, count in counts.items():
            html.append(f"<details><summary>{esc(scene)}: every solver</summary>" + counted(count, "scene", lambda _, name=scene: name) + "</details>")
        timing["streams"] = {scene: {"solvers": fixed(c), "median_time_s": times(c)} for scene, c in counts.items()}
    else:
        html.append(f"<p class='open'>Not made: <code>{STREAMS}</code>.</p>")
    return Section("\n".join(html), data, timing)
