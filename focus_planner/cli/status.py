# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner status``: what a running planner says of itself, its plan and its lenses."""

from __future__ import annotations

import argparse
import json
import math
import sys
from typing import TYPE_CHECKING, Any

from focus_planner.cli.interrupts import ctrl_c
from focus_planner.cli.node_options import PATIENCE, add_node_options, node_name
from focus_planner.cli.progress import shown
from focus_planner.cli.terminal import show_error

if TYPE_CHECKING:
    from focus_planner.ros.reaching import Standing

_NO_ANSWER, _BAD_INPUT = 1, 2
_NO_PLAN, _WRONG_LENSES, _OTHER_LENSES = 3, 4, 5
_EPILOG = """\
exit status:
  0  a plan is in force, and every lens is verified or accepted
  1  no such node answered
  2  bad input
  3  no plan is in force
  4  a plan is in force, and a lens failed or differs from it
  5  a plan is in force, and a lens has not been reported as set
"""


def add(commands: Any) -> None:
    """Add the command."""
    status = commands.add_parser(
        "status",
        help="show a running planner node: its plan, its lenses, its inputs",
        description="Show what a planner node says of itself: its state, the plan in force, what\n"
        "became of it at every lens, and what the next plan would be made for.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    status.set_defaults(command=run)
    add_node_options(status, "how long to wait for the node (default: 10)")
    option = status.add_argument
    option("--cameras", action="store_true", help="list all cameras, not only those with trouble")
    option(
        "--json",
        action="store_true",
        help="print the fields of PlannerStatus.msg as JSON, with node, status_age (s), method,"
        " cost and lower_bound; what is not a number is null, infinity the text inf",
    )


def run(options: argparse.Namespace) -> int:
    """Show the status."""
    name = node_name(options)
    with shown(options.json) as tell:
        tell("loading ROS")
        try:
            from focus_planner.ros.reaching import NotReached, standing_of
        except ImportError as error:
            show_error(f"status needs ROS 2 (rclpy) and focus_planner_msgs: {error}")
            return _BAD_INPUT
        tell(f"looking for {name}")
        try:
            standing = standing_of(name, options.timeout or PATIENCE, ctrl_c.check)
        except NotReached as error:
            show_error(str(error))
            return _NO_ANSWER
    if options.json:
        json.dump(_jsonable(standing), sys.stdout, indent=1, allow_nan=False)
        print()
    else:
        from focus_planner.cli.status_text import show

        show(standing, sys.stdout, cameras=options.cameras)
    return exit_status(standing.status)


def exit_status(status: dict[str, Any]) -> int:
    """Return the exit status for the fields of a ``PlannerStatus``."""
    if not status["plan_id"]:
        return _NO_PLAN
    if status["failed"] or status["differ"]:
        return _WRONG_LENSES
    set_lenses = status["verified"] + status["accepted"]
    return 0 if set_lenses == len(status["lenses"]) else _OTHER_LENSES


def _jsonable(standing: Standing) -> dict[str, Any]:
    plan = standing.plan or {}
    told = {name: plan.get(name) for name in ("method", "cost", "lower_bound")}
    head = {"node": standing.node, "status_age": standing.age}
    fields: dict[str, Any] = _without_nan(head | told | standing.status)
    return fields


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _without_nan(each) for name, each in value.items()}
    if isinstance(value, list):
        return [_without_nan(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value
