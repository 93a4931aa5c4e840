"""A frozen stream of contact problems: what one run of a scene met on its way, solved by every method and solver.
Everybody gets the same numbers, so that what a solver costs and errs is seen apart from where its own answers would
have led the simulation.

  scripts/replay.py --out results/replay

One folder a scene, with the tables of scripts/solve_all.py. The run is `convex` at 1e-12 J; its problems are stored
evenly over the simulated time. A scene whose run does not finish is left out with a message, and with it the tables
that an earlier one left.
"""
import shutil
import sys
import tempfile
from pathlib import Path

from . import program, solve_all
from .plan import member_flags

STEP = 1e-3  # s
# Scene, its parameters, simulated seconds, and every how many events one is stored: eight a scene.
STREAMS = (("sliding_box", (), 8, 1000), ("circular_sliding", (), 10, 1250), ("stack", ("boxes=4", ), 1, 125),
           ("mobile_robot", (), 10, 1250), ("grasp", (), 1, 125))


def store(path, scene, sets, duration, every, folder, member):
    """Runs the scene, or a member of its ensemble, and stores its problems in `folder`; what is wrong, if it does not
    finish."""
    ended = program.call(path, "run", f"{scene}.xml", "--method", "convex", "--epsilon", "1e-12", "--step", STEP,
                         "--duration", duration, "--prune", "off", "--record-every", "0", "--save-problems", folder,
                         "--save-every", every, "--out", folder.with_name("run"), "--quiet", *program.settings(sets),
                         *member_flags(member))
    return "" if ended.returncode == 0 else ended.stderr.strip() or "the run did not finish"


def main():
    parser = program.flags(__doc__)
    parser.add_argument("--program", default=program.DEFAULT)
    parser.add_argument("--out", type=Path, default=program.ROOT / "results/replay",
                        help="folder of the tables [results/replay]")
    parser.add_argument("--limit", type=program.positive, default=10,
                        help="seconds for one problem and solver, repeats included [10]")
    parser.add_argument("--only", default="", help="scenes whose name contains this")
    parser.add_argument("--member", type=int, default=0, metavar="N",
                        help="the streams of member N of an ensemble (docs/numbers.md)")
    options = parser.parse_args()
    for scene, sets, duration, every in STREAMS:
        if options.only in scene:
            with tempfile.TemporaryDirectory() as scratch:
                problems, out = Path(scratch) / "problems", options.out / "__".join([scene, *sets]).replace("=", "-")
                fault = store(options.program, scene, sets, duration, every, problems, options.member)
                if fault:
                    print(f"replay: {scene} is left out: {fault}", file=sys.stderr)
                    shutil.rmtree(out, ignore_errors=True)
                    continue
                words = [problems, "--program", options.program, "--limit", options.limit, "--out", out]
                solve_all.main([str(word) for word in words])
