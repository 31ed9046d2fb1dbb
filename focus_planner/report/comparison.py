# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The plans that a report compares, and what each is worth on the same fresh samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import formulate_problem, leading_part
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.quality import Estimate, estimate_quality
from focus_planner.core.planning.request import METHODS, PlanRequest
from focus_planner.core.planning.sampled_quality import sampled_quality
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.validation import InputError, check_choice
from focus_planner.report.content import CostRow, Shares, SharpRow

AUTOFOCUS = "closest"
_AUTOFOCUS = "autofocus"
_BASELINES = (AUTOFOCUS, "average", "em")
_BEST = "k_view"

# Costs of one plan on one surface and rig differ by no more, of 1000: rays that graze an edge may
# hit on one machine and miss on another.
_SAME_COST = 0.05
_NOTHING = 1e-9
# Costs on different samples of one surface, in standard errors.
_LIKELY = 4.0
# So many sharp views and more are told as one.
_MANY_VIEWS = 5


@dataclass(frozen=True, eq=False)
class ComparedPlan:
    """A plan to compare, for the same surface.

    Attributes
    ----------
    title : str
        "closest (autofocus)".
    called : str
        What it is called in a sentence: "autofocus", "the recorded plan".
    plan : FocusPlan
    rig : Rig
        That it was made for: the cameras of the plan that it is compared with, in the same order,
        with the same or other lenses.
    """

    title: str
    called: str
    plan: FocusPlan
    rig: Rig


@dataclass(frozen=True)
class Worth:
    """What a plan is worth on fresh samples.

    Attributes
    ----------
    cost : Estimate
        1000 × the weighted mean.
    in_focus_area : Estimate
        In focus in the camera that images it best, square metres.
    covered_area : float
        Seen by some camera, square metres.
    counted_area : float
        Of the surface that has any importance, square metres.
    sharp_areas : tuple of SharpArea
        Sharp in at least 1, 2, 3 and 5 views; empty if not told.
    resolution : Resolution or None
        Of what is in focus.
    view_areas : tuple of float
        Seen by some camera and in focus in the pictures of none, of one, of two, ... cameras, the
        last of that many or more; square metres.
    """

    cost: Estimate
    in_focus_area: Estimate
    covered_area: float
    counted_area: float
    view_areas: tuple[float, ...] = ()
    sharp_areas: tuple[SharpArea, ...] = ()
    resolution: Resolution | None = None


def shares_of(worth: Worth, area: float) -> Shares:
    """Return what becomes of a surface of this area, square metres."""
    sharp, seen = worth.in_focus_area.value, worth.covered_area
    blurred, unseen = (
        # What is left by rounding of sums is no surface.
        part if part > _NOTHING * area else 0.0
        for part in (seen - sharp, worth.counted_area - seen)
    )
    views = tuple(each / area for each in worth.view_areas)
    return Shares(sharp / area, blurred / area, unseen / area, views)


def title_of(plan: FocusPlan) -> str:
    """Return a plan's method, and what that stands for: "closest (autofocus)"."""
    if plan.method == AUTOFOCUS:
        return f"{plan.method} (autofocus)"
    proven = plan.method == "optimal" and plan.converged
    return f"{plan.method} (proven)" if proven else plan.method


def called(method: str) -> str:
    """Return what a method's plan is called in a sentence."""
    return _AUTOFOCUS if method == AUTOFOCUS else method


def usual_comparisons(method: str) -> tuple[str, ...]:
    """Return the methods that show what a method's plan gains, or what it leaves to gain.

    The first is autofocus; for autofocus itself, the default method.
    """
    others = [each for each in _BASELINES if each != method]
    return (_BEST, *others) if method == AUTOFOCUS else tuple(others)


def check_methods(argument: str, compare: Iterable[str] | None) -> None:
    """Raise unless these are methods.

    Raises
    ------
    InputError
        Names one that is not.
    """
    for method in compare or ():
        check_choice(argument, method, METHODS)


def plans_to_compare(
    subject: PlannedSubject,
    compare: Sequence[str] | None = None,
    on_progress: Callable[[str], ProgressCallback] = lambda _: never_stop,
    argument: str = "compare",
) -> Iterator[ComparedPlan]:
    """Yield other methods' plans for the same request, made anew.

    Parameters
    ----------
    subject : PlannedSubject
    compare : sequence of str, optional
        The methods; by default those that show what the plan gains.
    on_progress : callable, optional
        Returns, for a method, the callback to call after every step.
    argument : str
        What the user calls the methods.

    Raises
    ------
    InputError
        If one of them is the plan's own method, or cannot plan for the request.
    """
    own = subject.plan.method
    methods = usual_comparisons(own) if compare is None else tuple(dict.fromkeys(compare))
    if own in methods:
        raise InputError(argument, "methods other than the plan's own", repr(own))
    for method in methods:
        plan = subject.with_method(method, on_progress(method))
        yield ComparedPlan(title_of(plan), called(method), plan, subject.rig)


def own_worth(plan: FocusPlan, found: Worth) -> Worth:
    """Return what a plan says of itself, and beyond that what was found."""
    if plan.sharp_areas:  # older plans do not tell
        found = replace(found, sharp_areas=plan.sharp_areas, resolution=plan.resolution)
    return replace(
        found,
        cost=Estimate(plan.fresh_cost, plan.fresh_standard_error),
        in_focus_area=Estimate(plan.in_focus_area, plan.in_focus_standard_error),
        covered_area=plan.covered_area,
    )


def worth_of(plans: Sequence[ComparedPlan], subject: PlannedSubject) -> list[Worth]:
    """Return what plans are worth on the fresh samples that the subject's plan was estimated on."""
    request = _with_samples_told(subject)
    problems: dict[int, Problem] = {}
    found = []
    for each in plans:
        rig = id(each.rig)
        if rig not in problems:
            fresh = formulate_problem(subject.scene, each.rig, request, subject.model, fresh=True)
            # A plan that ran out of time has fewer of them than it asked for.
            problems[rig] = leading_part(fresh, subject.plan.fresh_samples)
        problem = with_shots(problems[rig], each.plan.shots)
        quality = estimate_quality(problem, each.plan.focus_distances, each.rig)
        found.append(
            Worth(
                cost=quality.cost,
                in_focus_area=quality.in_focus_area,
                covered_area=quality.covered_area.value,
                counted_area=float(problem.samples.areas.sum()),
                view_areas=_view_areas(problem, each.plan.focus_distances),
                sharp_areas=quality.sharp_areas,
                resolution=quality.resolution,
            )
        )
    return found


def _view_areas(problem: Problem, focus: FloatArray) -> tuple[float, ...]:
    quality = sampled_quality(problem, focus)
    seen = quality.picture >= 0
    views = np.minimum(quality.views[seen], _MANY_VIEWS)
    areas = problem.samples.areas[seen]
    return tuple(np.bincount(views, weights=areas, minlength=_MANY_VIEWS + 1).tolist())


def _with_samples_told(subject: PlannedSubject) -> PlanRequest:
    """Return the request for one shot, with the numbers of samples that it came down to."""
    request, plan = subject.request, subject.plan
    chosen = not request.samples and isinstance(subject.scene.surface, Mesh)
    fresh = plan.fresh_samples if chosen else request.fresh_samples
    return replace(request, shots=1, samples=plan.samples, fresh_samples=fresh)


def is_cut_short(plan: FocusPlan) -> bool:
    """Return whether a plan is for fewer samples than were asked for."""
    return any(note.code == "budget" for note in plan.notes)


def other_inputs(plan: FocusPlan, rig: Rig, now: Worth) -> Note | None:
    """Return a note if a plan is probably not one for the surface and rig that are at hand.

    Parameters
    ----------
    plan : FocusPlan
    rig : Rig
    now : Worth
        On the surface and rig at hand.
    """
    planned = [camera.device_unit for camera in plan.cameras]
    if planned != [lens.table and lens.table.unit for lens in (c.lens for c in rig.cameras)]:
        return Note(
            "other_inputs",
            "the plan's device values are not those of this rig's lens tables: what is said of how"
            " lenses can be set is not for the lenses that it was made for; give the rig and the"
            " lens tables that it was made with, or report on a recorded run, which has them",
        )
    allowed = _SAME_COST
    if is_cut_short(plan):
        # It was estimated on the first of more fresh samples, which are not drawn by themselves.
        errors = (plan.fresh_standard_error**2 + now.cost.standard_error**2) ** 0.5
        allowed = _LIKELY * errors
    if abs(now.cost.value - plan.fresh_cost) <= allowed:
        return None
    return Note(
        "other_inputs",
        f"the plan says that its cost on fresh samples is {plan.fresh_cost:.1f}, and on this"
        f" surface and rig it is {now.cost.value:.1f}: the surface, the rig, its lens tables or the"
        " importance are probably not those that the plan was made for, and what is shown is how"
        " its distances would do here, but for the samples that cameras were planned to hold;"
        " give those that it was made for, or report on a recorded"
        " run, which has them",
    )


def find_autofocus(plans: Sequence[ComparedPlan]) -> int | None:
    """Return which of the plans is that of autofocus; None if none is."""
    return next((i for i, each in enumerate(plans) if each.called == _AUTOFOCUS), None)


def cost_rows(
    plans: Sequence[ComparedPlan], worths: Sequence[Worth], area: float, *, foreign: bool
) -> tuple[CostRow, ...]:
    """Return a row per plan, the dearest first, and one of the lower bound.

    Parameters
    ----------
    plans, worths
        That the report is about first.
    area : float
        Of the surface, square metres.
    foreign : bool
        Whether that plan was made for something else: its own costs do not hold here.
    """
    return tuple(_rows(plans, worths, area, foreign=foreign))


def _chosen_samples(plan: FocusPlan) -> tuple[int, int]:
    return plan.samples, plan.seed


def _measure(plan: FocusPlan) -> tuple[int, float]:
    return plan.views, plan.max_mm_per_pixel


def sharp_rows(
    plans: Sequence[ComparedPlan], worths: Sequence[Worth], area: float
) -> tuple[SharpRow, ...]:
    """Return, plan by plan, how much is sharp in how many views, and how finely it is imaged.

    Parameters
    ----------
    plans, worths
        That the report is about first.
    area : float
        Of the surface, square metres.
    """
    return tuple(
        SharpRow(
            title=each.title,
            shares=tuple(
                (sharp.views, sharp.area / area, sharp.standard_error / area)
                for sharp in worth.sharp_areas
            ),
            resolution=worth.resolution,
            reported=number == 0,
        )
        for number, (each, worth) in enumerate(zip(plans, worths, strict=True))
    )


def _rows(
    plans: Sequence[ComparedPlan], worths: Sequence[Worth], area: float, *, foreign: bool
) -> Iterator[CostRow]:
    autofocus = find_autofocus(plans)
    usual = None if autofocus is None else worths[autofocus].cost.value
    order = sorted(range(len(plans)), key=lambda i: -worths[i].cost.value)
    for i in order:
        plan, worth = plans[i].plan, worths[i]
        change = worth.cost.value / usual - 1 if usual and i != autofocus else None
        yield CostRow(
            title=plans[i].title,
            cost=None if foreign and i == 0 else plan.cost,
            fresh_cost=worth.cost.value,
            standard_error=worth.cost.standard_error,
            in_focus_share=worth.in_focus_area.value / area,
            change=change,
            reported=i == 0,
            other_samples=_chosen_samples(plan) != _chosen_samples(plans[0].plan),
            other_measure=_measure(plan) != _measure(plans[0].plan),
        )
    bound, images = plans[0].plan.lower_bound, plans[0].plan.images
    if bound is not None and not foreign:
        # Plans beside it may have more pictures, and so cost less.
        pictures = f", {images} picture{'s' * (images > 1)}" if images else ""
        yield CostRow(title=f"lower bound{pictures}", cost=bound)
