# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The options of ``focus_planner evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def add_conditions(group: Any) -> None:
    """Add them."""
    option = group.add_argument
    option(
        "--samples",
        type=int,
        default=1000,
        metavar="N",
        help="to plan on, of each subject, where an experiment does not vary them (default:"
        " %(default)s)",
    )
    option(
        "--judged",
        type=int,
        default=65_536,
        metavar="N",
        help="further samples, on which plans are judged (default: %(default)s)",
    )
    option("--seed", type=int, default=0, metavar="S", help="of all samplings (default: 0)")


def add_subjects(group: Any) -> None:
    """Add them."""
    option = group.add_argument
    option(
        "--rig",
        type=Path,
        metavar="RIG.YAML",
        help="the rig of all subjects (default: a run's own; for surfaces the paper's)",
    )
    option(
        "--subjects",
        type=int,
        metavar="N",
        help="how many to take, spread over all by their names (default: all, or as many as an"
        " experiment has use for)",
    )
    option(
        "--up",
        choices=("z", "y", "x", "-z", "-y", "-x"),
        help="axis that is up in the files (default: the one of z, y, x with which the cameras see"
        " most)",
    )
    option(
        "--unit",
        choices=("m", "cm", "mm"),
        help="of the files (default: the largest in which they have room between the cameras)",
    )
    option(
        "--place",
        choices=("as_is", "centred"),
        help="as_is: coordinates are in the rig's frame; centred: between the cameras, feet at"
        " z = 0 (default: centred, with --rig as_is)",
    )


def add_workers(group: Any) -> None:
    """Add them."""
    option = group.add_argument
    option(
        "--workers",
        type=int,
        metavar="N",
        help="processes on this machine (default: one per core; 1: this one)",
    )
    option(
        "--scheduler",
        metavar="ADDRESS",
        help="of a Dask scheduler, host:port, whose workers do the work instead",
    )
