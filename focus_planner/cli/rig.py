"""``focus_planner rig``: making a rig.yaml, by rule or of what other programs know."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.rig.camera import CameraIntrinsics
    from focus_planner.core.rig.frames import Similarity
    from focus_planner.core.rig.lens import Lens
    from focus_planner.core.rig.rig import Rig

_IMAGE_OPTIONS = ("image", "fx", "fy", "cx", "cy")

_LENS_OPTIONS: dict[str, dict[str, Any]] = {
    "focal_length": {"help": "F, metres (0.05)"},
    "hyperfocal_distance": {"help": "H = F² / (f-number · circle of confusion), metres (10)"},
    "f_number": {"help": "with --circle-of-confusion, instead of --hyperfocal-distance"},
    "circle_of_confusion": {"help": "the largest spot that counts as sharp on the sensor, metres"},
    "min_focus": {"help": "nearest distance that the lens can be set to, metres"},
    "max_focus": {"help": "farthest distance that the lens can be set to, metres"},
    "focus_distances": {"nargs": "+", "help": "the only distances that it can be set to, metres"},
    "focus_steps": {
        "type": int,
        "metavar": "N",
        "help": "positions from --min-focus to --max-focus, equally spaced in dioptres, instead",
    },
}


def add(commands: Any) -> None:
    """Add the command."""
    rig = commands.add_parser(
        "rig",
        help="make a rig.yaml, by rule or from COLMAP or tf2",
        description="Print a rig.yaml, made by rule or of what another program knows.",
    )
    kinds = rig.add_subparsers(title="kinds of rig", metavar="KIND", required=True)
    _add_cylinder(kinds)
    _add_colmap(kinds)
    _add_transforms(kinds)


# --- by rule -----------------------------------------------------------------------------------


def _add_cylinder(kinds: Any) -> None:
    cylinder = kinds.add_parser(
        "cylinder",
        help="cameras on a cylinder that look at its axis",
        description="Print the rig.yaml of cameras on a cylinder about the z axis, looking"
        " horizontally at it; column j stands at the angle 2πj/columns from +x, row by row from"
        " the bottom. The values in brackets, the paper's, hold where none is given.",
    )
    cylinder.set_defaults(command=_cylinder)
    option = cylinder.add_argument
    option("--rows", type=int, default=7, metavar="N", help="(7)")
    option("--columns", type=int, default=24, metavar="N", help="(24)")
    option("--radius", type=float, default=0.75, metavar="M", help="metres (0.75)")
    option(
        "--bottom", type=float, default=0.1, metavar="M", help="z of the lowest row, metres (0.1)"
    )
    option("--top", type=float, default=1.7, metavar="M", help="z of the highest row, metres (1.7)")
    option("--frame-id", default="world", metavar="NAME", help="the frame of the poses (world)")
    _add_lens(cylinder)


def _cylinder(options: argparse.Namespace) -> int:
    from focus_planner.core.rig.layouts import cylinder_rig

    return _print(
        cylinder_rig(
            options.rows,
            options.columns,
            options.radius,
            options.bottom,
            options.top,
            lens=_lens(options),
            frame_id=options.frame_id,
        )
    )


# --- of a COLMAP model -------------------------------------------------------------------------


def _add_colmap(kinds: Any) -> None:
    colmap = kinds.add_parser(
        "colmap",
        help="the images of a COLMAP model as cameras",
        description="Print the rig.yaml of a sparse model of COLMAP, text or binary: every image"
        " is a camera. Cameras are named by their images' paths without what all of them begin or"
        " end with: cam01/0001.jpg and cam02/0001.jpg make cam01 and cam02.",
    )
    colmap.set_defaults(command=_colmap)
    option = colmap.add_argument
    option(
        "folder",
        type=Path,
        metavar="FOLDER",
        help="the model's, such as sparse/0: cameras and images, .bin or .txt",
    )
    option(
        "--images",
        default="*",
        metavar="PATTERN",
        help="only images whose names match, such as 'cam*/0001.jpg' (all)",
    )
    option(
        "--scale",
        type=float,
        metavar="M",
        help="metres per unit of the model, which knows none itself (1, and a note)",
    )
    option(
        "--transform",
        type=Path,
        metavar="FILE",
        help="a text of 16 numbers, the 4 × 4 matrix row by row that takes the model, scaled by"
        " --scale, to the rig's frame; it may scale too",
    )
    option("--frame-id", default="world", metavar="NAME", help="the frame of the poses (world)")
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
        _note(
            f"COLMAP knows no metres; taken as such, the cameras span {span:.3g} m;"
            " --scale says how many metres one unit is"
        )
    return _print(rig)


def _rig_from_model(options: argparse.Namespace) -> Similarity:
    from focus_planner.core.rig.frames import Similarity
    from focus_planner.core.validation import check_number
    from focus_planner.io.colmap import load_alignment

    aligned = Similarity() if options.transform is None else load_alignment(options.transform)
    if options.scale is None:
        return aligned
    return aligned @ Similarity(scale=check_number("--scale", options.scale, above=0))


# --- of transforms -----------------------------------------------------------------------------


def _add_transforms(kinds: Any) -> None:
    transforms = kinds.add_parser(
        "transforms",
        help="frames of tf2 as cameras",
        description="Print the rig.yaml of cameras whose poses are transforms between frames, as"
        " tf2 has them; chains of transforms are composed. Cameras are named by their frames,"
        " without _optical_frame. The values in brackets hold where none is given.",
    )
    transforms.set_defaults(command=_transforms)
    option = transforms.add_argument
    option(
        "file",
        type=Path,
        metavar="FILE",
        help="YAML or JSON of TransformStamped messages, such as ros2 topic echo /tf_static"
        " prints; or a text of lines: x y z qx qy qz qw parent child, x y z yaw pitch roll parent"
        " child, or commands of static_transform_publisher",
    )
    option("--root", default="", metavar="FRAME", help="the rig's frame (the tree's root)")
    option(
        "--cameras",
        default="",
        metavar="PATTERN",
        help="the cameras' frames, such as 'cam*_optical_frame' (frames without children that are"
        " called optical, or if there are none, all without children)",
    )
    option(
        "--convention",
        default="",
        metavar="NAME",
        help="what the cameras' frames are: optical, z forward, or body, x forward (optical if"
        " their names end in _optical_frame or _optical, else body, and a note)",
    )
    option("--scale", type=float, metavar="M", help="metres per unit of the translations (1)")
    option("--frame-id", default="", metavar="NAME", help="the frame of the poses (--root)")
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
        intrinsics_of=_intrinsics_of(options),
        lens=_lens(options),
        frame_id=options.frame_id,
    )
    if options.camera_info is None and options.image is None:
        notes.append("all cameras have the paper's image; --camera-info or --image says theirs")
    for note in notes:
        _note(note)
    return _print(rig)


# --- image, lens, output -----------------------------------------------------------------------


def _add_image(parser: Any) -> None:
    group = parser.add_argument_group("image", "of all cameras; the paper's if none is given")
    group.add_argument(
        "--camera-info",
        type=Path,
        metavar="FILE",
        help="the YAML that camera_calibration writes; or a folder with NAME.yaml per camera",
    )
    group.add_argument(
        "--image", metavar="WxH", help="instead: width and height, pixels; with --fx"
    )
    for name, meaning in (
        ("fx", "focal length, pixels"),
        ("fy", "vertical focal length (--fx)"),
        ("cx", "principal point; the first pixel's centre is 0 (the middle)"),
        ("cy", "principal point (the middle)"),
    ):
        group.add_argument(f"--{name}", type=float, metavar="X", help=meaning)


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
        raise InputError("--image and --fx", "both, or neither", "one without the other")
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


def _print(rig: Rig) -> int:
    from focus_planner.io.rigs import rig_to_yaml

    sys.stdout.write(rig_to_yaml(rig))
    return 0


def _note(text: str) -> None:
    print("focus_planner: note:", text, file=sys.stderr)
