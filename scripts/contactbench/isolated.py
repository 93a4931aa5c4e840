"""Models in isolation (docs/engines.md, "In isolation"): contact problems that engines solved, with their answers,
solved again by our methods on the same data; and Siconos' solvers of exact friction beside ours on stored problems.

  scripts/isolated.py problems --out results/engines    runs three scenes in the engines that give their problems away,
                                                        keeps a problem of each: own_problems.csv and .hdf5 files
  scripts/isolated.py solvers --out results/engines     build/bin/bench_siconos_solvers on the stored problems:
                                                        siconos_solvers.csv, .md, and their performance profile
"""
import functools
import itertools
import math
import shutil
import sys
import tempfile
from pathlib import Path

from . import program, solve_all
from .gather import number
from .runs import table_of, write_table

# Scene, parameters, and the time whose problem is kept: at rest and sliding, at rest, falling on each other.
SCENES = (("sliding_box", (), 2.0), ("stack", ("boxes=4", ), 0.5), ("engines/pile.xml", (), 1.0))
# What keeps a problem, and how.
ENGINES = (("mujoco", "newton-elliptic"), ("mujoco", "newton-elliptic-stiff"), ("mujoco", "newton-pyramidal"),
           ("dart", "dantzig"), ("siconos", "nsgs"), ("siconos", "nsgs-tight"))
STEP = 1e-3  # s
# Solved to the end: M, J, v-, r and v+ agree as far as a solver goes.
KNOBS = {"mujoco": ("--knob", "tolerance=1e-15")}
COLUMNS = [
    "scene", "engine", "variant", "t", "contacts", "by", "law_residual", "law_residual_without_offset", "own_residual",
    "momentum_error", "velocity_error", "largest_compliance_per_kg", "status", "time_min_s", "file"]


def arguments(words):
    parser = program.flags(__doc__)
    parser.add_argument("what", choices=("problems", "solvers"))
    parser.add_argument("--program", type=Path, default=Path(program.DEFAULT), help="contactbench")
    parser.add_argument("--bench", type=Path, default=program.ROOT / "build/bin/bench_siconos_solvers")
    parser.add_argument("--out", type=Path, default=program.ROOT / "results/engines")
    parser.add_argument("--csv", type=Path, help="solvers: a table that was measured before, in place of a run")
    parser.add_argument("--limit", type=float, default=5, help="solvers: seconds of CPU a solve")
    parser.add_argument("--rounds", type=int, default=3, help="solvers: turns of each")
    parser.add_argument("words", nargs="*", help="scenes or stored problems whose name contains one of these [all]")
    return parser.parse_args(words)


# Engines' own problems.


def own_problem(path, scene, parameters, t, engine, variant, folder):
    """(file, what the engine's program says of it) of the last problem up to t; None where there is none."""
    name = str(program.ROOT / "scenarios" / scene) if scene.endswith(".xml") else scene
    words = [path, "run", name, "--engine", engine, "--variant", variant, "--step", STEP, "--duration", t, "--quiet"]
    words += KNOBS.get(engine, ())
    words += ["--save-problems", folder / "problems", "--record-every", "0", "--out", folder / "run"]
    try:
        why = program.call(*words, *program.settings(parameters), timeout=600).stderr.strip() or "no contact"
        found = sorted((folder / "problems").glob("step_*.hdf5"))
    except program.Late:
        why, found = "did not come back", []  # its last problem is not the one at t
    if not found:
        print(f"isolated: {engine}/{variant} on {scene}: {why}", file=sys.stderr)
        return None
    return found[-1], program.read_json(found[-1].with_suffix(".json"))


def our_choices(said):
    """Flags of one solve by each of our methods and solvers."""
    return [choice for choice in solve_all.choices(said, [8], "1e-12")[1] if choice.get("compression-bound") != "on"]


def rows_of(path, said, scene, own, place):
    """The engine's row and one of each of our methods on its problem."""
    file, about = own
    row = dict.fromkeys(COLUMNS) | {key: about.get(key) for key in COLUMNS if key in about} | {
        "scene": scene, "by": about["engine"], "file": place.name}
    rows = [row]
    for choice in our_choices(said):
        chosen = [part for key, value in choice.items() for part in (f"--{key}", str(value))]
        answer = solve_all.ask(path, [str(file), "--kind", "contact", "--repeat", "5", *chosen], 60)
        if answer["status"] == "unavailable":
            continue
        by = " ".join(str(choice[key]) for key in ("method", "solver", "variant") if choice.get(key))
        rows.append(
            dict.fromkeys(COLUMNS) | {key: row[key]
                                      for key in ("scene", "engine", "variant", "t", "contacts", "file")} |
            {key: answer.get(key) for key in ("law_residual", "status", "time_min_s")} | {"by": by})
    return rows


def problems(args):
    said, rows = program.listed(args.program), []
    here = {engine["name"] for engine in said["engines"] if not engine["unavailable"]}
    folder = args.out / "own_problems"
    folder.mkdir(parents=True, exist_ok=True)
    scenes = [scene for scene in SCENES if not args.words or any(word in scene[0] for word in args.words)]
    cells = [(*scene, *engine) for scene, engine in itertools.product(scenes, ENGINES) if engine[0] in here]

    def solved_by(number, scene, parameters, t, engine, variant):
        return own_problem(args.program, scene, list(parameters), t, engine, variant, Path(scratch) / str(number))

    with tempfile.TemporaryDirectory() as scratch:
        # The longest are the last; what is timed comes after all of them.
        tasks = [functools.partial(solved_by, number, *cell) for number, cell in enumerate(cells)]
        found = program.together(tasks[::-1])[::-1]
        for (scene, parameters, _, engine, variant), own in zip(cells, found):
            if own is None:
                continue
            stem = "_".join([Path(scene).stem, *(p.replace("=", "") for p in parameters)])
            place = folder / f"{stem}__{engine}__{variant}.hdf5"
            for suffix in (".hdf5", ".json"):
                shutil.copyfile(own[0].with_suffix(suffix), place.with_suffix(suffix))
            rows += rows_of(args.program, said, stem, own, place)
    write_table(rows, COLUMNS, args.out / "own_problems.csv")
    (args.out / "own_problems.md").write_text(own_markdown(rows), encoding="utf-8")
    print(f"{len(rows)} rows: {args.out / 'own_problems.csv'}, .md")


def words_of(x):
    return "-" if math.isnan(number(x)) else f"{number(x):.1e}"


def own_markdown(rows):
    """A table an engine's problem: its answer, then ours on the same data."""
    lines = [
        "# Engines' own contact problems", "",
        "Residual of Coulomb's law with the engine's offset, and without; of the engine's own model; how far M, J,",
        "v-, r and v+ agree with each other. `scripts/isolated.py problems`; docs/engines.md.", ""]
    for file, some in itertools.groupby(rows, key=lambda row: row["file"]):
        some = list(some)
        first = some[0]
        lines += [
            f"## {file}: {first['contacts']} contacts, t = {number(first['t']):g} s, "
            f"largest compliance {words_of(first['largest_compliance_per_kg'])} 1/kg", "",
            "| by | Coulomb | without offset | its own model | momentum | velocity, m/s | time, us | status |",
            "|---|---|---|---|---|---|---|---|"]
        for row in some:
            time = "-" if not row["time_min_s"] else f"{1e6 * number(row['time_min_s']):.1f}"
            cells = [words_of(row[c]) for c in COLUMNS[6:11]]
            lines.append(f"| {row['by']} | " + " | ".join(cells) + f" | {time} | {row['status'] or ''} |")
        lines.append("")
    return "\n".join(lines)


# What stands beside an engine's answer in the report, of our methods.
BESIDE = ("newton uncapped", "mirtich", "ap lemke", "convex ipm", "coulomb newton", "soft sap", "soft mujoco")


def own_answers(folder):
    """Per problem of own_problems.csv the engine's row, with the residuals of some of our methods under `ours`."""
    path = Path(folder) / "own_problems.csv"
    rows = table_of(path).to_dict("records") if path.exists() else []
    out = []
    for _, some in itertools.groupby(rows, key=lambda row: row["file"]):
        engine, *others = some
        found = {row["by"]: known(row["law_residual"]) for row in others if row["status"] == "ok"}
        out.append({key: engine[key] for key in ("file", "scene", "engine", "variant", "contacts")} |
                   {key: known(engine[key]) for key in COLUMNS[6:12]} | {"ours": [found.get(by) for by in BESIDE]})
    return out


def known(x):
    return None if math.isnan(number(x)) else number(x)


# Siconos' solvers beside ours.


def best(rows, theirs):
    """{problem: its least time by a solver of one side that the referee accepts, and whose}."""
    out = {}
    for row in rows:
        if row["solver"].startswith("siconos") != theirs or row["solved"] != "1":
            continue
        time = number(row["time_min_s"])
        if row["problem"] not in out or time < out[row["problem"]][0]:
            out[row["problem"]] = (time, row["solver"])
    return out


def profiles(rows):
    """{solver: ratios of its times to the least of all, ascending; infinite where it does not solve}."""
    least = {}
    for row in rows:
        if row["solved"] == "1":
            least[row["problem"]] = min(least.get(row["problem"], math.inf), number(row["time_min_s"]))
    out = {}
    for row in rows:
        ratio = number(row["time_min_s"]) / least[row["problem"]] if row["solved"] == "1" else math.inf
        out.setdefault(row["solver"], []).append(ratio)
    return {solver: sorted(ratios) for solver, ratios in out.items()}


def solvers_markdown(rows):
    ours, theirs = best(rows, False), best(rows, True)
    names = list(dict.fromkeys(row["problem"] for row in rows))
    lines = [
        "# Solvers of exact Coulomb friction: ours and Siconos' in one run", "",
        "Least time of the solve alone (us, CPU) by a solver whose answer the referee accepts (residual of",
        "Coulomb's law up to 1e-8). `scripts/isolated.py solvers`; bench/siconos_solvers.cpp says how each is called.",
        "", "| problem | contacts | our best | us | Siconos' best | us | ours/theirs |",
        "|---|---|---|---|---|---|---|"]
    contacts = {row["problem"]: row["contacts"] for row in rows}
    for name in names:
        a, b = ours.get(name), theirs.get(name)
        cells = [f"{x[1].removeprefix('siconos ')} | {1e6 * x[0]:.1f}" if x else "none | -" for x in (a, b)]
        ratio = f"{a[0] / b[0]:.2f}" if a and b else "-"
        lines.append(f"| {name} | {contacts[name]} | {cells[0]} | {cells[1]} | {ratio} |")
    both = [ours[n][0] / theirs[n][0] for n in names if n in ours and n in theirs]
    lines += [
        "", f"Ours at least as fast on {sum(r <= 1 for r in both)} of the {len(both)} problems that both solve; "
        f"solved by ours: {len(ours)}, by Siconos': {len(theirs)}, of {len(names)}.", "",
        "| solver | solved | fastest of all | within 2 times | false claims | no end |", "|---|---|---|---|---|---|"]
    of = {}
    for row in rows:
        of.setdefault(row["solver"], []).append(row)
    ratios = profiles(rows)
    for solver, some in of.items():
        count = [
            sum(r["solved"] == "1" for r in some),
            sum(r <= 1 for r in ratios[solver]),
            sum(r <= 2 for r in ratios[solver]),
            sum(r["verdict"] == "false claim" for r in some),
            sum(r["verdict"] in ("time limit", "left the program") or r["verdict"].startswith("killed") for r in some)]
        lines.append(f"| {solver} | " + " | ".join(map(str, count)) + " |")
    return "\n".join([*lines, ""])


def draw(rows, folder):
    """The performance profile of all solvers."""
    from . import looks  # pylint: disable=import-outside-toplevel # the tables need no figures
    plt = looks.plt
    figure, panel = plt.subplots(figsize=(7.5, 4.2))
    some = {s: r for s, r in profiles(rows).items() if math.isfinite(r[0])}
    end = 1.5 * max(x for ratios in some.values() for x in ratios if math.isfinite(x))
    colours = itertools.cycle((looks.BLACK, looks.BLUE, looks.GREEN, looks.PURPLE, looks.ORANGE))
    theirs = itertools.cycle((looks.VERMILION, looks.ORANGE, looks.SKY, looks.YELLOW, looks.PURPLE))
    lines = itertools.cycle(looks.LINES)
    for solver, ratios in some.items():
        x = [r for r in ratios if math.isfinite(r)]
        y = [(i + 1) / len(ratios) for i in range(len(x))]
        other = solver.startswith("siconos")
        panel.step([1.0, *x, end], [0.0, *y, y[-1]], where="post", label=solver,
                   color=next(theirs if other else colours), linestyle=next(lines) if other else "-",
                   linewidth=1.2 if other else 1.8)
    panel.set(xscale="log", xlim=(0.95, end), ylim=(-0.02, 1.03), ylabel="share of problems",
              xlabel="time over that of the fastest", title="accepted by the referee (1e-8)")
    panel.legend(fontsize=7, loc="lower right")
    looks.save(figure, folder, "siconos_solvers")


def solvers(args):
    args.out.mkdir(parents=True, exist_ok=True)
    csv = args.csv
    if csv is None:
        csv = args.out / "siconos_solvers.csv"
        csv.unlink(missing_ok=True)  # an older one would stand for what is not measured
        try:
            ended = program.call(args.bench, "--csv", csv, "--limit", args.limit, "--rounds", args.rounds, *args.words)
        except OSError as error:
            raise program.ProgramError(f"{args.bench}: {error.strerror}") from None
        if not csv.exists():
            words = (ended.stderr.strip() or ended.stdout.strip()).splitlines() or ["ended without a word"]
            raise program.ProgramError(f"{args.bench}: {words[-1]}")
    rows = table_of(csv).to_dict("records")
    if not rows:
        raise program.ProgramError(f"{csv}: holds no rows")
    (args.out / "siconos_solvers.md").write_text(solvers_markdown(rows), encoding="utf-8")
    draw(rows, args.out)
    print(f"{len(rows)} solves: {csv}, siconos_solvers.md, siconos_solvers.svg in {args.out}")


def main(words=None):
    args = arguments(words)
    (problems if args.what == "problems" else solvers)(args)
