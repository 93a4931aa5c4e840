"""What the program prints comes out again, word for word, of every scene and stored problem that the tests have, good or broken,
of every topic, and of every flag with values that it takes or refuses; and so does its exit code.

Where a change is meant to move it: PROGRAM=build/bin/contactbench python3 -B test/scripts/test_words.py make"""
import hashlib
import itertools
import json
import os
import re
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


def commands():
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
                yield f"{command} {base} {flag} {value}"
    for command, base in OF_METHODS.items():
        for method, flag in itertools.product(methods, values_of(command)):
            yield f"{command} {base} --method {method} {flag} {'on' if flag == '--warm-start' else '0.5'}"


def printed(command, limit=60):
    """Exit code and what is printed, line by line; a command names files from the root of the project."""
    with tempfile.TemporaryDirectory() as folder:
        words = [str(ROOT / word) if word.startswith(("scenarios/", "test/data/")) else word for word in command.split()]
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
    if ended.returncode == 0 and words[:1] == ["solve"]:  # its numbers are test_answers' matter
        out = []
    lines = [ended.returncode, *out, *(f"error: {line}" for line in err)]
    rest = json.dumps(lines[LONGEST:])
    return lines if len(lines) <= LONGEST else [*lines[:LONGEST], f"and {hashlib.sha256(rest.encode()).hexdigest()[:8]}"]


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
        wanted = json.loads(TABLE.read_text())
        self.assertGreater(len(wanted), 2000)
        found = test_answers.on_all_cores(printed, [(name, ) for name in wanted])
        different = [f"{name}:\n    was {then}\n    is  {now}" for (name, then), now in zip(wanted.items(), found) if then != now]
        self.assertFalse(different, "\n".join([f"{len(different)} of {len(wanted)} commands, the first:", *different[:10]]))


if __name__ == "__main__":
    if sys.argv[1:] == ["make"]:
        make()
    else:
        unittest.main()
