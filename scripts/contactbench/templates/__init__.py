"""The pages and tables that scripts/ write, as Jinja templates. Values of report.html are escaped by `| e`."""
import base64
import html
import json
import math
from pathlib import Path

import jinja2


def embedded(path):
    """A picture inside the page, so that the page needs nothing else."""
    return "data:image/png;base64," + base64.b64encode(Path(path).read_bytes()).decode()


def known(x, digits=3):
    """A number; nothing of nan or None."""
    return "" if x is None or math.isnan(x) and not hasattr(x, "values") else f"{x:.{digits}g}"


def short(cell):
    """A number of a table to three digits; words as they are."""
    try:
        return f"{float(cell):.3g}"
    except ValueError:
        return cell


TEMPLATES = jinja2.Environment(loader=jinja2.FileSystemLoader(Path(__file__).parent), trim_blocks=True,
                               lstrip_blocks=True, keep_trailing_newline=True, undefined=jinja2.StrictUndefined)
TEMPLATES.filters |= {
    "e": lambda text: html.escape(str(text)), "embedded": embedded, "json": json.dumps, "g3": lambda x: f"{x:.3g}",
    "short": short, "g2": lambda x: known(x, 2), "g4": lambda x: known(x, 4), "fixed": lambda x, digits: f"{x:.{digits}f}",
    "g3_known": known, "words": lambda name: name.replace("_", " "), "numbers": lambda some: ", ".join(f"{x:.3g}"
                                                                                                       for x in some)}


def render(template, **values):
    return TEMPLATES.get_template(template).render(values)
