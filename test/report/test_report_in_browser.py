# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A report in a browser: what a person sees, clicks and reads."""

from __future__ import annotations

import dataclasses
import io
import re

import numpy as np
import pytest
from PIL import Image

from focus_planner.report.content import Shares
from focus_planner.report.making import write_report
from testing import report_contents
from testing.opened_report import Opened, chromium

pytestmark = pytest.mark.processes

TABLET = {"width": 768, "height": 1024}
SMALL = {"width": 760, "height": 480}  # for what takes long to draw without a graphics card
NO_BREAK = "\N{NO-BREAK SPACE}"


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def content():
    picture = io.BytesIO()
    Image.new("RGB", (8, 12), (200, 40, 90)).save(picture, "webp")
    content = report_contents.with_pictures(report_contents.small(), picture.getvalue())
    first, second = content.plans
    # Of other samples than those that are shown, as the rest of a report tells them.
    told = dataclasses.replace(first, shares=Shares(0.61, 0.25, 0.14))
    return dataclasses.replace(content, plans=(told, second))


@pytest.fixture(scope="module")
def path(content, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(content, path)
    return path


def sharp_of(content, plan):
    """What the plan says, where it does; else what the samples do."""
    if plan.shares is not None:
        return plan.shares.sharp
    areas = content.surface.areas
    return areas[plan.in_focus].sum() / areas.sum()


def share_of_surface(pixels):
    """How much of a picture has the colours of sharp or blurred surface."""
    red, _, blue = np.moveaxis(pixels, -1, 0)
    return float((abs(red - blue) > 60).mean())


def point_to_click(opened):
    """Select the point in the middle of the first pane by a click; return its number."""
    opened.click_picture(0.29, 0.5)
    return opened.selected("point")


@pytest.fixture
def opened(browser, path):
    with Opened(browser, path) as opened:
        yield opened
        assert opened.complaints == []
        assert all(re.match(r"file:|data:|blob:", url) for url in opened.requests)
        assert [url for url in opened.requests if url.startswith("file:")] == [path.as_uri()]


def test_it_draws_the_surface_and_asks_for_nothing(opened):
    assert share_of_surface(opened.pixels()) > 0.05


def test_a_click_on_a_point_shows_the_numbers_of_the_plans(opened, content):
    point = point_to_click(opened)
    text = opened.inspector.inner_text()
    surface = content.surface
    place = ", ".join(f"{each:.3f}".replace("-", "−") for each in surface.points[point])
    assert place in text
    for plan in content.plans:
        assert f"{plan.cost[point]:.3f}" in text
        camera = plan.camera[point]
        assert camera < 0 or content.rig.cameras[camera].name in text
    low, high = surface.pair_offsets[point : point + 2]
    rows = opened.inspector.get_by_label("Cameras that see it").locator("tbody tr")
    assert rows.count() == high - low
    plan = content.plans[0]
    for row in rows.all():
        cells = row.locator("th, td").all_inner_texts()
        (camera,) = [k for k, each in enumerate(content.rig.cameras) if each.name == cells[0]]
        (pair,) = low + np.flatnonzero(surface.pair_camera[low:high] == camera)
        assert float(cells[1]) == pytest.approx(surface.pair_depth[pair], abs=6e-4)
        assert cells[3].startswith("sharp") == plan.pair_in_focus[pair]
        blurred = 0 if plan.pair_in_focus[pair] else surface.focus_weight
        assert float(cells[4]) == pytest.approx(surface.pair_cost[pair] + blurred, abs=6e-4)


def test_cameras_that_do_not_see_a_point_are_told_with_the_reason(opened, content):
    point = point_to_click(opened)
    told = opened.inspector.locator("summary").all_inner_texts()
    counts = {text.rsplit(": ", 1)[0]: int(text.rsplit(": ", 1)[1]) for text in told}
    low, high = content.surface.pair_offsets[point : point + 2]
    assert sum(counts.values()) == len(content.rig) - (high - low)
    assert set(counts) <= {
        "it is behind the camera",
        "it is outside the picture",
        "it faces away",
        "the surface hides it",
    }


def test_a_click_on_a_camera_shows_where_its_lens_is_set(opened, content):
    label = opened.page.locator(".camera-label:visible").first
    name = label.inner_text()
    box = label.bounding_box()
    # The label begins at the camera: it is moved 8 pixels to the right of it, and centred on it.
    opened.page.mouse.click(box["x"] - 8, box["y"] + 9)
    camera = opened.selected("camera")
    assert content.rig.cameras[camera].name == name
    text = opened.inspector.inner_text()
    for plan in content.plans:
        shot = plan.plan.cameras[camera].shots[0]
        for metres in (shot.focus_distance, shot.near_limit, shot.far_limit, shot.from_sensor):
            assert f"{metres:.3f}{NO_BREAK}m" in text
    picture = opened.inspector.locator("img")
    assert picture.count() == 1  # of the first plan, which has pictures
    opened.until("document.querySelector('.inspector img').naturalWidth === 8")


def test_a_camera_of_the_table_is_selected_and_marked(opened, content):
    opened.page.locator("#cameras th.name button", has_text="c5").click()
    assert content.rig.cameras[opened.selected("camera")].name == "c5"
    assert opened.page.locator("#cameras tr.selected th.name").inner_text() == "c5"
    assert opened.page.evaluate("document.activeElement.id") == "inspector-title"
    opened.inspector.get_by_role("button", name="Close").click()
    assert opened.page.locator("#cameras tr.selected").count() == 0


def test_plans_are_shown_alone_side_by_side_and_on_either_side_of_a_line(opened, content):
    both = opened.page.locator(".caption").all_inner_texts()
    for plan, caption in zip(content.plans, both, strict=True):
        told = f"{plan.title} {100 * sharp_of(content, plan):.1f}{NO_BREAK}% in focus"
        assert caption == told
    opened.page.get_by_text("Slider").click()
    divider = opened.page.get_by_role("slider")
    divider.focus()
    opened.page.keyboard.press("End")
    opened.until("document.querySelector('[role=slider]').ariaValueNow === '100'")
    opened.choose("beside", "none")
    opened.until("document.querySelectorAll('.caption').length === 1")
    assert not divider.is_visible()
    first = opened.pixels()
    opened.choose("Show", "1")
    title = content.plans[1].title
    opened.until(f"document.querySelector('.caption').innerText.startsWith({title!r})")
    opened.wait_until_it_looks_unlike(first)


def test_the_surface_is_coloured_by_what_is_asked_for(opened):
    for scheme in ("cost", "camera", "views"):
        before = opened.pixels()
        opened.choose("Colour by", scheme)
        opened.wait_until_it_looks_unlike(before)
        assert opened.page.locator(".legend tbody tr").count() >= 2


def test_the_legend_tells_shares_of_the_surface(opened, content):
    cells = opened.page.locator(".legend tbody tr").first.locator("td").all_inner_texts()
    shares = [sharp_of(content, plan) for plan in content.plans]
    assert cells == [f"{100 * share:.1f}{NO_BREAK}%" for share in shares]


def test_the_table_sorts_and_filters(opened, content):
    def names():
        return opened.page.locator("#cameras tbody tr:visible th.name").all_inner_texts()

    distance = opened.page.locator("#cameras th.distance_m")
    focus = {each.name: each.focus_distance for each in content.plans[0].plan.cameras}
    distance.get_by_role("button").click()
    assert distance.get_attribute("aria-sort") == "ascending"
    assert [focus[name] for name in names()] == sorted(focus.values())
    distance.get_by_role("button").focus()
    opened.page.keyboard.press("Enter")
    assert distance.get_attribute("aria-sort") == "descending"
    assert [focus[name] for name in names()] == sorted(focus.values(), reverse=True)
    opened.page.get_by_label("Find").fill("looks_")
    assert names() == ["looks_away"]
    assert opened.page.locator("#filters .count").inner_text() == "1 of 12 rows"
    opened.page.get_by_label("Find").fill("")
    assert opened.page.locator("#filters .count").inner_text() == "12 rows"
    opened.choose("Status", "sees nothing")
    assert names() == ["looks_away"]


def test_everything_can_be_done_by_keyboard(opened, content):
    opened.canvas.focus()
    opened.page.keyboard.press("n")
    assert opened.selected("camera") == 0
    opened.page.keyboard.press("p")
    opened.page.wait_for_selector(f".inspector[data-index='{len(content.rig) - 1}']")
    opened.page.keyboard.press("Escape")
    opened.page.wait_for_selector(".inspector[data-kind='']")
    opened.page.keyboard.press("Home")
    opened.page.keyboard.press("Enter")
    opened.selected("point")
    before = opened.pixels()
    for key in ("ArrowLeft", "ArrowUp", "Shift+ArrowRight", "+"):
        opened.page.keyboard.press(key)
    opened.wait_until_it_looks_unlike(before)


def test_a_panel_is_left_by_escape_for_where_one_came_from(opened):
    opened.page.locator("#cameras th.name button", has_text="c5").click()
    opened.selected("camera")
    opened.page.keyboard.press("Escape")
    opened.page.wait_for_selector(".inspector[data-kind='']")
    assert opened.page.evaluate("document.activeElement.tagName") == "CANVAS"


def test_names_of_cameras_stay_in_their_panes(opened):
    opened.page.get_by_role("button", name="Show rig").click()
    pictures = opened.canvas.bounding_box()
    middle = pictures["x"] + pictures["width"] / 2
    opened.until("document.querySelectorAll('.camera-label:not([hidden])').length > 12")
    for label in opened.page.locator(".camera-label:visible").all():
        box = label.bounding_box()
        ends = box["x"], box["x"] + box["width"]
        assert pictures["x"] <= ends[0]
        assert ends[1] <= middle or middle <= ends[0]
        assert ends[1] <= pictures["x"] + pictures["width"]


def test_it_is_printed_light_with_how_it_was_made(browser, path):
    with Opened(browser, path, color_scheme="dark") as opened:
        opened.page.evaluate("dispatchEvent(new Event('beforeprint'))")
        opened.page.emulate_media(media="print")
        assert opened.page.locator("#origin dl").first.is_visible()
        paper = opened.page.locator(".canvas .paper")
        shot = np.asarray(Image.open(io.BytesIO(paper.screenshot())).convert("RGB")).astype(int)
        assert share_of_surface(shot) > 0.02
        assert shot[20, 20].min() > 200
        opened.page.emulate_media(media="screen")
        opened.page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert not opened.page.locator("#origin dl").first.is_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_checker_of_accessibility_finds_nothing(browser, path, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with Opened(browser, path, TABLET, color_scheme=scheme, has_touch=True) as opened:
        opened.page.locator("#cameras th.name button", has_text="c5").click()
        opened.selected("camera")
        checker = axe.Axe()
        assert faults(checker, opened) == []
        if scheme == "dark":
            return  # the rest differs by colours that were checked
        opened.page.get_by_label("Find").fill("c5")
        opened.canvas.focus()
        opened.page.keyboard.press("Enter")
        opened.selected("point")
        opened.page.get_by_text("Slider").click()
        assert faults(checker, opened) == []


def faults(checker, opened):
    found = checker.run(opened.page).response["violations"]
    return [(each["id"], each["nodes"][0]["html"]) for each in found]


def test_it_fits_a_tablet_and_has_room_for_fingers(browser, path):
    with Opened(browser, path, TABLET, has_touch=True, is_mobile=True) as opened:
        widths = opened.page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
        assert widths[0] <= widths[1]
        for control in opened.page.locator(".toolbar button, .toolbar select").all():
            assert control.bounding_box()["height"] >= 44


def test_dark_is_dark_and_can_be_chosen(browser, path):
    with Opened(browser, path, color_scheme="dark") as opened:
        dark = opened.pixels()
        assert dark[-20, 20].max() < 80
        opened.page.get_by_text("Light").click()
        opened.wait_until_it_looks_unlike(dark)
        assert opened.pixels()[-20, 20].min() > 200


def test_names_from_elsewhere_run_nothing(browser, content, tmp_path):
    evil = "</script><img src=x onerror='document.title=1'><b>"
    write_report(report_contents.renamed(content, evil), tmp_path / "evil.html")
    with Opened(browser, tmp_path / "evil.html") as opened:
        assert opened.page.title() == evil
        assert evil in opened.page.locator(".caption").first.inner_text()
        assert opened.page.locator("b b, .caption img").count() == 0
        assert opened.complaints == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_first_picture_is_on_the_pages_own_ground(browser, path, scheme):
    with Opened(browser, path, color_scheme=scheme) as opened:
        style = "getComputedStyle(document.querySelector('.canvas')).backgroundColor"
        ground = re.findall(r"\d+", opened.page.evaluate(style))
        np.testing.assert_array_equal(opened.pixels()[-20, 20], [int(each) for each in ground])


def test_a_large_report_draws(browser, tmp_path):
    content = report_contents.made_large(squarely=0.998)  # few pairs: those do not draw
    assert len(content.surface.points) == 65_536
    assert len(content.rig) == 1_000
    write_report(content, tmp_path / "large.html")
    with Opened(browser, tmp_path / "large.html", SMALL) as opened:
        assert share_of_surface(opened.pixels()) > 0.05
        point = point_to_click(opened)
        assert f"{content.plans[0].cost[point]:.3f}" in opened.inspector.inner_text()
        opened.canvas.focus()
        for _ in range(4):
            opened.page.keyboard.press("ArrowLeft")
        opened.page.wait_for_selector("#stage[data-drawn]")  # all of it again, at rest
        assert opened.complaints == []


def test_without_webgl_the_rest_is_there(browser, path):
    with_out = browser.new_context()
    page = with_out.new_page()
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(path.as_uri())
    page.wait_for_selector("#stage [role=alert]")
    assert "WebGL" in page.locator("#stage").inner_text()
    page.get_by_label("Find").fill("c5")
    assert page.locator("#cameras tbody tr:visible").count() == 1
    assert page.locator("#cameras tbody th.name button").count() == 0  # they would lead nowhere
    with_out.close()


def test_one_plan_is_shown_without_choices_of_plans(browser, content, tmp_path):
    alone = dataclasses.replace(content, plans=content.plans[:1])
    write_report(alone, tmp_path / "alone.html")
    with Opened(browser, tmp_path / "alone.html") as opened:
        assert opened.page.locator(".toolbar select").count() == 1
        assert opened.complaints == []
