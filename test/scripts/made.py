"""Results made by hand: folders of runs whose numbers a test chooses, and what a page or a panel shows of them."""
import csv
import html.parser
import json

from contactbench import gather, plan, templates
from contactbench.runs import Cell, Runs

# A run in which nothing happened; what a test is about it gives itself.
PLAIN = {
    "sweeps": "paper", "scene": "box", "method": "ap", "solver": "lemke", "repeat": "1", "status": "ok",
    "finished": "true", "step": "0.01", "duration": "2.0", "t_reached": "2.0", "steps": "200", "solves": "10",
    "processing_s": "1.0", "busy": "false", "false_claims": "0", "law_residual_max": "0.0", "peak_memory_mb": "10.0"}
EPS = {"method": "convex", "solver": "ipm", "epsilon": "1e-12"}


def row(**words):
    """A row of runs.csv; A-P has eight edges, and its run has the name that a sweep gives it."""
    of = {column: "" for column in gather.COLUMNS} | PLAIN | {name: str(word) for name, word in words.items()}
    of |= {"k": "8"} if of["method"] == "ap" and "k" not in words else {}
    return of | ({} if "run" in words else {"run": plan.Run.of(of).name})


def cell(**words):
    """One run as a cell, without files."""
    return Cell([row(**words)], "nowhere")


def csv_of(head, rows):
    """The text of a CSV file."""
    return "\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n"


def trajectory(rows):
    """trajectory.csv of (t, body, place, quaternion w x y z); one without the last (or with None) is not turned."""
    return csv_of("t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz",
                  [(t, body, *place, *(turn[0] if turn and turn[0] is not None else (1, 0, 0, 0)), *6 * (0, ))
                   for t, body, place, *turn in rows])


def write_rows(path, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, list(dict.fromkeys(c for of in rows for c in of)), "", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def write_files(folder, files):
    for name, text in files.items():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def results(top, rows, ensemble=(), **manifest):
    """A folder of results: rows as row() makes them, or only what differs from PLAIN, named r0__r1, r1__r1 ...; runs
    lie under runs/, with the "files" of each row, {name: text}."""
    rows = [dict(of) for of in rows]
    (top / "runs").mkdir(parents=True, exist_ok=True)
    for number, of in enumerate(rows):
        write_files(top / "runs" / of.setdefault("run", f"r{number}__r1"), of.pop("files", {}))
    write_rows(top / "runs.csv", [row(**of) for of in rows])
    if ensemble:
        write_rows(top / "ensemble.csv", [row(**{"run": f"m{number}"} | of) for number, of in enumerate(ensemble)])
    (top / "manifest.json").write_text(json.dumps(manifest))
    return Runs(top, top / "runs")


def lines_of(axes, **wanted):
    """The lines of a panel that have a name in its legend (no markers, no crosses), or that are as is wanted."""
    def fits(line):
        return all(getattr(line, f"get_{name}")() == value for name, value in wanted.items())

    return [line for line in axes.lines if (fits(line) if wanted else not line.get_label().startswith("_"))]


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
