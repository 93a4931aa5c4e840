#!/usr/bin/env bash
# Installs what is missing and builds the program: build/bin/contactbench, the engines beside it and the Python module for what is installed.
#   scripts/build.sh              the program
#   scripts/build.sh --tests      besides, the tests (scripts/test.sh runs them)
#   scripts/build.sh --sanitize   both under the address and undefined-behaviour sanitizers (build-sanitize/)
#   scripts/build.sh --no-setup   without looking for missing packages
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

preset=release targets=(contactbench engines contactbench_python) packages=() setup=yes
for flag in "$@"; do
  case "$flag" in
    --tests) targets=() packages=(--tests) ;;
    --sanitize) preset=sanitize targets=() packages=(--tests) ;;
    --no-setup) setup=no ;;
    *) sed -n '2,6p' "$0" | sed 's/^# \{0,1\}//'; exit 2 ;;
  esac
done

[ "$setup" = no ] || "$root/scripts/setup.sh" "${packages[@]}"
build_preset "$preset" "${targets[@]}"
