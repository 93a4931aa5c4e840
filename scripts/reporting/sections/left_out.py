"""What runs leave out: what each thing saves where it applies, and costs where it does not (bench_prune)."""
import csv

from ..section import Section, esc, table

TITLE = "What is left out"


def build(results):
    path = results.folder / "left_out.csv"
    if not path.exists():
        return Section("<p>Not measured: <code>build/bin/bench_prune results/left_out.csv</code> needs Google Benchmark's "
                       "package, without which bench/ is not built.</p>")
    with path.open() as file:
        rows = list(csv.DictReader(file))
    html = ("<p>Steps of two simulations that differ in one thing, in turns; smallest of the batches, CPU time. A ratio below 1 is "
            "a saving. The answers are the same (<code>test/acceptance/pruning.py</code>).</p>")
    for kind, head in (("saves", "Where it applies"), ("costs", "Where there is nothing of it to leave out"),
                       ("speed", "All of it on, beside all of it off")):
        chosen = [row for row in rows if row["table"] == kind]
        html += f"<h3>{head}</h3>" + table(["what", "scene", "method", "left out, us", "left in, us", "ratio", "status"], [
            [esc(row["what"]), esc(row["scene"]), esc(row["method"]), row["with_us"], row["without_us"], row["ratio"],
             esc(row["status"])] for row in chosen])
    return Section(html, timing={"rows": rows})
