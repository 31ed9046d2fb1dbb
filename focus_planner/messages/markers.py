"""3D markers of a plan: what is in focus, and where the cameras look and focus."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.plan import CameraStatus, SolvedPlan
from focus_planner.core.rig.geometry import image_corners
from focus_planner.core.rig.rig import Rig
from focus_planner.messages.writing import Fields, Stamp, header_fields

_POINT_SIZE = 0.006  # metres
_LINE_WIDTH = 0.001
# Red, green, blue; distinguishable by the colour-blind.
_IN_FOCUS, _BLURRED, _UNSEEN = (0.0, 0.62, 0.45), (0.90, 0.38, 0.0), (0.55, 0.55, 0.58)
_OF_USE, _OF_NO_USE = (0.20, 0.40, 0.75), (0.70, 0.70, 0.72)
# Edges of the pyramid: 0 to 3 are the image's corners, 4 is the camera.
_EDGES = np.array([[4, 0], [4, 1], [4, 2], [4, 3], [0, 1], [1, 2], [2, 3], [3, 0]])


class _Kind(IntEnum):
    """Equal to the constants of ``Marker.msg``."""

    LINE_LIST = 5
    POINTS = 8


def markers_to_fields(plan: SolvedPlan, rig: Rig, stamp: Stamp) -> Fields:
    """Return a marker of the plan's fresh samples, and one for each camera.

    A sample is green if it is in focus in the camera that images it best, orange if it is not, and
    grey if no camera sees it. A camera is a pyramid from its centre of projection to the plane of
    focus; grey if it images no sample best.
    """
    header = header_fields(rig.frame_id, stamp)
    markers = [_surface(plan, header)]
    for k, (camera, focus) in enumerate(zip(rig.cameras, plan.cameras, strict=True)):
        corners = image_corners(camera, focus.focus_distance)
        of_use = focus.status == CameraStatus.PLANNED
        ends = np.vstack([corners, camera.position])[_EDGES].reshape(-1, 3)
        colour = _OF_USE if of_use else _OF_NO_USE
        marker = _marker("cameras", k, _Kind.LINE_LIST, ends, header)
        markers.append(marker | {"scale": {"x": _LINE_WIDTH}, "color": _colour(colour)})
    return {"markers": markers}


def _surface(plan: SolvedPlan, header: Fields) -> Fields:
    problem = plan.fresh_problem
    _, best = problem.evaluate(plan.focus_distances)
    in_focus = problem.in_focus(plan.focus_distances, best)
    kind = np.where(in_focus, 0, np.where(best < 0, 2, 1))
    colours = [_colour(each) for each in (_IN_FOCUS, _BLURRED, _UNSEEN)]
    marker = _marker("surface", 0, _Kind.POINTS, problem.samples.points, header)
    return marker | {
        "scale": {"x": _POINT_SIZE, "y": _POINT_SIZE},
        "colors": [colours[each] for each in kind],
    }


def _marker(name: str, number: int, kind: _Kind, points: FloatArray, header: Fields) -> Fields:
    return {
        "header": header,
        "ns": name,
        "id": number,
        "type": int(kind),
        "pose": {"orientation": {"w": 1.0}},
        "points": [dict(zip("xyz", point, strict=True)) for point in points.tolist()],
    }


def _colour(colour: tuple[float, float, float]) -> Fields:
    return dict(zip("rgba", (*colour, 1.0), strict=True))
