#!/usr/bin/env bash
# Installs from Debian's packages what the program, its tests and its figures need, and only what is missing.
#   scripts/setup.sh           install what is missing (Debian 12; asks sudo where not root)
#   scripts/setup.sh --tests   besides, what only the tests need
#   scripts/setup.sh --engines besides, the engines that can stand beside the methods (docs/engines.md)
#   scripts/setup.sh --check   print what is missing, install nothing; exit code 1 where a needed package is missing
set -euo pipefail

needed=(
  cmake g++ ninja-build pkg-config   # build
  libeigen3-dev libsuitesparse-dev   # linear algebra
  libpugixml-dev libcli11-dev libfmt-dev nlohmann-json3-dev  # scene files, flags, output
  catch2                             # tests
  python3 python3-numpy python3-matplotlib python3-pandas python3-jinja2  # figures and tables
)
# The build leaves out what these serve where a release does not carry them.
optional=(
  libhdf5-dev libfclib-dev           # stored contact problems
  liburdfdom-dev                     # robots from URDF files
  libbenchmark-dev                   # bench/
  pybind11-dev python3-dev           # the Python module
  git                                # the commit in the manifest
  libjs-three                        # runs to look at (view.py)
  python3-tqdm                       # the time left of a sweep, as a bar
  python3-distributed                # sweeps on other machines (sweep.py --engine dask)
)
# Others' programs that the tests compare with or look through; without one its tests are skipped.
for_tests=(
  python3-cvxopt                     # the convex method against a solver that shares no code
  liborocos-kdl-dev                  # robots against another library
  chromium                           # the report in a browser
  assimp-utils                       # glTF files
  yapf3 flake8 pylint                # how scripts/ is written
  clang-format                       # how all else is
  qemu-user                          # the same numbers on other processors
)

# Engines beside the methods; nothing needs them.
engines=(libode-dev libbullet-dev libmujoco-dev libdart-dev libsimbody-dev libsiconos-mechanics-dev)

check=no
for flag in "$@"; do
  case "$flag" in
    --tests) optional+=("${for_tests[@]}") ;;
    --engines) optional+=("${engines[@]}") ;;
    --check) check=yes; optional+=("${for_tests[@]}") ;;
    *) sed -n '2,6p' "$0" | sed 's/^# \{0,1\}//'; exit 2 ;;
  esac
done

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  echo "setup: no apt-get here. Install these (Debian's names) by hand: ${needed[*]}; optional: ${optional[*]}" >&2
  exit 1
fi

installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }
missing() { local p; for p in "$@"; do installed "$p" || echo "$p"; done; }

mapfile -t lacking < <(missing "${needed[@]}")
mapfile -t lacking_optional < <(missing "${optional[@]}")

if [ "$check" = yes ]; then
  for p in "${lacking[@]}"; do echo "missing: $p"; done
  for p in "${lacking_optional[@]}"; do echo "missing (optional): $p"; done
  [ ${#lacking[@]} -eq 0 ] || exit 1
  [ ${#lacking_optional[@]} -ne 0 ] || echo "nothing is missing"
  exit 0
fi
if [ $((${#lacking[@]} + ${#lacking_optional[@]})) -eq 0 ]; then
  exit 0
fi

known() { apt-cache show "$1" >/dev/null 2>&1; }
# An optional package that this release does not carry is not asked for again and again.
if [ ${#lacking[@]} -eq 0 ] && compgen -G '/var/lib/apt/lists/*_Packages*' >/dev/null; then
  askable=()
  for p in "${lacking_optional[@]}"; do
    if known "$p"; then askable+=("$p"); else echo "setup: $p is not in this release's packages; left out"; fi
  done
  lacking_optional=("${askable[@]}")
  [ ${#lacking_optional[@]} -ne 0 ] || exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "setup: not root, and no sudo. As root: apt-get install ${lacking[*]} ${lacking_optional[*]}" >&2
    # Without the optional packages the program still builds.
    [ ${#lacking[@]} -eq 0 ] && exit 0 || exit 1
  fi
  as_root=(sudo)
fi
apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get "$@"; }

echo "setup: installing ${lacking[*]} ${lacking_optional[*]}"
apt update -qq
wanted=("${lacking[@]}")
for p in "${lacking_optional[@]}"; do
  if known "$p"; then
    wanted+=("$p")
  else
    echo "setup: $p is not in this release's packages; left out"
  fi
done
[ ${#wanted[@]} -eq 0 ] || apt install -y -qq --no-install-recommends "${wanted[@]}"
