"""Table I beside the paper's."""
from .. import table1
from ..section import Section

TITLE = "Table I: processing time"
TIMES = ("median_s", "minimum_s", "ratio", "busy")


def build(results):
    table1.write(results)
    rows = [row for _, row in table1.entries(results)]
    # A run that a limit cut is cut elsewhere next time.
    def cut(row):
        return row["status"] in ("time_limit", "memory_limit")
    data = [{k: v for k, v in row.items() if k not in TIMES and not (cut(row) and k in ("reason", "t_reached"))} for row in rows]
    text = """<p>Median of the repeats in seconds; in brackets the ratio to the convex method at 1e-12 J in the same column. Below, in
italics, what the paper prints and its ratio; a question mark where the scan of the paper lost the column. A star: others used the
machine meanwhile. <code>table1.csv</code>, <code>.md</code> and <code>.tex</code> hold the same.</p>"""
    return Section(text + table1.web(results), {"rows": data}, {"rows": [{k: row[k] for k in TIMES} for row in rows]})
