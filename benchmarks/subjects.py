# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""One plan for many subjects: on those that it was made for, and on others.

Takes twelve bodies: BODIES=folder. A plan from half of them is judged on the other half, beside
autofocus on each and a plan of each one's own. In a booth all stand alike, so the same is done with
twelve bodies in one pose: the first of them, in the heights and volumes of all.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, rig
from focus_planner import Mesh, PlanRequest, Scene, SolvedPlan, Subject, plan_focus
from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.presets import plan_presets
from focus_planner.core.planning.quality import Quality, estimate_quality
from focus_planner.core.problem.problem import Problem

_BODIES = 12
_REPEATS = 3
_REQUEST = PlanRequest(samples=4096, fresh_samples=20_000)
_ASKED_IN_FOCUS, _AUTOFOCUS = 0.755, 0.49
_ASKED_GAP, _ASKED_SECONDS = 0.008, 2.0


@dataclass(frozen=True)
class _Subjects:
    """Scenes by name, and the problems on which plans for them are judged."""

    scenes: dict[str, Scene]
    fresh: dict[str, Problem]

    @classmethod
    def of(cls, scenes: dict[str, Scene]) -> _Subjects:
        judging = replace(_REQUEST, seed=1)
        fresh = {
            name: formulate_problem(scene, rig(), judging, fresh=True)
            for name, scene in scenes.items()
        }
        return cls(scenes, fresh)

    def given(self, names: Sequence[str]) -> list[Subject]:
        return [Subject(self.scenes[name], name) for name in names]

    def mean(self, names: Sequence[str], focus: Callable[[str], FloatArray]) -> float:
        """Return the share of the surface in focus, the mean of some subjects."""
        shares = []
        for name in names:
            fresh = self.fresh[name]
            quality: Quality = estimate_quality(fresh, focus(name))
            shares.append(quality.in_focus_area.value / fresh.samples.areas.sum())
        return float(np.mean(shares))


def run(console: Console) -> None:
    """Print the tables."""
    scenes = dict(list(body_scenes().items())[:_BODIES])
    if len(scenes) < _BODIES:
        console.print(f"subjects: takes {_BODIES} bodies, not {len(scenes)}; BODIES=folder of them")
        return
    varied = _Subjects.of(scenes)
    names = list(scenes)
    halves = names[:6], names[6:]
    both = halves, halves[::-1]
    table = Table("what", "asked", "measured", title="One plan for six subjects")
    plans = _in_focus(table, varied, both, "", asked=True)
    _bounds(table, plans)
    _seconds(table, varied.given(halves[0]))
    _worst(table, varied, halves[0])
    _presets(table, varied, names)
    _in_focus(table, _Subjects.of(_in_one_pose(scenes)), both, "in one pose: ", asked=False)
    console.print(table)


def _in_focus(
    table: Table,
    subjects: _Subjects,
    both: Sequence[tuple[list[str], list[str]]],
    where: str,
    *,
    asked: bool,
) -> list[SolvedPlan]:
    """Add rows of what is in focus on subjects that a plan was not made for; return the plans."""
    own = _focus_of_each(subjects, "k_view")
    autofocus = _focus_of_each(subjects, "closest")
    plans, taped = [], []
    for made_for, judged_on in both:
        plan = plan_focus(subjects.given(made_for), rig(), _REQUEST)
        plans.append(plan)
        taped.append(subjects.mean(judged_on, lambda _, plan=plan: plan.focus_distances))
        table.add_row(
            f"{where}in focus, from {made_for[0]} … {made_for[-1]} on {judged_on[0]} …",
            "",
            f"{taped[-1]:.1%}",
        )
    wanted = f"at least {_ASKED_IN_FOCUS:.1%}" if asked else ""
    table.add_row(f"{where}in focus, mean of both", wanted, f"{np.mean(taped):.1%}")
    names = list(subjects.scenes)
    known = f"{_AUTOFOCUS:.0%}" if asked else ""
    table.add_row(f"{where}autofocus on each", known, f"{subjects.mean(names, autofocus):.1%}")
    table.add_row(f"{where}a plan of each one's own", "", f"{subjects.mean(names, own):.1%}")
    return plans


def _focus_of_each(subjects: _Subjects, method: str) -> Callable[[str], FloatArray]:
    request = replace(_REQUEST, method=method, bound="none")
    found = {
        name: plan_focus(scene, rig(), request).focus_distances
        for name, scene in subjects.scenes.items()
    }
    return found.__getitem__


def _bounds(table: Table, plans: Sequence[SolvedPlan]) -> None:
    quick = max(plan.gap or 0.0 for plan in plans)
    table.add_row("gap to the quick bound, the larger", "", f"{quick:.2%}")


def _seconds(table: Table, subjects: Sequence[Subject]) -> None:
    tight = plan_focus(subjects, rig(), replace(_REQUEST, bound="tight"))
    table.add_row("gap to the tight bound", f"at most {_ASKED_GAP:.1%}", f"{tight.gap:.2%}")
    request = replace(_REQUEST, fresh_samples=4096)
    plans, processor = [], []
    for _ in range(_REPEATS):
        began = time.process_time()
        plans.append(plan_focus(subjects, rig(), request))
        processor.append(time.process_time() - began)
    seconds = float(np.median([plan.total_seconds for plan in plans]))
    solving = float(np.median([plan.solve_seconds for plan in plans]))
    table.add_row(
        "seconds with rays and quick bound, median",
        f"at most {_ASKED_SECONDS:g}",
        f"{seconds:.2f}, of which solving {solving:.2f}",
    )
    # What it takes of a machine that others share.
    table.add_row("the same, of processors", "", f"{float(np.median(processor)):.2f}")


def _worst(table: Table, subjects: _Subjects, names: Sequence[str]) -> None:
    given, request = subjects.given(names), replace(_REQUEST, bound="tight")
    for title, worst in (("mean", False), ("worst", True)):
        plan = plan_focus(given, rig(), replace(request, worst=worst))
        costs = [each.cost for each in plan.subjects]
        gap = f", gap {plan.gap:.2%}" if worst else ""
        text = f"worst {max(costs):.1f}, mean {np.mean(costs):.1f}{gap}"
        table.add_row(f"costs of a plan for the {title}", "", text)


def _presets(table: Table, subjects: _Subjects, names: Sequence[str]) -> None:
    for count in (1, 2, 3):
        presets = plan_presets(subjects.given(names), rig(), count, _REQUEST)
        table.add_row(f"cost of twelve with {count} preset(s)", "", f"{presets.cost:.1f}")


# --- one pose ------------------------------------------------------------------------------------


def _in_one_pose(scenes: dict[str, Scene]) -> dict[str, Scene]:
    """Return the first body in the height and the volume of each."""
    first = next(iter(scenes.values())).surface
    assert isinstance(first, Mesh)
    posed = {}
    for name, scene in scenes.items():
        mesh = scene.surface
        assert isinstance(mesh, Mesh)
        taller = _height(mesh) / _height(first)
        wider = np.sqrt(_volume(mesh) / _volume(first) / taller)
        scaled = first.vertices * np.array([wider, wider, taller])
        posed[name] = Scene(Mesh(scaled, first.triangles))
    return posed


def _height(mesh: Mesh) -> float:
    return float(np.ptp(mesh.vertices[:, 2]))


def _volume(mesh: Mesh) -> float:
    """Return the volume within a closed mesh, by the divergence theorem."""
    corners = mesh.vertices[mesh.triangles]
    return float(np.linalg.det(corners).sum() / 6)
