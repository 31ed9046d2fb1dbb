"""Comparison of two plans for the same surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from focus_planner.core.planning.plan import FocusPlan


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
    """Return the changes of the cameras that both plans have, the largest first."""
    now = {camera.name: camera for camera in after.cameras}
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
        if camera.name in now and camera.focus_distance != now[camera.name].focus_distance
    ]
    return sorted(changes, key=lambda change: (-change.moved, change.name))


def median_moved(changes: list[CameraChange]) -> float:
    """Return the median absolute change of focus distance, metres."""
    return float(np.median([change.moved for change in changes]))


def quantities(plan: FocusPlan) -> Iterator[tuple[str, float | str | bool | None, str]]:
    """Yield the quantities to compare plans by: name, value, and unit or error."""
    yield "method", plan.method, ""
    yield "samples", plan.samples, ""
    yield "cost", plan.cost, ""
    yield "lower_bound", plan.lower_bound, ""
    yield "fresh_cost", plan.fresh_cost, f"± {plan.fresh_standard_error:.2f}"
    yield "covered_area", plan.covered_area, "m²"
    yield "in_focus_area", plan.in_focus_area, f"± {plan.in_focus_standard_error:.3f} m²"
    yield "converged", plan.converged, ""
    yield "solve_seconds", plan.solve_seconds, "s"
    yield "total_seconds", plan.total_seconds, "s"
