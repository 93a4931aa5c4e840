#!/usr/bin/env python3
"""Every solver over every stored problem of a folder: one tidy table (CSV) and its summary (Markdown).

Runs `contactbench solve`, one process a problem and solver, and reads what it prints. Where a problem has a reference
(NAME.ref.json), the convex model's energy change and velocities are compared with it. Needs Python 3 only.
"""

import argparse
import collections
import csv
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

from sweeping import one

COLUMNS = ["problem", "kind", "method", "solver", "variant", "k", "epsilon", "compression_bound", "size", "contacts",
           "status", "reason", "iterations", "claimed_residual", "residual", "law_residual", "gap", "infeasibility",
           "false_claim", "energy_change_j", "reference", "reference_error", "velocity_error", "velocity_allowed", "time_min_s", "time_median_s", "busy", "notes"]


def arguments():
    root = pathlib.Path(__file__).resolve().parent.parent
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="*", type=pathlib.Path, default=[root / "test/data/problems", root / "test/data/stacks"],
                        help="folders with NAME.hdf5, NAME.dat, NAME.M.mtx + NAME.q.mtx [test/data]")
    parser.add_argument("--program", type=pathlib.Path, default=None, help="contactbench [build/bin/contactbench]")
    parser.add_argument("--out", type=pathlib.Path, default=root / "results/solve_all", help="folder of the tables")
    parser.add_argument("--k", type=int, nargs="+", default=[4, 8], help="edges of the friction polygon for ap")
    parser.add_argument("--epsilon-relative", default="1e-12",
                        help="convex: suboptimality as a fraction of the energy before the event")
    parser.add_argument("--repeat", type=int, default=5, help="timed solves of each problem")
    parser.add_argument("--limit", type=float, default=60, help="seconds for one problem and solver, repeats included")
    parser.add_argument("--only", default="", help="problems whose name contains this")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    args = parser.parse_args()
    if args.program is None:
        known = [p for p in sorted(root.glob("build*/bin/contactbench")) + sorted(root.glob("build/*/bin/contactbench"))]
        if not known:
            sys.exit("solve_all.py: no built program below build*/; give --program PATH")
        args.program = known[0]
    return args


def ask(program, flags, limit):
    """What one solve prints, or a row that says how it ended."""
    try:
        done = subprocess.run([str(program), "solve", "--json", *flags], capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return {"status": "time_limit", "reason": f"more than {limit:g} s"}
    if done.returncode in (0, 3) and done.stdout.strip():
        return json.loads(done.stdout)
    status = "input_error" if done.returncode == 2 else "crash"
    message = (done.stderr.strip().splitlines() or ["ended without a word"])[-1]
    return {"status": status, "reason": message}


def choices(program, ks, epsilon):
    """Flags of every solver: a list for LCPs and one for contact problems."""
    table = json.loads(subprocess.run([str(program), "list", "--json"], capture_output=True, text=True, check=True).stdout)
    lcp, contact = [], []
    methods = {row["name"]: row for row in table["methods"]}
    for row in table["solvers"]:
        # The solvers of A-P's problem and those without a method solve bare LCPs.
        if row["method"] in (None, "ap"):
            lcp.append({"solver": row["name"]})
    for name, row in methods.items():
        flags = {option["flag"] for option in row["options"]}
        for solver in row["solvers"] or [None]:
            for variant in row["variants"] or [None]:
                choice = {"method": name}
                if solver:
                    choice["solver"] = solver
                if variant:
                    choice["variant"] = variant
                if "k" in flags:
                    contact += [{**choice, "k": k} for k in ks]
                elif "compression-bound" in flags:
                    contact += [{**choice, "compression-bound": on, "epsilon-relative": epsilon} for on in ("on", "off")]
                else:
                    contact.append(choice)
    return lcp, contact


def problems(folders, only):
    """(name, kind, flags, reference) of every stored problem, by name."""
    found = []
    for folder in folders:
        for file in sorted(folder.iterdir()):
            if only not in file.name:
                continue
            if file.name.endswith(".M.mtx"):
                stem = file.name[:-6]
                found.append((stem, "lcp", ["--matrix", str(file), "--vector", str(folder / (stem + ".q.mtx"))],
                              folder / (stem + ".ref.json")))
            elif file.suffix in (".hdf5", ".h5"):
                found.append((file.stem, "contact", [str(file)], folder / (file.stem + ".ref.json")))
            elif file.suffix == ".dat":
                kind = "lcp" if file.name.startswith("lcp") else "contact"
                found.append((file.stem, kind, [str(file)], folder / (file.stem + ".ref.json")))
    return found


def read_reference(path):
    if not path.exists():
        return None
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def judge(row, choice, reference, velocities, solved):
    """Fills in what the reference says: the ending of exact Lemke, or the energy change, its relative error, and the
    largest error of u after the event over the largest speed before or after it. Kinetic energy being strictly
    convex, |du_i|^2 <= 3 w_i |dv|_M^2 <= 6 w_i (both gaps): what the reference's own gap allows."""
    if reference is None:
        return
    if row["kind"] == "lcp":
        row["reference"] = reference.get("exact_lemke", "")
        return
    key = {"on": "ds_kappa", "off": "ccp_nocap"}.get(choice.get("compression-bound"))
    answer = reference.get(key) if key else None
    if answer and row.get("energy_change_j") is not None and answer.get("dKE") is not None:
        row["reference"] = answer["dKE"]
        size = max(abs(answer["dKE"]), 1e-14 * abs(reference.get("KE_before", 0)))
        row["reference_error"] = abs(row["energy_change_j"] - answer["dKE"]) / size if size else abs(row["energy_change_j"])
        if velocities and answer.get("u"):
            fastest = max([solved["speed_before_m_per_s"], *map(abs, answer["u"])])
            worst = max(abs(a - b) for a, b in zip(velocities, answer["u"], strict=True))
            gap = abs(answer.get("gap") or 0) + abs(solved["gap"] or 0)
            row["velocity_error"] = worst / fastest if fastest else worst
            row["velocity_allowed"] = math.sqrt(6 * solved["weight_max_per_kg"] * gap) / fastest if fastest else 0


def read_vector(path):
    """The numbers of a Matrix Market array file with one column."""
    if not path.exists():
        return []
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("%")]
    return [float(line) for line in lines[1:]]


def solve_all(args, scratch):
    lcp, contact = choices(args.program, args.k, args.epsilon_relative)
    stored = problems(args.folder, args.only)
    rows, load = [], one.Load()
    for count, (name, kind, flags, reference_path) in enumerate(stored, 1):
        reference = read_reference(reference_path)
        for choice in lcp if kind == "lcp" else contact:
            chosen = [part for key, value in choice.items() for part in (f"--{key}", str(value))]
            velocities = scratch / "u.mtx"
            velocities.unlink(missing_ok=True)
            if choice.get("method") == "convex":
                chosen += ["--velocities", str(velocities)]
            start = time.monotonic()
            answer = ask(args.program, [*flags, "--kind", kind, "--repeat", str(args.repeat), *chosen], args.limit)
            row = {column: answer.get(column) for column in COLUMNS}
            others = load.others(start)
            row.update(problem=name, kind=kind, method=choice.get("method"), solver=choice.get("solver"),
                       variant=choice.get("variant"), k=choice.get("k"), compression_bound=choice.get("compression-bound"),
                       busy=None if others is None else others > one.BUSY, epsilon=choice.get("epsilon-relative"), iterations=answer.get("iterations", answer.get("pivots")),
                       notes="; ".join(answer.get("notes", [])))
            judge(row, choice, reference, read_vector(velocities), answer)
            rows.append(row)
        if not args.quiet and sys.stderr.isatty():
            print(f"\r{count}/{len(stored)} {name:<60}", end="", file=sys.stderr)
    if not args.quiet and sys.stderr.isatty():
        print(file=sys.stderr)
    return rows


def label(row):
    parts = [row["method"] or "lcp", row["solver"], row["variant"]]
    if row["k"] is not None:
        parts.append(f"k={row['k']}")
    if row["compression_bound"]:
        parts.append(f"bound {row['compression_bound']}")
    return " ".join(str(part) for part in parts if part)


def number(x):
    return f"{x:.2g}" if isinstance(x, (int, float)) and math.isfinite(x) else ""


def markdown(rows):
    lines = ["# All solvers over all stored problems", "",
             "`ok`: the check on the original data confirms the claim. Worst checked residual and median time are over the `ok` ones; "
             "errors of energy change and velocity are against the stored references (`convex`), energy's relative, velocity's over the "
             "largest speed; beside the worst one stands the most that the references' own gaps (near 1e-12 J) allow.", "",
             "| solver | problems | ok | other endings | false claims | worst residual | worst energy error | worst velocity error | allowed there "
             "| median time, us |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    groups = collections.OrderedDict()
    for row in rows:
        groups.setdefault((row["kind"], label(row)), []).append(row)
    for (_, name), group in groups.items():
        good = [row for row in group if row["status"] == "ok"]
        others = collections.Counter(row["status"] for row in group if row["status"] != "ok")
        worst = max((row for row in good if row.get("velocity_error") is not None), key=lambda row: row["velocity_error"], default={})
        times = [row["time_median_s"] for row in good if row["time_median_s"] is not None]
        lines.append("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |".format(
            name, len(group), len(good), ", ".join(f"{status} {n}" for status, n in sorted(others.items())),
            sum(bool(row["false_claim"]) for row in group),
            number(max((row["residual"] for row in good if row["residual"] is not None), default=None)),
            number(max((row["reference_error"] for row in good if row.get("reference_error") is not None), default=None)),
            number(worst.get("velocity_error")), number(worst.get("velocity_allowed")),
            number(1e6 * statistics.median(times)) if times else ""))
    lines += ["", "## Endings other than ok", "", "| problem | solver | status | reference | why |", "|---|---|---|---|---|"]
    for row in rows:
        if row["status"] != "ok":
            lines.append("| {} | {} | {} | {} | {} |".format(row["problem"], label(row), row["status"],
                                                         row["reference"] if row["reference"] is not None else "",
                                                         (row["reason"] or "").replace("|", "/")))
    return "\n".join(lines) + "\n"


def main():
    args = arguments()
    for folder in args.folder:
        if not folder.is_dir():
            sys.exit(f"solve_all.py: {folder}: no such folder")
    with tempfile.TemporaryDirectory() as scratch:
        rows = solve_all(args, pathlib.Path(scratch))
    if not rows:
        sys.exit("solve_all.py: no problems found; a folder must hold NAME.hdf5, NAME.dat or NAME.M.mtx")
    args.out.mkdir(parents=True, exist_ok=True)
    with open(args.out / "solve_all.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    (args.out / "solve_all.md").write_text(markdown(rows), encoding="utf-8")
    print(f"{len(rows)} solves: {args.out / 'solve_all.csv'}, {args.out / 'solve_all.md'}")


if __name__ == "__main__":
    main()
