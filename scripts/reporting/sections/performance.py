"""Performance profiles, and how often a claim of success is true."""
from .. import precision
from ..section import Section, esc, table
from . import figures

TITLE = "How often, how fast, how truthfully"


def build(results):
    picture, about, digest = figures.shown(results, figures.PLOTS / "performance.py", precision.SWEEP)
    rows = precision.truthfulness(results)
    html = picture + "<p>Over all runs of all sweeps: how many ended ok, and how many of the solver's claims of success the referee refuted.</p>" + \
        table(["method", "runs", "ended ok", "inaccurate", "solves", "claims refuted", "share of true claims"],
              [[esc(name), r["runs"], f"{r['ok']} ({100 * r['ok'] / r['runs']:.1f} %)", r["inaccurate"], r["solves"], r["false_claims"],
                f"{100 * (1 - r['false_claims'] / r['solves']):.4f} %" if r["solves"] else ""] for name, r in rows.items()])
    limited = any(row["status"] in ("time_limit", "memory_limit") for row in results.rows)
    # How far a run comes before a limit is the machine's, and with it the number of solves.
    return Section(html, {"figure": about, "truth": {} if limited else rows}, {"sha256": digest, "truth": rows if limited else {}})
