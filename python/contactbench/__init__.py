"""Contact models for rigid bodies, from Python: docs/python.md.

    import contactbench as cb
    p = cb.Problem.read("problem.hdf5")               # or Problem(M=, J=, v=, mu=), Problem(W=, q=, mu=)
    a = cb.solve(p, "ap", k=8)                        # a.impulses, a.status, a.residual, ...
    cb.judge(p, a.impulses, "newton")                 # the referee, whoever answered
    r = cb.run("stack.xml", "convex", duration=0.5)   # r.t, r.position, r.status, ...
    for p in cb.problems("stack.xml", "ap"): ...      # the problems that a run meets

Units are SI; impulses N s and velocities m/s, (nc, 3), n, t1, t2 of each contact. What is wrong with an argument is an
Error in one line; how an answer or a run ended is its `status` and `reason`, never an exception.
"""
import json as _json
import os as _os

from ._core import Answer, Error, Problem, judge, laws, methods, solve, version_line, __version__
from . import _core

__all__ = ["Answer", "Error", "Problem", "Run", "judge", "laws", "methods", "performance_profile", "problems", "run", "scenes",
           "solve"]


def _scenes_folder():
    """Of an installed module; scenes of the source tree are found without."""
    here = _os.path.dirname(_os.path.abspath(__file__))
    for _ in range(6):
        here = _os.path.dirname(here)
        folder = _os.path.join(here, "share", "contactbench", "scenarios")
        if _os.path.isdir(folder):
            return folder
    return None


def scenes():
    """Paths of the scenes that come with the program."""
    folder = _scenes_folder()
    if not folder:
        return _core.bundled()
    return sorted(_os.path.join(folder, name) for name in _os.listdir(folder) if name.endswith(".xml"))


def _find(scene):
    scene = _os.fspath(scene)
    folder = _scenes_folder()
    if folder and not _os.path.exists(scene):
        for name in (scene, scene + ".xml"):
            if _os.path.exists(_os.path.join(folder, name)):
                return _os.path.join(folder, name)
    return scene


class Run:
    """What a run came to. Arrays begin with the state at t = 0; n recorded times, nb bodies that move, m recorded steps.

    t                 (n,)        s
    position          (n, nb, 3)  centres of mass, m
    orientation       (n, nb, 4)  unit quaternions w, x, y, z
    velocity          (n, nb, 3)  m/s
    angular_velocity  (n, nb, 3)  rad/s, world axes
    bodies            names
    joints, q         names of joints that move, and (n, nj) their coordinates, rad or m
    steps             dict of (m,) arrays: t, events, contacts, iterations, residual, law_residual, event_energy_gain (J),
                      max_penetration (m), kinetic_energy, potential_energy (J), solve_s, step_s; and status, words
    status, reason    how it ended, as in summary.json
    errors            dict, against the scene's reference
    summary           dict, all of summary.json (docs/interface.md)
    """

    def __init__(self, arrays):
        self.summary = _json.loads(arrays.pop("summary"))
        self.status, self.reason = self.summary["status"], self.summary["reason"]
        self.finished, self.errors = self.summary["finished"], self.summary["errors"]
        self.__dict__.update(arrays)

    def __bool__(self):
        return self.finished

    def __repr__(self):
        ending = self.status + (f": {self.reason}" if self.reason else "")
        return f"<contactbench.Run: {self.summary['scenario']}, {self.summary['method']}, {len(self.t)} times, {ending}>"


def run(scene, method, **options):
    """Simulates a scene (a path, or the name of one that comes with the program) and returns a Run.

    method     a name (`contactbench.methods`), "external" with command=..., or a function problem -> impulses (nc, 3) in N s
    law        what a function or an external program claims to solve (`contactbench.laws`)
    step, duration, time_limit (s), friction, restitution, record_every, prune, set={parameter: value},
    stepping ("events", "steps"): as the flags of `contactbench run`
    and the method's own: solver, variant, k, epsilon, ...

    A function that raises ends the run as 'crash', NaN as 'not_finite', a wrong shape as 'input_error', one that does not
    come back as 'time_limit' (with time_limit=); what was reached until then is in the arrays. Ctrl-C raises
    KeyboardInterrupt.
    """
    return Run(_core.simulate(_find(scene), method, options))


def problems(scene, method="ap", **options):
    """The problems that a run of the scene meets, one by one as it goes (Problem, with `t` in s); options as run(). Its
    time_limit is that of the run alone: what is done with the problems does not count."""
    return _core.Events(_find(scene), method, options)


def performance_profile(seconds, path=None, title=None):
    """Draws a performance profile (Dolan and More, 2002): for each solver the share of problems that it answers within tau
    times the fastest. seconds: {solver: list of s, one a problem, None or inf where it gave no answer that holds}.
    Returns matplotlib's axes; writes a picture where `path` is given.
    """
    import matplotlib
    if path:
        matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np
    names = list(seconds)
    table = np.array([[np.inf if s is None else s for s in seconds[name]] for name in names], float)
    best = table.min(axis=0)
    ratio = table[:, np.isfinite(best)] / best[np.isfinite(best)]
    finite = ratio[np.isfinite(ratio)]
    last = max(10.0, 2 * finite.max()) if finite.size else 10.0
    _, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for name, row in zip(names, ratio):
        tau = np.sort(row[np.isfinite(row)])
        share = np.arange(1, len(tau) + 1) / table.shape[1]
        axes.step(np.r_[1, tau, last], np.r_[0, share, share[-1] if len(tau) else 0], where="post", label=name)
    axes.set(xscale="log", xlim=(1, last), ylim=(0, 1.02), xlabel="time over that of the fastest", ylabel="share of problems",
             title=title or f"{table.shape[1]} problems")
    axes.legend(loc="lower right", fontsize="small")
    if path:
        axes.figure.savefig(path, dpi=150)
    return axes
