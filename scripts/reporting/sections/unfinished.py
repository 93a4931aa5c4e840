"""Every run that did not end well, with its reason."""
from ..section import Section, esc, table

TITLE = "Runs that did not end well"


def build(results):
    bad = [row for row in results.rows if row["status"] != "ok" or row["false_claims"] not in ("", "0")]
    rows = [[esc(r["run"]), esc(r["status"]), esc(f"{float(r['t_reached']):.4g} s" if r["t_reached"] else ""), esc(r["reason"]),
             esc(r["false_claims"])] for r in bad]
    # What a limit cut may come through on another machine.
    limits = ("time_limit", "memory_limit")
    text = "<p>None.</p>" if not bad else table(["run", "status", "reached", "reason", "false claims"], rows)
    return Section(text, {r["run"]: [r["status"], r["reason"]] for r in bad if r["status"] not in limits},
                   {r["run"]: [r["status"], r["reason"]] for r in bad if r["status"] in limits})
