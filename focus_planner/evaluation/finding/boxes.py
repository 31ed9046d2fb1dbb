# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading many surfaces for how large they are, and whether they can be read at all.

That takes a second for some hundred thousand triangles as text, and much more than planning where
there are hundreds of such: several processes share it. They import little.
"""

from __future__ import annotations

import signal
from collections.abc import Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import Mesh, Surface
from focus_planner.core.validation import InputError
from focus_planner.io.surfaces import load_surface

# Bytes of files; reading fewer is over before processes are up.
_WORTH_IT = 200_000_000


def points_of(surface: Surface) -> FloatArray:
    """Return (N, 3) the vertices of a mesh, or the points of a cloud."""
    return surface.vertices if isinstance(surface, Mesh) else surface.points


def read_boxes(
    paths: Sequence[Path], processes: int = 1, worth_it: int = _WORTH_IT
) -> Generator[FloatArray | str, None, None]:
    """Yield of every file the box of its surface, or why it cannot be read.

    Parameters
    ----------
    paths : sequence of Path
    processes : int
        That share the work where there is much.
    worth_it : int
        From how many bytes of files on.

    Yields
    ------
    (2, 3) array or str
        The least and the greatest coordinates, in units of the file.
    """
    if processes == 1 or sum(map(_size, paths)) < worth_it:
        yield from map(_read_box, paths)
        return
    with ProcessPoolExecutor(processes, get_context("spawn"), _leave_ctrl_c) as pool:
        try:
            yield from pool.map(_read_box, paths)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _read_box(path: Path) -> FloatArray | str:
    try:
        points = points_of(load_surface(path, looks=False))
    except InputError as error:
        return str(error).removeprefix(f"{path}: ")
    return np.array([points.min(axis=0), points.max(axis=0)])


def _leave_ctrl_c() -> None:
    """Leave Ctrl-C, which a terminal sends to all, to the process that waits."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _size(path: Path) -> int:
    with suppress(OSError):
        return path.stat().st_size
    return 0
