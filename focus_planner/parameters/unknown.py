# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Parameters that were given and that nobody declares, and what was probably meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence

from focus_planner.parameters.declaration import Declaration

# Those of every node of rclpy.
_OF_ROS = ("qos_overrides.", "use_sim_time", "start_type_description_service")
# A slip of the pen is closer than this; names that other nodes have mostly are not.
_CLOSE = 0.75
# Of each kind: a file may have any number of names of any length.
_MOST_NAMES, _LONGEST_NAME = 1000, 200


def meant_by(
    given: Iterable[str], declarations: Sequence[Declaration]
) -> Iterator[tuple[str, str]]:
    """Yield the given names that resemble a declared one without being one, and that.

    Parameters
    ----------
    given : iterable of str
        Names of the parameters that a node was given; those of other nodes may be among them.
    declarations : sequence of Declaration
        The node's parameters.
    """
    declared = [each.name for each in declarations]
    others = [each for each in sorted(set(given).difference(declared)) if _is_own(each)]
    if not others:
        return
    known = _declared_by_our_nodes()
    for name in others[:_MOST_NAMES]:
        meant = "" if name in known else _closest(_plain(name), declared)
        if meant:
            yield name, meant


def _is_own(name: str) -> bool:
    return not name.startswith(_OF_ROS) and len(name) <= _LONGEST_NAME


def _declared_by_our_nodes() -> set[str]:
    """Return the parameters of all our nodes, which one file may hold under ``/**``."""
    from focus_planner.parameters import lenses, planner  # noqa: PLC0415 - not while a node starts

    nodes = planner.DECLARATIONS, lenses.ADAPTER_DECLARATIONS, lenses.SIMULATION_DECLARATIONS
    return {each.name for declarations in nodes for each in declarations}


def _closest(name: str, declared: Sequence[str]) -> str:
    """Return the declared name that resembles a name, with its group or without; "" for none."""
    by_spelling = {each.rpartition(".")[2]: each for each in declared} | {
        each: each for each in declared
    }
    found = difflib.get_close_matches(name, by_spelling, n=1, cutoff=_CLOSE)
    return by_spelling[found[0]] if found else ""


def _plain(name: str) -> str:
    return name.lower().replace("-", "_").replace("/", ".")
