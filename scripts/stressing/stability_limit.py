"""The step from which a scene without contacts blows up, found by trying, against the program's own estimate."""
import json
import math
import subprocess
from pathlib import Path

STEPS = 2000      # of a run: a mode that grows by 3.5 % a step is seen
NEARNESS = 0.005  # of the bisection


def measure(program, scene, flags, folder):
    """(measured limit, the program's estimate), both s."""

    def run(step):
        command = [program, "run", str(scene), "--method", "newton", *flags, "--step", repr(step), "--duration", repr(STEPS * step),
                   "--record-every", "0", "--out", str(folder), "--quiet"]
        subprocess.run(command, capture_output=True, check=False)
        return json.loads((Path(folder) / "summary.json").read_text())

    least, most = 1e-7, 1e2
    estimate = run(least)["control"]["largest_stable_step"]
    while most > least * (1 + NEARNESS):
        middle = math.sqrt(least * most)
        status = run(middle)["status"]
        if status not in ("ok", "energy_blowup"):
            raise ValueError(f"{status} at a step of {middle:g} s")
        least, most = (middle, most) if status == "ok" else (least, middle)
    return math.sqrt(least * most), estimate
