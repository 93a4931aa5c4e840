#!/usr/bin/env python3
"""Writes the report from the result files: Table I, figures, claims, one self-contained report.html, and report.json.

  scripts/report.py --results results --runs results/runs/quick

In report.json everything that depends on the machine stands under the key `timing`; the rest is the same whenever the same
is run. A section of the report is one file in scripts/reporting/sections/.
"""
import argparse
import concurrent.futures
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import interpreter

interpreter.need("matplotlib", "numpy")
from reporting.results import Results  # noqa: E402
from reporting.section import esc  # noqa: E402
from reporting.sections import ORDER  # noqa: E402

PLOTS = Path(__file__).resolve().parent / "plots"

STYLE = """
:root { color-scheme: light; --line: #d5d5d5; --good: #00734f; --bad: #b02a00; --open: #6a6a6a; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1c1c1c; background: #fff; max-width: 72rem; margin: 0 auto; padding: 0 1rem 3rem;
       overflow-wrap: break-word; }
h1 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 2px solid var(--line); } h3 { margin: 1.6rem 0 .3rem; }
nav a { display: inline-block; margin-right: 1rem; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .85rem; }
th, td { border-bottom: 1px solid var(--line); padding: .3rem .5rem; text-align: left; vertical-align: top; }
.table1 { font-size: .72rem; } .table1 td, .table1 th { padding: .25rem .35rem; }
.table1 td { text-align: right; white-space: nowrap; } .table1 th { font-weight: 600; } .table1 i { color: #555; }
.table1 tbody th { position: sticky; left: 0; background: #fff; }
td.bad { color: var(--bad); } .table1 td.bad { white-space: normal; }
figure { margin: 2rem 0; break-inside: avoid; } figure img { max-width: 100%; height: auto; } figcaption { margin-bottom: .6rem; }
.verdict { font-weight: 600; } .good.verdict { color: var(--good); } .bad.verdict { color: var(--bad); }
.open { color: var(--open); } .warn { background: #fff3d6; padding: .4rem .7rem; }
.claim li { break-inside: avoid; } .claim ul { padding-left: 1.2rem; } .claim li { margin-bottom: .5rem; }
details { margin: .5rem 0; } pre { overflow-x: auto; background: #f6f6f6; padding: .6rem; font-size: .8rem; } code { font-size: .9em; }
@media (max-width: 40rem) { body { font-size: 15px; padding: 0 .7rem 2rem; } }
@media print {
  @page { size: A4; margin: 12mm; }
  @page wide { size: A4 landscape; }
  .table1 { page: wide; }
  h2, h3, figcaption { break-after: avoid; }
  body { font-size: 10pt; max-width: none; padding: 0; } nav, details { display: none; } .wide { overflow: visible; }
  table { font-size: 7pt; } th, td { padding: 1pt 3pt; } .table1 td { white-space: normal; } figure img { max-height: 190mm; }
  .table1 tbody th { position: static; }
}
"""


def draw(options):
    """Every plot script, in processes of their own; one that fails is said in the report and stops nothing."""
    def run(script):
        return script, subprocess.run([sys.executable, "-B", str(script), "--results", str(options.results), "--runs", str(options.runs)],
                                      capture_output=True, text=True)
    scripts = [p for p in sorted(PLOTS.glob("*.py")) if p.stem != "common"]
    for script in scripts:
        for old in (options.results / "figures").glob(f"{script.stem}.*"):
            old.unlink()  # a picture of other results must not stand in for one that fails
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for script, ended in pool.map(run, scripts):
            if ended.returncode != 0:
                said = (ended.stderr.strip().splitlines() or ["no message"])[-1]
                print(f"report: {script.name} could not draw: {said}", file=sys.stderr)


def finite(value):
    """What is no number is null: NaN is no JSON."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", required=True, type=Path, help="folder of runs.csv and manifest.json; all is written there")
    parser.add_argument("--runs", required=True, type=Path, help="folder with one folder a run")
    parser.add_argument("--no-draw", action="store_true", help="take the figures that are there")
    options = parser.parse_args()
    if not options.no_draw:
        draw(options)
    results = Results(options.results, options.runs)
    sections = [(module.__name__.rpartition(".")[2], module.TITLE, module.build(results)) for module in ORDER]

    profile = results.manifest.get("profile") or "default"
    body = "\n".join(f'<section id="{name}"><h2>{esc(title)}</h2>\n{section.html}\n</section>' for name, title, section in sections)
    links = "".join(f'<a href="#{name}">{esc(title)}</a>' for name, title, _ in sections)
    (options.results / "report.html").write_text(f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,"><title>contactbench: contact models compared ({esc(profile)} profile)</title><style>{STYLE}</style></head>
<body><h1>Contact models in multibody simulation: the paper's benchmark, made again</h1>
<nav>{links}</nav>
{body}
</body></html>
""")
    report = {"profile": profile, "sections": {name: {"title": title, "data": section.data, "timing": section.timing}
                                               for name, title, section in sections}}
    (options.results / "report.json").write_text(json.dumps(finite(report), indent=1, allow_nan=False) + "\n")


if __name__ == "__main__":
    main()
