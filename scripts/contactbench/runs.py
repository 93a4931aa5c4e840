"""The tables of runs as claims, figures and pages read them: a Cell is one method on one scene with one choice of
knobs, with its repeats."""
import copy
import functools
import math
import shlex
import statistics
import zlib
from pathlib import Path

import numpy as np
import pandas as pd

from .gather import CELL, LIMITS, number
from .plan import Run
from .program import read_json

# Columns of other tables that say what was asked.
ASKED = {
    "problem", "kind", "scene", "method", "variant", "solver", "k", "epsilon", "compression_bound", "id", "row",
    "bound", "expect", "table", "what", "command"}
NAMES = {
    "newton": "Newton", "mirtich": "Mirtich", "ap": "A-P", "convex": "convex", "coulomb": "Coulomb",
    "nsgs": "Gauss-Seidel", "admm": "ADMM", "sap": "SAP", "lemke": "Lemke", "path": "PATH", "ynl": "YNL",
    "path-lib": "PATH library", "ode": "ODE", "bullet": "Bullet", "bullet-float": "Bullet (float)", "mujoco": "MuJoCo",
    "dart": "DART", "simbody": "Simbody", "siconos": "Siconos"}


def write_table(rows: list[dict], columns: list[str], path):
    """A CSV file of rows (dictionaries); what one lacks is empty."""
    pd.DataFrame(rows, columns=columns, dtype=object).to_csv(path, index=False, lineterminator="\n")


def table_of(path) -> pd.DataFrame:
    """A CSV file with its cells as they are written; an empty one is an empty word."""
    return pd.read_csv(path, dtype=str, keep_default_na=False)


class Cell:
    """One method on one scene with one choice of knobs: its repeats. `members`: the cells of its ensemble, other last
    bits and another order of contacts each (worth.py)."""
    def __init__(self, rows: list[dict[str, str]], runs, members=()):
        self.rows, self.members = rows, [Cell([row], runs) for row in members]
        self.key = (rows[0]["method"], rows[0]["solver"] or rows[0]["variant"])
        # Files are read from the repeat with the median time, so that no single disturbance of the machine shows.
        self.row = sorted(rows, key=lambda r: float(r["processing_s"] or "inf"))[(len(rows) - 1) // 2]
        self.folder = Path(runs) / (self.row.get("folder") or self.row["run"])

    def __getitem__(self, column):
        return self.row[column]

    def knob(self, name):
        """A knob beside k and epsilon as it was given; empty where it was not."""
        return dict(word.split("=", 1) for word in self["knobs"].split()).get(name, "")

    @property
    def step_or_accuracy(self):
        accuracy = self.knob("accuracy")
        return f"to {accuracy} m" if accuracy else self["step"]

    @property
    def way(self):
        """How it steps, in words."""
        return f"accuracy {self.knob('accuracy')} m" if self.knob("accuracy") else f"step {self['step']} s"

    @property
    def finished(self):
        return all(r["finished"] == "true" for r in self.rows)

    @property
    def times(self) -> list[float]:
        return [float(r["processing_s"]) for r in self.rows if r["finished"] == "true" and r["processing_s"]]

    @property
    def seconds(self) -> float:
        """Median processing time of the finished repeats, s; nan where there is none."""
        return statistics.median(self.times or [math.nan])

    @property
    def busy(self):
        """Whether others used the machine during a repeat."""
        return any(r["busy"] == "true" for r in self.rows)

    def error(self, name: str) -> float:
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
        """The limit that cut a repeat, empty where none did: what is to come out the same when made again must not show
        it."""
        return next((r["status"] for r in self.rows if r["status"] in LIMITS), "")

    @property
    def name(self):
        """The method as a reader would say it."""
        parts = [self["method"], self["solver"] if self["method"] != "convex" else "", self["variant"]]
        return " ".join(NAMES.get(p, p)
                        for p in parts if p) + (f", epsilon {self['epsilon']} J" if self["epsilon"] else "")

    @property
    def with_k(self):
        """With the polygon's edges; its step stands in a column of its own."""
        return self.name + (f", k = {self['k']}" if self["k"] else "")

    @property
    def setting(self):
        """The method with all its knobs but its step or accuracy, which stands in a column of its own, and what says
        nothing of the method."""
        beside = ("step", "accuracy", "duration", "record_interval")
        others = [word for word in self["knobs"].split() if word.partition("=")[0] not in beside]
        return ", ".join([self.with_k, *others])

    @property
    def label(self):
        """The method with all its knobs."""
        return self.with_k + (f", {self['knobs']}" if self["knobs"] else "")

    @property
    def command(self):
        """What a reader types to do this run again."""
        return shlex.join(["contactbench", "run", f"{self['scene']}.xml", *Run.of(self.row).flags()])

    def series(self, file, *columns, of=None, most=None):
        """Columns of a file of the run as arrays; empty ones where there is no file or no row."""
        return series(self.folder / file, *columns, of=of, most=most)


class Clock:
    """Another clock. By every second one each time is multiplied by the inverse of what the one before has, so that of
    two times either comes first by one of them; by one others use the machine throughout, by the next nobody does."""
    def __init__(self, draw: int):
        self.draw = draw

    def factor(self, word: str) -> float:
        """From a thousandth to a thousand, as the word says."""
        power = zlib.crc32(f"{self.draw // 2 or ''}{word}".encode()) / 2**32 * 6 - 3
        return 10**(-power if self.draw % 2 else power)

    def turned(self, cell: str, word: str) -> str:
        """A cell as this clock has it: number or answer."""
        if cell.lower() in ("true", "false"):
            answer = "false" if self.draw % 2 else "true"
            return answer if cell.islower() else answer.capitalize()
        try:
            return repr((float(cell) + 1) * self.factor(word))
        except ValueError:
            return cell and "turned"


@functools.lru_cache(maxsize=1)  # who draws asks for body after body
def lines_of(path, *_):
    lines = path.read_text().splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        lines.pop()  # a run that was killed can leave half a row
    return lines


def series(path: Path, *columns: str, of=None, most: int | None = None) -> np.ndarray:
    """Columns of a CSV file as arrays. `of`: only the rows of a body, joint or pair, by its words; `most`: at most
    about so many of them, evenly spaced, and the last."""
    try:
        file = path.stat()
        lines = lines_of(path, file.st_mtime_ns, file.st_size)
    except OSError:
        lines = []
    rows = lines[1:]
    for word in of or ():
        rows = [row for row in rows if f",{word}," in row]
    if not rows:
        return np.empty((len(columns), 0))
    if most and len(rows) > most:
        rows = [rows[i] for i in np.unique(np.linspace(0, len(rows) - 1, most).round().astype(int))]
    head = lines[0].strip().split(",")
    return np.loadtxt(rows, delimiter=",", usecols=[head.index(c) for c in columns], ndmin=2).T


class Runs:
    """A folder with runs.csv and manifest.json, and the folder of its runs. `table` holds the words of runs.csv as they
    are, `ensemble` the rows of ensemble.csv. Runs lie in RESULTS/runs/PROFILE, of one scene in RESULTS/runs."""
    def __init__(self, results, runs=None):
        self.folder, self.whole, self.aside, self.repeat, self.clock = Path(results), True, 0, 0, None
        self.lacking = False  # whether a file was read that others made and this member did not
        self.table = table_of(self.folder / "runs.csv")
        file = self.folder / "ensemble.csv"
        self.ensemble = table_of(file).to_dict("records") if file.exists() else []
        self.manifest = read_json(self.folder / "manifest.json") or {}
        self.profile = self.manifest.get("profile") or "default"
        places = [Path(runs)] if runs else [self.folder / "runs" / self.profile, self.folder / "runs"]
        self.runs = next((place for place in places if place.is_dir()), places[0])

    def cells(self, scene: str | None = None, sweep: str | None = "paper", **wanted: str) -> list[Cell]:
        """Cells in the order of the table: those of a scene (of all), of one sweep file (of all: None), with given
        columns."""
        wanted = wanted if scene is None else {"scene": scene, **wanted}
        asked = (sweep, *sorted(wanted.items()))
        if asked not in self.answered:
            self.answered[asked] = self.found(sweep, wanted)
        return list(self.answered[asked])

    @functools.cached_property
    def answered(self):
        """{what was asked of `cells`: its answer}; a report asks the same a thousand times."""
        return {}

    def found(self, sweep, wanted):
        groups = {}
        for row in self.records:
            if all(row[column] == value
                   for column, value in wanted.items()) and (sweep is None or sweep in row["sweeps"].split()):
                groups.setdefault(tuple(row[c] for c in CELL), []).append(row)
        return [Cell(rows, self.runs, self.members_of.get(key, ())) for key, rows in groups.items()]

    @functools.cached_property
    def records(self):
        """The rows of the table, which nobody changes after."""
        return self.table.to_dict("records")

    @functools.cached_property
    def members_of(self):
        """{cell: rows of its members}."""
        groups = {}
        for row in self.ensemble:
            groups.setdefault(tuple(row[c] for c in CELL), []).append(row)
        return groups

    def seen(self, table, aside=0, repeat=0, clock=None):
        """The same results with another table, without ensemble. `aside`: the member whose other files are taken where
        there are some; `repeat`: the one whose times these are; `clock`: by which these are its times."""
        other = copy.copy(self)
        for of_table in ("records", "members_of", "answered"):
            other.__dict__.pop(of_table, None)
        other.table, other.ensemble, other.whole, other.aside = table, [], False, aside
        other.repeat, other.clock = repeat, clock
        return other

    def read(self, file) -> pd.DataFrame | None:
        """Another table of the results, None where there is none; by another clock what was measured is another, and
        so is all that no member made too: its spread is not known."""
        made = list(self.folder.glob(f"members/*/{file}"))
        path = self.folder / "members" / str(self.aside) / file
        if path not in made:
            path = self.folder / file
            self.lacking |= self.aside > 0 and bool(made)
        if not path.exists():
            return None
        table = table_of(path)
        for column in table if self.clock else ():
            if column.endswith(("_s", "_us")) or column in ("ratio", "busy") or not made and column not in ASKED:
                table[column] = [
                    self.clock.turned(cell, f"{file} {column} {n}") for n, cell in enumerate(table[column])]
        return table

    def missing(self, scene):
        """Why a scene has no run; empty where it has some."""
        if (self.table["scene"] == scene).any():
            return ""
        return self.manifest.get("missing", {}).get(scene, "no run of it is in this profile")
