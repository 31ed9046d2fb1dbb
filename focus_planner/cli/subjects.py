# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What reports, previews and masks are about: a recorded run, or a plan with its files."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.compiling import compile_first
from focus_planner.cli.option_rules import check_beside
from focus_planner.cli.progress import Tell, show_share
from focus_planner.cli.surface_options import add_surface_options, read_surface
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import FocusPlan
    from focus_planner.core.planning.subject import PlannedSubject
    from focus_planner.recording.run import Run


@dataclass(frozen=True)
class NamedSubject:
    """A plan, what it was made for, and what to call that.

    Attributes
    ----------
    subject : PlannedSubject
    surface, rig : str
        Names of the files, or of the topics on which a node received them.
    run : Run or None
        The recorded run, if the plan comes from one.
    """

    subject: PlannedSubject
    surface: str
    rig: str
    run: Run | None


def add_subject_options(parser: Any) -> None:
    """Add the options that name a plan and what it was made for."""
    option = parser.add_argument
    option(
        "plan",
        type=Path,
        metavar="RUN|PLAN.JSON",
        help="folder of a recorded run or its .mcap file; or a plan.json, with --surface and --rig",
    )
    option(
        "--surface",
        type=Path,
        metavar="SURFACE",
        help="with PLAN.JSON: the surface that it was made for; with RUN: the same surface, for the"
        " colours or the texture that a run does not have",
    )
    option(
        "--subject",
        metavar="NAME",
        help="of a plan for several surfaces, the one that this is about, by its name in the plan"
        " (default: the one that costs most, or that --surface names; for masks there is none)",
    )
    add_surface_options(parser)
    option("--rig", type=Path, metavar="RIG.YAML", help="with PLAN.JSON: the rig")
    option(
        "--lens-tables",
        type=Path,
        metavar="FILE",
        help="with PLAN.JSON: the lens tables that it was made with",
    )


def load_subject(
    options: argparse.Namespace, tell: Tell, *, must_choose: bool = False
) -> NamedSubject:
    """Read what the options name.

    Parameters
    ----------
    options : argparse.Namespace
    tell : callable
    must_choose : bool
        Whether one of several subjects has to be named; else it is the one that costs most.

    Raises
    ------
    InputError
        If it cannot be read, or the plan is not one for this surface and rig.
    """
    tell("loading the planner")
    if options.plan.suffix.lower() == ".json":
        return _subject_of_files(options, tell)
    return _subject_of_run(options, tell, must_choose)


def _subject_of_run(options: argparse.Namespace, tell: Tell, must_choose: bool) -> NamedSubject:
    from focus_planner.core.planning.work import CLOUDS
    from focus_planner.recording.provenance import input_names
    from focus_planner.recording.run_reading import read_run
    from focus_planner.recording.subject import subject_of

    for name in ("rig", "lens_tables", "importance", "importance_property"):
        if getattr(options, name) is not None:
            flag = f"--{name.replace('_', '-')}"
            raise InputError(
                flag, "a plan.json to use it with", str(options.plan), "a run has its own"
            )
    check_beside(options, "--up", "--surface")
    tell(f"reading {options.plan}")
    run = read_run(options.plan)
    if run.has_clouds:
        compile_first(tell, (CLOUDS,))
    subjects = run.ending.plan.subjects if run.ending and run.ending.plan else ()
    if subjects and must_choose and options.subject is None:
        names = ", ".join(each.surface for each in subjects)
        raise InputError(
            "--subject", "the one of the plan's subjects that the pictures show", "none", names
        )
    subject = subject_of(run, show_share(tell, "preparing the surface"), options.subject)
    if options.surface is not None:
        subject = _with_looks_of(subject, options, tell)
    surface, rig = input_names(run)
    if run.ending and run.ending.plan and run.ending.plan.worst:
        surface = options.subject or run.ending.plan.worst.surface
    return NamedSubject(subject, surface, rig, run)


def _with_looks_of(
    subject: PlannedSubject, options: argparse.Namespace, tell: Tell
) -> PlannedSubject:
    """Return the subject with the colours and the texture that the file has."""
    from dataclasses import replace

    import numpy as np

    from focus_planner.core.surface.scene import Scene
    from focus_planner.core.surface.surface import Mesh, PointCloud

    then, now = subject.scene.surface, read_surface(options, tell)
    pairs: list[tuple[Any, Any]] = []
    looks: dict[str, Any] = {}
    if isinstance(now, Mesh) and isinstance(then, Mesh):
        pairs = [(now.vertices, then.vertices), (now.triangles, then.triangles)]
        looks = {"vertex_colours": now.vertex_colours, "texture": now.texture}
    elif isinstance(now, PointCloud) and isinstance(then, PointCloud):
        pairs = [(now.points, then.points)]
        looks = {"colours": now.colours}
    if not pairs or not all(np.array_equal(a, b) for a, b in pairs):
        raise InputError(
            str(options.surface),
            f"the surface of {options.plan}",
            "another",
            "leave --surface out for the run's own",
        )
    # All else, importance and normals among it, is as it was planned with.
    seen = replace(then, **{name: look for name, look in looks.items() if look is not None})
    return replace(subject, scene=Scene(seen, show_share(tell, f"preparing {options.surface}")))


def _subject_of_files(options: argparse.Namespace, tell: Tell) -> NamedSubject:
    from focus_planner.core.planning.subject import PlannedSubject, plan_for_one, requested
    from focus_planner.core.planning.work import CLOUDS
    from focus_planner.core.surface.scene import Scene
    from focus_planner.core.surface.surface import PointCloud
    from focus_planner.io.lens_tables import load_lens_tables
    from focus_planner.io.plans import load_plan
    from focus_planner.io.rigs import load_rig
    from focus_planner.recording.subject import check_alone

    for name in ("surface", "rig"):
        if getattr(options, name) is None:
            raise InputError(
                f"--{name}",
                f"the {name} that {options.plan} was made for",
                "none",
                "a plan.json has neither surface nor rig; a recorded run has both",
            )
    tell(f"reading {options.plan}")
    plan = load_plan(options.plan)
    rig = load_rig(options.rig)
    if options.lens_tables is not None:
        rig = load_lens_tables(options.lens_tables).apply(rig)
    _check_cameras(options, plan, [camera.name for camera in rig.cameras])
    if plan.subjects:
        plan = plan_for_one(plan, options.subject or options.surface.name)
    else:
        check_alone(options.subject, str(options.plan))
    surface = read_surface(options, tell)
    if isinstance(surface, PointCloud):
        compile_first(tell, (CLOUDS,))
    scene = Scene(surface, show_share(tell, f"preparing {options.surface}"))
    subject = PlannedSubject(scene, rig, requested(plan, scene), plan)
    return NamedSubject(subject, options.surface.name, options.rig.name, None)


def _check_cameras(options: argparse.Namespace, plan: FocusPlan, names: list[str]) -> None:
    planned = [camera.name for camera in plan.cameras]
    if planned == names:
        return
    only = [name for name in planned if name not in names]
    got = (
        f"one without {only[0]}" if only else f"{len(names)} cameras for the plan's {len(planned)}"
    )
    raise InputError(
        str(options.rig), f"the rig of {options.plan}, with its cameras in its order", got
    )
