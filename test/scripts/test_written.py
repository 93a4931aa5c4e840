"""What the scripts write comes out again: random scenes, the runs that sweep files name, the independent look at runs, stiff cases
with their page and map, runs to look at, and of kept runs the report with its figures and what is recommended. What changes a
number, a word or a line of a picture is seen here, in whatever script it was changed.

Where a change is meant to move it: PROGRAM=build/bin/contactbench python3 -B test/scripts/test_written.py make. Other runs are kept by
`test_written.py keep RESULTS RUNS`, of what scripts/reproduce.sh made there."""
import contextlib
import functools
import hashlib
import io
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import unittest
import unittest.mock
from pathlib import Path
from types import SimpleNamespace

# NumPy's and OpenBLAS' kernels of any processor of x86-64, before they are loaded: theirs round in as many ways as there are.
os.environ["OPENBLAS_CORETYPE"], os.environ["OPENBLAS_NUM_THREADS"] = "Prescott", "1"
os.environ["NPY_DISABLE_CPU_FEATURES"] = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX2 FMA3"

import test_answers
from contactbench import campaign, gltf, heatmap, look, plan, problems, program, recommend, scenes, stress, view
from contactbench import runs as runs_module

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "test/data/written.json"
KEPT = ROOT / "test/data/kept_runs.tar.xz"  # results of the quick profile, files of runs thinned
PROGRAM = os.environ.get("PROGRAM")
SEED = 4
ROUNDED = 9  # digits


def digest(content):
    return hashlib.sha256(content if isinstance(content, bytes) else str(content).encode()).hexdigest()[:8]


def rounded(value, digits=ROUNDED):
    """The same with numbers of so many digits."""
    if isinstance(value, dict):
        return {key: rounded(part, digits) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(part, digits) for part in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def drawn(text):
    """An SVG file by its numbers to a hundredth of a point."""
    return digest(re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda number: f"{float(number[0]):.2f}", text))


@functools.cache
def listed():
    """What the program has, whatever is installed."""
    said = program.listed(PROGRAM)
    for part in said["solvers"] + said["engines"]:
        part["unavailable"] = None
    return said


def random_scenes():
    for shapes in (False, True):
        for number in range(4 * len(scenes.SHAPES if shapes else scenes.FAMILIES)):
            scene = scenes.make(SEED, number, shapes)
            yield f"{scene.name} {scene.family} {scene.kind}", digest(scene.xml() + json.dumps(scene.files))


def engines_sweep():
    yield from runs_of([ROOT / "scenarios/sweeps/engines.toml"])


def runs_of_sweeps():
    yield from runs_of(path for path in sorted((ROOT / "scenarios/sweeps").glob("*.toml")) if path.stem != "engines")


def runs_of(sweeps):
    for path in sweeps:
        profiles = sorted(re.findall(r"^\[profiles\.(\w+)", path.read_text(), re.MULTILINE) or ["default"])
        for profile in dict.fromkeys(profiles):
            try:
                runs, missing = plan.plan([path], profile, listed())[:2]
            except plan.SweepError as error:
                yield f"{path.name} {profile}", str(error).replace(str(ROOT), "")
                continue
            said = "\n".join(f"{run.name} {run.sweeps} {run.repeat} {run.members} {run.timed} {run.time_limit_s} {run.record_every}" for run in runs)
            yield f"{path.name} {profile}", f"{len(runs)} runs, {digest(said + str(missing).replace(str(ROOT), ''))}"


LOOKED_AT = {"newton/uncapped": "newton --variant uncapped", "soft/sap": "soft --variant sap"}


def looked_at(number, shapes, method):
    with tempfile.TemporaryDirectory() as folder:
        scene = scenes.make(SEED, number, shapes)
        scene.duration = 0.2
        path = scenes.write(scene, Path(folder))
        job = {"program": PROGRAM, "time_limit": 60, "method": method, "statuses": program.statuses_of(listed()),
               "flags": ["--method", *LOOKED_AT[method].split()]}
        row, _ = campaign.examine(job, path, look.Model(path), Path(folder) / "out")
    return rounded({key: value for key, value in row.items() if key not in ("run_s", "git")}, 6)


def looks():
    cells = [(number, shapes, method) for shapes in (False, True) for number in range(2 * len(scenes.SHAPES if shapes else scenes.FAMILIES))
             for method in LOOKED_AT]
    for cell, row in zip(cells, test_answers.on_all_cores(looked_at, cells)):
        yield " ".join(map(str, cell)), row


STIFF = ("soft/sap", "mirtich")
SLOW = ("S1", "S2", "M2", "A1")  # by mirtich


def stiff_cases():
    """Some columns of the quick rows, and all that is made of them."""
    cases = tomllib.loads(stress.CASES.read_text())
    with tempfile.TemporaryDirectory() as folder, unittest.mock.patch.dict(stress.DEPARTS, cases.get("departs", {})):
        out = Path(folder)
        options = SimpleNamespace(program=PROGRAM, other_program=None, only=[], quick=True, accuracy=0.0, member=0, time_limit=60,
                                  scratch=out, statuses=program.statuses_of(listed()))
        columns = [column for column in stress.methods_of(listed()) if column[0] in STIFF]
        jobs = [job for job in stress.plan(cases, columns, options)
                if job["method"] == STIFF[0] or cases["case"][job["case"]]["id"] not in SLOW]
        solves = stress.problem_jobs(cases, columns, listed(), [], out)
        cells = test_answers.on_all_cores(stress.do_run, [(job, cases["case"][job["case"]], options) for job in jobs])
        answers = test_answers.on_all_cores(stress.do_problem, [(job, options) for job in solves])
        stress.compare(jobs, cells, cases)
        rows = stress.table_of(jobs, cells, cases)
        rows += [{**cell, "id": job["id"], "scene": job["name"], "row": "stored problem", "method": job["method"], "expect": "ends: " + ", ".join(job["ends"])}
                 for job, cell in zip(solves, answers)]
        for row in rows:
            row["solve_s"] = 1e-3
            yield f"{row['id']} {row['scene']} {row['row']} {row['method']}", digest(
                json.dumps(rounded([row[column] for column in stress.COLUMNS])).replace(folder, ""))
        stress.write_tables(rows, out, {"git": "", "program": "", "cpu": "", "made": "", "runs": len(rows), "quick": True, "time_limit_s": 60, "load_average": 0.0})
        heatmap.draw(out / "stress.csv", out)
        yield "stress.md", digest((out / "stress.md").read_text().replace(folder, ""))
        yield "heatmap.svg", drawn((out / "heatmap.svg").read_text())


SEEN = ("stack --set boxes=3 --method ap --duration 0.05", "grasp --method convex --duration 0.02", "rubble_slope --method newton --duration 0.03",
        "mobile_robot_caster --method convex --duration 0.03", "rolling_drum --method soft --stepping steps --duration 0.02")


def runs_to_look_at():
    with tempfile.TemporaryDirectory() as folder:
        for number, flags in enumerate(SEEN):
            scene, *flags = flags.split()
            out = Path(folder) / str(number)
            program.call(PROGRAM, "run", f"{scene}.xml", *flags, "--record-contacts", "--out", out, "--quiet")
            for frames in (400, 5):
                page = view.scene_of([out, out] if number == 0 else [out], str(out) if number == 1 else None, frames=frames)
                yield f"{scene} {frames}", digest(json.dumps(rounded(page, 6)))
            yield f"{scene}.glb", digest(gltf.file_of(view.Motion(out)))


def recommended(results):
    """What is said of kept runs, or why nothing is."""
    for scene, error, more in itertools.product(("sliding_box", "stack --set boxes=4", "grasp", "impacting_sphere", "circular_sliding", "nothing"),
                                                ("1e-1", "1e-4", "1e-9"), ("", "--time-per-step 2e-5", "--json", "--measure none")):
        words = f"{scene} --error {error} {more}".split()
        with unittest.mock.patch.object(sys, "argv", ["recommend.py", *words, "--results", str(results)]), \
                contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
            code = recommend.main()
        said = (out.getvalue() + err.getvalue()).replace(str(results), "RESULTS").splitlines()
        yield " ".join(words), [code, *said] if len(said) < 8 else [code, digest("\n".join(said))]


def report():
    """Report, figures and recommendations of kept runs."""
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(KEPT) as file:
            file.extractall(folder)
        top = Path(folder) / "results"
        ended = subprocess.run([sys.executable, "-B", ROOT / "scripts/report.py", "--results", top, "--runs", top / "runs"], capture_output=True,
                               text=True)
        yield "report.py", [ended.returncode, *(ended.stdout + ended.stderr).replace(folder, "").splitlines()]
        made = json.loads((top / "report.json").read_text())
        for name, section in made["sections"].items():
            for part in section:
                yield f"{name} {part}", digest(json.dumps(rounded(section[part])))
        page = (top / "report.html").read_text()
        for number, part in enumerate(re.split(r"<h2", re.sub(r"data:[^\"')]*|<svg.*?</svg>", "", page, flags=re.DOTALL))):
            yield f"report.html {number} {' '.join(re.sub('<[^>]*>', ' ', part).split()[1:5])}", digest(part.replace(folder, ""))
        for file in sorted(top.glob("figures/*.svg")):
            yield file.name, drawn(file.read_text())
        for file in sorted(top.glob("table1.*")):
            yield file.name, digest(file.read_text())
        yield from recommended(top)


def made_problems():
    for name, text, ends, speed in problems.made():
        yield name, [digest(text), *ends, speed]
    for ratio, mu, count in ((0.1, 1.0, 27), (0.2, 0.3, 5)):
        yield f"arch {ratio} {mu} {count}", digest(json.dumps([rounded(float(word)) for word in problems.arch(ratio, mu, count).split()]))


PARTS = (random_scenes, made_problems, runs_of_sweeps, engines_sweep, looks, stiff_cases, runs_to_look_at, report)


def keep(results, runs):
    """Makes KEPT of results and their runs: of each file of a run 16 moments, evenly, in seven digits; nothing that is made of them."""
    def thin(path, most=16):
        lines = path.read_text().splitlines(keepends=True)
        bodies = len({line.split(",")[1] for line in lines[1:]}) if path.name == "trajectory.csv" else 1
        moments = max(1, (len(lines) - 1) // bodies)
        every = -(-moments // most)
        kept = [line for k, line in enumerate(lines[1:]) if k // bodies % every == 0 or k // bodies == moments - 1]
        short = re.compile(r"-?\d+\.\d{6,}(e[-+]?\d+)?")
        path.write_text("".join([lines[0], *(short.sub(lambda number: f"{float(number[0]):.7g}", line) for line in kept)]))

    with tempfile.TemporaryDirectory() as folder:
        top = Path(folder) / "results"
        shutil.copytree(results, top, ignore=shutil.ignore_patterns("runs", "*.html", "figures", "report.json", "table1.*", "failing", "scenes", "heatmap.*",
                                                                    "random_runs.jsonl"))
        shutil.copytree(runs, top / "runs", ignore=shutil.ignore_patterns("*.hdf5", ".lock"))
        for path in (top / "runs").rglob("*.csv"):
            thin(path)
        machine = json.loads((top / "manifest.json").read_text())["machine"]
        for path in top.rglob("*.*"):
            if path.suffix in (".csv", ".json", ".md", ".toml"):  # of no machine and no place
                text = path.read_text().replace(machine["cpu"], "a processor").replace(machine["os"], "a system")
                path.write_text(text.replace(str(Path(results).resolve()), "RESULTS").replace(str(ROOT), "ROOT"))
        for path in (top / "runs.csv", top / "ensemble.csv"):  # every tenth beside others
            rows = runs_module.table_of(path)
            rows["busy"] = ["true" if number % 10 == 0 else "false" for number in range(len(rows))]
            runs_module.write_table(rows.to_dict("records"), list(rows), path)
        with tarfile.open(KEPT, "w:xz", preset=9) as file:
            file.add(top, "results")


def make():
    TABLE.write_text(json.dumps({part.__name__: dict(part()) for part in PARTS}, indent=0, ensure_ascii=False) + "\n")


@unittest.skipUnless(PROGRAM, "PROGRAM is not set: ctest names the program")
class Written(unittest.TestCase):
    setUp = test_answers.Answers.setUp

    def same(self, part):
        wanted, found = json.loads(TABLE.read_text())[part.__name__], json.loads(json.dumps(dict(part())))
        different = [f"{name}: is {found.get(name)}, was {wanted.get(name)}" for name in wanted | found if found.get(name) != wanted.get(name)]
        self.assertFalse(different, "\n".join([f"{len(different)} of {len(wanted)} differ, the first:", *different[:20]]))

    def test_random_scenes(self):
        self.same(random_scenes)

    def test_made_problems(self):
        self.same(made_problems)

    def test_the_runs_that_sweep_files_name(self):
        self.same(runs_of_sweeps)

    def test_the_runs_beside_engines(self):
        if absent := [engine["name"] for engine in program.listed(PROGRAM)["engines"] if engine["unavailable"]]:
            self.skipTest(f"not installed: {', '.join(absent)}")
        self.same(engines_sweep)

    def test_the_look_at_runs(self):
        self.same(looks)

    def test_stiff_cases_with_their_page_and_map(self):
        self.same(stiff_cases)

    def test_runs_to_look_at(self):
        self.same(runs_to_look_at)

    def test_report_figures_and_recommendations_of_kept_runs(self):
        self.same(report)


if __name__ == "__main__":
    if sys.argv[1:2] == ["make"]:
        make()
    elif sys.argv[1:2] == ["keep"]:
        keep(*map(Path, sys.argv[2:]))
    else:
        unittest.main()
