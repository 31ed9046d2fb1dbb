# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which files of a folder are subjects, and what they are called.

Data sets come in many layouts: a file per subject, a folder per subject, the same subject in
several resolutions or formats, and other files beside them. Files whose paths differ only in their
endings, or in words that tell versions of a scan apart, are versions of one subject.
"""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from focus_planner.io.formats.arrays import holds_mesh

#: Of files that are meshes, or laser scans, whatever they are called.
_MESHES = ("ply", "obj", "stl", "off", "glb", "gltf")
_SCANS = ("pcd", "xyz", "xyzn", "pts", "las", "laz", "e57")
# What else may hold points, but mostly does not: taken where there is nothing better.
_PERHAPS = ("npy", "txt", "asc", "csv")

# Words that tell versions of a scan apart.
_FINE = r"high|highres|hires"
_CHANGED = r"normali[sz]ed|clean|cleaned|fusion|fitted"
_COARSE = r"low|lowres|decimated|simplified"
_PARTIAL = r"partial(?:[\s._-]*\d+)?"
_NEUTRAL = r"res|resolution|textured|watertight"


def _words(*words: str) -> re.Pattern[str]:
    """Return an expression that finds words, each with what separates it from the one before."""
    return re.compile(rf"(?i)(?:^|[\s._-]+)(?:{'|'.join(words)})(?=[\s._-]|$)")


_VERSIONS = _words(_FINE, _CHANGED, _COARSE, _PARTIAL, _NEUTRAL)
# What makes a version worse, the worst first; and better.
_WORSE = _words(_PARTIAL), _words(_COARSE), _words(_CHANGED)
_BETTER = _words(_FINE)


class SubjectFile(NamedTuple):
    """A subject's file.

    Attributes
    ----------
    name : str
        Unique among all that were found.
    path : Path
        Of a surface, or of the folder of a recorded run.
    is_run : bool
    others : tuple of Path
        Other versions of the same subject, which are not taken.
    """

    name: str
    path: Path
    is_run: bool = False
    others: tuple[Path, ...] = ()


def subject_files(data: Path) -> list[SubjectFile]:
    """Return the subjects in a folder and all below it, sorted by name.

    Parameters
    ----------
    data : Path
        A folder, or the file of a single surface or run.
    """
    if not data.is_dir():
        return [SubjectFile(data.stem, data, data.suffix == ".mcap")]
    runs, surfaces = _found(data)
    versions: dict[tuple[str, ...], list[Path]] = defaultdict(list)
    for path in surfaces:
        versions[_subject(path.relative_to(data))].append(path)
    taken = {key: sorted(paths, key=_rank) for key, paths in versions.items()}
    keys = [*taken, *(run.relative_to(data).parts for run in runs)]
    names = _names(data.resolve().name, keys)
    found = [
        SubjectFile(names[key], first, others=(*others,)) for key, (first, *others) in taken.items()
    ]
    found += [SubjectFile(names[run.relative_to(data).parts], run, is_run=True) for run in runs]
    return sorted(found)


def _found(data: Path) -> tuple[list[Path], list[Path]]:
    """Return the folders of runs, and the files of surfaces."""
    runs, meshes, perhaps = list[Path](), list[Path](), list[Path]()
    for folder, names in _walk(data):
        if any(name.endswith(".mcap") for name in names):
            runs.append(folder)
            continue
        for name in names:
            path, kind = folder / name, Path(name).suffix.lower().removeprefix(".")
            if kind in (*_MESHES, *_SCANS) or (kind == "npz" and holds_mesh(path)):
                meshes.append(path)
            elif kind in _PERHAPS:
                perhaps.append(path)
    return runs, meshes or ([] if runs else perhaps)


def _walk(data: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield every folder with its files, in a fixed order, without hidden ones."""
    for folder, below, names in os.walk(data):
        below[:] = sorted(name for name in below if not _is_hidden(name))
        yield Path(folder), sorted(name for name in names if not _is_hidden(name))


def _is_hidden(name: str) -> bool:
    return name.startswith((".", "__MACOSX"))


# --- versions ----------------------------------------------------------------------------------


def _subject(path: Path) -> tuple[str, ...]:
    """Return what the paths of all versions of a subject have in common."""
    whole = path.with_suffix("").parts
    parts = [_VERSIONS.sub("", part).lstrip(" ._-") for part in whole]
    return tuple(part for part in parts if part) or whole


def _rank(path: Path) -> tuple[int, int, int, bool, int, str]:
    """Return what sorts versions: whole before partial, fine before coarse, as scanned before else.

    Of formats, meshes come before clouds, in the order in which they are listed.
    """
    text = " ".join(path.with_suffix("").parts)
    partial, coarse, changed = (len(words.findall(text)) for words in _WORSE)
    kinds = (*_MESHES, "npz", *_SCANS, *_PERHAPS)
    kind = kinds.index(path.suffix.lower().removeprefix("."))
    return partial, coarse, changed, not _BETTER.search(text), kind, str(path)


# --- names -------------------------------------------------------------------------------------


def _names(folder: str, keys: Iterable[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """Return a short name for each path: without what all have in common, or say twice."""
    keys = list(keys)
    short = {key: _without_repetition(key) for key in keys}
    if len({*short.values()}) < len(keys):
        short = {key: key for key in keys}
    parts = list(short.values())
    head = _common(parts)
    tail = _common([key[head:][::-1] for key in parts])
    cut = {key: part[head : len(part) - tail] for key, part in short.items()}
    if len(keys) == 1:
        return {keys[0]: short[keys[0]][-1] if short[keys[0]] else folder}
    return {key: "/".join(part) for key, part in cut.items()}


def _without_repetition(key: tuple[str, ...]) -> tuple[str, ...]:
    """Return a path without a file's name that only repeats its folder's."""
    return key[:-1] if len(key) > 1 and key[-1].startswith(key[-2]) else key


def _common(paths: Sequence[tuple[str, ...]]) -> int:
    """Return how many parts all paths begin with, of which each keeps at least one."""
    most = min(len(path) for path in paths) - 1 if paths else 0
    return next((n for n in range(most) if len({path[n] for path in paths}) > 1), max(most, 0))
