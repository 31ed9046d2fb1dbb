# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Set-up: which Python it chooses, and what it reports when it fails.

The Pythons are stub scripts that answer as those of other versions would.
"""

from __future__ import annotations

import fcntl
import os
import platform
import pty
import re
import shutil
import struct
import subprocess
import sys
import termios
from contextlib import contextmanager
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
TOOLS = REPOSITORY / "tools"
NEWEST_FIRST = ("3.12.4", "3.13.1", "3.11.9", "3.10.2")

pytestmark = pytest.mark.processes


# --- which Python ----------------------------------------------------------------------------


def program(path, answer, *, fails=False):
    """Write a program that prints an answer, whatever it is asked."""
    path.parent.mkdir(parents=True, exist_ok=True)
    stream = "2" if fails else "1"
    path.write_text(f"#!/bin/sh\nprintf '%s\\n' '{answer}' >&{stream}\nexit {int(fails)}\n")
    path.chmod(0o755)
    return path


def python(path, version, lacks=""):
    return program(path, f"{version}\t{path}\t{lacks}")


def shim(path):
    return program(path, f"pyenv: {path.name}: command not found", fails=True)


@pytest.fixture
def machine(tmp_path):
    """A machine without any Python: a folder of programs, and a pyenv without versions."""
    programs = tmp_path / "bin"
    programs.mkdir()
    for name in ("awk", "bash", "cut", "grep", "sort"):
        (programs / name).symlink_to(shutil.which(name))
    return tmp_path


def find(machine, *arguments, **settings):
    env = {"PATH": str(machine / "bin"), "HOME": str(machine), **settings}
    return subprocess.run(
        [str(TOOLS / "find_python.sh"), *arguments],
        env=env,
        capture_output=True,
        text=True,
        check=False,
    )


def found(machine, **settings):
    done = find(machine, **settings)
    assert done.returncode == 0, done.stderr
    return done.stdout.rstrip("\n").split("\t")


def refusal(machine, **settings):
    done = find(machine, **settings)
    assert (done.returncode, done.stdout) == (1, "")
    (line,) = done.stderr.splitlines()
    return line


def test_jazzys_own_python_comes_first_then_the_others(machine):
    for version in reversed(NEWEST_FIRST):
        path = python(machine / "bin" / f"python{version.rpartition('.')[0]}", version)
        if version != "3.13.1":
            python(machine / "bin" / "python3", version)
    assert found(machine)[0] == "3.12.4"
    listed = find(machine, "--all").stdout.splitlines()
    assert [line.split("\t")[0] for line in listed] == list(NEWEST_FIRST)
    path = machine / "bin" / "python3.10"
    assert found(machine, PYTHON="3.10") == ["3.10.2", str(path), ""]


def test_pythons_of_pyenv_are_found_behind_shims_that_do_not_run(machine):
    shim(machine / "bin" / "python3.12")
    python(machine / "bin" / "python3", "3.11.7")
    assert found(machine)[0] == "3.11.7"
    for version in ("3.12.1", "3.12.10", "3.12.9"):
        path = machine / ".pyenv" / "versions" / version / "bin" / "python3.12"
        python(path, version)
    newest = str(machine / ".pyenv" / "versions" / "3.12.10" / "bin" / "python3.12")
    assert found(machine) == ["3.12.10", newest, ""]
    assert found(machine, PYTHON="python3.12") == ["3.12.10", newest, ""]
    elsewhere = machine / "elsewhere"
    (machine / ".pyenv").rename(elsewhere)
    assert found(machine)[0] == "3.11.7"
    assert found(machine, PYENV_ROOT=str(elsewhere))[0] == "3.12.10"


def test_one_that_lacks_nothing_comes_before_one_that_apt_has_to_complete(machine):
    lacks = "python3.12-venv python3.12-dev"
    python(machine / "bin" / "python3.12", "3.12.3", lacks)
    assert found(machine)[::2] == ["3.12.3", lacks]
    python(machine / "bin" / "python3.10", "3.10.12")
    assert found(machine)[::2] == ["3.10.12", ""]
    assert found(machine, PYTHON="3.12")[::2] == ["3.12.3", lacks]


def test_a_chosen_python_that_does_not_work_is_told_in_one_line(machine):
    python(machine / "bin" / "python3.12", "3.12.1")
    path = shim(machine / "bin" / "python3.11")
    assert refusal(machine, PYTHON="nowhere") == "PYTHON=nowhere: there is no such program."
    assert refusal(machine, PYTHON=str(path)) == (
        f"PYTHON={path}: it does not run: pyenv: python3.11: command not found."
    )
    assert "PYTHON=3.13: no such CPython, of 3.10 to 3.13, is on PATH or in pyenv" in refusal(
        machine, PYTHON="3.13"
    )
    old = program(machine / "old", "unusable\tit is CPython 3.9.18; CPython 3.10 to 3.13 is needed")
    assert refusal(machine, PYTHON=str(old)).startswith(f"PYTHON={old}: it is CPython 3.9.18; ")


def test_a_machine_without_a_python_that_fits_is_told_so(machine):
    told = "No CPython 3.10 to 3.13 was found; python3: "
    assert refusal(machine) == f"{told}there is no such program."
    program(machine / "bin" / "python3", "unusable\tit is CPython 3.8.10; newer is needed")
    assert refusal(machine) == f"{told}it is CPython 3.8.10; newer is needed."


def test_real_pythons_answer(machine):
    version, path, _ = found(machine, PYTHON=sys.executable)
    assert version == platform.python_version()
    assert Path(path).resolve() == Path(sys.executable).resolve()


# --- why it failed ---------------------------------------------------------------------------

LOGS = {
    "exception": (
        """\
Traceback (most recent call last):
  File "<string>", line 1, in <module>
  File "/x/focus_planner/core/solvers/solution.py", line 158, in assign_samples
    seen = kernels.assign(
           ^^^^^^^^^^^^^^^
  File "/x/.venv/lib/python3.12/site-packages/numba/parfors/parfor.py", line 3966, in lookup
    raise AssertionError("unexpected cycle in lookup()")
AssertionError: unexpected cycle in lookup()
""",
        [
            "AssertionError: unexpected cycle in lookup()",
            '  in "/x/focus_planner/core/solvers/solution.py", line 158: seen = kernels.assign(',
        ],
    ),
    "exception of several lines": (
        """\
Traceback (most recent call last):
  File "/x/focus_planner/core/planning/x.py", line 42, in warm_up
    plan_focus(scene, rig, request)
numba.core.errors.TypingError: Failed in nopython mode pipeline (step: frontend)
Cannot unify int64 and array(int64, 1d, C)

File "focus_planner/core/kernels/stabbing.py", line 77:
def stab(
    <source elided>
""",
        [
            "numba.core.errors.TypingError: Failed in nopython mode pipeline (step: frontend)",
            "Cannot unify int64 and array(int64, 1d, C)",
            'File "focus_planner/core/kernels/stabbing.py", line 77:',
            "def stab(",
            "    <source elided>",
            '  in "/x/focus_planner/core/planning/x.py", line 42: plan_focus(scene, rig, request)',
        ],
    ),
    "pip": (
        """\
+ python -m pip install -r requirements.lock
Looking in links: /wheels
ERROR: Ignored the following versions that require a different python version: 0.1
ERROR: Could not find a version that satisfies the requirement nothing==1.0
ERROR: No matching distribution found for nothing==1.0
WARNING: There was an error checking the latest version of pip.
""",
        [
            "ERROR: Could not find a version that satisfies the requirement nothing==1.0",
            "ERROR: No matching distribution found for nothing==1.0",
        ],
    ),
    "uv": (
        """\
Downloading numpy (16.0MiB)
error: Failed to download `numpy==2.2.6`
  cause: Hash mismatch for `numpy==2.2.6`
""",
        ["error: Failed to download `numpy==2.2.6`", "  cause: Hash mismatch for `numpy==2.2.6`"],
    ),
    "apt": (
        "Reading package lists...\nE: Unable to locate package python3.12-venv\n",
        ["E: Unable to locate package python3.12-venv"],
    ),
    "cmake": (
        """\
-- The C compiler identification is GNU 12.2.0
CMake Error at CMakeLists.txt:2 (find_package):
  By not providing "Findnone.cmake" in CMAKE_MODULE_PATH this project has

  asked CMake to find a package configuration file provided by "none".

-- Configuring incomplete, errors occurred!
""",
        [
            "CMake Error at CMakeLists.txt:2 (find_package):",
            '  By not providing "Findnone.cmake" in CMAKE_MODULE_PATH this project has',
            '  asked CMake to find a package configuration file provided by "none".',
        ],
    ),
    "ninja": (
        """\
[1/4] Building C object a.c.o
FAILED: [code=1] a.c.o
/usr/bin/cc -o a.c.o -c /x/a.c
/x/a.c: In function 'f':
/x/a.c:1:16: error: 'x' undeclared (first use in this function)
[2/4] Building C object b.c.o
FAILED: [code=1] b.c.o
/x/b.c:1:10: fatal error: none.h: No such file or directory
compilation terminated.
ninja: build stopped: subcommand failed.
""",
        [
            "FAILED: [code=1] a.c.o",
            "/x/a.c:1:16: error: 'x' undeclared (first use in this function)",
            "FAILED: [code=1] b.c.o",
            "/x/b.c:1:10: fatal error: none.h: No such file or directory",
        ],
    ),
    "generator": (
        """\
[1/4] Generating Python
FAILED: [code=1] _plan.py
Traceback (most recent call last):
  File "/x/rosidl_generator_py", line 8, in <module>
    generate(arguments)
KeyError: 'type'
[2/4] Building C object b.c.o
ninja: build stopped: subcommand failed.
""",
        [
            "KeyError: 'type'",
            '  in "/x/rosidl_generator_py", line 8: generate(arguments)',
            "FAILED: [code=1] _plan.py",
        ],
    ),
    "memory": (
        "tools/setup.sh: line 9: 4321 Killed                  python -c 'warm_up()'\n",
        ["tools/setup.sh: line 9: 4321 Killed                  python -c 'warm_up()'"],
    ),
    "earlier stage": (
        "== one\nERROR: mended since\n== two\nERROR: this\n",
        ["ERROR: this"],
    ),
    "anything else": (
        "+ odd\n" + "".join(f"line {i}\n" for i in range(20)),
        [f"line {i}" for i in range(5, 20)],
    ),
}


@pytest.mark.parametrize(("log", "cause"), LOGS.values(), ids=LOGS)
def test_the_cause_of_a_failed_stage_is_found_in_its_log(tmp_path, log, cause):
    file = tmp_path / "setup.log"
    file.write_text(f"== a stage\n+ a command\n{log}+ exit 1\n", encoding="utf-8")
    command = [str(TOOLS / "cause.sh"), str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == cause


# --- set-up itself ---------------------------------------------------------------------------


def on(tmp_path, **answers):
    """Return a PATH on which programs give answers as those of another machine would."""
    for name, answer in answers.items():
        case = "".join(f'[ "$1" = "{word}" ] && echo "{said}"\n' for word, said in answer.items())
        path = tmp_path / "stubs" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"#!/bin/sh\n{case}true\n")
        path.chmod(0o755)
    return f"{tmp_path / 'stubs'}:{os.environ['PATH']}"


def set_up(tmp_path, **settings):
    """Set up in a copy of the repository that has nothing but what set-up looks at first."""
    shutil.copytree(TOOLS, tmp_path / "tools")
    (tmp_path / "msg_defs").mkdir()
    (tmp_path / "focus_planner" / "core").mkdir(parents=True)
    for name in ("requirements.lock", "setup.py", "setup.cfg"):
        shutil.copy(REPOSITORY / name, tmp_path)
    return subprocess.run(
        [str(tmp_path / "tools" / "setup.sh")],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        check=False,
    )


LINUX = {"-s": "Linux", "-m": "aarch64"}


def test_set_up_on_another_system_says_what_to_type_instead(tmp_path):
    for system in ("Darwin", "MINGW64_NT-10.0-22631"):
        path = on(tmp_path, uname={"-s": system, "-m": "arm64"})
        done = set_up(tmp_path / system, PATH=path)
        assert done.returncode == 1
        assert done.stderr.startswith(f"Set-up is for Linux; this is {system}. ")
        assert "\n  .venv/bin/pip install '.[formats,pdf,picture]'" in done.stderr
        assert "docs/systems.md" in done.stderr
        assert not (tmp_path / system / ".venv").exists()
    assert (REPOSITORY / "docs" / "systems.md").exists()


def test_what_comes_before_that_runs_in_the_bash_of_macos():
    first, _, rest = (TOOLS / "setup.sh").read_text().partition("\nreadonly name=")
    assert rest
    for newer in ("declare -A", "declare -rA", "mapfile", "readarray", "EPOCHREALTIME", "${x,,}"):
        assert newer not in first


def test_set_up_on_a_machine_without_wheels_says_so(tmp_path):
    done = set_up(tmp_path / "a", PATH=on(tmp_path, uname={**LINUX, "-m": "riscv64"}))
    assert done.returncode != 0
    assert "Open3D and Numba for x86-64 and aarch64; this machine is riscv64." in done.stderr
    old = on(tmp_path, uname=LINUX, getconf={"GNU_LIBC_VERSION": "glibc 2.31"})
    done = set_up(tmp_path / "b", PATH=old)
    assert done.returncode == 1
    assert "for glibc 2.35 or newer" in done.stderr
    assert "the glibc of this machine is 2.31." in done.stderr


def on_aarch64(tmp_path, *, libraries):
    """Return the settings of a machine on which all that set-up starts is a stub that succeeds."""
    python = tmp_path / "python3.12"
    python.write_text(
        f"""#!/bin/sh
case "$*" in
  *"-m pip --version") [ "$0" != {python} ] ;;
  "-m venv "*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
  *rclpy*) echo "there is no ROS here" >&2; exit 1 ;;
  -SEc*) printf '3.12.4\\t%s\\t\\n' "$0" ;;
esac
"""
    )
    python.chmod(0o755)
    path = on(
        tmp_path,
        **{"uname": {"-s": "Linux", "-m": "aarch64"}, "apt-get": {}, "sudo": {}, "cc": {}},
        **{"c++": {}, "getconf": {"GNU_LIBC_VERSION": "glibc 2.39"}},
        ldconfig={"-p": " ".join(f"{name} (libc6)" for name in libraries)},
    )
    return {"PATH": path, "PYTHON": str(python)}


ON_AARCH64 = (
    *("libGL.so.1", "libEGL.so.1", "libX11.so.6", "libidn2.so.0", "libgomp.so.1"),
    "libgfortran.so.5",
)


def test_set_up_where_ros_has_no_wheels_leaves_it_out_and_says_so(tmp_path):
    done = set_up(tmp_path / "here", **on_aarch64(tmp_path, libraries=ON_AARCH64))
    assert done.returncode == 0, done.stderr
    assert "ROS interfaces" not in done.stderr
    assert done.stderr.endswith(
        "\nWithout ROS, of which there are no wheels for aarch64: everything but the nodes works.\n"
        "For the nodes, build this in a sourced ROS 2 Jazzy; see CONTRIBUTING.md.\n"
    )


def test_set_up_asks_for_the_libraries_of_this_machines_wheels(tmp_path):
    done = set_up(tmp_path / "here", **on_aarch64(tmp_path, libraries=ON_AARCH64[:-1]))
    assert done.returncode == 1
    assert "apt-get installs libgfortran5" in done.stderr
    assert done.stderr.endswith("apt-get succeeded, and yet these are missing:\nlibgfortran5\n")


def test_set_up_stops_at_a_python_that_does_not_work_and_says_why(tmp_path):
    chosen = shim(tmp_path / "python3.12")
    done = set_up(tmp_path, PYTHON=str(chosen))
    assert done.returncode == 1
    assert (
        f"PYTHON={chosen}: it does not run: pyenv: python3.12: command not found.\n" in done.stderr
    )
    assert "make setup PYTHON=/path/to/python3.12" in done.stderr
    assert "++" not in done.stderr  # as the shell traces commands


def test_a_failed_stage_shows_its_cause_and_keeps_to_the_folder_that_was_named(tmp_path):
    broken = tmp_path / "broken"
    broken.write_text(
        f"""#!/bin/sh
[ "$1" = -m ] || exec printf '3.12.4\\t{broken}\\t\\n'
echo 'error: no space is left' >&2
for line in $(seq 40); do echo "line $line"; done
exit 1
"""
    )
    broken.chmod(0o755)
    done = set_up(tmp_path, PYTHON=str(broken), VENV=".venv-2")
    assert done.returncode == 1
    assert f"\nPython 3.12.4 ({broken})\nvirtual environment" in done.stderr
    assert "failed\n\n  error: no space is left\n\nSet-up stopped at: virtual env" in done.stderr
    assert "line 40" in (tmp_path / ".venv-2" / ".setup" / "setup.log").read_text()
    assert not (tmp_path / ".venv").exists()


# --- that it is alive ------------------------------------------------------------------------

LOG = """\
== ROS interfaces
+ cmake --build x
[6/80] Building C object a.c.o
\t[7/80] Building C object b.c.o
++ seq 3
"""


@contextmanager
def alive(state, **settings):
    """Run what shows that a stage is at work, in a pipe or on a terminal of 80 columns."""
    ours, theirs = os.pipe() if settings.pop("piped") else pty.openpty()
    if os.isatty(theirs):
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    process = subprocess.Popen(
        [str(TOOLS / "alive.sh"), "ROS interfaces, kernels", str(state), str(state / "stamp")],
        cwd=state,
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        env={**os.environ, "TERM": "xterm", "SECOND": "0.02", **settings},
    )
    os.close(theirs)
    try:
        yield ours
    finally:
        process.terminate()
        process.wait()
        os.close(ours)


def read_until(file, text):
    """Return what came until a text did; pytest's own limit of time ends the wait."""
    shown = ""
    while text not in shown:
        part = os.read(file, 65536)
        assert part, shown
        shown += part.decode()
    return shown


@pytest.fixture
def state(tmp_path):
    (tmp_path / "stamp").write_text("unfinished")
    (tmp_path / "setup.log").write_text(LOG)
    return tmp_path


def test_a_terminal_shows_what_a_stage_does_and_for_how_long(state):
    with alive(state, piped=False) as terminal:
        for done in ("[7/80] Building C object b.c.o", "[8/80] Building C", "compiled"):
            shown = read_until(terminal, done)
            *_, line = shown.split("\r\033[K")
            assert re.match(r"ROS interfaces, kernels {11}\d+ s +", line)
            assert len(line) <= 80 - 4
            assert "+" not in line
            with (state / "setup.log").open("a") as log:
                if "[7" in done:
                    log.write(f"[8/80] Building C object {'long/' * 40}c.c.o\n")
                else:
                    log.write("compiling kernels\n")
            (state / "focus_planner").mkdir(exist_ok=True)
            (state / "focus_planner" / "kernel.nbi").touch()
        assert "1 kernel compiled" in shown
    assert not (state / "told").exists()


def test_what_an_earlier_stage_wrote_is_not_shown(state):
    with (state / "setup.log").open("a") as log:
        log.write("== kernels\n+ python -m focus_planner warm-up\n")
    with alive(state, piped=True, EVERY="1") as pipe:
        shown = read_until(pipe, " s  ")
    assert re.fullmatch(r"\n(  \d+ s +\n?)+", shown)


def test_elsewhere_it_is_a_line_now_and_then(state):
    with alive(state, piped=True, EVERY="2") as pipe:
        shown = read_until(pipe, "b.c.o\n") + read_until(pipe, "b.c.o\n")
    first, *lines = shown.splitlines()
    assert first == ""
    for line in lines:
        assert re.fullmatch(r"  \d+ s +\[7/80\] Building C object b\.c\.o", line)
    assert (state / "told").exists()


def test_set_up_shows_that_it_is_alive(tmp_path):
    waiting = tmp_path / "waiting"
    waiting.write_text(
        f"""#!/bin/sh
[ "$1" = -m ] || exec printf '3.12.4\\t{waiting}\\t\\n'
echo 'unpacking'
until [ -e .venv/.setup/told ]; do sleep 0.05; done
exit 1
"""
    )
    waiting.chmod(0o755)
    done = set_up(tmp_path, PYTHON=str(waiting), SECOND="0.02", EVERY="2")
    assert done.returncode == 1
    title = "virtual environment               "
    assert re.search(rf"\n{title}\n(  \d+ s +\w*\n)*  \d+ s +unpacking\n", done.stderr)
    assert f"s    unpacking\n{title}failed\n" in done.stderr
