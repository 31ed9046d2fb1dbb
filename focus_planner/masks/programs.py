# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What the programs that use masks call them, and how a mask's picture is called.

All masks are white where a pixel is to be used and black elsewhere, of 8 bits, as large as their
picture: COLMAP, nerfstudio and Metashape agree on that.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath
from typing import NamedTuple

from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.validation import InputError

_FIELD = re.compile(r"\{([^{}]*)\}")
_OPTION = "--images"


class Program(NamedTuple):
    """A program that masks are for.

    Attributes
    ----------
    title : str
        What people call it.
    mask_of : callable
        From the place of a picture, below the folder of all, to that of its mask, below ``masks``.
    """

    title: str
    mask_of: Callable[[PurePosixPath], PurePosixPath]


def _beside(image: PurePosixPath) -> PurePosixPath:
    return image.with_name(f"{image.name}.png")


def _in_place(image: PurePosixPath) -> PurePosixPath:
    return PurePosixPath(f"{image.stem}.png")


def _marked(image: PurePosixPath) -> PurePosixPath:
    return PurePosixPath(f"{image.stem}_mask.png")


#: By the name to ask for them.
PROGRAMS: Mapping[str, Program] = {
    "colmap": Program("COLMAP", _beside),
    "nerfstudio": Program("nerfstudio", _in_place),
    "metashape": Program("Metashape", _marked),
    "none": Program("no program in particular", _in_place),
}


class PictureName(NamedTuple):
    """A picture of a plan.

    Attributes
    ----------
    camera : int
        Which of the plan's cameras takes it.
    shot : int
        Which of the camera's shots it is, counted from 0.
    image : PurePosixPath
        Its place below the folder of all pictures.
    """

    camera: int
    shot: int
    image: PurePosixPath


def picture_names(plan: FocusPlan, template: str | None = None) -> list[PictureName]:
    """Return a plan's pictures, camera by camera and shot by shot.

    Parameters
    ----------
    plan : FocusPlan
    template : str, optional
        What the pictures' files are called, with ``{camera}`` for the camera's name and ``{shot}``
        for the number of the shot, counted from 1 as on lens sheets. By default
        ``{camera}.jpg``, or ``{camera}_{shot}.jpg`` if each camera takes several.

    Raises
    ------
    InputError
        If the template has another field, tells no file below a folder, or calls two pictures the
        same.
    """
    if template is None:
        template = "{camera}.jpg" if plan.shots == 1 else "{camera}_{shot}.jpg"
    _check_template(template)
    names = [
        PictureName(c, s, PurePosixPath(_filled(template, camera.name, s + 1)))
        for c, camera in enumerate(plan.cameras)
        for s in range(len(camera.shots))
    ]
    _check_distinct([str(name.image) for name in names], "picture", template)
    return names


def mask_places(
    names: list[PictureName], program: Program, template: str | None = None
) -> list[PurePosixPath]:
    """Return the places of the pictures' masks.

    Raises
    ------
    InputError
        If two pictures would have the same mask.
    """
    places = [program.mask_of(name.image) for name in names]
    _check_distinct([str(place) for place in places], "mask", template or "")
    return places


def _filled(template: str, camera: str, shot: int) -> str:
    return _FIELD.sub(lambda match: camera if match[1] == "camera" else str(shot), template)


def _check_template(template: str) -> None:
    expected = "a name of picture files such as {camera}.jpg or {camera}_{shot}.jpg"
    others = [field for field in _FIELD.findall(template) if field not in ("camera", "shot")]
    if others or re.search(r"[{}]", _FIELD.sub("", template)):
        raise InputError(_OPTION, expected, repr(template), "it may have {camera} and {shot}")
    path = PurePosixPath(template)
    if path.is_absolute() or ".." in path.parts or "\\" in template or not template.isprintable():
        raise InputError(_OPTION, expected, repr(template), "give it below the folder of pictures")
    # A number is no ending: without it, several shots would have the same maps.
    if not path.suffix or template.endswith("/") or _FIELD.search(path.suffix):
        raise InputError(_OPTION, expected, repr(template), "end it as the pictures' files end")


def _check_distinct(places: list[str], what: str, template: str) -> None:
    # Elsewhere, names that differ in case alone are usually those of one file.
    files = places if sys.platform == "linux" else [place.casefold() for place in places]
    if len(set(files)) == len(files):
        return
    twice = next(place for i, place in enumerate(places) if files[i] in files[:i])
    raise InputError(
        _OPTION,
        f"another {what} for every camera and shot",
        f"{twice} twice by {template!r}",
        "have {camera}, and with several shots {shot}, in the file's own name",
    )
