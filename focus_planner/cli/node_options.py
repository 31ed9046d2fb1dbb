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
