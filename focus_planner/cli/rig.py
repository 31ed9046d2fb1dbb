"""``focus_planner rig``: making a rig.yaml by rule."""

from __future__ import annotations

import argparse
import sys
from typing import Any

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
        "rig", help="make a rig.yaml by rule", description="Print a rig.yaml made by rule."
    )
    kinds = rig.add_subparsers(title="kinds of rig", metavar="KIND", required=True)
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
    lens = cylinder.add_argument_group("lens")
    for name, settings in _LENS_OPTIONS.items():
        flag = f"--{name.replace('_', '-')}"
        lens.add_argument(flag, **{"type": float, "metavar": "X"} | settings)


def _cylinder(options: argparse.Namespace) -> int:
    from focus_planner.core.rig import cylinder_rig
    from focus_planner.io.rigs import lens_of, rig_to_yaml

    given = {name: getattr(options, name) for name in _LENS_OPTIONS}
    rig = cylinder_rig(
        options.rows,
        options.columns,
        options.radius,
        options.bottom,
        options.top,
        lens=lens_of("lens", {name: value for name, value in given.items() if value is not None}),
        frame_id=options.frame_id,
    )
    sys.stdout.write(rig_to_yaml(rig))
    return 0
