# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner masks``: which pixels of every picture show the subject in focus."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.compiling import compile_first
from focus_planner.cli.option_rules import check_beside
from focus_planner.cli.progress import Tell, show_share, shown
from focus_planner.cli.subjects import add_subject_options, load_subject
from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.planning.subject import PlannedSubject
    from focus_planner.masks.making import MaskedPicture
    from focus_planner.masks.programs import PictureName

_PROGRAMS = ("colmap", "nerfstudio", "metashape", "none")
_TRANSFORMS = "transforms.json"
_MAPS = "tiff"
# Of the surface, to estimate what is sharp in another picture on.
_SAMPLES = 20_000
_DESCRIPTION = """\
Write a mask for every picture that a plan asks for: white where the subject is in focus, black
where it is blurred and beside it. About half of what a planned camera sees is blurred in its own
picture and sharp in another: what is made of the pictures is the better for knowing which.

In DIR, masks go to masks/, maps to depth/ and blur/. See docs/masks.md for how COLMAP, nerfstudio
and Metashape take them.
"""


def add(commands: Any) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "masks",
        help="write masks of what is in focus in every picture, and maps of depth and blur",
        description=_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command=run)
    add_subject_options(parser)
    option = parser.add_argument
    option(*("-o", "--output"), type=Path, required=True, metavar="DIR", help="folder to write to")
    option(
        "--for",
        dest="program",
        choices=_PROGRAMS,
        default="none",
        help="the program that takes the masks, which decides what they are called (default:"
        " %(default)s)",
    )
    option(
        "--images",
        metavar="TEMPLATE",
        help="what the pictures' files are called, with {camera} and {shot}, which counts from 1"
        " (default: {camera}.jpg, or {camera}_{shot}.jpg if cameras take several)",
    )
    option(
        "--max-blur",
        type=_blur,
        metavar="PIXELS",
        help="also leave out what is blurred by more than this (default: the plan's depth of field"
        " alone decides)",
    )
    option("--depth", action="store_true", help="also write maps of depth, metres")
    option("--blur", action="store_true", help="also write maps of blur, pixels")
    option(
        "--maps",
        choices=("tiff", "exr"),
        help="with --depth or --blur: how to write these maps, 32-bit floating point in either"
        f" (default: {_MAPS})",
    )
    option("--quiet", action="store_true", help="show no progress")


def _blur(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number of pixels above 0, got {text!r}")
    return value


def run(options: argparse.Namespace) -> int:
    """Write what the options ask for; print how much is in focus."""
    check_beside(options, "--maps", "--depth", "--blur")
    options.maps = options.maps or _MAPS
    with shown(options.quiet) as tell:
        _check_output(options)
        subject = load_subject(options, tell, must_choose=True).subject
        from focus_planner.core.planning.work import DEPTHS, PLANNING
        from focus_planner.masks.programs import PROGRAMS, mask_places, picture_names

        names = picture_names(subject.plan, options.images)
        places = mask_places(names, PROGRAMS[options.program], options.images)
        transforms = None
        if options.program == "nerfstudio":
            transforms = _transforms(options.output, subject, names, places)
        compile_first(tell, (PLANNING, DEPTHS))
        pictures = _written(options, subject, names, places, tell)
        if transforms is not None:
            _write_text(options.output / _TRANSFORMS, json.dumps(transforms, indent=2) + "\n")
        tell("comparing pictures with one another")
        from focus_planner.masks.making import sharp_elsewhere

        elsewhere = sharp_elsewhere(subject, _SAMPLES, options.max_blur)
    for line in _summary(options, pictures, elsewhere):
        print(line)
    return 0


def _check_output(options: argparse.Namespace) -> None:
    """Raise if what is asked for cannot be written; called before the work."""
    from focus_planner.io.files import check_folder_writable
    from focus_planner.masks.maps import check_writer

    if options.depth or options.blur:
        check_writer(options.maps)
    check_folder_writable(options.output)


def _written(
    options: argparse.Namespace,
    subject: PlannedSubject,
    names: Sequence[PictureName],
    places: Sequence[Any],
    tell: Tell,
) -> list[tuple[int, int]]:
    """Write masks and maps; return how many pixels of each show the subject, and in focus."""
    from focus_planner.masks.making import masked_pictures
    from focus_planner.masks.maps import write_mask

    found = list[tuple[int, int]]()
    show = show_share(tell, f"masking {len(names)} pictures")
    pictures = masked_pictures(
        subject,
        names,
        max_blur=options.max_blur,
        with_blur=options.blur,
        on_progress=lambda done: show(done / len(names)),
    )
    for picture, place in zip(pictures, places, strict=True):
        write_mask(_made(options.output / "masks" / place), picture.mask)
        _write_maps(options, picture)
        found.append((picture.subject_pixels, picture.sharp_pixels))
    return found


def _write_maps(options: argparse.Namespace, picture: MaskedPicture) -> None:
    from focus_planner.masks.maps import WRITERS

    write = WRITERS[options.maps]
    place = picture.name.image.with_suffix(f".{options.maps}")
    if options.depth:
        write(_made(options.output / "depth" / place), picture.depths, "Z")
    if options.blur:
        assert picture.blur is not None
        write(_made(options.output / "blur" / place), picture.blur, "Y")


def _made(path: Path) -> Path:
    """Return the path, once its folder is there."""
    from focus_planner.io.files import made_folder

    return made_folder(path.parent) / path.name


def _write_text(path: Path, text: str) -> None:
    from focus_planner.io.files import atomic_write

    with atomic_write(path) as file:
        file.write(text.encode())


# --- nerfstudio --------------------------------------------------------------------------------


def _transforms(
    folder: Path,
    subject: PlannedSubject,
    names: Sequence[PictureName],
    places: Sequence[Any],
) -> dict[str, Any] | None:
    """Return what the folder's transforms.json is to hold: its frames, or else the rig's."""
    from focus_planner.io.files import is_there, read_text
    from focus_planner.io.rig_files.nerfstudio import frames_of_rig, nerfstudio_frames, with_masks

    masks = [f"masks/{place}" for place in places]
    file = folder / _TRANSFORMS
    if is_there(file):
        data = nerfstudio_frames(read_text(file, "nerfstudio's cameras"))
        if data is None:
            raise InputError(
                str(file), "nerfstudio's cameras, with frames", "something else", "move it away"
            )
        by_name = {name.image.stem: mask for name, mask in zip(names, masks, strict=True)}
        return with_masks(str(file), data, by_name)
    cameras = [subject.rig.cameras[name.camera] for name in names]
    try:
        return frames_of_rig(cameras, [f"images/{name.image}" for name in names], masks)
    except InputError as error:
        show_note(f"no {_TRANSFORMS} is written: {error}")
        return None


# --- summary -----------------------------------------------------------------------------------


def _summary(
    options: argparse.Namespace, pictures: Sequence[tuple[int, int]], elsewhere: float | None
) -> list[str]:
    from statistics import median

    from focus_planner.masks.programs import PROGRAMS

    lines = [f"masks: {len(pictures)} in {options.output / 'masks'}"]
    if options.program != "none":
        lines[0] += f", called as {PROGRAMS[options.program].title} takes them"
    kinds = [kind for kind in ("depth", "blur") if getattr(options, kind)]
    lines += [f"maps of {kind}: {len(pictures)} in {options.output / kind}" for kind in kinds]
    shares = [sharp / seen for seen, sharp in pictures if seen]
    if not shares:
        return [*lines, "in focus: no picture shows the subject"]
    seen, sharp = (sum(column) for column in zip(*pictures, strict=True))
    text = f"in focus: {sharp / seen:.1%} of the pixels that show the subject"
    if len(shares) > 1:
        text += f"; by picture {min(shares):.1%} to {max(shares):.1%}, median {median(shares):.1%}"
    lines.append(text)
    if elsewhere is not None:
        lines.append(f"of the blurred pixels, sharp in another picture: {elsewhere:.1%}")
    black = {
        "without the subject": sum(not seen for seen, _ in pictures),
        "with nothing of it in focus": sum(seen > 0 and not sharp for seen, sharp in pictures),
    }
    if any(black.values()):
        told = ", ".join(f"{count} {which}" for which, count in black.items() if count)
        lines.append(f"masks that are all black: {told}")
    if options.program == "colmap":
        lines.append(
            f"next: colmap feature_extractor --ImageReader.mask_path {options.output / 'masks'} ..."
        )
    return lines
