# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Options of every kind of rig: image and lens; and how a rig is printed."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.notes import Note
    from focus_planner.core.rig.camera import CameraIntrinsics
    from focus_planner.core.rig.lens import Lens
    from focus_planner.core.rig.rig import Rig

_IMAGE_OPTIONS = ("image", "fx", "fy", "cx", "cy")

_LENS_OPTIONS: dict[str, dict[str, Any]] = {
    "focal_length": {"help": "focal length, metres (default: 0.05)"},
    "hyperfocal_distance": {
        "help": "focal length² / (f-number · circle of confusion), metres (default: 10)"
    },
    "f_number": {"help": "focal length over aperture diameter; replaces --hyperfocal-distance"},
    "circle_of_confusion": {
        "help": "largest blur spot on the sensor that counts as sharp, metres (default with"
        " --f-number: two pixels if their size is known, else the sensor's diagonal / 1500); beside"
        " --hyperfocal-distance it tells previews and masks the aperture"
    },
    "min_focus": {"help": "nearest distance at which the lens can focus, metres"},
    "max_focus": {"help": "farthest distance at which the lens can focus, metres"},
    "focus_distances": {
        "nargs": "+",
        "help": "the only distances at which the lens can focus, metres",
    },
    "focus_steps": {
        "type": int,
        "metavar": "N",
        "help": "or number of focus positions from --min-focus to --max-focus, equally spaced in"
        " dioptres",
    },
    "hiatus": {
        "help": "how far the rear principal plane is behind the front one, metres; for distances"
        " from the sensor (default: 0, a thin lens)"
    },
}


def add_image_options(parser: Any, default: str = "the paper's") -> None:
    """Add the options of the cameras' image."""
    group = parser.add_argument_group("image", f"Applies to all cameras; the default is {default}.")
    group.add_argument(
        "--camera-info",
        type=Path,
        metavar="FILE",
        help="YAML file as written by camera_calibration, or a folder with NAME.yaml per camera",
    )
    group.add_argument(
        "--image",
        metavar="WxH",
        help="width and height, pixels; with --fx, instead of --camera-info",
    )
    for name, meaning in (
        ("fx", "horizontal focal length, pixels"),
        ("fy", "vertical focal length, pixels (default: --fx)"),
        (
            "cx",
            "horizontal principal point, pixels; the first pixel's centre is 0 (default: middle)",
        ),
        ("cy", "vertical principal point, pixels (default: middle)"),
    ):
        group.add_argument(f"--{name}", type=float, metavar="X", help=meaning)


def has_image(options: argparse.Namespace) -> bool:
    """Return whether the options tell the image."""
    given = (getattr(options, name, None) for name in ("camera_info", *_IMAGE_OPTIONS))
    return any(value is not None for value in given)


def only_size(options: argparse.Namespace) -> tuple[int, int] | None:
    """Return the width and height that the options tell, if they tell nothing else of the image."""
    given = {name for name in _IMAGE_OPTIONS if getattr(options, name) is not None}
    if given != {"image"} or options.camera_info is not None:
        return None
    return _size(options.image)


def intrinsics_of(options: argparse.Namespace) -> Callable[[str], CameraIntrinsics]:
    """Return a function from a camera's name to its intrinsics."""
    from focus_planner.core.rig.camera import CameraIntrinsics
    from focus_planner.io.camera_info import intrinsics_lookup

    by_flags = any(getattr(options, name) is not None for name in _IMAGE_OPTIONS)
    if options.camera_info is not None:
        if by_flags:
            raise InputError("--camera-info", "it, or --image and --fx", "both")
        return intrinsics_lookup(options.camera_info)
    image = _pinhole(options) if by_flags else CameraIntrinsics()
    return lambda _: image


def _pinhole(options: argparse.Namespace) -> CameraIntrinsics:
    from focus_planner.core.rig.camera import CameraIntrinsics

    size, fx, fy, cx, cy = (getattr(options, name) for name in _IMAGE_OPTIONS)
    if size is None or fx is None:
        raise InputError("--image and --fx", "both or neither", "one without the other")
    width, height = _size(size)
    with errors_of_options({"width": "image", "height": "image"} | dict.fromkeys(_IMAGE_OPTIONS)):
        return CameraIntrinsics(
            width,
            height,
            fx,
            fx if fy is None else fy,
            (width - 1) / 2 if cx is None else cx,
            (height - 1) / 2 if cy is None else cy,
        )


def _size(text: str) -> tuple[int, int]:
    from focus_planner.core.rig.camera import MAX_PIXELS
    from focus_planner.core.validation import check_whole

    match = re.fullmatch(r"(\d{1,12})[x×](\d{1,12})", text)
    if match is None:
        raise InputError("--image", "WIDTHxHEIGHT in pixels, such as 1920x1080", repr(text))
    width, height = (
        check_whole("--image", int(digits), 1, MAX_PIXELS) for digits in match.groups()
    )
    return width, height


def add_lens_options(parser: Any) -> None:
    """Add the options of the cameras' lens."""
    lens = parser.add_argument_group("lens")
    for name, settings in _LENS_OPTIONS.items():
        flag = f"--{name.replace('_', '-')}"
        lens.add_argument(flag, **{"type": float, "metavar": "X"} | settings)


def lens_values(options: argparse.Namespace) -> dict[str, Any]:
    """Return what the options say of the lens, by name."""
    given = {name: getattr(options, name) for name in _LENS_OPTIONS}
    return {name: value for name, value in given.items() if value is not None}


def lens_of(options: argparse.Namespace) -> Lens:
    """Return the lens of the options, the paper's where they say nothing.

    A circle of confusion that they do not tell beside an f-number is assumed for the paper's image;
    :func:`print_rig` assumes it anew for every camera's own.
    """
    from focus_planner.io.rigs import lens_from_values

    with errors_of_options(dict.fromkeys(_LENS_OPTIONS)):
        return lens_from_values("lens options", lens_values(options))


@contextmanager
def errors_of_options(names: Mapping[str, str | None]) -> Iterator[None]:
    """Call values in errors by the options that they were given with.

    Parameters
    ----------
    names : mapping of str to str or None
        The options, without their hyphens, by the values' names; None for one of the same name.
    """

    def option(match: re.Match[str]) -> str:
        return f"--{(names[match[1]] or match[1]).replace('_', '-')}"

    word = re.compile(rf"\b(?:lens\.|image\.)?({'|'.join(sorted(names, reverse=True))})\b")
    try:
        yield
    except InputError as error:
        argument, expected, remedy = (
            word.sub(option, text) for text in (error.argument, error.expected, error.remedy)
        )
        raise InputError(argument, expected, error.got, remedy) from None


def print_rig(rig: Rig, options: argparse.Namespace) -> int:
    """Print a rig whose lenses nothing but the options tells, and what nothing tells of it."""
    from dataclasses import replace

    from focus_planner.core.rig.defaults import assumed_values, keys_of

    of_lens = assumed_values(lens_values(options), {}) & keys_of("lens")
    assumed = {
        camera.name: of_lens | rig.assumed.get(camera.name, frozenset()) for camera in rig.cameras
    }
    return print_made(replace(rig, assumed=assumed), options)


def print_made(rig: Rig, options: argparse.Namespace) -> int:
    """Print a rig, and what nothing tells of its lenses and images."""
    from focus_planner.core.rig.defaults import notes_on_defaults
    from focus_planner.io.rigs import rig_to_yaml

    defaults = notes_on_defaults(
        rig.assumed.values(),
        "use --focal-length, and --f-number with --circle-of-confusion, or --hyperfocal-distance,"
        " or edit the rig's file",
        "use --camera-info, or --image with --fx, or edit the rig's file",
    )
    rig, on_circles = _with_own_circles(rig, options)
    for note in (*rig.notes, *defaults, *on_circles):
        show_note(note.text)
    sys.stdout.write(rig_to_yaml(rig))
    return 0


def _with_own_circles(rig: Rig, options: argparse.Namespace) -> tuple[Rig, tuple[Note, ...]]:
    """Assume every camera's circle of confusion if the options tell only its f-number."""
    from dataclasses import replace

    from focus_planner.core.rig.circles import CIRCLE, assumed_circle, note_on_circles
    from focus_planner.core.rig.defaults import FOCAL_LENGTH
    from focus_planner.core.rig.optics import lens_of_aperture

    given = lens_values(options)
    if "f_number" not in given or "circle_of_confusion" in given:
        return rig, ()
    circles, cameras = [], []
    for camera in rig.cameras:
        told = FOCAL_LENGTH not in rig.assumed.get(camera.name, ())
        image, lens = camera.intrinsics, camera.lens
        circles.append(assumed_circle(image, lens.focal_length, focal_length_told=told))
        with errors_of_options(dict.fromkeys(_LENS_OPTIONS)):
            lens = lens_of_aperture(lens, given["f_number"], None, image, focal_length_told=told)
        cameras.append(replace(camera, lens=lens))
    assumed = {
        camera.name: frozenset({CIRCLE, *rig.assumed.get(camera.name, ())})
        for camera in rig.cameras
    }
    remedy = "use --circle-of-confusion, or give circle_of_confusion under lens in the rig's file"
    return (
        replace(rig, cameras=tuple(cameras), assumed=assumed),
        note_on_circles(circles, len(rig), remedy),
    )
