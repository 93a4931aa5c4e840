#!/usr/bin/env python3
"""Prints the answers to the paper's claims from the result files, with the numbers and the commands that made them.

  scripts/claims.py                  all, one line each
  scripts/claims.py C3 C4            these, with every number and every run
"""
import argparse
import sys
from pathlib import Path

import interpreter

interpreter.need("numpy")
from reporting import claims  # noqa: E402
from reporting.results import Results  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("claims", nargs="*", metavar="ID", help="C1 ... C10")
    parser.add_argument("--results", type=Path, default=ROOT / "results", help="folder of runs.csv")
    parser.add_argument("--runs", type=Path, help="folder of the runs [results/runs/PROFILE]")
    options = parser.parse_args()
    results = Results(options.results, options.runs or ".")
    if options.runs is None:
        results.runs = options.results / "runs" / (results.manifest.get("profile") or "default")
    answers = {claim.id: claim for claim in claims.all_claims(results)}
    for wanted in options.claims:
        if wanted not in answers:
            sys.exit(f"claims: no claim {wanted}; there are {', '.join(answers)}")
    for claim in [answers[w] for w in options.claims] or answers.values():
        verdict = "; ".join(f"{who}: {what}" if who else what for who, what in claim.answers.items())
        print(f"{claim.id} {claim.scene}: {claim.text}\n  {verdict}")
        if not options.claims:
            continue
        for part in claim.parts:
            print(f"  * {part.verdict}: {part.text}" + (f" ({part.why})" if part.why else ""))
            for what, value in part.numbers.items():
                print(f"      {what}: {claims.said(value)}")
        for command in claims.commands(claim):
            print(f"  {command}")


if __name__ == "__main__":
    main()
