"""The table of figures: each a function draw(table, axes) of the runs that it shows, or of the whole table. A new one
is a function, a row in FIGURES, what it shows in figures.toml and a link in scripts/plots/. They read result files
only.

The links in scripts/plots draw one of them each."""
import math
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Callable

import numpy as np
from matplotlib.patches import Polygon

from . import precision, program, repose, robots, solve_all, stepping
from .looks import Curves, ending, floor_line, legend, look_of, plt, point, save, solves, styles
from .runs import Runs

SAYS = {
    name: " ".join(text.split())
    for name, text in tomllib.loads(Path(__file__).with_suffix(".toml").read_text()).items()}
FLOOR = 1e-18  # m; what is below, exact zeros too, is drawn here


def figure01(table, axes):
    whole, close = axes
    impact, before = [], []
    for number, cell, _ in table:
        t, energy = cell.series("steps.csv", "t", "kinetic_energy")
        table.draw(whole, number, t, energy)
        if len(t) > 1:
            jump = int(np.argmax(np.abs(np.diff(energy))))
            impact.append(t[jump + 1])
            before.append(energy[jump])
            window = np.abs(t - t[jump + 1]) <= 0.05
            table.draw(close, number, t[window], energy[window], markers=3, cross=False)
    whole.set(title="whole run", xlabel="time (s)", ylabel="kinetic energy (J)")
    whole.set_ylim(bottom=0)
    if impact:
        where = float(np.median(impact))
        close.set(title=f"around the impact at t = {where:.3g} s", xlabel="time (s)",
                  xlim=(max(0.0, where - 0.05), where + 0.05))
        close.axhline(max(before), color="0.55", linewidth=0.8, linestyle=(0, (6, 3)))
        close.annotate("before the impact", (where + 0.05, max(before)), xytext=(0, -3), textcoords="offset points",
                       ha="right", va="top", fontsize=7.5, color="0.35")


def timing(title):
    """Processing time alone."""
    return lambda table, axes: table.time(axes, title)


def pushed(t):
    """Exact way of the sliding box, by the scene's own numbers: slides at (F - mu m g)/m while pushed, then is slowed
    by mu g until it stands."""
    mu, g, push, mass, begin, end = 0.1, 9.8, 1.0, 1.0, 1.0, 5.0
    a, b = push / mass - mu * g, mu * g
    under_way = np.clip(t - begin, 0, end - begin)
    speed = a * (end - begin)
    free = np.clip(t - end, 0, speed / b)
    return a * under_way**2 / 2 + speed * free - b * free**2 / 2


def figure03(table, axes):
    top, middle, bottom = axes
    time = np.linspace(0, 8, 801)
    truth = top.plot(time, pushed(time), color="0.75", linewidth=5, label="exact", solid_capstyle="butt", zorder=2)[0]
    farthest = [pushed(8.0)]
    for number, cell, _ in table:
        t, x, z = cell.series("trajectory.csv", "t", "px", "pz")
        if len(t):
            table.draw(top, number, t, x - x[0])
            table.draw(middle, number, t, np.maximum(np.hypot(x - x[0] - pushed(t), z - z[0]), 1e-16))
            farthest.append(np.max(np.abs(x - x[0])))
    top.set(title="displacement along the push", xlabel="time (s)", ylabel="displacement (m)")
    if max(farthest) > 20 * farthest[0]:
        top.set_yscale("symlog", linthresh=2 * farthest[0])
    middle.set(title="distance from the exact position (below 1e-16 m drawn at 1e-16)", xlabel="time (s)",
               ylabel="error (m)", yscale="log")
    table.time(bottom, "processing time")
    return [truth, *table.handles()]


def figure04(table, axes):
    top, bottom = axes
    floor = False
    for number, cell, _ in table:
        t, x, y, z = cell.series("trajectory.csv", "t", "px", "py", "pz")
        if len(t):
            creep = np.sqrt((x - x[0])**2 + (y - y[0])**2 + (z - z[0])**2)
            floor = floor or bool(np.any(creep[1:] <= FLOOR))
            table.draw(top, number, t[1:], np.maximum(creep[1:], FLOOR), points=300)
    top.set(title="creep: distance from the start, 0 m is exact", xlabel="time (s)", ylabel="displacement (m)",
            yscale="log")
    if floor:
        floor_line(top, FLOOR, "exactly 0, or below $10^{-18}$ m, is drawn here", xytext=(-2, -4), va="top")
        top.set_ylim(bottom=FLOOR / 100)
    table.time(bottom, "processing time")


def figure05(table, axes):
    path, distance = axes
    mu, g, drive = 0.02, 9.8, 0.4  # the scene's own (scenarios/circular_sliding.xml)
    radius = np.sqrt(drive**2 - (mu * g)**2)  # m, and m/s: one turn takes 2 pi s
    lag = np.arccos(mu * g / drive)  # rad, of the velocity behind the drive

    def exact(t):
        """Steady start: velocity of constant length, `lag` behind the turning drive."""
        return radius * (np.sin(t - lag) + np.sin(lag)), radius * (np.cos(lag) - np.cos(t - lag))

    truth = path.plot(*exact(np.linspace(0, 2 * np.pi, 400)), color="0.78", linewidth=6, label="exact", zorder=2)[0]
    extent, clipped, least = 3 * radius, False, 1.0
    for number, cell, look in table:
        t, px, pz = cell.series("trajectory.csv", "t", "px", "pz")
        if len(t) == 0:
            continue
        # One point every 20 ms of the path is enough for the eye.
        every = max(1, int(round(0.02 / (t[1] - t[0])))) if len(t) > 1 else 1
        dx, dz = px - px[0], pz - pz[0]
        clipped = clipped or bool(np.max(np.hypot(dx, dz)) > 2 * extent)
        at = table.path(path, number, dx[::every], dz[::every], 0.7,
                        max(1, min(len(t) - 1, int(np.searchsorted(t, 2 * np.pi)))))
        path.plot(dx[at], dz[at], **{**look, "linestyle": "", "markersize": 6, "zorder": 5})
        ex, ez = exact(t)
        error = np.maximum(np.hypot(dx - ex, dz - ez), 1e-16)
        least = min(least, float(np.quantile(error, 0.02)))
        table.draw(distance, number, t, error, points=300)
    from_above(path, clipped)
    if clipped:
        centre = radius * np.sin(lag), radius * np.cos(lag)
        path.set(xlim=(centre[0] - extent, centre[0] + extent), ylim=(centre[1] + extent, centre[1] - extent))
    distance.set(title="distance from the exact position", xlabel="time (s)", ylabel="distance (m)", yscale="log")
    distance.set_ylim(bottom=least / 3)  # all begin at 0
    return [truth, *table.handles()]


def from_above(path, clipped):
    path.set(title="path from above" + (" (cut off)" if clipped else ""), xlabel="x (m)", ylabel="z (m)")
    path.set_aspect("equal", adjustable="box")
    path.invert_yaxis()  # y points up, towards the reader: x to the right puts z downwards


def figure07(table, axes):
    def boxes(cell):
        return int(cell["parameters"].split("=")[1])

    # One curve a method and knob, over the numbers of boxes.
    curves = {}
    for cell in table.cells:
        curves.setdefault((cell.key, cell["k"], cell["epsilon"]), []).append(cell)
    handles, unfinished = [], []
    for look, some in zip(styles([c[0] for c in curves.values()]), curves.values()):
        done = [c for c in some if not math.isnan(c.seconds)]
        axes.plot([boxes(c) for c in done], [c.seconds for c in done], **look)
        reasons = {}
        for c in some:
            if math.isnan(c.seconds):
                unfinished.append((boxes(c), look))
                reasons.setdefault(c["status"], []).append(str(boxes(c)))
        ended = "; ".join(f"{', '.join(n)}: {status}" for status, n in reasons.items())
        handles.append(plt.Line2D([], [], **{**look, "label": look["label"] + (f" ({ended})" if ended else "")}))
    axes.set(xscale="log", yscale="log", title="stack of boxes, 1 s simulated", xlabel="boxes",
             ylabel="processing time (s)")
    counts = sorted({boxes(c) for c in table.cells})
    axes.set_xticks(counts, [str(n) for n in counts])
    axes.set_xticks([], minor=True)
    if unfinished:
        # A rail above the axes for what did not finish: no time is claimed for it.
        axes.text(-0.01, 1.12, "did not\nfinish", transform=axes.transAxes, ha="right", va="center", fontsize=7.5)
        axes.set_title("stack of boxes, 1 s simulated", pad=42)
        same = {}
        for n, look in unfinished:
            same[n] = same.get(n, -1) + 1
            axes.plot([n], [1.05 + 0.035 * same[n]], transform=axes.get_xaxis_transform(), clip_on=False, linestyle="",
                      marker=look["marker"], markersize=6, color=look["color"], markerfacecolor="none",
                      markeredgewidth=1.2)
    return handles


def three_below(table):
    """Two panels above one as wide as both, which has a line a cell."""
    figure = plt.figure(figsize=(9.5, 4.6 + 0.24 * len(table)))
    upper, lower = figure.add_gridspec(2, 1, height_ratios=[4.4, 0.3 + 0.22 * len(table)])
    return figure, [*(figure.add_subplot(g) for g in upper.subgridspec(1, 2)), figure.add_subplot(lower)]


def figure08(table, axes):
    path, distance, share = axes
    truth = path.plot(*robots.figure_eight(), color="0.78", linewidth=6, label="wanted", zorder=2)[0]
    extent, clipped, longest = 2.0 * robots.AMPLITUDE, False, 1.0
    least = 1e-3  # m, drawn at least: all begin at 0
    for number, cell, look in table:
        t, x, z, _ = robots.axle(cell)
        if len(t) == 0:
            continue
        clipped = clipped or bool(np.max(np.maximum(np.abs(x), np.abs(z))) > extent)
        at = table.path(path, number, x, z, 0.8, len(t) - 1)
        path.plot(x[at], z[at], **{**look, "linestyle": "", "markersize": 6, "zorder": 5})
        every = slice(None, None, 2)
        table.draw(distance, number, t[every], np.maximum(robots.cross_track(t[every], x[every], z[every]), least),
                   points=400)
        edges, left, right = robots.loads(cell)
        longest, both = max(longest, edges[-1]), left + right
        part = np.ma.masked_where(both <= 0, left / np.where(both > 0, both, 1))
        share.pcolormesh(edges, [number - 0.42, number + 0.42], part[None, :], cmap="RdBu", vmin=0, vmax=1,
                         rasterized=True)
    from_above(path, clipped)
    if clipped:
        path.set(xlim=(-extent, extent), ylim=(extent, -extent))
    distance.set(title="distance from the wanted path", xlabel="time (s)", ylabel="distance (m)", yscale="log")
    distance.set_ylim(bottom=least)
    share.set_facecolor("0.7")
    share.grid(False)
    share.set(title="share of the load: left wheel (blue), right wheel (red)", xlabel="time (s)", xlim=(0, longest),
              ylim=(len(table) - 0.5, -0.5))
    share.set_yticks(range(len(table)), [look["label"] for look in table.looks], fontsize=7.5)
    return [truth, *table.handles()]


def figure10(table, axes):
    size, least = 0.03, 1e-7  # m, of the box (scenarios/grasp.xml); drawn at least: all begin at 0
    dropped = axes.axhline(size / 2, color="0.6", linestyle=":", linewidth=1.2, label="half the box's size")
    for number, cell, _ in table:
        t, creep = robots.creep(cell)
        table.draw(axes, number, t, np.maximum(creep, least))
    axes.set(title="creep of the grasped box", xlabel="time (s)", ylabel="displacement in the fingers' frames (m)",
             yscale="log")
    # What falls further than this was dropped long before.
    axes.set_ylim(least, min(axes.get_ylim()[1], 1.0))
    return [dropped, *table.handles()]


EVERY = 5.0  # s, between the places of the mobile robot


def robot_picture(table, axes):
    extent = 1.5 * robots.AMPLITUDE
    for panel in axes.flat[len(table):]:
        panel.axis("off")
    for panel, (_, cell, look) in zip(axes.flat, table):
        panel.plot(*robots.figure_eight(), color="0.8", linewidth=4, zorder=2)
        t, x, z, heading = robots.axle(cell)
        panel.plot(x, z, color=look["color"], linewidth=0.7, zorder=3)
        for moment in np.arange(0, t[-1] + 1e-9, EVERY) if len(t) else []:
            i = int(np.argmin(np.abs(t - moment)))
            base, wheels, nose = robots.outline(x[i], z[i], heading[i])
            panel.fill(*base.T, facecolor="white", edgecolor=look["color"], linewidth=0.8, zorder=4)
            panel.plot(*nose.T, color=look["color"], linewidth=0.8, zorder=5)
            for wheel in wheels:
                panel.plot(*wheel.T, color="black", linewidth=2, solid_capstyle="butt", zorder=5)
        ended = cell.how_it_ended
        panel.set_title(look["label"] + (f"\n{ended}" if ended else ""), fontsize=8.5)
        panel.set_aspect("equal", adjustable="box")
    axes[0, 0].set(xlim=(-extent, extent), ylim=(extent, -extent))
    for panel in axes[:, 0]:
        panel.set_ylabel("z (m)")
    for panel in axes[-1]:
        panel.set_xlabel("x (m)")
    return []


MOMENTS = (0, 0.06, 0.14, 0.6, 1)  # of the time that a grasp reached


def grasp_picture(table, axes):
    box_places = []
    for row, cell, look in table:
        tracks = {
            name: cell.series("trajectory.csv", "t", *robots.POSE, of=(name, ), most=1500)
            for name in (*robots.ARM, *robots.FINGERS, "box")}
        count = min(track.shape[1] for track in tracks.values())
        for column, panel in enumerate(axes[row]):
            panel.set(xticks=[], yticks=[])
            panel.set_aspect("equal", adjustable="box")
            panel.spines[:].set_visible(False)
            if count == 0:
                continue
            i = round((count - 1) * MOMENTS[column])
            places = np.array([robots.VIEW @ tracks[name][1:4, i] for name in robots.ARM])
            panel.plot(*places.T, color="0.55", linewidth=3, marker="o", markersize=3, zorder=2,
                       solid_joinstyle="round")
            for name, half, centre in robots.PADS:
                finger = robots.VIEW @ tracks[name][1:4, i]
                panel.plot(*np.array([places[-1], finger]).T, color="0.55", linewidth=1.5, zorder=2)
                panel.add_patch(
                    Polygon(robots.silhouette(tracks[name][:, i], half, centre), facecolor="0.8", edgecolor="0.3",
                            linewidth=0.6, zorder=3 if name.endswith("left") else 5))
            panel.add_patch(
                Polygon(robots.silhouette(tracks["box"][:, i], *robots.BOX), facecolor=look["color"], edgecolor="black",
                        linewidth=0.5, alpha=0.9, zorder=4))
            trace = robots.VIEW @ tracks["box"][1:4, :i + 1]
            panel.plot(*trace[:, ::8], linestyle="", marker=".", markersize=1.2, color=look["color"], zorder=1)
            box_places += [places.min(axis=0), places.max(axis=0)]
            panel.text(0.03, 0.02, f"{tracks['box'][0, i]:.3g} s", transform=panel.transAxes, fontsize=7)
        axes[row, 0].set_title(look["label"] + ending(cell), fontsize=8.5)
    if box_places:
        low, high = np.min(box_places, axis=0), np.max(box_places, axis=0)
        # Room for the hand; a box that falls leaves the picture.
        axes[0, 0].set(xlim=(low[0] - 0.1, high[0] + 0.02), ylim=(low[1] - 0.07, high[1] + 0.06))
    return []


def fineness(cell):
    return float(cell["k"] or 0), -math.log10(float(cell["epsilon"] or 1))


def spread_of(point):
    """Least and most error of the ensemble, of the members that have one."""
    some = [
        max(e, FLOOR) for c in (point["cell"], *point["cell"].members)
        if not math.isnan(e := c.error(point["measure"]))]
    return min(some), max(some)


def error_time(table, axes):
    handles = {}
    for panel in axes.flat[len(precision.scenes(table)):]:
        panel.axis("off")
    for panel, (scene, parameters) in zip(axes.flat, precision.scenes(table)):
        points = precision.points(table, scene, parameters)
        groups, failed, knobs, floor = {}, [], {}, False
        for p, look in zip(points, styles([p["cell"] for p in points])):
            cell = p["cell"]
            knobs.setdefault(cell.key, set()).add(fineness(cell))
            name = look_of(cell.key, (look["label"], ))[0]
            handles.setdefault(name, point(name, look["color"], look["marker"]))
            if p["error"] is None:
                failed.append(look)
            else:
                groups.setdefault((cell.key, cell["k"], cell["epsilon"], not p["step"]), []).append((p, look))
        for (key, _, _, to_accuracy), some in groups.items():
            some.sort(key=lambda pair: -float(pair[0]["step"] or pair[0]["cell"].knob("accuracy")))
            error = [max([e for e in p["errors"] if math.isfinite(e)] + [FLOOR]) for p, _ in some]
            floor = floor or min(error) <= FLOOR
            finer = sorted(knobs[key])  # from coarse to fine
            size = 3.5 + 3.5 * finer.index(fineness(some[0][0]["cell"])) / max(len(finer) - 1, 1)
            look = {**some[0][1], "linestyle": "-", "linewidth": 0.6, "label": "_", "markersize": size}
            if to_accuracy:  # in place of a step
                look |= {"linestyle": "--", "linewidth": 1.2, "markerfacecolor": "none"}
            panel.plot([p["time"] for p, _ in some], error, **look)
            panel.hlines(error, [p["least"] for p, _ in some], [p["most"] for p, _ in some], color=look["color"],
                         linewidth=1.6, alpha=0.35)
            panel.vlines([p["time"] for p, _ in some], *zip(*(spread_of(p) for p, _ in some)), color=look["color"],
                         linewidth=0.8, alpha=0.35)
        front = precision.pareto(points)
        panel.plot([p["time"] for p in front], [max(p["worst"], FLOOR) for p in front], linestyle="", marker="o",
                   markersize=11, markerfacecolor="none", markeredgecolor="0.5", markeredgewidth=1.0, zorder=2.5)
        for number, look in enumerate(failed):
            panel.plot([1.03], [0.03 + 0.94 * (number + 0.5) / len(failed)], transform=panel.transAxes, clip_on=False,
                       linestyle="", marker=look["marker"], color=look["color"], markerfacecolor="none", markersize=5)
        if failed:
            panel.text(1.06, 0.5, f"{len(failed)} did not finish", transform=panel.transAxes, rotation=90, va="center",
                       fontsize=7.5)
        busy = sum(p["busy"] for p in points)
        if busy:
            panel.set_title(f"others used the machine during {busy} of {len(points)}", loc="right", fontsize=7.5,
                            color="0.35")
        if floor:
            floor_line(panel, FLOOR, "exactly 0, or below $10^{-18}$ m", xytext=(-2, 3), va="bottom")
        # A scene on which nothing moves has few decades; what is there is told apart all the same.
        panel.set(xscale="log", yscale="log", title=" ".join([scene.replace("_", " "), parameters]).strip(),
                  xlabel="processing time for a simulated second (s)", ylabel="largest error (m)")
    return list(handles.values())


def error_budget(table, axes):
    handles, least = {}, 1e-17  # m
    columns = (("solver", "of the solver"), ("model", "of the model"), ("step_error", "of the step"))
    for line, (scene, parameters) in zip(axes, precision.scenes(table)):
        rows = precision.budget(table, scene, parameters)
        for row, look in zip(rows, styles([r["cell"] for r in rows])):
            cell = row["cell"]
            name = look_of(cell.key, (look["label"], ))[0]
            handles.setdefault(name, point(name, look["color"], look["marker"]))
            for panel, (part, _) in zip(line, columns):
                if not math.isnan(row[part]) and cell.times:
                    panel.plot([cell.seconds / float(cell["duration"])], [max(row[part], least)],
                               **{**look, "linestyle": "", "label": "_"})
        for panel, (_, title) in zip(line, columns):
            panel.set(xscale="log", yscale="log", title=f"{scene.replace('_', ' ')} {parameters}: {title}".replace(
                " :", ":"))
            panel.title.set_fontsize(8.5)
        busy = sum(r["cell"].busy for r in rows)
        line[0].set_ylabel("error (m)" + (f"\n(others used the\nmachine: {busy} of {len(rows)})" if busy else ""))
    for panel in axes[-1]:
        panel.set_xlabel("processing time for a simulated second (s)")
    return list(handles.values())


def performance(table, axes):
    first = {name: next(iter(cells.values())) for name, cells in precision.contenders(table).items()}
    looks = dict(zip(first, styles(list(first.values()))))
    for panel, ratios_of, title in zip(axes, precision.profiles(table),
                                       ("ended ok", "ended ok, with the least error or up to twice that")):
        end = max((r for ratios in ratios_of.values() for r in ratios if math.isfinite(r)), default=1.0) * 1.5
        for name, ratios in ratios_of.items():
            x = [r for r in ratios if math.isfinite(r)]
            y = np.arange(1, len(x) + 1) / len(ratios)
            panel.step([1.0, *x, end], [0.0, *y, y[-1] if len(y) else 0.0], where="post",
                       **{**looks[name], "label": name, "marker": "", "linestyle": "-"})
            panel.plot(x, y, **{**looks[name], "label": "_", "linestyle": ""})
        panel.set(xscale="log", xlim=(0.95, end), ylim=(-0.02, 1.03), title=title,
                  xlabel="time over that of the fastest")
    axes[0].set_ylabel("share of problems")
    return [plt.Line2D([], [], **{**looks[n], "label": n, "linestyle": "-"}) for n in looks]


def stored_problems(table, axes):
    handles = {}
    for panel, kind, title in zip(axes, ("contact", "lcp"), ("contact problems", "linear complementarity problems")):
        solves(panel, [r for r in table if r["kind"] == kind], "residual", 1e-17, handles)
        panel.set_ylabel("checked residual")
        panel.set_title(title + "; above: not ok", pad=16)
    return list(handles.values())


def streams(table, axes):
    handles = {}
    for panel in axes.flat[len(table):]:
        panel.axis("off")
    for panel, (scene, rows) in zip(axes.flat, table.items()):
        solves(panel, rows, "law_residual", 1e-17, handles)  # exact zeros are drawn there
        panel.set_ylabel("residual against Coulomb")
        panel.set_title(scene, pad=16)
    return list(handles.values())


def panels(rows=1, columns=1, size=(6.5, 3.6), **more):
    """A canvas: a function of the table -> figure, axes."""
    return lambda table: plt.subplots(rows, columns, figsize=size, **more)


def two_beside(count):
    """As many panels as `count` says, two in a line."""
    def canvas(table):
        lines = -(-count(table) // 2)
        return plt.subplots(lines, 2, figsize=(9.5, 3.5 * lines), squeeze=False)

    return canvas


def scenes_by_three(table):
    lines = len(precision.scenes(table))
    return plt.subplots(lines, 3, figsize=(9.5, 2.5 * lines), squeeze=False, sharex="row", sharey="row")


def robots_by_three(table):
    columns = min(3, len(table))
    rows = -(-len(table) // columns)
    return plt.subplots(rows, columns, figsize=(3.3 * columns, 3.5 * rows), squeeze=False, sharex=True, sharey=True)


def moments(table):
    return plt.subplots(len(table), len(MOMENTS), figsize=(2.1 * len(MOMENTS), 1.75 * len(table) + 0.3), squeeze=False,
                        sharex=True, sharey=True)


def all_runs(results, scene):
    return Curves(results.cells(scene))


def uncut(results, scene):
    """For pictures without times: the cells that no limit cut, so that the picture comes out the same when made again;
    and what it says of the others."""
    cells = results.cells(scene)
    cut = [cell.label for cell in cells if cell.cut]
    return Curves([cell for cell in cells if not cell.cut],
                  "cut by a limit, not drawn: " + ", ".join(cut) if cut else "")


def one_each(results, scene):
    """One cell a method and solver: the first, which is the most exact."""
    some = uncut(results, scene)
    return Curves(list({cell.key: cell for cell in reversed(some.cells)}.values())[::-1], some.note)


def compared(results, _):
    """The whole table, if it has scenes of the sweep error_time."""
    return results if precision.scenes(results) else []


def contending(results, _):
    return results if precision.contenders(results) else []


def stored(results, _):
    return solve_all.rows_of(results)


def streamed(results, _):
    return solve_all.streams(results)


@dataclass
class Figure:
    draw: Callable  # (table, axes) -> handles of the legend, None for those of the table's cells
    scene: str = ""
    canvas: Callable = panels()
    table: Callable = all_runs  # (results, scene) -> what is drawn
    columns: int = 3  # of the legend
    needs: str = ""  # what makes the table, where it is not of a scene; such a figure stands in a section of its own
    tight: dict = field(default_factory=dict)
    adjust: dict | None = None  # in place of a tight layout

    @property
    def elsewhere(self):
        return bool(self.needs)


SWEEP = "the sweep error_time"
APART = {"hspace": 0.6, "wspace": 0.3}
WIDE, HIGH = {"width_ratios": [3, 2]}, {"height_ratios": [3, 2]}
# yapf: disable
FIGURES = {
    "error_budget": Figure(error_budget, "", scenes_by_three, compared, 4, SWEEP),
    "error_time": Figure(error_time, "", two_beside(lambda table: len(precision.scenes(table))), compared, 4, SWEEP),
    "figure01": Figure(figure01, "impacting_sphere", panels(1, 2, (9, 3.4), sharey=True, gridspec_kw=WIDE), uncut),
    "figure02": Figure(timing("impacting sphere"), "impacting_sphere"),
    "figure03": Figure(figure03, "sliding_box", panels(3, 1, (7, 8.4)), columns=2),
    "figure04": Figure(figure04, "sticking_box", panels(2, 1, (7, 6.8), gridspec_kw=HIGH), columns=2),
    "figure05": Figure(figure05, "circular_sliding", panels(1, 2, (9.5, 4.2)), uncut),
    "figure06": Figure(timing("box sliding in a circle"), "circular_sliding"),
    "figure07": Figure(figure07, "stack", panels(size=(6.5, 4.6)), columns=2),
    "figure08": Figure(figure08, "mobile_robot", three_below, uncut),
    "figure09": Figure(timing("mobile robot"), "mobile_robot"),
    "figure10": Figure(figure10, "grasp", panels(size=(7, 4.2)), uncut),
    "figure11": Figure(timing("manipulator grasp"), "grasp"),
    "grasp_picture": Figure(grasp_picture, "grasp", moments, one_each, tight={"h_pad": 0.4, "w_pad": 0.2}),
    "performance": Figure(performance, "", panels(1, 2, (9.5, 3.6), sharey=True), contending, 4, SWEEP),
    "repose": Figure(repose.repose, "", repose.canvas, repose.runs, 3, "the sweep motion"),
    "robot_picture": Figure(robot_picture, "mobile_robot", robots_by_three, one_each),
    "steps_taken": Figure(stepping.steps_taken, "", stepping.canvas, stepping.drawn, 4, "the sweep stepping"),
    "stored_problems": Figure(stored_problems, "", panels(1, 2, (9.5, 4.2)), stored, 4, "scripts/solve_all.py"),
    "streams": Figure(streams, "", two_beside(len), streamed, 4, "scripts/replay.py", adjust=APART),
}
# yapf: enable


def draw(name: str, results: Runs):
    """Draws a figure into the folder of the results; a picture that says so, where there is nothing to show."""
    this = FIGURES[name]
    table = this.table(results, this.scene)
    if table:
        figure, axes = this.canvas(table)
        handles = this.draw(table, axes)
        if this.adjust:
            figure.subplots_adjust(**this.adjust)
        else:
            figure.tight_layout(**this.tight)
        legend(figure, table.handles() if handles is None else handles, this.columns, getattr(table, "note", ""))
    else:
        figure, axes = plt.subplots(figsize=(7, 1.5))
        axes.axis("off")
        axes.text(0.5, 0.5, f"no run of {this.scene or this.needs} in runs.csv", ha="center", va="center")
    save(figure, results.folder / "figures", name)


def main():
    parser = program.flags(None)
    parser.add_argument("--results", required=True, type=Path,
                        help="folder with runs.csv; figures go to figures/ in it")
    parser.add_argument("--runs", required=True, type=Path, help="folder with one folder a run")
    options = parser.parse_args()
    name = Path(sys.argv[0]).stem
    if name not in FIGURES:
        parser.error("a figure is drawn by its link in scripts/plots")
    draw(name, Runs(options.results, options.runs))
