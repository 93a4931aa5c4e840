"""Siconos' answers to the stored problems, judged by `contactbench judge` under Coulomb's law: where the referee finds that
an answer holds it is one, whoever gave it; and what `solve --method external` says of the same impulses is the same to the
last bit.

    siconos_answers.py PROGRAM SICONOS_ANSWER [PROBLEM ...]
"""
import glob
import json
import os
import subprocess
import sys
import tempfile

PROBLEMS = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "data", "problems")
KNOWN = ("gen_sphereslide_", "gen_free_b2_", "gen_wedge_")  # few contacts, one answer: a solver that misses these is broken
LIMIT = "10"  # s, a problem


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    return done.returncode, json.loads(done.stdout) if done.stdout.startswith("{") else None, done.stderr


def main():
    program, siconos, *paths = sys.argv[1:]
    wrong = []
    for path in paths or sorted(glob.glob(PROBLEMS + "/*.hdf5")):
        name = os.path.basename(path)[:-5]
        for solver in ("nsgs", "nsn_ac"):
            with tempfile.TemporaryDirectory() as folder:
                answer = os.path.join(folder, "r.txt")
                command = f"{siconos} {solver} {{text}} {{answer}} 2>/dev/null && cp {{answer}} {answer}"
                _, solved, said = run(program, "solve", path, "--kind", "contact", "--method", "external", "--command", command,
                                      "--law", "coulomb", "--time-limit", LIMIT, "--json")
                if solved is None or not os.path.exists(answer):
                    print(f"{name:40} {solver:7} {said.strip() if solved is None else solved['status']}")
                    if name.startswith(KNOWN):
                        wrong.append(f"{name}: {solver} has no answer")
                    continue
                code, judged, said = run(program, "judge", path, answer, "--law", "coulomb", "--json")
            if judged is None:
                wrong.append(f"{name}: {solver}: exit code {code}: {said.strip()}")
                continue
            holds = judged["verdict"] == "holds"
            found = judged["residual"]  # none of an answer that is not finite
            print(f"{name:40} {solver:7} {judged['verdict']:14} residual {'none' if found is None else format(found, '.3g')}"
                  f"{'' if holds else ', worst at contact ' + str((judged['worst'] or {}).get('contact'))}")
            if code != (0 if holds else 3):
                wrong.append(f"{name}: exit code {code} and '{judged['verdict']}'")
            if solved["residual"] != found:
                wrong.append(f"{name}: judge finds {found}, solve {solved['residual']}")
            if solver == "nsgs" and name.startswith(KNOWN) and (found is None or found > 1e-6):
                wrong.append(f"{name}: {found} of an answer that should be one")
    sys.exit("\n".join(wrong) or 0)


if __name__ == "__main__":
    main()
