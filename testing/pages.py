# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pages of the documentation, and running the code that is in them.

A comment before a block says how it is run; the reader does not see it::

    <!-- background -->           its programs go on until the page ends: nodes
    <!-- not run: REASON -->      it is checked as far as that goes without running it
    <!-- run first: COMMAND -->   what the reader has already, and the page needs
    <!-- beside: COMMAND -->      what goes on at the reader's meanwhile, until the page ends
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path

import yaml
from rclpy.context import Context
from rclpy.node import Node
from sybil import Document, Region, Sybil
from sybil.evaluators.python import PythonEvaluator
from sybil.parsers.markdown import CodeBlockParser

from testing.forked_commands import ForkedCommands

ROOT = Path(__file__).parents[1]
PAGES = (
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "QUALITY_DECLARATION.md",
    ROOT / "bags/README.md",
    ROOT / "data/README.md",
    ROOT / "data/bodies/README.md",
    ROOT / "examples/README.md",
    ROOT / "focus_planner/bodies/README.md",
    *sorted((ROOT / "docs").glob("*.md")),
)
# What pages name by its path, seen from where the reader is: the root of a clone.
_REACHABLE = ("bags", "config", "docs", "examples", "focus_planner/bodies", "security", "testing")
_NOTE = re.compile(r"^<!-- (background|not run|run first|beside)(?:: (.+?))? -->$", re.MULTILINE)
# The names of the nodes that commands run; of simulated lenses that of any driver node.
_NODES = {"node": "focus_planner", "lens_adapter": "lens_adapter", "simulated_lens": "camera"}
_SECONDS = 240
_SECONDS_TO_END = 240
_EVALUATE = PythonEvaluator()


#: Those whose code is run.
WITH_CODE = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
#: Those of them that start most programs. A test file of their own runs beside the others.
RECIPES = (ROOT / "README.md", ROOT / "docs/your_rig.md")


def name_of(page: Path) -> str:
    """Return a page's name in tests."""
    return str(page.relative_to(ROOT))


def lay_out(folder: Path) -> None:
    """Make what pages refer to reachable from a folder that they may write to."""
    for path in _REACHABLE:
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).symlink_to(ROOT / path)


class Reader:
    """Someone who does what a page says, from its first block to its last, in one folder.

    A context manager: in the end what goes on in the background is ended.

    Parameters
    ----------
    page : Path
    folder : Path
        The current one.
    """

    def __init__(self, page: Path, folder: Path) -> None:
        self._folder = folder
        self._commands = ForkedCommands(folder / ".commands")
        self._at_the_end = ExitStack()
        self._background: list[subprocess.Popen[str]] = []
        self._note: tuple[str, str] = ("", "")
        parsers = (
            _find_notes,
            CodeBlockParser(language="bash", evaluator=self._shell),
            CodeBlockParser(language="python", evaluator=self._python),
        )
        self._document: Document = Sybil(parsers).parse(page)
        self._document.namespace["__name__"] = "__main__"
        for _, region in self._document.regions:
            region.evaluator = region.evaluator or self._take_note

    def __enter__(self):
        # Pages are also looked at where there are no interfaces, which clients need.
        from testing.ros.patient_clients import have_clients_wait  # noqa: PLC0415

        have_clients_wait()
        self._at_the_end.enter_context(self._commands)
        self._at_the_end.callback(self._end_background)
        return self

    def __exit__(self, *_):
        self._at_the_end.close()

    def _end_background(self):
        for process in self._background:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGINT)
        try:
            ended = [process.wait(_SECONDS_TO_END) for process in self._background]
            # One that was interrupted while it started may say so; one that failed ended by itself.
            assert {*ended} <= {0, 130, -signal.SIGINT}, f"ended with {ended}"
        finally:
            for process in self._background:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)

    def read(self) -> int:
        """Do all that the page says; return how many blocks there are."""
        examples = list(self._document.examples())
        for example in examples:
            example.evaluate()
        return len(examples)

    def _take_note(self, example):
        kind, text = example.parsed
        if kind == "run first":
            self._run(text)
        elif kind == "beside":
            self._background.append(self._start(f"exec {text}"))
        else:
            assert kind != "not run" or text, "say why a block is not run"
            self._note = (kind, text)

    def _taken_note(self):
        note, self._note = self._note, ("", "")
        return note[0]

    def _shell(self, example):
        note = self._taken_note()
        if note == "not run":
            _check_commands(example.parsed)
        elif note == "background":
            self._background.append(self._start(example.parsed))
            self._wait_until_up(example.parsed)
        else:
            self._run(example.parsed)

    def _python(self, example):
        if self._taken_note() == "not run":
            compile(example.parsed, example.path, "exec")
        else:
            _EVALUATE(example)

    def _start(self, script, **options):
        python = str(Path(sys.executable).parent)
        path = os.pathsep.join((str(self._commands.folder), python, os.environ["PATH"]))
        return subprocess.Popen(
            ["bash", "-euo", "pipefail", "-c", script],
            cwd=self._folder,
            env={**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)},
            text=True,
            start_new_session=True,
            **options,
        )

    def _wait_until_up(self, script):
        """Wait until another node of the name that a script gives is in the graph."""
        program = re.search(r"^focus_planner (\w+)", script, re.MULTILINE)[1]
        given = re.search(r"__node:=(\w+)", script)
        name = given[1] if given else _NODES[program]
        until = time.monotonic() + _SECONDS
        with Bystander() as bystander:
            while not bystander.sees(name):
                assert self._background[-1].poll() is None, f"it ended: {script}"
                assert time.monotonic() < until, f"{name} never came: {script}"
                time.sleep(0.1)

    def _run(self, script):
        process = self._start(script, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        try:
            output, _ = process.communicate(timeout=_SECONDS)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
        assert process.returncode == 0, f"{script}\nended with {process.returncode}:\n{output}"


class Bystander:
    """A node that looks who else is there."""

    def __init__(self):
        self._context = Context()
        self._context.init(args=[])
        self._node = Node("bystander", context=self._context, use_global_arguments=False)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._node.destroy_node()
        self._context.try_shutdown()

    def sees(self, name):
        return name in self._node.get_node_names()


def _find_notes(document: Document) -> Iterator[Region]:
    for match in _NOTE.finditer(document.text):
        yield Region(match.start(), match.end(), parsed=match.groups())


# --- commands that cannot be run here -----------------------------------------------------------


def _check_commands(script: str) -> None:
    """Check that a script is one, and that what it names of this project exists."""
    subprocess.run(["bash", "-n", "-c", script], check=True)
    for line in script.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] == ["focus_planner"]:
            _check_options(words[1:])
        elif words[:1] == ["make"]:
            assert words[1] in make_targets(), line
        elif words[:1] == ["ros2"]:
            _check_ros2(words[1:])


def _check_options(words: list[str]) -> None:
    command = [word for word in words[:2] if re.fullmatch(r"[a-z_-]+", word)]
    options = [word for word in words if re.fullmatch(r"--[a-z-]+", word)]
    text = _help(" ".join(command[: 2 if command[0] == "rig" else 1]))
    for option in options[: options.index("--ros-args") if "--ros-args" in options else None]:
        assert option in text, f"focus_planner {command} has no {option}"


@cache
def _help(command: str) -> str:
    program = [sys.executable, "-m", "focus_planner", *command.split(), "--help"]
    return subprocess.run(program, check=True, capture_output=True, text=True).stdout


@cache
def make_targets() -> frozenset[str]:
    """Return what the Makefile makes."""
    text = (ROOT / "Makefile").read_text()
    return frozenset(re.findall(r"^([a-z]+):", text, re.MULTILINE))


def _check_ros2(words: list[str]) -> None:
    """Check the files, executables, types and fields that a ros2 command names."""
    setup = (ROOT / "setup.py").read_text()
    for word in words:
        if "/" in word[1:] and not word.startswith("/") and (ROOT / word.split("/")[0]).is_dir():
            assert (ROOT / word).exists(), word
    if words[:2] == ["run", "focus_planner"]:
        assert f'"{words[2]} = ' in setup, words[2]
    if words[:2] == ["launch", "focus_planner"]:
        launch = (ROOT / "launch" / words[2]).read_text()
        assert all(f'<arg name="{w.split(":=")[0]}"' in launch for w in words if ":=" in w), words
    for i, word in enumerate(words[:-1]):
        if re.fullmatch(r"focus_planner_msgs/(srv|msg)/\w+", word):
            assert set(yaml.safe_load(words[i + 1])) <= _fields(word), words[i + 1]


def _fields(interface: str) -> set[str]:
    """Return the names of the fields of a message, or of a service's request."""
    _, kind, name = interface.split("/")
    request = (ROOT / f"msg_defs/{kind}/{name}.{kind}").read_text().split("\n---")[0]
    return {name for _, name in re.findall(r"^([\w/\[\]]+) (\w+)$", request, re.MULTILINE)}
