"""Clients of a planner that wait as long as a busy machine may need."""

from focus_planner.ros import client
from testing.ros.planner_process import PATIENCE

_USUAL = client._TIMEOUT


def have_clients_wait() -> None:
    """Let every call in this process wait, where no other time is given."""
    client._TIMEOUT = float(PATIENCE)
    for kind in (client.PlannerClient, client.Goal):
        for method in vars(kind).values():
            if defaults := getattr(method, "__defaults__", None):
                longer = [client._TIMEOUT if value == _USUAL else value for value in defaults]
                method.__defaults__ = tuple(longer)
