# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What the imports of other programs' cameras share: options, and how a rig becomes of a file."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.progress import shown
from focus_planner.cli.rig_options import (
    add_image_options,
    add_lens_options,
    has_image,
    intrinsics_of,
    lens_of,
    lens_values,
    only_size,
    print_made,
)
from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.rig.rig import Rig
    from focus_planner.io.rig_files.found import ImportOptions

    Load = Callable[[str | PathLike[str], ImportOptions], tuple[Rig, list[str]]]


def add_import(
    kinds: Any,
    name: str,
    *,
    summary: str,
    description: str,
    file: str,
    cameras: str,
    unit_of: str,
    aliases: Sequence[str] = (),
) -> Any:
    """Add a kind of rig that is read from a file, and return its parser.

    Parameters
    ----------
    kinds : Any
    name, summary, description : str
        Of the kind.
    file : str
        What the file is.
    cameras : str
        What the pattern of cameras matches, with an example.
    unit_of : str
        What has units of length, for ``--scale``.
    aliases : sequence of str
        Its other names.
    """
    parser = kinds.add_parser(name, help=summary, description=description, aliases=aliases)
    parser.add_argument("file", type=Path, metavar="FILE", help=file)
    parser.add_argument(
        "--cameras",
        "--images",
        default="",
        metavar="PATTERN",
        help=f"use only cameras {cameras} (default: all)",
    )
    add_placement_options(parser, unit_of)
    add_image_options(parser, "that of the file")
    add_lens_options(parser)
    return parser


def add_placement_options(parser: Any, unit_of: str) -> None:
    """Add the options that say where a rig is, and how large."""
    parser.add_argument(
        "--scale",
        type=float,
        metavar="METRES",
        help=f"metres per unit of {unit_of} (default: 1)",
    )
    parser.add_argument(
        "--transform",
        type=Path,
        metavar="FILE",
        help="text file of 16 numbers: row by row, the 4 × 4 matrix from these poses, scaled by"
        " --scale, to the rig's frame; it may scale too",
    )
    parser.add_argument(
        "--frame-id", default="", metavar="NAME", help="frame of the rig (default: world)"
    )


def add_image_folder(parser: Any) -> None:
    """Add the option of kinds whose file may leave the size of images to the images."""
    parser.add_argument(
        "--image-folder",
        type=Path,
        metavar="FOLDER",
        help="where the images are whose size, and the focal length of whose lenses, their headers"
        " tell (default: beside the file); or give --image WxH, here also without --fx",
    )


def import_options(options: argparse.Namespace) -> ImportOptions:
    """Return what the options say of a rig."""
    from focus_planner.io.rig_files.alignment import load_alignment
    from focus_planner.io.rig_files.found import ImportOptions

    lens_of(options)  # in whose errors they have their own names
    transform = getattr(options, "transform", None)
    takes_size = hasattr(options, "image_folder")
    size = only_size(options) if takes_size else None
    return ImportOptions(
        cameras=getattr(options, "cameras", ""),
        scale=options.scale,
        transform=None if transform is None else load_alignment(transform),
        frame_id=options.frame_id,
        intrinsics_of=intrinsics_of(options) if size is None and has_image(options) else None,
        size=size,
        image_folder=getattr(options, "image_folder", None),
        lens=lens_values(options),
    )


@contextmanager
def naming_the_kind(path: Path, kind: str) -> Iterator[None]:
    """Have the error of a file that is one of another kind of rig, or its folder, say which."""
    try:
        yield
    except InputError as error:
        from focus_planner.io.rig_files.recognition import file_of_kind, probable_kind_of_file

        other = probable_kind_of_file(path)
        if (inside := file_of_kind(path, kind)) is not None:
            remedy = f"give the file in it: {inside}"
        elif other and other != kind:
            remedy = f"it looks like a file for focus_planner rig {other}"
        else:
            raise
        raise InputError(error.argument, error.expected, error.got, remedy) from None


def run_import(options: argparse.Namespace, load: Load, kind: str) -> int:
    """Read a file of a kind, and print its rig and what was noticed."""
    with shown(quiet=False) as tell, naming_the_kind(options.file, kind):
        tell(f"reading {options.file}")
        rig, notes = load(options.file, import_options(options))
    for note in notes:
        show_note(note)
    return print_made(rig, options)
