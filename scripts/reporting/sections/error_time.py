"""A first look at error against run time, on the scenes with an exact answer."""
from .. import precision
from ..section import Section
from . import figures

TITLE = "Error against run time"


def build(results):
    html, about, digest = figures.shown(results, figures.PLOTS / "error_time.py")
    profile = results.manifest.get("profile") or "default"
    about["commands"][0] = f"scripts/sweep.py scenarios/sweeps/error_time.toml --profile {profile}"
    html = html.replace("scenarios/sweeps/paper.toml", "scenarios/sweeps/error_time.toml")
    points = [point for scene in precision.scenes(results) for point in precision.points(results, *scene)]
    keep = ("run", "scene", "parameters", "step", "measure", "status", "error")
    return Section(html, {"figure": about, "points": [{k: p[k] for k in keep} for p in points]},
                   {"sha256": digest, "points": [{"run": p["run"], "time": p["time"], "least": p["least"]} for p in points]})
