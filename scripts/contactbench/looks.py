"""The look of a method and what figures are made of. Every method keeps its colour, marker and line in all figures
(Okabe and Ito's colours; line and marker tell the curves apart in grey), and a method that is added later gets a look
of its own by itself."""
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from .gather import PARTS, number

matplotlib.use("Agg")
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"

# (method, solver or variant): name in legends, colour, marker.
LOOKS = {
    ("newton", "uncapped"): ("Newton, uncapped", VERMILION, "v"),
    ("newton", "stick-tested"): ("Newton, stick-tested", ORANGE, "^"),
    ("mirtich", ""): ("Mirtich", PURPLE, "D"),
    ("ap", "lemke"): ("A-P, Lemke", BLUE, "o"),
    ("ap", "path"): ("A-P, PATH", SKY, "s"),
    ("ap", "ynl"): ("A-P, YNL", GREEN, "P"),
    ("convex", "ipm"): ("convex", BLACK, "d"),
    ("ap", "pgs"): ("A-P, PGS", "#AA4499", "H"),
    ("coulomb", "newton"): ("Coulomb, Newton", "#332288", "X"),
    ("coulomb", "nsgs"): ("Coulomb, Gauss-Seidel", "#882255", "p"),
    ("coulomb", "bisection"): ("Coulomb, bisection", "#CC6677", "8"),
    ("coulomb", "admm"): ("Coulomb, ADMM", "#117733", "*"),
    ("coulomb", "cascade"): ("Coulomb, cascade", "#999933", "h"),
    ("soft", "sap"): ("soft, SAP", "#8C564B", "<"),
    ("soft", "mujoco"): ("soft, MuJoCo", "#7F7F7F", ">"), }
LATER = [(c, m) for m in "<>p*hX" for c in (PURPLE, ORANGE, GREEN, VERMILION, SKY, BLUE)]

LINES = ["-", (0, (4, 1.6)), (0, (1, 1.4)), (0, (5, 1.4, 1, 1.4))]

plt.rcParams.update({
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "lines.markeredgewidth": 0.6,
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "svg.hashsalt": "contactbench",
    "svg.fonttype": "path",
    "path.simplify": True,
    "axes.formatter.use_mathtext": True, })


def look_of(key, other):
    """(name, colour, marker) of a method with its solver or variant."""
    return LOOKS.get(key) or LOOKS.get((key[0], "")) or other


def styles(some):
    """A look for each cell: colour and marker by method and solver, line by knob (k, epsilon)."""
    looks, knobs, later, out = {}, {}, iter(LATER), []
    for cell in some:
        if cell.key not in looks:
            looks[cell.key] = look_of(cell.key, None) or (" ".join(p for p in cell.key if p), *next(later))
        knob = (cell["k"], cell["epsilon"], cell["knobs"])
        if knob not in knobs.setdefault(cell.key, []):
            knobs[cell.key].append(knob)
    for place, cell in enumerate(some):
        name, colour, marker = looks[cell.key]
        line = LINES[knobs[cell.key].index((cell["k"], cell["epsilon"], cell["knobs"])) % len(LINES)]
        name += f", k = {cell['k']}" if cell["k"] else ""
        name += rf", $\epsilon$ = {power(cell['epsilon'])} J" if cell["epsilon"] else ""
        name += ", " + cell["knobs"].replace("_", " ") if cell["knobs"] else ""
        out.append({
            "label": name, "color": colour, "marker": marker, "linestyle": line, "markeredgecolor": "white",
            "zorder": 3 + 0.01 * place})
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


class Curves:
    """The cells of a figure with their looks; `note`: what its legend adds."""
    def __init__(self, cells, note=""):
        self.cells, self.looks, self.note = cells, styles(cells), note

    def __len__(self):
        return len(self.cells)

    def __iter__(self):
        """Number, cell and look of each."""
        return zip(range(len(self)), self.cells, self.looks)

    def draw(self, axes, number, t, y, points=600, markers=8, cross=True):
        """One curve with its markers staggered against those of the others, and a cross where the run stopped."""
        if len(t) == 0:
            return
        style, ended = self.looks[number], self.cells[number].how_it_ended
        x, z = thin(np.asarray(t), np.asarray(y), points)
        line = axes.plot(x, z, **{**style, "marker": ""})[0]
        # Markers at even places along the axis, shifted from curve to curve.
        places = x[0] + (x[-1] - x[0]) * (np.arange(markers) + (number + 0.5) / len(self)) / markers
        at = np.unique(np.clip(np.searchsorted(x, places), 0, len(x) - 1))
        axes.plot(x[at], z[at], **{**style, "linestyle": "", "label": "_", "zorder": line.get_zorder() + 0.5})
        if cross and " at " in ended:
            axes.plot(x[-1:], z[-1:], linestyle="", marker="x", color=style["color"], markersize=8, markeredgewidth=1.8,
                      zorder=9, clip_on=False)

    def path(self, axes, number, x, z, width, turn):
        """A path with two markers in its first `turn` points, at places of its own."""
        axes.plot(x, z, **{**self.looks[number], "marker": "", "linewidth": width})
        return [int(turn * (number + 0.5 + half) / len(self) / 2) for half in (0, len(self))]

    def time(self, axes, title):
        """Processing time up to each moment: all parts of a step but the referee's check; a log scale where the methods
        are far apart."""
        most = []
        for place, cell, _ in self:
            t, *parts = cell.series("steps.csv", "t", *PARTS)
            used = np.cumsum(sum(parts))
            self.draw(axes, place, t, used)
            most += [used[-1]] if len(used) else []
        if most and max(most) > 20 * min(most):
            axes.set_yscale("log")
            axes.set_ylim(bottom=min(most) / 100)
        axes.set(title=title, xlabel="simulated time (s)", ylabel="processing time (s)")

    def handles(self):
        return [plt.Line2D([], [], **{**look, "label": look["label"] + ending(cell)}) for _, cell, look in self]


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


def point(name, colour, marker):
    """Of a method, in a legend of points."""
    return plt.Line2D([], [], linestyle="", marker=marker, color=colour, label=name)


def solves(panel, rows, column, floor, known):
    """Residual (a column of solve_all.csv) over time of a solve, a point a problem and solver; what is below `floor` is
    drawn there, and what did not end ok on the rail above. `known`: handles for a legend, to which new ones are
    added."""
    groups = {}
    for row in rows:
        groups.setdefault((row["method"] or "ap", row["solver"] or row["variant"]), []).append(row)
    for key, some in groups.items():
        name, colour, marker = look_of(key, (" ".join(key), YELLOW, "*"))
        known.setdefault(name, point(name, colour, marker))
        look = {
            "linestyle": "", "marker": marker, "color": colour, "markersize": 3.5, "markeredgewidth": 0.3, "alpha": 0.7}
        good = [r for r in some if r["status"] == "ok" and r["time_median_s"] and r[column]]
        panel.plot([number(r["time_median_s"]) for r in good], [max(number(r[column]), floor) for r in good], **look)
        bad = [r for r in some if r["status"] != "ok" and r["time_median_s"]]
        panel.plot([number(r["time_median_s"]) for r in bad], [1.04] * len(bad), transform=panel.get_xaxis_transform(),
                   clip_on=False,
                   **{**look, "markerfacecolor": "none", "markeredgewidth": 0.8, "markeredgecolor": colour})
    busy = sum(r["busy"] == "True" for r in rows)
    if busy:
        panel.set_title(f"others used the machine during {busy} of {len(rows)}", loc="right", fontsize=7, color="0.35",
                        pad=16)
    panel.set(xscale="log", yscale="log", xlabel="time of a solve, median (s)")


def floor_line(axes, floor, text, **place):
    """A broken line where what is below is drawn."""
    axes.axhline(floor, color="0.55", linewidth=0.8, linestyle=(0, (6, 3)), zorder=2)
    axes.annotate(text, (1, floor), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right",
                  fontsize=7.5, color="0.35", **place)


def save(figure, folder, name):
    """As PNG and SVG, the same bytes for the same picture. 256 colours are enough for lines, in a third of the file."""
    folder.mkdir(parents=True, exist_ok=True)
    place = folder / f"{name}.png"
    figure.savefig(place, bbox_inches="tight", metadata={"Software": None})
    with Image.open(place) as drawn:
        drawn.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(place, optimize=True)
    figure.savefig(folder / f"{name}.svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
    plt.close(figure)
