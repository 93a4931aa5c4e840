"""Figure 7: processing time of a stack (1 s simulated) against its number of boxes.

The paper's figure has the convex method and Newton at the bottom, Anitescu-Potra and Mirtich at the top."""
import math

import common
from common import plt

SCENE = "stack"

options = common.arguments()
cells = common.cells(options, SCENE)
if not cells:
    common.nothing(options, "figure07", SCENE)
    raise SystemExit


def boxes(cell):
    return int(cell["parameters"].split("=")[1])


# One curve a method and knob, over the numbers of boxes.
curves = {}
for cell in cells:
    curves.setdefault((cell.key, cell["k"], cell["epsilon"]), []).append(cell)
first = [c[0] for c in curves.values()]
looks = common.styles(first)
figure, axes = plt.subplots(figsize=(6.5, 4.6))
handles, unfinished = [], []
for look, some in zip(looks, curves.values()):
    done = [c for c in some if not math.isnan(c.seconds)]
    axes.plot([boxes(c) for c in done], [c.seconds for c in done], **look)
    failed = [c for c in some if math.isnan(c.seconds)]
    unfinished += [(boxes(c), look) for c in failed]
    reasons = {}
    for c in failed:
        reasons.setdefault(c["status"], []).append(str(boxes(c)))
    ended = "; ".join(f"{', '.join(n)}: {status}" for status, n in reasons.items())
    handles.append(plt.Line2D([], [], **{**look, "label": look["label"] + (f" ({ended})" if ended else "")}))

axes.set(xscale="log", yscale="log", title="stack of boxes, 1 s simulated", xlabel="boxes", ylabel="processing time (s)")
counts = sorted({boxes(c) for c in cells})
axes.set_xticks(counts, [str(n) for n in counts])
axes.set_xticks([], minor=True)
if unfinished:
    # A rail above the axes for what did not finish: no time is claimed for it.
    axes.text(-0.01, 1.12, "did not\nfinish", transform=axes.transAxes, ha="right", va="center", fontsize=7.5)
    axes.set_title("stack of boxes, 1 s simulated", pad=42)
    rail = axes.get_xaxis_transform()
    same = {}
    for n, look in unfinished:
        height = 1.05 + 0.035 * same.get(n, 0)
        same[n] = same.get(n, 0) + 1
        axes.plot([n], [height], transform=rail, clip_on=False, linestyle="", marker=look["marker"], markersize=6,
                  color=look["color"], markerfacecolor="none", markeredgewidth=1.2)
figure.tight_layout()
common.legend(figure, handles, columns=2)
common.save(figure, options, "figure07")
