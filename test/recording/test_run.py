# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a run says is what it was told."""

from __future__ import annotations

import math
import tempfile
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from focus_planner.core.planning.fingerprint import Fingerprint
from focus_planner.core.planning.plan import FocusPlan, WarmStart
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.progress import Progress
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Grid, Rig
from focus_planner.core.surface.appearance import Texture
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.validation import InputError
from focus_planner.io.lens_tables import lens_tables_from_yaml
from focus_planner.messages.reading import Optics
from focus_planner.messages.typestore import CLOUD, POSES, RIG, VERTEX_DATA, deserialize, serialize
from focus_planner.messages.writing import poses_to_fields
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage, BagWriter
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.run import Beginning, Ending
from focus_planner.recording.run_inputs import input_messages, rig_message, surface_messages
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.run_writing import (
    beginning_messages,
    beginning_of,
    ending_messages,
    inputs_of,
    progress_message,
)
from testing import messages as build
from testing.contents import in_full
from testing.problems import sphere, torus
from testing.runs import RIG as SMALL_RIG
from testing.runs import TORUS, beginning_with, cloud, record, rewritten, with_payload

RUN = "focus_planner_msgs/msg/Run"
AT = 1_700_000_000_123_456_000


def written(folder, beginning, inputs, progress=(), ending=None):
    """Write a run and return it as it is read."""
    bag = BagWriter()
    for message in inputs:
        bag.add(message)
    for message in beginning_messages(beginning):
        bag.add(message)
    for elapsed, step in progress:
        bag.add(progress_message(beginning, elapsed, step))
    if ending is not None:
        for message in ending_messages(beginning, ending, beginning.at + 5):
            bag.add(message)
    bag.open(folder / beginning.run_id)
    return read_run(bag.close())


def same_bits(one, other):
    return (one is None and other is None) or (
        one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    )


def same_surface(one, other):
    names = [field.name for field in fields(one) if field.name != "notes"]
    return type(one) is type(other) and all(
        same_bits(getattr(one, name), getattr(other, name)) for name in names
    )


def uneven(mesh, *, normals=False, importance=False):
    """A mesh in which no number is round."""
    random = np.random.default_rng(5)
    vertices = mesh.vertices + 1e-3 * random.normal(size=mesh.vertices.shape)
    return Mesh(
        vertices,
        mesh.triangles,
        random.normal(size=vertices.shape) if normals else None,
        random.random(len(vertices)) if importance else None,
    )


def coloured(surface):
    """The surface, with a colour for every vertex or point."""
    name, places = (
        ("vertex_colours", surface.vertices)
        if isinstance(surface, Mesh)
        else ("colours", surface.points)
    )
    colours = np.random.default_rng(6).integers(0, 256, places.shape)
    return replace(surface, **{name: colours.astype(np.uint8)})


SURFACES = {
    "a mesh": uneven(torus()),
    "a mesh with normals": uneven(torus(), normals=True),
    "a mesh with importance": uneven(sphere(), importance=True),
    "a mesh with both": uneven(sphere(), normals=True, importance=True),
    "a mesh with colours": coloured(uneven(torus())),
    "a mesh with all": coloured(uneven(sphere(), normals=True, importance=True)),
    "a cloud": cloud(),
    "a cloud with normals": cloud(normals=True),
    "a cloud with importance": cloud(importance=True),
    "a cloud with both": cloud(normals=True, importance=True),
    "a cloud with colours": coloured(cloud()),
    "a cloud with all": coloured(cloud(normals=True, importance=True)),
}
LENSES = (
    Lens(),
    Lens(0.035, 4.0 + 1 / 3, 0.3, 2.0),
    Lens(0.085, 18.0, focus_distances=(0.45, 0.5, 0.7 + 1e-13, 1.1)),
    Lens(0.05, 7.0, 0.4, 3.0, focus_steps=64),
    Lens(0.05, 7.0, 0.4, focus_steps=9),
    Lens(0.05, 7.0, table=LensTable("steps", False, (0.3 + 1e-16, 1 / 3, math.inf), (7.25, 1, 0))),
    Lens(0.05, 7.0, 0.4, table=LensTable("focus_absolute", True, (0.3, 2.0), (250, -3.5))),
    Lens(table=LensTable("dioptres")),
)
TABLES = "default: {unit: dioptres}  # ü\ncameras: {c0: {unit: m}}\n"


def mixed_rig():
    """Cameras of every kind of lens and two kinds of images, turned by a seed."""
    random = np.random.default_rng(8)
    cameras = []
    for i, lens in enumerate(LENSES):
        q = random.normal(size=4)
        intrinsics = (
            CameraIntrinsics(1920, 1080, 1400.1, 1405.7, 955.5, 541.2)
            if i % 2
            else CameraIntrinsics()
        )
        position = tuple(random.normal(size=3).tolist())
        cameras.append(
            Camera(f"kind_{i}", position, tuple((q / np.linalg.norm(q)).tolist()), intrinsics, lens)
        )
    return Rig(tuple(cameras), "booth", Grid(1, len(LENSES)))


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())
def test_a_surface_is_read_to_the_bit(surface, tmp_path):
    beginning = beginning_with()
    run = written(tmp_path, beginning, inputs_of(beginning, surface, SMALL_RIG))
    (arrival,) = run.surfaces()
    assert arrival.topic == ("/focus_planner/" + ("mesh" if isinstance(surface, Mesh) else "cloud"))
    assert same_surface(arrival.read(Optics()), surface)
    # What was read is written as what it was read from.
    again = surface_messages(beginning.planner, arrival.read(Optics()), "world", beginning.at)
    assert [m.payload for m in again] == [m.payload for m in run.inputs if m.type_name != RIG]


@pytest.mark.parametrize("name", ["normals", "colors"])
@pytest.mark.parametrize(("count", "told"), [(4, "three numbers per vertex, got 4"), (30, "shape")])
def test_data_of_other_vertices_is_told(name, count, told, tmp_path):
    beginning = beginning_with()
    inputs = inputs_of(beginning, coloured(uneven(torus(), normals=True)), SMALL_RIG)
    inputs = [
        with_payload(message, serialize(VERTEX_DATA, {name: np.ones(count)}))
        if message.type_name == VERTEX_DATA
        else message
        for message in inputs
    ]
    run = written(tmp_path, beginning, inputs)
    with pytest.raises(InputError, match=told):
        run.surfaces()[0].read(Optics())


def test_a_texture_is_recorded_as_colours_of_vertices(tmp_path):
    mesh = uneven(torus())
    image = np.random.default_rng(7).integers(0, 256, (9, 7, 3)).astype(np.uint8)
    places = np.random.default_rng(8).random((len(mesh.triangles), 3, 2))
    mesh = replace(mesh, texture=Texture(image, places.astype(np.float32)))
    beginning = beginning_with()
    run = written(tmp_path, beginning, inputs_of(beginning, mesh, SMALL_RIG))
    read = run.surfaces()[0].read(Optics())
    np.testing.assert_array_equal(read.vertex_colours, mesh.colours_of_vertices())


@settings(max_examples=30)
@given(st.data())
def test_any_cloud_is_read_to_the_bit(data):
    surface = data.draw(build.clouds())
    beginning = beginning_with()
    with tempfile.TemporaryDirectory() as folder:
        run = written(Path(folder), beginning, inputs_of(beginning, surface, SMALL_RIG))
    assert same_surface(run.surfaces()[0].read(Optics()), surface)


def test_a_rig_of_every_kind_of_camera_is_read_to_the_bit(tmp_path):
    rig = mixed_rig()
    beginning = beginning_with(rig=rig)
    run = written(tmp_path, beginning, inputs_of(beginning, TORUS, rig))
    (arrival,) = run.rigs()
    assert in_full(arrival.read(run.beginning.settings.optics)) == in_full(rig)


@settings(max_examples=30)
@given(build.rigs())
def test_any_rig_is_read_to_the_bit(rig):
    beginning = beginning_with(rig=rig)
    with tempfile.TemporaryDirectory() as folder:
        run = written(Path(folder), beginning, inputs_of(beginning, TORUS, rig))
    assert in_full(run.rigs()[0].read(Optics())) == in_full(rig)


def test_poses_take_image_and_lens_from_the_parameters(tmp_path):
    values = {"image.width": 640, "lens.f_number": 8.0, "lens.circle_of_confusion": 3e-5}
    values |= {"lens.hyperfocal_distance": 0.0, "frame_id": "booth"}
    rig = mixed_rig()
    payload = serialize(POSES, poses_to_fields(rig))
    beginning = replace(beginning_with(), settings=Settings.from_values(values))
    topic = "/focus_planner/camera_poses"
    run = written(tmp_path, beginning, [BagMessage(topic, POSES, payload, AT)])
    (arrival,) = run.rigs()
    assert (arrival.topic, arrival.type_name, arrival.payload) == (topic, POSES, payload)
    cameras = arrival.read(run.beginning.settings.optics).cameras
    poses = [(camera.position, camera.orientation) for camera in rig.cameras]
    assert [(camera.position, camera.orientation) for camera in cameras] == poses
    assert {camera.intrinsics for camera in cameras} == {CameraIntrinsics(width=640)}
    lens = Lens(0.05, 0.05**2 / (8.0 * 3e-5), circle_of_confusion=3e-5)
    assert {camera.lens for camera in cameras} == {lens}


def test_inputs_keep_their_times_and_their_order(tmp_path):
    beginning = beginning_with()
    rigs = [
        rig_message("/focus_planner", SMALL_RIG, AT + 2000),
        rig_message("/focus_planner", mixed_rig(), AT + 3000),
    ]
    surface = surface_messages("/focus_planner", TORUS, "world", AT + 1000)
    run = written(tmp_path, beginning, [*surface, *rigs])
    assert [m.at for m in run.inputs] == [AT + 1000, AT + 2000, AT + 3000]
    assert [input_messages("/focus_planner", arrival) for arrival in run.rigs()] == [
        [replace(message, definition="")] for message in run.inputs[1:]
    ]


def other_than_default(declaration):
    """A value that is allowed, and is not the default."""
    special = {
        "method": "optimal",
        "scope": "assigned",
        "tuples": "grid",
        "bound": "tight",
        "frame_id": "booth",
        "importance_field": "weight",
        "record_directory": "/runs/ü",
        "lens_tables": "not/there/any/more.yaml",
        "k": 3,
        "gap": 0.01 + 1e-12,
        "lens.hyperfocal_distance": 0.0,
        "lens.f_number": 5.6,
        "lens.circle_of_confusion": 3.1e-5,
        "lens.min_focus": 0.3,
        "lens.max_focus": 4.0,
        "lens.focal_length": 0.035,
        "lens.focus_distances": (0.5, 1 / 3 + 0.5, 2.0),
        "lens.focus_steps": 0,  # or the distances above
        "lens.hiatus": 0.0123,
        "seed": 2**63 - 1,
        "cost.axis_deviation_weight": 0.2,
        "cost.projected_area_weight": 0.1,
        "cost.focus_weight": 0.6,
    }
    default = declaration.default
    if declaration.name in special:
        return special[declaration.name]
    if isinstance(default, bool):
        return not default
    return {
        "overlap": "refuse",
        "replan": "rate",
        "record_access": "group",
        "data_directories": "/tables:/runs",
        "camera_frames": "left_optical_frame cam*_link",
        "camera_convention": "body",
        "camera_info_topics": "/*/camera_info",
    }.get(declaration.name) or default + 3


def test_every_parameter_is_read_as_it_was(tmp_path):
    values = {d.name: other_than_default(d) for d in DECLARATIONS}
    before = Settings.from_values(values, TABLES)
    assert {type(value) for _, value in before.values} == {bool, int, float, str, tuple}
    run = written(tmp_path, replace(beginning_with(), settings=before), [])
    assert run.beginning.settings == before
    assert [type(v) for _, v in run.beginning.settings.values] == [
        type(v) for _, v in before.values
    ]
    assert dict(run.beginning.settings.values) == values
    assert run.beginning.settings.recording.directory == Path("/runs/ü")


def test_lens_tables_are_read_as_their_file_had_them_then(tmp_path):
    path = tmp_path / "lenses.yaml"
    path.write_text(TABLES)
    beginning = beginning_with(lens_tables=str(path))
    path.unlink()
    run = written(tmp_path, beginning, inputs_of(beginning, TORUS, SMALL_RIG))
    (message,) = (m for m in read_bag(run.path).messages if m.type_name == RUN)
    assert message.read().lens_tables == TABLES
    read = run.beginning.settings
    assert read == beginning.settings
    assert (read.lens_tables_text, read.lens_tables.where) == (TABLES, str(path))
    (arrival,) = run.rigs()
    tables = [camera.lens.table for camera in arrival.read(read.optics).cameras]
    assert tables == [LensTable("m"), *[LensTable("dioptres")] * (len(SMALL_RIG) - 1)]


def test_a_run_of_a_file_is_of_its_rig_and_its_tables(tmp_path):
    tables = lens_tables_from_yaml(TABLES, "lenses.yaml")
    beginning = beginning_of("a", "/p", PlanRequest(), "world", {}, tables)
    assert dict(beginning.settings.values)["lens_tables"] == "lenses.yaml"
    assert beginning.settings.lens_tables == tables
    assert beginning_of("a", "/p", PlanRequest(), "world", {}).settings.lens_tables is None


@settings(max_examples=30)
@given(build.requests)
def test_any_request_is_read_as_it_was(request):
    if request.seed >= 2**63:  # parameters have a sign
        request = replace(request, seed=request.seed - 2**63)
    with tempfile.TemporaryDirectory() as folder:
        run = written(Path(folder), beginning_with(request), [])
    assert run.beginning.request == request


@pytest.mark.parametrize(
    "request_",
    [
        PlanRequest(samples=0, standard_error=0.7, fresh_samples=77),
        PlanRequest(tuples="grid", seed=0, gap=0.0, depth_tolerance=0.0),
        PlanRequest(time_budget=0.25, shots=3),
    ],
)
def test_what_only_parameters_say_is_read_too(request_, tmp_path):
    assert written(tmp_path, beginning_with(request_), []).beginning.request == request_


def test_a_request_that_leaves_things_out_takes_the_parameters(tmp_path):
    beginning = replace(beginning_with(PlanRequest("average", 55)), asked={"seed": 9})
    run = written(tmp_path, beginning, [])
    assert run.beginning.request == PlanRequest("average", 55, 9)
    assert run.beginning.asked["method"] == ""


def test_the_rest_of_a_beginning_is_read_as_it_was(tmp_path):
    beginning = Beginning(
        run_id=new_run_id(),
        planner="/booth/planner",
        settings=Settings.from_values({}),
        asked={},
        at=AT,
        software={"python": "3.11.2", "processor": "ü × 2", "": ""},
    )
    run = written(tmp_path, beginning, [])
    assert run.beginning.run_id == beginning.run_id == run.path.name
    assert run.beginning.planner == "/booth/planner"
    assert run.beginning.at == AT
    assert run.beginning.software == beginning.software
    assert run.beginning.warm_start is None
    assert {m.topic.rpartition("/")[0] for m in read_bag(run.path).messages} <= {
        "/booth/planner",
        "/booth/planner/run",
    }


@pytest.mark.parametrize("prices", [None, np.random.default_rng(2).random(5)])
def test_a_warm_start_is_read_to_the_bit(prices, tmp_path):
    random = np.random.default_rng(1)
    warm_start = WarmStart(("a", "a", "b"), random.random(3), random.normal(size=(5, 3)), prices)
    read = written(tmp_path, beginning_with(warm_start=warm_start), []).beginning.warm_start
    assert read.names == warm_start.names
    for name in ("focus_distances", "points", "prices"):
        assert same_bits(getattr(read, name), getattr(warm_start, name))


def test_progress_is_read_as_it_was(tmp_path):
    steps = [
        Progress("visibility", 3, math.nan),
        Progress("em", 0, 1 / 3, 0.1 + 0.2),
        Progress("prices", 4, 712.25, -math.inf),
    ]
    beginning = beginning_with()
    run = written(tmp_path, beginning, [], [(0.25 * k, step) for k, step in enumerate(steps)])
    assert repr(run.progress) == repr(tuple(steps))
    assert run.elapsed == (0.0, 0.25, 0.5)
    times = [m.at for m in read_bag(run.path).messages if m.topic.endswith("progress")]
    assert times == [beginning.at + k * 250_000_000 for k in range(3)]


@settings(max_examples=30)
@given(build.plans)
def test_any_plan_is_read_as_it_was(plan):
    prints = (Fingerprint("samples", (3,), (2**64 - 1,)), Fingerprint("costs", (1, 0), (7, 8)))
    ending = Ending(True, "told", plan, StopLog.from_counts((3, 1, 2)), prints, (17, 999_999_999))
    with tempfile.TemporaryDirectory() as folder:
        run = written(Path(folder), beginning_with(), [], (), ending)
    assert run.fault == ""
    assert run.ending == ending
    assert in_full(run.ending.plan) == in_full(plan)


def test_a_run_that_failed_is_read_as_it_was(tmp_path):
    ending = Ending(False, "rig: expected «poses», got none yet")
    run = written(tmp_path, beginning_with(), [], (), ending)
    assert run.ending == ending
    assert run.fault == ""


def test_a_plan_in_a_run_has_its_name(tmp_path):
    path = record(tmp_path)
    (plan,) = (m.read() for m in read_bag(path).messages if m.topic.endswith("focus_plan"))
    assert plan.plan_id == path.name == read_run(path).beginning.run_id
    assert isinstance(read_run(path).ending.plan, FocusPlan)


def test_new_names_differ_and_sort_by_time():
    names = [new_run_id() for _ in range(200)]
    assert len(set(names)) == 200
    stems = [name.split("-")[0] for name in names]
    assert stems == sorted(stems)


# --- what is no run ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run_path(tmp_path_factory):
    return record(tmp_path_factory.mktemp("runs"))


def read_or_told(path):
    """A run, or why there is none."""
    try:
        return read_run(path)
    except InputError as error:
        return str(error)


def test_without_a_result_it_is_partial(run_path, tmp_path):
    path = rewritten(
        run_path, tmp_path / "x", lambda m: None if m.topic.endswith("run/result") else m
    )
    run = read_run(path)
    assert run.ending is None
    assert run.fault == "no result"
    assert [m.payload for m in run.inputs] == [m.payload for m in read_run(run_path).inputs]


@pytest.mark.parametrize("missing", ["/run", "/run/request"])
def test_without_a_beginning_it_is_no_run(run_path, tmp_path, missing):
    topic = "/focus_planner" + missing
    path = rewritten(run_path, tmp_path / "x", lambda m: None if m.topic == topic else m)
    with pytest.raises(InputError, match=r"expected a recorded run, got a bag of .*FocusPlan"):
        read_run(path)


def test_wherever_it_is_cut_off_it_is_partial_or_no_run(run_path, tmp_path):
    (file,) = run_path.glob("*.mcap")
    whole = file.read_bytes()
    cut = tmp_path / "cut.mcap"
    partial = 0
    for length in np.linspace(0, len(whole) - 9, 60).astype(int).tolist():
        cut.write_bytes(whole[:length])
        run = read_or_told(cut)
        if not isinstance(run, str):
            partial += 1
            assert run.ending is None
            assert run.fault
    assert 0 < partial < 60


def test_no_byte_that_is_wrong_raises_anything_else(run_path, tmp_path):
    (file,) = run_path.glob("*.mcap")
    whole = np.frombuffer(file.read_bytes(), np.uint8)
    random = np.random.default_rng(0)
    bad = tmp_path / "bad.mcap"
    for _ in range(150):
        changed = whole.copy()
        changed[random.integers(len(whole), size=random.integers(1, 4))] = random.integers(256)
        bad.write_bytes(changed.tobytes())
        read = read_or_told(bad)
        assert not isinstance(read, str) or "\n" not in read


def test_no_payload_that_is_wrong_raises_anything_else(run_path, tmp_path):
    """As a checksum cannot tell: what another program wrote."""
    random = np.random.default_rng(1)
    messages = read_bag(run_path).messages
    kinds = [k for k, m in enumerate(messages) if "/run" in m.topic or "plan" in m.topic]
    refused = 0
    for trial in range(150):
        k = kinds[trial % len(kinds)]
        payload = np.frombuffer(messages[k].payload, np.uint8).copy()
        where = random.integers(4, len(payload), size=random.integers(1, 6))
        payload[where] = random.integers(256, size=len(where))
        bag = BagWriter()
        for j, message in enumerate(messages):
            bag.add(with_payload(message, payload.tobytes()) if j == k else message)
        bag.open(tmp_path / f"bad{trial}")
        read = read_or_told(bag.close())
        if isinstance(read, str):
            refused += 1
            assert "\n" not in read
    assert refused > 10


@pytest.mark.parametrize("known", [True, False])
def test_a_weight_counts_in_runs_older_than_the_parameter(tmp_path, known):
    fields_ = build.importance_fields(np.arange(40), name="weight")
    message = BagMessage("/planner/cloud", CLOUD, serialize(CLOUD, fields_), AT)
    run = written(tmp_path, beginning_with(), [message, rig_message("/planner", SMALL_RIG, AT)])

    def older(recorded):
        deserialized = deserialize(RUN, recorded.payload)
        kept = [p for p in deserialized.parameters if p.name != "importance_field"]
        names = ("stamp", "run_id", "planner", "seed", "software", "warm_start")
        rest = {name: getattr(deserialized, name) for name in names}
        return with_payload(recorded, serialize(RUN, {**rest, "parameters": kept}))

    if not known:
        path = rewritten(run.path, tmp_path / "x", lambda m: older(m) if m.type_name == RUN else m)
        run = read_run(path)
    (arrival,) = run.surfaces()
    importance = arrival.read(Optics()).importance
    if known:
        assert importance is None
    else:
        np.testing.assert_array_equal(importance, np.arange(40))


def changed_parameters(message, change):
    """The beginning with its parameters changed."""
    run = deserialize(RUN, message.payload)
    parameters = [change(p) for p in run.parameters]
    fields_ = {f: getattr(run, f) for f in ("stamp", "run_id", "planner", "seed", "software")}
    payload = serialize(RUN, {**fields_, "parameters": parameters, "warm_start": run.warm_start})
    return with_payload(message, payload)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("method", {"type": 1, "bool_value": True}),
        ("method", {"type": 0}),
        ("method", {"type": 4, "string_value": "best"}),
        ("samples", {"type": 4, "string_value": "many"}),
        ("lens.focus_distances", {"type": 3, "double_value": 1.0}),
        ("lens.focal_length", {"type": 4, "string_value": "long"}),
        ("record_directory", {"type": 2, "integer_value": 3}),
        ("image.width", {"type": 9}),
        ("time_budget", {"type": 4, "string_value": "soon"}),
    ],
)
def test_a_bad_parameter_is_told_in_one_line(run_path, tmp_path, name, value):
    def change(parameter):
        given_ = {"name": parameter.name, "value": parameter.value}
        return given_ if parameter.name != name else {"name": name, "value": value}

    path = rewritten(
        run_path,
        tmp_path / "x",
        lambda m: changed_parameters(m, change) if m.type_name == RUN else m,
    )
    with pytest.raises(InputError, match=r"expected a recorded run, got one with a bad ") as told:
        read_run(path)
    assert "\n" not in str(told.value)


def test_a_parameter_of_a_later_version_is_told_in_one_line(run_path, tmp_path):
    def change(parameter):
        name = "image.skew" if parameter.name == "image.cy" else parameter.name
        return {"name": name, "value": parameter.value}

    path = rewritten(
        run_path,
        tmp_path / "x",
        lambda m: changed_parameters(m, change) if m.type_name == RUN else m,
    )
    with pytest.raises(InputError, match="'skew'; update") as told:
        read_run(path)
    assert "\n" not in str(told.value)
