"""Results made by hand: folders of runs whose numbers a test chooses, and the tables of a page as words."""
import csv
import html.parser
import json
from pathlib import Path

from contactbench import gather, plan, templates
from contactbench.runs import Cell, Runs

# A run in which nothing happened; what a test is about it gives itself.
PLAIN = {
    "sweeps": "paper", "scene": "box", "method": "ap", "solver": "lemke", "k": "8", "repeat": "1", "status": "ok",
    "finished": "true", "step": "0.01", "duration": "2.0", "t_reached": "2.0", "steps": "200", "solves": "10",
    "processing_s": "1.0", "busy": "false", "false_claims": "0", "law_residual_max": "0.0", "peak_memory_mb": "10.0"}
EPS = {"method": "convex", "solver": "ipm", "k": "", "epsilon": "1e-12"}


def row(**words):
    """A row of runs.csv; its run has the name that a sweep gives it."""
    of = {column: "" for column in gather.COLUMNS} | PLAIN | {name: str(word) for name, word in words.items()}
    return of | ({} if "run" in words else {"run": plan.Run.of(of).name})


def cell(**words):
    """One run as a cell, without files."""
    return Cell([row(**words)], "nowhere")


def write_rows(path, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, list(dict.fromkeys(c for of in rows for c in of)), "", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def results(folder, rows, ensemble=(), **manifest):
    """A folder of results of these rows; the runs lie in it under runs/."""
    folder = Path(folder)
    write_rows(folder / "runs.csv", rows)
    if ensemble:
        write_rows(folder / "ensemble.csv", ensemble)
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / "runs").mkdir(exist_ok=True)
    return Runs(folder, folder / "runs")


def write_motion(of, run, places, file="trajectory.csv", head="t,body,px,py,pz"):
    """The trajectory of a run: rows of numbers and words."""
    folder = of.runs / run
    folder.mkdir(parents=True, exist_ok=True)
    (folder / file).write_text("\n".join([head, *(",".join(map(str, place)) for place in places)]) + "\n")


class Reader(html.parser.HTMLParser):
    """Tables of a page: lists of rows, a list of words each; cells are told apart by where the next one begins."""
    def __init__(self):
        super().__init__()
        self.tables, self.words, self.inside = [], [], False

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
            self.inside = True
        elif tag == "br" and self.inside:
            self.tables[-1][-1][-1] += " | "

    def handle_endtag(self, tag):
        self.inside = self.inside and tag not in ("td", "th", "table")

    def handle_data(self, data):
        self.words.append(data)
        if self.inside:
            self.tables[-1][-1][-1] += data


def page(name, shown, **more):
    """(tables, all words) of a section of the report."""
    reader = Reader()
    reader.feed(templates.render(f"sections/{name}.html", s=shown, sections={}, **more))
    tidy = lambda text: " ".join(text.split())
    return [[[*map(tidy, cells)] for cells in rows] for rows in reader.tables], tidy(" ".join(reader.words))
