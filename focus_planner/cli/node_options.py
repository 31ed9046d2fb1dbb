# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The options that say which node on the graph is meant, and for how long it is waited for."""

from __future__ import annotations

import argparse
from typing import Any

from focus_planner.core.validation import InputError

#: Of a node to appear, seconds: many times what discovery takes.
PATIENCE = 10.0


def add_node_options(parser: Any, timeout: str) -> None:
    """Add the options; ``timeout`` says what is waited for."""
    option = parser.add_argument
    option(
        "--node",
        default="/focus_planner",
        metavar="NAME",
        help="full name of the planner node, with its namespace (default: %(default)s)",
    )
    option("--timeout", type=float, metavar="SECONDS", help=timeout)


def node_name(options: argparse.Namespace) -> str:
    """Return the full name of the node.

    Raises
    ------
    InputError
        If it is no name of a node, or the timeout is no time.
    """
    from focus_planner.parameters.drivers import full_name

    if options.timeout is not None and not 0 < options.timeout < float("inf"):
        raise InputError("--timeout", "seconds, above 0", f"{options.timeout:g}")
    name = full_name("--node", options.node, "/")
    if not all(part.isidentifier() and part.isascii() for part in name.split("/")[1:]):
        expected = "letters, digits and underscores between slashes, like /rig_1/focus_planner"
        raise InputError("--node", expected, repr(name))
    return name
