#!/usr/bin/env bash
# A part of scripts/stress.py that takes seconds: no cell may be wrong, silent or a defect.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../scripts/lib.sh"
export PYTHONDONTWRITEBYTECODE=1
exec "$(find_python)" "$root/scripts/stress.py" --program "$1" --only P1 --only P2 --only W2 --only W3 --only F1 --only F2 --only T4 \
  --method ap/lemke
