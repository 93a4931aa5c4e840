"""Writes the report from the result files: Table I, figures, claims, one self-contained report.html, and report.json.

  scripts/report.py --results results --runs results/runs/quick

In report.json everything that depends on the machine stands under the key `timing`; the rest is the same whenever the
same is run. Beside both stands what each number is worth (docs/numbers.md). A section of the report is one function in
scripts/contactbench/sections.py and one page of the same name in templates/sections/.
"""
import json
import math
import os
import sys
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from pathlib import Path

from . import figures, program, scenery, table1, worth
from .runs import Runs
from .sections import groups, of_paper
from .templates import render

OF_ANY = ("error_time", "error_budget")  # figures of scenes of which the paper claims nothing


def drawn(name, results):
    """Draws a figure; what is wrong with it, if it cannot be."""
    try:
        figures.draw(name, results)
        return ""
    except Exception as error:  # whatever the files hold: one that fails is said in the report and stops nothing
        return f"{type(error).__name__}: {error}"


def draw(results):
    """Every figure that these results have, on all cores."""
    names = list(figures.FIGURES) if of_paper(results) else OF_ANY
    for name in names:
        for old in (results.folder / "figures").glob(f"{name}.*"):
            old.unlink()  # a picture of other results must not stand in for one that fails
    with ProcessPoolExecutor(os.cpu_count() or 1) as pool:
        said = {name: pool.submit(drawn, name, results) for name in names}
    for name, future in said.items():
        # A process that dies takes with it what was still to be drawn.
        fault = "its process died" if isinstance(future.exception(), BrokenExecutor) else future.result()
        if fault:
            print(f"report: {name}.py could not draw: {fault.splitlines()[-1]}", file=sys.stderr)


def finite(value):
    """What is no number is null: NaN is no JSON."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def heading(results):
    """Title of the window, first line of the page."""
    if of_paper(results):
        return {
            "title": "contact models compared",
            "heading": "Contact models in multibody simulation: the paper's benchmark, made again"}
    scenes = ", ".join(dict.fromkeys(results.table["scene"]))
    return {"title": scenes, "heading": f"Contact models compared: {scenes}"}


def write(results):
    """All that the report is, into the folder of the results."""
    why = scenery.write_motions(results)
    if why:
        print(f"report: no motion.html: {why}", file=sys.stderr)
    worlds = worth.Worlds(results)
    order = groups(results)
    built = {build.__name__: worlds.build(build, results) for group in order.values() for build in group}
    sections, said = {name: section for name, (section, _, _) in built.items()}, {}
    for name, (section, of_data, of_timing) in built.items():
        said[name] = {
            "title": section.title, "data": section.data, "worth": of_data, "timing": section.timing,
            "worth_of_timing": of_timing}
    said = finite(said)
    (results.folder / "report.json"
     ).write_text(json.dumps({"profile": results.profile, "sections": said}, indent=1, allow_nan=False) + "\n")
    count = worth.counted([[s["data"], s["timing"]] for s in said.values()],
                          [[s["worth"], s["worth_of_timing"]] for s in said.values()])
    names = {title: [build.__name__ for build in group] for title, group in order.items()}
    page = render("report.html", profile=results.profile, sections=sections, worth=count, groups=names,
                  **heading(results))
    (results.folder / "report.html").write_text(page)
    if of_paper(results):
        table1.write(results, sections["table_one"].shown)


def main():
    parser = program.flags(__doc__)
    parser.add_argument("--results", required=True, type=Path,
                        help="folder of runs.csv and manifest.json; all is written there")
    parser.add_argument("--runs", type=Path,
                        help="folder with one folder a run [RESULTS/runs/PROFILE, or RESULTS/runs]")
    parser.add_argument("--no-draw", action="store_true", help="take the figures that are there")
    options = parser.parse_args()
    results = Runs(options.results, options.runs)
    if not options.no_draw:
        draw(results)
    write(results)
