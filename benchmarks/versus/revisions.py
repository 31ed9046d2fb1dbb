# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""An earlier revision in a folder of its own, and the Python that it works with."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from benchmarks.versus.process import EndedError, LackingError, Process
from focus_planner.core.validation import InputError

ROOT = Path(__file__).parents[2]
#: Where revisions are kept, by commit, with their kernels; ``make clean`` removes it.
FOLDER = ROOT / "build" / "versus"


@dataclass(frozen=True)
class Revision:
    """Sources, and the Python to run them with.

    Attributes
    ----------
    name : str
    root : Path
    python : Path
    environment : str
        Where it runs, as the end of a sentence.
    """

    name: str
    root: Path
    python: Path = Path(sys.executable)
    environment: str = "in this environment"


def today() -> Revision:
    """Return this working tree, changes that are not committed included."""
    return Revision("today", ROOT)


def earlier(revision: str, surface: Path, tell: Callable[[str], object]) -> Revision:
    """Return a revision of this repository, ready to run.

    It gets today's environment if it plans in that; otherwise one of its own, from its own lock,
    with the first Python found with which it does.

    Parameters
    ----------
    revision : str
        As git knows it.
    surface : Path
        What to plan for.
    tell : callable
        Told what takes long.

    Raises
    ------
    InputError
        If there is no such revision, or it works with no Python found here.
    """
    commit = commit_of(revision)
    folder = FOLDER / commit[:12]
    source = _unpacked(commit, folder / "source")
    name = revision if commit.startswith(revision) else f"{revision} ({commit[:7]})"
    kept = folder / "python"
    if kept.exists():
        environment, _, python = kept.read_text().partition("\n")
        return Revision(name, source, Path(python), environment)
    failures: list[str] = []
    for ready in _candidates(name, source, tell, failures):
        tell(f"{name}: compiling its kernels {ready.environment}, once")
        failure = _failure(ready, surface)
        if failure is None:
            kept.write_text(f"{ready.environment}\n{ready.python}")
            return ready
        failures.append(f"{ready.environment}: {failure}")
        tell(f"{name} cannot plan {failures[-1]}")
    tried = "; ".join(failures)
    raise InputError("REV", "a revision that can plan here", revision, f"it cannot {tried}")


def commit_of(revision: str) -> str:
    """Return the commit of a revision, 40 digits.

    Raises
    ------
    InputError
        If there is none, or no repository, or no git.
    """
    if not revision:
        raise InputError("REV", "a revision to compare with", "none", "add REV=3ec12f4, say")
    try:
        _git("rev-parse", "--git-dir")
    except FileNotFoundError:
        remedy = "install git, which has earlier revisions"
        raise InputError("git", "a program", "none of that name", remedy) from None
    except subprocess.CalledProcessError:
        remedy = "clone it with git, which has earlier revisions"
        raise InputError("REV", "a git repository", str(ROOT), remedy) from None
    try:
        arguments = "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}"
        return _git("rev-parse", *arguments).decode().strip()
    except subprocess.CalledProcessError:
        remedy = "git log lists them; git fetch --unshallow --tags gets those that a clone lacks"
        raise InputError("REV", "a revision of this repository", revision, remedy) from None


def _git(*arguments: str) -> bytes:
    command = ["git", "-C", str(ROOT), *arguments]
    return subprocess.run(command, capture_output=True, check=True).stdout  # noqa: S603


def _unpacked(commit: str, folder: Path) -> Path:
    """Return a folder with a commit's files: whole, or not there."""
    if not folder.exists():
        partial = folder.with_name("partial")
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        unpack = ["tar", "--extract", "--directory", str(partial)]
        subprocess.run(unpack, input=_git("archive", commit), check=True)  # noqa: S603
        partial.rename(folder)
    return folder


def _candidates(
    name: str, source: Path, tell: Callable[[str], object], failures: list[str]
) -> Iterator[Revision]:
    """Yield the revision in today's environment, then, given why it fails, in those of its own."""
    yield Revision(name, source)
    # The same Python helps if only a package is missing.
    lacking = any("No module named" in failure for failure in failures)
    for version, program in _pythons()[0 if lacking else 1 :]:
        place = source.parent / f"environment-{version}"
        if not (place / "whole").exists():
            tell(f"{name}: installing what its lock says, Python {version}, once")
            _install(program, place, source / "requirements.lock")
            (place / "whole").touch()
        environment = f"in an environment of its own, Python {version}"
        yield Revision(name, source, place / "bin" / "python", environment)


def _pythons() -> list[tuple[str, str]]:
    """Return the versions and programs of Pythons: this one, older ones, newer ones."""
    find = [ROOT / "tools" / "find_python.sh", "--all"]
    found = subprocess.run(find, capture_output=True, text=True, check=True).stdout  # noqa: S603
    here = sys.version_info[:2]
    pythons = {here: sys.executable}
    for line in found.splitlines():
        version, program, lacks = line.split("\t")
        if not lacks:
            major, minor = map(int, version.split(".")[:2])
            pythons.setdefault((major, minor), program)
    order = sorted(pythons, key=lambda version: (version > here, abs(version[1] - here[1])))
    return [(f"{major}.{minor}", pythons[major, minor]) for major, minor in order]


def _install(program: str, place: Path, lock: Path) -> None:
    """Make an environment of what a lock says."""
    options = "--no-deps", "--require-hashes", "--disable-pip-version-check", "--quiet"
    for command in (
        [program, "-m", "venv", "--clear", place],
        [place / "bin" / "python", "-m", "pip", "install", *options, "-r", lock],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
        if done.returncode:
            lines = (done.stderr or done.stdout).strip().splitlines() or ["it says nothing"]
            raise InputError("REV", "dependencies that can be installed", str(lock), lines[-1])


def _failure(revision: Revision, surface: Path) -> str | None:
    """Return why a revision cannot plan; None if it can. What it compiles is kept."""
    try:
        with closing(Process(revision.python, revision.root, surface)) as process:
            process.run("plan", 1000, 1)
    except (EndedError, LackingError) as error:
        return str(error)
    return None
