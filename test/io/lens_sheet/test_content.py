# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import pytest

from focus_planner import CameraStatus, InputError, Lens, Rig, cylinder_rig
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.io.lens_sheet.content import Kind, lens_sheet
from testing.lens_sheets import NOTES, RIG, camera, in_steps, limited, plan, shot


def texts(sheet):
    """What is printed: per row, the texts by key."""
    keys = [column.key for column in sheet.columns]
    return [dict(zip(keys, (c.text for c in row.cells), strict=True)) for row in sheet.rows]


def values(sheet):
    keys = [column.key for column in sheet.columns]
    return [dict(zip(keys, (c.value for c in row.cells), strict=True)) for row in sheet.rows]


def test_a_row_tells_what_to_set_and_what_for():
    rows = {row["name"]: row for row in texts(lens_sheet(plan(), RIG))}
    assert rows["cam_0_00"] == {
        "set": "",
        "name": "cam_0_00",
        "distance_m": "0.390",
        "from_sensor_m": "0.447",
        "dioptres": "2.564",
        "near_m": "0.380",
        "far_m": "0.410",
        "holds": "8 samples, 2.0 %",
        "in_focus": "75 %",
        "checked": "",
    }
    assert rows["cam_1_00"]["far_m"] == "∞"
    assert rows["cam_1_00"]["holds"] == "400 samples, 100.0 %"
    assert rows["cam_1_01"]["holds"] == "1 sample, 0.25 %"
    assert rows["cam_1_01"]["from_sensor_m"] == "–"
    for name, why in (("cam_0_01", "others image it better"), ("cam_0_02", "sees no surface")):
        assert rows[name]["holds"] == f"nothing, {why}: leave as it is"
        assert rows[name]["in_focus"] == "–"


def test_values_keep_all_their_digits():
    given = plan()
    rows = {row["name"]: row for row in values(lens_sheet(given, RIG))}
    for each in given.cameras:
        row = rows[each.name]
        assert row["distance_m"] == each.focus_distance
        assert row["from_sensor_m"] == each.from_sensor
        assert row["dioptres"] == 1 / each.focus_distance
        assert (row["near_m"], row["far_m"]) == (each.near_limit, each.far_limit)


def test_cameras_without_samples_are_idle():
    sheet = lens_sheet(plan(), RIG)
    idle = {row.cells[1].text for row in sheet.rows if row.idle}
    assert idle == {"cam_0_01", "cam_0_02"}


def test_rows_are_in_the_order_of_the_walk():
    names = [row["name"] for row in texts(lens_sheet(plan(), RIG))]
    assert names == [f"cam_{row}_{column:02d}" for column in range(3) for row in range(2)]


def test_every_shot_has_a_row_and_lenses_with_a_table_a_device_value():
    sheet = lens_sheet(in_steps(), RIG)
    rows = texts(sheet)
    assert [(row["name"], row["shot"]) for row in rows[:4]] == [
        ("cam_0_00", "1"),
        ("cam_0_00", "2"),
        ("cam_1_00", "1"),
        ("cam_1_00", "2"),
    ]
    assert len(rows) == 2 * len(RIG)
    by_shot = {(row["name"], row["shot"]): row for row in rows}
    device = ("device_value", "device_unit")
    assert [by_shot["cam_0_00", "1"][key] for key in device] == ["–", "–"]
    assert [by_shot["cam_0_01", "1"][key] for key in device] == ["1235", "steps"]
    assert [by_shot["cam_0_01", "2"][key] for key in device] == ["7.25", "steps"]
    assert by_shot["cam_0_01", "2"]["holds"] == "nothing: skip this shot"
    assert "of 2" in [column.unit for column in sheet.columns]
    assert ("device value", "what the lens's driver takes, from the lens's table") in sheet.measures


def test_without_tables_and_with_one_shot_there_are_no_columns_for_them():
    keys = [column.key for column in lens_sheet(plan(), RIG).columns]
    assert not {"shot", "device_value", "device_unit"} & set(keys)
    assert [c.key for c in lens_sheet(plan(), RIG).columns if c.kind is Kind.BOX] == [
        "set",
        "checked",
    ]


@pytest.mark.parametrize(
    ("depth", "printed"),
    [(0.5, "0.400"), (0.014, "0.400"), (0.0041, "0.400"), (0.002, "0.4000"), (1e-9, "0.400000")],
)
def test_distances_have_the_digits_that_the_depth_of_field_asks_for(depth, printed):
    one = shot(0.4, near_limit=0.4, far_limit=0.4 + depth)
    sheet = lens_sheet(plan(camera("cam_0_00", one)), Rig(RIG.cameras[:1]))
    assert texts(sheet)[0]["distance_m"] == printed


def test_the_head_tells_what_was_planned_and_how_it_is_measured():
    made = datetime(2026, 11, 26, 22, 30)  # noqa: DTZ001 - as a clock on the wall shows it
    sheet = lens_sheet(plan(), RIG, surface="a.ply", rig_file="rig.yaml", made=made)
    assert sheet.title == "Lens sheet for 6 cameras"
    assert dict(sheet.facts) == {
        "surface": "a.ply",
        "rig": "rig.yaml, frame world",
        "planned": "2026-11-26 22:30",
        "method": "k_view, on 400 samples, seed 0",
        "fresh cost": "303.0 ± 3.5 of 1000 (0 is perfect), on 4096 samples unseen by the solver",
        "in focus": "1.750 ± 0.010 m², 87.5 % of the surface",
        "cameras": "4 planned, 1 sees only what others image better, 1 sees nothing",
    }
    measures = dict(sheet.measures)
    assert "from the centre of projection" in measures["distance"]
    assert measures["from the sensor"].endswith("from the sensor plane, for thin lenses of 50 mm")
    assert sheet.notes == tuple(note.text for note in NOTES)


def test_what_is_sharp_in_how_many_views_and_how_finely_is_in_the_head():
    several = replace(
        plan(),
        views=3,
        max_mm_per_pixel=0.75,
        sharp_areas=(SharpArea(1, 1.75, 0.01), SharpArea(3, 1.25, 0.02)),
        resolution=Resolution(0.41234, 0.7),
    )
    facts = dict(lens_sheet(several, RIG).facts)
    assert facts["sharp"] == (
        "87.5 % ± 0.5 % in 1, 62.5 % ± 1.0 % in 3 views or more, of the surface"
    )
    assert facts["resolution"] == "0.412 mm per pixel in the median, 0.7 or finer for 90% of it"
    assert facts["method"] == (
        "k_view for 3 views, on 400 samples, seed 0,"
        " of what is imaged at 0.75 mm per pixel or finer"
    )
    assert facts["fresh cost"].startswith("303.0 ± 3.5 of 1000 for 3 views (0 is perfect), on 4096")
    held = [row["holds"] for row in texts(lens_sheet(several, RIG))]
    assert "nothing, sees no surface finely enough: leave as it is" in held
    assert "nothing, sees no surface: leave as it is" not in held
    assert {"sharp", "resolution"}.isdisjoint(dict(lens_sheet(plan(), RIG).facts))


def test_what_is_not_known_is_not_in_the_head():
    sheet = lens_sheet(replace(plan(), notes=()), RIG)
    assert {"surface", "planned"}.isdisjoint(dict(sheet.facts))
    assert dict(sheet.facts)["rig"] == "frame world"
    assert sheet.notes == ()
    stopped = replace(plan(), converged=False, depth_tolerance=0.002)
    assert dict(lens_sheet(stopped, RIG).facts)["method"] == (
        "k_view, on 400 samples, seed 0, for errors of depth up to 2 mm, ended before it converged"
    )


def test_lenses_of_several_lengths_and_their_hiatus_are_told():
    lenses = (Lens(0.035), Lens(0.05, hiatus=0.01))
    cameras = tuple(replace(c, lens=lenses[k % 2]) for k, c in enumerate(RIG.cameras))
    told = dict(lens_sheet(plan(), Rig(cameras)).measures)["from the sensor"]
    assert told.endswith("for lenses of 35 to 50 mm with the hiatus that the rig states")


def test_a_plan_for_another_rig_is_refused():
    with pytest.raises(InputError, match="rig: expected the cameras that the plan is for"):
        lens_sheet(plan(), cylinder_rig(3, 2))


def test_a_plan_of_an_unknown_kind_has_a_sheet_too():
    one = camera("cam_0_00", shot(0.4, 0, 0), status=CameraStatus.UNKNOWN)
    nothing = replace(plan(one), surface_area=0.0)
    sheet = lens_sheet(nothing, Rig(RIG.cameras[:1]))
    assert sheet.title == "Lens sheet for 1 camera"
    assert texts(sheet)[0]["holds"] == "unknown"


def test_cameras_without_a_picture_are_left_as_they_are():
    given = limited()
    sheet = lens_sheet(given, RIG)
    assert (given.pictures, given.shots) == (5, 2)
    # A row per picture, and one per camera that takes none.
    assert len(sheet.rows) == 7
    by_name = {}
    for row, told in zip(sheet.rows, texts(sheet), strict=True):
        by_name.setdefault(told["name"], []).append((row, told))
    idle, blind = by_name["cam_1_00"], by_name["cam_0_00"]
    for rows, why in ((idle, "takes no picture"), (blind, "sees no surface")):
        ((row, told),) = rows
        assert told["holds"] == f"nothing, {why}: leave as it is"
        assert told["shot"] == told["in_focus"] == "–"
        assert row.idle
        picture, take, *_ = row.capture
        assert (picture, take) == (None, 0)
    assert idle[0][1]["device_value"] == "1237"
    numbers = [row.capture[0] for row in sheet.rows if row.capture[0] is not None]
    assert numbers == [1, 2, 3, 4, 5]
    # A camera that is moved stops for its pictures only.
    moved = lens_sheet(given, replace(RIG, grid=None, sequence=True))
    assert [row.capture[0] for row in moved.rows] == [1, 2, 3, 4, 5]
    facts = dict(sheet.facts)
    assert facts["pictures"] == "5, of at most 6"
    assert "1 takes no picture" in facts["cameras"]
    assert "pictures" not in dict(lens_sheet(plan(), RIG).facts)
