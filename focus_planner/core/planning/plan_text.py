# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A plan in words: what ``print(plan)`` shows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import FocusPlan
    from focus_planner.core.planning.sharp_views import Resolution, SharpArea
    from focus_planner.core.planning.subject_quality import SubjectQuality

# Of cameras, where they are not what a status is called.
_WORDS = {"SEES_NOTHING": "seeing nothing", "DROPPED": "taking no picture"}


def plan_text(plan: FocusPlan) -> str:
    """Return a plan in a few lines: its quality, and what its cameras have to do."""
    rows = list(_rows(plan))
    width = max(len(name) for name, _ in rows)
    return "\n".join([_title(plan), *(f"  {name:<{width}}  {text}" for name, text in rows)])


def plan_line(plan: FocusPlan) -> str:
    """Return what a plan is in one line."""
    return (
        f"<{type(plan).__name__}: {plan.method}, {_cameras(plan)}, cost {plan.cost:.1f}"
        f"{for_views(plan)} on {plan.samples} samples, {plan.fresh_cost:.1f} ±"
        f" {plan.fresh_standard_error:.1f} on {plan.fresh_samples} fresh ones>"
    )


def for_views(plan: FocusPlan) -> str:
    """Return what is said of a cost for several views; nothing of one for one view."""
    return f" for {plan.views} views" if plan.views > 1 else ""


def _title(plan: FocusPlan) -> str:
    return f"{plan.method} plan for {_cameras(plan)}{unfinished(plan, ', ')}"


def unfinished(plan: FocusPlan, before: str = "") -> str:
    """Return why a plan is not what was asked for, after ``before``; nothing if it is."""
    if plan.converged:
        return ""
    # Of these it is the gap that may be missed without anyone's stopping the search.
    only_bounded = plan.method == "optimal" and (plan.images > 0 or plan.is_for_worst)
    return before + ("not proven to be within the gap" if only_bounded else "stopped early")


def _cameras(plan: FocusPlan) -> str:
    count = len(plan.cameras)
    shots = f" of {plan.shots} shots" if plan.shots > 1 else ""
    if plan.images:
        shots = f", {plan.pictures} picture{'s' * (plan.pictures != 1)}"
    return f"{count} camera{'s' * (count != 1)}{shots}"


def _rows(plan: FocusPlan) -> Iterator[tuple[str, str]]:
    """Yield rows: name, text."""
    whose = for_views(plan)
    if len(plan.subjects) > 1:
        whose += f", {'worst' if plan.is_for_worst else 'mean'} of {len(plan.subjects)} subjects"
    yield "cost", f"{plan.cost:.2f} of 1000{whose}, on {plan.samples} samples, seed {plan.seed}"
    bound = "none sought"
    if plan.lower_bound is not None and plan.gap is not None:
        bound = f"{plan.lower_bound:.2f}: within {100 * plan.gap:.3g} % of the best"
    yield "lower bound", bound
    fresh = f"{plan.fresh_cost:.2f} ± {plan.fresh_standard_error:.2f}"
    yield "fresh cost", f"{fresh}, on {plan.fresh_samples} samples unseen by the solver"
    seen = _share(plan.covered_area, plan)
    yield "seen", f"{plan.covered_area:.3f} m²{seen} of the surface"
    in_focus = f"{plan.in_focus_area:.3f} ± {plan.in_focus_standard_error:.3f} m²"
    yield "in focus", f"{in_focus}{_share(plan.in_focus_area, plan)}"
    if plan.sharp_areas:
        yield "sharp views", ", ".join(_sharp(sharp, plan) for sharp in plan.sharp_areas)
    if plan.resolution:
        yield "resolution", resolution_text(plan.resolution)
    if plan.worst is not None and len(plan.subjects) > 1:
        yield "worst", f"{plan.worst.surface}: {worst_in_words(plan.worst)}"
    statuses = sorted(Counter(camera.status for camera in plan.cameras).items())
    words = (
        f"{count} {_WORDS.get(status.name, status.name.lower())}" for status, count in statuses
    )
    yield "cameras", ", ".join(words) or "none"
    distances = [shot.focus_distance for camera in plan.cameras for shot in camera.shots]
    yield "focused at", f"{min(distances):.3f} to {max(distances):.3f} m" if distances else "none"
    yield "time", f"{plan.total_seconds:.3f} s, of which {plan.solve_seconds:.3f} s solving"
    codes = ", ".join(dict.fromkeys(note.code for note in plan.notes))
    yield "notes", f"{len(plan.notes)}: {codes}" if codes else "none"


def resolution_text(resolution: Resolution) -> str:
    """Return how finely what is in focus is imaged."""
    return (
        f"{resolution.median:.3g} mm per pixel in the median,"
        f" {resolution.percentile_90:.3g} or finer for 90% of it"
    )


def _sharp(sharp: SharpArea, plan: FocusPlan) -> str:
    if not plan.surface_area:
        return f"{sharp.views}+ {sharp.area:.3f} ± {sharp.standard_error:.3f} m²"
    share, error = sharp.area / plan.surface_area, sharp.standard_error / plan.surface_area
    return f"{sharp.views}+ {100 * share:.1f} ± {error:.1%}"


def worst_in_words(worst: SubjectQuality) -> str:
    """Return what a plan is worth for the subject that costs most."""
    in_focus = f", {worst.in_focus_area / worst.surface_area:.1%} in focus"
    return (
        f"{worst.fresh_cost:.2f} ± {worst.fresh_standard_error:.2f} on fresh samples"
        f"{in_focus if worst.surface_area else ''}"
    )


def _share(area: float, plan: FocusPlan) -> str:
    return f", {area / plan.surface_area:.1%}" if plan.surface_area else ""
