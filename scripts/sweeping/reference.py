"""Certified references: where the bodies of a scene are at moments a fixed interval apart, from runs at a step/64 on which two
methods agree (scripts/references.py makes them), and how far a run is from that. NAME.csv holds the places, NAME.json how they
were made, or why there are none."""
import csv
import functools
import hashlib
import json
import math
import subprocess
from pathlib import Path

INTERVAL = 0.1  # s, between the moments of a reference
ERROR = "certified_linf_m"
SAID = ("accepted", "reason", "step", "duration", "uncertainty_m")  # of `about`, what the manifest of a sweep repeats


@functools.cache
def files_of(program, file, parameters):
    """The files that a scene reads, of which the program knows: its own and those of its robots. Its own where it is refused."""
    sets = (word for pair in parameters.split() for word in ("--set", pair))
    ended = subprocess.run([program, "check", str(file), "--files", *sets], capture_output=True, text=True)
    return tuple(ended.stdout.splitlines()) if ended.returncode == 0 else (str(file),)


def digest(*paths):
    sha = hashlib.sha256()
    for path in paths:
        sha.update(Path(path).read_bytes())
    return sha.hexdigest()[:16]


def name_of(scene, parameters):
    return "__".join([scene, *parameters.replace("=", "-").split()])


def places(path):
    """{(t, body): place} of a trajectory.csv or a stored reference; rounding of n h does not tell moments apart, and half a row,
    which a program that died leaves, is none."""
    with open(path, newline="") as file:
        return {(round(float(row["t"]), 9), row["body"]): tuple(float(row[c]) for c in ("px", "py", "pz"))
                for row in csv.DictReader(file) if row["pz"]}


def apart(a, b):
    """Largest distance of a body between two motions over the moments that both have, m; None where those do not reach the end of
    the shorter one, or there are none."""
    common = a.keys() & b.keys()
    if not common or max(t for t, _ in common) < min(max(t for t, _ in some) for some in (a, b)):
        return None
    return max(math.dist(a[key], b[key]) for key in common)


class Reference:
    """A stored reference: `about` is its JSON, `motion` its places; None where it was not accepted."""

    def __init__(self, about, motion):
        self.about, self.motion = about, motion

    def error(self, duration, trajectory):
        """Largest distance of a run's bodies from it, m; None for a run of another length, or one without its moments."""
        if self.motion is None or duration != self.about["duration"]:
            return None
        try:
            return apart(self.motion, places(trajectory))
        except (OSError, ValueError, KeyError, TypeError):
            return None


def read(folder, scene, parameters, files):
    """The reference of a scene with its parameters; None where there is none, or one of the scene's files is another since."""
    name = name_of(scene, parameters)
    try:
        about = json.loads((Path(folder) / f"{name}.json").read_text())
        if about["scene_digest"] != digest(*files):
            return None
        return Reference(about, places(Path(folder) / f"{name}.csv") if about["accepted"] else None)
    except (OSError, ValueError, KeyError):
        return None
