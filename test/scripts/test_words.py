"""What the program prints comes out again, word for word, of every scene and stored problem that the tests have, good or broken,
of every topic, and of every flag with values that it takes or refuses; and so does its exit code.

Where a change is meant to move it: PROGRAM=build/bin/contactbench python3 -B test/scripts/test_words.py make"""
import hashlib
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import test_answers
from contactbench import program

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "test/data/words.json"
PROGRAM = os.environ.get("PROGRAM")
PROBLEM = "test/data/contact/gen_free_b2_c3_s1.txt"  # of three contacts
BASES = {  # a command that does, and what is then given besides
    "run": "sticking_box.xml --method ap --duration 0.002 --out out",
    "solve": f"{PROBLEM} --kind contact --method convex",
    "judge": f"{PROBLEM} ANSWER3 --law coulomb",
    "check": "sticking_box.xml"}
TOGETHER = {"--order": "--accuracy 1e-3", "--record-interval": "--accuracy 1e-3", "--seed": "--perturb 1e-3",
            "--save-every": "--save-problems problems"}
VALUES = ("x", "''", "-1", "0", "nan", "1e400", "3", "0.5")
OF_METHODS = {"run": "sticking_box.xml --duration 0.002 --out out --quiet", "solve": f"{PROBLEM} --kind contact"}
LONGEST = 14  # lines of what one command prints that are kept; those beyond by their digest
OF_ITS_PLACE = re.compile(r"^  (time|memory) .*|\(git [^)]*\)|\(unavailable: .*|\"unavailable\": .*", re.MULTILINE)


def files(*patterns):
    return [str(path.relative_to(ROOT)) for pattern in patterns for path in sorted(ROOT.glob(pattern)) if path.is_file()]


def values_of(command):
    """Flags of a command that take a value."""
    return re.findall(r"^  (--[\w-]+) \S", program.call(PROGRAM, command, "--help").stdout, re.MULTILINE)


def matrix(file):
    return (ROOT / file).read_bytes().startswith(b"%%MatrixMarket")


def contacts(file):
    """Of a contact problem, as the program says where an answer is too short."""
    said = re.search(r"(\d+) contacts? needs? ", "\n".join(map(str, printed(f"judge {file} ANSWER0 --law coulomb"))))
    return int(said.group(1)) if said else 0


def with_use_for(command, flag):
    """The base of a command without the flag, with what the flag belongs to."""
    base = re.sub(rf" {flag} \S+", "", BASES[command]) + (f" {TOGETHER[flag]}" if flag in TOGETHER else "")
    owner = re.search(r"only (\w+)", "\n".join(map(str, printed(f"{command} {base} {flag} 0.5"))))
    return re.sub(r"--(method|law) \w+", rf"--\1 {owner.group(1)}", base) if owner else base


# Scenes each of whose attributes is given another word, is left out, or has another name; what it is in, besides, of those with a robot.
SPOILT = ("sliding_box", "circular_sliding", "stack", "grasp", "mobile_robot_caster", "conveyor", "hills", "quadruped", "pushed_block", "rolling_drum",
          "urdf_arm scenarios/urdf/arm.urdf", "gripper scenarios/urdf/gripper_arm.urdf")
ATTRIBUTE = re.compile(r' ([\w:]+)="([^"]*)"')
WORDS = {"x": "x", "negative": "-1", "nothing": "", "two": "1 2"}


def spoilt(text, how):
    """The text with its n-th attribute as "n=HOW" says."""
    at, how = how.split("=")
    found = list(ATTRIBUTE.finditer(text))[int(at)]
    word = "" if how == "left-out" else f' {found[1]}{"s" if how == "renamed" else ""}="{WORDS.get(how, found[2])}"'
    return text[:found.start()] + word + text[found.end():]


def spoilt_scenes():
    hows = itertools.cycle(("x", "renamed", "negative", "left-out", "two", "nothing"))
    for name in SPOILT:
        scene, *beside = name.split()
        for file in [f"scenarios/{scene}.xml", *beside]:
            for at in range(sum(1 for _ in ATTRIBUTE.finditer((ROOT / file).read_text()))):
                yield f"check scenarios/{scene}.xml SPOILT:{file}:{at}={next(hows)}"


def engines():
    """Those that are here."""
    return [engine["name"] for engine in program.listed(PROGRAM)["engines"] if not engine["unavailable"]]


def commands():
    yield "list engines"
    yield "list engines --json"
    for engine in engines():
        for flag in ("--variant", "--setting", "--step"):
            yield f"check --engine {engine} {flag} no"
        for scene in ("sliding_box", "stack", "rolling_drum", "hills", "grasp", "conveyor"):
            yield f"run scenarios/{scene}.xml --engine {engine} --duration 0.001 --out out"
    yield from spoilt_scenes()
    for topic in ("methods", "outside", "laws", "solvers", "scenarios", "controllers", "references", "statuses", "nothing"):
        yield f"list {topic}"
        yield f"list {topic} --json"
    for shell in ("bash", "zsh", "fish"):
        yield f"completion {shell}"
    for command in ("run", "solve", "judge", "check", "list", "completion", "nothing"):
        yield f"{command} --help"
        if command != "list":  # which tells what is installed
            yield command
        yield f"{command} --nothing"
    methods = [method["name"] for method in program.listed(PROGRAM)["methods"]]
    good = files("scenarios/*.xml", "scenarios/stress/*.xml", "scenarios/preflight/*.xml", "test/data/accuracy/*.xml",
                 "test/data/scenes/*.xml")
    for file in good + files("test/data/broken/*", "test/data/fuzz/scene/*", "scenarios/urdf/*", "test/data/meshes/*"):
        yield f"check {file}"
    for file, method in zip(good, itertools.cycle(methods)):
        yield f"check {file} --json"
        yield f"check {file} --files"
        yield f"check {file} --method {method} --steps 5"
        yield f"run {file} --method {method} --duration 0.01 --out out"
    for file in files("test/data/fuzz/problem/*"):
        yield f"solve {file} --kind {'lcp --solver lemke' if matrix(file) else 'contact --method convex'}"
    problems = files("test/data/contact/*.*", "test/data/events/*", "test/data/problems/*.hdf5", "test/data/siconos/*")
    for file, law in zip(problems, itertools.cycle(law["name"] for law in program.listed(PROGRAM)["laws"])):
        yield f"judge {file} ANSWER{contacts(file)} --law {law}"
        yield f"judge {file} ANSWER{contacts(file)} --law {law} --json"
    yield f"judge {PROBLEM} {PROBLEM} --law coulomb"
    for command in BASES:
        for flag in values_of(command):
            base = with_use_for(command, flag)
            yield f"{command} {base} {flag}"
            for value in VALUES:
                if flag != "--memory-limit" or not value.startswith(("3", "0.5")):  # a matter of the moment
                    yield f"{command} {base} {flag} {value}"
    for command, base in OF_METHODS.items():
        for method, flag in itertools.product(methods, (flag for flag in values_of(command) if flag != "--memory-limit")):
            yield f"{command} {base} --method {method} {flag} {'on' if flag == '--warm-start' else '0.5'}"


def printed(command, limit=60):
    """Exit code and what is printed, line by line; a command names files from the root of the project."""
    with tempfile.TemporaryDirectory() as folder:
        words = [str(ROOT / word) if word.startswith(("scenarios/", "test/data/")) else word for word in command.split()]
        if words[-1].startswith("SPOILT:"):
            _, file, how = words.pop().split(":")
            shutil.copytree(ROOT / "scenarios", Path(folder) / "scenarios", ignore=shutil.ignore_patterns("stress", "sweeps", "preflight"))
            (Path(folder) / file).write_text(spoilt((ROOT / file).read_text(), how))
            words[1] = words[1].replace(f"{ROOT}/", f"{folder}/")
        for k, word in enumerate(words):
            if word.startswith("ANSWER"):
                words[k] = "answer.txt"
                (Path(folder) / "answer.txt").write_text("0.5 0.1 0 " + "0.2 0 0.3 " * (int(word[6:]) - 1) + "\n")
            elif word == "''":
                words[k] = ""
        try:
            ended = subprocess.run([PROGRAM, *words], cwd=folder, capture_output=True, text=True, errors="replace",
                                   stdin=subprocess.DEVNULL, timeout=limit)
        except subprocess.TimeoutExpired:
            return ["no end"]
        out, err = (OF_ITS_PLACE.sub("", text.replace(folder, "FOLDER").replace(str(ROOT), "ROOT")).splitlines()
                    for text in (ended.stdout, ended.stderr))
        if "--engine" in words and (Path(folder) / "out/trajectory.csv").exists():  # its first row is the scene's, what follows the engine's
            rows = (Path(folder) / "out/trajectory.csv").read_text().splitlines()
            out = [*out[:1], hashlib.sha256("".join(row for row in rows if row.startswith(("t,", "0,"))).encode()).hexdigest()[:8]]
    if ended.returncode == 0 and words[:1] == ["solve"]:  # its numbers are test_answers' matter
        out = []
    if words[:2] == ["list", "engines"]:  # versions are the system's
        out = [re.sub(r"\d+(\.\d+)+", "VERSION", line) for line in out]
    lines = [ended.returncode, *out, *(f"error: {line}" for line in err)]
    most = 1 if ended.returncode == 0 and "SPOILT:" in command else LONGEST
    rest = json.dumps(lines[most:])
    return lines if len(lines) <= most else [*lines[:most], f"and {hashlib.sha256(rest.encode()).hexdigest()[:8]}"]


def make():
    names = list(dict.fromkeys(commands()))
    first, second = (test_answers.on_all_cores(printed, [(name, ) for name in names]) for _ in range(2))
    kept = {name: one for name, one, two in zip(names, first, second) if one == two != ["no end"]}
    TABLE.write_text(json.dumps(kept, indent=0, ensure_ascii=False) + "\n")
    print(f"{len(kept)} of {len(names)} commands; not the same twice:", *(name for name in names if name not in kept), sep="\n  ")


@unittest.skipUnless(PROGRAM, "PROGRAM is not set: ctest names the program")
class Words(unittest.TestCase):
    setUp = test_answers.Answers.setUp

    def test_commands_print_what_they_printed(self):
        here, known = engines(), [engine["name"] for engine in program.listed(PROGRAM)["engines"]]
        wanted = json.loads(TABLE.read_text())
        for name in list(wanted):
            of = re.search(r"--engine (\S+)", name)
            if of and of[1] not in here or name.startswith("list engines") and here != known:
                del wanted[name]
        self.assertGreater(len(wanted), 2000)
        found = test_answers.on_all_cores(printed, [(name, ) for name in wanted])
        different = [f"{name}:\n    was {then}\n    is  {now}" for (name, then), now in zip(wanted.items(), found) if then != now]
        self.assertFalse(different, "\n".join([f"{len(different)} of {len(wanted)} commands, the first:", *different[:10]]))


if __name__ == "__main__":
    if sys.argv[1:] == ["make"]:
        make()
    else:
        unittest.main()
