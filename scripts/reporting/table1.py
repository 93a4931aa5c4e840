"""Table I: processing time of each method on each scene at the paper's settings, beside what the paper prints.

The paper's numbers (paper_table1.csv) are those that a scan of it shows; cells whose column the scan lost are marked. Another
machine, fifteen years ago: what can be compared are ratios inside a column. The unit of a column is the convex method at
1e-12 J, here and there, because it is the only one that the paper has a time for in every column.
"""
import csv
import html
import math
from pathlib import Path

# Column: scene, parameters, the paper's k, heading.
COLUMNS = [("impacting_sphere", "", "8", "impacting sphere"), ("sliding_box", "", "16", "sliding box"),
           ("sticking_box", "", "8", "sticking box"), ("circular_sliding", "", "8", "circular sliding")]
COLUMNS += [("stack", f"boxes={n}", "4", f"stack of {n}") for n in (1, 2, 4, 8, 16)]
COLUMNS += [("mobile_robot", "", "4", "mobile robot"), ("grasp", "", "12", "grasp")]
FIELDS = ["method", "variant", "solver", "epsilon", "k", "scene", "parameters", "simulated_s", "repeats", "status", "reason",
          "t_reached", "median_s", "minimum_s", "ratio", "busy", "paper_s", "paper_certain", "paper_ratio"]


def paper_times():
    """(method, solver, epsilon or "", column) -> (seconds or "DNF", certain)."""
    times = {}
    with open(Path(__file__).with_name("paper_table1.csv"), newline="") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            scene, _, boxes = row["scene"].partition("_") if row["scene"].startswith("stack") else (row["scene"], "", "")
            column = (scene, f"boxes={boxes}" if boxes else "")
            solver = "" if row["method"] == "convex" else row["solver"]
            times[row["method"], solver, row["epsilon"], *column] = (row["processing_s"], row["certain"] == "yes")
    return times


def paper_cell(times, cell):
    solver = "" if cell["method"] == "convex" else cell["solver"]
    for epsilon in (cell["epsilon"], ""):
        found = times.get((cell["method"], solver, epsilon, cell["scene"], cell["parameters"]))
        if found:
            return found
    return "", True


def is_unit(cell):
    return cell["method"] == "convex" and cell["epsilon"] == "1e-12"


def entries(results):
    """A row a cell of the table; what is missing or has no time is empty."""
    times, out = paper_times(), []
    for scene, parameters, k, _ in COLUMNS:
        column = [c for c in results.cells(scene, parameters=parameters, knobs="") if c["k"] in ("", k)]
        unit = next((c.seconds for c in column if is_unit(c) and c.finished), math.nan)
        paper_unit = next((paper_cell(times, c)[0] for c in column if is_unit(c)), "")
        for cell in column:
            paper, certain = paper_cell(times, cell)
            timed = cell.finished and cell.times
            worst = next((r for r in cell.rows if r["finished"] != "true"), cell.row)
            row = {**{f: cell[f] for f in ("method", "variant", "solver", "epsilon", "k", "scene", "parameters")},
                   "simulated_s": cell["duration"], "repeats": len(cell.rows), "status": worst["status"], "reason": worst["reason"],
                   "t_reached": worst["t_reached"], "median_s": cell.seconds if timed else "",
                   "minimum_s": min(cell.times) if timed else "", "ratio": cell.seconds / unit if timed and unit == unit else "",
                   "busy": "true" if cell.busy else "false", "paper_s": paper, "paper_certain": "yes" if certain else "no",
                   "paper_ratio": float(paper) / float(paper_unit) if numeric(paper) and numeric(paper_unit)
                   and float(paper_unit) > 0 else ""}
            out.append((cell, row))
    return out


def numeric(text):
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def ours(row):
    """Time in s, or the status with the simulated time that was reached."""
    if row["median_s"] != "":
        return f"{row['median_s']:.3g}" + ("" if row["status"] == "ok" else f" ({row['status']})")
    return row["status"] + (f" at {float(row['t_reached']):.3g} s" if row["t_reached"] else "")


def theirs(row):
    return row["paper_s"] + ("" if row["paper_certain"] == "yes" or not row["paper_s"] else "?")


def ratio(value):
    return "" if value == "" else f"{value:.0f}" if value >= 99.5 else f"{value:.2g}"


def grid(results):
    """Names of the methods, and {(method, column): row}."""
    names, table = [], {}
    for cell, row in entries(results):
        if cell.name not in names:
            names.append(cell.name)
        table[cell.name, cell["scene"], cell["parameters"]] = row
    return names, table


def heading(results, scene, parameters, k, title):
    durations = {c["duration"] for c in results.cells(scene, parameters=parameters, knobs="") if c["duration"]}
    return title, ", ".join([f"{float(d):g} s" for d in sorted(durations)] + [f"k = {k}"])


def markdown(results):
    names, table = grid(results)
    heads = [" ".join([title, f"({about})"]) for title, about in (heading(results, *c) for c in COLUMNS)]
    lines = ["| s (ratio) / paper's s (ratio) | " + " | ".join(heads) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    for name in names:
        cells = []
        for scene, parameters, _, _ in COLUMNS:
            row = table.get((name, scene, parameters))
            cells.append("" if row is None else ours(row) + bracket(row["ratio"]) + (f" / {theirs(row)}{bracket(row['paper_ratio'])}"
                                                                                      if row["paper_s"] else ""))
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def bracket(value):
    return f" ({ratio(value)})" if value != "" else ""


def tex(text):
    for plain, escaped in (("\\", r"\textbackslash "), ("_", r"\_"), ("%", r"\%"), ("&", r"\&"), ("#", r"\#")):
        text = text.replace(plain, escaped)
    return text


def latex(results):
    """A tabular for \\input; needs booktabs, and a wide page (\\usepackage{rotating}, sidewaystable)."""
    names, table = grid(results)
    lines = [r"% Processing time in s, and its ratio to convex at 1e-12 J in the column; below in italics what the paper prints.",
             r"\begin{tabular}{l" + "r" * len(COLUMNS) + "}", r"\toprule"]
    for part in (0, 1):
        lines.append(" & ".join([""] + [tex(heading(results, *c)[part]) for c in COLUMNS]) + r" \\")
    lines.append(r"\midrule")
    for name in names:
        rows = [table.get((name, scene, parameters)) for scene, parameters, _, _ in COLUMNS]
        lines.append(" & ".join([tex(name)] + ["" if r is None else tex(ours(r) + bracket(r["ratio"])) for r in rows]) + r" \\")
        lines.append(" & ".join([""] + ["" if r is None or not r["paper_s"] else
                                       rf"\emph{{{tex(theirs(r) + bracket(r['paper_ratio']))}}}" for r in rows]) + r" \\")
    return "\n".join(lines + [r"\bottomrule", r"\end{tabular}"]) + "\n"


def web(results):
    """As HTML: a cell has our time and ratio, below it the paper's."""
    names, table = grid(results)
    heads = "".join(f"<th>{html.escape(title)}<br><small>{html.escape(about)}</small></th>"
                    for title, about in (heading(results, *c) for c in COLUMNS))
    lines = [f'<div class="wide"><table class="table1"><thead><tr><th>method</th>{heads}</tr></thead><tbody>']
    for name in names:
        cells = []
        for scene, parameters, _, _ in COLUMNS:
            row = table.get((name, scene, parameters))
            if row is None:
                cells.append("<td></td>")
                continue
            kind = "good" if row["status"] == "ok" else "bad"
            mark = "*" if row["busy"] == "true" and row["median_s"] != "" else ""
            paper = f'<br><i>{html.escape(theirs(row) + bracket(row["paper_ratio"]))}</i>' if row["paper_s"] else ""
            cells.append(f'<td class="{kind}" title="{html.escape(row["reason"])}">{html.escape(ours(row))}{mark}'
                         f'<small>{bracket(row["ratio"])}</small>{paper}</td>')
        lines.append(f"<tr><th>{html.escape(name)}</th>{''.join(cells)}</tr>")
    return "\n".join(lines + ["</tbody></table></div>"])


def write(results):
    """table1.csv, .md and .tex in the folder of the results."""
    with open(results.folder / "table1.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(row for _, row in entries(results))
    (results.folder / "table1.md").write_text(markdown(results))
    (results.folder / "table1.tex").write_text(latex(results))
