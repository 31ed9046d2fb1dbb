# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A report as one file: what it says without its program, and what it lets nobody do."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from focus_planner.core.notes import Note
from focus_planner.core.planning.sharp_views import Resolution
from focus_planner.report.content import CostRow, DepthHistogram, SharpRow, Step
from focus_planner.report.making import write_report
from focus_planner.report.page import report_page
from focus_planner.report.payload import encoded_payload
from testing import report_contents
from testing.payloads import decoded

EVIL = "</script><img src=x onerror=alert(1)>\"'&\u202e\x1b[31m{title}"


@pytest.fixture(scope="module")
def content():
    return report_contents.small()


@pytest.fixture(scope="module")
def page(content):
    return report_page(content)


def test_no_line_ends_between_a_number_and_its_unit(content):
    notes = (Note("noise", "depths are off by 3 mm ± 1 and 5 metres"),)
    verdict = "It holds 47 %. 7 cameras do not."
    shown = report_page(dataclasses.replace(content, verdict=verdict, notes=notes))
    assert "It holds 47\N{NO-BREAK SPACE}%. 7 cameras do not." in shown
    assert "off by 3\N{NO-BREAK SPACE}mm ±\N{NO-BREAK SPACE}1 and 5 metres" in shown


class _Elements(HTMLParser):
    def __init__(self, page):
        super().__init__()
        self.tags, self.attributes, self.text = [], [], {}
        self._open = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        self._open.append((tag, dict(attrs).get("id")))

    def handle_data(self, data):
        key = self._open[-1] if self._open else None
        self.text[key] = self.text.get(key, "") + data


def test_the_payload_holds_the_plans_exactly_and_the_surface_to_what_can_be_seen(content):
    facts, arrays = decoded(encoded_payload(content))
    surface = content.surface
    shares = arrays["points"].reshape(3, -1).T / 65535
    points = np.array(facts["origin"]) + facts["extent"] * shares
    np.testing.assert_allclose(points, surface.points, rtol=0, atol=facts["extent"] / 65535)
    np.testing.assert_array_equal(arrays["counts"], np.diff(surface.pair_offsets))
    steps, cameras = arrays["cameras"], []
    for count in arrays["counts"]:
        cameras.append(np.cumsum(steps[:count]))
        steps = steps[count:]
    np.testing.assert_array_equal(np.concatenate(cameras), surface.pair_camera)
    low, depths = facts["depth"]
    depth = low + depths * arrays["depths"] / 65535
    np.testing.assert_allclose(depth, surface.pair_depth, rtol=0, atol=depths / 65535)
    np.testing.assert_allclose(arrays["costs"] / 65535, surface.pair_cost, rtol=0, atol=1e-5)
    for k, plan in enumerate(content.plans):
        np.testing.assert_array_equal(arrays[f"camera{k}"] - 1, plan.camera)
        np.testing.assert_array_equal(arrays[f"sharp{k}"], plan.in_focus)
        np.testing.assert_array_equal(arrays[f"views{k}"], plan.sharp_views)
        np.testing.assert_array_equal(arrays[f"held{k}"], plan.pair_in_focus)
        np.testing.assert_allclose(arrays[f"cost{k}"] / 65535, plan.cost, rtol=0, atol=1e-5)
        for told, focus in zip(facts["plans"][k]["cameras"], plan.plan.cameras, strict=True):
            assert [shot["focus"] for shot in told["shots"]] == [
                shot.focus_distance for shot in focus.shots
            ]


def test_the_limit_of_resolution_the_views_and_bins_are_told(content):
    facts, _ = decoded(encoded_payload(content))
    assert (facts["mostMmPerPixel"], facts["views"]) == (None, 1)
    assert all(image["bin"] == [1, 1] for image in facts["images"])
    surface = dataclasses.replace(content.surface, max_mm_per_pixel=0.5, views=3)
    first = content.rig.cameras[0]
    binned = dataclasses.replace(first.intrinsics, binning=(2, 3))
    cameras = (dataclasses.replace(first, intrinsics=binned), *content.rig.cameras[1:])
    rig = dataclasses.replace(content.rig, cameras=cameras)
    facts, _ = decoded(encoded_payload(dataclasses.replace(content, surface=surface, rig=rig)))
    assert (facts["mostMmPerPixel"], facts["views"]) == (0.5, 3)
    assert facts["images"][facts["cameras"][0]["image"]]["bin"] == [2, 3]


def test_other_lenses_and_many_settings_are_told(content):
    first, second = content.plans
    many = tuple(np.linspace(0.3, 5.0, 9000).tolist())
    lens = dataclasses.replace(content.rig.cameras[0].lens, focus_distances=many)
    beside = dataclasses.replace(second, lenses=(lens,) * len(content.rig), sees_the_same=False)
    facts, _ = decoded(
        encoded_payload(dataclasses.replace(content, plans=(first, beside), decimals=5))
    )
    assert facts["decimals"] == 5
    assert [plan["seesTheSame"] for plan in facts["plans"]] == [True, False]
    assert facts["plans"][0]["lenses"] is None
    (number,) = set(facts["plans"][1]["lenses"])
    assert number not in {camera["lens"] for camera in facts["cameras"]}
    told = facts["lenses"][number]["distances"]
    assert len(told) <= 4096
    assert set(told) <= set(many)
    assert {facts["lenses"][camera["lens"]]["distances"] for camera in facts["cameras"]} == {None}


def test_the_shot_that_a_camera_is_pictured_with_is_told(content):
    plan = content.plans[0]
    camera = plan.plan.cameras[0]
    far = dataclasses.replace(camera.shots[0], focus_distance=9.0)
    bracket = dataclasses.replace(camera, shots=(camera.shots[0], far), focus_distance=9.0)
    cameras = (bracket, *plan.plan.cameras[1:])
    told = dataclasses.replace(plan, plan=dataclasses.replace(plan.plan, cameras=cameras))
    facts, _ = decoded(encoded_payload(dataclasses.replace(content, plans=(told,))))
    assert [each["main"] for each in facts["plans"][0]["cameras"]] == [1] + [0] * 11


def test_normals_survive_the_octahedron(content):
    _, arrays = decoded(encoded_payload(content))
    x, y = arrays["normals"].reshape(2, -1) / 65535 * 2 - 1
    z = 1 - abs(x) - abs(y)
    below = z < 0
    x, y = (
        np.where(below, (1 - abs(y)) * np.where(x >= 0, 1, -1), x),
        np.where(below, (1 - abs(x)) * np.where(y >= 0, 1, -1), y),
    )
    normals = np.stack([x, y, z], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    np.testing.assert_allclose(normals, content.surface.normals, atol=2e-4)


def test_more_cameras_than_a_byte_holds_are_told_apart(content):
    surface = dataclasses.replace(content.surface, pair_camera=content.surface.pair_camera * 6000)
    _, arrays = decoded(encoded_payload(dataclasses.replace(content, surface=surface)))
    first = int(arrays["counts"][0])
    np.testing.assert_array_equal(np.cumsum(arrays["cameras"][:first]), surface.pair_camera[:first])


def test_what_it_says_is_there_without_its_program(content, page):
    stripped = re.sub(r"(?s)<script.*?</script>", "", page)
    stripped = stripped.replace("\N{NO-BREAK SPACE}", " ")
    for text in (content.verdict, content.notes[-1].text, content.facts[0][1]):
        assert text in stripped
    for camera, row in zip(content.rig.cameras, content.sheet.rows, strict=True):
        assert f'data-value="{camera.name}"' in stripped
        assert all(f">{cell.text}<" in stripped for cell in row.cells if cell.text)
    assert f"{content.costs[0].fresh_cost:.1f}" in stripped
    assert content.software[0][1] in stripped


def test_names_from_elsewhere_stay_text(content):
    hostile = report_contents.renamed(content, EVIL)
    before, after = _Elements(report_page(content)), _Elements(report_page(hostile))
    assert "img" not in after.tags
    assert not [name for _, name, _ in after.attributes if name.startswith("on")]
    assert set(after.tags) <= set(before.tags)
    assert "\x1b" not in report_page(hostile)
    assert "\u202e" not in report_page(hostile)
    assert "{title}" in after.text[("h1", None)]
    facts, _ = decoded(encoded_payload(hostile))
    assert facts["plans"][0]["title"] == EVIL  # set as text by the program


def test_the_policy_allows_its_own_program_and_style_and_nothing_else(page):
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page)[1]
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == "'none'"
    program = page.rsplit("<script>", 1)[1].rsplit("</script>", 1)[0]
    style = page.split("<style>", 1)[1].split("</style>", 1)[0]
    for rule, inline in (("script-src", program), ("style-src", style)):
        digest = base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()
        assert rules[rule] == f"'sha256-{digest}'"
    assert rules["img-src"] == "data: blob:"
    assert not re.search(r'\b(?:src|href)="(?!data:)', page.split("<script>")[0])
    assert " style=" not in page.split("<script")[0]


def test_it_is_the_same_for_the_same_content(content, page):
    assert report_page(content) == page


def test_it_is_small():
    assert len(report_page(report_contents.real()).encode()) < 3_000_000


def test_a_picture_is_carried_as_it_is(content):
    picture = bytes(range(256)) * 3
    _, arrays = decoded(encoded_payload(report_contents.with_pictures(content, picture)))
    assert bytes(arrays["picture0.11"].astype(np.uint8)) == picture
    assert "picture1.0" not in arrays


def test_a_report_of_next_to_nothing_has_no_empty_parts(content):
    bare = dataclasses.replace(
        content,
        notes=(),
        facts=(),
        costs=(),
        sharp=(),
        steps=(),
        parameters=(),
        software=(),
        plans=content.plans[:1],
        histograms=tuple(DepthHistogram(np.empty(0), np.empty(0)) for _ in content.rig.cameras),
    )
    page = report_page(bare)
    for part in ("costs", "sharp-views", "steps", "origin"):
        assert f'id="{part}"' not in page
    assert 'class="notes"' not in page.split("<script")[0]


def test_costs_on_other_samples_are_said_not_to_compare(content):
    told = "The costs as planned are on different samples, and do not compare"
    assert told not in report_page(content)
    costs = (CostRow("this", 190.0, 205.0), CostRow("then", 200.0, 210.0, other_samples=True))
    assert told in report_page(dataclasses.replace(content, costs=costs))


def test_costs_for_other_views_are_said_not_to_compare(content):
    told = "The costs as planned are for different numbers of views or limits of resolution"
    costs = (CostRow("this", 190.0, 205.0), CostRow("then", 200.0, 210.0, other_measure=True))
    assert told in report_page(dataclasses.replace(content, costs=costs))
    unplanned = (costs[0], CostRow("then", None, 210.0, other_measure=True))
    assert told not in report_page(dataclasses.replace(content, costs=unplanned))


def test_what_a_cost_for_several_views_is_is_said(content):
    told = "A piece of surface costs the mean of its 3 best views, 1 for each that is missing."
    assert told not in report_page(content)
    first, *others = content.plans
    several = dataclasses.replace(first, plan=dataclasses.replace(first.plan, views=3))
    assert told in " ".join(
        report_page(dataclasses.replace(content, plans=(several, *others))).split()
    )


def test_sharp_views_are_a_table(content):
    shares = ((1, 0.875, 0.004), (2, 0.5, 0.01), (3, 0.25, 0.01), (5, 0.0, 0.0))
    rows = (
        SharpRow("this", shares, Resolution(0.41234, 1.25), reported=True),
        SharpRow("<b>then</b>", shares, None),
        SharpRow("not told", (), None),
    )
    page = report_page(dataclasses.replace(content, sharp=rows))
    table = page.split('id="sharp-views"')[1].split("</section>")[0]
    for part in ("87.5", "50.0", "25.0", "0.0"):
        assert table.count(f">{part}\N{NO-BREAK SPACE}%<") == 2
    assert "<small> ± 0.4</small>" in table
    assert ">0.412<" in table
    assert ">1.25<" in table
    assert table.count("–") == 2
    assert "&lt;b&gt;then" in table
    assert "not told" not in table
    assert [f"in {n}" in table for n in ("1<", "2 or more", "3 or more", "5 or more")] == [True] * 4


def test_unknown_numbers_are_dashes(content):
    costs = (CostRow("a baseline", None), CostRow("another", 200.0, 210.0))
    steps = (Step("em", 1, None, None, None), Step("em", 2, 3.0, None, None))
    page = report_page(dataclasses.replace(content, costs=costs, steps=steps))
    table = page.split('id="costs"')[1].split("</section>")[0]
    assert table.count("–") == 4 + 2
    assert 'id="steps"' not in page  # one known cost is no curve


def test_curves_are_over_steps_where_seconds_are_unknown(content):
    steps = tuple(Step("em", k, 300.0 - k, 290.0, None) for k in range(3))
    page = report_page(dataclasses.replace(content, steps=steps))
    drawing = page.split('class="convergence"')[1].split("</svg>")[0]
    assert ">step<" in drawing
    assert "cost 298.0" in drawing
    assert "bound 290.0" in drawing


def test_equal_costs_have_a_curve_too(content):
    steps = tuple(Step("em", k, 300.0, 300.0, 0.0) for k in range(3))
    assert "cost 300.0" in report_page(dataclasses.replace(content, steps=steps))


def test_notes_are_told_in_their_words(content):
    noted = dataclasses.replace(content, notes=(Note("budget", "a < b & c"),))
    assert "<li>a &lt; b &amp; c</li>" in report_page(noted)


def test_it_is_saved_as_it_is(content, page, tmp_path):
    write_report(content, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_bytes() == page.encode()
