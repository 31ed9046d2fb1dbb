# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Strategies for camera intrinsics: all distortion models, binning, regions of interest."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import strategies as st

from focus_planner.core.rig.camera import DISTORTION_COUNTS

# Calibrated coefficients are a few tenths at most; those of tangential terms and prisms are less.
_LARGE, _SMALL = st.floats(-0.4, 0.4), st.floats(-0.01, 0.01)
_ORDER = "kkppkkkkssss"


@st.composite
def distortions(draw):
    """A distortion model with coefficients of strong distortion."""
    model = draw(st.sampled_from(["", *DISTORTION_COUNTS]))
    if not model:
        return {}
    count = draw(st.sampled_from(DISTORTION_COUNTS[model]))
    order = "kkkk" if model == "equidistant" else _ORDER
    drawn = [draw(_LARGE if kind == "k" else _SMALL) for kind in order[:count]]
    tilt = [0.0] * (count - len(drawn))
    return {"distortion_model": model, "distortion": (*drawn, *tilt)}


@st.composite
def regions(draw, width, height):
    """A region of interest and a binning for an image of this size."""
    left, top = draw(st.integers(0, width - 1)), draw(st.integers(0, height - 1))
    part = draw(st.integers(1, width - left)), draw(st.integers(1, height - top))
    region = draw(st.sampled_from([None, (left, top, *part)]))
    columns, rows = part if region else (width, height)
    binning = draw(st.integers(1, min(columns, 8))), draw(st.integers(1, min(rows, 8)))
    return {"region": region, "binning": binning}


@st.composite
def varied(draw, pinholes):
    """One of the pinhole intrinsics, with distortion, binning and region."""
    pinhole = draw(pinholes)
    return replace(pinhole, **draw(distortions()), **draw(regions(pinhole.width, pinhole.height)))
