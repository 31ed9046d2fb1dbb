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
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.defaults import keys_of
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Grid, Rig
from focus_planner.core.validation import InputError
from focus_planner.io.rigs import load_rig, rig_to_yaml, save_rig
from testing.intrinsics import varied
from testing.messages import lens_tables

NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,12}", fullmatch=True) | st.sampled_from(
    ["yes", "No", "null", "on", "y", "true", "e1", "inf", "NaN"]
)
METRES = st.floats(-1e6, 1e6)
POSITIVE = st.floats(1e-6, 1e6)
QUATERNIONS = (
    st.tuples(*[st.floats(-1, 1)] * 4)
    .filter(lambda q: math.hypot(*q) > 0.1)
    .map(lambda q: tuple(x / math.hypot(*q) for x in q))
)
PLAIN_IMAGES = st.builds(
    CameraIntrinsics,
    width=st.integers(1, 10_000),
    height=st.integers(1, 10_000),
    fx=POSITIVE,
    fy=POSITIVE,
    cx=METRES,
    cy=METRES,
)
IMAGES = PLAIN_IMAGES | varied(PLAIN_IMAGES)


@st.composite
def lenses(draw: st.DrawFn) -> Lens:
    focal_length = draw(st.floats(1e-4, 0.5))
    lens = Lens(
        focal_length,
        draw(st.floats(0.6, 1e3)),
        draw(st.floats(0.51, 0.6)),
        draw(st.floats(1.0, 1e3) | st.just(math.inf)),
    )
    if draw(st.booleans()):  # whole values need not be within those limits
        return Lens(0.05, 9.0, table=draw(lens_tables(kinds=(True,))))
    takes = draw(
        st.just({})
        | st.fixed_dictionaries({"focus_steps": st.integers(2, 65_536)})
        | st.fixed_dictionaries({"table": lens_tables(kinds=(False,))})
        | st.fixed_dictionaries(
            {"focus_distances": st.lists(st.floats(0.6, 0.7), min_size=1, max_size=4)}
        )
    )
    return replace(lens, **takes)


@st.composite
def rigs(draw: st.DrawFn) -> Rig:
    names = draw(st.lists(NAMES, min_size=1, max_size=6, unique=True))
    images, kinds = draw(st.lists(IMAGES, min_size=1)), draw(st.lists(lenses(), min_size=1))
    cameras = tuple(
        Camera(
            name,
            draw(st.tuples(METRES, METRES, METRES)),
            draw(QUATERNIONS),
            draw(st.sampled_from(images)),
            draw(st.sampled_from(kinds)),
        )
        for name in names
    )
    grid = draw(st.sampled_from([None, Grid(1, len(cameras)), Grid(len(cameras), 1)]))
    return Rig(cameras, draw(st.text(max_size=10)), grid, sequence=draw(st.booleans()))


@st.composite
def assumptions(draw: st.DrawFn) -> Rig:
    """A rig of which nothing tells some values, which are the defaults."""
    rig = draw(rigs())
    some = st.sets(st.sampled_from(sorted(keys_of("lens") | keys_of("image"))))
    assumed, cameras = {}, []
    for camera in rig.cameras:
        keys = frozenset(draw(some | st.just(set())))
        image = {k[6:]: getattr(CameraIntrinsics(), k[6:]) for k in keys if k[:6] == "image."}
        lens = {k[5:]: getattr(Lens(), k[5:]) for k in keys if k[:5] == "lens."}
        kind = replace(Lens(0.05, 9.0), **lens) if lens else camera.lens
        plain = CameraIntrinsics(64, 48, 50.0, 50.0, 0.0, 0.0)
        intrinsics = replace(plain, **image) if image else camera.intrinsics
        cameras.append(replace(camera, intrinsics=intrinsics, lens=kind))
        assumed[camera.name] = keys
    return replace(rig, cameras=tuple(cameras), assumed=assumed)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rig=rigs())
def test_a_rig_comes_back_bit_for_bit(tmp_path: Path, rig: Rig) -> None:
    save_rig(rig, tmp_path / "rig.yaml")
    assert load_rig(tmp_path / "rig.yaml") == rig


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rig=assumptions())
def test_what_nothing_told_comes_back_and_no_more(tmp_path: Path, rig: Rig) -> None:
    save_rig(rig, tmp_path / "rig.yaml")
    read = load_rig(tmp_path / "rig.yaml")
    assert read == rig
    assert read.assumed == rig.assumed
    lacking = [kind for kind in ("lens", "image") if any(
        keys_of(kind) & keys for keys in rig.assumed.values())]  # fmt: skip
    assert [note.code for note in read.notes] == [f"default_{kind}" for kind in lacking]


def test_what_a_camera_gives_itself_is_told(tmp_path: Path) -> None:
    own = camera_with(lens="{focal_length: 0.05}").replace("a,", "b,")
    text = (
        "image: {width: 9, height: 9, fx: 9, fy: 9, cx: 4, cy: 4}\n"
        "lens: {focal_length: 0.05, hyperfocal_distance: 10}\n"
        f"defaults: [lens]\ncameras: [{CAMERA}, {own}, %s]"
    )
    checked = camera_with(defaults="[]").replace("a,", "c,")
    rig = load_rig(write(tmp_path, text % checked))
    both = {"lens.focal_length", "lens.hyperfocal_distance"}
    assert rig.assumed == {"a": both, "b": {"lens.hyperfocal_distance"}, "c": set()}
    (note,) = rig.notes
    assert note.text.startswith("nothing tells the lens of 2 of 3 cameras: focal length 50 mm and")
    for wrong in ("[lense]", "lens", "[[lens]]", "[lens.fx]", "[3]"):
        camera = camera_with(defaults=wrong).replace("a,", "c,")
        with pytest.raises(InputError, match=r"cameras\[2\]\.defaults: expected a list of lens"):
            load_rig(write(tmp_path, text % camera))


def test_the_cylinder_comes_back_and_reads_like_the_contract(tmp_path: Path) -> None:
    rig = cylinder_rig()
    text = rig_to_yaml(rig)
    lines = text.splitlines()
    assert lines[0] == "frame_id: world"
    assert lines[1].startswith("image: {width: 580, height: 870, fx: 1190.732, fy: 1190.732,")
    assert lines[2].startswith("lens: {focal_length: 0.05, hyperfocal_distance: 10.0}")
    assert lines[3] == "grid: {rows: 7, columns: 24}"
    assert lines[5].startswith("  - {name: cam_0_00, position: [0.75, 0.0, 0.1], orientation: [")
    assert len(lines) == 5 + 168
    (tmp_path / "rig.yaml").write_text(text)
    assert load_rig(tmp_path / "rig.yaml") == rig
    assert yaml.safe_load(text)["cameras"][0]["orientation"] == [-0.5, -0.5, 0.5, 0.5]


def write(folder: Path, text: str) -> Path:
    path = folder / "rig.yaml"
    path.write_text(text)
    return path


TABLE = "{unit: steps, distances: [0.4, 2], values: [900, 0]}"
CAMERA = "{name: a, position: [1, 0, 0], orientation: [0, 0, 0, 1]}"


STEPS = LensTable("steps", False, (0.4, 2.0), (900, 0))


def camera_with(**values: str) -> str:
    return CAMERA[:-1] + "".join(f", {key}: {value}" for key, value in values.items()) + "}"


def test_what_is_not_given_is_the_papers(tmp_path: Path) -> None:
    rig = load_rig(write(tmp_path, f"cameras: [{CAMERA}]"))
    assert rig == Rig((Camera("a", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),))


def test_a_camera_overrides_keys_of_image_and_lens(tmp_path: Path) -> None:
    own = camera_with(image="{width: 640}", lens="{min_focus: 0.4}")
    rig = load_rig(
        write(
            tmp_path,
            f"image: {{width: 100, height: 200}}\nlens: {{focal_length: 0.035}}\ncameras: [{own}]",
        )
    )
    assert rig.cameras[0].intrinsics == CameraIntrinsics(width=640, height=200)
    assert rig.cameras[0].lens == Lens(focal_length=0.035, min_focus=0.4)


def test_images_may_be_distorted_binned_and_read_in_part(tmp_path: Path) -> None:
    shared = "{distortion_model: plumb_bob, distortion: [-1e-1, 0, 0, 0], binning: [2, 2]}"
    cameras = (
        camera_with(image="{region: [8, 4, 100, 50], binning: [1, 1]}"),
        camera_with(image='{distortion_model: "", distortion: []}').replace("a,", "b,"),
        camera_with(image="{distortion: [0.1, 0, 0, 0, 1]}").replace("a,", "c,"),
    )
    text = f"image: {shared}\ncameras: [{', '.join(cameras)}]"
    images = [camera.intrinsics for camera in load_rig(write(tmp_path, text)).cameras]
    barrel = (-0.1, 0.0, 0.0, 0.0)
    assert images[0] == CameraIntrinsics(
        distortion_model="plumb_bob", distortion=barrel, region=(8, 4, 100, 50)
    )
    assert images[1] == CameraIntrinsics(binning=(2, 2))
    assert images[2].distortion == (0.1, 0.0, 0.0, 0.0, 1.0)


def test_an_image_is_written_with_what_it_has_only() -> None:
    (camera,) = cylinder_rig(1, 1).cameras
    barrel = CameraIntrinsics(
        distortion_model="plumb_bob", distortion=(-0.1, 0, 0, 0), region=(0, 0, 9, 8)
    )
    other = replace(camera, name="other")
    rig = Rig(
        (
            replace(camera, intrinsics=barrel),
            replace(other, intrinsics=barrel),
            replace(camera, name="plain"),
        )
    )
    lines = rig_to_yaml(rig).splitlines()
    assert lines[1].endswith(
        "cy: 434.44, distortion_model: plumb_bob, distortion: [-0.1, 0.0, 0.0, 0.0],"
        " region: [0, 0, 9, 8]}   # pixels"
    )
    assert lines[-1].endswith("image: {distortion_model: '', distortion: [], region: null}}")


@pytest.mark.parametrize(
    ("shared", "own", "circle"),
    [
        ("{f_number: 8, circle_of_confusion: 3e-5}", "{}", 3e-5),
        ("{hyperfocal_distance: 7, circle_of_confusion: 3e-5}", "{}", 3e-5),
        ("{f_number: 8, circle_of_confusion: 3e-5}", "{hyperfocal_distance: 7}", 3e-5),
        ("{hyperfocal_distance: 7}", "{circle_of_confusion: 2e-5}", 2e-5),
        ("{f_number: 8, circle_of_confusion: 3e-5}", "{circle_of_confusion: 2e-5}", 2e-5),
        (
            "{hyperfocal_distance: 7, circle_of_confusion: 3e-5}",
            "{circle_of_confusion: null}",
            None,
        ),
        ("{hyperfocal_distance: 7}", "{}", None),
    ],
)
def test_a_circle_of_confusion_is_kept(
    tmp_path: Path, shared: str, own: str, circle: float | None
) -> None:
    rig = load_rig(write(tmp_path, f"lens: {shared}\ncameras: [{camera_with(lens=own)}]"))
    assert rig.cameras[0].lens.circle_of_confusion == circle
    assert load_rig(write(tmp_path, rig_to_yaml(rig))).cameras == rig.cameras


@pytest.mark.parametrize(
    ("shared", "own", "hyperfocal"),
    [
        ("{f_number: 8, circle_of_confusion: 3e-5}", "{}", 0.05**2 / (8 * 3e-5)),
        ("{f_number: 8, circle_of_confusion: 3e-5}", "{f_number: 4}", 0.05**2 / (4 * 3e-5)),
        ("{f_number: 8, circle_of_confusion: 3e-5}", "{hyperfocal_distance: 7}", 7),
        ("{hyperfocal_distance: 7}", "{f_number: 8, circle_of_confusion: 3e-5}", 0.0025 / 24e-5),
        ("{f_number: 8, circle_of_confusion: 3e-5}", "{focal_length: 0.1}", 0.1**2 / (8 * 3e-5)),
    ],
)
def test_the_aperture_gives_the_hyperfocal_distance(
    tmp_path: Path, shared: str, own: str, hyperfocal: float
) -> None:
    rig = load_rig(write(tmp_path, f"lens: {shared}\ncameras: [{camera_with(lens=own)}]"))
    assert rig.cameras[0].lens.hyperfocal_distance == pytest.approx(hyperfocal, rel=1e-12)


@pytest.mark.parametrize(
    ("shared", "own", "takes"),
    [
        ("{focus_distances: [1, 5e-1, 1]}", "{}", {"focus_distances": (0.5, 1.0)}),
        ("{focus_distances: [1]}", "{focus_distances: [2]}", {"focus_distances": (2.0,)}),
        ("{focus_distances: [1]}", "{focus_distances: null}", {}),
        ("{focus_distances: [1]}", "{min_focus: 0.4, focus_steps: 9}", {"focus_steps": 9}),
        (
            "{min_focus: 0.4, focus_steps: 9}",
            "{focus_distances: [1]}",
            {"focus_distances": (1.0,)},
        ),
        ("{min_focus: 0.4, focus_steps: 9}", "{focus_distances: null}", {"focus_steps": 9}),
        ("{min_focus: 0.4, focus_steps: 9}", "{focus_steps: null}", {}),
        (f"{{table: {TABLE}}}", "{}", {"table": STEPS}),
        (f"{{table: {TABLE}}}", "{table: {unit: dioptres}}", {"table": LensTable("dioptres")}),
        (f"{{table: {TABLE}}}", "{table: null}", {}),
    ],
)
def test_a_camera_overrides_what_its_lens_takes(
    tmp_path: Path, shared: str, own: str, takes: dict[str, Any]
) -> None:
    rig = load_rig(write(tmp_path, f"lens: {shared}\ncameras: [{camera_with(lens=own)}]"))
    lens = rig.cameras[0].lens
    assert lens == replace(Lens(min_focus=lens.min_focus), **takes)


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("", "an empty file"),
        ("\n", "expected keys and values: frame_id, image, .* got nothing"),
        ("cameras: [1, 2", r"expected YAML, got line \d, column \d: "),
        ("cameras: {{", "expected YAML, got line "),
        ("a: !!python/object:os.system x", "expected YAML"),
        ("frame_id: 2024-13-41", "expected YAML, got line 1, column 11: a number or a date that"),
        ("- 1", "expected keys and values"),
        ("frame_id: world", "cameras: expected a list of cameras, got nothing"),
        ("cameras: []", "rig: expected at least one camera, got none"),
        ("cameras: {a: 1}", "cameras: expected a list"),
        ("camras: []", "camras: expected one of .*did you mean cameras"),
        (f"cameras: [{camera_with(lense='{}')}]", r"cameras\[0\]\.lense: .*did you mean lens\?"),
        (f"lens: {{f_nmber: 8}}\ncameras: [{CAMERA}]", r"lens\.f_nmber: .*did you mean f_number"),
        (f"zoom: 1\ncameras: [{CAMERA}]", "zoom: expected one of the keys .*, got an unknown one$"),
        ("cameras: [{name: a}]", r"cameras\[0\]\.position: expected a value, got none"),
        ("cameras: [a]", r"cameras\[0\]: expected keys and values: name"),
        (
            f"cameras: [{CAMERA}, {CAMERA}]",
            "unique camera names, got 'a' 2 times; name one of them a_2$",
        ),
        (
            f"cameras: [{CAMERA}, {CAMERA.replace('name: a', 'name: ä')}]",
            r"cameras\[1\]: camera name: expected letters, .* got 'ä'; name it a_2$",
        ),
        (f"cameras: [{CAMERA.replace('name: a', 'name: 7')}]", "got 7; name it cam_7$"),
        (
            f"cameras: [{CAMERA.replace('[0, 0, 0, 1]', '[0, 0, 0, 0]')}]",
            r"yaml: camera a: orientation: expected a unit quaternion .*never set",
        ),
        (
            f"cameras: [{CAMERA.replace('[0, 0, 0, 1]', '[.nan, 0, 0, 1]')}]",
            r"yaml: camera a: orientation: expected a unit quaternion",
        ),
        (
            f"cameras: [{CAMERA.replace('[1, 0, 0]', '[1, .nan, 0]')}]",
            r"yaml: camera a: position: expected finite coordinates",
        ),
        (
            f"cameras: [{CAMERA.replace('[1, 0, 0]', '[1, 0]')}]",
            r"cameras\[0\]\.position: expected a list of 3 numbers, got a list of 2",
        ),
        (
            f"cameras: [{CAMERA.replace('[1, 0, 0]', '[1, x, 0]')}]",
            r"cameras\[0\]\.position\[1\]: expected a number, got 'x'",
        ),
        (f"cameras: [{CAMERA.replace('a,', '1a,')}]", r"cameras\[0\]: camera name: .*got '1a'"),
        (f"cameras: [{CAMERA.replace('a,', 'yes,')}]", r"cameras\[0\]: camera name: .*got True"),
        (
            f"lens: {{circle_of_confusion: 3e-5}}\ncameras: [{CAMERA}]",
            "lens: expected f_number or hyperfocal_distance with circle_of_confusion, got neither",
        ),
        (
            f"lens: {{f_number: 8, hyperfocal_distance: 9}}\ncameras: [{CAMERA}]",
            "lens: expected either hyperfocal_distance or .*got both",
        ),
        (
            f"lens: {{focal_length: -1}}\ncameras: [{CAMERA}]",
            r"yaml: lens\.focal_length: .*above 0",
        ),
        (
            f"lens: {{focus_distances: 3}}\ncameras: [{CAMERA}]",
            r"lens\.focus_distances: expected a list of numbers, got a number",
        ),
        (
            f"lens: {{focus_distances: [1, x]}}\ncameras: [{CAMERA}]",
            r"lens\.focus_distances\[1\]: expected a number, got 'x'",
        ),
        (
            f"lens: {{focus_distances: []}}\ncameras: [{CAMERA}]",
            r"yaml: lens\.focus_distances: expected 1 to 65536 distances, got 0",
        ),
        (
            f"lens: {{table: {{unt: m}}}}\ncameras: [{CAMERA}]",
            r"yaml: lens\.table\.unt: .*did you mean unit\?",
        ),
        (
            f"lens: {{table: {{unit: s, distances: [1], values: [2]}}}}\ncameras: [{CAMERA}]",
            r"yaml: lens\.table: table\.distances: expected at least 2, got 1",
        ),
        (
            f"lens: {{min_focus: 9, table: {TABLE}}}\ncameras: [{CAMERA}]",
            r"yaml: lens\.table: expected distances from min_focus \(9 m\) .*, got 0.4 to 2 m",
        ),
        (
            f"image: {{width: 9}}\nimage: {{}}\ncameras: [{CAMERA}]",
            "line 2, .* duplicate key image",
        ),
        (
            f"lens: {{focus_steps: 2.5, min_focus: 1}}\ncameras: [{CAMERA}]",
            r"lens\.focus_steps: expected a whole number",
        ),
        (f"image: {{width: 1.5}}\ncameras: [{CAMERA}]", r"yaml: image\.width: expected a whole"),
        (f"image: {{width: wide}}\ncameras: [{CAMERA}]", r"image\.width: expected a number"),
        (
            f"image: {{distortion_model: 3}}\ncameras: [{CAMERA}]",
            r"yaml: image\.distortion_model: expected a name, got 3",
        ),
        (
            f"image: {{distortion_model: fisheye}}\ncameras: [{CAMERA}]",
            r"yaml: image\.distortion_model: expected one of .*, got 'fisheye'",
        ),
        (
            f"image: {{distortion: [0.1, x]}}\ncameras: [{CAMERA}]",
            r"yaml: image\.distortion\[1\]: expected a number, got 'x'",
        ),
        (
            f"image: {{binning: 2}}\ncameras: [{CAMERA}]",
            r"yaml: image\.binning: expected a list of numbers, got a number",
        ),
        (
            f"cameras: [{camera_with(image='{region: [0, 0, 1.5, 2]}')}]",
            r"yaml: camera a: image\.region\[2\]: expected a whole number of at least 1, got 1\.5",
        ),
        (f"image:\ncameras: [{CAMERA}]", r"image: expected keys and values: width, .*got nothing"),
        (f"grid: {{rows: 2}}\ncameras: [{CAMERA}]", r"grid\.columns: expected a value"),
        (f"sequence: 1\ncameras: [{CAMERA}]", "sequence: expected true or false, got 1"),
        (f"grid: {{rows: 2, columns: 3}}\ncameras: [{CAMERA}]", "rows × columns = 1"),
        (f"frame_id: 3\ncameras: [{CAMERA}]", "frame_id: expected a name, got 3"),
    ],
)
def test_a_bad_rig_is_refused_where_it_is_bad(tmp_path: Path, text: str, telling: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=telling) as caught:
        load_rig(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_missing_or_binary_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected a rig\.yaml, got no such file"):
        load_rig(tmp_path / "none.yaml")
    (tmp_path / "rig.yaml").write_bytes(bytes(range(255, 0, -1)))
    with pytest.raises(InputError, match="not text"):
        load_rig(tmp_path / "rig.yaml")


def test_what_differs_from_the_others_is_written_with_its_camera() -> None:
    base, *rest = cylinder_rig(1, 4).cameras
    odd = Camera(
        base.name, base.position, base.orientation, CameraIntrinsics(width=99), Lens(max_focus=2.0)
    )
    lines = rig_to_yaml(Rig((odd, *rest))).splitlines()
    assert [line for line in lines if "image" in line][1].endswith(
        "image: {width: 99}, lens: {max_focus: 2.0}}"
    )
    told = replace(odd, lens=Lens(table=STEPS))
    (line,) = (line for line in rig_to_yaml(Rig((told, *rest))).splitlines() if "table" in line)
    assert line.endswith(
        "lens: {table: {unit: steps, distances: [0.4, 2.0], values: [900.0, 0.0]}}}"
    )
    assert sum(bool(re.search("image|lens", line)) for line in lines) == 3


# --- circles of confusion that were assumed ----------------------------------------------------

FULL_FRAME = "image: {width: 6000, height: 4000, fx: 8333, fy: 8333, cx: 2999.5, cy: 1999.5}"


ONE = f"cameras: [{CAMERA}]"
DOUBTED = "defaults: [lens.focal_length]"


def loaded(folder: Path, text: str) -> Rig:
    return load_rig(write(folder, text))


def test_an_f_number_takes_two_pixels_and_says_so(tmp_path: Path) -> None:
    lens = "lens: {focal_length: 0.05, f_number: 8}"
    rig = loaded(tmp_path, f"{FULL_FRAME}\n{lens}\ncameras: [{CAMERA}]")
    circle = 2 * 0.05 / 8333
    assert rig.cameras[0].lens.circle_of_confusion == pytest.approx(circle, rel=1e-15)
    assert rig.cameras[0].lens.hyperfocal_distance == pytest.approx(0.05**2 / (8 * circle))
    (note,) = rig.notes
    assert note.code == "default_lens"
    assert "of the only camera: 12 µm is assumed, two pixels;" in note.text
    assert note.text.endswith(f"as circle_of_confusion under lens in {tmp_path / 'rig.yaml'}")


@pytest.mark.parametrize(
    ("text", "focal_length", "codes"),
    [
        (f"{FULL_FRAME}\nlens: {{f_number: 8}}", 0.05, ["default_lens"] * 2),
        (
            f"{FULL_FRAME}\nlens: {{focal_length: 0.05, f_number: 8}}\n{DOUBTED}",
            0.05,
            ["default_lens"] * 2,
        ),
        ("lens: {focal_length: 0.035, f_number: 8}", 0.035, ["default_image", "default_lens"]),
    ],
)
def test_of_unknown_pixels_it_takes_a_part_of_the_diagonal(
    tmp_path: Path, text: str, focal_length: float, codes: list[str]
) -> None:
    rig = loaded(tmp_path, f"{text}\ncameras: [{CAMERA}]")
    image = rig.cameras[0].intrinsics
    diagonal = focal_length * math.hypot(image.width / image.fx, image.height / image.fy)
    assert rig.cameras[0].lens.circle_of_confusion == pytest.approx(diagonal / 1500, rel=1e-12)
    assert [note.code for note in rig.notes] == codes
    assert "assumed, the sensor's diagonal / 1500;" in rig.notes[-1].text


def test_a_circle_that_was_assumed_stays_one_in_files(tmp_path: Path) -> None:
    own = camera_with(lens="{hyperfocal_distance: 7, circle_of_confusion: 2e-5}")
    other = camera_with(image="{fx: 9000}", lens="{f_number: 5.6}")
    text = (
        f"{FULL_FRAME}\nlens: {{focal_length: 0.05, f_number: 8, min_focus: 0.4}}\n"
        f"cameras: [{CAMERA}, {own.replace('a,', 'b,')}, {other.replace('a,', 'c,')}]"
    )
    rig = loaded(tmp_path, text)
    assert rig.assumed["b"] == frozenset()
    for some in (slice(0, 3), slice(1, 3), slice(0, 1), slice(2, 3)):
        part = replace(rig, cameras=rig.cameras[some])
        written = rig_to_yaml(part)
        again = loaded(tmp_path, written)
        assert again == part
        assert again.assumed == {camera.name: rig.assumed[camera.name] for camera in part.cameras}
        assert rig_to_yaml(again) == written
        assert any("circle of confusion" in note.text for note in again.notes)
    assert (
        "lens: {focal_length: 0.05, f_number: 8.0, min_focus: 0.4}   # metres; circle_of_confusion"
        " is assumed: add yours\n"
    ) in rig_to_yaml(rig)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"lens: {{focal_length: 50}}\ncameras: [{CAMERA}]", "rig.yaml: lens.focal_length: "),
        (
            "cameras: [" + camera_with(lens="{focal_length: 50}") + "]",
            "rig.yaml: camera a: lens.focal_length: expected metres, .* write 0.05$",
        ),
        (
            "cameras: [" + camera_with(lens="{f_number: 8, circle_of_confusion: 0.03}") + "]",
            "rig.yaml: camera a: lens.circle_of_confusion: .* write 3e-05$",
        ),
        (
            "cameras: [" + camera_with(lens="{f_number: 0.125}") + "]",
            "rig.yaml: camera a: lens.f_number: .* for 1/8 write 8$",
        ),
        (
            "cameras: [" + camera_with(lens="{focal_length: 1.55}", image="{fx: 500}") + "]",
            "rig.yaml: camera a: lens.focal_length: .* write 0.00155$",
        ),
        (
            f"lens: {{table: {{unit: s, distances: [300, 900], values: [0, 9]}}}}\n{ONE}",
            r"rig.yaml: lens.table.*distances \(the nearest\): .* write 0.3$",
        ),
        (f"defaults: [lense]\ncameras: [{CAMERA}]", r"a list of 1; did you mean lens\?"),
    ],
)
def test_an_error_names_file_camera_and_value(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        loaded(tmp_path, text)
