"""Stored problems: checked residual against time, one point a problem and solver, without a simulation around it.

Left: contact problems from the scenes and from others' collections, against the model that was solved. Right: bare linear
complementarity problems. Solver and trajectory are seen apart here: everybody gets the same numbers. What did not end ok stands on
the rail above, at the time it took."""
import common
from common import plt
from reporting import stored
from reporting.results import Results, number

FLOOR = 1e-17
options = common.arguments()
rows = [r for r in stored.rows(Results(options.results, options.runs)) if r["status"] != "unavailable"]
if not rows:
    common.nothing(options, "stored_problems", "scripts/solve_all.py")
    raise SystemExit
figure, panels = plt.subplots(1, 2, figsize=(9.5, 4.2))
handles = {}
for panel, kind, title in zip(panels, ("contact", "lcp"), ("contact problems", "linear complementarity problems")):
    groups = {}
    for row in rows:
        if row["kind"] == kind:
            groups.setdefault((row["method"] or "ap", row["solver"] or row["variant"]), []).append(row)
    for (method, choice), some in groups.items():
        name, colour, marker = common.LOOKS.get((method, choice)) or common.LOOKS.get((method, "")) or (f"{method} {choice}", common.YELLOW, "*")
        handles.setdefault(name, plt.Line2D([], [], linestyle="", marker=marker, color=colour, label=name))
        look = {"linestyle": "", "marker": marker, "color": colour, "markersize": 3.5, "markeredgewidth": 0.3, "alpha": 0.7}
        good = [r for r in some if r["status"] == "ok" and r["time_median_s"] and r["residual"]]
        panel.plot([number(r["time_median_s"]) for r in good], [max(number(r["residual"]), FLOOR) for r in good], **look)
        bad = [r for r in some if r["status"] != "ok" and r["time_median_s"]]
        panel.plot([number(r["time_median_s"]) for r in bad], [1.04] * len(bad), transform=panel.get_xaxis_transform(), clip_on=False,
                   **{**look, "markerfacecolor": "none", "markeredgewidth": 0.8, "markeredgecolor": colour})
    panel.set(xscale="log", yscale="log", xlabel="time of a solve, median (s)", ylabel="checked residual")
    panel.set_title(title + "; above: not ok", pad=16)
figure.tight_layout()
common.legend(figure, list(handles.values()), columns=4)
common.save(figure, options, "stored_problems")
