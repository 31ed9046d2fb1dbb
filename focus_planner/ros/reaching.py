# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Finding a planner on the graph, and saying in words why it is not reached."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

from focus_planner.core.validation import first_few
from focus_planner.messages.writing import Fields
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.conversions import message_from_ros
from focus_planner.ros.status_watch import HeardStatus, StatusWatch

_MAX_NAMED = 8


class NotReached(Exception):  # noqa: N818 - named for what happened
    """A planner did not answer, or did not do what was asked; its text says why, in one line."""


@dataclass(frozen=True)
class Standing:
    """What a planner says of itself, without ROS.

    Attributes
    ----------
    node : str
        Its full name.
    status : dict
        The fields of its ``PlannerStatus``.
    age : float
        How old that is, seconds.
    plan : dict or None
        The fields of the ``FocusPlan`` in force; None if there is none, or it was not heard.
    """

    node: str
    status: Fields
    age: float
    plan: Fields | None


def standing_of(name: str, timeout: float, on_wait: Callable[[], object]) -> Standing:
    """Return what a planner says of itself.

    Parameters
    ----------
    name : str
        Its full name.
    timeout : float
        How long to wait for it, seconds.
    on_wait : callable
        Called again and again meanwhile; what it raises ends the wait.

    Raises
    ------
    NotReached
        If it says nothing in time.
    """
    with PlannerClient(name, on_wait) as client:
        watch = client.watch_status()
        first_status(client, watch, name, timeout)
        newest = watch.newest
        assert newest is not None
        plan = _plan_in_force(client, newest.message.plan_id, timeout)
        return Standing(name, message_from_ros(newest.message), newest.age, plan)


def _plan_in_force(client: PlannerClient, plan_id: str, timeout: float) -> Fields | None:
    if not plan_id:
        return None
    try:
        plan = client.latched_plan(timeout)
    except TimeoutError:
        return None
    return message_from_ros(plan) if plan.plan_id == plan_id else None


def first_status(
    client: PlannerClient, watch: StatusWatch, name: str, timeout: float
) -> HeardStatus:
    """Return the first status that is heard of a planner.

    Raises
    ------
    NotReached
        If there is none in time; it says which planners are on the graph.
    """
    heard = watch.wait_for(lambda _: True, timeout)
    if heard is None:
        raise NotReached(_nobody(name, client.planners(), client.domain, timeout))
    return heard


def _nobody(name: str, planners: list[str], domain: int, timeout: float) -> str:
    reach = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "SUBNET"
    graph = f"ROS domain {domain} (discovery range {reach})"
    if name in planners:
        return f"{name} is on {graph}, but has said nothing within {timeout:g} s: does it hang?"
    said = f"no planner {name} answered within {timeout:g} s on {graph}"
    if planners:
        return f"{said}, where there are: {first_few(planners, _MAX_NAMED)}; choose with --node"
    return (
        f"{said}, nor any other; is it running, with the same ROS_DOMAIN_ID and"
        " ROS_AUTOMATIC_DISCOVERY_RANGE?"
    )
