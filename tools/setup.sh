#!/usr/bin/env bash
# Set up .venv with all that the planner, its ROS interfaces and its tests need.
#
# Works in stages. A stage whose inputs have not changed since it last succeeded is skipped, so
# that a repeated or interrupted set-up does only what is left. PYTHON=... chooses the Python that
# makes a new .venv. All state is in .venv/.setup: `rm -r .venv` starts from nothing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly venv=$PWD/.venv
readonly state=$venv/.setup
readonly log=.venv/.setup/setup.log
readonly messages=$state/focus_planner_msgs

# A sourced ROS, another environment's marker or an active venv would leak into this one.
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH PYTHONHOME PYTHONPATH VIRTUAL_ENV
unset _ROS_WHEELS_BOOTSTRAP_COMPLETE

# What the wheels of Open3D and Numba expect of the system: library and Debian package.
declare -rA library_packages=(
  [libusb-1.0.so.0]=libusb-1.0-0
  [libGL.so.1]=libgl1
  [libEGL.so.1]=libegl1
  [libX11.so.6]=libx11-6
  [libidn2.so.0]=libidn2-0
  [libgomp.so.1]=libgomp1
)

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
  local name=$1 title=$2 stamp=$state/$1.stamp began=$EPOCHREALTIME key status=0
  shift 2
  key=$(sha256sum tools/setup.sh "$@")
  [[ -f $stamp && $(<"$stamp") == "$key" ]] && return
  interrupted=$([[ -f $stamp && $(<"$stamp") == unfinished ]] && echo yes || echo no)
  echo unfinished >"$stamp"
  ((${#done_stages[@]})) || : >"$log"
  printf '%-34s' "$title" >&3
  # Not under `if` or `||`: there, bash would ignore errors inside the stage.
  set +e
  (set -ex; "stage_$name") >>"$log" 2>&1
  status=$?
  set -e
  ((status != 64)) || exit 1
  if ((status)); then
    say "failed" "" "The last lines of $log:" "$(tail -n 15 "$log" | sed 's/^/  /')" "" \
      "Set-up stopped at: $title. Mend the cause named above and repeat: what is done is kept."
    exit 1
  fi
  echo "$key" >"$stamp"
  done_stages+=("$name")
  seconds_since "$began" >&3
  say ""
}

fits() {  # PYTHON: whether it runs and is one that the lock file covers
  "$1" -SEc 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null
}

find_python() {
  local candidate
  for candidate in .venv/bin/python ${PYTHON:-python3 python3.12 python3.11 python3.13 python3.10}; do
    if fits "$candidate"; then
      echo "$candidate"
      return
    fi
  done
  return 1
}

# Debian packages that this machine lacks, one a line.
missing_packages() {
  local python version library libraries
  command -v cc >/dev/null && command -v c++ >/dev/null || echo g++
  libraries=$(PATH=$PATH:/sbin ldconfig -p)
  for library in "${!library_packages[@]}"; do
    [[ $libraries == *"$library "* ]] || echo "${library_packages[$library]}"
  done
  python=$(find_python) || { printf '%s\n' python3 python3-dev python3-venv; return; }
  version=$("$python" -SEc 'import sys; print("%d.%d" % sys.version_info[:2])')
  [[ -x .venv/bin/pip ]] || "$python" -SEc 'import ensurepip' || echo "python$version-venv"
  [[ -f $("$python" -SEc 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h ]] ||
    echo "python$version-dev"
}

stage_system() {
  local packages sudo='' as_root=()
  packages=$(missing_packages | sort | tr '\n' ' ')
  if ! find_python && { [[ ${PYTHON-} ]] || command -v python3; }; then
    stop "Python 3.10 to 3.13 is needed. ${PYTHON:-python3} is: $("${PYTHON:-python3}" --version 2>&1)" \
      "Install one of them and name it: make setup PYTHON=/path/to/python3.12"
  fi
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

stage_venv() {
  .venv/bin/python -m pip --version || "$(find_python)" -m venv .venv
}

# uv installs in a tenth of pip's time but knows nothing of pip's configuration: hand over the
# index and the certificates. What it cannot do with them, pip does.
stage_wheels() {
  local setting again=() lock=(--no-deps --require-hashes -r requirements.lock)
  pip_setting() {
    .venv/bin/python -m pip config list | sed -nE "s/^(global|install)\.$1='(.*)'$/\2/p" | tail -n 1
  }
  setting=${PIP_INDEX_URL:-$(pip_setting index-url)}
  [[ -z $setting ]] || export UV_DEFAULT_INDEX=${UV_DEFAULT_INDEX:-$setting}
  setting=${PIP_CERT:-$(pip_setting cert)}
  [[ -z $setting ]] || export SSL_CERT_FILE=${SSL_CERT_FILE:-$setting}

  sed -n '/^uv==/,/[^\\]$/p' requirements.lock >"$state/uv.txt"
  # A killed installer leaves packages that look installed and are not whole.
  [[ $interrupted == no ]] || again=(--reinstall)
  if .venv/bin/python -m pip install --no-compile --no-deps --require-hashes -r "$state/uv.txt" &&
    .venv/bin/uv pip install --python .venv/bin/python "${again[@]}" "${lock[@]}"; then
    return
  fi
  [[ $interrupted == no ]] || again=(--force-reinstall)
  .venv/bin/python -m pip install --no-compile "${again[@]}" "${lock[@]}"
}

# The wheels' exported CMake targets name the folders of the machine that built them.
repair_cmake_exports() {
  .venv/bin/python - <<'PYTHON'
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
  PYTHONPATH=. .venv/bin/python -c 'from focus_planner.core.planning.precompile import warm_up; warm_up()'
}

# The kernels need none of the interfaces, and one core: compile both at once.
stage_build() {
  stage_kernels &
  local kernels=$!
  # shellcheck disable=SC2064 # by now, not when it ends: the variable is local
  trap "kill $kernels 2>/dev/null || :" EXIT
  build_messages
  wait "$kernels"
}

build_messages() {
  repair_cmake_exports
  # What an earlier definition generated must not outlive it.
  if [[ -f $messages/install_manifest.txt ]]; then
    tr '\n' '\0' <"$messages/install_manifest.txt" | xargs -0 rm -f
  fi
  rm -rf "$messages" "$venv"/lib/python3.*/site-packages/focus_planner_msgs
  export PATH=$venv/bin:$PATH
  cmake -S msg_defs -B "$messages" -G Ninja -DBUILD_TESTING=OFF \
    -DCMAKE_INSTALL_PREFIX="$venv" -DCMAKE_PREFIX_PATH="$venv" \
    -DPython3_EXECUTABLE="$venv/bin/python"
  cmake --build "$messages" --target install
}

stage_package() {
  .venv/bin/python -m pip install --no-deps --no-build-isolation -e .
}

# Also writes the bytecode of what is imported, which the installers leave out: the whole would
# take half a minute. Without it, every start of a program would compile these again.
stage_check() {
  unset PYTHONDONTWRITEBYTECODE
  .venv/bin/python -m pip check
  .venv/bin/python - <<'PYTHON'
import hypothesis, matplotlib.pyplot, numba, open3d, pytest, rich.console, rich.table, yaml
import rclpy.action
import scipy.optimize, scipy.sparse, scipy.spatial
from focus_planner_msgs.action import PlanFocus as PlanAction
from focus_planner_msgs.srv import PlanFocus as PlanService
from rclpy.type_support import check_for_type_support

check_for_type_support(PlanAction)
check_for_type_support(PlanService)
assert numba.njit(lambda: 1)() == 1
PYTHON
}

# Scripts in a .venv name its folder: one that was moved, or whose Python is gone, is useless.
if [[ -e .venv ]] && { [[ -f $state/location && $(<"$state/location") != "$PWD" ]] ||
  { [[ -e .venv/bin ]] && ! fits .venv/bin/python; }; }; then
  say "Removing .venv: it was moved, or its Python does not run or is not 3.10 to 3.13."
  rm -rf .venv
fi
mkdir -p "$state"
echo "$PWD" >"$state/location"

exec 4>"$state/lock"  # two set-ups at once would trip over each other
flock 4

done_stages=()
began=$EPOCHREALTIME
mapfile -t definitions < <(find msg_defs -type f | sort)
mapfile -t core < <(find focus_planner/core -name '*.py' | sort)
stage system "system packages"
stage venv "virtual environment"
stage wheels "Python and ROS packages" requirements.lock
stage build "ROS interfaces, kernels" requirements.lock "${definitions[@]}"
stage kernels "kernels" requirements.lock "${core[@]}"
stage package "focus_planner" requirements.lock setup.py setup.cfg
stage check "check" requirements.lock setup.py setup.cfg "${definitions[@]}"
if ((${#done_stages[@]})); then
  say "ready: .venv                      $(seconds_since "$began")"
fi
