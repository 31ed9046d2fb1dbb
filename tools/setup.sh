#!/usr/bin/env bash
# Set up .venv with all that the planner, its ROS interfaces and its tests need.
#
#   tools/setup.sh [--without-interfaces]
#
# Works in stages. A stage whose inputs have not changed since it last succeeded is skipped, so
# that a repeated or interrupted set-up does only what is left. PYTHON=... chooses the Python that
# makes a new .venv, as in tools/find_python.sh; VENV=... another folder than .venv. All state is in
# .venv/.setup: `rm -r .venv` starts afresh. Everything but the nodes works without the interfaces,
# which are left out where ROS has no wheels.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Up to here this runs in the bash of macOS and of Git for Windows too.
readonly system=$(uname -s) machine=$(uname -m)
if [[ $system != Linux ]]; then
  printf '%s\n' >&2 "Set-up is for Linux; this is $system. What needs no ROS runs here as well:" "" \
    "  python3 -m venv .venv" \
    "  .venv/bin/pip install '.[formats,pdf,picture]'    # on Windows: .venv\\Scripts\\pip" \
    "  brew install libusb                               # on macOS only: Open3D opens it" "" \
    "and then .venv/bin/focus_planner plan, report and the others; see docs/systems.md."
  exit 1
fi

readonly name=${VENV:-.venv}
venv=$name
[[ $venv == /* ]] || venv=$PWD/$venv
readonly venv state=$venv/.setup
readonly log=$name/.setup/setup.log
readonly python=$venv/bin/python

# A sourced ROS, another environment's marker or an active venv would leak into this one.
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH PYTHONHOME PYTHONPATH VIRTUAL_ENV
unset _ROS_WHEELS_BOOTSTRAP_COMPLETE

# What the wheels of Open3D and Numba expect of the system: library and Debian package.
declare -A library_packages=(
  [libGL.so.1]=libgl1
  [libEGL.so.1]=libegl1
  [libX11.so.6]=libx11-6
  [libidn2.so.0]=libidn2-0
  [libgomp.so.1]=libgomp1
)
case $machine in  # which Open3D's wheels for it expect besides
  x86_64) library_packages[libusb-1.0.so.0]=libusb-1.0-0 ;;
  aarch64 | arm64) library_packages[libgfortran.so.5]=libgfortran5 ;;
esac
readonly library_packages

exec 3>&2  # a stage's own output goes to the log; what the user must read goes here

say() { printf '%s\n' "$@" >&3; }

# End a stage with a message that leaves no need to see the log.
stop() {
  say "" "$@"
  exit 64
}

seconds_since() { awk -v start="$1" -v now="$EPOCHREALTIME" 'BEGIN { printf "%.1f s", now - start }'; }

# stage NAME TITLE FILE...: run stage_NAME unless it last succeeded with these files as they are.
stage() {
  local stage=$1 title=$2 stamp=$state/$1.stamp began=$EPOCHREALTIME key status=0 alive
  shift 2
  key=$(sha256sum tools/setup.sh "$@")
  [[ -f $stamp && $(<"$stamp") == "$key" ]] && return
  interrupted=$([[ -f $stamp && $(<"$stamp") == unfinished ]] && echo yes || echo no)
  echo unfinished >"$stamp"
  ((${#done_stages[@]})) || : >"$log"
  echo "== $title" >>"$log"
  printf '%-34s' "$title" >&3
  rm -f "$state/told"
  tools/alive.sh "$title" "$state" "$stamp" >&3 2>/dev/null 4>&- &
  alive=$!
  # Not under `if` or `||`: there, bash would ignore errors inside the stage.
  set +e
  (set -ex; "stage_$stage") >>"$log" 2>&1
  status=$?
  kill "$alive" 2>/dev/null
  wait "$alive" 2>/dev/null
  set -e
  [[ ! -t 3 || ${TERM:-dumb} == dumb ]] || printf '\r\033[K' >&3
  ((status != 64)) || exit 1
  [[ ! -t 3 && ! -e $state/told ]] || printf '%-34s' "$title" >&3
  if ((status)); then
    say "failed" "" "$(tools/cause.sh "$log" | sed 's/^/  /')" "" \
      "Set-up stopped at: $title. Fix the cause above and run it again: finished stages are kept." \
      "The full log is $log."
    exit 1
  fi
  echo "$key" >"$stamp"
  done_stages+=("$stage")
  seconds_since "$began" >&3
  say ""
}

fits() {  # PYTHON: whether it runs and is one that the lock file covers
  "$1" -SEc 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null
}

# The Python of .venv or, if there is none yet, the one that will make it: version, program, lacks.
find_python() {
  if [[ -x $python ]]; then PYTHON=$python tools/find_python.sh; else tools/find_python.sh; fi
}

# Debian packages that this machine lacks, one a line.
missing_packages() {
  local library libraries found packages
  command -v cc >/dev/null && command -v c++ >/dev/null || echo g++
  libraries=$(PATH=$PATH:/sbin ldconfig -p)
  for library in "${!library_packages[@]}"; do
    [[ $libraries == *"$library "* ]] || echo "${library_packages[$library]}"
  done
  found=$(find_python) || { printf '%s\n' python3 python3-dev python3-venv; return; }
  packages=${found##*$'\t'}
  [[ ! -x $venv/bin/pip ]] || packages=${packages/python*-venv/}
  # shellcheck disable=SC2086  # one word per package
  [[ -z $packages ]] || printf '%s\n' $packages
}

# Debian 12 and Ubuntu 22.04 have it.
readonly least_glibc=2.35

stage_system() {
  local packages sudo='' as_root=() glibc
  glibc=$(getconf GNU_LIBC_VERSION | cut -d ' ' -f 2) || glibc=none
  [[ $(printf '%s\n' "$least_glibc" "$glibc" | sort -V | head -n 1) == "$least_glibc" ]] ||
    stop "Open3D, which casts the rays, has wheels for glibc $least_glibc or newer, of Debian 12 and" \
      "Ubuntu 22.04; the glibc of this machine is $glibc."
  if ! find_python && { [[ ${PYTHON-} ]] || command -v python3; }; then
    stop "$( (set +x; find_python 2>&1) 2>/dev/null)" \
      "Choose one that works, by version or path: make setup PYTHON=/path/to/python3.12"
  fi
  packages=$(missing_packages | sort | tr '\n' ' ')
  [[ $packages ]] || return 0
  if ! command -v apt-get >/dev/null; then
    stop "Missing on this machine, by their Debian names: $packages" "Install them and repeat."
  fi
  if ((EUID)); then as_root=(sudo -n); fi
  if ! "${as_root[@]}" true 2>/dev/null; then
    command -v sudo >/dev/null && sudo="sudo "
    stop "Missing on this machine: $packages" "Type this, as root, and repeat:" "" \
      "  ${sudo}apt-get update && ${sudo}apt-get install -y --no-install-recommends $packages"
  fi
  say "" "  apt-get installs $packages"
  export DEBIAN_FRONTEND=noninteractive
  "${as_root[@]}" apt-get update
  # shellcheck disable=SC2086  # one word per package
  "${as_root[@]}" apt-get install -y --no-install-recommends $packages
  missing_packages >"$state/missing.txt"
  [[ ! -s $state/missing.txt ]] ||
    stop "apt-get succeeded, and yet these are missing:" "$(<"$state/missing.txt")"
}

announce_python() {
  local version program
  IFS=$'\t' read -r version program _ < <(find_python)
  say "Python $version ($program)"
}

# An environment keeps its Python: say so if another one is requested.
keep_python() {
  local asked version
  asked=$(tools/find_python.sh) || stop "$(tools/find_python.sh 2>&1)"
  asked=${asked%%$'\t'*}
  version=$("$python" -SEc 'import platform; print(platform.python_version())')
  [[ $asked == "$version" ]] ||
    say "$name keeps its Python $version. For $asked choose another folder: VENV=.venv-${asked%.*}"
}

stage_venv() {
  local program
  IFS=$'\t' read -r _ program _ < <(find_python)
  "$python" -m pip --version || "$program" -m venv "$venv"
}

# uv installs in a tenth of pip's time but knows nothing of pip's configuration: hand over the
# index and the certificates. What it cannot do with them, pip does.
stage_wheels() {
  local setting again=() lock=(--no-deps --require-hashes -r requirements.lock)
  pip_setting() {
    "$python" -m pip config list | sed -nE "s/^(global|install)\.$1='(.*)'$/\2/p" | tail -n 1
  }
  setting=${PIP_INDEX_URL:-$(pip_setting index-url)}
  [[ -z $setting ]] || export UV_DEFAULT_INDEX=${UV_DEFAULT_INDEX:-$setting}
  setting=${PIP_CERT:-$(pip_setting cert)}
  [[ -z $setting ]] || export SSL_CERT_FILE=${SSL_CERT_FILE:-$setting}

  sed -n '/^uv==/,/[^\\]$/p' requirements.lock >"$state/uv.txt"
  # A killed installer leaves packages that look installed and are not whole.
  [[ $interrupted == no ]] || again=(--reinstall)
  if "$python" -m pip install --no-compile --no-deps --require-hashes -r "$state/uv.txt" &&
    "$venv/bin/uv" pip install --python "$python" "${again[@]}" "${lock[@]}"; then
    return
  fi
  [[ $interrupted == no ]] || again=(--force-reinstall)
  "$python" -m pip install --no-compile "${again[@]}" "${lock[@]}"
}

# The wheels' exported CMake targets name the folders of the machine that built them.
repair_cmake_exports() {
  "$python" - <<'PYTHON'
import re
import sys
import sysconfig
from pathlib import Path

import numpy

builder = r"/opt/python/[^/;\"]+"
repairs = {
    builder + r"/include/python3\.\d+": sysconfig.get_path("include"),
    builder + r"/lib/python3\.\d+/site-packages/numpy/_core/include": numpy.get_include(),
}
for export in Path(sys.prefix, "share").glob("*/cmake/*Export.cmake"):
    text = repaired = export.read_text()
    for pattern, folder in repairs.items():
        repaired = re.sub(pattern, lambda _, folder=folder: folder, repaired)
    if repaired != text:
        # A new file, not an edit: this one may be a hard link into the installer's cache.
        fresh = export.with_suffix(".repaired")
        fresh.write_text(repaired)
        fresh.replace(export)
PYTHON
}

stage_kernels() {
  PYTHONPATH=. "$python" -m focus_planner warm-up
}

# The kernels need none of the interfaces, and some wait for others: compile both at once, messages
# with what kernels leave of the cores.
stage_build() {
  stage_kernels >"$state/kernels.log" 2>&1 &
  local kernels=$! status=0
  # shellcheck disable=SC2064 # by now, not when it ends: the variable is local
  trap "kill $kernels 2>/dev/null || :" EXIT
  build_messages
  echo "compiling kernels"
  wait "$kernels" || status=$?
  cat "$state/kernels.log"
  return "$status"
}

# PACKAGE FOLDER: build and install a package of messages.
build_package() {
  local build=$state/$1
  # What an earlier definition generated must not outlive it.
  if [[ -f $build/install_manifest.txt ]]; then
    tr '\n' '\0' <"$build/install_manifest.txt" | xargs -0 rm -f
  fi
  rm -rf "$build" "$venv"/lib/python3.*/site-packages/"$1"{,-*.egg-info}
  cmake -S "$2" -B "$build" -G Ninja -DBUILD_TESTING=OFF \
    -DCMAKE_INSTALL_PREFIX="$venv" -DCMAKE_PREFIX_PATH="$venv" \
    -DPython3_EXECUTABLE="$venv/bin/python"
  nice cmake --build "$build" --target install
}

# tf2_msgs is in no index of Python packages: tools/tf2_msgs has the one message of it that is used.
build_messages() {
  repair_cmake_exports
  export PATH=$venv/bin:$PATH
  build_package focus_planner_msgs msg_defs
  build_package tf2_msgs tools/tf2_msgs
  "$python" - <<'PYTHON'
from focus_planner_msgs.action import PlanFocus as PlanAction
from focus_planner_msgs.srv import PlanFocus as PlanService
from rclpy.type_support import check_for_type_support
from tf2_msgs.msg import TFMessage

check_for_type_support(PlanAction)
check_for_type_support(PlanService)
check_for_type_support(TFMessage)
PYTHON
}

# `compat`: a path in site-packages, which type checkers follow too, in place of an import hook.
# The lock: set-ups of several environments would write *.egg-info at the same time.
stage_package() {
  flock setup.py "$python" -m pip install --no-deps --no-build-isolation \
    --config-settings editable_mode=compat -e .
}

# Also writes the bytecode of what is imported, which the installers leave out: the whole would
# take half a minute. Without it, every start of a program would compile these again.
stage_check() {
  unset PYTHONDONTWRITEBYTECODE
  "$python" -m pip check
  "$python" - <<'PYTHON'
import hypothesis, matplotlib.pyplot, numba, open3d, pytest, rich.console, rich.table, yaml
import scipy.optimize, scipy.sparse, scipy.spatial

assert numba.njit(lambda: 1)() == 1
PYTHON
  [[ $ros == no ]] || "$python" -c 'import rclpy.action'
}

interfaces=yes
case ${1-} in
  '') ;;
  --without-interfaces) interfaces=no ;;
  *) stop "tools/setup.sh: expected no argument or --without-interfaces, got: $*" ;;
esac

case $machine in
  x86_64) ros=yes ;;
  aarch64 | arm64) ros=no interfaces=no ;;
  *) stop "There are wheels of Open3D and Numba for x86-64 and aarch64; this machine is $machine." ;;
esac

# Scripts in a .venv name its folder: one that was moved, or whose Python is gone, is useless.
if [[ -e $venv ]] && { [[ -f $state/location && $(<"$state/location") != "$PWD" ]] ||
  { [[ -e $venv/bin ]] && ! fits "$python"; }; }; then
  say "Removing $name: it was moved, or its Python does not run or is not 3.10 to 3.13."
  rm -rf "$venv"
fi
mkdir -p "$state"
echo "$PWD" >"$state/location"

exec 4>"$state/lock"  # two set-ups at once would trip over each other
flock 4

if [[ -x $python && ${PYTHON-} ]]; then keep_python; fi

done_stages=()
began=$EPOCHREALTIME
mapfile -t definitions < <(find msg_defs tools/tf2_msgs -type f ! -name CHANGELOG.rst | sort)
mapfile -t core < <(find focus_planner/core -name '*.py' | sort)
stage system "system packages"
[[ -x $python ]] || announce_python
stage venv "virtual environment"
stage wheels "Python and ROS packages" requirements.lock
[[ $interfaces == no ]] ||
  stage build "ROS interfaces, kernels" requirements.lock "${definitions[@]}"
stage kernels "kernels" requirements.lock "${core[@]}"
stage package "focus_planner" requirements.lock setup.py setup.cfg
stage check "check" requirements.lock setup.py setup.cfg
if ((${#done_stages[@]})); then
  printf '%-34s%s\n' "ready: $name" "$(seconds_since "$began")" >&3
  [[ $ros == yes ]] ||
    say "Without ROS, of which there are no wheels for $machine: everything but the nodes works." \
      "For the nodes, build this in a sourced ROS 2 Jazzy; see CONTRIBUTING.md."
fi
