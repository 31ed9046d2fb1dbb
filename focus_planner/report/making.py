# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From a plan to a report of it in a file."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subject import PlannedSubject, plan_for_one, requested
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.io.files import atomic_write
from focus_planner.report.assembly import Provenance, assemble, check_samples
from focus_planner.report.comparison import check_methods, plans_to_compare
from focus_planner.report.content import ReportContent
from focus_planner.report.naming import check_report
from focus_planner.report.page import report_page
from focus_planner.report.pictures import Pictures


def save_report(
    plan: FocusPlan,
    scene: Scene,
    rig: Rig,
    path: Path,
    *,
    request: PlanRequest | None = None,
    model: CostModel | None = None,
    compare: Sequence[str] | None = None,
    samples: int | None = None,
    pictures: Pictures | None = None,
    surface: str = "",
    rig_file: str = "",
) -> None:
    """Write a report of a plan: one HTML page that needs nothing else.

    Parameters
    ----------
    plan : FocusPlan
    scene : Scene
    rig : Rig
        That the plan is for. If the plan cannot be for this scene and rig, the report says so.
    path : Path
        Ends in ``.html``; written atomically.
    request : PlanRequest, optional
        That the plan was made for, as other methods are asked too; by default what of it the plan
        tells.
    model : CostModel, optional
        The paper's by default.
    compare : sequence of str, optional
        Methods to compare the plan with; the first is shown beside it. By default those that show
        what it gains.
    samples : int, optional
        Of the surface, to show; by default as many as a page has room for.
    pictures : Pictures, optional
        Of what each camera will see, as
        :func:`~focus_planner.report.thumbnails.camera_pictures` makes them; this takes longer.
    surface, rig_file : str, optional
        Names of the files that it was made from. Of a plan for several subjects, ``surface`` is
        the name of the one whose scene is given.

    Raises
    ------
    InputError
        If a value is out of range, the plan is for other cameras, or the file cannot be written.
    """
    check_report(path)
    if samples is not None:
        check_samples("samples", samples)
    check_methods("compare", compare)
    if plan.subjects:
        plan = plan_for_one(plan, surface)
    subject = PlannedSubject(scene, rig, request or requested(plan, scene), plan, model)
    content = assemble(
        subject,
        tuple(plans_to_compare(subject, compare)),
        Provenance(surface, rig_file, certain=False),
        samples=samples,
        pictures=pictures,
        made=datetime.now().astimezone(),
    )
    write_report(content, path)


def write_report(content: ReportContent, path: Path) -> None:
    """Write a report atomically.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    page = report_page(content).encode()
    with atomic_write(path) as file:
        file.write(page)
