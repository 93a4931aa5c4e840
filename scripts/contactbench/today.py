"""The methods of today beside the paper's: what each model does wrong, on which kind of scene, and at which cost.
Everything is compared with exact Coulomb friction at the same step, so that the error of the step is none of a model's.
Reads result files of the sweep today; runs nothing."""
import math

from . import precision
from .gather import number

SWEEP = "today"
# What may be missing of Coulomb's law, and whose that is: the columns of the budget.
COLUMNS = {
    "polygon": "friction in a polygon", "convexity": "a convex program", "softness": "contacts that give way",
    "sequence": "one contact after another"}
EXACT = ("newton", "cascade")  # two solvers of the law itself; where they part, it has several answers


def column_of(cell):
    """The column of a cell's model; empty for one that solves the law itself."""
    if cell["method"] == "coulomb":
        return "sequence" if cell["solver"] in ("nsgs", "bisection") and not exact(cell) else ""
    return {"ap": "polygon", "convex": "convexity", "soft": "softness"}.get(cell["method"], "sequence")


def label_of(cell):
    """The method with the knobs that tell it apart in a scene and step."""
    knobs = [
        word.replace("compression_bound", "bound").replace("=", " ") for word in cell["knobs"].split()
        if not word.startswith(("step=", "duration="))]
    return ", ".join([cell.with_k.replace(", epsilon 1e-12 J", ""), *knobs])


def exact(cell):
    """Whether its answers are Coulomb's law to rounding."""
    return cell["status"] == "ok" and number(cell["law_residual_max"]) <= precision.EXACT_LAW


def references(cells, step):
    """The runs of exact Coulomb friction at a step, those of the two solvers first; none where none was exact."""
    some = [c for c in cells if c["method"] == "coulomb" and c["step"] == step and c.finished and exact(c)]
    return sorted(some, key=lambda c: EXACT.index(c["solver"]) if c["solver"] in EXACT else len(EXACT))


def rows_of(results):
    """A row a scene, step and run: how far it is from exact Coulomb friction (m, largest distance of a body), how far
    two solvers of that are from each other, the error against the scene's own reference, and what a step costs."""
    rows = []
    scenes = dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=SWEEP))
    for scene, parameters in scenes:
        cells = results.cells(scene, SWEEP, parameters=parameters)
        name = precision.measure(results, scene, parameters, SWEEP)
        for step in dict.fromkeys(c["step"] for c in cells):
            law = references(cells, step)
            agree = precision.apart(*law[:2]) if len(law) > 1 else math.nan
            for cell in (c for c in cells if c["step"] == step):
                rows.append({
                    "scene": scene, "parameters": parameters, "step": step, "cell": cell, "label": label_of(cell),
                    "column": column_of(cell), "status": cell["status"] if cell.finished else cell.how_it_ended,
                    "agree": agree, "apart": precision.apart(cell, law[0]) if law and cell.finished else math.nan,
                    "law": number(cell["law_residual_max"]), "error": cell.error(name) if name else math.nan,
                    "measure": name, "time_per_step": cell.seconds /
                    int(cell["steps"]) if cell.finished and int(cell["steps"] or 0) else math.nan})
    return rows


def budget(rows):
    """A row a scene and step: for each column its runs and how far they are from exact Coulomb friction, the nearest
    first."""
    out = {}
    for row in rows:
        line = out.setdefault((row["scene"], row["parameters"], row["step"]),
                              {"agree": row["agree"], "law_error": math.nan} | {column: [] for column in COLUMNS})
        if row["cell"]["method"] == "coulomb" and row["cell"]["solver"] == EXACT[0]:
            line["law_error"] = row["error"]
        if row["column"] and not math.isnan(row["apart"]):
            line[row["column"]] = sorted([*line[row["column"]], row], key=lambda r: r["apart"])
    return out


def advice(rows):
    """For each scene and step: whose motion is Coulomb's (to a hundredth of a millimetre), the cheapest first."""
    out = {}
    for row in rows:
        if row["status"] == "ok" and row["apart"] <= 1e-5:
            out.setdefault((row["scene"], row["parameters"], row["step"]), []).append(row)
    return {key: sorted(some, key=lambda r: r["time_per_step"]) for key, some in out.items()}
