import dataclasses
import math

import numpy as np
import pytest
import reference
from hypothesis import given
from hypothesis import strategies as st

from focus_planner import (
    Camera,
    CameraStatus,
    CostModel,
    Grid,
    Image,
    InputError,
    Lens,
    LensTable,
    Mesh,
    PointCloud,
    Rig,
)

STRAIGHT = (0.0, 0.0, 0.0, 1.0)
COUNTED = LensTable("focus_absolute", True, (0.3, 0.5, 3.0), (30, 20, 6))
RANGE = LensTable("steps", False, (0.4, 2.0), (0, 1000))
TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def camera(name="a", **changes):
    return Camera(**{"name": name, "position": (0, 0, 0), "orientation": STRAIGHT} | changes)


def test_the_defaults_are_the_papers():
    lens, image, model = Lens(), Image(), CostModel()
    assert (lens.focal_length, lens.hyperfocal_distance) == (0.05, 10.0)
    assert (lens.min_focus, lens.max_focus) == (0.0, math.inf)
    assert (image.width, image.height) == (580, 870)
    assert (image.fx, image.fy, image.cx, image.cy) == (1190.732, 1190.732, 284.813, 434.440)
    assert model == CostModel(1 / 3, 1 / 3, 1 / 3, 1.0, 0.75)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"focal_length": 0}, "lens.focal_length: expected a number above 0, got 0"),
        ({"focal_length": math.nan}, "lens.focal_length: expected a number above 0, got nan"),
        (
            {"hyperfocal_distance": 0.05},
            r"lens.hyperfocal_distance: expected a number above 0.05, got 0.05",
        ),
        ({"hyperfocal_distance": math.inf}, "lens.hyperfocal_distance: .* got inf"),
        ({"min_focus": -0.1}, "lens.min_focus: expected a number of at least 0, got -0.1"),
        ({"min_focus": math.inf}, "lens.min_focus: .* got inf"),
        ({"min_focus": 1e13}, r"lens.min_focus: expected metres up to 1e\+12, got 1e\+13"),
        ({"hyperfocal_distance": 1e308}, "lens.hyperfocal_distance: expected metres up to"),
        ({"focus_distances": [1e13]}, "lens.focus_distances: expected metres up to"),
        ({"max_focus": 0.05}, "lens.max_focus: expected a number above 0.05, got 0.05"),
        (
            {"min_focus": 2.0, "max_focus": 1.5},
            r"lens.min_focus: expected at most max_focus \(1.5 m\), got 2 m",
        ),
        ({"focus_distances": 3.0}, "lens.focus_distances: expected a list of distances .* got 3.0"),
        ({"focus_distances": "0.5"}, "lens.focus_distances: expected a list of distances"),
        ({"focus_distances": []}, "lens.focus_distances: expected 1 to 65536 distances, got 0; le"),
        (
            {"focus_distances": [1.0, 0.05]},
            r"lens.focus_distances\[1\]: expected a number above 0.05, got 0.05",
        ),
        ({"focus_distances": [math.inf]}, r"lens.focus_distances\[0\]: .* got inf"),
        ({"focus_distances": [1.0, math.nan]}, r"lens.focus_distances\[1\]: .* got nan"),
        ({"focus_distances": ["a"]}, r"lens.focus_distances\[0\]: .* got 'a'"),
        (
            {"focus_distances": [0.5, 0.4], "min_focus": 0.45},
            r"lens.focus_distances: expected distances from min_focus \(0.45 m\) .* 0.4 to 0.5 m",
        ),
        ({"focus_distances": [2.0], "max_focus": 1.5}, "lens.focus_distances: .* got 2 to 2 m"),
        (
            {"focus_steps": 1, "min_focus": 0.4},
            "lens.focus_steps: expected a whole number of at least 2, got 1",
        ),
        ({"focus_steps": 2.5, "min_focus": 0.4}, "lens.focus_steps: .* got 2.5"),
        ({"focus_steps": 10**6, "min_focus": 0.4}, "lens.focus_steps: expected at most 65536"),
        (
            {"focus_steps": 9},
            r"lens.min_focus: expected a number above focal_length \(0.05 m\), with focus_steps",
        ),
        (
            {"focus_steps": 9, "focus_distances": [1.0], "min_focus": 0.4},
            "lens.focus_steps: expected focus_distances or focus_steps, got both",
        ),
        ({"table": "dioptres"}, "lens.table: expected a LensTable, got 'dioptres'"),
        (
            {"table": COUNTED, "min_focus": 3.5},
            r"lens.table: expected distances from min_focus \(3.5 m\) to .* got 0.3 to 3 m",
        ),
        ({"table": COUNTED, "max_focus": 0.2}, r"max_focus \(0.2 m\), above .* got 0.3 to 3 m"),
        (
            {"table": RANGE, "focal_length": 2.5},
            r"above focal_length \(2.5 m\), got 0.4 to 2 m",
        ),
        (
            {"table": COUNTED, "min_focus": 2.9, "max_focus": 2.95},
            "lens.table: .* got none of 25 whole values there",
        ),
        (
            {"table": COUNTED, "focus_distances": [1.0]},
            "lens.table: expected a table of whole values, focus_distances or focus_steps, got two",
        ),
        ({"table": COUNTED, "focus_steps": 9, "min_focus": 0.4}, "lens.table: .* got two of them"),
        (
            {"table": RANGE, "focus_distances": [1.0, 3.0]},
            r"from min_focus \(0.4 m\) to max_focus \(2 m\), as the lens's table leaves them",
        ),
        (
            {"table": LensTable("m"), "focus_steps": 9},
            "lens.min_focus: expected a number above focal_length .*, with focus_steps, got 0",
        ),
    ],
)
def test_lenses_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        Lens(**values)


def test_a_lens_may_take_a_list_of_distances():
    lens = Lens(focus_distances=[2.0, 0.5, 2.0, 1])
    assert lens.focus_distances == (0.5, 1.0, 2.0)
    assert lens.settable_distances.tolist() == [0.5, 1.0, 2.0]
    assert lens == Lens(focus_distances=np.array([0.5, 1.0, 2.0]))
    assert hash(lens) == hash(Lens(focus_distances=(0.5, 1.0, 2.0)))
    assert lens != Lens()
    assert Lens().settable_distances is None
    with pytest.raises(ValueError, match="read-only"):
        lens.settable_distances[0] = 1


def test_a_lens_may_have_steps_equal_in_dioptres():
    lens = Lens(min_focus=0.3, max_focus=3.0, focus_steps=10)
    settable = lens.settable_distances
    assert (settable[0], settable[-1], len(settable)) == (0.3, 3.0, 10)
    assert (np.diff(settable) > 0).all()
    np.testing.assert_allclose(np.diff(1 / settable), (1 / 3.0 - 1 / 0.3) / 9)
    np.testing.assert_allclose(settable, reference.settable(lens))
    assert Lens(min_focus=0.7, max_focus=0.7, focus_steps=2).settable_distances.tolist() == [0.7]


@given(st.floats(0.1, 1.0), st.floats(1.0, 20.0), st.integers(2, 200))
def test_the_limits_are_steps_exactly(low, ratio, steps):
    settable = Lens(min_focus=low, max_focus=low * ratio, focus_steps=steps).settable_distances
    assert (settable[0], settable[-1]) == (low, low * ratio)
    assert len(settable) <= steps


def test_a_step_at_infinity_counts_but_is_not_taken():
    settable = Lens(min_focus=0.5, focus_steps=5).settable_distances
    assert settable.tolist() == [0.5, 1 / 1.5, 1.0, 2.0]
    assert Lens(min_focus=0.5, focus_steps=2).settable_distances.tolist() == [0.5]


def test_a_table_limits_its_lens():
    assert Lens().focus_limits == (0.0, math.inf)
    assert Lens(table=LensTable("dioptres")).focus_limits == (0.0, math.inf)
    assert Lens(table=RANGE).focus_limits == (0.4, 2.0)
    narrow = Lens(min_focus=0.2, max_focus=1.5, table=RANGE)
    assert narrow.focus_limits == (0.4, 1.5)
    assert narrow.settable_distances is None
    # What was given stays, for another table.
    assert dataclasses.replace(narrow, table=None) == Lens(min_focus=0.2, max_focus=1.5)


def test_a_table_of_whole_values_is_a_list_of_distances():
    lens = Lens(table=COUNTED)
    assert lens.settable_distances.tolist() == COUNTED.settable_distances.tolist()
    assert len(lens.settable_distances) == 25
    some = Lens(min_focus=0.31, max_focus=1.0, table=COUNTED).settable_distances
    expected = reference.settable(Lens(0.05, 10.0, 0.31, 1.0, table=COUNTED))
    np.testing.assert_allclose(some, expected, rtol=1e-15)
    assert 0 < len(some) < 25
    # Nothing nearer than its focal length comes into focus.
    long = Lens(focal_length=0.4, table=COUNTED)
    assert long.settable_distances.min() > 0.4
    with pytest.raises(ValueError, match="read-only"):
        lens.settable_distances[0] = 1


def test_lists_and_steps_go_with_a_table_of_a_range():
    assert Lens(focus_distances=(0.5, 1.0), table=RANGE).settable_distances.tolist() == [0.5, 1.0]
    stepped = Lens(max_focus=9.0, focus_steps=3, table=RANGE)
    assert stepped.settable_distances.tolist() == [0.4, 1 / 1.5, 2.0]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 0}, "image.width: expected a whole number of at least 1, got 0"),
        ({"height": 8.5}, "image.height: expected a whole number of at least 1, got 8.5"),
        ({"fx": 0}, "image.fx: expected a number above 0, got 0"),
        ({"fy": -1.0}, "image.fy: expected a number above 0, got -1"),
        ({"cx": math.nan}, "image.cx: expected a number, got nan"),
        ({"cy": "x"}, "image.cy: expected a number, got 'x'"),
        (
            {"distortion_model": "fisheye", "distortion": (0.1,)},
            "image.distortion_model: expected one of .*, got 'fisheye'; rectified images have no d",
        ),
        ({"distortion_model": "fisheye"}, "image.distortion_model: expected one of plumb_bob"),
        ({"distortion": (0.1,) * 5}, "image.distortion_model: expected one of .*, got ''"),
        (
            {"distortion_model": "plumb_bob", "distortion": (0.1,) * 8},
            "image.distortion: expected 4 or 5 coefficients of the model plumb_bob, got 8",
        ),
        (
            {"distortion_model": "rational_polynomial", "distortion": (0.1,) * 5},
            "image.distortion: expected 8 or 12 or 14 coefficients of the model rational_p.*got 5",
        ),
        (
            {"distortion_model": "equidistant"},
            "image.distortion: expected 4 coefficients of the model equidistant, got 0",
        ),
        (
            {"distortion_model": "rational_polynomial", "distortion": (0.1,) * 14},
            "image.distortion: expected a sensor that is not tilted: .*, got 0.1 and 0.1; calibrat",
        ),
        (
            {"distortion_model": "plumb_bob", "distortion": (0.1, math.nan, 0, 0)},
            r"image.distortion\[1\]: expected a number, got nan",
        ),
        (
            {"distortion_model": "plumb_bob", "distortion": (0.1, -1e40, 0, 0)},
            r"image.distortion: expected coefficients up to 1e\+30, got -1e\+40",
        ),
        ({"distortion": 0.1}, "image.distortion: expected a list of coefficients, got 0.1"),
        ({"distortion": "0.1"}, "image.distortion: expected a list of coefficients, got '0.1'"),
        ({"binning": (2,)}, "image.binning: expected columns and rows, got 1 numbers"),
        ({"binning": 2}, "image.binning: expected columns and rows .*, got 2"),
        ({"binning": (0, 1)}, r"image.binning\[0\]: expected a whole number of at least 1, got 0"),
        ({"binning": (581, 1)}, "image.binning: expected at most 580 × 870, .*, got 581 × 1"),
        (
            {"binning": (8, 1), "region": (0, 0, 7, 9)},
            "image.binning: expected at most 7 × 9, what is read, got 8 × 1",
        ),
        ({"region": (0, 0, 7)}, "image.region: expected x_offset, .*height, got 3 numbers"),
        ({"region": (-1, 0, 7, 7)}, r"image.region\[0\]: expected a whole number of at least 0"),
        ({"region": (0, 0, 7, 0)}, r"image.region\[3\]: expected a whole number of at least 1"),
        ({"region": (0, 0.5, 7, 1)}, r"image.region\[1\]: expected a whole number .*, got 0.5"),
        (
            {"region": (80, 0, 501, 9)},
            r"image.region: expected .* 580 × 870, got 501 × 9 from \(80, 0\) on; offsets and",
        ),
    ],
)
def test_images_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        Image(**values)


def test_polynomials_without_coefficients_are_a_pinhole():
    for model, count in (("plumb_bob", 5), ("plumb_bob", 0), ("rational_polynomial", 8), ("", 3)):
        assert Image(distortion_model=model, distortion=[0] * count) == Image()
    fisheye = Image(distortion_model="equidistant", distortion=[0, 0, 0, 0])
    assert fisheye != Image()
    assert fisheye.distortion == (0.0, 0.0, 0.0, 0.0)


def test_an_image_is_a_plain_record_whatever_it_was_made_of():
    image = Image(
        distortion_model="plumb_bob",
        distortion=np.array([0.25, 0, 0, 0]),
        binning=[2, np.int64(3)],
        region=[1, 2, 5, 10],
    )
    assert (image.distortion, image.binning) == ((0.25, 0.0, 0.0, 0.0), (2, 3))
    assert {type(number) for number in image.distortion} == {float}
    assert {type(number) for number in (*image.binning, *image.region)} == {int}
    assert hash(image) == hash(dataclasses.replace(image))


def test_pixels_read_are_whole_bins_of_the_region():
    assert Image().pixels_read == (0, 0, 580, 870)
    assert Image(region=(0, 0, 580, 870)) == Image()
    assert Image(region=(3, 4, 11, 13)).pixels_read == (3, 4, 11, 13)
    assert Image(region=(3, 4, 11, 13), binning=(2, 5)).pixels_read == (3, 4, 10, 10)
    assert Image(binning=(300, 870)).pixels_read == (0, 0, 300, 870)


def test_a_camera_normalises_its_quaternion():
    almost = camera(orientation=(0.5, 0.5, -0.5, 0.5004))
    assert math.isclose(sum(q * q for q in almost.orientation), 1.0, rel_tol=1e-15)
    assert camera(position=np.array([1, 2, 3])).position == (1.0, 2.0, 3.0)
    assert all(type(x) is float for x in (*almost.orientation, *almost.position))


@pytest.mark.parametrize("name", ["", "1a", "_a", "a-b", "a b", "ä", "a\n", None, 3])
def test_names_that_are_no_topic(name):
    with pytest.raises(InputError, match="camera name: expected letters, digits and underscores"):
        camera(name)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"position": (0, 0)}, r"camera a: position: expected shape \(3\), got shape \(2,\)"),
        ({"position": (0, 0, math.nan)}, "camera a: position: expected finite metres"),
        ({"position": "abc"}, "camera a: position: expected numbers"),
        ({"orientation": (0, 0, 1)}, r"camera a: orientation: expected shape \(4\)"),
        (
            {"orientation": (0, 0, 0, 0)},
            (
                "camera a: orientation: expected a unit quaternion x, y, z, w, got .* of length 0; "
                "the pose was probably never set"
            ),
        ),
        ({"orientation": (0, 0, 0, 1.01)}, "of length 1.01"),
        ({"orientation": (0, 0, 0, math.nan)}, "of length nan"),
        ({"orientation": (math.nan, 0, 0, 1e300)}, "of length inf"),
        ({"orientation": (0.0, 0.0, 0.0, 1e308)}, "of length inf"),
    ],
)
def test_poses_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        camera(**values)


def test_a_rig_needs_cameras_of_different_names_that_fit_its_grid():
    with pytest.raises(InputError, match="rig: expected at least one camera, got none"):
        Rig(())
    with pytest.raises(InputError, match="rig: expected unique camera names, got 'b' 2 times"):
        Rig((camera("a"), camera("b"), camera("b")))
    with pytest.raises(
        InputError, match=r"rig.grid: expected rows × columns = 2, the number of .*, got 2 × 3"
    ):
        Rig((camera("a"), camera("b")), grid=Grid(2, 3))
    assert len(Rig((camera("a"), camera("b")), grid=Grid(1, 2))) == 2
    assert Rig((camera(),)).frame_id == "world"


@pytest.mark.parametrize("values", [{"rows": 0, "columns": 1}, {"rows": 1, "columns": 0}])
def test_a_grid_has_rows_and_columns(values):
    with pytest.raises(InputError, match="expected a whole number of at least 1, got 0"):
        Grid(**values)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"focus_weight": -0.1}, "focus_weight: expected a number of at least 0, got -0.1"),
        ({"projected_area_weight": -1}, "projected_area_weight: expected a number of at least 0"),
        ({"axis_deviation_weight": math.nan}, "axis_deviation_weight: .* got nan"),
        ({"focus_weight": 0.5}, "cost weights: expected a sum of at most 1, got 1.16667"),
        ({"projected_area_scale": -1}, "projected_area_scale: expected a number of at least 0"),
        ({"axis_deviation_limit": 0}, "axis_deviation_limit: expected a number above 0, got 0"),
    ],
)
def test_cost_models_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        CostModel(**values)


def test_a_mesh_keeps_its_own_read_only_arrays():
    vertices = TETRAHEDRON.copy()
    mesh = Mesh(vertices, FACES, 3 * np.ones((4, 3)))
    vertices[:] = 0
    np.testing.assert_array_equal(mesh.vertices, TETRAHEDRON)
    assert mesh.triangles.dtype == np.int32
    np.testing.assert_allclose(mesh.vertex_normals, 1 / np.sqrt(3))
    for array in (mesh.vertices, mesh.triangles, mesh.vertex_normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        mesh.vertices = TETRAHEDRON


def test_cross_products_point_outward_with_twice_the_area():
    crosses = Mesh(TETRAHEDRON, FACES).cross_products
    np.testing.assert_array_equal(crosses, [[0, 0, -1], [0, -1, 0], [-1, 0, 0], [1, 1, 1]])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"triangles": np.zeros((0, 3), int)}, "mesh: expected at least one triangle, got none"),
        ({"triangles": [[0, 1]]}, r"mesh triangles: expected shape \(n, 3\), got shape \(1, 2\)"),
        ({"vertices": np.zeros((0, 3))}, "mesh vertices: expected at least one, got none"),
        ({"vertices": np.zeros((4, 2))}, r"mesh vertices: expected shape \(n, 3\)"),
        (
            {"triangles": [[0, 1, 2], [0, 1, 4]]},
            r"mesh triangles: expected vertex indices from 0 to 3, got \[0, 1, 4\] in triangle 1",
        ),
        ({"triangles": [[0, -1, 2]]}, r"vertex indices from 0 to 3, got \[0, -1, 2\]"),
        (
            {"triangles": [[0, 1, 2], [0, 1, 1]]},
            (
                r"mesh triangles: expected triangles with an area, got 1 of 2 degenerate "
                r"\(first: 1\); remove them"
            ),
        ),
        (
            {"vertices": np.where(TETRAHEDRON > 0, np.nan, TETRAHEDRON)},
            (
                r"mesh vertices: expected finite numbers, got NaN or infinity in 3 of 4 "
                r"\(first: vertex 1\); repair the mesh"
            ),
        ),
        ({"vertex_normals": np.ones((3, 3))}, r"mesh vertex_normals: expected shape \(4, 3\)"),
        (
            {"vertex_normals": np.zeros((4, 3))},
            (
                r"mesh vertex_normals: expected vectors with a length, got 4 of 4 of length zero "
                r"\(first: 0\); leave the normals out"
            ),
        ),
        (
            {"vertex_normals": np.full((4, 3), np.inf)},
            "mesh vertex_normals: expected finite numbers",
        ),
        (
            {"vertex_importance": np.ones(3)},
            r"mesh vertex_importance: expected shape \(4\), got shape \(3,\)",
        ),
        ({"vertex_importance": np.ones((4, 1))}, "mesh vertex_importance: expected shape"),
        (
            {"vertex_importance": [1, 2, np.nan, 3]},
            (
                "mesh vertex_importance: expected finite numbers, got NaN or infinity in 1 of 4 "
                r"\(first: vertex 2\)"
            ),
        ),
        ({"vertex_importance": [1, 2, np.inf, 3]}, "mesh vertex_importance: .*NaN or infinity"),
        (
            {"vertex_importance": [1, -2, 0, -1]},
            (
                "mesh vertex_importance: expected numbers of at least 0, got 2 of 4 below "
                r"\(first: -2 of vertex 1\)"
            ),
        ),
        (
            {"vertex_importance": np.zeros(4)},
            "mesh vertex_importance: expected some above 0, got 0 all over the surface; leave",
        ),
        (
            {"triangles": [[0, 1, 2]], "vertex_importance": [0, 0, 0, 5]},
            "mesh vertex_importance: expected some above 0, got 0 all over the surface",
        ),
        ({"vertex_importance": ["much"] * 4}, "mesh vertex_importance: expected numbers"),
    ],
)
def test_meshes_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        Mesh(**{"vertices": TETRAHEDRON, "triangles": FACES} | values)


def test_indices_of_vertices_are_whole():
    with pytest.raises(InputError, match="mesh triangles"):
        Mesh(TETRAHEDRON, [[0.0, 1.5, 2.0]])


def test_a_thin_triangle_has_an_area_and_one_on_a_line_has_none():
    Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]], [[0, 1, 2]])
    with pytest.raises(InputError, match="1 of 1 degenerate"):
        Mesh([[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 1, 2]])
    # The smallest scenes are not degenerate for being small.
    Mesh(1e-6 * TETRAHEDRON, FACES)


def test_a_cloud_keeps_its_own_read_only_arrays():
    points = np.random.default_rng(0).random((16, 3))
    cloud = PointCloud(points, 2 * np.ones((16, 3)))
    np.testing.assert_array_equal(cloud.points, points)
    np.testing.assert_allclose((cloud.normals**2).sum(axis=1), 1)
    for array in (cloud.points, cloud.normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    ("points", "normals", "message"),
    [
        (np.zeros((0, 3)), None, "cloud: expected at least 16 points, got an empty cloud"),
        (np.zeros((15, 3)), None, "cloud: expected at least 16 points, got 15"),
        (np.zeros((16, 2)), None, r"cloud points: expected shape \(n, 3\), got shape \(16, 2\)"),
        (
            np.full((16, 3), np.nan),
            None,
            (
                r"cloud points: expected finite numbers, got NaN or infinity in 16 of 16 "
                r"\(first: point 0\); remove the invalid points first"
            ),
        ),
        (np.ones((16, 3)), np.ones((15, 3)), r"cloud normals: expected shape \(16, 3\)"),
        (np.ones((16, 3)), np.zeros((16, 3)), "cloud normals: expected vectors with a length"),
        (np.ones((16, 3)), np.full((16, 3), np.nan), "cloud normals: expected finite numbers"),
        (np.ones((16, 3)), np.full((16, 3), 1e200), "cloud normals: expected components up to 1e"),
        (np.ones((16, 3)), np.full((16, 3), 1e-160), "16 of 16 of length zero"),
    ],
)
def test_clouds_that_cannot_be(points, normals, message):
    with pytest.raises(InputError, match=message):
        PointCloud(points, normals)


@pytest.mark.parametrize(
    ("importance", "message"),
    [
        (np.ones(15), r"cloud importance: expected shape \(16\), got shape \(15,\)"),
        (np.full(16, np.nan), r"cloud importance: .* in 16 of 16 \(first: point 0\)"),
        (-np.arange(16), r"numbers of at least 0, got 15 of 16 below \(first: -1 of point 1\)"),
        (np.zeros(16), "cloud importance: expected some above 0, got 0 all over the surface"),
    ],
)
def test_an_importance_of_points_that_cannot_be(importance, message):
    with pytest.raises(InputError, match=message):
        PointCloud(np.random.default_rng(0).random((16, 3)), importance=importance)


def test_importance_is_kept_as_it_is_given():
    importance = np.array([0.0, 7.0, 1e-300, 1e300])
    mesh = Mesh(TETRAHEDRON, FACES, vertex_importance=importance)
    cloud = PointCloud(np.random.default_rng(0).random((16, 3)), importance=np.arange(16))
    for kept, expected in ((mesh.vertex_importance, importance), (cloud.importance, range(16))):
        np.testing.assert_array_equal(kept, expected)
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 1


def test_statuses_are_the_messages_constants():
    assert [(status.name, int(status)) for status in CameraStatus] == [
        ("UNKNOWN", 0),
        ("PLANNED", 1),
        ("UNASSIGNED", 2),
        ("SEES_NOTHING", 3),
    ]
