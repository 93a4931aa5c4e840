"""Every solver over every stored problem of a folder: one tidy table (CSV) and its summary (Markdown).

Runs `contactbench solve`, one process a problem and solver, and reads what it prints. Where a problem has a reference
(NAME.ref.json), the convex model's energy change and velocities are compared with it.
"""
import collections
import json
import math
import statistics
import sys
import tempfile
import time
from pathlib import Path

from . import program
from .gather import number
from .runs import table_of, write_table
from .templates import known, render

COLUMNS = [
    "problem", "kind", "method", "solver", "variant", "k", "epsilon", "compression_bound", "size", "contacts", "status",
    "reason", "iterations", "claimed_residual", "residual", "law_residual", "gap", "infeasibility", "false_claim",
    "energy_change_j", "reference", "reference_error", "velocity_error", "velocity_allowed", "time_min_s",
    "time_median_s", "busy", "notes"]
CHOSEN = ("method", "solver", "variant", "k", "compression_bound")


def arguments(words):
    root = program.ROOT
    parser = program.flags(__doc__)
    parser.add_argument("folder", nargs="*", type=Path, default=[
        root / "test/data/problems", root / "test/data/stacks"],
                        help="folders with NAME.hdf5, NAME.dat, NAME.M.mtx + NAME.q.mtx [test/data]")
    parser.add_argument("--program", type=Path, default=None, help="contactbench [build/bin/contactbench]")
    parser.add_argument("--out", type=Path, default=root / "results/solve_all", help="folder of the tables")
    parser.add_argument("--k", type=int, nargs="+", default=[4, 8], help="edges of the friction polygon for ap")
    parser.add_argument("--epsilon-relative", default="1e-12",
                        help="convex: suboptimality as a fraction of the energy before the event")
    parser.add_argument("--repeat", type=int, default=5, help="timed solves of each problem")
    parser.add_argument("--limit", type=program.positive, default=60,
                        help="seconds for one problem and solver, repeats included")
    parser.add_argument("--only", default="", help="problems whose name contains this")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    args = parser.parse_args(words)
    if args.program is None:
        built = sorted(root.glob("build*/bin/contactbench")) + sorted(root.glob("build/*/bin/contactbench"))
        args.program = built[0] if built else sys.exit(
            "solve_all.py: no built program below build*/; give --program PATH")
    return args


def ask(path, flags, limit):
    """What one solve prints, or a row that says how it ended."""
    try:
        done = program.call(path, "solve", "--json", *flags, timeout=limit)
    except program.Late:
        return {"status": "time_limit", "reason": f"more than {limit:g} s"}
    if done.returncode in (0, 3) and done.stdout.strip():
        return json.loads(done.stdout)
    message = (done.stderr.strip().splitlines() or ["ended without a word"])[-1]
    return {"status": "input_error" if done.returncode == 2 else "crash", "reason": message}


def choices(said, ks, epsilon):
    """Flags of every solver: a list for LCPs and one for contact problems."""
    # The solvers of A-P's problem and those without a method solve bare LCPs.
    lcp, contact = [{"solver": row["name"]} for row in said["solvers"] if row["method"] in (None, "ap")], []
    for method, variant, solver in program.choices(said, unavailable=True)[0]:
        flags = {option["flag"] for option in method["options"]}
        choice = {
            key: word for key, word in (("method", method["name"]), ("solver", solver), ("variant", variant)) if word}
        more = [{"k": k} for k in ks] if "k" in flags else [{}]
        if "compression-bound" in flags:
            more = [{"compression-bound": bound, "epsilon-relative": epsilon} for bound in ("on", "off")]
        contact += [{**choice, **knobs} for knobs in more]
    return lcp, contact


def problems(folders, only):
    """(name, kind, flags, file of the reference) of every stored problem, by name."""
    for folder in folders:
        for file in sorted(file for file in folder.iterdir() if only in file.name):
            stem, kind, flags = file.stem, "contact", [str(file)]
            if file.name.endswith(".M.mtx"):
                stem, kind = file.name[:-6], "lcp"
                flags = ["--matrix", str(file), "--vector", str(folder / f"{stem}.q.mtx")]
            elif file.suffix == ".dat":
                kind = "lcp" if file.name.startswith("lcp") else "contact"
            elif file.suffix not in (".hdf5", ".h5"):
                continue
            yield stem, kind, flags, folder / f"{stem}.ref.json"


def judge(row, choice, reference, velocities, solved):
    """Fills in what the reference says: the ending of exact Lemke, or the energy change, its relative error, and the
    largest error of u after the event over the largest speed before or after it. Kinetic energy being strictly
    convex, |du_i|^2 <= 3 w_i |dv|_M^2 <= 6 w_i (both gaps): what the reference's own gap allows."""
    if reference and row["kind"] == "lcp":
        row["reference"] = reference.get("exact_lemke", "")
        return
    answer = (reference or {}).get({"on": "ds_kappa", "off": "ccp_nocap"}.get(choice.get("compression-bound")))
    if not answer or row.get("energy_change_j") is None or answer.get("dKE") is None:
        return
    row["reference"] = answer["dKE"]
    size = max(abs(answer["dKE"]), 1e-14 * abs(reference.get("KE_before", 0)))
    row["reference_error"] = abs(row["energy_change_j"] - answer["dKE"]) / (size or 1)
    if velocities and answer.get("u"):
        fastest = max([solved["speed_before_m_per_s"], *map(abs, answer["u"])])
        worst = max(abs(a - b) for a, b in zip(velocities, answer["u"], strict=True))
        gap = abs(answer.get("gap") or 0) + abs(solved["gap"] or 0)
        row["velocity_error"] = worst / (fastest or 1)
        row["velocity_allowed"] = math.sqrt(6 * solved["weight_max_per_kg"] * gap) / fastest if fastest else 0


def solve_all(args, scratch):
    said = program.listed(args.program)
    lcp, contact = choices(said, args.k, args.epsilon_relative)
    stored, rows, load = list(problems(args.folder, args.only)), [], program.Load()
    show = not args.quiet and sys.stderr.isatty()
    for count, (name, kind, flags, reference_path) in enumerate(stored, 1):
        reference = program.read_json(reference_path)
        for choice in lcp if kind == "lcp" else contact:
            chosen = [part for key, value in choice.items() for part in (f"--{key}", str(value))]
            velocities = scratch / "u.mtx"
            velocities.unlink(missing_ok=True)
            if choice.get("method") == "convex":
                chosen += ["--velocities", str(velocities)]
            start = time.monotonic()
            answer = ask(args.program, [*flags, "--kind", kind, "--repeat", str(args.repeat), *chosen], args.limit)
            others = load.others(start)
            row = {column: answer.get(column) for column in COLUMNS} | {"problem": name, "kind": kind}
            row |= {column: choice.get(column.replace("_", "-")) for column in CHOSEN}
            row |= {"epsilon": choice.get("epsilon-relative"), "notes": "; ".join(answer.get("notes", []))}
            row |= {"iterations": answer.get("iterations", answer.get("pivots"))}
            row |= {"busy": None if others is None else others > program.BUSY}
            judge(row, choice, reference, program.read_vector(velocities), answer)
            rows.append(row)
        if show:
            print(f"\r{count}/{len(stored)} {name:<60}", end="\n" if count == len(stored) else "", file=sys.stderr)
    return rows


def main(words=None):
    args = arguments(words)
    for folder in args.folder:
        if not folder.is_dir():
            sys.exit(f"solve_all.py: {folder}: no such folder")
    with tempfile.TemporaryDirectory() as scratch:
        rows = solve_all(args, Path(scratch))
    if not rows:
        sys.exit("solve_all.py: no problems found; a folder must hold NAME.hdf5, NAME.dat or NAME.M.mtx")
    args.out.mkdir(parents=True, exist_ok=True)
    write_table(rows, COLUMNS, args.out / "solve_all.csv")
    table = table_of(args.out / "solve_all.csv").to_dict("records")
    (args.out / "solve_all.md").write_text(markdown(table), encoding="utf-8")
    print(f"{len(rows)} solves: {args.out / 'solve_all.csv'}, {args.out / 'solve_all.md'}")


# The tables as they are read: results/solve_all, and results/replay/SCENE of scripts/replay.py.


def rows_of(results, folder="solve_all"):
    """Solves of a folder, but those of a solver that is not installed here: it has no place in a comparison."""
    table = results.read(f"{folder}/solve_all.csv")
    return [] if table is None else [row for row in table.to_dict("records") if row["status"] != "unavailable"]


def streams(results):
    """{scene with its parameters: rows} of the replayed streams."""
    found = sorted((results.folder / "replay").glob("*/solve_all.csv"))
    return {
        path.parent.name.replace("__", " ").replace("-", "=").replace("_", " "): rows_of(
            results, path.parent.relative_to(results.folder)) for path in found}


def solver(row):
    parts = [
        row["method"] or "LCP", row["solver"], row["variant"], f"k = {row['k']}" if row["k"] else "",
        f"bound {row['compression_bound']}" if row["compression_bound"] else ""]
    return " ".join(p for p in parts if p)


def by_solver(some):
    """{(kind, solver): rows}."""
    groups = {}
    for row in some:
        groups.setdefault((row["kind"], solver(row)), []).append(row)
    return groups


def of(group, column):
    """A column of those that ended ok."""
    return [number(r[column]) for r in group if r["status"] == "ok" and r[column]]


def counted(group):
    """Counts (`busy`: solves during which others used the machine); worst checked residual, median residual against
    Coulomb and median time of the ok ones."""
    count = {"problems": len(group), "ok": sum(r["status"] == "ok" for r in group)}
    count |= {
        name: sum(r[column] == "True" for r in group)
        for name, column in (("false_claims", "false_claim"), ("busy", "busy"))}
    count["residual"] = max(of(group, "residual"), default=math.nan)
    count["law_residual"] = statistics.median(of(group, "law_residual") or [math.nan])
    return count | {"time": statistics.median(of(group, "time_median_s") or [math.nan])}


def summary(some):
    return {key: counted(group) for key, group in by_solver(some).items()}


def markdown(some):
    lines = []
    for (_, name), group in by_solver(some).items():
        count, others = counted(group), collections.Counter(r["status"] for r in group if r["status"] != "ok")
        ends = ", ".join(f"{status} {n}" for status, n in sorted(others.items()))
        errors = zip(of(group, "velocity_error"), of(group, "velocity_allowed"))  # both are known or neither
        worst = max(errors, default=(math.nan, math.nan), key=lambda pair: pair[0])
        numbers = [count["residual"], max(of(group, "reference_error"), default=math.nan), *worst, 1e6 * count["time"]]
        lines.append([name, len(group), count["ok"], ends, count["false_claims"], *(known(x, 2) for x in numbers)])
    return render("solve_all.md", solvers=lines, bad=[(solver(row), row) for row in some if row["status"] != "ok"])
