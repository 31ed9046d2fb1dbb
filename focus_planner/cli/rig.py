"""``focus_planner rig``: making a rig.yaml, from a layout or from the data of other programs."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.rig.camera import CameraIntrinsics
    from focus_planner.core.rig.frames import Similarity
    from focus_planner.core.rig.lens import Lens
    from focus_planner.core.rig.rig import Rig

_IMAGE_OPTIONS = ("image", "fx", "fy", "cx", "cy")

_LENS_OPTIONS: dict[str, dict[str, Any]] = {
    "focal_length": {"help": "focal length, metres (default: 0.05)"},
    "hyperfocal_distance": {
        "help": "focal length² / (f-number · circle of confusion), metres (default: 10)"
    },
    "f_number": {"help": "with --circle-of-confusion: replaces --hyperfocal-distance"},
    "circle_of_confusion": {
        "help": "largest blur spot on the sensor that counts as sharp, metres; beside"
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


def add(commands: Any) -> None:
    """Add the command."""
    rig = commands.add_parser(
        "rig",
        help="make a rig.yaml from a layout, a COLMAP model or tf2 transforms",
        description="Print a rig.yaml made from a regular layout, a COLMAP model or tf2"
        " transforms.",
    )
    kinds = rig.add_subparsers(title="kinds of rig", metavar="KIND")
    _add_cylinder(kinds)
    _add_colmap(kinds)
    _add_transforms(kinds)


# --- layouts -----------------------------------------------------------------------------------


def _add_cylinder(kinds: Any) -> None:
    cylinder = kinds.add_parser(
        "cylinder",
        help="cameras on a cylinder, facing its axis",
        description="Print the rig.yaml of cameras on a cylinder about the z axis, which they face"
        " horizontally. Column j is at the angle 2πj/columns from +x; the order is row by row from"
        " the bottom. The defaults are the paper's.",
    )
    cylinder.set_defaults(command=_cylinder)
    option = cylinder.add_argument
    option("--rows", type=int, default=7, metavar="N", help="number of rows (default: %(default)s)")
    option(
        "--columns",
        type=int,
        default=24,
        metavar="N",
        help="number of columns (default: %(default)s)",
    )
    option(
        "--radius", type=float, default=0.75, metavar="METRES", help="metres (default: %(default)s)"
    )
    option(
        "--bottom",
        type=float,
        default=0.1,
        metavar="METRES",
        help="z of the lowest row, metres (default: %(default)s)",
    )
    option(
        "--top",
        type=float,
        default=1.7,
        metavar="METRES",
        help="z of the highest row, metres (default: %(default)s)",
    )
    option(
        "--frame-id",
        default="world",
        metavar="NAME",
        help="frame of the poses (default: %(default)s)",
    )
    _add_image(cylinder)
    _add_lens(cylinder)


def _cylinder(options: argparse.Namespace) -> int:
    from dataclasses import replace

    from focus_planner.core.rig.defaults import keys_of
    from focus_planner.core.rig.layouts import cylinder_rig

    rig = cylinder_rig(
        options.rows,
        options.columns,
        options.radius,
        options.bottom,
        options.top,
        lens=_lens(options),
        frame_id=options.frame_id,
    )
    intrinsics_of = _intrinsics_of(options)
    cameras = tuple(replace(each, intrinsics=intrinsics_of(each.name)) for each in rig.cameras)
    of_image = frozenset[str]() if _has_image(options) else keys_of("image")
    assumed = {camera.name: of_image for camera in cameras}
    return _print(replace(rig, cameras=cameras, assumed=assumed), options)


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
    _add_lens(colmap)


def _colmap(options: argparse.Namespace) -> int:
    from focus_planner.core.rig.geometry import camera_positions
    from focus_planner.io.colmap import load_colmap

    rig = load_colmap(
        options.folder,
        images=options.images,
        rig_from_model=_rig_from_model(options),
        lens=_lens(options),
        frame_id=options.frame_id,
    )
    if options.scale is None and options.transform is None:
        places = camera_positions(rig)
        span = (places.max(axis=0) - places.min(axis=0)).max()
        show_note(
            f"a COLMAP model has no unit; if it is metres, the cameras span {span:.3g} m;"
            " otherwise give the metres per unit with --scale"
        )
    return _print(rig, options)


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
    _add_image(transforms)
    _add_lens(transforms)


def _transforms(options: argparse.Namespace) -> int:
    from focus_planner.io.transforms import load_transforms

    rig, notes = load_transforms(
        options.file,
        root=options.root,
        cameras=options.cameras,
        convention=options.convention,
        scale=options.scale,
        intrinsics_of=_intrinsics_of(options) if _has_image(options) else None,
        lens=_lens(options),
        frame_id=options.frame_id,
    )
    for note in notes:
        show_note(note)
    return _print(rig, options)


# --- image, lens, output -----------------------------------------------------------------------


def _add_image(parser: Any) -> None:
    group = parser.add_argument_group(
        "image", "Applies to all cameras; the default is the paper's."
    )
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


def _has_image(options: argparse.Namespace) -> bool:
    given = (getattr(options, name) for name in ("camera_info", *_IMAGE_OPTIONS))
    return any(value is not None for value in given)


def _intrinsics_of(options: argparse.Namespace) -> Callable[[str], CameraIntrinsics]:
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
    match = re.fullmatch(r"(\d+)[x×](\d+)", size)
    if match is None:
        raise InputError("--image", "WIDTHxHEIGHT in pixels, such as 1920x1080", repr(size))
    width, height = int(match[1]), int(match[2])
    return CameraIntrinsics(
        width,
        height,
        fx,
        fx if fy is None else fy,
        (width - 1) / 2 if cx is None else cx,
        (height - 1) / 2 if cy is None else cy,
    )


def _add_lens(parser: Any) -> None:
    lens = parser.add_argument_group("lens")
    for name, settings in _LENS_OPTIONS.items():
        flag = f"--{name.replace('_', '-')}"
        lens.add_argument(flag, **{"type": float, "metavar": "X"} | settings)


def _lens(options: argparse.Namespace) -> Lens:
    from focus_planner.io.rigs import lens_from_values

    given = {name: getattr(options, name) for name in _LENS_OPTIONS}
    return lens_from_values(
        "lens", {name: value for name, value in given.items() if value is not None}
    )


def _print(rig: Rig, options: argparse.Namespace) -> int:
    """Print a rig, and what nothing tells of it: its lenses, and images that it has assumed."""
    from dataclasses import replace

    from focus_planner.core.rig.defaults import assumed_values, keys_of, notes_on_defaults
    from focus_planner.io.rigs import rig_to_yaml

    given = {name: getattr(options, name) for name in _LENS_OPTIONS}
    lens = {name: value for name, value in given.items() if value is not None}
    of_lens = assumed_values(lens, {}) & keys_of("lens")
    assumed = {
        camera.name: of_lens | rig.assumed.get(camera.name, frozenset()) for camera in rig.cameras
    }
    defaults = notes_on_defaults(
        assumed.values(),
        "use --focal-length, and --f-number with --circle-of-confusion, or --hyperfocal-distance,"
        " or edit the rig's file",
        "use --camera-info, or --image with --fx, or edit the rig's file",
    )
    for note in (*rig.notes, *defaults):
        show_note(note.text)
    sys.stdout.write(rig_to_yaml(replace(rig, assumed=assumed)))
    return 0
