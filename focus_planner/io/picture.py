# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pictures of plans: the cost of every point of the surface, and the cameras' focus distances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.rig.geometry import camera_positions
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud, Samples
from focus_planner.core.validation import InputError
from focus_planner.io.endings import DRAWINGS, check_ending, ending_of
from focus_planner.io.files import atomic_write

try:
    from matplotlib import colormaps, rc_context
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
except ImportError as error:
    raise InputError(
        "picture",
        "matplotlib to draw it with",
        str(error),
        "install it: pip install 'focus_planner[picture]'",
    ) from error

_SAMPLES = 150_000
_PIXELS = 440  # along the surface's longer side
_COST = ScalarMappable(Normalize(0.0, 0.75), colormaps["magma_r"])
_UNSEEN = (0.62, 0.68, 0.72)
_LIGHT = np.array([-0.4, 0.4, np.sqrt(0.68)])  # to the right, up, towards the viewer; a unit vector
_MARGIN = 8
# What is left out of files: when they were written.
_DATES = {"svg": "Date", "pdf": "CreationDate"}
_INK, _FAINT = "#1d2129", "#6b7280"

_MARKER_AREA = 12_000  # of all cameras' markers together, square points

# Inches.
_LEFT, _RIGHT, _GAP = 0.7, 1.2, 0.14
_TOP, _TITLE, _BETWEEN, _CAMERAS, _BOTTOM = 1.25, 0.75, 0.5, 1.35, 0.5
_NARROW, _WIDE = 3.4, 6.0  # one plan's width beside others, and alone
_LOWEST = 2.4  # of a flat surface's row: the label of its scale needs so much


@dataclass(frozen=True)
class _View:
    """An orthographic view of the surface.

    Attributes
    ----------
    name : str
    right, towards : (3,) arrays
        Unit vectors to the right of the picture and towards the viewer; z points up.
    """

    name: str
    right: FloatArray
    towards: FloatArray


_VIEWS = (
    _View("front", np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])),
    _View("back", np.array([-1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])),
)


def draw_plans(scene: Scene, rig: Rig, plans: Mapping[str, FocusPlan], path: Path) -> None:
    """Draw plans for one surface and rig side by side.

    Costs are estimated on fresh samples: on the samples that it was optimised for, a plan looks
    better than it is. All plans are compared with the largest of their depth tolerances and
    numbers of views, and with the finest of their limits of resolution. The surface is shown from
    −y, the direction that bodies face, and from +y. A camera with several shots has the colour of
    the shot that images most.

    Parameters
    ----------
    scene : Scene
    rig : Rig
    plans : mapping
        Plans for ``scene`` and ``rig`` by their titles.
    path : Path
        Written atomically, as what its name says (:data:`~focus_planner.io.endings.DRAWINGS`).

    Raises
    ------
    InputError
        If the file cannot be written, or its name says something else.
    """
    check_ending("picture", path, DRAWINGS)
    fresh = _fresh_problem(scene, rig, list(plans.values()))
    layout = _Layout(len(plans), _aspect(fresh.samples))
    metres = _focus_scale([plan.focus_distances for plan in plans.values()])
    for column, (title, plan) in enumerate(plans.items()):
        problem, focus = with_shots(fresh, plan.shots), plan.focus_distances
        costs, best = problem.evaluate(focus)
        above, below = layout.surface(column), layout.cameras(column)
        _draw_surface(above, fresh.samples, costs, best)
        _write_title(above, title, problem, focus)
        _draw_cameras(below, rig, scene.centre, np.asarray(metres.to_rgba(_main_distances(plan))))
        if column == 0:
            _write_heights(below, rig)
    _draw_scales(layout, metres)
    _write_headline(layout.figure, rig, fresh, list(plans.values()))
    _save(layout.figure, path)


def _save(figure: Figure, path: Path) -> None:
    """Write a figure as what the name says; the same figure always gives the same file."""
    kind, how = DRAWINGS[ending_of(path)]
    options = {"pil_kwargs": dict(how)} if how else {"metadata": {_DATES[kind]: None}}
    with rc_context({"svg.hashsalt": "focus_planner"}), atomic_write(path) as file:
        figure.savefig(file, format=kind, **options)


def _fresh_problem(scene: Scene, rig: Rig, plans: list[FocusPlan]) -> Problem:
    """Return a problem of many fresh samples, but not more than a cloud has points.

    Fewer samples are drawn larger, which covers the gaps between a sparse cloud's points.
    """
    points = len(scene.surface.points) if isinstance(scene.surface, PointCloud) else _SAMPLES
    request = PlanRequest(
        fresh_samples=min(points, _SAMPLES),
        views=max(plan.views for plan in plans),
        depth_tolerance=max(plan.depth_tolerance for plan in plans),
        max_mm_per_pixel=min(plan.max_mm_per_pixel for plan in plans),
    )
    return formulate_problem(scene, rig, request, by="area", fresh=True)


class _Layout:
    """The layout of the picture: a column per plan, its surface above its cameras."""

    def __init__(self, columns: int, aspect: float) -> None:
        self._width = _NARROW if columns > 1 else _WIDE
        self._height = max(self._width * aspect, _LOWEST)
        width = _LEFT + columns * (self._width + _GAP) - _GAP + _RIGHT
        self._cameras = _BOTTOM
        self._surface = _BOTTOM + _CAMERAS + _BETWEEN
        height = self._surface + self._height + _TITLE + _TOP
        self.figure = Figure(figsize=(width, height), dpi=100, facecolor="white")
        FigureCanvasAgg(self.figure)

    def surface(self, column: int) -> Axes:
        return self._axes(self._x(column), self._surface, self._width, self._height)

    def cameras(self, column: int) -> Axes:
        return self._axes(self._x(column), self._cameras, self._width, _CAMERAS)

    def cost_scale(self) -> Axes:
        return self._axes(self._right(), self._surface, 0.15, self._height)

    def focus_scale(self) -> Axes:
        return self._axes(self._right(), self._cameras, 0.15, _CAMERAS)

    def _x(self, column: int) -> float:
        return _LEFT + column * (self._width + _GAP)

    def _right(self) -> float:
        return float(self.figure.get_figwidth()) - _RIGHT + 0.25

    def _axes(self, x: float, y: float, width: float, height: float) -> Axes:
        w, h = self.figure.get_size_inches()
        return self.figure.add_axes((x / w, y / h, width / w, height / h))


def _main_distances(plan: FocusPlan) -> FloatArray:
    return np.array([camera.focus_distance for camera in plan.cameras])


def _focus_scale(distances: list[FloatArray]) -> ScalarMappable:
    every = np.concatenate(distances)
    low, high = np.percentile(every[np.isfinite(every)], [2, 98])
    return ScalarMappable(Normalize(float(low), float(high)), colormaps["cividis"])


def _draw_surface(axes: Axes, samples: Samples, costs: FloatArray, best: IntArray) -> None:
    colours = np.asarray(_COST.to_rgba(costs))[:, :3]
    colours[best < 0] = _UNSEEN
    images = [_image(view, samples, colours) for view in _VIEWS]
    axes.imshow(np.concatenate(images, axis=1), interpolation="antialiased")
    axes.set_axis_off()
    for x, view in zip((0.25, 0.75), _VIEWS, strict=True):
        axes.text(x, 0.0, view.name, va="top", transform=axes.transAxes, **_label(10, _FAINT))


def _image_size(samples: Samples) -> tuple[int, int, float]:
    """Return a view's width and height in pixels, and the scale in pixels per metre."""
    extent = (samples.points.max(axis=0) - samples.points.min(axis=0))[[0, 2]]
    scale = _PIXELS / float(extent.max())
    width, height = np.ceil(extent * scale).astype(int) + 2 * _MARGIN
    return int(width), int(height), scale


def _aspect(samples: Samples) -> float:
    """Return the ratio of height to width of all views side by side."""
    width, height, _ = _image_size(samples)
    return height / (len(_VIEWS) * width)


def _image(view: _View, samples: Samples, colours: FloatArray) -> FloatArray:
    """Return (height, width, 3) the surface as seen by the viewer, on white.

    Every sample is drawn as a small square, the nearest last.
    """
    points = samples.points
    low, high = points.min(axis=0), points.max(axis=0)
    width, height, scale = _image_size(samples)
    centred = (points - (low + high) / 2) * scale
    column = np.rint(width / 2 + centred @ view.right).astype(int)
    row = np.rint(height / 2 - centred[:, 2]).astype(int)
    reach = _reach(samples, scale)
    square = np.indices((2 * reach + 1, 2 * reach + 1)).reshape(2, -1) - reach
    shaded = _shade(view, samples.normals, colours)
    image = np.ones((height, width, 3))
    # For repeated indices NumPy keeps the last value: the nearest sample.
    order = np.argsort(points @ view.towards, kind="stable")[:, None]
    image[row[order] + square[0], column[order] + square[1]] = shaded[order]
    return image


def _reach(samples: Samples, scale: float) -> int:
    """Return by how many pixels a sample's square must extend to each side to leave no holes."""
    spacing = np.sqrt(samples.areas.sum() / len(samples)) * scale
    return int(np.clip(np.ceil(spacing), 1, _MARGIN))


def _shade(view: _View, normals: FloatArray, colours: FloatArray) -> FloatArray:
    """Return the colours, a little darker where the surface turns away from the light."""
    axes = np.stack([view.right, [0.0, 0.0, 1.0], view.towards])
    light = np.clip(normals @ axes.T @ _LIGHT, 0.0, 1.0)
    shaded: FloatArray = colours * (0.75 + 0.25 * light)[:, None]
    return shaded


def _write_title(axes: Axes, title: str, fresh: Problem, focus: FloatArray) -> None:
    axes.set_title(title, fontsize=18, weight="bold", color=_INK, pad=30)
    quality = estimate_quality(fresh, focus)
    share = quality.in_focus_area.value / fresh.samples.areas.sum()
    text = f"cost {quality.cost.value:.0f}   ·   {share:.0%} in focus"
    axes.annotate(
        text, (0.5, 1.0), (0, 9), "axes fraction", "offset points", va="bottom", **_label(13, _INK)
    )


def _draw_cameras(axes: Axes, rig: Rig, centre: FloatArray, colours: FloatArray) -> None:
    """Draw the cameras unrolled: by angle around the surface and by height."""
    positions = camera_positions(rig)
    x, y, _ = (positions - centre).T
    angle = np.degrees(np.arctan2(x, -y))  # the front, −y, in the middle
    size = float(np.clip(_MARKER_AREA / len(rig), 2, 150))
    axes.scatter(angle, positions[:, 2], c=colours, s=size, marker="s", linewidths=0)
    axes.set_xlim(-190, 190)
    axes.set_xticks([-90, 0, 90], ["−x", "front (−y)", "+x"])
    axes.set_yticks([])
    axes.margins(y=0.12)
    axes.tick_params(length=0, colors=_FAINT)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _write_heights(axes: Axes, rig: Rig) -> None:
    heights = camera_positions(rig)[:, 2]
    ends = sorted({float(heights.min()), float(heights.max())})
    axes.set_yticks(ends, [f"{z:.1f} m" for z in ends])


def _draw_scales(layout: _Layout, metres: ScalarMappable) -> None:
    cost = layout.figure.colorbar(_COST, cax=layout.cost_scale(), extend="max")
    cost.set_label("cost of a point (0 best, 1 unseen)", color=_INK)
    focus = layout.figure.colorbar(metres, cax=layout.focus_scale(), extend="both")
    focus.set_label("focus distance / m", color=_INK)
    for bar in (cost, focus):
        bar.outline.set_visible(False)
        bar.ax.tick_params(colors=_FAINT)


def _write_headline(figure: Figure, rig: Rig, fresh: Problem, plans: list[FocusPlan]) -> None:
    x, top = _LEFT / figure.get_figwidth(), 1 - 0.16 / figure.get_figheight()
    cameras = f"{len(rig)} cameras" if len(rig) > 1 else "1 camera"
    figure.text(
        x, top, f"{cameras}, {_shots(plans)}", fontsize=20, weight="bold", color=_INK, va="top"
    )
    text = (
        f"The cost of each point in the {_best(fresh.views)}, and the cameras unrolled.\n"
        f"Estimated on {fresh.sample_count:,} points of the surface; no camera sees the grey ones."
        f"\n{_measured(plans)}"
    )
    below = top - 0.42 / figure.get_figheight()
    figure.text(x, below, text, fontsize=10, color=_FAINT, va="top", linespacing=1.4)


def _best(views: int) -> str:
    return f"{views} cameras that image it best" if views > 1 else "camera that images it best"


def _measured(plans: list[FocusPlan]) -> str:
    text = "Focus distances: from the centre of projection"
    told = [plan.sensor_offsets for plan in plans if plan.sensor_offsets]
    if not told:
        return f"{text}."
    least, most = 1000 * min(low for low, _ in told), 1000 * max(high for _, high in told)
    return f"{text}; from the sensor {least:.0f} to {most:.0f} mm more."


def _shots(plans: list[FocusPlan]) -> str:
    told = {f"{plan.pictures} pictures" for plan in plans if plan.images}
    counts = {plan.shots for plan in plans if not plan.images}
    if counts == {1} and not told:
        return "one shot"
    if counts:
        told.add(f"{' or '.join(map(str, sorted(counts)))} shots each")
    return " or ".join(sorted(told))


def _label(size: float, colour: str) -> dict[str, Any]:
    return {"ha": "center", "fontsize": size, "color": colour}
