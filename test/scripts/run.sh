#!/usr/bin/env bash
# The tests of scripts/, with a python that can draw.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../../scripts/lib.sh"
export PYTHONDONTWRITEBYTECODE=1
exec "$(find_python)" "$root/test/scripts/reproduction.py"
