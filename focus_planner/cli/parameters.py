"""``focus_planner parameters``: a parameter file for the node."""

from __future__ import annotations

import argparse
import sys
from typing import Any


def add(commands: Any) -> None:
    """Add the command."""
    parameters = commands.add_parser(
        "parameters",
        help="print a parameter file for the node, with every parameter explained",
        description="Print a parameter file with the default, the description, the unit and the"
        " range of every parameter of the node. To use it: focus_planner node --ros-args"
        " --params-file FILE",
    )
    parameters.set_defaults(command=_parameters)


def _parameters(_: argparse.Namespace) -> int:
    from focus_planner.parameters.file import parameters_to_yaml
    from focus_planner.parameters.planner import DECLARATIONS

    sys.stdout.write(parameters_to_yaml(DECLARATIONS))
    return 0
