"""The heat map of stress.csv: a row a case, a column a method, a panel a quantity. Reads the table only."""
import csv
import math

VERDICTS = ["right", "model", "typed", "wrong", "silent", "defect"]
COLOURS = ["#3b7d4f", "#a8c686", "#d9d9d9", "#e08a3c", "#c0392b", "#000000"]
PANELS = [("residual", "checked residual", -16, 0), ("error", "error / bound", -6, 6),
          ("energy_gain", "energy gain of an event", -16, 2), ("penetration", "penetration, m", -16, 0),
          ("solve_s", "time solving, s", -5, 1.5)]


def value(row, key):
    """log10 of a quantity; None where there is none, -inf for zero or less."""
    try:
        x = float(row[key]) / (float(row["bound"]) if key == "error" else 1)
    except (ValueError, ZeroDivisionError):
        return None
    return math.log10(x) if x > 0 else -math.inf


def draw(table, out):
    import matplotlib
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "contactbench"
    import matplotlib.pyplot as plt
    import numpy as np
    from matplotlib.colors import BoundaryNorm, ListedColormap

    with open(table) as file:
        rows = list(csv.DictReader(file))
    methods = list(dict.fromkeys(r["method"] for r in rows))
    cases = list(dict.fromkeys((r["id"], r["scene"], r["row"]) for r in rows))
    at = {((r["id"], r["scene"], r["row"]), r["method"]): r for r in rows}
    figure, axes = plt.subplots(1, 1 + len(PANELS), figsize=(4 + 2.6 * (1 + len(PANELS)), 1.5 + 0.16 * len(cases)),
                                sharey=True, layout="constrained")

    verdicts = np.full((len(cases), len(methods)), np.nan)
    for i, case in enumerate(cases):
        for j, method in enumerate(methods):
            if (case, method) in at:
                verdicts[i, j] = VERDICTS.index(at[case, method]["verdict"])
    colours = ListedColormap(COLOURS)
    picture = axes[0].imshow(verdicts, cmap=colours, norm=BoundaryNorm(np.arange(-0.5, len(VERDICTS)), len(VERDICTS)),
                             aspect="auto", interpolation="none")
    bar = figure.colorbar(picture, ax=axes[0], location="top", ticks=range(len(VERDICTS)), pad=0.005, aspect=12)
    bar.ax.set_xticklabels(VERDICTS, fontsize=6, rotation=40, ha="left")
    axes[0].set_yticks(range(len(cases)), [f"{scene}: {row}  {ident}" for ident, scene, row in cases], fontsize=6)
    for axis, (key, title, low, high) in zip(axes[1:], PANELS):
        values = np.full((len(cases), len(methods)), np.nan)
        for i, case in enumerate(cases):
            for j, method in enumerate(methods):
                found = value(at[case, method], key) if (case, method) in at else None
                if found is not None:
                    values[i, j] = min(max(found, low), high)
        map_of = plt.get_cmap("viridis").copy()
        map_of.set_bad("#ffffff")
        picture = axis.imshow(values, cmap=map_of, vmin=low, vmax=high, aspect="auto", interpolation="none")
        bar = figure.colorbar(picture, ax=axis, location="top", pad=0.005, aspect=12)
        bar.ax.tick_params(labelsize=6)
        bar.set_label("log10 of " + title, fontsize=7)
    for axis in axes:
        axis.set_xticks(range(len(methods)), methods, fontsize=6, rotation=90)
        axis.tick_params(length=0)
    figure.savefig(out / "heatmap.png", dpi=110, metadata={"Software": None})
    figure.savefig(out / "heatmap.svg", metadata={"Date": None, "Creator": None})
    plt.close(figure)
