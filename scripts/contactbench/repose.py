"""The angle of repose: at which angle the balls of a turning drum stand (scenarios/rolling_drum.xml), from the runs of
the sweep `motion`. Reads result files; runs nothing."""
import contextlib
import math

import numpy as np
from matplotlib.patches import Circle

from . import program, view
from .looks import Curves, plt

SWEEP, SCENE = "motion", "rolling_drum"
FIGURE = "repose"
# Degrees, dry grains that turn slowly, and their friction: as the scene's head quotes GDR MiDi, On dense granular
# flows, Eur. Phys. J. E 14 (2004). A range for the eye: the review itself was not at hand.
PUBLISHED, OF_MU = (20, 35), (0.3, 0.6)
SETTLED = 0.5  # of the run: by then the first rise is over
SHOWN = "convex"  # whose balls are drawn, where it has run


def mu_of(cell):
    """Of the balls, nan where the run has the scene's own."""
    return float(dict(word.split("=") for word in cell["parameters"].split()).get("mu", "nan"))


def cells(results):
    return [cell for cell in results.cells(SCENE, SWEEP) if not math.isnan(mu_of(cell))]


def runs(results, _=None):
    return Curves(cells(results))


def angle(cell):
    """t, and by how many degrees the middle of the balls has turned about the drum's axis: the slope of their surface
    where they fill a segment of the drum evenly."""
    rows = view.table(cell.folder / "trajectory.csv")
    if rows.empty:
        return np.empty(0), np.empty(0)
    middle = rows[rows["body"].str.startswith("ball_")].groupby("t")[["px", "py"]].mean()
    return middle.index.to_numpy(), np.degrees(np.arctan2(middle["px"], -middle["py"])).to_numpy()


def settled(cell):
    """Least, mean and largest angle after the first rise; nothing of a run that did not come to its end."""
    t, degrees = angle(cell)
    late = degrees[t >= SETTLED * t[-1]] if cell.finished and len(t) else []
    return (late.min(), late.mean(), late.max()) if len(late) else None


def canvas(_):
    return plt.subplots(1, 3, figsize=(9.5, 3.5), gridspec_kw={"width_ratios": [2, 3, 2]})


def draw_balls(panel, cell, colour):
    """The balls at the end of a run, seen along the axis of the drum, and through their middle the slope."""
    motion = view.Motion(cell.folder, frames=2)
    radius = dict(zip(motion.shapes["shape"], motion.shapes["radius"].astype(float)))
    balls = [(pose[:2], radius[body]) for body, pose in zip(motion.bodies, motion.poses[-1]) if body in radius]
    for middle, size in balls:
        panel.add_patch(Circle(middle, size, facecolor="0.85", edgecolor="0.35", linewidth=0.6))
    r = max(float(np.hypot(*middle)) + size for middle, size in balls)
    panel.add_patch(Circle((0, 0), r, facecolor="none", edgecolor="0.35", linewidth=1.2))
    middle = np.mean([middle for middle, _ in balls], axis=0)
    along = np.array([-middle[1], middle[0]]) / np.hypot(*middle)
    half = np.sqrt(r**2 - middle @ middle)
    panel.plot(*np.array([middle - half * along, middle + half * along]).T, color=colour, linewidth=1.2,
               linestyle=(0, (6, 3)))
    panel.set(xlim=(-1.05 * r, 1.05 * r), ylim=(-1.05 * r, 1.05 * r), xticks=[], yticks=[])
    panel.set_aspect("equal", adjustable="box")
    panel.spines[:].set_visible(False)
    panel.set_title(f"{cell.with_k}, mu = {mu_of(cell):g}, at its end")


def repose(table, axes):
    picture, over_time, of_mu = axes
    most = max(mu_of(cell) for cell in table.cells)
    shift = 0.012  # of mu, between bars of the methods
    for number, cell, look in table:
        mu, found = mu_of(cell), settled(cell)
        if mu == most:
            table.draw(over_time, number, *angle(cell))
        if found:
            at = mu + shift * (0.5 if cell["method"] == SHOWN else -0.5)
            of_mu.vlines(at, found[0], found[2], color=look["color"], linewidth=1.5, alpha=0.5)
            of_mu.plot([at], [found[1]], **{**look, "linestyle": "", "label": "_"})
    steepest = [(cell, look) for _, cell, look in table if mu_of(cell) == most]
    for cell, look in sorted(steepest, key=lambda pair: pair[0]["method"] != SHOWN):
        with contextlib.suppress(program.ProgramError):  # kept no shapes
            draw_balls(picture, cell, look["color"])
            break
    else:
        picture.axis("off")
    over_time.axhspan(*PUBLISHED, color="0.9", zorder=0)
    of_mu.fill_between(OF_MU, *PUBLISHED, color="0.9", zorder=0)
    over_time.set(title=f"mu = {most:g}", xlabel="time (s)", ylabel="angle (degrees)")
    of_mu.set(title="mean, least and largest\nof the second half", xlabel="friction mu", ylim=(0, None))
    handles = {}
    for cell, handle in zip(table.cells, table.handles()):
        handles.setdefault(cell.key, handle)
    band = plt.Rectangle((0, 0), 1, 1, color="0.9", label="published, mu from 0.3 to 0.6")
    return [*handles.values(), band]
