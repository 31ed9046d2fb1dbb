# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from paths: the poses of one moving camera, as a table with titles or a trajectory."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.camera_path import path_rig
from focus_planner.core.rig.frames import Similarity, similarity_from_pose
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.names import as_camera_name
from focus_planner.core.rig.rig import Rig
from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import InputError, check_choice, first_few
from focus_planner.io.camera_frames import CONVENTIONS, frame_from_optical
from focus_planner.io.files import read_text
from focus_planner.io.quoting import word
from focus_planner.io.rig_files.alignment import finite_numbers, to_metres
from focus_planner.io.yaml_values import errors_within

EXPECTED = "a path of camera poses"
_MAX_BYTES = 64 << 20  # 250,000 poses, with all digits
_LAYOUTS = {
    # Numbers per line of a file without titles: where the position and the quaternion begin.
    3: (0, None),
    7: (0, 3),
    8: (1, 4),
}
_NO_TITLES = (
    "lines of x y z qx qy qz qw, with a time before it (TUM) or without, or of x y z with --target;"
    " or a first line of titles"
)
_POSITION = (("x", "x_m", "tx"), ("y", "y_m", "ty"), ("z", "z_m", "tz"))
_QUATERNION = (("qx",), ("qy",), ("qz",), ("qw",))
_TARGET = (("target_x",), ("target_y",), ("target_z",))
_NAME = ("name", "camera")
_TITLES = tuple(title for group in (*_POSITION, *_QUATERNION, *_TARGET, _NAME) for title in group)


@dataclass(frozen=True)
class _Poses:
    """What a file says, in its unit: one row each; where each row is, for errors."""

    where: tuple[str, ...]
    positions: list[list[float]]
    quaternions: list[list[float]] | None = None
    targets: list[list[float]] | None = None
    names: list[str] | None = None


def load_path(
    path: str | PathLike[str],
    *,
    target: Sequence[float] | None = None,
    steps: int = 0,
    closed: bool = False,
    convention: str = "optical",
    scale: float | None = None,
    transform: Similarity | None = None,
    intrinsics: CameraIntrinsics | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Read the path of a moving camera.

    Parameters
    ----------
    path : path
        A table whose first line has titles, after ``#`` or not, separated by commas, semicolons,
        tabs or spaces: ``x``, ``y``, ``z`` (or ``x_m``, …, or ``tx``, …) with ``qx``, ``qy``,
        ``qz``, ``qw`` or ``target_x``, ``target_y``, ``target_z``, and optionally ``name``; others
        are ignored. A plan's CSV is such a table. Or lines without titles: a trajectory as of TUM's
        RGB-D benchmark, ``timestamp tx ty tz qx qy qz qw``, the same without the time, or
        ``x y z``. Lines that begin with ``#`` are comments.
    target : (3,) array, optional
        What the camera looks at, in the rig's frame, metres, in place of orientations or targets
        of the file.
    steps, closed
        As for :func:`~focus_planner.core.rig.camera_path.path_rig`.
    convention : str
        The orientation of the frames that the quaternions turn: ``"optical"`` (z forward, x right,
        y down) or ``"body"`` (x forward, y left, z up).
    scale : float, optional
        Metres per unit of the positions. By default 1, but paths that span more than 100 m are
        rejected.
    transform : Similarity, optional
        From the file's frame, scaled, to the rig's; it may scale too.
    intrinsics, lens, frame_id
        As for :func:`~focus_planner.core.rig.layouts.cylinder_rig`.

    Raises
    ------
    InputError
        If the file cannot be read or is no such table, a quaternion has no unit norm, or as of
        ``path_rig``.
    """
    path = Path(path)
    check_choice("convention", convention, CONVENTIONS)
    poses = _read(path, read_text(path, EXPECTED, _MAX_BYTES))
    turned = poses.quaternions is not None and target is None
    if not turned and target is None and poses.targets is None:
        titles = "titles qx, qy, qz, qw or target_x, target_y, target_z, or --target"
        raise InputError(str(path), f"{EXPECTED}: {titles}", "positions alone")
    upright = [0.0, 0.0, 0.0, 1.0]
    quaternions = poses.quaternions if turned else None
    own = [
        similarity_from_pose(where, position, upright if quaternions is None else quaternions[i])
        for i, (where, position) in enumerate(zip(poses.where, poses.positions, strict=True))
    ]
    rig_from_file = to_metres(f"{path}: positions", own, scale)
    if transform is not None:
        rig_from_file = transform @ rig_from_file
    camera = frame_from_optical(is_body=convention == "body")
    placed = [rig_from_file @ each @ camera for each in own]
    targets = None
    if target is not None:
        targets = np.array(target, dtype=np.float64)
    elif not turned:
        targets = rig_from_file.points(np.array(poses.targets))
    with errors_within(str(path)):
        return path_rig(
            [each.position for each in placed],
            [each.orientation for each in placed] if turned else None,
            targets=targets,
            steps=steps,
            closed=closed,
            names=poses.names,
            intrinsics=intrinsics,
            lens=lens,
            frame_id=frame_id or "world",
        )


def _read(path: Path, text: str) -> _Poses:
    lines = [
        (f"{path}: line {i}", line.strip())
        for i, line in enumerate(text.splitlines(), start=1)
        if line.strip()
    ]
    for i, (_, line) in enumerate(lines):
        titles = _titles(line)
        if titles is not None:
            return _of_titles(path, titles, lines[i:])
        if not line.startswith("#"):
            break
    rows = [(where, _words(line)) for where, line in lines if not line.startswith("#")]
    if not rows:
        raise InputError(str(path), EXPECTED, "none")
    first_where, first = rows[0]
    if len(first) not in _LAYOUTS or not all(map(_is_number, first)):
        got = f"{len(first)} numbers" if all(map(_is_number, first)) else word(" ".join(first))
        raise InputError(first_where, _NO_TITLES, got)
    at, turn = _LAYOUTS[len(first)]
    values = [_numbers(where, words, len(first)) for where, words in rows]
    return _Poses(
        where=tuple(where for where, _ in rows),
        positions=[row[at : at + 3] for row in values],
        quaternions=None if turn is None else [row[turn : turn + 4] for row in values],
    )


def _of_titles(path: Path, titles: list[str], lines: list[tuple[str, str]]) -> _Poses:
    """Return the poses of a table, of which the first line has the titles."""
    where, first = lines[0]
    columns = {title: i for i, title in reversed(list(enumerate(titles)))}  # the first of a name

    def found(*groups: Sequence[str]) -> list[int] | None:
        at = [next((columns[t] for t in group if t in columns), None) for group in groups]
        missing = [group[0] for group, i in zip(groups, at, strict=True) if i is None]
        if missing and len(missing) < len(groups):
            near = [title for title in titles if title not in _TITLES]
            remedy = did_you_mean(near[0], _TITLES) if near else ""
            raise InputError(where, f"the title {missing[0]} as well", first_few(titles), remedy)
        return None if missing else [i for i in at if i is not None]

    position, turn, aim = found(*_POSITION), found(*_QUATERNION), found(*_TARGET)
    assert position is not None
    named = found(_NAME)
    rows = list(_rows(first, lines[1:]))
    if not rows:
        raise InputError(str(path), EXPECTED, "titles alone")
    short = next(((at, row) for at, row in rows if len(row) != len(titles)), None)
    if short is not None:
        raise InputError(short[0], f"{len(titles)} values, as there are titles", f"{len(short[1])}")

    def numbers_of(at: list[int] | None) -> list[list[float]] | None:
        if at is None:
            return None
        return [finite_numbers(place, [row[i] for i in at]) for place, row in rows]

    return _Poses(
        where=tuple(place for place, _ in rows),
        positions=numbers_of(position) or [],
        quaternions=numbers_of(turn),
        targets=numbers_of(aim) if turn is None else None,
        names=None if named is None else [_name(place, row[named[0]]) for place, row in rows],
    )


def _titles(line: str) -> list[str] | None:
    """Return a line's titles in lower case, without units in brackets; None if it has none."""
    words = [
        re.sub(r"\s*[\[(].*", "", each).strip().lower()
        for each in _cells(line.lstrip("# \t"), _separator(line))
    ]
    found = {*words}
    return words if all(found & {*group} for group in _POSITION) else None


def _rows(titles: str, lines: Sequence[tuple[str, str]]) -> Iterator[tuple[str, list[str]]]:
    separator = _separator(titles)
    for where, line in lines:
        if not line.startswith("#"):
            yield where, _cells(line, separator)


def _separator(line: str) -> str:
    return next((each for each in ",;\t" if each in line), " ")


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    except csv.Error:  # a cell too long to be one
        return []


def _words(line: str) -> list[str]:
    return [each for each in re.split(r"[\s,;]+", line) if each]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _numbers(where: str, words: list[str], count: int) -> list[float]:
    if len(words) != count:
        raise InputError(where, f"{count} numbers, as on the first line", str(len(words)))
    return finite_numbers(where, words)


def _name(where: str, text: str) -> str:
    name = as_camera_name(text)
    if not name:
        raise InputError(where, "a name with letters or digits", word(text))
    return name
