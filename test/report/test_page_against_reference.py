# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a person reads on the page, against slow arithmetic from the paper's equations."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import CameraIntrinsics, Lens, PlanRequest, Rig, Scene, plan_focus
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.report.assembly import assemble
from focus_planner.report.comparison import ComparedPlan, plans_to_compare
from focus_planner.report.making import write_report
from testing import reference
from testing.opened_report import Opened, chromium
from testing.problems import around, merged, sphere
from testing.report_contents import DISTORTED

pytestmark = pytest.mark.processes

TOLERANCE = 0.004
MODEL = CostModel(0.3, 0.4, 0.25, 0.8, 0.6)
FISHEYE = CameraIntrinsics(
    640, 480, 300.0, 300.0, 319.5, 239.5, "equidistant", (0.02, -0.004, 0.001, 0.0)
)
LENSES = (
    Lens(0.05, 40.0, circle_of_confusion=2e-5),
    Lens(0.035, 30.0, focus_distances=(0.6, 0.7, 0.8, 0.9, 1.0), hiatus=0.003),
    Lens(0.05, 50.0, min_focus=0.7, max_focus=1.1),
)
GRAZED = 1e-3  # metres, as the scene is about as large as its distance
NEAR_ENOUGH = 2e-4  # metres, and of costs: more than what the page rounds


def subject():
    surface = merged(sphere(0.25, subdivisions=3), sphere(0.09, (0.0, -0.36, 0.05)))
    heights = surface.vertices[:, 2]
    surface = replace(surface, vertex_importance=np.where(heights > 0, 1.0, 0.5))
    rig = around(7, 1.0, height=0.35)
    kinds = (CameraIntrinsics(640, 480, 420.0, 420.0, 319.5, 239.5), FISHEYE, DISTORTED)
    cameras = [
        replace(each, intrinsics=kinds[k % 3], lens=LENSES[k % 3])
        for k, each in enumerate(rig.cameras)
    ]
    away = replace(cameras[-1], name="looks_away", orientation=(0.0, 0.0, 0.0, 1.0))
    rig = Rig((*cameras[:-1], away))
    request = PlanRequest(
        samples=150, fresh_samples=250, shots=2, depth_tolerance=TOLERANCE, bound="tight"
    )
    scene = Scene(surface)
    plan = plan_focus(scene, rig, request, MODEL)
    return PlannedSubject(scene, rig, request, plan, MODEL)


@pytest.fixture(scope="module")
def content():
    of = subject()
    return assemble(of, tuple(plans_to_compare(of, ["closest"])), samples=200), of


class Truth:
    """What the paper says of samples and a plan."""

    def __init__(self, of, points, normals):
        self.of, self.points, self.normals = of, points, normals
        mesh, stop_short = of.scene.surface, of.scene.stop_short
        shape = len(points), len(of.rig)
        self.sees, self.sure = np.zeros(shape, bool), np.ones(shape, bool)
        self.base, self.depth = np.ones(shape), np.zeros(shape)
        for p, (point, normal) in enumerate(zip(points, normals, strict=True)):
            for c, camera in enumerate(of.rig.cameras):
                with_margins = {
                    reference.sees(mesh, camera, point, normal, stop_short, margin)
                    for margin in (-1e-4, 1e-4)
                }
                facing = abs((point - camera.position) @ normal)
                self.sees[p, c] = min(with_margins)
                self.sure[p, c] = len(with_margins) == 1 and facing > GRAZED
                self.depth[p, c] = (point - camera.position) @ reference.camera_axes(camera)[2]
                without_focus = replace(MODEL, focus_weight=0.0)
                self.base[p, c] = reference.pointwise_cost(
                    point, normal, camera, 1.0, without_focus
                )

    def holds(self, camera, depth, distances):
        lens = self.of.rig.cameras[camera].lens
        return any(reference.holds(depth, s, lens, TOLERANCE) for s in distances)

    def held(self, plan):
        held = np.zeros_like(self.sees)
        for c, focus in enumerate(plan.cameras):
            distances = [shot.focus_distance for shot in focus.shots]
            for p in np.flatnonzero(self.sees[:, c]):
                held[p, c] = self.holds(c, self.depth[p, c], distances)
        return held

    def costs(self, plan):
        blurred = ~self.held(plan)
        return np.where(self.sees, self.base + MODEL.focus_weight * blurred, 1.0)

    def best(self, plan):
        return np.where(self.sees.any(axis=1), self.costs(plan).argmin(axis=1), -1)

    def sharp(self, plan):
        best = self.best(plan)
        return (best >= 0) & self.held(plan)[np.arange(len(best)), best]


@pytest.fixture(scope="module")
def truth(content):
    report, of = content
    return Truth(of, report.surface.points, report.surface.normals)


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def opened(browser, content, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(content[0], path)
    with Opened(browser, path) as opened:
        yield opened


def cells_of(row):
    return [cell.strip() for cell in row.locator("th, td").all_inner_texts()]


def metres(text):
    return float(text.replace("\N{NO-BREAK SPACE}m", "").replace("∞", "inf"))


def areas(text):
    """Square metres."""
    units = {"m²": 1.0, "cm²": 1e-4}
    return [
        float(number) * units[unit]
        for number, unit in re.findall(r"([\d.]+)\N{NO-BREAK SPACE}(c?m²)", text)
    ]


def about(area):
    return pytest.approx(area, abs=0.6e-4, rel=0.006)


def some_points(opened):
    """Click here and there; yield the number of each point once."""
    seen = set()
    for x in (0.18, 0.24, 0.29, 0.34):
        for y in (0.3, 0.42, 0.5, 0.58, 0.7):
            opened.click_picture(x, y)
            if opened.inspector.get_attribute("data-kind") != "point":
                continue
            point = int(opened.inspector.get_attribute("data-index"))
            if point not in seen:
                seen.add(point)
                yield point


def test_what_is_told_of_points_is_true(opened, content, truth):
    report, of = content
    plan = of.plan
    names = [camera.name for camera in of.rig.cameras]
    held, costs, best = truth.held(plan), truth.costs(plan), truth.best(plan)
    told = {"sharp": 0, "blurred": 0, "unseen": 0, "moves": 0}
    for p in some_points(opened):
        if not truth.sure[p].all():
            continue
        text = opened.inspector.inner_text()
        rows = opened.inspector.get_by_label("Cameras that see it").locator("tbody tr").all()
        told_of = {cells[0]: cells[1:] for cells in map(cells_of, rows)}
        assert set(told_of) == {names[c] for c in np.flatnonzero(truth.sees[p])}
        for c in np.flatnonzero(truth.sees[p]):
            depth, _, there, cost = told_of[names[c]]
            assert float(depth) == pytest.approx(truth.depth[p, c], abs=6e-4)
            assert there.startswith("sharp") == held[p, c]
            assert float(cost) == pytest.approx(costs[p, c], abs=6e-4)
            _check_why(truth, plan, p, c, there)
        of_plans = opened.inspector.locator("table").first.locator("tbody tr").all()
        for each, row in zip(report.plans, of_plans, strict=True):
            _, state, by, cost, views = cells_of(row)
            chosen = truth.best(each.plan)[p]
            assert by == ("–" if chosen < 0 else names[chosen])
            assert float(cost) == pytest.approx(truth.costs(each.plan)[p].min(), abs=6e-4)
            assert int(views) == truth.held(each.plan)[p].sum()
            expected = "unseen" if chosen < 0 else "blurred"
            assert state == ("sharp" if truth.sharp(each.plan)[p] else expected)
        _check_blind(truth, p, opened.inspector.locator("summary").all_inner_texts())
        told[expected_state(truth, plan, p)] += 1
        told["moves"] += _check_mends(truth, plan, p, text, report.surface.areas, names)
        importance = re.search(r"with ([\d.]+) of the greatest importance", text)
        assert float(importance[1]) == pytest.approx(report.surface.importance[p], abs=6e-3)
        assert best[p] < 0 or names[best[p]] in text
    assert told["sharp"]
    assert told["blurred"]
    assert told["moves"]


def expected_state(truth, plan, p):
    if truth.best(plan)[p] < 0:
        return "unseen"
    return "sharp" if truth.sharp(plan)[p] else "blurred"


def _check_why(truth, plan, p, c, there):
    """What is said of a camera that sees the point: limits, tolerance, grazing, off the axis."""
    depth, shots = truth.depth[p, c], plan.cameras[c].shots
    found = re.search(r"([\d.]+)\N{NO-BREAK SPACE}mm (before|beyond) its (near|far) limit", there)
    if found:
        near = [
            reference.depth_of_field(s.focus_distance, truth.of.rig.cameras[c].lens) for s in shots
        ]
        away = [low - depth if found[2] == "before" else depth - high for low, high in near]
        least = min(each for each in away if each > -1e-9)
        assert float(found[1]) / 1000 == pytest.approx(least, abs=6e-4)
    inside = re.search(r"only ([\d.]+)\N{NO-BREAK SPACE}mm inside its (near|far) limit", there)
    if inside:
        limits = [
            reference.depth_of_field(s.focus_distance, truth.of.rig.cameras[c].lens) for s in shots
        ]
        assert any(low <= depth <= high for low, high in limits)
        assert float(inside[1]) / 1000 < TOLERANCE + NEAR_ENOUGH
    sight = np.asarray(truth.of.rig.cameras[c].position) - truth.points[p]
    slant = np.degrees(np.arccos(sight @ truth.normals[p] / np.linalg.norm(sight)))
    if abs(slant - 60) > 0.1:
        assert ("grazing" in there) == (slant > 60)
    axis = reference.camera_axes(truth.of.rig.cameras[c])[2]
    off = np.linalg.norm(np.cross(axis, sight))
    if abs(off - MODEL.axis_deviation_limit / 2) > 1e-3:
        assert ("off axis" in there) == (off > MODEL.axis_deviation_limit / 2)


def _check_blind(truth, p, told):
    counts = dict.fromkeys(("behind", "outside", "faces away", "hides"), 0)
    for c in np.flatnonzero(~truth.sees[p]):
        camera, point = truth.of.rig.cameras[c], truth.points[p]
        if truth.depth[p, c] <= camera.lens.focal_length:
            counts["behind"] += 1
        elif not reference.in_image(camera, point)[2]:
            counts["outside"] += 1
        elif (point - np.asarray(camera.position)) @ truth.normals[p] >= 0:
            counts["faces away"] += 1
        else:
            counts["hides"] += 1
    found = {text.rsplit(": ", 1)[0]: int(text.rsplit(": ", 1)[1]) for text in told}
    for word, count in counts.items():
        assert sum(number for text, number in found.items() if word in text) == count


def _check_mends(truth, plan, p, text, sample_areas, names):
    """Whether a change of focus does what is said of it; 0 if none is told."""
    move = re.search(
        r"Focus (\w+) [\d.]+\s?mm (nearer|farther), at ([\d.]+)\s?m: it would hold this point\. "
        r"(.*?) that is sharp nowhere would become sharp, and (.*?) would be sharp in no picture",
        text,
    )
    stop = re.search(r"stop (\w+) down by [\d.]+ stops \(([\d.]+) times its f-number\)", text)
    if stop:
        c, times = names.index(stop[1]), float(stop[2])
        lens = truth.of.rig.cameras[c].lens
        closed = replace(lens, hyperfocal_distance=lens.hyperfocal_distance / times)
        distances = [shot.focus_distance for shot in plan.cameras[c].shots]
        depth = truth.depth[p, c]
        assert any(reference.holds(depth, s, closed, TOLERANCE) for s in distances)
    if not move:
        return 0
    c, target = names.index(move[1]), float(move[3])
    lens = truth.of.rig.cameras[c].lens
    assert reference.holds(truth.depth[p, c], target, lens, TOLERANCE)
    assert lens.min_focus <= target <= lens.max_focus
    settings = reference.settable(lens)
    assert settings is None or min(abs(each - target) for each in settings) < 1e-6
    distances = [shot.focus_distance for shot in plan.cameras[c].shots]
    sides = (np.less if move[2] == "farther" else np.greater)(distances, target)
    held = truth.held(plan)
    changes = []
    for k in np.flatnonzero(sides):
        others = [target if j == k else s for j, s in enumerate(distances)]
        then = held.copy()
        then[:, c] = [
            truth.sees[q, c] and truth.holds(c, truth.depth[q, c], others) for q in range(len(held))
        ]
        gained = sample_areas[then.any(axis=1) & ~held.any(axis=1)].sum()
        lost = sample_areas[held.any(axis=1) & ~then.any(axis=1)].sum()
        changes.append((about(gained), about(lost)))
    assert (areas(move[4])[0], areas(move[5])[0]) in changes
    return 1


def test_a_plan_for_other_lenses_is_explained_with_these(browser, content, tmp_path):
    _, of = content
    shallow = tuple(
        replace(each, lens=Lens(0.05, 90.0, focus_steps=120, min_focus=0.5, max_focus=1.2))
        for each in of.rig.cameras
    )
    theirs = replace(of, rig=Rig(shallow))
    plan = plan_focus(of.scene, theirs.rig, of.request, MODEL)
    beside = ComparedPlan("as recorded", "the recorded plan", plan, theirs.rig)
    report = assemble(of, (beside,), samples=200)
    write_report(report, tmp_path / "beside.html")
    truth = Truth(theirs, report.surface.points, report.surface.normals)
    names = [camera.name for camera in theirs.rig.cameras]
    moves = 0
    with Opened(browser, tmp_path / "beside.html") as opened:
        for p in some_points(opened):
            opened.inspector.get_by_text("as recorded", exact=True).last.click()
            text = opened.inspector.inner_text()
            moves += _check_mends(truth, plan, p, text, report.surface.areas, names)
    assert moves


def test_what_is_told_of_cameras_is_true(opened, content, truth):
    report, of = content
    for c, camera in enumerate(of.rig.cameras):
        opened.page.locator("#cameras th.name button", has_text=camera.name).first.click()
        assert opened.selected("camera") == c
        table = opened.inspector.locator("table").first
        rows = {cells[0]: cells[1:] for cells in map(cells_of, table.locator("tbody tr").all())}
        shots = [shot for each in report.plans for shot in each.plan.cameras[c].shots]
        for k, shot in enumerate(shots):
            s, f = shot.focus_distance, camera.lens.focal_length
            near, far = reference.depth_of_field(s, camera.lens)
            told = {name: metres(each[k]) for name, each in rows.items() if "limit" in name}
            assert told == pytest.approx({"near limit": near, "far limit": far}, abs=6e-4)
            assert metres(rows["focus, from the centre of projection"][k]) == pytest.approx(
                s, abs=6e-4
            )
            image = f * s / (s - f)
            assert metres(rows["from the sensor"][k]) == pytest.approx(
                s + image + camera.lens.hiatus, abs=6e-4
            )
            assert rows["samples assigned to it"][k] == f"{shot.assigned_samples} of 150"
        text = opened.inspector.inner_text()
        seen = report.surface.areas[truth.sees[:, c]]
        if not len(seen):
            assert "It sees" not in text
            continue
        assert areas(text[text.index("It sees") :])[0] == about(seen.sum())
        for each in report.plans:
            held = report.surface.areas[truth.held(each.plan)[:, c]].sum()
            says = text[text.index(f"{each.title}: holds") :]
            assert areas(says)[0] == about(held)
        depths = report.histograms[c]
        expected, _ = np.histogram(truth.depth[truth.sees[:, c], c], depths.edges, weights=seen)
        np.testing.assert_allclose(depths.areas, expected, atol=1e-12)


def test_what_is_told_of_the_whole_is_true(opened, content):
    report, of = content
    problem, fresh = of.plan.problem, of.plan.fresh_problem
    planned = Truth(of, problem.samples.points, problem.samples.normals)
    judged = Truth(of, fresh.samples.points, fresh.samples.normals)
    weights, fresh_areas = fresh.samples.weights, fresh.samples.areas
    rows = {}
    for row in opened.page.locator("#costs tbody tr").all():
        name, _, *numbers = cells_of(row)
        rows[name] = [
            float(re.search(r"[−\d.]+|–", each)[0].replace("−", "-").replace("–", "nan"))
            for each in numbers
        ]
    usual = None
    for each in reversed(report.plans):
        fresh_cost, change, share, cost = rows[each.title]
        costs = judged.costs(each.plan).min(axis=1)
        expected = 1000 * (weights * costs).sum() / weights.sum()
        assert fresh_cost == pytest.approx(expected, abs=0.06)
        usual = usual or expected
        assert np.isnan(change) or change == pytest.approx(100 * (expected / usual - 1), abs=0.06)
        sharp = fresh_areas[judged.sharp(each.plan)].sum() / fresh_areas.sum()
        assert share == pytest.approx(100 * sharp, abs=0.06)
        on_these = 1000 * planned.costs(each.plan).min(axis=1).mean()
        assert cost == pytest.approx(on_these, abs=0.06)
    bound = rows["lower bound"][-1]
    assert bound <= of.plan.lower_bound < bound + 0.1
    sharp, best = judged.sharp(of.plan), judged.best(of.plan)
    shares = [
        fresh_areas[which].sum() / fresh_areas.sum()
        for which in (sharp, ~sharp & (best >= 0), best < 0)
    ]
    verdict = opened.page.locator(".verdict").inner_text().replace("\N{NO-BREAK SPACE}", " ")
    words = ("of the surface is sharp", "is seen but blurred there", "is seen by no camera")
    for word, share in zip(words, shares, strict=True):
        found = re.search(rf"([\d.]+) % (?:\(± [\d.]+\) )?{word}", verdict)
        assert (found is not None) == (share > 0)
        assert not found or float(found[1]) == pytest.approx(100 * share, abs=0.6)
    opened.choose("Colour by", "views")
    told = opened.page.locator(".legend tbody tr").all()
    numbers = [float(cells_of(row)[1].split()[-2].replace("<", "")) for row in told]
    views = np.where(best < 0, -1, np.minimum(judged.held(of.plan).sum(axis=1), 5))
    expected = [
        100 * fresh_areas[views == k].sum() / fresh_areas.sum() for k in (0, 1, 2, 3, 4, 5, -1)
    ]
    assert numbers == pytest.approx(expected, abs=0.11)
