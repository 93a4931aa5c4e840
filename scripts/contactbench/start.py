"""Where every script begins. It is started by whatever python3 comes first on a user's PATH, which may be a bare one of
their own: need() goes on in one that has the modules. As a script this prints that one (scripts/lib.sh)."""
import importlib
import importlib.util
import os
import sys

MODULES = ("jinja2", "matplotlib", "numpy", "pandas", "tomllib")
# Debian's own has what scripts/setup.sh installs.
CANDIDATES = (os.environ.get("PYTHON", ""), "/usr/bin/python3", "/usr/local/bin/python3")
ASKED = "CONTACTBENCH_PYTHONS_ASKED"  # how many of them were, which each tells the next


def need(modules=MODULES):
    """Returns where this interpreter has the modules; else starts the script again in the next candidate, and where
    none is left ends with exit code 1."""
    asked = int(os.environ.pop(ASKED, 0))
    lacking = [m for m in modules if importlib.util.find_spec(m) is None]
    if not lacking:
        return
    for number, candidate in enumerate(CANDIDATES[asked:], start=asked + 1):
        if os.access(candidate, os.X_OK):
            os.environ[ASKED] = str(number)
            os.execv(candidate, [candidate, *sys.orig_argv[1:]])
    packages = ", ".join(f"python3-{m}" for m in lacking)
    print(
        f"{os.path.basename(sys.argv[0])}: no python3 here has {', '.join(lacking)}: scripts/setup.sh --tests installs "
        f"Debian's ({packages}); PYTHON=/path/to/python3 names another one", file=sys.stderr)
    sys.exit(1)


def command(name):
    """Runs main() of a module of the package, with its exit code."""
    need()
    program = importlib.import_module("contactbench.program")
    try:
        sys.exit(importlib.import_module(f"contactbench.{name}").main())
    except program.ProgramError as error:
        sys.exit(f"{name}: {error}")
    except KeyboardInterrupt:
        print(f"\n{name}: interrupted", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    need()
    print(sys.executable)
