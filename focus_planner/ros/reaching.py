"""Finding a planner on the graph, and saying in words why it is not reached."""

from __future__ import annotations

import os

from focus_planner.core.validation import first_few
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.status_watch import HeardStatus, StatusWatch

_MAX_NAMED = 8


class NotReached(Exception):  # noqa: N818 - named for what happened
    """A planner did not answer, or did not do what was asked; its text says why, in one line."""


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
