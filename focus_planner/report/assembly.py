# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From a plan, what it was made for and what it is compared with to all that a report says."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from focus_planner.core.planning.plan_text import for_views
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_one_shot
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.text import printable
from focus_planner.core.validation import check_whole
from focus_planner.io.lens_sheet.content import LensSheet, decimals_of, lens_sheet
from focus_planner.report.comparison import (
    ComparedPlan,
    called,
    cost_rows,
    is_cut_short,
    other_inputs,
    own_worth,
    shares_of,
    sharp_rows,
    title_of,
    worth_of,
)
from focus_planner.report.content import ReportContent, ReportedPlan, SampledSurface, Shares, Step
from focus_planner.report.pictures import PICTURED_PLANS, Pictures, longest_side
from focus_planner.report.rounding import floored, millimetres
from focus_planner.report.sampling import depth_histograms, report_plan, sample_surface
from focus_planner.report.verdict import verdict

#: Samples of the surface, unless asked for otherwise, or many cameras see each of them.
SAMPLES = 16_384
#: Fewer show no surface; more are more than a browser turns at ease.
FEWEST_SAMPLES, MOST_SAMPLES = 100, 262_144

# Most of a page are pairs of a sample and a camera that sees it: samples are cut down to so many
# pairs, but not below what shows the surface well. The last are samples that tell how many pairs.
_PAIRS, _LEAST, _TRIED = 1_500_000, 4096, 1024

# What the lens sheet tells of a plan's quality, which is not that of its distances elsewhere.
_OF_QUALITY = ("fresh cost", "in focus", "sharp", "resolution")


@dataclass(frozen=True)
class Provenance:
    """Where a plan comes from, as far as that is known.

    Attributes
    ----------
    surface, rig : str
        Names of the files, or of the topics on which a node received them.
    planned : datetime or None
    run : str
        The id of the recorded run.
    changed : str
        How the plan differs from the recorded one: ``f_number=8``.
    steps : tuple of Step
    parameters, software : tuple
        Of the planner: names and values, names and versions.
    certain : bool
        Whether the surface and the rig are known to be those that the plan was made for. Otherwise
        the report checks whether they can be.
    """

    surface: str = ""
    rig: str = ""
    planned: datetime | None = None
    run: str = ""
    changed: str = ""
    steps: tuple[Step, ...] = ()
    parameters: tuple[tuple[str, Any], ...] = ()
    software: tuple[tuple[str, str], ...] = ()
    certain: bool = True


def check_samples(argument: str, samples: int) -> None:
    """Raise unless a report can show this many samples.

    Raises
    ------
    InputError
        Says how many it can.
    """
    check_whole(argument, samples, FEWEST_SAMPLES, MOST_SAMPLES)


def assemble(
    subject: PlannedSubject,
    compared: Sequence[ComparedPlan] = (),
    provenance: Provenance | None = None,
    *,
    samples: int | None = None,
    pictures: Pictures | None = None,
    made: datetime | None = None,
    tell: Callable[[str], object] = lambda _: None,
) -> ReportContent:
    """Return all that a report says of a plan.

    All plans are evaluated on the same samples, on which none of them was made. What is said of a
    plan as a whole is what the plan says of itself.

    Parameters
    ----------
    subject : PlannedSubject
    compared : sequence of ComparedPlan
        The first is shown beside the plan.
    provenance : Provenance, optional
    samples : int, optional
        Of the surface; by default as many as a page has room for, at most ``SAMPLES``.
    pictures : Pictures, optional
        Of what each camera will see; without them, the report shows none.
    made : datetime, optional
        When the report is made.
    tell : callable, optional
        Called with a short phrase before each part.

    Raises
    ------
    InputError
        If the number of samples is out of range, or the plan is for other cameras.
    """
    if samples is None:
        samples = _fitting_samples(subject)
    check_samples("samples", samples)
    provenance = provenance or Provenance()
    plan, rig = subject.plan, subject.rig
    sheet = lens_sheet(
        plan, rig, surface=provenance.surface, rig_file=provenance.rig, made=provenance.planned
    )
    plans = (ComparedPlan(title_of(plan), called(plan.method), plan, rig), *compared)
    tell("comparing plans on fresh samples")
    worths = worth_of(plans, subject)
    doubt = None if provenance.certain else other_inputs(plan, rig, worths[0])
    if doubt is None:
        worths[0] = own_worth(plan, worths[0])
    notes = (*filter(None, [doubt]), *plan.notes)
    tell(f"finding what the cameras see of {samples} samples")
    problem = with_one_shot(subject.fresh_problem(samples))
    request = subject.request
    surface = sample_surface(
        problem, subject.model, request.depth_tolerance, request.max_mm_per_pixel
    )
    foreign, area = doubt is not None, subject.scene.area
    shares = [shares_of(worth, area) for worth in worths]
    return ReportContent(
        title=_title(provenance.surface, len(rig)),
        verdict=verdict(plans, worths, notes, area, foreign=foreign),
        notes=notes,
        facts=(
            *_facts(sheet, provenance, subject, compared=bool(compared), foreign=foreign),
            *_of_report(provenance, subject, surface, pictures, made),
        ),
        rig=rig,
        surface=surface,
        plans=tuple(_reported(subject, plans, shares, problem, surface, pictures, tell)),
        costs=cost_rows(plans, worths, area, foreign=foreign),
        sharp=sharp_rows(plans, worths, area),
        steps=provenance.steps,
        sheet=sheet,
        histograms=depth_histograms(problem),
        parameters=provenance.parameters,
        decimals=max(decimals_of(each.plan) for each in plans),
        software=(*provenance.software, ("report made with", f"focus_planner {_version()}")),
    )


def _fitting_samples(subject: PlannedSubject) -> int:
    if SAMPLES * len(subject.rig) <= _PAIRS:
        return SAMPLES
    tried = subject.fresh_problem(_TRIED)
    each = len(tried.camera_index) / max(len(tried.samples), 1) / tried.shots
    return max(_LEAST, min(SAMPLES, int(_PAIRS / max(each, 1.0))))


def _reported(
    subject: PlannedSubject,
    plans: Sequence[ComparedPlan],
    shares: Sequence[Shares],
    problem: Problem,
    surface: SampledSurface,
    pictures: Pictures | None,
    tell: Callable[[str], object],
) -> Iterator[ReportedPlan]:
    side = longest_side(len(subject.rig))
    for number, each in enumerate(plans):
        own = each.rig is subject.rig
        theirs = subject if own else replace(subject, rig=each.rig)
        seen = problem if own else with_one_shot(theirs.fresh_problem(len(surface.points)))
        reported = report_plan(each.title, each.plan, seen, surface)
        lenses = () if own else tuple(camera.lens for camera in each.rig.cameras)
        reported = replace(reported, shares=shares[number], lenses=lenses)
        if pictures is not None and number < PICTURED_PLANS:
            tell(f"making pictures of {each.title}")
            made = tuple(pictures.make(theirs, each.plan, side))
            reported = replace(reported, pictures=made)
        yield reported


def _title(surface: str, cameras: int) -> str:
    """Return the title: topics, which runs of a node have for names, say nothing in it."""
    if surface and not surface.startswith("/"):
        return f"Focus plan for {printable(surface)}"
    return "Focus plan for 1 camera" if cameras == 1 else f"Focus plan for {cameras} cameras"


def _facts(
    sheet: LensSheet,
    provenance: Provenance,
    subject: PlannedSubject,
    *,
    compared: bool,
    foreign: bool,
) -> Iterator[tuple[str, str]]:
    """Yield what was planned, and what came of it."""
    plan = subject.plan
    yield "surface", ", ".join(filter(None, [printable(provenance.surface), _size(subject)]))
    for name, text in sheet.facts:
        if name != "surface" and not (foreign and name in _OF_QUALITY):
            yield name, text
        if name == "method" and plan.lower_bound is not None and not foreign:
            yield (
                "cost",
                f"{plan.cost:.1f}{for_views(plan)} on these, and no plan costs less"
                + (f" than {floored(plan.lower_bound)}" if plan.gap else ""),
            )
    if compared and subject.request.time_budget < math.inf:
        others = "had all the time they needed"
        yield "other plans", f"{others}; this one had {subject.request.time_budget:g} s"
    elif compared and not provenance.certain and is_cut_short(plan):
        yield "other plans", f"judged on {plan.fresh_samples} fresh samples, but not the same ones"


def _of_report(
    provenance: Provenance,
    subject: PlannedSubject,
    surface: SampledSurface,
    pictures: Pictures | None,
    made: datetime | None,
) -> Iterator[tuple[str, str]]:
    """Yield what the report shows, and where that comes from."""
    shown = f"{len(surface.points):,} samples that no plan was made on, seed {subject.request.seed}"
    yield "shown", f"{shown}, drawn by area, about {millimetres(surface.spacing)} apart"
    if pictures is not None and pictures.about:
        yield "pictures", printable(pictures.about)
    if provenance.run:
        yield "recorded run", printable(provenance.run)
    if provenance.changed:
        yield "changed", printable(provenance.changed)
    if made is not None:
        yield "report made", f"{made:%Y-%m-%d %H:%M}"


def _size(subject: PlannedSubject) -> str:
    """Return what tells a surface from another, as far as a line has room for it."""
    surface, area = subject.scene.surface, subject.scene.area
    if isinstance(surface, Mesh):
        return f"{len(surface.triangles):,} triangles, {area:.3g} m²"
    return f"{len(surface.points):,} points, about {area:.3g} m²"


def _version() -> str:
    try:
        return version("focus_planner")
    except PackageNotFoundError:
        return "not installed as a package"
