"""What somebody meets who has just cloned the project: scripts under a bare python3, a first picture."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import made
import standin
from folder import Folder

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


class FirstDay(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = Path(folder.name)

    def bare_python(self):
        """A folder for the PATH whose python3 has no modules but its own."""
        (self.top / "bare/bin").mkdir(parents=True)
        base = Path(sys._base_executable).resolve()
        (self.top / "bare/pyvenv.cfg").write_text(f"home = {base.parent}\ninclude-system-site-packages = false\n")
        (self.top / "bare/bin/python3").symlink_to(base)
        return self.top / "bare/bin"

    def test_every_script_finds_a_python_that_has_what_it_needs(self):
        bare = self.bare_python()
        without = subprocess.run([bare / "python3", "-c", "import numpy"], capture_output=True)
        self.assertNotEqual(without.returncode, 0, "the bare python has numpy")
        environment = os.environ | {"PATH": f"{bare}:{os.environ['PATH']}", "PYTHON": sys.executable}
        scripts = [[s] for s in sorted(SCRIPTS.glob("*.py")) if s.read_text().startswith("#!")]
        scripts += [["python3", s] for s in sorted((SCRIPTS / "plots").glob("*.py"))]
        self.assertGreater(len(scripts), 20)
        for words in scripts:
            with self.subTest(script=words[-1].name):
                ended = subprocess.run([*map(str, words), "--help"], capture_output=True, text=True, env=environment)
                self.assertEqual(ended.returncode, 0, ended.stderr)

    def test_where_no_python_has_the_modules_the_remedy_is_said(self):
        bare = self.bare_python()
        ended = subprocess.run([bare / "python3", "-c", "from contactbench import start; start.CANDIDATES = (); start.need(('numpy', ))"],
                               capture_output=True, text=True, cwd=SCRIPTS)
        self.assertEqual(ended.returncode, 1)
        self.assertIn("scripts/setup.sh", ended.stderr)
        self.assertIn("python3-numpy", ended.stderr)

    def test_a_first_picture_of_a_scene_is_one_command(self):
        program = standin.write(self.top / "program")
        ended = subprocess.run([sys.executable, "-B", SCRIPTS / "picture.py", "sliding_box", "--program", program, "--out", self.top / "first.png"],
                               capture_output=True, text=True, env=standin.environment())
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertEqual((self.top / "first.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(ended.stdout.count("--method"), 4)

    def test_a_picture_without_the_program_says_how_to_build_it(self):
        ended = subprocess.run([sys.executable, "-B", SCRIPTS / "picture.py", "sliding_box", "--program", self.top / "none"],
                               capture_output=True, text=True, cwd=self.top)
        self.assertEqual(ended.returncode, 1)
        self.assertIn("scripts/build.sh", ended.stderr)


class Shell(Folder):
    """Shell scripts in a project that is made up, where building does nothing."""
    LIB = 'root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)\nbuild_preset() { :; }\n'

    def write(self, name, text):
        path = self.top / "project" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)

    def run_in(self, folder, script, *words, lib="", **environment):
        """`lib`: what lib.sh has besides; programs of the project's folder bin/ come first."""
        self.write("scripts/lib.sh", self.LIB + lib)
        if script != "setup.sh":
            self.write("scripts/setup.sh", '#!/bin/sh\necho "setup.sh $*" >> "$(dirname "$0")/../said"\n')
        shutil.copy(SCRIPTS / script, self.top / "project/scripts")
        return subprocess.run(["bash", self.top / "project/scripts" / script, *words], capture_output=True, text=True, cwd=folder,
                              env=os.environ | {"PATH": f"{self.top}/project/bin:{os.environ['PATH']}"} | environment)

    def said(self):
        """Commands that stand-ins wrote to project/said, without the folder of the project; out beside it is OUT."""
        text = (self.top / "project/said").read_text()
        for top in (self.top.resolve(), self.top):
            text = text.replace(f"{top}/project/", "").replace(f"{top}/out", "OUT")
        return text.splitlines()

    def test_scenes_of_one_name_are_both_fuzzed_from(self):
        fuzzer = '#!/bin/sh\ncase "$*" in *-merge=1*) echo small > "$3/kept"; exit ;; esac\n' \
            'for last; do :; done\ncat "$last"/* >> said\n'
        for name in ("scene", "problem"):
            self.write(f"build-fuzz/bin/fuzz_{name}", fuzzer)
        for name, text in (("scenarios/pile.xml", "one\n"), ("scenarios/engines/pile.xml", "two\n"), ("test/data/broken/blank.xml", "three\n"),
                           ("test/data/scenes/a.urdf", "four\n"), ("test/data/siconos/a.dat", "five\n"), ("test/data/contact/a.dat", "six\n"),
                           ("test/data/problems/b.dat", "seven\n"), ("scenarios/stress/problems/c.dat", "eight\n")):
            self.write(name, text)
        ended = self.run_in(self.top, "fuzz.sh", "1")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        said = (self.top / "project/said").read_text().split()
        self.assertEqual(sorted(said), ["eight", "five", "four", "one", "seven", "six", "three", "two"])
        for name in ("scene", "problem"):  # what is left of all when it is reduced
            self.assertEqual([path.name for path in (self.top / f"project/test/data/fuzz/{name}").iterdir()], ["kept"])

    def test_figures_are_kept_where_one_stands(self):
        self.write("build/bin/bench_steps", "#!/bin/sh\necho some figures\n")
        (self.top / "here").mkdir()
        ended = self.run_in(self.top / "here", "bench.sh", "--out", "kept/bench.md")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertIn("some figures", (self.top / "here/kept/bench.md").read_text())

    def test_a_flag_that_is_none_ends_with_2_and_all_that_the_head_says(self):
        for script in ("bench.sh", "build.sh", "reproduce.sh", "setup.sh", "test.sh"):
            head = []
            for line in (SCRIPTS / script).read_text().splitlines()[1:]:
                if not line.startswith("# "):
                    break
                head.append(line[2:])
            ended = self.run_in(self.top, script, "--nonsense")
            self.assertEqual((ended.returncode, ended.stdout.splitlines()), (2, head), script)
        self.assertEqual(self.run_in(self.top, "fuzz.sh", "--nonsense").returncode, 2)
        self.assertEqual(self.run_in(self.top, "setup.sh", "--tests", "--nonsense").returncode, 2)

    def test_a_measurement_that_fails_stops_no_other_and_is_the_end_of_all(self):
        for name, code in (("cone", 3), ("lcp", 0), ("steps", 0)):
            self.write(f"build/bin/bench_{name}", f"#!/bin/sh\necho of {name}\nexit {code}\n")
        for words, code, names in (((), 1, ["cone", "lcp", "steps"]), (("ste", "cp"), 0, ["lcp", "steps"])):
            ended = self.run_in(self.top, "bench.sh", "--out", "bench.md", *words)
            kept = (self.top / "bench.md").read_text()
            self.assertEqual(ended.returncode, code, ended.stderr)
            self.assertEqual([line[3:] for line in kept.splitlines() if line.startswith("of ")], names)
            self.assertEqual("ended with exit code 3" in kept, "cone" in names)
        self.assertEqual(self.run_in(self.top, "bench.sh", "--out").returncode, 2)

    def test_jobs_are_one_a_core_as_far_as_memory_goes(self):
        for cores, memory, jobs in ((8, 3, "3"), (2, 30, "2"), (4, 4, "4")):
            for name, number in (("nproc", cores), ("awk", memory)):
                self.write(f"bin/{name}", f"#!/bin/sh\necho {number}\n")
            ended = subprocess.run(["bash", "-c", f". '{SCRIPTS}/lib.sh'; jobs"], capture_output=True, text=True,
                                   env=os.environ | {"PATH": f"{self.top}/project/bin:{os.environ['PATH']}"})
            self.assertEqual((ended.stdout.strip(), ended.stderr), (jobs, ""))

    def test_what_is_not_installed_is_said_and_only_what_is_needed_is_a_failure(self):
        for name in ("apt-get", "sudo"):
            self.write(f"bin/{name}", "#!/bin/sh\necho asked to install >&2\nexit 9\n")
        self.write("bin/dpkg-query", '#!/bin/sh\ncase " $LACKING " in *" $3 "*) exit 1 ;; esac\nprintf installed\n')
        for lacking, code, said in (("", 0, ["nothing is missing"]), ("libhdf5-dev chromium", 0, [
                "missing (optional): libhdf5-dev", "missing (optional): chromium"]),
                                    ("git cmake", 1, ["missing: cmake", "missing (optional): git"])):
            ended = self.run_in(self.top, "setup.sh", "--check", LACKING=lacking)
            self.assertEqual((ended.returncode, ended.stdout.splitlines(), ended.stderr), (code, said, ""), lacking)
        # Where nothing is missing nothing is asked of apt-get; engines and what tests look through are asked for by their flags alone.
        for words, lacking in (((), "libode-dev chromium"), (("--tests", ), "libode-dev"), (("--engines", ), "chromium")):
            ended = self.run_in(self.top, "setup.sh", *words, LACKING=lacking)
            self.assertEqual((ended.returncode, ended.stdout, ended.stderr), (0, "", ""), words)

    PYTHON = 'find_python() { echo "$root/bin/python"; }\njobs() { echo 5; }\n'

    def reproduce(self, *words, code="0"):
        """Exit code, and the commands that were run; scripts/stress.py ends so."""
        self.write("scripts/build.sh", "#!/bin/sh\n")
        self.write("bin/python", '#!/bin/bash\necho "$(basename "$1") ${*:2}" >> "$(dirname "$0")/../said"\n'
                   'case "$1" in *stress.py) exit "$CODE" ;; esac\n')
        (self.top / "project/said").write_text("")
        ended = self.run_in(self.top, "reproduce.sh", "--out", self.top / "out", *words, CODE=code,
                            lib=self.PYTHON + "build_preset() { false; }\n")
        return ended.returncode, self.said()

    def test_a_fault_of_stiff_cases_is_in_the_report_and_a_script_that_fails_ends_the_reproduction(self):
        for code, ends, reported in (("0", 0, True), ("3", 0, True), ("1", 1, False), ("2", 1, False)):
            ended, said = self.reproduce(code=code)
            self.assertEqual((ended, said[-1].startswith("report.py ")), (ends, reported), (code, said))

    def test_a_profile_is_that_of_every_sweep_and_only_the_paper_s_has_a_budget(self):
        for profile, words in (("quick", ()), ("paper", ("--profile", "paper", "--jobs", "3", "--keep"))):
            old = self.top / "out/members/1/stress/stress.csv"
            made.write_rows(old, [{"of": "another profile"}])
            _, said = self.reproduce(*words)
            self.assertFalse(old.exists())  # it would be taken for this one's
            sweeps = [line.split() for line in said if line.startswith("sweep.py ")]
            self.assertEqual([[word.rpartition("/")[2][:-5] for word in line if word.endswith(".toml")] for line in sweeps],
                             [["motion", "paper", "robots", "claims", "error_time", "orders", "polygons", "stepping", "today"],
                              ["engines"]])
            more = ["--keep", "--budget", "1.5"] if profile == "paper" else []
            for line, out in zip(sweeps, ("OUT", "OUT/engines")):
                at = line.index("--profile")
                self.assertEqual(line[at:at + 2] + line[at + 4:], [
                    "--profile", profile, "--runs", f"{out}/runs/{profile}", "--out", out, "--jobs",
                    "3" if words else "0", "--timed-alone", *more])
            cases, *of_member, random = (line.partition("--jobs 2 ")[2] for line in said if line.startswith("stress.py "))
            quick = profile == "quick"
            self.assertEqual(cases, "--out OUT/stress " + ("--quick --time-limit 0.5" if quick else "--engines"))
            self.assertEqual(of_member, [] if quick else ["--out OUT/members/1/stress --engines --member 1"])
            self.assertEqual(random.split()[:6], ["--out", "OUT/stress", "--seed", "1", "--random", "13" if quick else "52"])
            self.assertEqual(said[-1], f"report.py --results OUT --runs OUT/runs/{profile}")
            # All else is made by the program that was built, and the member's streams beside the published ones.
            by = "--program build/bin/contactbench"
            others = [line for line in said if line.split()[0] not in ("sweep.py", "stress.py", "report.py")]
            self.assertEqual(others, [
                f"references.py {by} --out OUT/references",
                f"solve_all.py {by} --out OUT/solve_all" + (" --k 8 --repeat 2" if quick else ""),
                f"replay.py {by} --out OUT/replay",
                f"engines.py findings {by} --out OUT/engines",
                f"isolated.py problems {'sliding_box stack ' if quick else ''}{by} --out OUT/engines",
                f"engines.py preflight {by} --out OUT/engines" + (" --setting default" if quick else ""),
                *([] if quick else [f"replay.py {by} --member 1 --out OUT/members/1/replay"])])

    def test_tests_end_as_the_worst_of_them(self):
        self.write("scripts/build.sh", '#!/bin/sh\necho "build.sh $*" >> said\n')
        self.write("bin/ctest", '#!/bin/sh\necho "ctest $*" >> said\nexit "$CODE"\n')
        self.write("bin/python3", '#!/bin/sh\necho "python3 $*" >> said\ncase "$*" in *"$FAILS"*) exit 1 ;; esac\n')
        for folder, name in (("build/bin", "test_lcp"), ("build/bin", "test_ncp"), ("bin", "clang-tidy")):
            self.write(f"{folder}/{name}", f'#!/bin/sh\necho "{name} $*" >> said\n[ "$FAILS" != {name} ]\n')
        for name in ("app/main.cpp", "lib/lcp/lemke.cpp"):
            self.write(name, "")
        acceptance = ["scenes", "precision", "pruning", "same_bytes", "any_scene", "reproduction", "other_machines"]
        for words, code, fails, ends in (((), "0", "none", 0), ((), "8", "none", 1), (("--long", ), "0", "none", 0),
                                         *((("--long", ), "0", f"{name}.py", 1) for name in acceptance), (("--sanitize", ), "0",
                                                                                                          "none", 0),
                                         (("--long", ), "0", "test_lcp", 1), (("--tidy", ), "0", "none", 0),
                                         (("--tidy", ), "0", "clang-tidy", 1),
                                         (("--sanitize", "--no-setup"), "0", "none", 0)):
            (self.top / "project/said").write_text("")
            ended = self.run_in(self.top, "test.sh", *words, CODE=code, FAILS=fails,
                                lib='find_python() { echo python3; }\njobs() { echo 5; }\n')
            self.assertEqual(ended.returncode, ends, (words, code, fails, ended.stderr))
            folder = "build-sanitize" if "--sanitize" in words else "build"
            passed = [word for word in words if word in ("--sanitize", "--no-setup")]
            said = self.said()
            self.assertEqual((said[0], said[-1]), (" ".join(["build.sh --tests", *passed]),
                                                   f"ctest --test-dir {folder} --output-on-failure --parallel 5"))
            self.assertEqual([line.split()[1] for line in said[3:-1]],
                             [f"test/acceptance/{name}.py" for name in acceptance] if "--long" in words else [])
            for name in ("lcp", "ncp"):
                self.assertEqual(f"test_{name} [long]" in said, "--long" in words)
            self.assertEqual("clang-tidy --quiet -p build app/main.cpp lib/lcp/lemke.cpp" in said, "--tidy" in words)
        # Planted faults are tried instead of all that.
        (self.top / "project/said").write_text("")
        ended = self.run_in(self.top, "test.sh", "--mutants", FAILS="none", lib="jobs() { echo 5; }\n")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertEqual(self.said(), ["python3 -B test/mutation/campaign.py --jobs 5"])

    def test_a_build_is_of_what_its_flags_say_after_what_is_missing_is_installed(self):
        release = "build release contactbench engines contactbench_python"
        for words, said in (((), ["setup.sh", release]), (("--tests", ), ["setup.sh --tests", "build release"]),
                            (("--sanitize", ), ["setup.sh --tests", "build sanitize"]), (("--no-setup", ), [release]),
                            (("--tests", "--no-setup"), ["build release"]),
                            (("--no-setup", "--sanitize"), ["build sanitize"])):
            self.write("said", "")
            ended = self.run_in(self.top, "build.sh", *words,
                                lib='build_preset() { echo "build $*" >> "$root/said"; }\n')
            self.assertEqual((ended.returncode, [line.strip() for line in self.said()]), (0, said), words)

    def test_all_targets_that_are_named_are_built_once_it_is_configured(self):
        for name, text in (("cmake", f'echo "cmake $*" >> "{self.top}/project/said"\nexit "$CODE"'), ("ccache", ""),
                           ("nproc", "echo 2"), ("awk", "echo 30")):
            self.write(f"bin/{name}", f"#!/bin/sh\n{text}\n")
        configured = "cmake --preset fast -DCMAKE_CXX_COMPILER_LAUNCHER=ccache"
        built = "cmake --build --preset fast --parallel 2"
        for targets, code, said in (((), 0, [configured, built]),
                                    (("one", "two"), 0, [configured, f"{built} --target one two"]),
                                    (("one", ), 3, [configured])):
            self.write("said", "")
            ended = subprocess.run(
                ["bash", "-c", f". '{SCRIPTS}/lib.sh'; build_preset fast \"$@\"", "bash", *targets],
                capture_output=True, text=True,
                env=os.environ | {"PATH": f"{self.top}/project/bin:{os.environ['PATH']}", "CODE": str(code)})
            self.assertEqual((ended.returncode, self.said()), (code, said), ended.stderr)

    def test_what_is_missing_and_known_here_is_installed_by_whom_may(self):
        log = 'echo "{} $*" >> "$(dirname "$0")/../said"\n'
        for name, text in (("apt-get", log.format("apt-get")), ("sudo", log.format("sudo")), ("id", 'echo "$WHO"\n'),
                           ("apt-cache", '[ "$2" != python3-tqdm ]\n'),
                           ("dpkg-query", 'case " $LACKING " in *" $3 "*) exit 1 ;; esac\nprintf installed\n')):
            self.write(f"bin/{name}", f"#!/bin/sh\n{text}")
        lacking = "libode-dev chromium python3-tqdm git cmake"
        for who, by in (("0", ""), ("1000", "sudo env DEBIAN_FRONTEND=noninteractive ")):
            self.write("said", "")
            ended = self.run_in(self.top, "setup.sh", "--tests", "--engines", LACKING=lacking, WHO=who)
            self.assertEqual((ended.returncode, ended.stdout.splitlines(), ended.stderr), (0, [
                "setup: installing cmake git python3-tqdm chromium libode-dev",
                "setup: python3-tqdm is not in this release's packages; left out"], ""))
            self.assertEqual(self.said(), [f"{by}apt-get update -qq",
                                           f"{by}apt-get install -y -qq --no-install-recommends "
                                           "cmake git chromium libode-dev"])


class SameBytes(unittest.TestCase):
    """test/acceptance/same_bytes.py on what is no program of ours."""

    def compare(self, *commands):
        with tempfile.TemporaryDirectory() as folder:
            program = Path(folder) / "program"
            program.write_text("\n".join(["#!/bin/sh", *commands]) + "\n")
            program.chmod(0o755)
            ended = subprocess.run([sys.executable, "-B", SCRIPTS.parent / "test/acceptance/same_bytes.py", program, "--only", self.only],
                                   capture_output=True, text=True, timeout=300, env=os.environ | {"PATH": "/nowhere"})  # no emulator
        return ended.returncode, ended.stdout

    def test_what_runs_nothing_shows_nothing(self):
        write = 'while [ "$1" != --out ]; do shift || exit 0; done; /bin/mkdir -p "$2"; echo "{}" > "$2/summary.json"'
        self.only = "sliding_box newton"
        self.assertEqual(self.compare(write)[0], 0)
        code, said = self.compare("echo no such scene >&2", "exit 2")
        self.assertEqual(code, 1, said)
        self.assertIn("exit code 2: no such scene", said)
        self.only = "no such name"
        code, said = self.compare(write)
        self.assertEqual(code, 1, said)
        self.assertIn("nothing was compared", said)


if __name__ == "__main__":
    unittest.main()
