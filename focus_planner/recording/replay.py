"""Planning a recorded run again, as it was or with changes, and comparing the two."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from functools import partial
from itertools import zip_longest

from focus_planner.core.planning.fingerprint import Fingerprint, fingerprints
from focus_planner.core.planning.plan import CameraFocus, FocusPlan, SolvedPlan
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import Progress, ProgressCallback, never_stop
from focus_planner.core.validation import InputError
from focus_planner.recording.run import Ending, Run
from focus_planner.runtime.log import SilentLog
from focus_planner.runtime.planner import NotReady, Planner, internal_error

# What differs from run to run.
_SECONDS = ("solve_seconds", "total_seconds")


@dataclass(frozen=True)
class Replayed:
    """What planning a run again came to.

    Attributes
    ----------
    ending : Ending
    progress : tuple of Progress
    plan : SolvedPlan or None
        The ending's, with its problem.
    rig : Rig or None
        What the plan is for.
    """

    ending: Ending
    progress: tuple[Progress, ...]
    plan: SolvedPlan | None = None
    rig: Rig | None = None


@dataclass(frozen=True)
class Difference:
    """Where two runs of the same begin to differ, or an effect of it.

    Attributes
    ----------
    stage : str
        A fingerprint's, "steps", "plan" or "outcome".
    what : str
        How much, in a few words.
    """

    stage: str
    what: str


def plan_run(
    run: Run, on_progress: ProgressCallback = never_stop, *, as_it_was: bool = True
) -> Replayed:
    """Plan what a run asks for, on the inputs that it had.

    Parameters
    ----------
    run : Run
        A partial one too.
    on_progress : callable, optional
    as_it_was : bool
        Whether the plan ends where it ended then, whatever its time budget; else where the budget
        ends it now.
    """
    ended = run.ending is not None and run.ending.success and as_it_was
    stop_log = run.ending.stop_log if run.ending and ended else None
    progress: list[Progress] = []

    def noted(step: Progress) -> bool:
        progress.append(step)
        return on_progress(step)

    beginning, settings = run.beginning, run.beginning.settings
    planner = Planner(SilentLog(), warm_start=beginning.warm_start)
    _feed(planner, run)
    try:
        plan, rig, _ = planner.plan(
            beginning.request,
            settings.optics,
            settings.model,
            noted,
            warm_start=beginning.warm_start is not None,
            stop_log=stop_log,
        )
    except (InputError, NotReady) as error:
        return Replayed(Ending(False, str(error)), tuple(progress))
    except Exception as error:  # noqa: BLE001 - it may be what the run was recorded for
        return Replayed(Ending(False, internal_error(error)), tuple(progress))
    ending = Ending(True, "", plan, plan.stop_log, fingerprints(plan))
    return Replayed(ending, tuple(progress), plan, rig)


def differences(run: Run, replayed: Replayed) -> list[Difference]:
    """Return how a replay differs from what was recorded, bit for bit; nothing if it does not.

    The first that is returned is where the two begin to differ.
    """
    assert run.ending is not None
    outcomes = outcome_differences(run, replayed.ending)
    if run.ending.plan is None or replayed.plan is None:
        return outcomes
    return [
        *_of_fingerprints(run.ending.fingerprints, replayed.ending.fingerprints),
        *_of_steps(run, replayed.progress),
        *outcomes,
    ]


def outcome_differences(run: Run, now: Ending) -> list[Difference]:
    """Return how another outcome of a run's request differs, whatever it came from."""
    assert run.ending is not None
    if run.ending.plan is None or now.plan is None:
        return list(_of_outcomes(run.ending, now))
    return list(_of_plans(run.ending.plan, now.plan))


def _feed(planner: Planner, run: Run) -> None:
    """Let a planner receive what was recorded."""
    # Where there are two of a kind the older is in force, and the newer was refused beside it,
    # whatever came between.
    arrivals: list[tuple[int, datetime, Callable[[], None]]] = [
        *((k, a.at, partial(planner.surface.receive, a)) for k, a in enumerate(run.surfaces())),
        *((k, a.at, partial(planner.rig.receive, a)) for k, a in enumerate(run.rigs())),
    ]
    for _, _, receive in sorted(arrivals, key=lambda arrival: arrival[:2]):
        receive()
        planner.digest(run.beginning.settings.optics)


# --- comparing ---------------------------------------------------------------------------------


def _of_outcomes(recorded: Ending, now: Ending) -> Iterator[Difference]:
    if recorded.success or now.success or recorded.message != now.message:
        told = [
            f"a plan of cost {e.plan.cost:.2f}" if e.plan else e.message for e in (recorded, now)
        ]
        yield Difference("outcome", f"recorded: {told[0]}; now: {told[1]}")


def _of_fingerprints(
    recorded: Sequence[Fingerprint], now: Sequence[Fingerprint]
) -> Iterator[Difference]:
    again = {fingerprint.stage: fingerprint for fingerprint in now}
    for before in recorded:
        after = again.get(before.stage)
        if after is None:
            yield Difference(before.stage, "no such stage now")
        elif after != before:
            yield Difference(before.stage, _how_much(before, after))


def _how_much(before: Fingerprint, after: Fingerprint) -> str:
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


def _of_steps(run: Run, now: Sequence[Progress]) -> Iterator[Difference]:
    """Yield the first step that differs."""
    recorded, again = _numbered(run.progress), _numbered(now)
    if run.ending and run.ending.stop_log.stopped:
        # A watch that had said no was told of no more steps.
        again = again[: len(recorded)]
    none = (0, None)
    for (here, before), (there, after) in zip_longest(recorded, again, fillvalue=none):
        if _bits(before) != _bits(after):
            what = f"step {here or there}: {_step(before)} then, {_step(after)} now"
            yield Difference("steps", what)
            return


def _numbered(steps: Sequence[Progress]) -> list[tuple[int, Progress | None]]:
    """Return the steps and their numbers, without those that earlier runs were not told of."""
    return [(number, step) for number, step in enumerate(steps, 1) if step.stage != "cells"]


def _bits(step: Progress | None) -> object:
    if step is None:
        return None
    # NaN is equal to NaN here.
    return step.stage, step.iteration, repr(step.cost), repr(step.lower_bound)


def _step(step: Progress | None) -> str:
    if step is None:
        return "none"
    bound = "" if step.lower_bound is None else f", bound {step.lower_bound!r}"
    return f"{step.stage} {step.iteration} of cost {step.cost!r}{bound}"


def _of_plans(recorded: FocusPlan, now: FocusPlan) -> Iterator[Difference]:
    names = [each.name for each in fields(FocusPlan) if each.name not in (*_SECONDS, "cameras")]
    values = [(name, getattr(recorded, name), getattr(now, name)) for name in names]
    changed = [f"{name} {a!r} then, {b!r} now" for name, a, b in values if a != b]
    if changed:
        yield Difference("plan", "; ".join(changed))
    if recorded.cameras != now.cameras:
        yield Difference("focus", _how_far(recorded.cameras, now.cameras))


def _how_far(recorded: Sequence[CameraFocus], now: Sequence[CameraFocus]) -> str:
    if [c.name for c in recorded] != [c.name for c in now]:
        return "other cameras"
    changed = [(a, b) for a, b in zip(recorded, now, strict=True) if a != b]
    moved = [(abs(b.focus_distance - a.focus_distance), a.name) for a, b in changed]
    farthest, name = max(moved)
    how_many = f"{len(changed)} of {len(recorded)} cameras"
    if not farthest:
        return f"{how_many}, at the same distances"
    return f"{how_many}; the farthest, {name}, by {1000 * farthest:.3g} mm"
