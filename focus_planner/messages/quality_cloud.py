# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The quality of a plan at points of the surface, as a cloud to look at."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.planning.sampled_quality import SampledQuality
from focus_planner.messages.reading import Datatype
from focus_planner.messages.writing import Fields, Stamp, header_fields
from focus_planner.palette import BLURRED, SHARP, UNSEEN, Colour


class _Field(NamedTuple):
    name: str
    offset: int
    datatype: Datatype
    kind: str


_FIELDS = (
    _Field("x", 0, Datatype.FLOAT32, "<f4"),
    _Field("y", 4, Datatype.FLOAT32, "<f4"),
    _Field("z", 8, Datatype.FLOAT32, "<f4"),
    _Field("cost", 12, Datatype.FLOAT32, "<f4"),
    _Field("rgb", 16, Datatype.FLOAT32, "<u4"),  # four bytes, by a convention of PCL
    _Field("camera", 20, Datatype.INT32, "<i4"),
    _Field("views", 24, Datatype.UINT32, "<u4"),
    _Field("in_focus", 28, Datatype.UINT8, "u1"),
)
_POINT = np.dtype(
    {
        "names": [field.name for field in _FIELDS],
        "formats": [field.kind for field in _FIELDS],
        "offsets": [field.offset for field in _FIELDS],
        "itemsize": 32,
    }
)


def quality_cloud_to_fields(quality: SampledQuality | None, frame_id: str, stamp: Stamp) -> Fields:
    """Return a cloud of the samples: how well the plan images each.

    Its fields beside x, y and z: ``cost``, from 0 to 1; ``camera``, which images the point best, an
    index into the plan's cameras, -1 where none sees it; ``in_focus``, 1 if it is in focus there,
    else 0; ``views``, how many cameras hold it in focus; ``rgb``, blue for what is in focus,
    orange for what is not, and grey for what no camera sees.

    Parameters
    ----------
    quality : SampledQuality or None
        None for a cloud of no points.
    frame_id : str
    stamp : tuple of int
        Seconds and nanoseconds.
    """
    points = np.zeros(0 if quality is None else len(quality.points), _POINT)
    if quality is not None:
        points["x"], points["y"], points["z"] = quality.points.T
        points["cost"], points["camera"] = quality.cost, quality.camera
        points["in_focus"], points["views"] = quality.in_focus, quality.views
        colours = np.array([_packed(each) for each in (SHARP, BLURRED, UNSEEN)], np.uint32)
        seen = quality.picture >= 0
        points["rgb"] = colours[np.where(quality.in_focus, 0, np.where(seen, 1, 2))]
    return {
        "header": header_fields(frame_id, stamp),
        "height": 1,
        "width": len(points),
        "fields": [
            {
                "name": field.name,
                "offset": field.offset,
                "datatype": int(field.datatype),
                "count": 1,
            }
            for field in _FIELDS
        ],
        "is_bigendian": False,
        "point_step": _POINT.itemsize,
        "row_step": _POINT.itemsize * len(points),
        "data": points.tobytes(),
        "is_dense": True,
    }


def _packed(colour: Colour) -> int:
    red, green, blue = colour
    return red << 16 | green << 8 | blue
