# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Replaying recorded runs, unchanged or with changes, and comparing the results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from datetime import datetime
from functools import partial
from itertools import zip_longest

from focus_planner.core.planning.fingerprint import Fingerprint, fingerprints
from focus_planner.core.planning.plan import CameraFocus, FocusPlan, SolvedPlan
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.recording.run import Ending, Run
from focus_planner.runtime.log import SilentLog
from focus_planner.runtime.planner import NotReady, Planner, internal_error

# These differ from run to run.
_SECONDS = ("solve_seconds", "total_seconds")
# What older versions did not tell of a plan.
_NOT_TOLD_BEFORE = ("sharp_areas", "resolution")


@dataclass(frozen=True)
class Replayed:
    """The result of replaying a run.

    Attributes
    ----------
    ending : Ending
    progress : tuple of Progress
    plan : SolvedPlan or None
        The ending's plan with its problem.
    rig : Rig or None
        The rig that the plan is for.
    """

    ending: Ending
    progress: tuple[Progress, ...]
    plan: SolvedPlan | None = None
    rig: Rig | None = None


@dataclass(frozen=True)
class Difference:
    """A difference between a run and its replay.

    Attributes
    ----------
    stage : str
        A fingerprint's stage, "steps", "plan", "focus" or "outcome".
    what : str
        A short description.
    """

    stage: str
    what: str


def plan_run(
    run: Run,
    on_progress: ProgressCallback = never_stop,
    on_preparing: Callable[[float], object] = lambda _: None,
    *,
    stop_as_recorded: bool = True,
) -> Replayed:
    """Plan a run again, with its request and inputs.

    Parameters
    ----------
    run : Run
        May be incomplete.
    on_progress : callable, optional
        Called after every step; return False to stop.
    on_preparing : callable, optional
        Called with the share that is done, 0 to 1, while a surface is made ready.
    stop_as_recorded : bool
        Whether planning stops at the recorded step; else when the time budget runs out.
    """
    ended = run.ending is not None and run.ending.success and stop_as_recorded
    stop_log = run.ending.stop_log if run.ending and ended else None
    progress: list[Progress] = []

    def record_step(step: Progress) -> bool:
        if step.is_part_of_a_plan:
            progress.append(step)
        return on_progress(step)

    beginning, settings = run.beginning, run.beginning.settings
    planner = Planner(SilentLog(), on_preparing=on_preparing, warm_start=beginning.warm_start)
    feed(planner, run)
    try:
        plan, rig, _ = planner.plan(
            beginning.request,
            settings.model,
            record_step,
            warm_start=beginning.warm_start is not None,
            min_change=settings.min_change,
            stop_log=stop_log,
            limits=run.resources,
            known_as=beginning.subjects,
        )
    except (InputError, NotReady) as error:
        return Replayed(Ending(False, str(error)), tuple(progress))
    except Exception as error:  # noqa: BLE001 - the run may have been recorded to reproduce it
        return Replayed(Ending(False, internal_error(error)), tuple(progress))
    ending = Ending(True, "", plan, plan.stop_log, fingerprints(plan))
    return Replayed(ending, tuple(progress), plan, rig)


def differences(run: Run, replayed: Replayed) -> list[Difference]:
    """Return how a replay differs from the recorded run, bit for bit; empty if it does not.

    Differences are in the order of planning: the first is where the two begin to differ.
    """
    assert run.ending is not None
    outcomes = outcome_differences(run, replayed.ending)
    if run.ending.plan is None or replayed.plan is None:
        return outcomes
    return [
        *_fingerprint_differences(run.ending.fingerprints, replayed.ending.fingerprints),
        *_step_differences(run, replayed.progress),
        *outcomes,
    ]


def outcome_differences(run: Run, now: Ending) -> list[Difference]:
    """Return how an outcome, of a replay or a running node, differs from the recorded one."""
    assert run.ending is not None
    found = [
        *_outcome_differences(run.ending, now),
        *_plan_differences(run.ending.plan, now.plan),
    ]
    return found or list(_message_differences(run.ending))


def feed(planner: Planner, run: Run) -> None:
    """Let the planner receive the recorded inputs."""
    # Of two inputs of a kind, the older is in force and the newer was rejected, whatever arrived
    # in between.
    arrivals: list[tuple[int, datetime, Callable[[], None]]] = [
        *((k, a.at, partial(planner.surface.receive, a)) for k, a in enumerate(run.surfaces())),
        *((k, a.at, partial(planner.rig.receive, a)) for k, a in enumerate(run.rigs())),
    ]
    settings = run.beginning.settings
    planner.digest(settings.optics, settings.subjects)
    for _, _, receive in sorted(arrivals, key=lambda arrival: arrival[:2]):
        receive()
        planner.digest(settings.optics, settings.subjects)


# --- comparing ---------------------------------------------------------------------------------


def _outcome_differences(recorded: Ending, now: Ending) -> Iterator[Difference]:
    alike = (recorded.success, bool(recorded.plan)) == (now.success, bool(now.plan))
    if not alike or (not now.success and recorded.message != now.message):
        texts = f"recorded: {_outcome_text(recorded)}; now: {_outcome_text(now)}"
        yield Difference("outcome", texts)


def _message_differences(recorded: Ending) -> Iterator[Difference]:
    """Yield a difference if a message is of another plan; what-ifs are recorded without any."""
    if recorded.plan is None or not recorded.message:
        return
    # Older versions did not mention notes.
    told = recorded.plan.summary().partition("; see its notes")[0]
    if told not in recorded.message:
        yield Difference("outcome", f"recorded: {recorded.message}; of the plan: {told}")


def _outcome_text(ending: Ending) -> str:
    if not ending.plan:
        return f"success without a plan: {ending.message}" if ending.success else ending.message
    plan = f"a plan of cost {ending.plan.cost:.2f}"
    return plan if ending.success else f"{ending.message}, beside {plan}"


def _fingerprint_differences(
    recorded: Sequence[Fingerprint], now: Sequence[Fingerprint]
) -> Iterator[Difference]:
    again = {fingerprint.stage: fingerprint for fingerprint in now}
    for before in recorded:
        after = again.get(before.stage)
        if after is None:
            yield Difference(before.stage, "no such stage now")
        elif after != before:
            yield Difference(before.stage, _extent(before, after))


def _extent(before: Fingerprint, after: Fingerprint) -> str:
    totals = f"{sum(before.counts)} then, {sum(after.counts)} now"
    if len(before.digests) == 1:
        return f"not the same bits; {totals}"
    pairs = zip_longest(
        zip(before.counts, before.digests, strict=True),
        zip(after.counts, after.digests, strict=True),
    )
    cameras = sum(one != other for one, other in pairs)
    what = "see other samples" if before.stage.endswith("visibility") else "have other costs"
    return f"{cameras} of {len(before.counts)} cameras {what}; pairs: {totals}"


def _step_differences(run: Run, now: Sequence[Progress]) -> Iterator[Difference]:
    """Yield the first step that differs."""
    recorded, again = _comparable_steps(run.progress), _comparable_steps(now)
    if run.ending and run.ending.stop_log.stopped:
        # Once stopped, the recorded run's callback was not called any more.
        again = again[: len(recorded)]
    none = (0, None)
    for (here, before), (there, after) in zip_longest(recorded, again, fillvalue=none):
        if _comparable(before) != _comparable(after):
            what = f"step {here or there}: {_step_text(before)} then, {_step_text(after)} now"
            yield Difference("steps", what)
            return


def _comparable_steps(steps: Sequence[Progress]) -> list[tuple[int, Progress | None]]:
    """Return the numbered steps without those that older versions did not record."""
    return [(number, step) for number, step in enumerate(steps, 1) if step.stage != "cells"]


def _comparable(step: Progress | None) -> object:
    if step is None:
        return None
    # By their texts, so that NaN equals NaN.
    return step.stage, step.iteration, repr(step.cost), repr(step.lower_bound)


def _step_text(step: Progress | None) -> str:
    if step is None:
        return "none"
    bound = "" if step.lower_bound is None else f", bound {step.lower_bound!r}"
    return f"{step.stage} {step.iteration} of cost {step.cost!r}{bound}"


def _plan_differences(recorded: FocusPlan | None, now: FocusPlan | None) -> Iterator[Difference]:
    if recorded is None or now is None:
        return
    apart = {*_SECONDS, "notes", "cameras"}
    if not (recorded.sharp_areas and now.sharp_areas):
        apart |= {*_NOT_TOLD_BEFORE}
    names = [f.name for f in fields(FocusPlan) if f.name not in apart]
    values = [(name, getattr(recorded, name), getattr(now, name)) for name in names]
    changed = [f"{name} {a!r} then, {b!r} now" for name, a, b in values if a != b]
    if changed:
        yield Difference("plan", "; ".join(changed))
    before, after = _told_by_both(recorded.cameras, now.cameras)
    if before != after:
        yield Difference("focus", _focus_extent(before, after))


def _told_by_both(
    recorded: Sequence[CameraFocus], now: Sequence[CameraFocus]
) -> tuple[Sequence[CameraFocus], Sequence[CameraFocus]]:
    """Return the cameras without their distances from the sensor, unless both plans tell these.

    Older versions did not. They follow from the distances and the lenses in any case.
    """
    plans = recorded, now
    if all(any(camera.from_sensor is not None for camera in plan) for plan in plans):
        return plans
    return tuple(map(_without_from_sensor, recorded)), tuple(map(_without_from_sensor, now))


def _without_from_sensor(camera: CameraFocus) -> CameraFocus:
    shots = tuple(replace(shot, from_sensor=None) for shot in camera.shots)
    return replace(camera, shots=shots, from_sensor=None)


def _focus_extent(recorded: Sequence[CameraFocus], now: Sequence[CameraFocus]) -> str:
    if [c.name for c in recorded] != [c.name for c in now]:
        return "other cameras"
    changed = [(a, b) for a, b in zip(recorded, now, strict=True) if a != b]
    moved = [(abs(b.focus_distance - a.focus_distance), a.name) for a, b in changed]
    farthest, name = max(moved)
    how_many = f"{len(changed)} of {len(recorded)} cameras"
    if not farthest:
        return f"{how_many}, at the same distances"
    return f"{how_many}; the farthest, {name}, by {1000 * farthest:.3g} mm"
