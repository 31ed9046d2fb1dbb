# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Making a cloud fit for planning: without strays and noise, and no denser than it has to be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.forks import refuse_forked_threads
from focus_planner.core.notes import Note
from focus_planner.core.surface.cloud_shape import CloudShape, cloud_shape, nearest_neighbours
from focus_planner.core.surface.noise import Scatter, estimate_scatter
from focus_planner.core.surface.smoothing import SmoothCloud, smooth
from focus_planner.core.surface.strays import stray_points
from focus_planner.core.surface.surface import PointCloud

# Of the spacing: with more noise than this, neighbours lie in front of and behind one another. The
# areas that they tell are then 3 % too large, and soon more.
_TOLERABLE_NOISE = 1 / 3
# Normals estimated from points that scatter are wrong before areas are.
_TOLERABLE_NOISE_WITHOUT_NORMALS = 1 / 6
#: A cloud of more points is averaged even if there is no noise.
MAX_POINTS_AS_GIVEN = 1_000_000


@dataclass(frozen=True, eq=False)
class PreparedCloud:
    """A cloud to sample, and what there is to say about it.

    Attributes
    ----------
    cloud : PointCloud
        The one given, or what was made of it.
    shape : CloudShape
    notes : tuple of Note
        If points were averaged because of noise or their number, or strays left out.
    """

    cloud: PointCloud
    shape: CloudShape
    notes: tuple[Note, ...] = ()


def prepare_cloud(
    cloud: PointCloud, on_progress: Callable[[float], object] = lambda _: None
) -> PreparedCloud:
    """Estimate a cloud's shape, after averaging its points if they scatter too far.

    Parameters
    ----------
    cloud : PointCloud
    on_progress : callable, optional
        Called with the share that is done.

    Raises
    ------
    InputError
        If most points coincide, all are strays, or all points with any importance are one of these.
    RuntimeError
        If the process was forked from one in which threads of GNU OpenMP ran already.
    """
    refuse_forked_threads()
    on_progress(0.0)
    scatter = estimate_scatter(cloud.points)
    on_progress(0.1)
    tolerable = _TOLERABLE_NOISE_WITHOUT_NORMALS if cloud.normals is None else _TOLERABLE_NOISE
    noisy = scatter.noise > tolerable * scatter.spacing
    if noisy or (len(cloud.points) > MAX_POINTS_AS_GIVEN and scatter.spacing > 0):
        smoothed = smooth(cloud, scatter, lambda share: on_progress(0.1 + 0.9 * share))
        count = len(cloud.points)
        note = _noise_note(scatter, smoothed) if noisy else _density_note(count, smoothed)
        notes = (note, *_stray_notes(smoothed.strays, count))
        return PreparedCloud(smoothed.cloud, smoothed.shape, notes)
    return _as_given(cloud, on_progress)


def _as_given(cloud: PointCloud, on_progress: Callable[[float], object]) -> PreparedCloud:
    """Return the cloud as it is, but without strays."""
    neighbours = nearest_neighbours(cloud.points)
    on_progress(0.5)
    stray = stray_points(cloud.points, neighbours)
    count = int(stray.sum())
    if not count or len(cloud.points) - count < PointCloud.MIN_POINTS:
        shape = cloud_shape(cloud, neighbours)
        on_progress(1.0)
        return PreparedCloud(cloud, shape)
    kept = _kept(cloud, ~stray)
    shape = cloud_shape(kept)
    on_progress(1.0)
    return PreparedCloud(kept, shape, _stray_notes(count, len(cloud.points)))


def _kept(cloud: PointCloud, which: NDArray[np.bool_]) -> PointCloud:
    return replace(
        cloud,
        points=cloud.points[which],
        normals=None if cloud.normals is None else cloud.normals[which],
        importance=None if cloud.importance is None else cloud.importance[which],
        colours=None if cloud.colours is None else cloud.colours[which],
    )


def _noise_note(scatter: Scatter, smoothed: SmoothCloud) -> Note:
    return Note(
        "noise",
        f"the cloud's points scatter by {_millimetres(scatter.noise)} about the surface, at a"
        f" spacing of {_millimetres(scatter.spacing)}: they were averaged to"
        f" {len(smoothed.cloud.points):,} points {_millimetres(smoothed.shape.spacing)} apart,"
        " and detail near that size is lost; scan with less noise, or give a mesh",
    )


def _density_note(count: int, smoothed: SmoothCloud) -> Note:
    return Note(
        "noise",
        f"the cloud's {count:,} points lie closer than planning needs: they were averaged to"
        f" {len(smoothed.cloud.points):,} points {_millimetres(smoothed.shape.spacing)} apart;"
        f" give at most {MAX_POINTS_AS_GIVEN:,} points to have them used as they are",
    )


def _stray_notes(strays: int, count: int) -> tuple[Note, ...]:
    if not strays:
        return ()
    return (
        Note(
            "noise",
            f"{strays:,} of the cloud's {count:,} points lie apart from any surface: they were left"
            " out; if they belong to the subject, scan it more densely there",
        ),
    )


def _millimetres(metres: float) -> str:
    return f"{1000 * metres:.3g} mm"
