"""What the figures share: the tidy table, the look of a method, and how a file is written.

A figure reads result files only. Every method keeps its colour, marker and line in all figures (Okabe and Ito's colours;
line and marker tell the curves apart in grey), and a method that is added later gets a look of its own by itself.
"""
import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import interpreter  # noqa: E402

interpreter.need("matplotlib", "numpy")
import matplotlib  # noqa: E402

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from reporting.results import Results, number  # noqa: E402

BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7")

# (method, solver or variant): name in legends, colour, marker.
LOOKS = {
    ("newton", "uncapped"): ("Newton, uncapped", VERMILION, "v"),
    ("newton", "stick-tested"): ("Newton, stick-tested", ORANGE, "^"),
    ("mirtich", ""): ("Mirtich", PURPLE, "D"),
    ("ap", "lemke"): ("A-P, Lemke", BLUE, "o"),
    ("ap", "path"): ("A-P, PATH", SKY, "s"),
    ("ap", "ynl"): ("A-P, YNL", GREEN, "P"),
    ("convex", "ipm"): ("convex", BLACK, "d"),
}
LATER = [(c, m) for m in "<>p*hX" for c in (PURPLE, ORANGE, GREEN, VERMILION, SKY, BLUE)]

plt.rcParams.update({
    "font.size": 9, "axes.titlesize": 10, "axes.titlelocation": "left", "axes.grid": True, "grid.color": "0.9",
    "grid.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False, "axes.axisbelow": True,
    "legend.frameon": False, "legend.fontsize": 8, "lines.linewidth": 1.3, "lines.markersize": 4.5,
    "lines.markeredgewidth": 0.6, "figure.dpi": 100, "savefig.dpi": 150, "svg.hashsalt": "contactbench",
    "svg.fonttype": "path", "path.simplify": True, "axes.formatter.use_mathtext": True,
})


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--results", required=True, type=Path, help="folder with runs.csv; figures go to figures/ in it")
    parser.add_argument("--runs", required=True, type=Path, help="folder with one folder a run")
    return parser.parse_args()


def cells(options, scene, sweep="paper", **wanted):
    """The cells of a scene in the order of the table, e.g. cells(options, "stack", parameters="boxes=4")."""
    return Results(options.results, options.runs).cells(scene, sweep, **wanted)


def uncut(some):
    """For pictures without times: the cells that no limit cut, so that the picture comes out the same when made again; and
    what it says of the others."""
    cut = [cell.label for cell in some if cell.cut]
    return [cell for cell in some if not cell.cut], "cut by a limit, not drawn: " + ", ".join(cut) if cut else ""


def styles(some):
    """A look for each cell: colour and marker by method and solver, line by knob (k, epsilon)."""
    looks, knobs, later = {}, {}, iter(LATER)
    for cell in some:
        if cell.key not in looks:
            known = LOOKS.get(cell.key) or LOOKS.get((cell.key[0], ""))
            looks[cell.key] = known or (" ".join(p for p in cell.key if p), *next(later))
        knob = (cell["k"], cell["epsilon"], cell["knobs"])
        if knob not in knobs.setdefault(cell.key, []):
            knobs[cell.key].append(knob)
    out = []
    for number, cell in enumerate(some):
        name, colour, marker = looks[cell.key]
        knob = (cell["k"], cell["epsilon"], cell["knobs"])
        line = ["-", (0, (4, 1.6)), (0, (1, 1.4)), (0, (5, 1.4, 1, 1.4))][knobs[cell.key].index(knob) % 4]
        if cell["k"]:
            name += f", k = {cell['k']}"
        if cell["epsilon"]:
            name += rf", $\epsilon$ = {power(cell['epsilon'])} J"
        if cell["knobs"]:
            name += ", " + cell["knobs"].replace("_", " ")
        out.append({"label": name, "color": colour, "marker": marker, "linestyle": line,
                    "markeredgecolor": "white", "zorder": 3 + 0.01 * number})
    return out


def power(number):
    """1e-12 as 10 to the -12."""
    mantissa, exponent = f"{float(number):.6e}".split("e")
    mantissa = f"{float(mantissa):g}"
    return ("" if mantissa == "1" else mantissa + r" $\times$ ") + rf"$10^{{{int(exponent)}}}$"


def thin(t, y, points=600):
    """At most about `points` points that keep every extreme: the least and the greatest of each interval."""
    if len(t) <= points:
        return t, y
    edges = np.linspace(0, len(t), points // 2 + 1).astype(int)
    keep = {0, len(t) - 1}
    for a, b in zip(edges[:-1], edges[1:]):
        keep.add(a + int(np.argmin(y[a:b])))
        keep.add(a + int(np.argmax(y[a:b])))
    keep = np.array(sorted(keep))
    return t[keep], y[keep]


def curve(axes, t, y, style, number, count, ended="", points=600, markers=8):
    """Draws one curve with its markers staggered against those of the others, and a cross where the run stopped."""
    if len(t) == 0:
        return
    x, z = thin(np.asarray(t), np.asarray(y), points)
    line = axes.plot(x, z, **{**style, "marker": ""})[0]
    # Markers at even places along the axis, shifted from curve to curve.
    places = x[0] + (x[-1] - x[0]) * (np.arange(markers) + (number + 0.5) / max(count, 1)) / markers
    at = np.unique(np.clip(np.searchsorted(x, places), 0, len(x) - 1))
    axes.plot(x[at], z[at], **{**style, "linestyle": "", "label": "_", "zorder": line.get_zorder() + 0.5})
    if ended and " at " in ended:
        axes.plot(x[-1:], z[-1:], linestyle="", marker="x", color=style["color"], markersize=8, markeredgewidth=1.8,
                  zorder=9, clip_on=False)


def ending(cell):
    """What a legend adds to the name of a run that did not end well."""
    ended = cell.how_it_ended
    return rf" ($\bf{{\times}}$ {ended})" if " at " in ended else f" ({ended})" if ended else ""


def legend(figure, handles, columns=3, note=""):
    """One legend for the whole figure, below it; `note` is its last entry."""
    if note:
        handles = [*handles, plt.Line2D([], [], linestyle="", label=note)]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 0.0), borderaxespad=0.2, ncol=columns,
                  columnspacing=1.6, handlelength=3.2)


def handles(some, looks):
    return [plt.Line2D([], [], **{**look, "label": look["label"] + ending(cell)}) for cell, look in zip(some, looks)]


def cumulative(cell):
    """Simulated time, and the processing time up to it (s): all parts of a step but the referee's check."""
    t, *parts = cell.series("steps.csv", "t", "dynamics_s", "collision_s", "assembly_s", "solve_s")
    return t, np.cumsum(sum(parts))


def timing_panel(axes, some, looks, title):
    """Processing time up to each moment; a log scale where the methods are far apart."""
    most = []
    for number, (cell, look) in enumerate(zip(some, looks)):
        t, used = cumulative(cell)
        curve(axes, t, used, look, number, len(some), cell.how_it_ended)
        if len(used):
            most.append(used[-1])
    if most and max(most) > 20 * min(most):
        axes.set_yscale("log")
        axes.set_ylim(bottom=min(most) / 100)
    axes.set(title=title, xlabel="simulated time (s)", ylabel="processing time (s)")


def solves(panel, rows, column, floor, known):
    """Residual (a column of solve_all.csv) over time of a solve, a point a problem and solver; what is below `floor` is drawn there, and
    what did not end ok on the rail above. `known`: handles for a legend, to which new ones are added."""
    groups = {}
    for row in rows:
        groups.setdefault((row["method"] or "ap", row["solver"] or row["variant"]), []).append(row)
    for (method, choice), some in groups.items():
        name, colour, marker = LOOKS.get((method, choice)) or LOOKS.get((method, "")) or (f"{method} {choice}", YELLOW, "*")
        known.setdefault(name, plt.Line2D([], [], linestyle="", marker=marker, color=colour, label=name))
        look = {"linestyle": "", "marker": marker, "color": colour, "markersize": 3.5, "markeredgewidth": 0.3, "alpha": 0.7}
        good = [r for r in some if r["status"] == "ok" and r["time_median_s"] and r[column]]
        panel.plot([number(r["time_median_s"]) for r in good], [max(number(r[column]), floor) for r in good], **look)
        bad = [r for r in some if r["status"] != "ok" and r["time_median_s"]]
        panel.plot([number(r["time_median_s"]) for r in bad], [1.04] * len(bad), transform=panel.get_xaxis_transform(), clip_on=False,
                   **{**look, "markerfacecolor": "none", "markeredgewidth": 0.8, "markeredgecolor": colour})
    busy = sum(r["busy"] == "True" for r in rows)
    if busy:
        panel.set_title(f"others used the machine during {busy} of {len(rows)}", loc="right", fontsize=7, color="0.35", pad=16)
    panel.set(xscale="log", yscale="log", xlabel="time of a solve, median (s)")


def save(figure, options, name):
    folder = options.results / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / f"{name}.png", bbox_inches="tight", metadata={"Software": None})
    figure.savefig(folder / f"{name}.svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
    plt.close(figure)


def nothing(options, name, scene):
    """Says so in the picture where no run of the scene is there."""
    figure, axes = plt.subplots(figsize=(7, 1.5))
    axes.axis("off")
    axes.text(0.5, 0.5, f"no run of {scene} in runs.csv", ha="center", va="center")
    save(figure, options, name)
