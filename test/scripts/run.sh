#!/usr/bin/env bash
# The tests of scripts/, with a python that can draw. What is not installed (Dask, Chromium) is skipped with a message.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../../scripts/lib.sh"
export PYTHONDONTWRITEBYTECODE=1
cd "$root/test/scripts"
exec "$(find_python)" -m unittest --verbose "${@:-discover}"
