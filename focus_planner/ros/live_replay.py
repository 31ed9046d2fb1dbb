"""Playing a recorded run into a running node, to see whether it answers the same."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import plan_from_message
from focus_planner.messages.typestore import CLOUD, MESH, POSES, RIG
from focus_planner.parameters.planner import DECLARATIONS, Settings
from focus_planner.recording.run import VERTEX_DATA, Ending, Run
from focus_planner.ros.client import PlannerClient

_TOPICS = {MESH: "mesh", CLOUD: "cloud", POSES: "camera_poses", RIG: "rig"}
# What a node says of its own topics and clock.
_WHERE_AND_WHEN = re.compile(r"received on \S+ at [\d:]+ UTC")


def replay_live(run: Run, node: str, tell: Callable[[str], None] = lambda _: None) -> Ending:
    """Publish a run's inputs to a node, call it as the run did, and return its answer.

    Parameters of the node that differ from those recorded are set to them, and back afterwards;
    its surface and rig are the run's from then on. Lens tables reach it in a file, so a run that
    has some needs a node on this machine.

    Parameters
    ----------
    run : Run
    node : str
        Its full name.
    tell : callable
        Told what is being done.

    Raises
    ------
    InputError
        If there is no such node, or it cannot be given what was recorded.
    """
    assert run.ending is not None
    if any(message.type_name == VERTEX_DATA for message in run.inputs):
        raise InputError(
            str(run.path),
            "a run whose mesh fits a message, for --live",
            "a mesh with normals or importance of its vertices",
            "replay it without --live",
        )
    if run.beginning.warm_start is not None:
        raise InputError(
            str(run.path),
            "a run that started from nothing, for --live",
            "one that started from the plan before it",
            "replay it without --live",
        )
    try:
        with PlannerClient(node) as client:
            tell(f"waiting for {node}")
            client.wait_for_node()
            with _parameters_of(client, run.beginning.settings):
                for message in run.inputs:
                    tell(f"publishing {message.topic}")
                    client.publish(_TOPICS[message.type_name], message.payload)
                tell(f"{node} is planning")
                answer = client.plan(**run.beginning.asked)
    except TimeoutError as error:
        raise InputError("--node", "a running planner", f"{node}: {error}") from None
    if answer.success:
        return Ending(True, answer.message, plan_from_message(answer.plan))
    return _with_its_times(run.ending, answer.message)


def _with_its_times(recorded: Ending, message: str) -> Ending:
    """Return a refusal; one that differs by topic and time of arrival only is the recorded one."""
    now, then = (_WHERE_AND_WHEN.sub("received", text) for text in (message, recorded.message))
    return Ending(False, recorded.message if now == then else message)


@contextmanager
def _parameters_of(client: PlannerClient, settings: Settings) -> Iterator[None]:
    """Give the node these parameters, where its own differ, and its own back in the end."""
    with TemporaryDirectory() as folder:
        yield from _set_for_a_while(client, _wanted(settings, Path(folder)))


def _wanted(settings: Settings, folder: Path) -> dict[str, Any]:
    """Return the parameters to set, the lens tables' file with what was recorded in it."""
    of_plans = {declaration.name for declaration in DECLARATIONS if declaration.plans}
    wanted = {name: value for name, value in settings.values if name in of_plans}
    if settings.lens_tables_text:
        file = folder / "lens_tables.yaml"
        file.write_text(settings.lens_tables_text, encoding="utf-8")
        wanted["lens_tables"] = str(file)
    return wanted


def _set_for_a_while(client: PlannerClient, wanted: dict[str, Any]) -> Iterator[None]:
    read_only = {declaration.name for declaration in DECLARATIONS if declaration.read_only}
    own = client.get_parameters(list(wanted))
    other = {name: value for name, value in wanted.items() if own[name] != value}
    for name in read_only & other.keys():
        raise InputError(
            f"the node's {name}",
            repr(other[name]),
            repr(own[name]),
            f"start it with -p {name}:={other[name]}",
        )
    _set(client, other)
    try:
        yield
    finally:
        _set(client, {name: own[name] for name in other})


def _set(client: PlannerClient, values: dict[str, Any]) -> None:
    if not values:
        return
    result = client.set_parameters_atomically(values)
    if not result.successful:
        raise InputError("the node's parameters", "those recorded", result.reason)
