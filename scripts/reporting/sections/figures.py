"""Every figure with what the paper's shows, and the commands that made its data."""
import ast
import hashlib
from pathlib import Path

from ..section import Section, code, esc, picture

TITLE = "Figures"
PLOTS = Path(__file__).resolve().parents[2] / "plots"


def about(script):
    """The head of a plot script, and its SCENE; scripts are read, not run."""
    tree = ast.parse(script.read_text())
    scene = next((node.value.value for node in tree.body if isinstance(node, ast.Assign)
                  and getattr(node.targets[0], "id", "") == "SCENE" and isinstance(node.value, ast.Constant)), "")
    return " ".join((ast.get_docstring(tree) or script.stem).split()), scene


def scripts(pattern="*.py"):
    """figure01 ... figure11 first, then the other pictures."""
    # Those of other sections stand there.
    elsewhere = ("common", "error_time", "error_budget", "performance", "stored_problems", "streams")
    found = [p for p in sorted(PLOTS.glob(pattern)) if p.stem not in elsewhere]
    return sorted(found, key=lambda p: (not p.stem.startswith("figure"), p.stem))


def shown(results, script, sweep="paper", made_by=None):
    """One figure as HTML, and what report.json says of it: of the runs of a sweep, or of what the command `made_by` writes."""
    text, scene = about(script)
    title, _, rest = text.partition(": ")
    image = results.folder / "figures" / f"{script.stem}.png"
    profile = results.manifest.get("profile") or "default"
    cells = results.cells(scene) if scene else []
    runs = [cell.command for cell in cells]
    made = [made_by or f"scripts/sweep.py scenarios/sweeps/{sweep}.toml --profile {profile}",
            f"scripts/plots/{script.name} --results results --runs results/runs/{profile}"]
    body = picture(image, title) if image.exists() else f'<p class="warn">{esc(script.stem)} could not be drawn.</p>'
    missing = f'<p class="open">{esc(scene)}: {esc(results.missing(scene))}</p>' if scene and results.missing(scene) else ""
    busy = "<p><small>Some of the runs were disturbed by others on the machine; their times are too high.</small></p>" \
        if not made_by and any(c.busy for c in cells or results.cells(sweep=sweep)) else ""
    html = (f'<figure id="{script.stem}"><figcaption><b>{esc(title)}.</b> {esc(rest[:1].upper() + rest[1:])}</figcaption>{missing}{busy}{body}'
            f"{code(made + [''] + runs, 'commands that made its data')}</figure>")
    return html, {"says": text, "scene": scene, "commands": made + runs}, \
        hashlib.sha256(image.read_bytes()).hexdigest() if image.exists() else None


def build(results):
    found = {script.stem: shown(results, script) for script in scripts()}
    return Section("\n".join(html for html, _, _ in found.values()), {name: data for name, (_, data, _) in found.items()},
                   {name: {"sha256": digest} for name, (_, _, digest) in found.items()})
