"""Result files as the tables, claims and figures read them: runs.csv, manifest.json, and the files of each run."""
import csv
import json
import math
import statistics
from pathlib import Path

import numpy as np

from sweeping.plan import Run

CELL = ("scene", "parameters", "method", "variant", "solver", "k", "epsilon", "knobs")


def number(text):
    """A cell of the table as a number; nan where it is empty."""
    return float(text) if text else math.nan


class Cell:
    """One method on one scene with one choice of knobs: its repeats."""

    def __init__(self, rows, runs):
        self.rows = rows
        self.runs = Path(runs)
        self.key = (rows[0]["method"], rows[0]["solver"] or rows[0]["variant"])
        # Files are read from the repeat with the median time, so that no single disturbance of the machine shows.
        timed = sorted(rows, key=lambda r: float(r["processing_s"] or "inf"))
        self.row = timed[(len(timed) - 1) // 2]
        self.folder = self.runs / self.row["run"]

    def __getitem__(self, column):
        return self.row[column]

    @property
    def finished(self):
        return all(r["finished"] == "true" for r in self.rows)

    @property
    def times(self):
        return [float(r["processing_s"]) for r in self.rows if r["finished"] == "true" and r["processing_s"]]

    @property
    def seconds(self):
        """Median processing time of the finished repeats, s; nan where there is none."""
        return statistics.median(self.times) if self.times else math.nan

    @property
    def busy(self):
        """Whether others used the machine during a repeat."""
        return any(r["busy"] == "true" for r in self.rows)

    def error(self, name):
        """A scene error (`contactbench list references`); nan where the run has none."""
        return number(self.row.get(f"error_{name}", ""))

    @property
    def how_it_ended(self):
        """Empty for a run that reached its end; else what stopped it and when."""
        bad = next((r for r in self.rows if r["finished"] != "true"), None)
        if bad is None:
            return "" if self["status"] == "ok" else self["status"]
        return bad["status"] + (f" at {float(bad['t_reached']):.3g} s" if bad["t_reached"] else "")

    @property
    def unrepeated(self):
        """The name of its runs without the number of the repeat, of which `row` is the one of median time."""
        return self["run"].rsplit("__r", 1)[0]

    @property
    def cut(self):
        """The limit that cut a repeat, empty where none did: how far such a run comes depends on the machine, and what
        is to come out the same when made again must not show it."""
        return next((r["status"] for r in self.rows if r["status"] in ("time_limit", "memory_limit")), "")

    @property
    def name(self):
        """The method as a reader would say it."""
        names = {"newton": "Newton", "mirtich": "Mirtich", "ap": "A-P", "convex": "convex", "lemke": "Lemke", "path": "PATH",
                 "ynl": "YNL", "path-lib": "PATH library"}
        parts = [self["method"]] + [self["solver"] if self["method"] != "convex" else ""] + [self["variant"]]
        said = " ".join(names.get(p, p) for p in parts if p)
        return said + (f", epsilon {self['epsilon']} J" if self["epsilon"] else "")

    @property
    def label(self):
        """The method with all its knobs."""
        return self.name + (f", k = {self['k']}" if self["k"] else "") + (f", {self['knobs']}" if self["knobs"] else "")

    @property
    def command(self):
        """What a reader types to do this run again."""
        return " ".join(["contactbench run", f"{self['scene']}.xml", *Run.of(self.row).flags()])

    def series(self, file, *columns, of=None, most=None):
        """Columns of a file of the run as arrays; empty arrays where there is no file or no row. `of`: only the rows of
        a body, joint or pair, by its words; `most`: at most about so many of them, evenly spaced."""
        return series(self.folder / file, *columns, of=of, most=most)


def series(path, *columns, of=None, most=None):
    """Columns of a CSV file as arrays. `of`: only the rows that have these words as cells; `most`: at most about so many
    of them, evenly spaced, and the last."""
    try:
        lines = path.read_text().splitlines(keepends=True)
    except OSError:
        return np.empty((len(columns), 0))
    if lines and not lines[-1].endswith("\n"):
        lines.pop()  # a run that was killed can leave half a row
    head, rows = lines[:1], lines[1:]
    for word in of or ():
        rows = [row for row in rows if f",{word}," in row]
    if not rows:
        return np.empty((len(columns), 0))
    if most and len(rows) > most:
        rows = [rows[i] for i in np.unique(np.linspace(0, len(rows) - 1, most).round().astype(int))]
    head = head[0].strip().split(",")
    return np.loadtxt(rows, delimiter=",", usecols=[head.index(c) for c in columns], ndmin=2).T


class Results:
    """A folder with runs.csv and manifest.json, and the folder of its runs."""

    def __init__(self, results, runs):
        self.folder, self.runs = Path(results), Path(runs)
        with open(self.folder / "runs.csv", newline="") as file:
            self.rows = list(csv.DictReader(file))
        try:
            self.manifest = json.loads((self.folder / "manifest.json").read_text())
        except FileNotFoundError:
            self.manifest = {}

    def cells(self, scene=None, sweep="paper", **wanted):
        """Cells in the order of the table: those of a scene (of all), of one sweep file (of all: None), with given columns."""
        groups = {}
        for row in self.rows:
            if (scene in (None, row["scene"]) and (sweep is None or sweep in row["sweeps"].split())
                    and all(row[c] == v for c, v in wanted.items())):
                groups.setdefault(tuple(row[c] for c in CELL), []).append(row)
        return [Cell(rows, self.runs) for rows in groups.values()]

    def missing(self, scene):
        """Why a scene has no run; empty where it has some."""
        if any(row["scene"] == scene for row in self.rows):
            return ""
        return self.manifest.get("missing", {}).get(scene, "no run of it is in this profile")
