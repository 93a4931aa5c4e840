"""The runs of the reproduction: the paper's scenes at the paper's settings, with every method that is built.

What there is to run comes from `contactbench list --json`; a new method, solver or variant fills in by itself.
"""
from dataclasses import dataclass, field

# Scene, parameters, and the edges of the friction polygon that the paper uses for it (Table I; Figure 4 adds 16).
SCENES = [
    ("impacting_sphere", {}, [8]),
    ("sliding_box", {}, [16]),
    ("sticking_box", {}, [8, 16]),
    ("circular_sliding", {}, [8]),
    ("stack", {"boxes": "1"}, [4]),
    ("stack", {"boxes": "2"}, [4]),
    ("stack", {"boxes": "4"}, [4]),
    ("stack", {"boxes": "8"}, [4]),
    ("stack", {"boxes": "16"}, [4]),
]
EPSILONS = ["1e-12", "1e-2"]  # J, suboptimality of the convex method
OUTSIDE = {"pgs"}  # solvers that the paper does not have and that cannot do its scenes (docs/adding.md)

# Repeats serve the processing times; the limit is wall-clock seconds of one run.
PROFILES = {
    "quick": {"repeats": 1, "time_limit": 60},
    "paper": {"repeats": 3, "time_limit": 3600},
}


@dataclass(frozen=True)
class Run:
    scene: str
    method: str
    solver: str = ""
    variant: str = ""
    k: str = ""
    epsilon: str = ""
    repeat: int = 1
    sets: tuple = field(default=())  # (name, value) pairs for --set

    @property
    def name(self):
        parts = [self.scene] + [f"{n}-{v}" for n, v in self.sets] + [self.method]
        parts += [p for p in (self.variant, self.solver) if p]
        parts += [f"k{self.k}"] if self.k else []
        parts += [f"eps{self.epsilon}"] if self.epsilon else []
        return "__".join(parts + [f"r{self.repeat}"])

    def flags(self):
        flags = ["--method", self.method]
        for flag in ("solver", "variant", "k", "epsilon"):
            if getattr(self, flag):
                flags += [f"--{flag}", getattr(self, flag)]
        for name, value in self.sets:
            flags += ["--set", f"{name}={value}"]
        return flags


def cells(method, edges):
    """Solver, variant, k and epsilon of one method on one scene; none where it has solvers but this build has not."""
    options = {option["flag"] for option in method["options"]}
    for solver in [s for s in method["solvers"] if s not in OUTSIDE] if method["choice"] else [""]:
        for variant in method["variants"] or [""]:
            for k in [str(e) for e in edges] if "k" in options else [""]:
                for epsilon in EPSILONS if "epsilon" in options else [""]:
                    yield {"solver": solver, "variant": variant, "k": k, "epsilon": epsilon}


def runs(profile, methods):
    """All runs of a profile, repeats interleaved: a slow minute of the machine touches every cell alike."""
    return [Run(scene=scene, method=method["name"], repeat=repeat, sets=tuple(sets.items()), **cell)
            for repeat in range(1, PROFILES[profile]["repeats"] + 1)
            for scene, sets, edges in SCENES
            for method in methods
            for cell in cells(method, edges)]
