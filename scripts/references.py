#!/usr/bin/env python3
"""Certified references of scenes without an exact answer: where the bodies are, from runs at 1/64 of the scene's step at the
tightest tolerance, kept only where two methods agree. Where they do not, the reference is `missing`, and the reason is stored.

  scripts/references.py                                the scenes of the project, those that are not there yet or have changed
  scripts/references.py my.xml --duration 2 --out DIR  one scene
"""
import argparse
import csv
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import interpreter

interpreter.need("tomllib")
from sweeping import reference  # noqa: E402
from sweeping.plan import scene_names  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
# Scenes and simulated seconds: as long as 64 times the steps take about a quarter of a minute a run.
SCENES = (("mobile_robot", 10), ("mobile_robot_caster", 10), ("grasp", 1), ("urdf_arm", 3))
FINER = 64
ENOUGH = 1e-9  # m: closer than this, two methods agree wherever the bodies go
SHARE = 0.1    # of the error that the scene's own step makes: what two methods may differ by at most
FIRST = ("--method", "convex", "--epsilon", "1e-12")
SECOND = (("--method", "ap", "--solver", "lemke"), ("--method", "ap", "--solver", "path"),
          ("--method", "newton", "--variant", "stick-tested"))


class MakeError(Exception):
    """The program refuses the scene: its message."""


class Maker:
    """Runs of one scene in a scratch folder."""

    def __init__(self, program, file, sets, scratch, limit):
        self.program, self.file, self.sets, self.scratch, self.limit = program, str(file), sets, Path(scratch), limit

    def words(self, method, *more):
        return ["run", self.file, *method, *more, *(word for pair in self.sets for word in ("--set", pair))]

    def run(self, method, step, duration):
        """Summary, motion and command of a run; the summary's status says what became of it."""
        out = self.scratch / "__".join([*method[1::2], str(step)])
        flags = ["--step", repr(step)] if step else []
        flags += ["--duration", repr(duration)] if duration else []
        every = round(reference.INTERVAL / step) if step else 1
        words = self.words(method, *flags)
        ended = subprocess.run([self.program, *words, "--record-every", str(every), "--time-limit", f"{self.limit:g}", "--quiet",
                                "--out", str(out)], capture_output=True, text=True)
        if ended.returncode not in (0, 3):
            raise MakeError(ended.stderr.strip() or f"{self.program} ended without a word")
        summary = json.loads((out / "summary.json").read_text())
        command = ["contactbench", *words]
        command[2] = Path(self.file).name
        motion = reference.places(out / "trajectory.csv") if summary["finished"] else None
        return summary, motion, " ".join(command)


def good(summary):
    return summary["status"] == "ok" and summary["residuals"]["false_claims"] == 0


def certify(maker, duration):
    """What is stored of a scene: (about, motion), motion None where no two methods agree."""
    coarse, own, _ = maker.run(FIRST, None, duration)  # at the scene's own step, and length where none is asked for
    step, duration = coarse["options"]["step"], coarse["options"]["duration"]
    about = {"scene": coarse["scenario"], "parameters": " ".join(maker.sets), "scene_digest": reference.digest(*reference.files_of(maker.program, maker.file, " ".join(maker.sets))),
             "accepted": False, "reason": "", "step": step / FINER, "duration": duration, "uncertainty_m": None,
             "versions": coarse["versions"], "machine": coarse["machine"]}

    def missing(why):
        return about | {"reason": why}, None
    first, motion, command = maker.run(FIRST, step / FINER, duration)
    half, halfway, _ = maker.run(FIRST, 2 * step / FINER, duration)
    about["runs"] = [{"command": command, "status": first["status"], "law_residual_max": first["residuals"]["law_max"]}]
    if not good(first) or not half["finished"]:
        return missing(f"convex at 1/{FINER} of the step: {first['status']}" + (f" ({first['reason']})" if first["reason"] else ""))
    # Of first order, the step leaves of the reference what halving it changed.
    about["step_difference_m"] = reference.apart(motion, halfway)
    about["error_of_own_step_m"] = reference.apart(motion, own) if own else None
    enough = max(ENOUGH, SHARE * (about["error_of_own_step_m"] or 0))
    tried = []
    for method in SECOND:
        second, other, command = maker.run(method, step / FINER, duration)
        agreement = reference.apart(motion, other) if good(second) else None
        about["runs"].append({"command": command, "status": second["status"], "law_residual_max": second["residuals"]["law_max"],
                              "agreement_m": agreement})
        if agreement is not None and agreement <= enough:
            return about | {"accepted": True, "uncertainty_m": max(agreement, about["step_difference_m"])}, motion
        tried.append(f"{' '.join(method[1::2])}: " + (f"{agreement:.2g} m apart" if agreement is not None else second["status"]))
    return missing(f"no second method within {enough:.2g} m of convex: " + ", ".join(tried))


def store(folder, about, motion):
    folder.mkdir(parents=True, exist_ok=True)
    name = reference.name_of(about["scene"], about["parameters"])
    if motion is not None:
        with open(folder / f"{name}.csv", "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(("t", "body", "px", "py", "pz"))
            writer.writerows((repr(t), body, *map(repr, place)) for (t, body), place in motion.items())
    (folder / f"{name}.json").write_text(json.dumps(about, indent=1) + "\n")


def make(program, file, sets, duration, folder, limit, again=False):
    """The reference of a scene (reference.Reference), made where it is not there yet."""
    known = reference.read(folder, Path(file).stem, " ".join(sets), reference.files_of(program, file, " ".join(sets)))
    if known and not again and duration in (None, known.about["duration"]):
        return known
    with tempfile.TemporaryDirectory() as scratch:
        about, motion = certify(Maker(program, file, sets, scratch, limit), duration)
    store(Path(folder), about, motion)
    return reference.Reference(about, motion)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", help="a scene's file, or the name of one that comes with the program [all of the project's]")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the scene")
    parser.add_argument("--duration", type=float, help="simulated time, s [the scene's]")
    parser.add_argument("--program", default=str(ROOT / "build/bin/contactbench"))
    parser.add_argument("--out", type=Path, default=ROOT / "results/references", help="folder of the references [results/references]")
    parser.add_argument("--limit", type=float, default=300, help="seconds for one run [300]")
    parser.add_argument("--again", action="store_true", help="make those that are there once more")
    options = parser.parse_args()
    if not shutil.which(options.program):
        sys.exit(f"references: {options.program} is no program; --program names another one")
    listed = scene_names(json.loads(subprocess.run([options.program, "list", "--json"], check=True, capture_output=True, text=True).stdout))
    wanted = [(options.scene, options.duration)] if options.scene else SCENES
    for scene, duration in wanted:
        name = scene.removesuffix(".xml")
        file = scene if Path(scene).is_file() else listed[name]["file"] if name in listed else sys.exit(f"references: no scene {scene}")
        try:
            made = make(options.program, file, options.set, duration, options.out, options.limit, options.again).about
        except MakeError as error:
            sys.exit(f"references: {error}")
        print(f"{name}, {made['duration']:g} s at a step of {made['step']:.3g} s: " +
              (f"to {made['uncertainty_m']:.2g} m" if made["accepted"] else f"missing ({made['reason']})"), flush=True)


if __name__ == "__main__":
    main()
