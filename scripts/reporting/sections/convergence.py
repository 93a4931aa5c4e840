"""Observed order in the step, and the friction polygon's error against its number of edges."""
from .. import precision
from ..section import Section, esc, table

TITLE = "Order in the step and in the polygon"


def numbers(some):
    return ", ".join(f"{v:.3g}" for v in some)


def build(results):
    orders, polygons = precision.orders(results), precision.polygons(results)
    html = ["<p>Largest error over time at steps halved three times, and the slope of its logarithm. No order is claimed where fewer "
            "than three halvings finished, where they differ by more than 0.5, or where nothing is left to converge.</p>",
            table(["scene", "method", "against", "errors, m (step from coarse to fine)", "each halving", "order"],
                  [[esc(f"{r['scene'].replace('_', ' ')} {r['parameters']}"), esc(r["method"]), esc(r["against"]), esc(numbers(r["errors"])),
                    esc(numbers(r["halvings"])), "not claimed" if r["order"] is None else f"{r['order']:.3f}"] for r in orders]),
            "<p>A polygon of k edges inscribed in the friction circle loses up to 1 - cos(pi/k) of it. Measured: largest distance from "
            "the exact answer of Coulomb's cone, and the slope of its logarithm against that of the loss, from 8 edges on and where the "
            "polygon's error is above three times the step's (1: the error is the loss).</p>",
            table(["scene", "polygon", "k", "1 - cos(pi/k)", "error, m", "of it the step's, m", "slope"],
                  [[esc(f"{r['scene'].replace('_', ' ')} {r['parameters']}"), esc(r["turned"]), esc(", ".join(map(str, r["k"]))),
                    esc(numbers(r["loss"])), esc(numbers(r["errors"])), esc(numbers(r["step_errors"])),
                    "" if r["slope"] is None else f"{r['slope']:.3f}"] for r in polygons])]

    def plain(rows):
        return [{k: v for k, v in r.items() if k != "cells"} | {"runs": [c["run"] for c in r["cells"]]} for r in rows]
    return Section("\n".join(html), {"orders": plain(orders), "polygons": plain(polygons)})
