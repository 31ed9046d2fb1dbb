# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The options that say how a file is to be taken as a surface."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.progress import Tell, show_reading
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.surface.surface import Surface


def add_surface_options(parser: Any) -> None:
    """Add the options."""
    option = parser.add_argument
    option(
        "--up",
        choices=("z", "y", "x", "-z", "-y", "-x"),
        help="axis of SURFACE that is up in the world; the surface is turned so that it becomes z"
        " (default: z)",
    )
    option(
        "--importance",
        type=Path,
        metavar="FILE",
        help="importance of each vertex or point: a text file of one number per line, or a .npy"
        " file; replaces the property importance of SURFACE",
    )
    option(
        "--importance-property",
        metavar="NAME",
        help="property, field or column of SURFACE that holds the importance of each vertex or"
        " point, such as weight (default: importance, if SURFACE has it)",
    )


def read_surface(options: argparse.Namespace, tell: Tell, path: Path | None = None) -> Surface:
    """Return the surface of the file, with its importance, turned up.

    Parameters
    ----------
    options : argparse.Namespace
    tell : callable
    path : Path, optional
        The file, by default that of the options.

    Raises
    ------
    InputError
        If it cannot be read, or the options contradict each other.
    """
    from focus_planner.core.surface.up_axis import with_z_up
    from focus_planner.io.importance import IMPORTANCE
    from focus_planner.io.surfaces import load_surface

    name = options.importance_property
    if options.importance is not None and name is not None:
        raise InputError("--importance and --importance-property", "one of them", "both")
    path = options.surface if path is None else path
    surface = load_surface(
        path,
        options.importance,
        importance_property=IMPORTANCE if name is None else name,
        on_progress=show_reading(tell, path),
    )
    return with_z_up(surface, options.up or "z")
