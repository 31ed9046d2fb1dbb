# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Replaying a recorded run on a running node, to check that it answers the same."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Any

from focus_planner.core.validation import InputError
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.messages.typestore import (
    CLOUD,
    MESH,
    POSES,
    RIG,
    TRANSFORMS,
    VERTEX_DATA,
    definition_of,
    fields_of,
    serialize,
)
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.run import Ending, Run
from focus_planner.ros.client import PlannerClient
from focus_planner.runtime.inputs import without_unheard

_TOPICS = {MESH: "mesh", CLOUD: "cloud", POSES: "camera_poses", RIG: "rig"}
# The part of a message that depends on a node's name and clock.
_RECEIVED = re.compile(r"received on \S+ at [\d:]+ UTC")


def replay_live(run: Run, node: str, on_step: Callable[[str], None] = lambda _: None) -> Ending:
    """Publish a run's inputs to a node, call it as the run did, and return its answer.

    Parameters of the node that differ from the recorded ones are set to those, and restored
    afterwards; its surface and rig stay the run's. Lens tables are passed in a file in one of its
    ``data_directories``, so a run that has some needs a node on this machine that has one.

    Parameters
    ----------
    run : Run
    node : str
        Full name of the node.
    on_step : callable
        Called with a description of each step.

    Raises
    ------
    InputError
        If there is no such node, or the run cannot be replayed on it.
    """
    assert run.ending is not None
    if any(message.type_name == VERTEX_DATA for message in run.inputs):
        raise InputError(
            str(run.path),
            "a mesh that a message can hold, for --live",
            "one with normals or importance per vertex",
            "replay it without --live",
        )
    if any(message.type_name == TRANSFORMS for message in run.inputs):
        raise InputError(
            str(run.path),
            "a run whose inputs are in the planner's frame, for --live",
            "one that depends on transforms, which are not published on a graph with its own",
            "replay it without --live",
        )
    if run.beginning.warm_start is not None:
        raise InputError(
            str(run.path),
            "a run without a warm start, for --live",
            "one that started from the plan before it",
            "replay it without --live",
        )
    if run.ending.stop_log.stopped:
        raise InputError(
            str(run.path),
            "a run that ended by itself, for --live",
            "one that a time budget or its caller ended",
            "replay it without --live, which stops at the same step",
        )
    try:
        with PlannerClient(node) as client:
            on_step(f"waiting for {node}")
            client.wait_for_node()
            with _parameters_of(client, run.beginning.settings):
                for message in run.inputs:
                    on_step(f"publishing {message.topic}")
                    client.publish(_TOPICS[message.type_name], _payload_now(message))
                on_step(f"{node} is planning")
                answer = client.plan(**run.beginning.asked)
    except TimeoutError as error:
        raise InputError("--node", "a running planner", f"{node}: {error}") from None
    if answer.success:
        return Ending(True, answer.message, plan_from_message(answer.plan))
    return _failure(run.ending, answer.message)


def _payload_now(message: BagMessage) -> bytes:
    """Return the message's bytes by today's definition; one that cannot be read as it is."""
    if message.definition in ("", definition_of(message.type_name)):
        return message.payload
    try:
        return serialize(message.type_name, fields_of(message.read()))
    except InputError:
        return message.payload


def _failure(recorded: Ending, message: str) -> Ending:
    """Return a failure; as recorded if it differs only in topics, times and strangers."""
    texts = without_unheard(message), recorded.message
    now, then = (_RECEIVED.sub("received", text) for text in texts)
    return Ending(False, recorded.message if now == then else message)


@contextmanager
def _parameters_of(client: PlannerClient, settings: Settings) -> Iterator[None]:
    """Give the node these parameters where its own differ, and restore its own in the end."""
    planning = {declaration.name for declaration in DECLARATIONS if declaration.plans}
    wanted = {name: value for name, value in settings.values if name in planning}
    with ExitStack() as files:
        if settings.lens_tables_text:
            folder = TemporaryDirectory(dir=_data_directory(client))
            file = Path(files.enter_context(folder)) / "lens_tables.yaml"
            file.write_text(settings.lens_tables_text, encoding="utf-8")
            wanted["lens_tables"] = str(file)
        yield from _temporarily_set(client, wanted)


def _data_directory(client: PlannerClient) -> Path:
    """Return a folder of this machine from which the node reads lens tables while it runs."""
    named = client.get_parameters(["data_directories"])["data_directories"] or ""
    for folder in map(Path, named.split(os.pathsep)):
        if folder.is_absolute() and os.access(folder, os.W_OK | os.X_OK):
            return folder
    raise InputError(
        "the node's data_directories",
        "a folder that can be written to, for the run's lens tables",
        repr(named),
        f"start it with -p data_directories:={gettempdir()}, or replay without --live",
    )


def _temporarily_set(client: PlannerClient, wanted: dict[str, Any]) -> Iterator[None]:
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
