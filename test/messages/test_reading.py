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

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from focus_planner.core.notes import Note
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io.lens_tables import LensTables
from focus_planner.messages.cdr import write_mesh
from focus_planner.messages.reading import (
    Datatype,
    camera_from_message,
    cloud_from_message,
    intrinsics_from_message,
    lens_from_message,
    mesh_from_bytes,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.requests import request_from_message
from focus_planner.messages.writing import cloud_to_fields
from focus_planner.parameters.planner_settings import Settings
from testing.messages import (
    BAD_CLOUDS,
    EMPTY_CAMERA,
    EMPTY_INFO,
    EMPTY_LENS,
    EMPTY_POSE,
    EMPTY_REQUEST,
    EMPTY_TABLE,
    NUMBERS,
    OPTICS,
    cloud_fields,
    cloud_layouts,
    importance_fields,
    message,
)

WORLD = {"header": {"frame_id": "world"}}


def lens_message(**fields):
    return message(EMPTY_LENS | fields)


def camera_message(**fields):
    return message(EMPTY_CAMERA | fields)


def request_message(**fields):
    return message(EMPTY_REQUEST | fields)


def read_cloud(fields, **options):
    return cloud_from_message(message(fields), "world", **options)


def test_a_lens_by_f_number_and_circle_of_confusion():
    lens = lens_from_message(
        lens_message(focal_length=0.05, f_number=8.0, circle_of_confusion=3.125e-5)
    )
    assert lens.focal_length == 0.05
    assert lens.hyperfocal_distance == pytest.approx(10.0)
    with pytest.raises(InputError, match=r"lens\.f_number: expected a number above 0, got 0"):
        lens_from_message(lens_message(focal_length=0.05))


def test_a_table_that_makes_no_sense_is_an_input_error():
    def table(**fields):
        return lens_message(focal_length=0.05, hyperfocal_distance=9.0, table=EMPTY_TABLE | fields)

    assert lens_from_message(table()).table is None
    assert lens_from_message(table(unit="dioptres")).table == LensTable("dioptres")
    for fields, told in [
        ({"distances": [1.0, 2.0], "values": [0.0, 1.0]}, "unit: expected a name .* got ''"),
        ({"values": [0.0, 1.0]}, "unit: expected a name"),
        ({"unit": "steps"}, "distances: expected at least 2 with the unit steps, got none"),
        ({"unit": "steps", "distances": [1.0, 2.0], "values": [3.0]}, "values: expected as many"),
    ]:
        with pytest.raises(InputError, match=r"^lens\.table\." + told):
            lens_from_message(table(**fields))
    stepped = {"unit": "s", "distances": [1.0, 2.0], "values": [3.0, 0.0], "step": 1.5}
    assert lens_from_message(table(**stepped)).table == LensTable("s", False, (1, 2), (3, 0), 1.5)
    whole = {"unit": "s", "whole": True, "distances": [1.0, 2.0], "values": [3.0, 0.0]}
    with pytest.raises(
        InputError, match=r"^lens\.table: expected either a table of whole values or steps,"
    ):
        lens_from_message(message(vars(table(**whole)) | {"focus_distances": [1.0]}))


def test_tables_are_given_to_cameras_that_bring_none():
    own = LensTable("m")
    tables = LensTables({"a": LensTable("dioptres"), "b": LensTable("dioptres")})
    optics = replace(OPTICS, tables=tables)
    lens = EMPTY_LENS | {"focal_length": 0.05, "hyperfocal_distance": 9.0}
    cameras = [
        EMPTY_CAMERA | {"name": "a", "lens": lens},
        EMPTY_CAMERA | {"name": "b", "lens": lens | {"table": EMPTY_TABLE | {"unit": "m"}}},
        EMPTY_CAMERA | {"name": "c"},
    ]
    fields = WORLD | {"cameras": cameras, "grid_rows": 0, "grid_columns": 0}
    rig = rig_from_message(message(fields), optics, "world")
    assert [camera.lens.table for camera in rig.cameras] == [LensTable("dioptres"), own, None]
    assert rig.cameras[2].lens == OPTICS.lens
    poses = message(WORLD | {"poses": [EMPTY_POSE]})
    with pytest.raises(InputError, match=r"cameras: expected some of the rig's 1: cam_000, got a"):
        poses_from_message(poses, optics, "world")
    by_number = replace(OPTICS, tables=LensTables({"cam_000": own}))
    assert poses_from_message(poses, by_number, "world").cameras[0].lens.table == own


def test_what_a_request_leaves_out_is_the_default():
    defaults = PlanRequest("em", 0, 8, 3, "assigned", "grid", 9.0, 2, 0.01, 10, 1.5, "tight", 0.01)
    defaults = replace(defaults, views=3, images=7, max_mm_per_pixel=0.5, worst=True)
    assert request_from_message(request_message(), defaults) == defaults
    own = request_from_message(request_message(bound="none", gap=0.5), defaults)
    assert own == replace(defaults, bound="none", gap=0.5)


def test_a_request_that_makes_no_sense_is_an_input_error():
    with pytest.raises(InputError, match="time_budget: expected a number of at least 0, got nan"):
        request_from_message(request_message(time_budget=math.nan), PlanRequest())
    with pytest.raises(InputError, match=r"method: expected one of .*, got 'guess'"):
        request_from_message(request_message(method="guess"), PlanRequest())
    with pytest.raises(InputError, match="bound: expected one of none, quick, tight, got 'some'"):
        request_from_message(request_message(bound="some"), PlanRequest())
    for gap in (math.nan, -1.0, 2.0, math.inf):
        with pytest.raises(InputError, match="gap: expected"):
            request_from_message(request_message(gap=gap), PlanRequest())


# --- clouds ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["importance", "weight"])
@pytest.mark.parametrize(("kind", "datatype"), NUMBERS)
def test_importance_may_be_any_type_of_number(kind, datatype, name):
    fields = importance_fields(np.arange(40), name=name, kind=kind, datatype=datatype)
    cloud = read_cloud(fields, importance_field=name)
    np.testing.assert_array_equal(cloud.importance, np.arange(40))


def test_only_importance_counts_by_itself():
    fields = importance_fields(np.arange(40))
    weight = {"name": "weight", "offset": 0, "datatype": Datatype.FLOAT64, "count": 1}
    fields["fields"].append(weight)
    cloud = read_cloud(fields)
    np.testing.assert_array_equal(cloud.importance, np.arange(40))
    (note,) = cloud.notes
    assert note == Note(
        "importance",
        "cloud: importance is used as the importance of the surface; rename it if it is something"
        " else",
    )
    cloud = read_cloud(importance_fields(np.arange(40), name="weight"))
    assert cloud.importance is None
    (note,) = cloud.notes
    assert note == Note(
        "importance",
        "cloud: weight is not used, since scanners call their confidence so; if it is the"
        " importance, give parameter importance_field the value weight",
    )


def test_a_field_that_is_asked_for_must_be_there():
    telling = r"cloud: expected weight, which parameter importance_field asks for, .*got importance"
    with pytest.raises(InputError, match=telling):
        read_cloud(importance_fields(np.arange(40)), importance_field="weight")


@pytest.mark.parametrize("dense", [True, False])
@pytest.mark.parametrize(
    ("bad", "error"),
    [
        (math.nan, r"cloud importance: expected finite numbers, got NaN .*\(first: point 7\)"),
        (math.inf, "cloud importance: expected finite numbers"),
        (-1.0, r"cloud importance: expected numbers of at least 0, got 1 of 40 below"),
    ],
)
def test_a_bad_importance_is_an_input_error_dense_or_not(bad, error, dense):
    values = np.ones(40)
    values[7] = bad
    with pytest.raises(InputError, match=error):
        read_cloud(importance_fields(values) | {"is_dense": dense})


def test_points_that_are_left_out_take_their_importance_along():
    points = np.random.default_rng(3).normal(size=(20, 3))
    fields = cloud_to_fields(PointCloud(points, importance=np.arange(20)), "world")
    table = np.frombuffer(fields["data"]).reshape(20, 4).copy()
    table[5] = math.nan
    received = read_cloud(fields | {"data": table.tobytes(), "is_dense": False})
    np.testing.assert_array_equal(received.importance, np.delete(np.arange(20), 5))


def test_an_importance_of_several_numbers_is_an_input_error():
    fields = importance_fields(np.arange(40), kind="u1", datatype=Datatype.UINT8)
    fields["fields"][-1]["count"] = 2
    with pytest.raises(InputError, match="field importance: expected one number, got 2 of"):
        read_cloud(fields)
    fields["fields"][-1] |= {"count": 1, "datatype": 99}
    with pytest.raises(InputError, match="expected one number, got 1 of datatype 99"):
        read_cloud(fields)


@given(cloud_layouts)
def test_any_layout_of_a_cloud_is_read(layout):
    points = np.random.default_rng(2).normal(size=(20, 3)).astype(layout["dtype"])
    np.testing.assert_array_equal(read_cloud(cloud_fields(points, **layout)).points, points)


@pytest.mark.parametrize("dense", [True, False])
def test_points_that_are_not_finite_are_left_out_whatever_the_cloud_says(dense):
    points = np.random.default_rng(3).normal(size=(20, 3))
    points[[3, 7], [0, 2]] = math.nan
    cloud = read_cloud(cloud_fields(points, dtype="f8") | {"is_dense": dense})
    np.testing.assert_array_equal(cloud.points, np.delete(points, [3, 7], axis=0))
    (note,) = cloud.notes
    assert note.code == "left_out"
    assert note.text.startswith("left out: 2 of 20 points, which are not finite numbers")


def test_normals_that_are_none_are_as_if_there_were_none():
    points = np.random.default_rng(3).normal(size=(20, 3))
    fields = cloud_to_fields(PointCloud(points, points), "world")
    table = np.frombuffer(fields["data"]).reshape(20, 6).copy()
    table[5, 3:] = math.nan
    assert read_cloud(fields | {"data": table.tobytes()}).normals is not None
    table[:, 3:] = 0
    cloud = read_cloud(fields | {"data": table.tobytes()})
    assert cloud.normals is None
    assert [note.code for note in cloud.notes] == ["left_out"]


def test_triangles_that_are_no_surface_are_left_out():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, math.nan]])
    triangles = np.array([[0, 1, 2], [0, 1, 1], [0, 1, 3]], dtype=np.int32)
    mesh = mesh_from_bytes(write_mesh(triangles, vertices))
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], [vertices[:3]])
    assert [note.text.split(",")[0] for note in mesh.notes] == [
        "left out: 1 of 3 triangles",
        "left out: 1 of 3 triangles",
    ]
    with pytest.raises(InputError, match="vertex indices from 0 to 3"):
        mesh_from_bytes(write_mesh(triangles + 1, vertices))


@pytest.mark.parametrize(("change", "error"), BAD_CLOUDS)
def test_a_cloud_that_contradicts_itself_is_an_input_error(change, error):
    with pytest.raises(InputError, match=error):
        read_cloud(cloud_fields(np.zeros((20, 3))) | change)


def test_no_cloud_has_points_of_gigabytes():
    fields = cloud_fields(np.zeros((20, 3))) | {"width": 1, "point_step": 2**31, "row_step": 2**31}
    large = message(fields)
    large.data = np.broadcast_to(np.uint8(0), 2**31)  # which takes one byte
    with pytest.raises(InputError, match="cloud point_step: expected at most 2147483647 bytes"):
        cloud_from_message(large, "world")


@pytest.mark.parametrize("size", [0, 2**31 - 1])
def test_a_cloud_without_points_is_empty_whatever_its_fields(size):
    fields = cloud_fields(np.zeros((20, 3)))
    empty = {"width": 0, "point_step": size, "row_step": 0, "data": b"", "fields": []}
    with pytest.raises(InputError, match="cloud: expected at least 16 points, got an empty cloud"):
        read_cloud(fields | empty)


# --- cameras -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("orientation", "error"),
    [
        ({"w": 0.0}, "cam_001: orientation: .*probably never set"),
        ({"x": math.nan}, "cam_001: orientation"),
        ({"w": 2.0}, "of norm 2"),
    ],
)
def test_an_orientation_that_is_none_is_an_input_error(orientation, error):
    pose = EMPTY_POSE | {"orientation": EMPTY_POSE["orientation"] | orientation}
    with pytest.raises(InputError, match=error):
        poses_from_message(message(WORLD | {"poses": [EMPTY_POSE, pose]}), OPTICS, "world")


def test_an_empty_rig_is_an_input_error():
    with pytest.raises(InputError, match="rig: expected at least one camera, got none"):
        poses_from_message(message(WORLD | {"poses": []}), OPTICS, "world")
    rig = WORLD | {"cameras": [], "grid_rows": 0, "grid_columns": 0}
    with pytest.raises(InputError, match="rig: expected at least one camera, got none"):
        rig_from_message(message(rig), OPTICS, "world")


def test_a_camera_takes_what_it_leaves_out_from_the_optics():
    camera = camera_from_message(camera_message(name="left"), OPTICS)
    assert (camera.intrinsics, camera.lens) == (OPTICS.intrinsics, OPTICS.lens)


def test_errors_of_a_camera_name_it():
    info = EMPTY_INFO | {"width": 10, "height": 10}
    with pytest.raises(InputError, match=r"camera left: image\.fx: expected a number above 0"):
        camera_from_message(camera_message(name="left", camera_info=info), OPTICS)
    lens = EMPTY_LENS | {"focal_length": -0.05, "hyperfocal_distance": 1.0}
    with pytest.raises(InputError, match=r"camera left: lens\.focal_length"):
        camera_from_message(camera_message(name="left", lens=lens), OPTICS)


def full_frame(**lens):
    """A camera of 24 megapixels of 6 µm."""
    f = 0.05 / 6e-6
    info = EMPTY_INFO | {"width": 6000, "height": 4000, "k": [f, 0, 2999.5, 0, f, 1999.5, 0, 0, 1]}
    fields = EMPTY_LENS | {"focal_length": 0.05} | lens if lens else EMPTY_LENS
    return EMPTY_CAMERA | {"camera_info": info, "lens": fields, "pose": AT_THE_ORIGIN}


AT_THE_ORIGIN = EMPTY_POSE | {"orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
ABOUT_CIRCLES = (
    "nothing tells the circle of confusion of 1 of 2 cameras: 12 µm is assumed, two pixels;"
)


def rig_of(cameras, optics):
    named = [camera | {"name": f"cam_{i}"} for i, camera in enumerate(cameras)]
    fields = WORLD | {"cameras": named, "grid_rows": 0, "grid_columns": 0}
    return rig_from_message(message(fields), optics, "world")


def test_an_f_number_on_a_topic_takes_two_pixels_and_says_so():
    told = full_frame(f_number=8.0, circle_of_confusion=2e-5)
    rig = rig_of([full_frame(f_number=8.0), told], OPTICS)
    assert [camera.lens.circle_of_confusion for camera in rig.cameras] == [
        pytest.approx(12e-6),
        2e-5,
    ]
    assert rig.cameras[0].lens.hyperfocal_distance == pytest.approx(0.05**2 / (8 * 12e-6))
    (note,) = rig.notes
    assert note.code == "default_lens"
    assert note.text.startswith(ABOUT_CIRCLES)
    assert note.text.endswith("or set the parameter lens.circle_of_confusion")
    assert rig.assumed == {"cam_0": {"lens.circle_of_confusion"}}


def test_an_f_number_of_the_parameters_is_that_of_every_cameras_own_image():
    values = {"lens.focal_length": 0.05001, "lens.hyperfocal_distance": 0.0, "lens.f_number": 8.0}
    optics = Settings.from_values(values).optics
    told = full_frame(f_number=8.0, circle_of_confusion=2e-5)
    rig = rig_of([full_frame(), told], optics)
    assert rig.cameras[0].lens.circle_of_confusion == pytest.approx(2 * 0.05001 / 0.05 * 6e-6)
    assert rig.cameras[1].lens.circle_of_confusion == 2e-5
    (note,) = rig.notes
    assert note.text.startswith(ABOUT_CIRCLES)
    posed = poses_from_message(message(WORLD | {"poses": [AT_THE_ORIGIN]}), optics, "world")
    image = CameraIntrinsics()
    diagonal = 0.05001 * math.hypot(image.width / image.fx, image.height / image.fy)
    assert posed.cameras[0].lens.circle_of_confusion == pytest.approx(diagonal / 1500)
    texts = [note.text for note in posed.notes if note.code == "default_lens"]
    assert ["the sensor's diagonal / 1500" in text for text in texts] == [True]


def test_an_f_number_without_effect_is_told():
    optics = Settings.from_values({"lens.f_number": 8.0, "lens.hyperfocal_distance": 7.0}).optics
    rig = rig_of([full_frame()], optics)
    assert rig.cameras[0].lens.hyperfocal_distance == 7.0
    assert rig.notes[-1].text == (
        "lens.f_number 8 is not used, because lens.hyperfocal_distance is 7 m; set that to 0"
    )
    assert rig_of([full_frame(hyperfocal_distance=9.0)], optics).notes == ()


@pytest.mark.parametrize(
    ("lens", "told"),
    [
        ({"focal_length": 50.0, "hyperfocal_distance": 9.0}, "lens.focal_length: .* write 0.05$"),
        ({"focal_length": 50.0, "f_number": 8.0}, "lens.focal_length: .* write 0.05$"),
        ({"f_number": 8.0, "circle_of_confusion": 0.03}, "circle_of_confusion: .* write 3e-05$"),
        ({"hyperfocal_distance": 9.0, "min_focus": 350.0}, "lens.min_focus: .* write 0.35$"),
        ({"f_number": -8.0}, "lens.f_number: expected a number above 0, got -8$"),
    ],
)
def test_a_lens_in_millimetres_on_a_topic_names_its_camera(lens, told):
    with pytest.raises(InputError, match=f"^camera cam_0: .*{told}"):
        rig_of([full_frame(**lens)], OPTICS)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"lens.focal_length": 50.0}, "^lens.focal_length: .* write 0.05$"),
        ({"lens.circle_of_confusion": 0.03}, "^lens.circle_of_confusion: .* write 3e-05$"),
        (
            {"lens.hyperfocal_distance": 0.0, "lens.f_number": 8.0, "lens.focal_length": 35.0},
            "^lens.focal_length: .* write 0.035$",
        ),
    ],
)
def test_parameters_in_millimetres_are_told(values, told):
    with pytest.raises(InputError, match=told):
        Settings.from_values(values)


INFO = EMPTY_INFO | {"width": 64, "height": 48, "k": [50, 0, 31.5, 0, 51, 23.5, 0, 0, 1]}
IMAGE = CameraIntrinsics(64, 48, 50, 51, 31.5, 23.5)


def info_message(**fields):
    return message(INFO | fields)


def roi(x_offset=0, y_offset=0, width=0, height=0, do_rectify=False):
    return {
        "x_offset": x_offset,
        "y_offset": y_offset,
        "width": width,
        "height": height,
        "do_rectify": do_rectify,
    }


@pytest.mark.parametrize(
    ("fields", "changes"),
    [
        ({}, {}),
        ({"binning_x": 1, "binning_y": 1, "roi": roi(0, 0, 64, 48)}, {}),
        ({"binning_x": 2}, {"binning": (2, 1)}),
        ({"binning_y": 4}, {"binning": (1, 4)}),
        ({"roi": roi(8, 4, 20, 10)}, {"region": (8, 4, 20, 10)}),
        # Which part is read out does not depend on what a rectified image is made of.
        ({"roi": roi(8, 4, 20, 10, True)}, {"region": (8, 4, 20, 10)}),
        ({"roi": roi(8, 4)}, {}),
        ({"distortion_model": "plumb_bob", "d": [0.0] * 5}, {}),
        ({"distortion_model": "plumb_bob", "d": []}, {}),
        ({"distortion_model": "plumb_bob", "d": [0.0] * 8}, {}),
        ({"distortion_model": "of this maker", "d": [0.0]}, {}),
        (
            {"distortion_model": "plumb_bob", "d": [0.1, 0, 0, 0]},
            {"distortion_model": "plumb_bob", "distortion": (0.1, 0.0, 0.0, 0.0)},
        ),
        (
            {"distortion_model": "equidistant", "d": [0.0] * 4},
            {"distortion_model": "equidistant", "distortion": (0.0,) * 4},
        ),
    ],
)
def test_camera_info_is_read_as_it_is_documented(fields, changes):
    assert intrinsics_from_message(info_message(**fields)) == replace(IMAGE, **changes)


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        (
            {"distortion_model": "of this maker", "d": [0.0, 0.1]},
            r"image\.distortion_model: expected one of .*, got 'of this maker'; for rectified",
        ),
        ({"d": [0.1] * 5}, r"image\.distortion_model: expected one of .*, got ''"),
        (
            {"distortion_model": "plumb_bob", "d": [0.1] * 6},
            r"image\.distortion: expected 4 or 5 coefficients of the model plumb_bob, got 6",
        ),
        ({"distortion_model": "equidistant"}, r"image\.distortion: expected 4 coefficients"),
        (
            {"distortion_model": "plumb_bob", "d": [0.1, math.nan, 0.0, 0.0]},
            r"image\.distortion\[1\]: expected a number, got nan",
        ),
        ({"roi": roi(8, 4, 60, 10)}, r"image\.region: expected .* pixels, got 60 × 10 at \(8, 4"),
        ({"roi": roi(8, 4, 20, 0)}, r"image\.region\[3\]: expected a whole number of at least 1"),
        ({"binning_x": 65}, r"image\.binning: expected at most 64 × 48, .*, got 65 × 1"),
        (
            {"width": 0, "d": [0.1]},
            r"camera_info\.width: expected the width of the image, with dis",
        ),
        ({"width": 0, "binning_y": 2}, r"camera_info\.width: expected .*, got 0; fill in width"),
        ({"width": 0, "roi": roi(8, 4, 20, 9)}, r"camera_info\.width: expected .*, got 0"),
    ],
)
def test_camera_info_that_makes_no_image_is_an_input_error_of_its_camera(fields, error):
    with pytest.raises(InputError, match=f"camera left: {error}"):
        camera_from_message(camera_message(name="left", camera_info=INFO | fields), OPTICS)


COLOURS = np.random.default_rng(11).integers(0, 256, (40, 3))


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize(
    ("name", "datatype"),
    [("rgb", Datatype.FLOAT32), ("rgb", Datatype.UINT32), ("rgba", Datatype.UINT32)],
)
def test_packed_colours(name, datatype, big_endian):
    packed = (COLOURS @ [1 << 16, 1 << 8, 1]).astype(np.uint32)
    packed |= 0xFF << 24 if name == "rgba" else 0  # as a float, it would be no number
    order = ">" if big_endian else "<"
    columns = np.random.default_rng(2).normal(size=(40, 3))
    fields = cloud_fields(columns, gap=4, big_endian=big_endian)
    data = np.frombuffer(fields["data"], np.uint8).reshape(40, -1).copy()
    data[:, :4] = packed.astype(f"{order}u4")[:, None].view(np.uint8)
    fields["data"] = data.tobytes()
    fields["fields"].append({"name": name, "offset": 0, "datatype": int(datatype), "count": 1})
    np.testing.assert_array_equal(read_cloud(fields).colours, COLOURS)


def test_colours_in_fields_of_their_own():
    fields = importance_fields(COLOURS[:, 0], name="r", kind="u1", datatype=Datatype.UINT8)
    assert read_cloud(fields).colours is None
    offset = fields["fields"][-1]["offset"]
    for name in ("g", "b"):
        fields["fields"].append({**fields["fields"][-1], "name": name, "offset": offset})
    expected = np.repeat(COLOURS[:, :1], 3, axis=1)
    np.testing.assert_array_equal(read_cloud(fields).colours, expected)


@pytest.mark.parametrize(
    "field",
    [
        {"datatype": int(Datatype.UINT8)},
        {"datatype": int(Datatype.FLOAT64)},
        {"datatype": 99},
        {"count": 3},
        {"offset": 10**9},
    ],
)
def test_colours_in_no_form_that_is_known_are_not_looked_at(field):
    fields = importance_fields(np.arange(40))
    known = {"name": "rgb", "offset": 0, "datatype": int(Datatype.FLOAT32), "count": 1}
    fields["fields"].append(known | field)
    cloud = read_cloud(fields)
    assert cloud.colours is None
    assert len(cloud.points) == 40


def test_without_colours_a_cloud_is_written_as_before():
    points = np.random.default_rng(1).normal(size=(20, 3))
    fields = cloud_to_fields(PointCloud(points), "world")
    assert fields["data"] == points.astype("<f8").tobytes()
    assert [field["name"] for field in fields["fields"]] == ["x", "y", "z"]
