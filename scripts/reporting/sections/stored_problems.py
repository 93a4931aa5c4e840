"""Every solver over every stored problem: residual against time, without a simulation around it."""
import math

from .. import stored
from ..section import Section, esc, table
from . import figures

TITLE = "The same problems for every solver"


def build(results):
    if not stored.rows(results):
        return Section("<p class='open'>Not made: <code>scripts/solve_all.py --out results/solve_all</code>.</p>")
    html, about, digest = figures.shown(results, figures.PLOTS / "stored_problems.py")
    made = "scripts/solve_all.py --out results/solve_all"
    html = html.replace(esc(about["commands"][0]), esc(made))
    about["commands"][0] = made
    counts = stored.summary(results)
    html += table(["problems", "solver", "number", "ok", "claims refuted", "worst checked residual", "median time, us"],
                  [[esc("contact" if kind == "contact" else "LCP"), esc(name), c["problems"],
                    f"{c['ok']} ({100 * c['ok'] / c['problems']:.0f} %)", c["false_claims"],
                    "" if math.isnan(c["residual"]) else f"{c['residual']:.2g}", "" if math.isnan(c["time"]) else f"{1e6 * c['time']:.3g}"]
                   for (kind, name), c in counts.items()])
    html += "<p>Residual and time are over the ones that ended ok. Endings, one by one: <code>solve_all/solve_all.md</code>.</p>"
    fixed = {f"{kind} {name}": {k: v for k, v in c.items() if k != "time"} for (kind, name), c in counts.items()}
    return Section(html, {"figure": about}, {"sha256": digest, "solvers": fixed,
                                             "median_time_s": {f"{kind} {name}": c["time"] for (kind, name), c in counts.items()}})
