# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner parameters``: a parameter file for each of the nodes."""

from __future__ import annotations

import argparse
import sys
from typing import Any

_PLANNER, _ADAPTER, _SIMULATION = "node", "lens_adapter", "simulated_lens"


def add(commands: Any) -> None:
    """Add the command."""
    parameters = commands.add_parser(
        "parameters",
        help="print a parameter file for a node, with every parameter explained",
        description="Print a parameter file with the default, the description, the unit and the"
        " range of every parameter of a node. To use it: focus_planner NODE --ros-args"
        " --params-file FILE",
    )
    parameters.set_defaults(command=_parameters)
    parameters.add_argument(
        "node",
        nargs="?",
        default=_PLANNER,
        choices=(_PLANNER, _ADAPTER, _SIMULATION),
        metavar="NODE",
        help="node (the planner), lens_adapter or simulated_lens (default: %(default)s)",
    )


def _parameters(options: argparse.Namespace) -> int:
    sys.stdout.write(_text_of(options.node))
    return 0


def _text_of(node: str) -> str:
    from focus_planner.parameters import file, lenses, planner

    if node == _PLANNER:
        return file.parameters_to_yaml(planner.DECLARATIONS)
    what, declarations = {
        _ADAPTER: ("the lens adapter", lenses.ADAPTER_DECLARATIONS),
        _SIMULATION: ("simulated lenses", lenses.SIMULATION_DECLARATIONS),
    }[node]
    return file.lens_parameters_to_yaml(node, what, declarations, lenses.ABOUT_DRIVERS)
