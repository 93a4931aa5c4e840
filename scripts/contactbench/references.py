"""Certified references of scenes without an exact answer: where the bodies are, from runs at 1/64 of the scene's step
at the tightest tolerance, kept only where two methods agree. Where they do not, the reference is `missing`, and the
reason is stored.

  scripts/references.py                                the scenes of the project, those not there yet or changed
  scripts/references.py my.xml --duration 2 --out DIR  one scene
"""
import csv
import hashlib
import json
import math
import shutil
import sys
import tempfile
from pathlib import Path

from . import program

INTERVAL = 0.1  # s, between the moments of a reference
ERROR = "certified_linf_m"
SAID = ("accepted", "reason", "step", "duration", "until", "uncertainty_m")  # of `about`, what the manifest of a sweep repeats
# Scenes and simulated seconds: as long as 64 times the steps take about a quarter of a minute a run.
SCENES = (("mobile_robot", 10), ("mobile_robot_caster", 10), ("grasp", 1), ("urdf_arm", 3))
FINER = 64
LESS_FINE = (64, 16, 4)  # where the limit of a run leaves no time for more, in this order; certified by the first alone
AGREED = "agreed_linf_m"  # as ERROR, but for the time alone for which two methods agree
ENOUGH = 1e-9  # m: closer than this, two methods agree wherever the bodies go
SHARE = 0.1  # of the error that the scene's own step makes: what two methods may differ by at most
FIRST = ("--method", "convex", "--epsilon", "1e-12")
SECOND = (("--method", "ap", "--solver", "lemke"), ("--method", "ap", "--solver", "path"),
          ("--method", "newton", "--variant", "stick-tested"))


def digest(*paths):
    return hashlib.sha256(b"".join(Path(path).read_bytes() for path in paths)).hexdigest()[:16]


def name_of(scene, parameters):
    return "__".join([scene, *parameters.replace("=", "-").split()])


def places(path):
    """{(t, body): place} of a trajectory.csv or a stored reference; rounding of n h does not tell moments apart, and
    half a row, which a program that died leaves, is none."""
    with open(path, newline="") as file:
        return {(round(float(row["t"]), 9), row["body"]): tuple(float(row[c]) for c in ("px", "py", "pz"))
                for row in csv.DictReader(file) if row["pz"]}


def agreement(a, b, enough):
    """Until when two motions stay within `enough` of each other, s: 0 where they are not for a moment; and the distance
    by then, m."""
    worst, until = 0.0, (0.0, 0.0)
    for t in sorted({t for t, _ in a.keys() & b.keys()}):
        worst = max([worst, *(math.dist(a[key], b[key]) for key in a.keys() & b.keys() if key[0] == t)])
        if worst > enough:
            break
        until = t, worst
    return until


def apart(a, b):
    """Largest distance of a body between two motions over the moments that both have, m; None where those do not reach
    the end of the shorter one, or there are none."""
    common = a.keys() & b.keys()
    if not common or max(t for t, _ in common) < min(max(t for t, _ in some) for some in (a, b)):
        return None
    return max(math.dist(a[key], b[key]) for key in common)


class Reference:
    """A stored reference: `about` (NAME.json) is how it was made, or why there is none; `motion` (NAME.csv) its places
    for as long as it holds (`until`), None where it does not."""
    def __init__(self, about, motion):
        self.about, self.motion = about, motion

    @property
    def name(self):
        """Of the error against it."""
        return ERROR if self.about["accepted"] else AGREED

    def error(self, duration, trajectory):
        """Largest distance of a run's bodies from it, m; None for a run of another length, or one without its
        moments."""
        if self.motion is None or duration != self.about["duration"]:
            return None
        try:
            return apart(self.motion, places(trajectory))
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def store(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        name = name_of(self.about["scene"], self.about["parameters"])
        if self.motion is not None:
            lines = [f"{t!r},{body},{','.join(map(repr, place))}\n" for (t, body), place in self.motion.items()]
            (folder / f"{name}.csv").write_text("t,body,px,py,pz\n" + "".join(lines))
        (folder / f"{name}.json").write_text(json.dumps(self.about, indent=1) + "\n")


def read(folder, scene, parameters, files):
    """The reference of a scene with its parameters; None where there is none, or one of the scene's files is another
    since."""
    name = name_of(scene, parameters)
    try:
        about = json.loads((Path(folder) / f"{name}.json").read_text())
        if about["scene_digest"] != digest(*files):
            return None
        return Reference(about, places(Path(folder) / f"{name}.csv") if about["accepted"] or about.get("until") else None)
    except (OSError, ValueError, KeyError):
        return None


class Maker:
    """Runs of one scene in a scratch folder."""
    def __init__(self, path, file, sets, scratch, limit):
        self.program, self.file, self.sets, self.scratch, self.limit = path, str(file), sets, Path(scratch), limit

    def run(self, method, step, duration):
        """Summary, motion and command of a run; the summary's status says what became of it."""
        out = self.scratch / "__".join([*method[1::2], str(step)])
        flags = ["--step", repr(step)] if step else []
        flags += ["--duration", repr(duration)] if duration else []
        words = ["run", self.file, *method, *flags, *program.settings(self.sets)]
        every = round(INTERVAL / step) if step else 1
        ended = program.call(self.program, *words, "--record-every", every, "--time-limit", f"{self.limit:g}",
                             "--quiet", "--out", out)
        if ended.returncode not in (0, 3):
            raise program.ProgramError(ended.stderr.strip() or f"{self.program} ended without a word")
        summary = json.loads((out / "summary.json").read_text())
        motion = places(out / "trajectory.csv") if summary["finished"] else None
        return summary, motion, " ".join(["contactbench", "run", Path(self.file).name, *words[2:]])


def good(summary):
    return summary["status"] == "ok" and summary["residuals"]["false_claims"] == 0


def took(summary):
    """Processing time of a run, s."""
    return sum(summary.get("time", {}).get(f"{part}_s") or 0.0 for part in ("dynamics", "collision", "assembly", "solve"))


def finest(coarse, limit):
    """How much finer than the scene's own step a run may be that has to come back within the limit, s; None where not
    even the least."""
    return next((finer for finer in LESS_FINE if finer * took(coarse) <= limit), None)


def certify(maker, duration):
    """The reference of a scene: of the whole run where two methods agree, else for as long as they do, else without a
    motion."""
    coarse, own, _ = maker.run(FIRST, None, duration)  # at the scene's own step, and length where none is asked for
    step, duration = coarse["options"]["step"], coarse["options"]["duration"]
    parameters = " ".join(maker.sets)
    about = {
        "scene": coarse["scenario"], "parameters": parameters,
        "scene_digest": digest(*program.files_of(maker.program, maker.file, parameters)), "accepted": False,
        "reason": "", "own_step": step, "took_s": took(coarse), "step": step / FINER, "duration": duration, "until": None, "uncertainty_m": None,
        "versions": coarse["versions"], "machine": coarse["machine"]}
    finer = finest(coarse, maker.limit)
    if not finer:
        return Reference(about | {"reason": f"a run at 1/{LESS_FINE[-1]} of the step takes too long"}, None)
    about["step"] = step / finer
    first, motion, command = maker.run(FIRST, step / finer, duration)
    half, halfway, _ = maker.run(FIRST, 2 * step / finer, duration)
    about["runs"] = [{"command": command, "status": first["status"], "law_residual_max": first["residuals"]["law_max"]}]
    if not good(first) or not half["finished"]:
        because = f" ({first['reason']})" if first["reason"] else ""
        why = f"convex at 1/{finer} of the step: {first['status']}{because}"
        return Reference(about | {"reason": why}, None)
    # Of first order, the step leaves of the reference what halving it changed.
    about["step_difference_m"] = apart(motion, halfway)
    about["error_of_own_step_m"] = apart(motion, own) if own else None
    enough = max(ENOUGH, SHARE * (about["error_of_own_step_m"] or 0))
    tried, longest = [], (0.0, 0.0)
    for method in SECOND:
        second, other, command = maker.run(method, step / finer, duration)
        distance = apart(motion, other) if good(second) else None
        about["runs"].append({
            "command": command, "status": second["status"], "law_residual_max": second["residuals"]["law_max"],
            "agreement_m": distance})
        if distance is not None and distance <= enough and finer == FINER:
            return Reference(
                about | {
                    "accepted": True, "until": duration, "uncertainty_m": max(distance, about["step_difference_m"])},
                motion)
        if other and good(second):
            longest = max(longest, agreement(motion, other, enough))
        tried.append(f"{' '.join(method[1::2])}: " +
                     (f"{distance:.2g} m apart" if distance is not None else second["status"]))
    why = f"no second method within {enough:.2g} m of convex" if finer == FINER else f"at 1/{finer} of the step only"
    about["reason"] = f"{why}: " + ", ".join(tried)
    until, distance = longest
    if until <= 0:
        return Reference(about, None)
    # What halving the step changes is of the same time.
    motion = {key: place for key, place in motion.items() if key[0] <= until}
    differ = apart(motion, {key: place for key, place in halfway.items() if key[0] <= until})
    return Reference(about | {"until": until, "uncertainty_m": max(distance, differ)}, motion)


def make(path, file, sets, duration, folder, limit, again=False):
    """The reference of a scene, made by the program `path` where it is not there yet."""
    known = read(folder, Path(file).stem, " ".join(sets), program.files_of(path, file, " ".join(sets)))
    if known and not again and duration in (None, known.about["duration"]):
        return known
    with tempfile.TemporaryDirectory() as scratch:
        made = certify(Maker(path, file, sets, scratch, limit), duration)
    made.store(Path(folder))
    return made


def main():
    parser = program.flags(__doc__)
    parser.add_argument("scene", nargs="?",
                        help="a scene's file, or the name of one that comes with the program [all of the project's]")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the scene")
    parser.add_argument("--duration", type=float, help="simulated time, s [the scene's]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, default=program.ROOT / "results/references",
                        help="folder of the references [results/references]")
    parser.add_argument("--limit", type=float, default=300, help="seconds for one run [300]")
    parser.add_argument("--again", action="store_true", help="make those that are there once more")
    options = parser.parse_args()
    if not shutil.which(options.program):
        sys.exit(f"references: {options.program} is no program; --program names another one")
    listed = program.scenes_of(program.listed(options.program))
    for scene, duration in [(options.scene, options.duration)] if options.scene else SCENES:
        name = scene.removesuffix(".xml")
        if not Path(scene).is_file() and name not in listed:
            sys.exit(f"references: no scene {scene}")
        file = scene if Path(scene).is_file() else listed[name]["file"]
        made = make(options.program, file, options.set, duration, options.out, options.limit, options.again).about
        found = f"to {made['uncertainty_m']:.2g} m" if made["accepted"] else f"missing ({made['reason']})"
        found += f"; agreed until {made['until']:g} s" if made["until"] and not made["accepted"] else ""
        print(f"{name}, {made['duration']:g} s at a step of {made['step']:.3g} s: {found}", flush=True)
