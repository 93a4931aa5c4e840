"""Stored problems: checked residual against time, one point a problem and solver, without a simulation around it.

Left: contact problems from the scenes and from others' collections, against the model that was solved. Right: bare linear
complementarity problems. Solver and trajectory are seen apart here: everybody gets the same numbers. What did not end ok stands on
the rail above, at the time it took."""
import common
from common import plt
from reporting import stored
from reporting.results import Results

FLOOR = 1e-17
options = common.arguments()
rows = stored.rows(Results(options.results, options.runs))
if not rows:
    common.nothing(options, "stored_problems", "scripts/solve_all.py")
    raise SystemExit
figure, panels = plt.subplots(1, 2, figsize=(9.5, 4.2))
handles = {}
for panel, kind, title in zip(panels, ("contact", "lcp"), ("contact problems", "linear complementarity problems")):
    common.solves(panel, [r for r in rows if r["kind"] == kind], "residual", FLOOR, handles)
    panel.set_ylabel("checked residual")
    panel.set_title(title + "; above: not ok", pad=16)
figure.tight_layout()
common.legend(figure, list(handles.values()), columns=4)
common.save(figure, options, "stored_problems")
