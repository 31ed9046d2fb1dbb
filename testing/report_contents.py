# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Contents of reports, of real plans for small and large scenes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from focus_planner import CameraIntrinsics, PlanRequest, cylinder_rig, plan_focus
from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.io.lens_sheet.content import lens_sheet
from focus_planner.report.content import (
    CostRow,
    DepthHistogram,
    ReportContent,
    ReportedPlan,
    SampledSurface,
    Step,
)
from testing.problems import around, body, looking_at, merged, sphere

DISTORTED = CameraIntrinsics(
    640, 480, 420.0, 420.0, 319.5, 239.5, "plumb_bob", (-0.21, 0.06, 0.001, -0.0007, 0.0)
)
_FISHEYE = CameraIntrinsics(
    640, 480, 300.0, 300.0, 319.5, 239.5, "equidistant", (0.02, -0.004, 0.001, 0.0)
)
_TITLES = {"closest": "closest (autofocus)"}
_BINS = 32


@cache
def small(samples: int = 600) -> ReportContent:
    """Two spheres, one of which hides some of the other, and 12 cameras of several kinds."""
    surface = merged(sphere(0.25), sphere(0.09, (0.0, -0.36, 0.05)))
    rig = around(12, 1.0, height=0.35)
    cameras = [
        replace(each, intrinsics=_FISHEYE if k % 4 == 1 else DISTORTED)
        for k, each in enumerate(rig.cameras)
    ]
    away = replace(cameras[-1], name="looks_away", orientation=(0.0, 0.0, 0.0, 1.0))
    return content_of(Scene(surface), Rig((*cameras[:-1], away)), samples)


@cache
def real(samples: int = 16_384) -> ReportContent:
    """A body in the paper's rig."""
    return content_of(Scene(body("arms_out")), cylinder_rig(), samples)


def made_large(
    samples: int = 65_536, cameras: int = 1_000, squarely: float = 0.985
) -> ReportContent:
    """Samples of a sphere and many cameras around it; the plans are made up, the geometry is not.

    A pair is one of a camera and a sample that faces it almost squarely, by this cosine: of what a
    convex surface has in its picture, the middle.
    """
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(samples, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = 0.3 * normals
    angles = 2 * np.pi * np.arange(cameras) / 25
    heights = np.linspace(-0.4, 0.4, cameras)
    places = np.stack([np.cos(angles), np.sin(angles), heights], axis=1)
    rig = Rig(
        tuple(
            looking_at(f"c{k}", place, (0.0, 0.0, 0.0)) for k, place in enumerate(places.tolist())
        )
    )
    towards = (places / np.linalg.norm(places, axis=1)[:, None]).astype(np.float32)
    sample, camera = np.nonzero(normals.astype(np.float32) @ towards.T > squarely)
    depth = ((places[camera] - points[sample]) * towards[camera]).sum(axis=1)
    counts = np.bincount(sample, minlength=samples)
    areas = np.full(samples, 4 * np.pi * 0.3**2 / samples)
    held = depth < 0.75
    views = np.bincount(sample[held], minlength=samples)
    first = np.concatenate([[0], np.cumsum(counts)])
    best = np.where(counts > 0, camera[np.minimum(first[:-1], len(camera) - 1)], -1)
    template = small()
    focus = template.plans[0].plan.cameras[0]
    plan = replace(
        template.plans[0].plan,
        cameras=tuple(replace(focus, name=each.name) for each in rig.cameras),
    )
    reported = ReportedPlan(
        title="made up",
        plan=plan,
        cost=np.where(best < 0, 1.0, 0.4 + 0.3 * (views == 0)),
        camera=best.astype(np.int32),
        in_focus=views > 0,
        sharp_views=views.astype(np.int32),
        pair_in_focus=held,
        held_area=np.bincount(camera[held], minlength=cameras) * areas[0],
    )
    surface = SampledSurface(
        points=points,
        normals=normals,
        areas=areas,
        importance=None,
        spacing=float(np.sqrt(areas[0])),
        pair_offsets=first,
        pair_camera=camera.astype(np.int32),
        pair_depth=depth,
        pair_cost=np.full(len(depth), 0.4),
        focus_weight=1 / 3,
    )
    return replace(
        template,
        rig=rig,
        surface=surface,
        plans=(reported, replace(reported, title="the same")),
        sheet=lens_sheet(plan, rig),
        histograms=(template.histograms[0],) * cameras,
    )


def content_of(scene, rig, samples, methods=("k_view", "closest"), shots=1) -> ReportContent:
    """The content of a report on plans by several methods, the first being what it is about."""
    fresh = PlanRequest(fresh_samples=samples)
    once = formulate_problem(scene, rig, fresh, by="area", fresh=True)
    steps = []
    request = PlanRequest(samples=min(samples, 4096), shots=shots, fresh_samples=min(samples, 4096))
    plans = [
        plan_focus(
            scene, rig, replace(request, method=each), on_progress=_noting(steps if not k else [])
        )
        for k, each in enumerate(methods)
    ]
    reported = tuple(_reported(once, plan) for plan in plans)
    first = plans[0]
    areas = once.samples.areas
    share = float(areas[reported[0].in_focus].sum() / areas.sum())
    return ReportContent(
        title="arms_out.ply, 168 cameras" if len(rig) == 168 else f"{len(rig)} cameras",
        verdict=(
            f"{share:.0%} of the surface is in focus in the camera that images it best; autofocus"
            f" reaches {_share(once, reported[-1]):.0%}. No plan can cost over"
            f" {100 * (first.gap or 0):.1f} % less."
        ),
        notes=(
            *first.notes,
            Note("importance", "all of the surface is equally important: none was given"),
        ),
        facts=(
            ("surface", "arms_out.ply, 1.93 m²"),
            ("rig", f"{len(rig)} cameras, frame {rig.frame_id}"),
            ("method", f"{first.method} on {first.samples} samples, seed {first.seed}"),
            ("planned", "2026-11-27 07:00"),
        ),
        rig=rig,
        surface=SampledSurface(
            points=once.samples.points,
            normals=once.samples.normals,
            areas=areas,
            importance=None,
            spacing=float(np.sqrt(areas.sum() / len(areas))),
            pair_offsets=once.sample_offsets,
            pair_camera=once.camera_index,
            pair_depth=once.depth,
            pair_cost=once.base_cost,
            focus_weight=once.focus_weight,
        ),
        plans=reported,
        costs=_costs(once, plans, reported),
        steps=tuple(steps),
        sheet=lens_sheet(first, rig, surface="arms_out.ply", rig_file="rig.yaml"),
        histograms=tuple(_histogram(once, c) for c in range(len(rig))),
        parameters=(("samples", first.samples), ("seed", first.seed), ("k", 2), ("bound", "quick")),
        software=(("focus_planner", "0.2.0"), ("numpy", np.__version__)),
    )


def _noting(steps):
    def note(progress):
        steps.append(
            Step(
                progress.stage,
                progress.iteration,
                _known(progress.cost),
                _known(progress.lower_bound),
                0.01 * (len(steps) + 1),
            )
        )
        return True

    return note


def _known(value):
    return float(value) if value is not None and np.isfinite(value) else None


def _reported(once, plan) -> ReportedPlan:
    problem, focus = with_shots(once, plan.shots), plan.focus_distances
    cost, best = problem.evaluate(focus)
    sharp = (problem.focus_near <= focus[problem.camera_index]) & (
        focus[problem.camera_index] <= problem.focus_far
    )
    pair_in_focus = sharp.reshape(len(once.depth), plan.shots).any(axis=1)
    areas = once.samples.areas[once.sample_index]
    return ReportedPlan(
        title=_TITLES.get(plan.method, plan.method),
        plan=plan,
        cost=cost,
        camera=np.where(best < 0, -1, best // plan.shots).astype(np.int32),
        in_focus=problem.in_focus(focus, best),
        sharp_views=np.bincount(
            once.sample_index[pair_in_focus], minlength=once.sample_count
        ).astype(np.int32),
        pair_in_focus=pair_in_focus,
        held_area=np.bincount(
            once.camera_index[pair_in_focus],
            weights=areas[pair_in_focus],
            minlength=once.camera_count,
        ),
    )


def _share(once, reported):
    areas = once.samples.areas
    return float(areas[reported.in_focus].sum() / areas.sum())


def _costs(once, plans, reported):
    rows = []
    for k, (plan, each) in enumerate(zip(plans, reported, strict=True)):
        cost = estimate_quality(with_shots(once, plan.shots), plan.focus_distances).cost
        rows.append(
            CostRow(
                each.title,
                plan.cost,
                cost.value,
                cost.standard_error,
                _share(once, each),
                reported=k == 0,
            )
        )
    against = rows[-1].fresh_cost
    rows = [replace(row, change=row.fresh_cost / against - 1) for row in rows[:-1]] + rows[-1:]
    return (*rows, CostRow("lower bound", plans[0].lower_bound))


def _histogram(once, camera):
    pairs = np.flatnonzero(once.camera_index == camera)
    if not len(pairs):
        return DepthHistogram(np.empty(0), np.empty(0))
    areas = once.samples.areas[once.sample_index[pairs]]
    counts, edges = np.histogram(once.depth[pairs], _BINS, weights=areas)
    return DepthHistogram(edges, counts)


def with_pictures(content: ReportContent, picture: bytes) -> ReportContent:
    """The same content with a picture for every camera of its first plan."""
    first = replace(content.plans[0], pictures=(picture,) * len(content.rig))
    return replace(content, plans=(first, *content.plans[1:]))


def renamed(content: ReportContent, title: str) -> ReportContent:
    """The same content with another title, verdict, note and fact."""
    return replace(
        content,
        title=title,
        verdict=title,
        notes=(Note("winding", title),),
        facts=((title, title),),
        parameters=((title, {title: [title]}),),
        software=((title, title),),
        plans=(replace(content.plans[0], title=title), *content.plans[1:]),
    )
