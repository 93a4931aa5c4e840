"""How sources are written: those of scripts/ formatted and linted as setup.cfg says, one file that starts processes, small entries; C++ formatted."""
import os
import re
import shutil
import subprocess
import tomllib
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = sorted((ROOT / "scripts/contactbench").rglob("*.py"))
ENTRIES = sorted((ROOT / "scripts").glob("*.py"))
SOURCES = sorted(path for folder in ("app", "bench", "lib", "python", "test") for path in (ROOT / folder).rglob("*.[ch]*") if path.suffix in (".cpp", ".h"))


def tool(name):
    """A test with a program that Debian has and this machine may lack."""
    return unittest.skipUnless(shutil.which(name), f"{name} is not installed (scripts/setup.sh --tests): not looked at")


class Style(unittest.TestCase):
    def silent(self, *words):
        ended = subprocess.run([*words, *map(str, [*PACKAGE, *ENTRIES])], capture_output=True, text=True, cwd=ROOT)
        self.assertEqual((ended.returncode, ended.stdout[-4000:]), (0, ""), ended.stderr[-4000:])

    @tool("yapf3")
    def test_the_layout_is_that_of_yapf(self):
        self.silent("yapf3", "--diff", "--parallel")

    @tool("clang-format")
    def test_the_layout_of_sources_is_that_of_clang_format(self):
        self.assertGreater(len(SOURCES), 100)
        ended = subprocess.run(["clang-format", "--dry-run", "--Werror", *map(str, SOURCES)], capture_output=True, text=True, cwd=ROOT)
        self.assertEqual(ended.returncode, 0, ended.stderr[-4000:])

    @tool("flake8")
    def test_flake8_finds_nothing(self):
        self.silent("flake8")

    @tool("pylint")
    def test_pylint_finds_nothing(self):
        self.silent("pylint", "--rcfile=setup.cfg", "--score=n", f"--jobs={os.cpu_count()}")


class Shape(unittest.TestCase):
    def test_no_file_is_so_large_that_others_refuse_it(self):
        if not (ROOT / ".git").exists():
            self.skipTest("no repository: which files are kept is not known")
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
        kept = [ROOT / name for name in listed if name and (ROOT / name).is_file()]
        self.assertGreater(len(kept), 500)
        self.assertEqual([str(path) for path in kept if path.stat().st_size > 5_000_000], [])

    def test_one_file_starts_processes(self):
        starts = re.compile(r"^\s*(import|from) (subprocess|pty|multiprocessing)\b|\bos\.(system|popen|spawn|fork)|\bPopen\(", re.MULTILINE)
        self.assertEqual([p.name for p in [*PACKAGE, *ENTRIES] if starts.search(p.read_text())], ["program.py"])

    def test_no_script_edits_where_modules_are_found(self):
        for path in ROOT.glob("scripts/**/*.py"):
            self.assertNotIn("sys.path", path.read_text(), path)

    def test_an_entry_is_an_entry(self):
        self.assertGreater(len(ENTRIES), 8)
        for path in ENTRIES:
            self.assertLessEqual(len(path.read_text().splitlines()), 30, path)

    def test_every_figure_can_be_drawn_alone(self):
        words = (ROOT / "scripts/contactbench/figures.toml").read_text()
        links = {path.stem: path.resolve() for path in (ROOT / "scripts/plots").iterdir()}
        self.assertEqual(set(links), set(re.findall(r"^(\w+) = ", words, re.MULTILINE)))
        self.assertEqual(set(links.values()), {ROOT / "scripts/figure.py"})

    def test_every_planted_fault_stands_once_in_its_file(self):
        for fault in tomllib.loads((ROOT / "test/mutation/mutants.toml").read_text())["mutant"]:
            with self.subTest(fault["id"]):
                self.assertEqual((ROOT / fault["file"]).read_text().count(fault["from"]), 1)


if __name__ == "__main__":
    unittest.main()
