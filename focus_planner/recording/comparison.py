# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Comparison of two plans for the same surface, and what of them can be compared."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from focus_planner.core.planning.plan import FocusPlan
from focus_planner.recording.run import Run


@dataclass(frozen=True)
class Comparable:
    """Which of two plans' estimates are on the same samples.

    Attributes
    ----------
    samples : bool
        Those that the plans were made on, and their costs and bounds are.
    fresh_samples : bool
        Those that no solver has seen.
    measure : bool
        Whether costs mean the same: for as many views, and with as coarse a resolution counted as
        seen. If not, no costs compare.
    """

    samples: bool
    fresh_samples: bool
    measure: bool = True

    def sentence(self, before: FocusPlan, after: FocusPlan) -> str:
        """Return what has to be said of the plans' costs; empty if they simply compare."""
        if not self.measure:
            return (
                f"The costs are {measure_text(before)} then, {measure_text(after)} now, and do not"
                " compare; the areas that are sharp in as many views do."
            )
        if self.samples and self.fresh_samples:
            return ""
        change = after.fresh_cost - before.fresh_cost
        errors = math.hypot(before.fresh_standard_error, after.fresh_standard_error)
        how = "within" if abs(change) <= errors else "more than"
        which = "on the same" if self.fresh_samples else "on different"
        told = (
            f"{change:+.2f} {which} fresh samples, which is {how} their standard errors"
            f" ({errors:.2f} together)."
        )
        if self.samples:
            return f"The fresh costs: {told}"
        return f"The costs are on different samples and do not compare. The fresh costs do: {told}"


def comparable(before: Run, after: Run) -> Comparable:
    """Return what of two runs with plans for the same surface can be compared."""
    plans = [run.ending.plan for run in (before, after) if run.ending and run.ending.plan]
    return Comparable(
        _alike(before, after, ""),
        _alike(before, after, "fresh "),
        same_measure(plans),
    )


def same_measure(plans: Sequence[FocusPlan]) -> bool:
    """Return whether the costs of plans mean the same, whatever samples they are on."""
    return len({(plan.views, plan.max_mm_per_pixel) for plan in plans}) <= 1


def measure_text(plan: FocusPlan) -> str:
    """Return what a plan's costs are for: 'for 3 views'."""
    views = f"for {plan.views} view{'s' * (plan.views > 1)}"
    if math.isinf(plan.max_mm_per_pixel):
        return views
    return f"{views} of at most {plan.max_mm_per_pixel:g} mm per pixel"


def _alike(before: Run, after: Run, prefix: str) -> bool:
    """Return whether samples are the same: by their fingerprints, or by how they were chosen.

    Fingerprints alone would not do: estimated normals differ in their last bits on other machines.
    """
    prints, chosen = [], []
    for run in (before, after):
        assert run.ending is not None
        assert run.ending.plan is not None
        plan, request, values = (
            run.ending.plan,
            run.beginning.request,
            run.beginning.settings.values,
        )
        prints.append(
            [each for each in run.ending.fingerprints if each.stage == f"{prefix}samples"]
        )
        count = plan.fresh_samples if prefix else plan.samples
        # Of 0 samples those of a cloud are its own points.
        kind = "" if prefix else request.samples == 0
        chosen.append((count, plan.seed, kind, dict(values).get("importance_field")))
    return bool(prints[0] and prints[0] == prints[1]) or chosen[0] == chosen[1]


@dataclass(frozen=True)
class CameraChange:
    """A camera whose focus distance differs between two plans.

    Attributes
    ----------
    name : str
    before, after : float
        Focus distances, metres.
    from_sensor_before, from_sensor_after : float or None
        The same from the sensor, metres; None where the plan does not tell it.
    samples_before, samples_after : int
        Numbers of assigned samples.
    """

    name: str
    before: float
    after: float
    samples_before: int
    samples_after: int
    from_sensor_before: float | None = None
    from_sensor_after: float | None = None

    @property
    def moved(self) -> float:
        """The absolute change of focus distance, metres."""
        return abs(self.after - self.before)


def camera_changes(before: FocusPlan, after: FocusPlan) -> list[CameraChange]:
    """Return the changes of the cameras that take pictures in both plans, the largest first."""
    # What a lens rests at whose camera takes no picture does not matter.
    now = {camera.name: camera for camera in after.cameras if camera.shots}
    changes = [
        CameraChange(
            camera.name,
            camera.focus_distance,
            now[camera.name].focus_distance,
            camera.assigned_samples,
            now[camera.name].assigned_samples,
            camera.from_sensor,
            now[camera.name].from_sensor,
        )
        for camera in before.cameras
        if camera.shots
        and camera.name in now
        and camera.focus_distance != now[camera.name].focus_distance
    ]
    return sorted(changes, key=lambda change: (-change.moved, change.name))


def median_moved(changes: list[CameraChange]) -> float:
    """Return the median absolute change of focus distance, metres."""
    return float(np.median([change.moved for change in changes]))


def quantities(plan: FocusPlan) -> Iterator[tuple[str, float | str | bool | None, str]]:
    """Yield the quantities to compare plans by: name, value, and unit or error."""
    yield "method", plan.method, ""
    yield "samples", plan.samples, ""
    yield "views", plan.views, ""
    yield "pictures", plan.pictures, ""
    yield "cost", plan.cost, ""
    yield "lower_bound", plan.lower_bound, ""
    yield "fresh_cost", plan.fresh_cost, f"± {plan.fresh_standard_error:.2f}"
    yield "covered_area", plan.covered_area, "m²"
    yield "in_focus_area", plan.in_focus_area, f"± {plan.in_focus_standard_error:.3f} m²"
    for sharp in plan.sharp_areas:
        name = f"sharp in {sharp.views} view{'s' * (sharp.views > 1)}"
        yield name, sharp.area, f"± {sharp.standard_error:.3f} m²"
    if plan.resolution:
        yield "median_resolution", plan.resolution.median, "mm/px"
        yield "90th_percentile", plan.resolution.percentile_90, "mm/px"
    yield "converged", plan.converged, ""
    yield "solve_seconds", plan.solve_seconds, "s"
    yield "total_seconds", plan.total_seconds, "s"
