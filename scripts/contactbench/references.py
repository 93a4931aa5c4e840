"""Certified references of scenes without an exact answer: where the bodies are, from runs by `--accuracy`
(docs/stepping.md), kept as long as two methods agree. Where they do not, the reference is `missing`, and the reason is
stored.

  scripts/references.py                                the scenes of the project, those not there yet or changed
  scripts/references.py my.xml --duration 2 --out DIR  one scene
"""
import csv
import json
import math
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

from . import program
from .program import digest

INTERVAL = 0.1  # s, between the moments of a reference
ERROR = "certified_linf_m"
# Of `about`, what the manifest of a sweep repeats.
SAID = ("accepted", "reason", "accuracy_m", "duration", "until", "uncertainty_m")
# Scenes and simulated seconds.
SCENES = (("mobile_robot", 70), ("mobile_robot_caster", 70), ("grasp", 25), ("urdf_arm", 3))
WANTED = (1e-8, 1e-6)  # m: accuracies, the next where the one before comes to nothing
COARSER = 10  # times the accuracy: what a run with that is off by is more than what the reference is
SHARE = 0.1  # of the error that the scene's own step makes: what two methods may differ by at most
FIRST = ("--method", "convex")
SECOND = (("--method", "coulomb"), ("--method", "ap", "--solver", "lemke"), ("--method", "ap", "--solver", "path"))


def name_of(scene, parameters):
    """Of its files; pi/4 is a value, as in the name of a run."""
    return "__".join([scene, *parameters.replace("=", "-").split()]).replace("/", ":")


def places(path):
    """{(t, body): place} of a trajectory.csv or a stored reference; rounding of n h does not tell moments apart, and
    half a row, which a program that died leaves, is none."""
    with open(path, newline="") as file:
        return {(round(float(row["t"]), 9), row["body"]): tuple(float(row[c]) for c in ("px", "py", "pz"))
                for row in csv.DictReader(file) if row["pz"]}


def common(a, b):
    """The moments that two motions share, of all bodies."""
    return sorted(a.keys() & b.keys())


def apart(a, b):
    """Largest distance of a body between two motions over the moments that both have, m; None where those do not reach
    the end of the shorter one, or there are none."""
    keys = common(a, b)
    if not keys or keys[-1][0] < min(max(t for t, _ in some) for some in (a, b)):
        return None
    return max(math.dist(a[key], b[key]) for key in keys)


def agree_until(a, b, enough):
    """The last moment up to which no body of two motions is further apart than `enough` (m); None where there is none
    after the start."""
    last = None
    for key in common(a, b):
        if math.dist(a[key], b[key]) > enough:
            return next((t for t, _ in reversed(common(a, b)) if 0 < t < key[0]), None)
        last = key[0]
    return last or None


def up_to(motion, t):
    return {key: place for key, place in motion.items() if key[0] <= t}


class Reference:
    """A stored reference: `about` (NAME.json) is how it was made, or why there is none; `motion` (NAME.csv) its places,
    None where it was not accepted."""
    def __init__(self, about, motion):
        self.about, self.motion = about, motion

    def error(self, duration, trajectory):
        """Largest distance of a run's bodies from it, m; None for a run that goes on longer than it, or one without
        its moments."""
        if self.motion is None or round(duration, 9) > self.about["until"]:  # a moment, as places() has them
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
        if about["scene_digest"] != digest(*files) or "until" not in about:  # of other files, or of an older program
            return None
        return Reference(about, places(Path(folder) / f"{name}.csv") if about["accepted"] else None)
    except (OSError, ValueError, KeyError):
        return None


class Maker:
    """Runs of one scene in a scratch folder."""
    def __init__(self, path, file, sets, scratch, limit):
        self.program, self.file, self.sets, self.scratch, self.limit = path, str(file), sets, Path(scratch), limit

    def run(self, method, accuracy, duration):
        """Summary, motion and command of a run to an accuracy, at the scene's own step where that is None; the
        summary's status says what became of it."""
        out = self.scratch / "__".join([*method[1::2], str(accuracy)])
        flags = ["--accuracy", repr(accuracy), "--record-interval", repr(INTERVAL)] if accuracy else []
        flags += ["--duration", repr(duration)] if duration else []
        words = ["run", self.file, *method, *flags, *program.settings(self.sets)]
        ended = program.call(self.program, *words, "--time-limit", f"{self.limit:g}", "--quiet", "--out", out)
        if ended.returncode not in (0, 3):
            raise program.ProgramError(ended.stderr.strip() or f"{self.program} ended without a word")
        summary = json.loads((out / "summary.json").read_text())
        motion = None
        if summary["finished"]:
            motion = places(out / "trajectory.csv")
            end = max((t for t, _ in motion), default=0)  # which need not be one of the moments
            motion = {
                key: place for key, place in motion.items()
                if key[0] == end or abs(key[0] - INTERVAL * round(key[0] / INTERVAL)) < 1e-6 * INTERVAL}
        return summary, motion, shlex.join(["contactbench", "run", Path(self.file).name, *words[2:]])


def good(summary):
    return summary["status"] == "ok" and summary["residuals"]["false_claims"] == 0


def said(method, summary, more=""):
    because = f" ({summary['reason']})" if summary["reason"] else ""
    return f"{' '.join(method[1::2])}: {more or summary['status'] + because}"


def certify(maker, duration):
    """The reference of a scene, without a motion where no two methods agree."""
    coarse, own, _ = maker.run(FIRST, None, duration)  # at the scene's own step, and length where none is asked for
    asked, duration = duration, coarse["options"]["duration"]
    # Whole steps may end beyond the duration, where the runs to an accuracy have no moment.
    own = own and up_to(own, round(duration, 9))
    parameters = " ".join(maker.sets)
    about = {
        "scene": coarse["scenario"], "parameters": parameters,
        "scene_digest": digest(*program.files_of(maker.program, maker.file, parameters)), "accepted": False,
        "reason": "", "own_step": coarse["options"]["step"], "took_s": coarse["time"]["total_s"], "accuracy_m": None,
        "duration": duration, "asked_s": asked, "until": None, "uncertainty_m": None, "versions": coarse["versions"],
        "machine": coarse["machine"], "runs": []}
    reasons = []
    for wanted in WANTED:
        found = at_accuracy(maker, about, wanted, own)
        if found.about["accepted"]:
            return found
        reasons.append(f"to {wanted:g} m: {found.about['reason']}")
        about["runs"] = found.about["runs"]
    return Reference(about | {"reason": "; ".join(reasons)}, None)


def at_accuracy(maker, about, wanted, own):
    """The reference by runs to one accuracy. `own`: the motion at the scene's own step, or None."""
    about, duration = about | {"accuracy_m": wanted, "runs": [*about["runs"]]}, about["duration"]

    def run(method, accuracy):
        summary, motion, command = maker.run(method, accuracy, duration)
        estimate = (summary.get("accuracy") or {}).get("estimated_error_m")
        about["runs"].append({
            "command": command, "status": summary["status"], "law_residual_max": summary["residuals"]["law_max"],
            "estimated_error_m": estimate, "seconds": summary["time"]["total_s"]})
        return summary, motion if good(summary) else None

    first, motion = run(FIRST, wanted)
    if motion is None:
        return Reference(about | {"reason": said(FIRST, first)}, None)
    _, coarser = run(FIRST, COARSER * wanted)
    about["error_of_own_step_m"] = apart(motion, own) if own else None
    enough = max(COARSER * wanted, SHARE * (about["error_of_own_step_m"] or 0))
    tried, best = [], (0, None, "")
    for method in SECOND:
        second, other = run(method, wanted)
        until = agree_until(motion, other, enough) if other else None
        about["runs"][-1]["agree_until_s"] = until
        tried.append(said(method, second, other and f"apart by more than {enough:.2g} m from {until or 0:g} s on"))
        if until and until > best[0]:
            best = until, other, tried[-1]
        if until and until >= duration * (1 - 1e-9):
            break
    until, other, why = best
    if not until or coarser is None:
        return Reference(about | {"reason": "no second method agrees with convex: " + ", ".join(tried)}, None)
    motion = up_to(motion, until)
    unsure = max(apart(motion, up_to(some, until)) for some in (other, coarser))
    about |= {"accepted": True, "until": until, "uncertainty_m": unsure}
    return Reference(about | {"reason": "" if until >= duration * (1 - 1e-9) else why}, motion)


def make(path, file, sets, duration, folder, limit, again=False):
    """The reference of a scene, made by the program `path` where it is not there yet. Without a duration of the scene's
    own: one that was asked for another time is none."""
    known = read(folder, Path(file).stem, " ".join(sets), program.files_of(path, file, " ".join(sets)))
    asked = known and known.about.get("asked_s")
    if known and not again and (duration == known.about["duration"] or duration is None and asked is None):
        return known
    with tempfile.TemporaryDirectory() as scratch:
        made = certify(Maker(path, file, sets, scratch, limit), duration)
    made.store(Path(folder))
    return made


def main():
    parser = program.flags(__doc__)
    parser.add_argument("scene", nargs="?",
                        help="a scene's file, or the name of one that comes with the program [all of the project's]")
    parser.add_argument("--set", action="append", default=[], type=program.setting, metavar="NAME=VALUE",
                        help="a parameter of the scene")
    parser.add_argument("--duration", type=program.positive, help="simulated time, s [the scene's]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, default=program.ROOT / "results/references",
                        help="folder of the references [results/references]")
    parser.add_argument("--limit", type=program.positive, default=300, help="seconds for one run [300]")
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
        print(f"{name}, {made['until'] or made['duration']:g} of {made['duration']:g} s: {found}", flush=True)
