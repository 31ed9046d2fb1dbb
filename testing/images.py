"""Made-up images: of every model of distortion, binned, and read out in part."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import strategies as st

from focus_planner.core.rig.camera import DISTORTION_COUNTS

# Of lenses: what is calibrated is a few tenths at most, but for tangential terms and prisms.
_LARGE, _SMALL = st.floats(-0.4, 0.4), st.floats(-0.01, 0.01)
_ORDER = "kkppkkkkssss"


@st.composite
def distortions(draw):
    """A model and coefficients of it, of strong lenses."""
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
    """A region of interest and a binning, for as many pixels."""
    left, top = draw(st.integers(0, width - 1)), draw(st.integers(0, height - 1))
    part = draw(st.integers(1, width - left)), draw(st.integers(1, height - top))
    region = draw(st.sampled_from([None, (left, top, *part)]))
    columns, rows = part if region else (width, height)
    binning = draw(st.integers(1, min(columns, 8))), draw(st.integers(1, min(rows, 8)))
    return {"region": region, "binning": binning}


@st.composite
def varied(draw, images):
    """One of the images, with distortion, binning and region."""
    image = draw(images)
    return replace(image, **draw(distortions()), **draw(regions(image.width, image.height)))
