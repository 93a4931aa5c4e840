"""Performance profiles: share of the problems (a scene with a step) that a method solves within a factor of the fastest's time.

Left: a problem is solved by a run that ends ok. Right: by one whose error is besides at most twice the least of all methods. A
failure counts as infinite time. With more than two methods such profiles can misrank all but the best: read the left end (how
often a method is the fastest) and the height at the right end (how many it solves), and compare pairs elsewhere."""
import math

import common
from common import np, plt
from reporting import precision
from reporting.results import Results

options = common.arguments()
results = Results(options.results, options.runs)
methods = precision.contenders(results)
if not methods:
    common.nothing(options, "performance", "the sweep error_time")
    raise SystemExit
first = {name: next(iter(cells.values())) for name, cells in methods.items()}
looks = dict(zip(first, common.styles(list(first.values()))))
figure, panels = plt.subplots(1, 2, figsize=(9.5, 3.6), sharey=True)
for panel, table, title in zip(panels, precision.profiles(results), ("ended ok", "ended ok, with the least error or up to twice that")):
    finite = [r for ratios in table.values() for r in ratios if math.isfinite(r)]
    end = max(finite, default=1.0) * 1.5
    for name, ratios in table.items():
        x = [r for r in ratios if math.isfinite(r)]
        y = np.arange(1, len(x) + 1) / len(ratios)
        panel.step([1.0, *x, end], [0.0, *y, y[-1] if len(y) else 0.0], where="post",
                   **{**looks[name], "label": name, "marker": "", "linestyle": "-"})
        panel.plot(x, y, **{**looks[name], "label": "_", "linestyle": ""})
    panel.set(xscale="log", xlim=(0.95, end), ylim=(-0.02, 1.03), title=title, xlabel="time over that of the fastest")
panels[0].set_ylabel("share of problems")
figure.tight_layout()
common.legend(figure, [plt.Line2D([], [], **{**looks[n], "label": n, "linestyle": "-"}) for n in looks], columns=4)
common.save(figure, options, "performance")
