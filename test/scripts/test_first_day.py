"""What somebody meets who has just cloned the project: scripts under a bare python3, a first picture."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

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

    def run_in(self, folder, script, *words):
        self.write("scripts/lib.sh", self.LIB)
        self.write("scripts/setup.sh", "#!/bin/sh\n")
        shutil.copy(SCRIPTS / script, self.top / "project/scripts")
        return subprocess.run(["bash", self.top / "project/scripts" / script, *words], capture_output=True, text=True, cwd=folder)

    def test_scenes_of_one_name_are_both_fuzzed_from(self):
        fuzzer = '#!/bin/sh\ncase "$*" in *-merge=1*) exit ;; esac\nfor last; do :; done\ncat "$last"/* >> said\n'
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

    def test_figures_are_kept_where_one_stands(self):
        self.write("build/bin/bench_steps", "#!/bin/sh\necho some figures\n")
        (self.top / "here").mkdir()
        ended = self.run_in(self.top / "here", "bench.sh", "--out", "kept/bench.md")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertIn("some figures", (self.top / "here/kept/bench.md").read_text())


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
