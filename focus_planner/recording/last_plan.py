# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Finding the plan that was in force when a planner ended, among runs that anyone may have made.

A run that cannot be read, or whose plan can be none of the planner's, is skipped and told of. All
work together is bounded, whatever the runs hold, so that none keeps a planner from starting.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.io.files import open_regular
from focus_planner.messages.plan_checking import check_plan
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import PLAN, RUN
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.bag_reading import RUNS, BagReading, Limits
from focus_planner.recording.folders import RunFolder, runs_newest_first
from focus_planner.recording.naming import A_RUN, METADATA

# How many runs to search for a published plan.
_MAX_RUNS = 1000
_MIB = 2**20
# A plan for 20,000 cameras takes 6 MB, and is in a chunk of its own if it is large: larger ones,
# with surfaces in them, are passed over.
_MAX_PLAN = 32 * _MIB
# Surfaces may be of any size that is recorded; they do not matter here.
_LIMITS = Limits(piece=2 * _MAX_PLAN, unpacked=1024 * _MIB, records=300_000, passed_over=RUNS.piece)
# Of all runs together, in bytes unpacked: some seconds.
_MAX_COST = 4096 * _MIB
_MAX_METADATA = _MIB
_MAX_WHY = 300  # characters
# What is in every bag's metadata.yaml. The file is not parsed: that there is the name of a topic in
# it can be told without, and it may be made to harm a parser.
_OF_METADATA = ("rosbag2_bagfile_information:", "topics_with_message_count:")


@dataclass(frozen=True)
class LastPlan:
    """A published plan.

    Attributes
    ----------
    message : FocusPlan message
    run : Path
        The folder of its run.
    """

    message: Message
    run: Path


@dataclass(frozen=True)
class Skipped:
    """A run that may have held the last plan, and why it was not read.

    Attributes
    ----------
    run : Path
        Its folder.
    why : str
        One line.
    """

    run: Path
    why: str


@dataclass(frozen=True)
class Search:
    """The result of a search for the last plan.

    Attributes
    ----------
    plan : LastPlan or None
    skipped : tuple of Skipped
        Runs newer than the plan's, the newest first.
    """

    plan: LastPlan | None
    skipped: tuple[Skipped, ...] = ()


def last_plan(
    directory: Path, planner: str, check: Callable[[Message], None] = lambda _: None
) -> Search:
    """Return the newest plan that a planner published and recorded, if there is one.

    Runs that were cut off are searched too: a plan is written to the file before it is published.

    Parameters
    ----------
    directory : Path
        The parent of the runs' folders.
    planner : str
        The planner's full name.
    check : callable, optional
        Raises ``InputError`` for a plan that cannot be put in force here.

    Raises
    ------
    OSError
        If the directory exists but cannot be read.
    """
    if not directory.is_dir():
        return Search(None)
    topic = f"{planner}/focus_plan"
    skipped: list[Skipped] = []
    budget = _Budget()
    for run in runs_newest_first(directory)[:_MAX_RUNS]:
        try:
            message = _plan_of(run, topic, budget)
            if message is not None:
                check(message)
                return Search(LastPlan(message, run.path), tuple(skipped))
        except InputError as error:
            skipped.append(Skipped(run.path, str(error)[:_MAX_WHY]))
        except Exception as error:  # noqa: BLE001 - no run may keep a planner from starting
            skipped.append(Skipped(run.path, f"internal error: {error!r}"[:_MAX_WHY]))
        if budget.left <= 0:
            skipped.append(Skipped(run.path, "older runs were not searched: these took too long"))
            break
    return Search(None, tuple(skipped))


def publishers_in(run: RunFolder) -> set[str]:
    """Return the full names of the planners that published a plan in a run.

    Raises
    ------
    InputError
        If the run cannot be read.
    """
    topics: dict[str, set[str]] = {PLAN: set(), RUN: set()}
    for message in _messages(run, lambda _, kind: kind in topics, _Budget()):
        topics[message.type_name].add(message.topic)
    planners = {topic.removesuffix("/run") for topic in topics[RUN]}
    return {planner for planner in planners if f"{planner}/focus_plan" in topics[PLAN]}


class _Budget:
    """How much work is left."""

    def __init__(self) -> None:
        self.left = _MAX_COST


def _plan_of(run: RunFolder, topic: str, budget: _Budget) -> Message | None:
    """Return the plan published in a run, None if there is none.

    Raises
    ------
    InputError
        If the run cannot be read, or the plan cannot be one of a planner.
    """
    if run.fault:
        raise InputError(str(run.path), "the folder of a run", run.fault)
    if not _may_hold(run, topic):
        return None
    last: BagMessage | None = None
    for message in _messages(run, lambda *of: of == (topic, PLAN), budget):
        last = message
    if last is None:
        return None
    if len(last.payload) > _MAX_PLAN:
        raise InputError(
            str(run.path), f"a plan of at most {_MAX_PLAN:,} bytes", f"{len(last.payload):,}"
        )
    plan = last.read()
    if plan.plan_id != run.name:
        raise InputError("plan_id", f"the name of the run, {run.name}", repr(plan.plan_id))
    check_plan(plan)
    return plan


def _messages(
    run: RunFolder, wanted: Callable[[str, str], bool], budget: _Budget
) -> Iterator[BagMessage]:
    """Yield messages of a run; raise in the end if anything but an early end is wrong with it."""
    if run.is_partial and not run.file_size:
        return
    limits = replace(_LIMITS, unpacked=max(min(_LIMITS.unpacked, budget.left), 0))
    with open_regular(run.file, A_RUN, limits.file, may_be_empty=True) as stream:
        reading = BagReading(stream, limits, wanted)
        yield from reading
    budget.left -= reading.cost
    if reading.fault and not reading.cut_off:
        raise InputError(str(run.file), "a recorded run", reading.fault)


def _may_hold(run: RunFolder, topic: str) -> bool:
    """Return whether a run has messages of a topic, or there are no metadata to tell.

    Raises
    ------
    InputError
        If the metadata are not those of a bag.
    """
    path = run.path / METADATA
    if run.is_partial or not path.exists():
        return True
    with open_regular(path, "the metadata of a bag", _MAX_METADATA) as file:
        text = file.read().decode(errors="replace")
    if not all(part in text for part in _OF_METADATA):
        raise InputError(str(path), "the metadata of a bag", "something else")
    return topic in text
