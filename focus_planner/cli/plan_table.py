# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A plan's quality as a table on the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, TextIO

from focus_planner.cli.best_so_far import CUT_SHORT

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import FocusPlan, Shot, SolvedPlan


def print_summary(which: str, plan: SolvedPlan, stream: TextIO, interrupted: str) -> None:
    """Print a plan's quality.

    Parameters
    ----------
    which : str
        What the title begins with.
    plan : SolvedPlan
    stream : TextIO
    interrupted : str
        What Ctrl-C did to it.
    """
    from focus_planner.cli.subject_table import print_subjects
    from focus_planner.cli.tables import console_for, new_table

    table = new_table(title=f"{which}{plan.method}, {len(plan.cameras)} cameras")
    table.add_column()
    table.add_column(justify="right")
    table.add_column()
    for name, value, note in _summary(plan, interrupted):
        table.add_row(name, value, note)
    console = console_for(stream)
    console.print(table)
    if plan.subjects:
        print_subjects(plan.subjects, console)


def _summary(plan: SolvedPlan, interrupted: str) -> Iterator[tuple[str, str, str]]:
    """Yield rows: name, value, note."""
    from collections import Counter

    from focus_planner.core.planning.plan_text import for_views, unfinished

    def area(part: float) -> str:
        return f"{part:.3f} m²"

    def share(part: float) -> str:
        return f"{part / plan.surface_area:.1%} of the surface"

    whose = f"{'worst' if plan.is_for_worst else 'mean'} of {len(plan.subjects)} subjects, "
    on = f"{whose if len(plan.subjects) > 1 else ''}on {plan.samples} samples"
    yield "cost", f"{plan.cost:.2f}", f"of 1000{for_views(plan)}, {on}, seed {plan.seed}"
    if plan.lower_bound is not None and plan.gap is not None:
        note = f"no plan costs less on these samples: within {100 * plan.gap:.3g} % of the best"
        yield "lower bound", f"{plan.lower_bound:.2f}", note
    fresh = f"{plan.fresh_cost:.2f} ± {plan.fresh_standard_error:.2f}"
    yield "fresh cost", fresh, f"on {plan.fresh_samples} samples unseen by the solver"
    average = "of a subject on average" if plan.subjects else ""
    yield "surface", area(plan.surface_area), average
    yield "seen", area(plan.covered_area), share(plan.covered_area)
    in_focus = f"{plan.in_focus_area:.3f} ± {area(plan.in_focus_standard_error)}"
    yield "in focus", in_focus, f"{share(plan.in_focus_area)}, in its best view"
    yield from _sharpness(plan)
    early = "stopped early by Ctrl-C" if interrupted == CUT_SHORT else unfinished(plan)
    yield "solved in", f"{plan.solve_seconds:.3f} s", "" if plan.converged else early
    yield "total", f"{plan.total_seconds:.3f} s", ""
    if plan.images:
        used = sum(bool(camera.shots) for camera in plan.cameras)
        most = f"of at most {plan.images}, by {used} of {len(plan.cameras)} cameras"
        yield "pictures", str(plan.pictures), most
    elif plan.shots > 1:
        used = sum(shot.assigned_samples > 0 for camera in plan.cameras for shot in camera.shots)
        yield "shots", str(plan.shots * len(plan.cameras)), f"{used} in use"
    values: dict[str, list[float]] = {}
    for shot, unit in ((s, c.device_unit) for c in plan.cameras for s in c.shots):
        if unit is not None and shot.device_value is not None:
            values.setdefault(unit, []).append(shot.device_value)
    for unit, told in values.items():
        yield "lenses", f"{min(told):g} to {max(told):g}", unit
    shots = [shot for camera in plan.cameras for shot in camera.shots]
    yield "focused at", _span([shot.focus_distance for shot in shots]), _from_sensor(shots)
    for status, count in sorted(Counter(c.status for c in plan.cameras).items()):
        yield "cameras", str(count), status.name.lower().replace("_", " ")


def _sharpness(plan: FocusPlan) -> Iterator[tuple[str, str, str]]:
    """Yield what is sharp in how many views, and how finely what is in focus is imaged."""
    for sharp in plan.sharp_areas:
        name = f"in {sharp.views} view{'s' * (sharp.views > 1)}"
        area = f"{sharp.area:.3f} ± {sharp.standard_error:.3f} m²"
        share = f"{sharp.area / plan.surface_area:.1%} of the surface"
        yield name, area, f"{share}, sharp in so many or more"
    if plan.resolution is not None:
        note = f"median of what is in focus; 90% at {plan.resolution.percentile_90:.3g} or finer"
        yield "resolution", f"{plan.resolution.median:.3g} mm/px", note


def _span(metres: Sequence[float]) -> str:
    return f"{min(metres):.3f} to {max(metres):.3f} m"


def _from_sensor(shots: Sequence[Shot]) -> str:
    marked = [shot.from_sensor for shot in shots if shot.from_sensor is not None]
    return f"from the centre of projection; {_span(marked)} from the sensor" if marked else ""
