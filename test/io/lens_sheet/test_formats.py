# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The files that lens sheets are written as."""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from pypdf import PdfReader

from focus_planner import InputError, Rig, cylinder_rig, gantry_rig
from focus_planner.core.notes import Note
from focus_planner.io.lens_sheet import SUFFIXES
from focus_planner.io.lens_sheet.content import lens_sheet
from focus_planner.io.lens_sheet.csv_text import sheet_to_csv
from focus_planner.io.lens_sheet.html_page import sheet_to_html
from focus_planner.io.lens_sheet.pdf_pages import sheet_to_pdf
from focus_planner.io.lens_sheet.saving import save_lens_sheet
from testing.lens_sheets import NOTES, RIG, camera, in_steps, limited, plan, shot

LARGE = cylinder_rig()
LARGE_PLAN = plan(*(camera(c.name, shot(0.3 + k / 1000)) for k, c in enumerate(LARGE.cameras)))
PLANS = [(plan(), RIG), (in_steps(), RIG), (LARGE_PLAN, LARGE)]


# --- CSV ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("planned", "rig"), PLANS)
def test_csv_reads_back_as_the_plan(planned, rig):
    rows = list(csv.DictReader(io.StringIO(sheet_to_csv(lens_sheet(planned, rig)), newline="")))
    shots = {(c.name, k): (c, s) for c in planned.cameras for k, s in enumerate(c.shots, 1)}
    assert len(rows) == len(shots)
    for row in rows:
        planned_camera, planned_shot = shots.pop((row["name"], int(row.get("shot", 1))))
        assert float(row["distance_m"]) == planned_shot.focus_distance
        assert float(row["dioptres"]) == 1 / planned_shot.focus_distance
        assert float(row["near_m"]) == planned_shot.near_limit
        assert float(row["far_m"]) == planned_shot.far_limit
        told = row["from_sensor_m"]
        assert (float(told) if told else None) == planned_shot.from_sensor
        value = row.get("device_value")
        assert (float(value) if value else None) == planned_shot.device_value
        assert (row.get("device_unit") or None) == planned_camera.device_unit
        assert (row["set"], row["checked"]) == ("", "")


@pytest.mark.parametrize(("planned", "rig"), PLANS)
def test_csv_tells_programs_where_each_picture_is_taken_and_whether(planned, rig):
    rows = list(csv.DictReader(io.StringIO(sheet_to_csv(lens_sheet(planned, rig)), newline="")))
    poses = {each.name: (each.position, each.orientation) for each in rig.cameras}
    shots = {(c.name, k): s for c in planned.cameras for k, s in enumerate(c.shots, 1)}
    assert [int(row["picture"]) for row in rows] == list(range(1, len(shots) + 1))
    for row in rows:
        assert tuple(float(row[key]) for key in ("x_m", "y_m", "z_m")) == poses[row["name"]][0]
        turn = tuple(float(row[key]) for key in ("qx", "qy", "qz", "qw"))
        assert turn == poses[row["name"]][1]
        needed = shots[row["name"], int(row.get("shot", 1))].assigned_samples > 0
        assert int(row["take"]) == needed
        assert row["frame"] == "world"
    assert list(rows[0])[:3] == ["set", "name", "shot" if planned.shots > 1 else "distance_m"]


def test_csv_of_one_camera_is_in_shooting_order():
    rig = gantry_rig(0.8, 0.5, 0.4, rows=3, columns=4)
    planned = plan(*(camera(each.name, shot(0.4), shot(0.5)) for each in rig.cameras))
    rows = csv.DictReader(io.StringIO(sheet_to_csv(lens_sheet(planned, rig)), newline=""))
    taken = [(row["name"], row["shot"]) for row in rows]
    assert taken == [(each.name, k) for each in rig.cameras for k in "12"]
    assert taken[8][0] == "cam_1_03"
    # Nothing of it is printed.
    assert "picture" not in sheet_to_html(lens_sheet(planned, rig))


def test_csv_lines_end_as_rfc_4180_says():
    text = sheet_to_csv(lens_sheet(plan(), RIG))
    assert text.endswith("\r\n")
    assert text.count("\r\n") == text.count("\n") == len(RIG) + 1
    assert len({len(row) for row in csv.reader(io.StringIO(text, newline=""))}) == 1


def test_csv_writes_whole_steps_as_whole_numbers():
    rows = csv.DictReader(io.StringIO(sheet_to_csv(lens_sheet(in_steps(), RIG)), newline=""))
    values = {row["device_value"] for row in rows}
    assert {"1235", "7.25", ""} <= values
    assert not any(value.endswith(".0") for value in values)


def test_every_format_tells_which_cameras_take_no_picture():
    sheet = lens_sheet(limited(), RIG)
    rows = list(csv.DictReader(io.StringIO(sheet_to_csv(sheet), newline="")))
    idle = {row["name"]: row for row in rows if not row["picture"]}
    assert set(idle) == {"cam_0_00", "cam_1_00"}
    for row in idle.values():
        assert (row["take"], row["shot"]) == ("0", "")
    html = sheet_to_html(sheet)
    assert html.count("takes no picture: leave as it is") == 1
    assert "5, of at most 6" in html
    text = "".join(page.extract_text() for page in PdfReader(io.BytesIO(sheet_to_pdf(sheet))).pages)
    assert "takes no picture" in text


def test_csv_writes_infinity_as_programs_read_it():
    rows = csv.DictReader(io.StringIO(sheet_to_csv(lens_sheet(plan(), RIG)), newline=""))
    far = {row["name"]: row["far_m"] for row in rows}
    assert far["cam_1_00"] == "inf"
    assert math.isinf(float(far["cam_1_00"]))


@pytest.mark.parametrize("unit", ["=cmd|' /C calc'!A0", "+1", "-1", "@SUM(A1)", " =1", "＝1"])
def test_csv_holds_no_formula(unit):
    planned = in_steps()
    cameras = tuple(replace(each, device_unit=unit) for each in planned.cameras)
    text = sheet_to_csv(lens_sheet(replace(planned, cameras=cameras), RIG))
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert {row["device_unit"] for row in rows} == {f"'{unit}"}
    assert {row["name"] for row in rows} == {each.name for each in cameras}
    text = sheet_to_csv(lens_sheet(planned, replace(RIG, frame_id=unit)))
    assert {row["frame"] for row in csv.DictReader(io.StringIO(text, newline=""))} == {f"'{unit}"}


HOSTILE = "\x1b[2J\u202e\x9b\r\n<b>\udcff"


@pytest.mark.parametrize("write", [sheet_to_csv, sheet_to_html])
def test_no_format_holds_what_steers_a_terminal(write):
    planned = in_steps()
    cameras = tuple(replace(each, device_unit=HOSTILE) for each in planned.cameras)
    planned = replace(planned, cameras=cameras, notes=(Note("up_axis", HOSTILE),))
    sheet = lens_sheet(planned, RIG, surface=HOSTILE, rig_file=HOSTILE)
    text = write(sheet)
    assert re.search(r"\\x1b\[2J\\u202e\\x9b (<|&lt;)b(>|&gt;)\\udcff", text)
    assert text.replace("\r\n", "").replace("\n", "").isprintable()
    assert sheet_to_pdf(sheet).startswith(b"%PDF")


# --- HTML --------------------------------------------------------------------------------------

_VOID = {"meta", "input", "br"}


class Page(HTMLParser):
    """Checks that tags are balanced, and keeps the attributes and the texts of cells."""

    def __init__(self, text):
        super().__init__()
        self.open, self.attributes, self.rows, self.names = [], [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.attributes += attrs
        if tag not in _VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in {"td", "th"}:
            self.rows[-1].append("")
            if ("scope", "row") in attrs:
                self.names.append(len(self.rows) - 1)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data


@pytest.mark.parametrize(("planned", "rig"), PLANS)
def test_html_has_every_row_in_order(planned, rig):
    sheet = lens_sheet(planned, rig)
    page = Page(sheet_to_html(sheet))
    assert page.rows[1:] == [[cell.text for cell in row.cells] for row in sheet.rows]
    assert len(page.names) == len(sheet.rows)
    assert page.attributes.count(("type", "checkbox")) == 2 * len(sheet.rows)


def test_html_needs_nothing_else():
    page = sheet_to_html(lens_sheet(plan(), RIG))
    assert not {"href", "src", "srcset", "data", "action"} & {n for n, _ in Page(page).attributes}
    assert not re.search(r"url\(|@import|https?:|<script|<link|<img", page)


def test_html_names_every_camera_once():
    page = sheet_to_html(lens_sheet(LARGE_PLAN, LARGE))
    for each in LARGE.cameras:
        assert page.count(each.name) == 1


def test_html_repeats_the_head_of_the_table_and_breaks_no_row():
    page = sheet_to_html(lens_sheet(LARGE_PLAN, LARGE))
    assert "thead { display: table-header-group; }" in page
    assert "break-inside: avoid" in page
    assert page.index("<thead>") < page.index("<tbody>")


def test_html_escapes_names():
    page = sheet_to_html(lens_sheet(plan(), RIG, surface="<a> & b.ply"))
    assert "&lt;a&gt; &amp; b.ply" in page
    assert "paper&#x27;s lens &lt;50 mm&gt; &amp; no table" in page
    assert "<a>" not in page


# --- PDF ---------------------------------------------------------------------------------------


def pages(planned, rig, **head):
    content = sheet_to_pdf(lens_sheet(planned, rig, **head))
    return [page.extract_text() for page in PdfReader(io.BytesIO(content)).pages]


def positions(page):
    """Where the texts of a page begin."""
    found = []

    def keep(text, outer, inner, *_):
        if text.strip():
            x, y = inner[4:]
            found.append(
                (
                    x * outer[0] + y * outer[2] + outer[4],
                    x * outer[1] + y * outer[3] + outer[5],
                )
            )

    page.extract_text(visitor_text=keep)
    return found


def test_pdf_has_every_camera_once_in_order_and_the_head_on_every_page():
    texts = pages(LARGE_PLAN, LARGE)
    assert len(texts) == 4
    walked = [row.cells[1].text for row in lens_sheet(LARGE_PLAN, LARGE).rows]
    assert re.findall(r"cam_\d_\d\d", "\n".join(texts)) == walked
    for number, text in enumerate(texts, 1):
        assert f"page {number} of 4" in text
        for heading in ("camera", "distance", "sensor", "dioptres", "near", "far", "checked"):
            assert heading in text


def test_pdf_prints_what_the_sheet_says():
    (text,) = pages(plan(), RIG, surface="körper <1>.ply")
    for word in ("Lens sheet for 6 cameras", "0.447", "∞", "303.0 ± 3.5", "körper <1>.ply", "m²"):
        assert word in text
    for note in NOTES:
        assert note.text in text


def test_pdf_puts_question_marks_for_what_its_font_does_not_have():
    (text,) = pages(plan(), RIG, surface="身体.ply")
    assert "??.ply" in text


def test_pdf_is_a4_and_nothing_sticks_out():
    names = ["c" * 100, *(c.name for c in RIG.cameras[1:])]
    cameras = [replace(c, name=n) for c, n in zip(RIG.cameras, names, strict=True)]
    planned = in_steps()
    renamed = [replace(c, name=n) for c, n in zip(planned.cameras, names, strict=True)]
    sheet = lens_sheet(replace(planned, cameras=tuple(renamed)), Rig(tuple(cameras)))
    for page in PdfReader(io.BytesIO(sheet_to_pdf(sheet))).pages:
        width, height = float(page.mediabox.width), float(page.mediabox.height)
        assert (round(width), round(height)) == (595, 842)
        placed = positions(page)
        assert len(placed) > 100
        for x, y in placed:
            assert 30 < x < width - 30
            assert 20 < y < height - 20


def test_pdf_is_the_same_every_time_but_for_its_dates():
    sheet = lens_sheet(plan(), RIG)
    stamps = re.compile(rb"\(D:[^)]*\)|<[0-9a-f]{32}>")
    first, second = (stamps.sub(b"", sheet_to_pdf(sheet)) for _ in range(2))
    assert first == second


# --- files -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sheet.csv", "sheet.HTML", "sheet.pdf"])
def test_the_name_chooses_the_format(tmp_path: Path, name):
    save_lens_sheet(lens_sheet(plan(), RIG), tmp_path / name)
    start = (tmp_path / name).read_bytes()[:9]
    assert start.startswith({"csv": b"set,name", "HTML": b"<!DOCTYPE", "pdf": b"%PDF-"}[name[6:]])
    assert list(tmp_path.iterdir()) == [tmp_path / name]


@pytest.mark.parametrize("name", ["sheet.txt", "sheet", "sheet.json"])
def test_another_name_is_refused(tmp_path: Path, name):
    with pytest.raises(InputError, match=re.escape(f"a name that ends in {', '.join(SUFFIXES)}")):
        save_lens_sheet(lens_sheet(plan(), RIG), tmp_path / name)
    assert list(tmp_path.iterdir()) == []
