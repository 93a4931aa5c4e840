"""From sweep files (scenarios/sweeps/*.toml, docs/sweeps.md) and `contactbench list --json` to the list of runs.

A sweep file says which scenes with which knobs; methods, solvers and variants come from the program's own list, so that
a new one fills in by itself. A run that two sweep files ask for is one run that belongs to both.
"""
import dataclasses
import itertools
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from .program import ProgramError, choices, scenes_of

# Knobs in a sweep file are flags of `contactbench run`, with underscores. These are every method's, the others only of
# the methods whose row in `list --json` names the flag.
COMMON = ("step", "stepping", "accuracy", "order", "record_interval", "joint_forces", "duration", "restitution",
          "friction", "prune")
# Parts of the names of runs; of other knobs their own names.
SHORT = {
    "step": "h", "stepping": "by-", "accuracy": "A", "order": "p", "record_interval": "dt", "joint_forces": "joints-",
    "duration": "T", "k": "k", "epsilon": "eps", "epsilon_relative": "epsrel", "compression_bound": "bound-",
    "regularise": "reg", "warm_start": "warm-", "restitution": "e", "friction": "mu", "prune": "prune-"}
# What may stand beside the knobs in a block or a profile.
SETTINGS = {
    "repeats": 1, "members": 0, "record_every": 1, "record_interval_s": 0, "record_contacts": False, "timed": True,
    "time_limit_s": 3600, "memory_limit_mb": 4096}
# m: how far a member of an ensemble moves each free body at the start: the last bits of a place of size 1 m.
LAST_BITS = "1e-15"
COARSE = 10  # steps between its records
OTHER = {"scene", "set", "methods", "engines", "setting", "profiles"}
OF_ENGINES = ("step", "duration", "restitution", "friction", "setting")  # knobs that engines have too, and their own


def member_flags(number: int, given=()) -> list[str]:
    """What makes a run a member of its ensemble, where nothing of it is given already."""
    flags = [] if "--perturb" in given else ["--perturb", LAST_BITS, "--seed", str(number)]
    flags += [] if "--shuffle-contacts" in given else ["--shuffle-contacts", str(number)]
    return flags if number else []


def without_member(command: str, number: int) -> str:
    """The command of the run that this one is a member of: what member_flags put at its end taken away."""
    for flags in (member_flags(number, ["--perturb"]), member_flags(number, ["--shuffle-contacts"])):
        command = command.removesuffix(" " + " ".join(flags)) if flags else command
    return command


class SweepError(ProgramError):
    """A sweep file that is wrong: says which file and block, and what would be right."""


@dataclass(frozen=True)
class Run:
    scene: str
    sets: tuple  # (name, value) pairs for --set
    method: str
    variant: str
    solver: str
    knobs: tuple  # (knob, value) pairs, COMMON first
    repeat: int
    member: int = 0  # of the cell's ensemble (worth.py); 0 is the run itself
    # What follows does not change what the run is.
    sweeps: tuple = ()
    record_every: int = 1
    timed: bool = True
    time_limit_s: float = 3600
    memory_limit_mb: float = 4096
    file: str = ""  # of a scene that does not come with the program
    members: int = 0  # of its ensemble, at most
    engine: bool = False  # whether it is an engine that stands as the method
    record_contacts: bool = False

    @classmethod
    def of(cls, row):
        """The run of a row of runs.csv."""
        def pairs(words):
            return [tuple(word.split("=", 1)) for word in words.split()]

        knobs = dict(pairs(row["knobs"])) | {n: row[n] for n in ("k", "epsilon") if row[n]}
        return cls(row["scene"], tuple(pairs(row["parameters"])), row["method"], row["variant"], row["solver"],
                   tuple((n, knobs[n]) for n in dict.fromkeys([*COMMON, "k", "epsilon", *knobs]) if n in knobs),
                   int(row["repeat"]), engine=bool(row.get("engine")))

    @property
    def cell(self):
        """All that tells runs apart but the repeat."""
        return self.scene, self.sets, self.method, self.variant, self.solver, self.knobs

    @property
    def name(self):
        parts = [self.scene] + [f"{n}-{v}" for n, v in self.sets] + [self.method]
        parts += [p for p in (self.variant, self.solver) if p]
        parts += [f"{SHORT.get(n, n + '-')}{v}" for n, v in self.knobs]
        parts += [f"m{self.member}" if self.member else f"r{self.repeat}"]
        return "__".join(parts).replace("/", ":")  # a folder; pi/4 is a value

    def as_member(self, number):
        """The run with other last bits at the start and its contacts in another order. Nobody draws it, so that not
        every step is kept."""
        # Steps of an accuracy end at the moments of a reference, each of which is to be kept.
        every = COARSE if self.record_every == 1 and "accuracy" not in dict(self.knobs) else self.record_every
        return dataclasses.replace(self, member=number, timed=False, record_every=every, record_contacts=False)

    def flags(self):
        """Of `contactbench run`, all that the result depends on."""
        flags = ["--engine" if self.engine else "--method", self.method]
        for flag in ("variant", "solver"):
            if getattr(self, flag):
                flags += [f"--{flag}", getattr(self, flag)]
        for name, value in self.knobs:
            flags += [f"--{name.replace('_', '-')}", value]
        for name, value in self.sets:
            flags += ["--set", f"{name}={value}"]
        return flags + member_flags(self.member, flags)

    def asked(self):
        """The run in a form that JSON can hold: the first part of run.json."""
        knobs = dict(self.knobs)
        return {
            "run": self.name, "scene": self.scene, "parameters": " ".join(f"{n}={v}" for n, v in self.sets),
            "method": self.method, "variant": self.variant, "solver": self.solver, "k": knobs.pop(
                "k", ""), "epsilon": knobs.pop("epsilon", ""), "knobs": " ".join(f"{n}={v}" for n, v in knobs.items()),
            "repeat": self.repeat, "member": self.member, "engine": self.method if self.engine else ""}


def text(value):
    """A value as a flag has it: without blanks, which mean nothing there and would part it in a table."""
    if isinstance(value, bool):
        return "on" if value else "off"
    return "".join(str(value).split())


def values(value):
    return [text(v) for v in value] if isinstance(value, list) else [text(value)]


def own_knobs(method):
    return [option["flag"].replace("-", "_") for option in method["options"]]


def read(path, listed):
    """A sweep file, for the program whose `list --json` this is; numbers stay as they are written, so that 1e-2 is 1e-2
    in names and tables."""
    try:
        with open(path, "rb") as file:
            sweep = tomllib.load(file, parse_float=str)
    except OSError as error:
        raise SweepError(f"{path}: {error.strerror}") from None
    except tomllib.TOMLDecodeError as error:
        raise SweepError(f"{path}: {error}") from None
    knobs = set(COMMON) | {knob for method in listed["methods"] for knob in own_knobs(method)}
    known = {"title", "outside", "profiles", "runs", "methods", "engines", "setting"} | set(SETTINGS) | knobs
    for key in sweep:
        if key not in known:
            raise SweepError(f"{path}: unknown key '{key}'; known: {', '.join(sorted(known))}")
    if not sweep.get("runs"):
        raise SweepError(f"{path}: no [[runs]] block")
    profiles = sweep.get("profiles", {})
    for name, profile in profiles.items():
        allowed = knobs | set(SETTINGS) | {"set", "methods", "engines", "setting"}
        for key in profile:
            if key not in allowed:
                raise SweepError(f"{path}: profile {name}: unknown key '{key}'; known: {', '.join(sorted(allowed))}")
    for number, block in enumerate(sweep["runs"], start=1):
        allowed = OTHER | knobs | set(SETTINGS) | set(profiles)
        parts = [block] + [block[p] for p in profiles if p in block]
        for key in (key for part in parts for key in part):
            if key not in allowed:
                raise SweepError(f"{path}: block {number}: unknown key '{key}'; known: {', '.join(sorted(allowed))}")
        if "scene" not in block:
            raise SweepError(f"{path}: block {number}: no scene")
    return sweep


def wanted(name, patterns):
    """`ap`, `ap/lemke` and `newton/uncapped` name methods; no list means all of them."""
    return not patterns or any(name == p or name.startswith(p + "/") for p in patterns)


def engines(listed):
    """Rows of engines beside those of methods (program.choices): of each variant; of an engine that is not here one,
    whose runs are `unavailable`."""
    return [({"name": engine["name"], "engine": True, "here": not engine["unavailable"]}, variant, "")
            for engine in listed.get("engines", [])
            for variant in [v["name"] for v in engine.get("variants", [])] or [""]]


def knobs_of(method):
    if method.get("engine"):
        return OF_ENGINES if method["here"] else ()
    return *COMMON, *own_knobs(method)


def asked_for(method, name, block):
    """Methods where nothing is said of them, engines only where they are."""
    if not method.get("engine"):
        return wanted(name, block.get("methods"))
    patterns = block.get("engines", [])
    return bool(patterns) and wanted(name, [] if patterns == ["all"] else patterns)


def turned(chosen, knobs):
    """Scene parameters with pi/k and pi/2k worked out: the angles by which a polygon of k edges is turned at worst and
    half-way."""
    k = int(dict(knobs).get("k", 0))
    angles = {"pi/k": math.pi / k, "pi/2k": math.pi / (2 * k)} if k else {}
    if not k and any(v in ("pi/k", "pi/2k") for _, v in chosen):
        return None
    return tuple((n, repr(angles[v]) if v in angles else v) for n, v in chosen)


def recorded(settings, knobs):
    """Every how many steps a run is recorded: so often, or at a distance in simulated time, so that steps can be
    compared."""
    interval, step = float(settings["record_interval_s"]), dict(knobs).get("step")
    return max(1, round(interval / float(step))) if interval and step else int(settings["record_every"])


def block_runs(block, scene, file, sweep, profile, rows, stem):
    merged = {**sweep, **sweep.get("profiles", {}).get(profile, {}), **block, **block.get(profile, {})}
    settings = {key: merged.get(key, default) for key, default in SETTINGS.items()}
    sets = [[(name, v) for v in values(value)] for name, value in merged.get("set", {}).items()]
    for chosen in itertools.product(*sets):
        for method, variant, solver in rows:
            if not asked_for(method, "/".join(p for p in (method["name"], variant or solver) if p), merged):
                continue
            # What a block leaves empty is left out of it; an accuracy takes the place of a step.
            names = [n for n in knobs_of(method) if merged.get(n, []) != []]
            if "accuracy" in names:
                if method.get("no_expansion"):
                    continue
                names = [n for n in names if n != "step"]
            for knobs in itertools.product(*[[(n, v) for v in values(merged[n])] for n in names]):
                if turned(chosen, knobs) is None:
                    continue  # an angle of the polygon is none of a method without one
                yield Run(scene, turned(chosen, knobs), method["name"], variant, solver, tuple(knobs), 0, 0, (stem, ),
                          recorded(settings, knobs), bool(settings["timed"]), float(settings["time_limit_s"]),
                          float(settings["memory_limit_mb"]), file,
                          0 if method.get("engine") else int(settings["members"]), method.get("engine", False),
                          bool(settings["record_contacts"]) and not method.get("engine")), int(settings["repeats"])


def merge(a, b):
    """One run that two blocks ask for: with the moments that either wants (0 is none), and the wider limits."""
    finest = math.gcd(a.record_every, b.record_every)
    return dataclasses.replace(a, sweeps=tuple(
        dict.fromkeys(a.sweeps + b.sweeps)), record_every=finest, timed=a.timed or b.timed, time_limit_s=max(
            a.time_limit_s, b.time_limit_s), memory_limit_mb=max(a.memory_limit_mb, b.memory_limit_mb), members=max(
                a.members, b.members), record_contacts=a.record_contacts or b.record_contacts)


def plan(paths, profile, listed):
    """The runs in the order in which they are done: repeats interleaved, so that a slow minute of the machine touches
    every cell alike. Besides what the program does not have: {scene or solver: reason}."""
    scenes, merged, missing = scenes_of(listed), {}, {}
    for path in paths:
        sweep = read(path, listed)
        if profile and sweep.get("profiles") and profile not in sweep["profiles"]:
            raise SweepError(f"{path}: no profile '{profile}'; known: {', '.join(sweep['profiles'])}")
        rows, out = choices(listed, sweep.get("outside", []))
        missing.update(out)
        rows = [*rows, *engines(listed)]
        for block in sweep["runs"]:
            if profile and profile not in block.get("profiles", [profile]):
                continue
            scene, file = block["scene"], ""
            if scene.endswith(".xml"):
                # A file of the user's own, beside the sweep file; the program itself knows its parameters.
                file = str(path.parent.resolve() / scene)
                scene = Path(scene).stem
                if not Path(file).is_file():
                    raise SweepError(f"{path}: no file {file}")
            elif scene not in scenes:
                missing[scene] = "this build has no such scene"
                continue
            for name in block.get("set", {}):
                if not file and name not in scenes[scene]["parameters"]:
                    raise SweepError(f"{path}: {scene} has no parameter '{name}'; it has "
                                     f"{', '.join(scenes[scene]['parameters'])}")
            for run, repeats in block_runs(block, scene, file, sweep, profile, rows, path.stem):
                for repeat in range(1, repeats + 1):
                    this = dataclasses.replace(run, repeat=repeat)
                    before = merged.get(this.name)
                    if before and before.file != file:
                        both = " and ".join(of or "the one of this build" for of in (file, before.file))
                        raise SweepError(f"{path}: two scenes are called {scene}, and runs are: {both}; rename one")
                    merged[this.name] = merge(before, this) if before else this
    return sorted(merged.values(), key=lambda run: run.repeat), missing
