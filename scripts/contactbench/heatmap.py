"""The heat map of stress.csv: a row a case, a column a method, a panel a quantity. Reads the table only."""
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.colors import BoundaryNorm, ListedColormap

from .measures import VERDICTS

COLOURS = ["#3b7d4f", "#a8c686", "#d9d9d9", "#9d8ec7", "#e08a3c", "#c0392b", "#000000"]
PANELS = [("residual", "checked residual", -16, 0), ("error", "error / bound", -6, 6),
          ("energy_gain", "energy gain of an event", -16, 2), ("penetration", "penetration, m", -16, 0),
          ("solve_s", "time solving, s", -5, 1.5)]


def draw(path, out):
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "contactbench"
    rows = pd.read_csv(path, keep_default_na=False, na_values={
        name: "" for name in ("bound", *(key for key, *_ in PANELS))})
    methods, cases = rows["method"].unique(), rows[["id", "scene", "row"]].drop_duplicates()
    rows["error"] /= rows["bound"]
    rows["verdict"] = [list(VERDICTS).index(verdict) for verdict in rows["verdict"]]

    def of(column):
        """Of each case and method; nan where there is none."""
        table = rows.drop_duplicates(["id", "scene", "row", "method"], keep="last")
        table = table.pivot(index=["id", "scene", "row"], columns="method", values=column)
        return table.reindex(index=pd.MultiIndex.from_frame(cases), columns=methods).to_numpy(float)

    figure, axes = plt.subplots(1, 1 + len(PANELS), figsize=(4 + 2.6 * (1 + len(PANELS)), 1.5 + 0.16 * len(cases)),
                                sharey=True, layout="constrained")
    picture = axes[0].imshow(of("verdict"), cmap=ListedColormap(COLOURS), aspect="auto", interpolation="none",
                             norm=BoundaryNorm(np.arange(-0.5, len(VERDICTS)), len(VERDICTS)))
    bar = figure.colorbar(picture, ax=axes[0], location="top", ticks=range(len(VERDICTS)), pad=0.005, aspect=12)
    bar.ax.set_xticklabels(VERDICTS, fontsize=6, rotation=40, ha="left")
    names = [f"{case.scene}: {case.row}  {case.id}" for case in cases.itertuples()]
    axes[0].set_yticks(range(len(cases)), names, fontsize=6)
    for axis, (key, title, low, high) in zip(axes[1:], PANELS):
        values = of(key)
        known = ~np.isnan(values)
        values[known] = np.clip(np.log10(np.maximum(values[known], 1e-300)), low, high)  # zero and less are the least
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
