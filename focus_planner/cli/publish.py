# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner publish``: gives a running planner a surface and a rig."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.interrupts import ctrl_c
from focus_planner.cli.node_options import PATIENCE, add_node_options, node_name
from focus_planner.cli.option_rules import check_beside
from focus_planner.cli.progress import Tell, shown
from focus_planner.cli.surface_options import add_surface_options, read_surface
from focus_planner.cli.terminal import show_error, show_note
from focus_planner.core.text import printable
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.rig.rig import Rig
    from focus_planner.core.surface.surface import Surface

_TIMEOUT = 60.0
_NOT_DONE, _BAD_INPUT = 1, 2


def add(commands: Any) -> None:
    """Add the command."""
    publish = commands.add_parser(
        "publish",
        help="give a running planner node a surface, a rig or both",
        description="Publish a surface, a rig or both to a planner node, and wait until it says"
        " that it uses them. Exit status 0: it does; 1: it refused them, is not active or did not"
        " answer; 2: bad input.",
    )
    publish.set_defaults(command=run)
    option = publish.add_argument
    option(
        "surface",
        type=Path,
        nargs="?",
        metavar="SURFACE",
        help="mesh or point-cloud file, in metres and in the frame of the rig",
    )
    option("--rig", type=Path, metavar="RIG.YAML", help="file of the cameras")
    add_surface_options(publish)
    option(
        "--lens-tables",
        type=Path,
        metavar="FILE",
        help="YAML file of lens tables by camera, published with the rig; for lenses without a"
        " table in RIG.YAML",
    )
    add_node_options(
        publish,
        "how long to wait for the node to appear (default: 10), to start and to take what was"
        " published (default: 60)",
    )
    option(
        "--plan",
        action="store_true",
        help="then have it plan, with the parameters of the node, and wait for the plan",
    )
    option("--method", metavar="METHOD", help="with --plan: the solver, if not the node's")
    option("--quiet", action="store_true", help="show no progress, and say nothing of success")


def run(options: argparse.Namespace) -> int:
    """Publish what the options name."""
    name = node_name(options)
    _check(options)
    with shown(options.quiet) as tell:
        rig = _read_rig(options, tell)
        surface = None if options.surface is None else read_surface(options, tell)
        _check_importance(options, surface)
        tell("loading ROS")
        try:
            from focus_planner.ros.client import PlannerClient
            from focus_planner.ros.feeding import Feeder
            from focus_planner.ros.reaching import NotReached
        except ImportError as error:
            show_error(f"publish needs ROS 2 (rclpy) and focus_planner_msgs: {error}")
            return _BAD_INPUT
        patience, timeout = options.timeout or PATIENCE, options.timeout or _TIMEOUT
        try:
            with PlannerClient(name, ctrl_c.check) as client:
                feeder = Feeder(client, name, tell, patience, timeout)
                status = feeder.feed(surface, rig)
                planned = feeder.plan(options.method or "") if options.plan else None
        except NotReached as error:
            show_error(str(error))
            return _NOT_DONE
    _show_notes(name, status, surface, rig)
    if not options.quiet:
        print(f"{name} has {_in_words(options, surface, rig)}")
    return 0 if planned is None else _show_plan(options, planned)


def _check(options: argparse.Namespace) -> None:
    """Raise unless there is something to publish, and every option has what it is about."""
    if options.surface is None and options.rig is None:
        raise InputError("arguments", "SURFACE, --rig RIG.YAML or both", "neither")
    for option in ("--up", "--importance", "--importance-property"):
        check_beside(options, option, "SURFACE")
    check_beside(options, "--lens-tables", "--rig")
    check_beside(options, "--method", "--plan")


def _check_importance(options: argparse.Namespace, surface: Surface | None) -> None:
    """Raise if an importance was given that would be lost."""
    asked = options.importance is not None or options.importance_property is not None
    if asked and hasattr(surface, "triangles"):
        raise InputError(
            "--importance and --importance-property",
            "a point cloud as SURFACE",
            "a mesh, whose message has no place for it",
            'publish its vertices as a cloud, or plan from files with "focus_planner plan"',
        )


def _read_rig(options: argparse.Namespace, tell: Tell) -> Rig | None:
    from focus_planner.io.lens_tables import load_lens_tables
    from focus_planner.io.rigs import load_rig

    if options.rig is None:
        return None
    tell(f"reading {options.rig}")
    rig = load_rig(options.rig)
    return load_lens_tables(options.lens_tables).apply(rig) if options.lens_tables else rig


# --- what is said --------------------------------------------------------------------------------


def _show_notes(name: str, status: Any, surface: Surface | None, rig: Rig | None) -> None:
    for notes in (surface.notes if surface else (), rig.notes if rig else ()):
        for note in notes:
            show_note(note.text)
    lost = ("vertex_importance", "vertex_normals", "vertex_colours", "texture")
    left_out = [part for part in lost if getattr(surface, part, None) is not None]
    if left_out:
        parts = ", ".join(part.removeprefix("vertex_") for part in left_out)
        show_note(f"the message of a mesh has no place for its {parts}: left out")
    for kind in ("surface", "rig"):
        if not getattr(status, kind).topic:
            show_note(f"{name} has no {kind} yet, and cannot plan without")


def _in_words(options: argparse.Namespace, surface: Surface | None, rig: Rig | None) -> str:
    said = []
    if surface is not None:
        triangles = getattr(surface, "triangles", None)
        size = (
            f"a cloud of {len(getattr(surface, 'points', ())):,} points"
            if triangles is None
            else f"a mesh of {len(triangles):,} triangles"
        )
        said.append(f"the surface {options.surface.name}, {size}")
    if rig is not None:
        cameras = "1 camera" if len(rig) == 1 else f"{len(rig)} cameras"
        said.append(f"the rig {options.rig.name} of {cameras}")
    return printable(", and ".join(said))


def _show_plan(options: argparse.Namespace, planned: Any) -> int:
    """Tell what the planner answered; return the exit status."""
    if not planned.success:
        show_error(f"no plan: {planned.message}")
        return _NOT_DONE
    if not options.quiet:
        print(f"{printable(planned.plan.plan_id)}: {printable(planned.message)}")
    return 0
