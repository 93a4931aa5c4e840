"""A run to look at: one HTML file that needs nothing else, with bodies, contacts and errors over time (docs/view.md).

  contactbench run stack.xml --method ap --record-contacts --out a
  scripts/view.py a                                   view.html
  scripts/view.py a b --out ab.html                   two runs, side by side or laid over each other
  scripts/view.py a --gltf a.glb                      glTF 2.0 with animation, for Blender and others

Exit codes: 0 written; 1 a run that cannot be drawn, or no three.js.
"""
import base64
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd

from . import gltf, program, references
from .templates import render

THREE = Path("/usr/share/javascript/three")  # Debian's libjs-three
SCRIPTS = ("build/three.min.js", "examples/js/controls/OrbitControls.js")
FRAMES, FEWEST = 400, 10
ROOM = 1_500_000  # bytes that the motion of a scene may take in the page, beside three.js
MODES = ("open", "stick", "slip")
PLACE, IMPULSE = ["px", "py", "pz"], ["rx", "ry", "rz"]
POSE = ["px", "py", "pz", "qx", "qy", "qz", "qw"]  # three.js' and glTF's order of a quaternion
# Of steps.csv: what is drawn over time, its unit, whether over powers of ten.
CURVES = {
    "residual": ("checked residual", "", True), "event_energy_gain": ("energy gain of the events", "J", False),
    "kinetic_energy": ("kinetic energy", "J", False), "max_penetration": ("overlap", "m", True)}


def table(path):
    """A CSV file of a run; a row that a killed run left half is none."""
    try:
        rows = pd.read_csv(path)
    except (OSError, ValueError):
        return pd.DataFrame()
    return rows[rows[rows.columns[-1]].notna() | (rows.index < len(rows) - 1)]


def decimals(shapes):
    """Of a contact's place in m, to which points are told apart: a millimetre, or among shapes below a centimetre a
    tenth of the smallest."""
    solid = shapes.loc[shapes["kind"] != "half_space", ["radius", "hx", "hy", "hz"]]
    sizes = 2 * solid.astype(float).max(axis=1)
    sizes = sizes[sizes > 0]
    return max(3, math.ceil(1 - math.log10(sizes.min()) - 1e-9)) if len(sizes) else 3


def merged(rows, fixed, digits=3):
    """{t: contacts} of the steps that end at column `end`: those of a step's events at one point of a pair as one, with
    the sum of the impulses and the mode of the largest; the impulse is that on what moves, of two on the upper one."""
    rows = rows.assign(size=np.linalg.norm(rows[IMPULSE].to_numpy(float), axis=1))
    keys = ["end", "a", "b", *(rows[p].round(digits) for p in PLACE)]
    some = rows.sort_values("size", kind="stable").groupby(keys, sort=False)
    of = some[[*PLACE, "mode"]].last().assign(**some[IMPULSE].sum())  # on a
    a, b = of.index.get_level_values("a"), of.index.get_level_values("b")
    on_b = a.isin(fixed) | ~b.isin(fixed) & (of["ry"].to_numpy(float) < 0)
    of[IMPULSE] = np.where(on_b, -1, 1)[:, None] * of[IMPULSE].to_numpy(float)
    return dict(tuple(of.groupby(level=0)))


class Motion:
    """A run as it is drawn: poses of its bodies at some moments, its shapes, the contacts of these moments."""
    def __init__(self, folder, label="", frames=FRAMES):
        self.folder, self.summary = Path(folder), program.read_json(Path(folder) / "summary.json") or {}
        self.shapes = table(self.folder / "shapes.csv").fillna("")
        rows = table(self.folder / "trajectory.csv")
        if self.shapes.empty or rows.empty:
            raise program.ProgramError(
                f"{folder}: has no motion with shapes; contactbench run ... --record-contacts --out {folder} makes it")
        self.bodies = list(dict.fromkeys(rows["body"]))
        count = len(rows) // len(self.bodies)
        poses = rows[POSE].to_numpy(float)[:count * len(self.bodies)].reshape(count, -1, 7)
        at = np.unique(np.linspace(0, count - 1, min(count, frames)).round().astype(int))
        self.t, self.poses = rows["t"].to_numpy(float)[::len(self.bodies)][at], poses[at]
        self.steps = table(self.folder / "steps.csv")
        contacts, groups = table(self.folder / "contacts.csv"), {}
        if len(contacts):  # the end of a step is the moment at which its contacts are shown
            ends = pd.Series(np.round(self.steps["t"], 9).values, index=self.steps["step"])
            contacts["end"] = contacts["step"].map(ends)
            fixed = self.shapes.loc[self.shapes["body"] == "", "shape"]
            shown = contacts[contacts["end"].isin(np.round(self.t, 9))]
            groups = merged(shown, fixed, decimals(self.shapes))
        self.contacts = [groups.get(round(t, 9)) for t in self.t]
        self.label = label or self.name

    @property
    def name(self):
        words = [self.summary.get(key) for key in ("method", "solver", "variant")]
        options = self.summary.get("options") or {}
        words += [f"{key} {options[key]:g}" for key in ("k", "epsilon") if options.get(key) is not None]
        return " ".join(word for word in words if word)

    @property
    def scene(self):
        return " ".join([self.summary.get("scenario", ""), *words_of(self.summary.get("parameters") or {})])

    def surfaces(self):
        """The rows of shapes.csv; those of hulls with `faces`, of each its corners x y z, counter-clockwise."""
        rows, hulls = self.shapes.to_dict("records"), table(self.folder / "hulls.csv")
        faces = {}
        if len(hulls):
            for (shape, _), corners in hulls.groupby(["shape", "face"], sort=False):
                faces.setdefault(shape, []).append(corners[["x", "y", "z"]].to_numpy(float).tolist())
        return [row | ({"faces": faces.get(row["shape"], [])} if row["kind"] == "hull" else {}) for row in rows]

    def places(self):
        """{(t, body): place}, as references have them."""
        return {(round(float(t), 9), body): place for t, frame in zip(self.t, self.poses)
                for body, place in zip(self.bodies, frame[:, :3])}

    def bytes_of_a_frame(self):
        most = sum(len(c) for c in self.contacts if c is not None) / len(self.t)
        return 4 / 3 * (28 * len(self.bodies) + 25 * most) + 80

    def curves(self):
        """{what: {t, v}} over time, at most a point a frame."""
        at = np.unique(np.linspace(0, len(self.steps) - 1, min(len(self.steps), FRAMES)).round().astype(int))
        some = self.steps.iloc[at] if len(self.steps) else self.steps
        return {key: curve(some["t"], some[key]) for key in CURVES if key in some}

    def page(self):
        """What the page needs of it."""
        rows = [c for c in self.contacts if c is not None]
        all_of = pd.concat(rows) if rows else pd.DataFrame(columns=[*PLACE, *IMPULSE, "mode"])
        numbers = all_of[[*PLACE, *IMPULSE]].to_numpy(float)
        modes = [MODES.index(mode) for mode in all_of["mode"]]
        return {
            "label": self.label, "status": self.summary.get("status", ""), "bodies": self.bodies,
            "t": numbers_of(self.t), "poses": packed(self.poses, "<f4"), "shapes": self.surfaces(), "contacts": {
                "count": [0 if c is None else len(c) for c in self.contacts], "numbers": packed(numbers, "<f4"),
                "modes": packed(modes, "u1")}, "impulse": largest(numbers[:, 3:]), "curves": self.curves()}


def words_of(parameters):
    return [
        f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}" for name, value in parameters.items()]


def numbers_of(values, digits=6):
    """Numbers as the page holds them; what is none is null."""
    return [float(f"{v:.{digits}g}") if math.isfinite(v) else None for v in values]


def packed(values, kind):
    return base64.b64encode(np.asarray(values).astype(kind).tobytes()).decode()


def curve(t, values):
    return {"t": numbers_of(t), "v": numbers_of(pd.to_numeric(values, errors="coerce"), 4)}


def largest(vectors):
    """What a long arrow stands for: nearly the largest, so that one impact does not make all else a dot."""
    sizes = np.linalg.norm(vectors, axis=1) if len(vectors) else np.zeros(1)
    return float(np.quantile(sizes, 0.98)) or 1.0


def apart(places, reference):
    """Largest distance of a body over time from where the reference has it, at the moments that both have."""
    of = {}
    for key in places.keys() & reference.keys():
        of[key[0]] = max(of.get(key[0], 0.0), math.dist(places[key], reference[key]))
    return curve(sorted(of), pd.Series([of[t] for t in sorted(of)], dtype=float))


def reference_of(path):
    """Places of a run's folder, or of a stored reference's CSV file."""
    path = Path(path)
    file = path / "trajectory.csv" if path.is_dir() else path
    try:
        return references.places(file)
    except (OSError, KeyError) as error:
        raise program.ProgramError(f"--reference {path}: no run and no reference ({error})") from None


def scene_of(folders, reference=None, labels=(), frames=FRAMES, room=ROOM):
    """One scene of the page: one run or two of the same bodies."""
    motions = [Motion(folder, label, frames) for folder, label in zip(folders, [*labels, *[""] * len(folders)])]
    needed = sum(m.bytes_of_a_frame() for m in motions) * len(motions[0].t)
    if needed > room and frames > FEWEST:
        return scene_of(folders, reference, labels, max(FEWEST, int(frames * room / needed)), room)
    curves = {key: list(said) for key, said in CURVES.items()}
    runs = [motion.page() for motion in motions]
    if reference:
        places = reference_of(reference)
        for motion, run in zip(motions, runs):
            run["curves"]["error"] = apart(motion.places(), places)
        curves = {"error": ["distance from the reference", "m", True]} | curves
    elif len(motions) == 2:
        runs[0]["curves"]["error"] = apart(motions[0].places(), motions[1].places())
        curves = {"error": ["distance between the two", "m", True]} | curves
    return {"name": motions[0].scene, "title": motions[0].summary.get("title") or "", "runs": runs, "curves": curves}


def page(scenes):
    """The page of some scenes, each of one run or two."""
    try:
        scripts = [(THREE / name).read_text().replace("</script", "<\\/script") for name in SCRIPTS]
    except OSError:
        raise program.ProgramError(
            f"three.js is not at {THREE}: scripts/setup.sh installs it (Debian's libjs-three)") from None
    data = json.dumps({"scenes": scenes, "modes": MODES}, allow_nan=False).replace("</", "<\\/")
    return render("view.html", scripts=scripts, data=data, title=", ".join(s["name"] for s in scenes))


def main():
    parser = program.flags(__doc__)
    parser.add_argument("runs", nargs="+", metavar="RUN",
                        help="folder of a run with --record-contacts; two of the same scene are compared")
    parser.add_argument("--reference", help="a run, or a stored reference, that errors over time are against")
    parser.add_argument("--label", action="append", default=[],
                        help="what a run is called, in their order [its method]")
    parser.add_argument("--frames", type=int, default=FRAMES, help=f"moments that are kept, at most [{FRAMES}]")
    parser.add_argument("--out", type=Path, default=Path("view.html"), help="the page [view.html]")
    parser.add_argument("--gltf", type=Path, help="write the first run's motion as binary glTF 2.0, and no page")
    options = parser.parse_args()
    if len(options.runs) > 2:
        parser.error("one run, or two to compare")
    if options.frames < 2:
        parser.error("--frames must be at least 2")
    if options.gltf:
        options.gltf.write_bytes(gltf.file_of(Motion(options.runs[0], frames=options.frames)))
    else:
        options.out.write_text(page([scene_of(options.runs, options.reference, options.label, options.frames)]))
    print(options.gltf or options.out)
