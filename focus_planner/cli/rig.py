"""``focus_planner rig``: making a rig.yaml, from a layout or from the data of other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli import rig_layouts
from focus_planner.cli.progress import shown
from focus_planner.cli.rig_options import (
    add_image_options,
    add_lens_options,
    has_image,
    intrinsics_of,
    lens_of,
    print_rig,
)
from focus_planner.cli.terminal import show_note

if TYPE_CHECKING:
    from focus_planner.core.rig.frames import Similarity


def add(commands: Any) -> None:
    """Add the command."""
    rig = commands.add_parser(
        "rig",
        help="make a rig.yaml from a layout, a COLMAP model or tf2 transforms",
        description="Print a rig.yaml made from a regular layout, a COLMAP model or tf2"
        " transforms.",
    )
    kinds = rig.add_subparsers(title="kinds of rig", metavar="KIND")
    rig_layouts.add(kinds)
    _add_colmap(kinds)
    _add_transforms(kinds)


# --- COLMAP models -----------------------------------------------------------------------------


def _add_colmap(kinds: Any) -> None:
    colmap = kinds.add_parser(
        "colmap",
        help="the images of a COLMAP model as cameras",
        description="Print the rig.yaml of a sparse COLMAP model, text or binary: every image is a"
        " camera. Cameras are named after their images' paths, without the beginning and the end"
        " common to all: cam01/0001.jpg and cam02/0001.jpg become cam01 and cam02.",
    )
    colmap.set_defaults(command=_colmap)
    option = colmap.add_argument
    option(
        "folder",
        type=Path,
        metavar="FOLDER",
        help="folder of the model, such as sparse/0, with cameras and images (.bin or .txt)",
    )
    option(
        "--images",
        default="*",
        metavar="PATTERN",
        help="use only images whose names match, such as 'cam*/0001.jpg' (default: all)",
    )
    option(
        "--scale",
        type=float,
        metavar="METRES",
        help="metres per unit of the model, which has no unit of its own (default: 1, with a note)",
    )
    option(
        "--transform",
        type=Path,
        metavar="FILE",
        help="text file of 16 numbers: row by row, the 4 × 4 matrix from the model, scaled by"
        " --scale, to the rig's frame; it may scale too",
    )
    option(
        "--frame-id",
        default="world",
        metavar="NAME",
        help="frame of the poses (default: %(default)s)",
    )
    add_lens_options(colmap)


def _colmap(options: argparse.Namespace) -> int:
    from focus_planner.core.rig.geometry import camera_positions
    from focus_planner.io.colmap import load_colmap

    with shown(quiet=False) as tell:
        tell(f"reading {options.folder}")
        rig = load_colmap(
            options.folder,
            images=options.images,
            rig_from_model=_rig_from_model(options),
            lens=lens_of(options),
            frame_id=options.frame_id,
        )
    if options.scale is None and options.transform is None:
        places = camera_positions(rig)
        span = (places.max(axis=0) - places.min(axis=0)).max()
        show_note(
            f"a COLMAP model has no unit; if it is metres, the cameras span {span:.3g} m;"
            " otherwise give the metres per unit with --scale"
        )
    return print_rig(rig, options)


def _rig_from_model(options: argparse.Namespace) -> Similarity:
    from focus_planner.core.rig.frames import Similarity
    from focus_planner.core.validation import check_number
    from focus_planner.io.colmap import load_alignment

    aligned = Similarity() if options.transform is None else load_alignment(options.transform)
    if options.scale is None:
        return aligned
    return aligned @ Similarity(scale=check_number("--scale", options.scale, above=0))


# --- transforms --------------------------------------------------------------------------------


def _add_transforms(kinds: Any) -> None:
    transforms = kinds.add_parser(
        "transforms",
        help="tf2 frames as cameras",
        description="Print the rig.yaml of cameras whose poses are tf2 transforms; chains of"
        " transforms are composed. Cameras are named after their frames, without _optical_frame.",
    )
    transforms.set_defaults(command=_transforms)
    option = transforms.add_argument
    option(
        "file",
        type=Path,
        metavar="FILE",
        help="TransformStamped messages as YAML or JSON, as printed by ros2 topic echo /tf_static;"
        " or a text file with a transform on each line: x y z qx qy qz qw parent child, or x y z"
        " yaw pitch roll parent child, or a static_transform_publisher command; or nerfstudio's"
        " transforms.json, whose frames are images with intrinsics of their own",
    )
    option(
        "--root", default="", metavar="FRAME", help="frame of the rig (default: root of the tree)"
    )
    option(
        "--cameras",
        default="",
        metavar="PATTERN",
        help="frames of the cameras, such as 'cam*_optical_frame' (default: the leaves of the tree"
        " with optical in their names, or all leaves if there are none)",
    )
    option(
        "--convention",
        default="",
        metavar="NAME",
        help="axes of the cameras' frames: optical (z forward) or body (x forward) (default:"
        " optical if their names end in _optical_frame or _optical, otherwise body, with a note)",
    )
    option(
        "--scale",
        type=float,
        metavar="METRES",
        help="metres per unit of the translations (default: 1)",
    )
    option("--frame-id", default="", metavar="NAME", help="frame of the poses (default: --root)")
    add_image_options(transforms)
    add_lens_options(transforms)


def _transforms(options: argparse.Namespace) -> int:
    from focus_planner.io.transforms import load_transforms

    with shown(quiet=False) as tell:
        tell(f"reading {options.file}")
        rig, notes = load_transforms(
            options.file,
            root=options.root,
            cameras=options.cameras,
            convention=options.convention,
            scale=options.scale,
            intrinsics_of=intrinsics_of(options) if has_image(options) else None,
            lens=lens_of(options),
            frame_id=options.frame_id,
        )
    for note in notes:
        show_note(note)
    return print_rig(rig, options)
