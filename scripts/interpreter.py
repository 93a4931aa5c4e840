"""A script is started by whatever python3 comes first on a user's PATH, which may be a bare one of their own; need() goes on in one
that has the modules. As a script it prints that one (scripts/lib.sh)."""
import importlib.util
import os
import subprocess
import sys

# Debian's own has what scripts/setup.sh installs.
CANDIDATES = (os.environ.get("PYTHON", ""), "/usr/bin/python3", "/usr/local/bin/python3")


def has(candidate, modules):
    try:
        return subprocess.run([candidate, "-c", "import " + ", ".join(modules)], stderr=subprocess.DEVNULL).returncode == 0
    except OSError:
        return False


def need(*modules, otherwise=1):
    """Returns where this interpreter has the modules; else starts the script again in one that has, or ends with code `otherwise`."""
    lacking = [m for m in modules if importlib.util.find_spec(m) is None]
    if not lacking:
        return
    for candidate in filter(None, CANDIDATES):
        if has(candidate, modules):
            os.execv(candidate, [candidate, *sys.orig_argv[1:]])
    print(f"{os.path.basename(sys.argv[0])}: no python3 here has {', '.join(lacking)}: scripts/setup.sh --tests installs Debian's "
          f"({', '.join('python3-' + m for m in lacking)}); PYTHON=/path/to/python3 names another one", file=sys.stderr)
    sys.exit(otherwise)


if __name__ == "__main__":
    need("matplotlib", "numpy")
    print(sys.executable)
