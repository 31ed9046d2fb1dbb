"""Restoring the plan that was in force when a planner ended, from its recorded runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import yaml

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import PLAN
from focus_planner.recording.bag import METADATA, read_bag
from focus_planner.recording.retention import runs_newest_first

# How many runs to search for a published plan.
_MAX_RUNS = 1000
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


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


def last_plan(directory: Path, planner: str) -> LastPlan | None:
    """Return the newest plan that a planner published and recorded; None if there is none.

    Truncated runs are searched too: a plan is written to the file before it is published.

    Parameters
    ----------
    directory : Path
        The parent of the runs' folders.
    planner : str
        The planner's full name.

    Raises
    ------
    OSError
        If the directory exists but cannot be read.
    """
    if not directory.is_dir():
        return None
    topic = f"{planner}/focus_plan"
    for run in runs_newest_first(directory)[:_MAX_RUNS]:
        message = _plan_of(run, topic)
        if message is not None:
            return LastPlan(message, run)
    return None


def _plan_of(run: Path, topic: str) -> Message | None:
    """Return the plan published in a run; None if there is none or it cannot be read."""
    if not _may_hold(run, topic):
        return None
    try:
        messages = read_bag(run).messages
        plans = [m for m in messages if (m.topic, m.type_name) == (topic, PLAN)]
        return plans[-1].read() if plans else None
    except (InputError, OSError):
        return None


def _may_hold(run: Path, topic: str) -> bool:
    """Return whether a run has messages of a topic, or its metadata cannot tell."""
    try:
        text = (run / METADATA).read_text(encoding="utf-8")
        topics = yaml.load(text, _Loader)["rosbag2_bagfile_information"][  # noqa: S506
            "topics_with_message_count"
        ]
        return any(each["topic_metadata"]["name"] == topic for each in topics)
    except (OSError, ValueError, yaml.YAMLError, LookupError, TypeError):
        return True
