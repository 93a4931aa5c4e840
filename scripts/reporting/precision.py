"""Error against processing time: the points of the sweep error_time, scene by scene."""
import math

SWEEP = "error_time"
# The error that stands for a scene: the largest over time, of position where the scene has it.
MEASURES = ("position_linf_m", "displacement_linf_m")


def scenes(results):
    """(scene, parameters) in the order of the table, of those with an exact answer."""
    found = dict.fromkeys((c["scene"], c["parameters"]) for c in results.cells(sweep=SWEEP))
    return [s for s in found if measure(results, *s)]


def measure(results, scene, parameters):
    cells = results.cells(scene, SWEEP, parameters=parameters)
    return next((m for m in MEASURES if any(not math.isnan(c.error(m)) for c in cells)), "")


def points(results, scene, parameters):
    """Per cell: time (median, s a simulated second) and error (m); None where the run did not finish or has none."""
    name = measure(results, scene, parameters)
    out = []
    for cell in results.cells(scene, SWEEP, parameters=parameters):
        finite = cell.finished and cell.times and not math.isnan(cell.error(name))
        duration = float(cell["duration"]) if cell["duration"] else math.nan
        out.append({"run": cell["run"], "scene": scene, "parameters": parameters, "step": cell["step"], "measure": name,
                    "status": cell["status"] if cell.finished else cell.how_it_ended.split(" at ")[0],
                    "error": cell.error(name) if finite else None, "time": cell.seconds / duration if finite else None,
                    "least": min(cell.times) / duration if finite else None, "busy": cell.busy, "cell": cell})
    return out
