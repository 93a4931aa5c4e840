"""Results of made-up runs, for tests whose numbers are known. What a test does not give is the same in all of them."""
import csv
import json

from contactbench import gather
from contactbench.runs import Runs

GIVEN = {
    "sweeps": "paper", "scene": "s", "method": "ap", "solver": "lemke", "repeat": "1", "status": "ok", "finished": "true",
    "step": "0.01", "duration": "1", "steps": "100", "false_claims": "0", "busy": "false", "processing_s": "1"}


def csv_of(head, rows):
    """The text of a CSV file."""
    return "\n".join([head, *(",".join(map(str, row)) for row in rows)]) + "\n"


def trajectory(rows):
    """trajectory.csv of (t, body, place, quaternion w x y z)."""
    return csv_of("t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz",
                  [(t, body, *place, *((1, 0, 0, 0) if turn is None else turn), *6 * (0, )) for t, body, place, turn in rows])


def write(path, rows):
    names = dict.fromkeys([*gather.COLUMNS, *(c for row in rows for c in row)])
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, list(names), "", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def results(top, rows, members=(), **manifest):
    """runs.csv with a row each, ensemble.csv and the files of the runs: a row's "files" are {name: text}."""
    top.mkdir(parents=True, exist_ok=True)
    (top / "runs").mkdir(exist_ok=True)
    lines = []
    for number, row in enumerate(rows):
        row = {"run": f"r{number}__r1", **GIVEN, **row}
        for name, text in row.pop("files", {}).items():
            (top / "runs" / row["run"]).mkdir(exist_ok=True)
            (top / "runs" / row["run"] / name).write_text(text)
        lines.append(row)
    write(top / "runs.csv", lines)
    if members:
        write(top / "ensemble.csv", [{"run": f"m{n}", **GIVEN, **row} for n, row in enumerate(members)])
    (top / "manifest.json").write_text(json.dumps(manifest))
    return Runs(top, top / "runs")


def lines_of(axes, **wanted):
    """The lines of a panel that have a name in its legend (no markers, no crosses), or that are as is wanted."""
    def fits(line):
        return all(getattr(line, f"get_{name}")() == value for name, value in wanted.items())

    return [line for line in axes.lines if (fits(line) if wanted else not line.get_label().startswith("_"))]
