"""A first picture of a scene: runs it with each method and draws how far its bodies move, with what energy, and at what
cost.

  scripts/picture.py sticking_box                                  picture.png, in some seconds
  scripts/picture.py my.xml --method ap --method convex --out my.png
"""
import json
import math
import shlex
import tempfile
from itertools import accumulate
from pathlib import Path

from . import program
from .gather import PARTS
from .looks import LOOKS, legend, plt
from .runs import series


def run(options, method, out):
    """One run; its summary, whatever it ended with."""
    flags = ["--method", method, "--time-limit", f"{options.limit:g}", *program.settings(options.set)]
    flags += ["--duration", f"{options.duration:.12g}"] if options.duration else []
    words = program.run_words(options.program, options.scene, flags, out)
    print(shlex.join(words), flush=True)
    try:
        ended = program.call(*words)
    except OSError as error:
        raise program.ProgramError(
            f"{options.program}: {error.strerror}; scripts/build.sh builds it, --program names another one") from None
    if ended.returncode not in (0, 3):
        raise program.ProgramError(ended.stderr.strip())
    return json.loads((out / "summary.json").read_text())


def displacement(out):
    """Times (s) and the largest distance (m) of a body from where it began."""
    start, far = {}, {}
    names = [line.split(",")[1] for line in (out / "trajectory.csv").read_text().splitlines()[1:]]
    for name, t, *place in zip(names, *series(out / "trajectory.csv", "t", "px", "py", "pz")):
        far[t] = max(far.get(t, 0.0), math.dist(place, start.setdefault(name, place)))
    return list(far), list(far.values())


def draw(options, folder):
    figure, panels = plt.subplots(3, 1, figsize=(7, 7), sharex=True)
    looks = {method: (name, colour) for (method, _), (name, colour, _) in reversed(LOOKS.items())}
    title = options.scene
    for method in options.method:
        summary = run(options, method, folder / method)
        title = f"{summary['scenario']}: {summary.get('title', '')}"
        name, colour = looks.get(method, (method, None))
        style = {"label": name + ("" if summary["status"] == "ok" else f" ({summary['status']})"), "color": colour}
        panels[0].plot(*displacement(folder / method), **style)
        times, energy, *parts = series(folder / method / "steps.csv", "t", "kinetic_energy", *PARTS)
        panels[1].plot(times, energy, **style)
        panels[2].plot(times, list(accumulate(sum(parts))), **style)
    for panel, label in zip(panels, ("farthest from its start, m", "kinetic energy, J", "processing time so far, s")):
        panel.set_ylabel(label)
    panels[0].set_title(title)
    panels[2].set_xlabel("simulated time, s")
    figure.tight_layout()
    legend(figure, panels[0].get_lines(), columns=4)
    figure.savefig(options.out, bbox_inches="tight")


def main():
    parser = program.flags(__doc__)
    parser.add_argument("scene", help="a scene's file, or the name of one that comes with the program")
    parser.add_argument("--method", action="append", default=[], help="may be repeated [newton, mirtich, ap, convex]")
    parser.add_argument("--set", action="append", default=[], type=program.setting, metavar="NAME=VALUE",
                        help="a parameter of the scene")
    parser.add_argument("--duration", type=program.positive, help="simulated time, s [the scene's]")
    parser.add_argument("--limit", type=program.positive, default=10,
                        help="seconds that a run may take; what is done by then is drawn [10]")
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, default=Path("picture.png"), help="PNG, SVG or PDF [picture.png]")
    options = parser.parse_args()
    options.method = options.method or ["newton", "mirtich", "ap", "convex"]
    if not options.scene.endswith(".xml"):
        options.scene += ".xml"
    with tempfile.TemporaryDirectory() as folder:
        draw(options, Path(folder))
    print(options.out)
