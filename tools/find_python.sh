#!/usr/bin/env bash
# Find a Python to make a virtual environment with.
#
#   tools/find_python.sh         the one to use: PYTHON if it is set (a version such as 3.10, or a
#                                program), otherwise 3.12, which is Jazzy's own, 3.13, 3.11 or 3.10
#   tools/find_python.sh --all   the best one of each version, in this order
#
# Prints one line per Python, of three fields separated by tabs: version, program, and the Debian
# packages it lacks for making virtual environments and building extensions. A complete Python
# beats one that lacks packages. Every candidate is run: pyenv puts shims on PATH even for versions
# that are not selected. All versions installed in pyenv are candidates, selected or not. If there
# is none, one line on stderr says why and the exit status is 1.
set -euo pipefail

readonly versions=(3.12 3.13 3.11 3.10)  # those of requirements.lock
readonly tab=$'\t'

# probe PROGRAM: print its line, or why it cannot be used.
probe() {
  local answer
  if ! command -v "$1" >/dev/null; then
    echo "there is no such program"
    return 1
  fi
  if ! answer=$("$1" -SEc "$probe_code" 2>&1); then
    answer=$(awk 'NF { line = $0; if (!/^Traceback/) exit } END { print line }' <<<"$answer")
    echo "it does not run: ${answer:-no output}"
    return 1
  fi
  answer=${answer##*$'\n'}
  echo "${answer#"unusable$tab"}"
  [[ $answer != unusable* ]]
}

# Runs on every Python from 2.7 on, to say which it is.
readonly probe_code='
import os, platform, sys, sysconfig

def reply(*fields):
    print("\t".join(fields))
    sys.exit()

version = "%d.%d" % sys.version_info[:2]
name = "%s %s" % (platform.python_implementation(), platform.python_version())
if name[:2] != "CP" or not (3, 10) <= sys.version_info[:2] <= (3, 13):
    reply("unusable", "it is %s; CPython 3.10 to 3.13 is needed" % name)
if sysconfig.get_config_var("Py_GIL_DISABLED"):
    reply("unusable", "it is a free-threaded %s, which Numba does not support" % name)
lacks = []
try:
    import ensurepip, venv
except ImportError:
    lacks.append(("venv", "it cannot make virtual environments: it lacks ensurepip or venv"))
header = os.path.join(sysconfig.get_path("include"), "Python.h")
if not os.path.exists(header):
    lacks.append(("dev", "its headers are not installed: there is no " + header))
if lacks and sys.prefix != "/usr":  # no package can mend that
    reply("unusable", lacks[0][1])
packages = " ".join("python%s-%s" % (version, part) for part, _ in lacks)
reply(platform.python_version(), sys.executable, packages)
'

candidates() {  # VERSION: programs that may be it
  type -ap "python$1" python3 || :
  compgen -G "${PYENV_ROOT:-${HOME-}/.pyenv}/versions/$1[.-]*/bin/python$1" | sort -rV || :
}

best_of() {  # VERSION: its line
  local candidate answer incomplete=''
  while read -r candidate; do
    answer=$(probe "$candidate") && [[ $answer == "$1".* ]] || continue
    if [[ $answer == *"$tab" ]]; then
      echo "$answer"
      return
    fi
    incomplete=${incomplete:-$answer}
  done < <(candidates "$1")
  [[ $incomplete ]] && echo "$incomplete"
}

all() {
  local version
  for version in "${versions[@]}"; do best_of "$version" || :; done
}

chosen() {  # PYTHON: its line
  local version=${1#python} answer
  if [[ $version =~ ^3\.[0-9]+$ ]] && best_of "$version"; then
    return
  fi
  if [[ $1 =~ ^[0-9.]+$ ]]; then
    answer="no such CPython, of 3.10 to 3.13, is on PATH or in pyenv; give the path of one"
  elif answer=$(probe "$1"); then
    echo "$answer"
    return
  fi
  echo "PYTHON=$1: $answer." >&2
  return 1
}

if [[ ${1-} == --all ]]; then
  all
elif [[ ${PYTHON-} ]]; then
  chosen "$PYTHON"
else
  found=$(all)
  { grep -m 1 "$tab$" <<<"$found" || grep -m 1 . <<<"$found"; } || {
    echo "No CPython 3.10 to 3.13 was found; python3: $(probe python3)." >&2
    exit 1
  }
fi
