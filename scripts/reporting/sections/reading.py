"""How to read the report, and the machine, versions and settings that made it."""
import statistics

from ..section import Section, esc, table

TITLE = "How to read this"
PROFILES = {"quick": "one run a cell (two of most in error against run time) and a limit of a minute a run: statuses, errors and claims hold, times are a first look",
            "paper": "the paper's durations, three interleaved repeats, limits of an hour a run"}


def spread(results):
    """How far repeats of a cell are apart: {cells, median, worst} of the ratio of the most to the least time; None where nothing was
    repeated."""
    ratios = [max(c.times) / min(c.times) for c in results.cells(sweep=None) if len(c.times) > 1]
    return {"cells": len(ratios), "median": statistics.median(ratios), "worst": max(ratios)} if ratios else None


def build(results):
    manifest = results.manifest
    machine, versions, timing = manifest.get("machine") or {}, manifest.get("versions") or {}, manifest.get("timing", {})
    profile = manifest.get("profile") or "default"
    busy, runs = timing.get("runs_on_a_busy_machine", 0), manifest.get("runs", 0)
    noise = (f"<p class='warn'>During {busy} of {runs} runs others used the machine (more than a quarter of a core). Times from such runs "
             "carry a star; compare them with care.</p>" if busy else "<p>No run is known to have been disturbed by others on the machine.</p>")
    apart = spread(results)
    noise += "<p>Before a run is timed, its start is run once uncounted; repeats are interleaved, on one thread. " + (
        f"Of {apart['cells']} cells with repeats, the slowest took {apart['median']:.2f} times as long as the quickest (median; {apart['worst']:.2f} "
        "at worst): differences below that say nothing.</p>" if apart else "Nothing was repeated, so that noise is not known.</p>")
    text = f"""
<p>Contact models for rigid bodies, on the scenes of E. Drumwright and D. A. Shell, <i>An Evaluation of Methods for Modeling
Contact in Multibody Simulation</i> (ICRA 2011), with all models written anew and each answer checked by an independent
referee. Numbers come from result files; none was typed by hand. Profile <b>{esc(profile)}</b>: {esc(PROFILES.get(profile, ""))}.</p>
<ul>
<li><b>Processing time</b> is dynamics, collision, assembly and solve, in seconds for the whole simulated time; the check of each
answer and writing are not in it. Compare ratios inside a column, not seconds with the paper's of 2011.</li>
<li><b>A run that did not finish</b> has a typed status and the simulated time that it reached in place of the paper's DNF.
<i>inaccurate</i>: it finished, but the referee refused answers on the way.</li>
<li><b>Empty</b> is what is not there: a solver that is not installed, a scene that this build lacks. It is never 0.</li>
<li><b>k</b>: edges of A-P's friction polygon. <b>epsilon</b>: suboptimality in J at which the convex solver may stop.</li>
<li><b>Newton</b> is shown in two readings: <i>uncapped</i> friction (the one that explains the paper's Figure 1) and
<i>stick-tested</i>.</li>
</ul>
{noise}"""
    rows = [[esc(key), esc(value)] for key, value in {**machine, **versions, "python": manifest.get("python", "")}.items()] \
        if isinstance(machine, dict) and isinstance(versions, dict) else [["machine", esc(machine)], ["versions", esc(versions)]]
    rows.append(["sweeps", esc(", ".join(manifest.get("sweeps", [])))])
    rows.append(["runs", esc(", ".join([f"{runs}"] + [f"{n} {s}" for s, n in manifest.get("statuses", {}).items()]))])
    rows += [[f"left out: {esc(name)}", esc(why)] for name, why in manifest.get("missing", {}).items()]
    if manifest.get("runs_not_done_yet"):
        rows.append(["not done yet", esc(manifest["runs_not_done_yet"])])
    # The repeat count and limits of a cell are in runs.csv; the machine itself is what times depend on.
    data = {key: manifest.get(key) for key in ("profile", "sweeps", "runs", "missing", "statuses")}
    return Section(text + table(["", "this report was made with"], rows), data,
                   {"machine": machine, "versions": versions, "python": manifest.get("python"), "busy": timing, "spread": apart})
