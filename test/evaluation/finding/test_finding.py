# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What folders of scans become: 3DBodyTex as it is downloaded, others, recorded runs."""

from __future__ import annotations

import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest

from focus_planner.cli import main as cli
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.evaluation.finding.finding import Options, find_sources, spread
from focus_planner.io.bodies import bodies
from focus_planner.io.rigs import save_rig
from focus_planner.io.surfaces import load_surface
from testing.data_sets import body_tex_1, body_tex_2, person, write_npz, write_obj
from testing.runs import beginning_with, record_failure

BAGS = Path(__file__).parents[3] / "bags"
SMALL = Options(rig=cylinder_rig(3, 8), place="centred")


def unpacked(source):
    """Return a source's subject as it arrives on another machine."""
    return pickle.loads(pickle.dumps(source.pack())).unpack()


def box(subject):
    points = subject.surface.vertices
    return points.min(axis=0), points.max(axis=0)


def names(found):
    return [source.name for source in found.sources]


def codes(found):
    return [note.code for note in found.notes]


# --- 3DBodyTex -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("scale", "unit"), [(1, "m"), (100, "cm"), (1000, "mm")])
def test_the_first_3dbodytex_stands_between_the_cameras(tmp_path, scale, unit):
    found = find_sources(body_tex_1(tmp_path, scale=scale))
    assert names(found) == ["006-f-run", "012-m-u", "355-m-scape039"]
    assert codes(found) == [*(["unit"] if unit != "m" else []), "up_axis", "placement"]
    for source, height in zip(found.sources, (1.6, 1.65, 1.7), strict=True):
        subject = unpacked(source)
        low, high = box(subject)
        np.testing.assert_allclose((low + high)[:2], 0, atol=3e-6)
        assert low[2] == pytest.approx(0, abs=2e-6)
        assert high[2] == pytest.approx(height, abs=2e-3)
        assert len(subject.rig) == 168
        assert [note.code for note in subject.notes] == codes(found)  # none on textures


def test_the_second_3dbodytex_is_read_from_its_archives(tmp_path):
    found = find_sources(body_tex_2(tmp_path))
    assert names(found) == [
        "test/170410-007-f-1moq-b682-result",
        "train/170410-001-m-r9iu-df44-result",
    ]
    whole = unpacked(found.sources[0])
    assert len(whole.surface.vertices) == len(person().vertices)  # not the partial scan
    assert "partial" in found.notes[-1].text
    texture = 64 * 64 * 3
    assert sum(map(len, found.sources[0].pack().files.values())) < 2 * texture + 30_000


def test_all_versions_of_a_scan_are_one_subject(tmp_path):
    for version, mesh in (
        ("high/a.ply", person()),
        ("low/a.ply", person(coarse=True)),
        ("high/a_simplified.stl", person(coarse=True)),
        ("high/b.obj", person()),
    ):
        path = tmp_path / version
        path.parent.mkdir(exist_ok=True)
        mesh.export(path)
    found = find_sources(tmp_path, SMALL)
    assert names(found) == ["a", "b"]
    assert found.sources[0].path == tmp_path / "high/a.ply"
    assert found.notes[-1].text == (
        "of 1 subject there are several versions; the whole, finest one is taken, such as"
        " high/a.ply, not high/a_simplified.stl, low/a.ply"
    )


# --- unit, axis, place ---------------------------------------------------------------------------


@pytest.mark.parametrize("up", ["z", "y", "x"])
def test_the_axis_is_found_that_the_cameras_see_most_with(tmp_path, up):
    for number in range(2):
        person(1.7, up).export(tmp_path / f"{number}.ply")
    found = find_sources(tmp_path)
    low, high = box(unpacked(found.sources[0]))
    assert high[2] - low[2] == pytest.approx(1.7, abs=1e-3)
    assert ("up_axis" in codes(found)) == (up != "z")


def test_what_is_told_is_not_guessed(tmp_path):
    person(1700, "y").export(tmp_path / "a.ply")
    told = Options(up="y", unit="mm", place="as_is")
    found = find_sources(tmp_path, told)
    assert not found.notes
    _, high = box(unpacked(found.sources[0]))
    assert high[2] == pytest.approx(1.7 + 0.0004, abs=1e-3)


def test_shipped_bodies_stay_where_they_are_bit_for_bit():
    found = find_sources(bodies()[0].parent)
    assert not found.notes
    for source, path in zip(found.sources, bodies(), strict=True):
        assert source.name == path.stem
        np.testing.assert_array_equal(
            unpacked(source).surface.vertices, load_surface(path).vertices
        )


def test_before_another_rig_surfaces_stay_where_they_are(tmp_path):
    person().export(tmp_path / "a.ply")
    found = find_sources(tmp_path, Options(rig=cylinder_rig(3, 8)))
    low, _ = box(unpacked(found.sources[0]))
    assert low[2] == pytest.approx(0.4, abs=1e-3)
    assert not found.notes


def test_in_a_rigs_own_frame_nothing_is_assumed(tmp_path):
    cameras = cylinder_rig(1, 8, radius=0.3, bottom=0.4, top=0.4).cameras
    beside = Rig(cameras[:2])  # as of a gantry: less far apart than the subject is tall
    person(1.7, "y").export(tmp_path / "anna.ply")
    person(0.3).export(tmp_path / "small.ply")
    found = find_sources(tmp_path, Options(beside))
    assert found.notes == ()
    (tall, _) = (source.pack().unpack() for source in found.sources)
    expected = load_surface(tmp_path / "anna.ply")
    np.testing.assert_array_equal(tall.surface.vertices, expected.vertices)


def test_mixed_units_are_refused(tmp_path):
    person().export(tmp_path / "a.ply")
    person(1700).export(tmp_path / "b.ply")
    with pytest.raises(InputError, match=r"a, 1\.7 across, as if in metres, and b, 1700 across"):
        find_sources(tmp_path)
    assert len(find_sources(tmp_path, Options(unit="m", up="z")).sources) == 2


def test_what_has_room_in_no_unit_is_refused(tmp_path):
    person(1e6).export(tmp_path / "a.ply")
    with pytest.raises(InputError, match=r"a: expected a surface that has room between the cam"):
        find_sources(tmp_path)


# --- names and digests ---------------------------------------------------------------------------


def test_digests_change_with_all_that_decides(tmp_path):
    person().export(tmp_path / "a.ply")
    person().export(tmp_path / "b.ply")
    told = Options(up="z", unit="m", place="as_is")
    first, second = (source.digest for source in find_sources(tmp_path, told).sources)
    assert first == second
    others = {
        "rig": cylinder_rig(2, 4),
        "up": "y",
        "unit": "cm",
        "place": "centred",
    }
    digests = {first}
    for name, value in others.items():
        options = Options(**{"up": "z", "unit": "m", "place": "as_is"} | {name: value})
        digests.add(find_sources(tmp_path, options).sources[0].digest)
    assert len(digests) == 1 + len(others)


def test_a_file_that_changed_since_is_not_sent(tmp_path):
    path = tmp_path / "a.ply"
    person().export(path)
    (source,) = find_sources(tmp_path, SMALL).sources
    person(1.5).export(path)
    with pytest.raises(InputError, match="the file that was there when the evaluation began"):
        source.pack()


def test_names_are_unique_and_short(tmp_path):
    for path in ("x/one/mesh.ply", "x/two/mesh.ply", "x/two/two.ply"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        person(coarse=True).export(tmp_path / path)
    assert names(find_sources(tmp_path, SMALL)) == ["one/mesh", "two", "two/mesh"]
    assert names(find_sources(tmp_path / "x/one/mesh.ply", SMALL)) == ["mesh"]


def test_subjects_are_spread_over_all(tmp_path):
    for number in range(6):
        person(coarse=True).export(tmp_path / f"{number}.ply")
    found = find_sources(tmp_path, Options(rig=SMALL.rig, most=3))
    assert names(found) == ["0", "2", "4"]
    assert spread("abcdefg", 2) == ["a", "d"]
    assert spread("ab", 5) == ["a", "b"]


# --- what cannot be read -------------------------------------------------------------------------


def test_a_broken_mesh_is_left_out_and_named(tmp_path):
    person().export(tmp_path / "a.ply")
    (tmp_path / "b.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:-50])
    (tmp_path / "._a.ply").write_bytes(b"of another file system")
    (tmp_path / "notes.txt").write_text("nothing of a surface\n")
    found = find_sources(tmp_path, SMALL)
    assert names(found) == ["a"]
    (told,) = [note.text for note in found.notes if note.code == "left_out"]
    assert told.startswith(f"left out: {tmp_path / 'b.ply'}: expected a complete")


def test_if_nothing_can_be_read_the_first_reason_is_told(tmp_path):
    (tmp_path / "a.ply").write_bytes(b"ply\n")
    with pytest.raises(InputError, match=r"at least one subject that can be read, got .*a\.ply"):
        find_sources(tmp_path)


def test_an_empty_folder_and_none_are_told_apart(tmp_path):
    with pytest.raises(InputError, match="at least one mesh, point cloud or recorded run"):
        find_sources(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        find_sources(tmp_path / "missing")


def test_an_archive_without_a_mesh_is_no_subject(tmp_path):
    write_npz(tmp_path / "a.npz", person())
    np.savez(tmp_path / "pose.npz", betas=np.zeros(10))
    assert names(find_sources(tmp_path, SMALL)) == ["a"]


def test_buffers_beside_a_gltf_travel_with_it(tmp_path):
    for name, content in person().export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    (source,) = find_sources(tmp_path, SMALL).sources
    assert len(source.pack().files) > 1
    assert len(unpacked(source).surface.vertices) == len(person().vertices)


# --- recorded runs -------------------------------------------------------------------------------


def test_recorded_runs_are_subjects_before_their_own_rigs(tmp_path):
    for name in ("mesh_em", "mixed_rig"):
        shutil.copytree(BAGS / name, tmp_path / name)
    shutil.copytree(BAGS / "data_sets/bodies", tmp_path / "no_run")
    found = find_sources(tmp_path)
    assert names(found) == ["mesh_em", "mixed_rig"]
    assert "no_run: expected a recorded run" in found.notes[0].text
    subject = unpacked(found.sources[1])
    assert len({camera.lens for camera in subject.rig.cameras}) > 1
    (other,) = find_sources(tmp_path / "mesh_em", Options(rig=cylinder_rig(2, 4))).sources
    assert len(unpacked(other).rig) == 8


@pytest.mark.parametrize("option", ["up", "unit", "place"])
def test_runs_are_not_turned(option):
    value = {"up": "y", "unit": "mm", "place": "centred"}[option]
    with pytest.raises(InputError, match=f"--{option}: expected surfaces from files"):
        find_sources(BAGS / "mesh_em", Options(**{option: value}))


def test_nothing_of_a_temporary_folder_is_left(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", None)
    write_obj(tmp_path / "data/a.obj", person())
    path = tmp_path / "data/a.obj"
    path.write_text(path.read_text() + "p 1\n")
    subject = unpacked(find_sources(tmp_path / "data", SMALL).sources[0])
    assert not list((tmp_path / "tmp").iterdir())
    assert all("focus_planner_" not in note.text for note in subject.notes)


def test_each_subject_of_a_run_for_several_is_one(tmp_path):
    for name, height in (("anna", 1.6), ("bert", 1.7)):
        person(height).export(tmp_path / f"{name}.ply")
    save_rig(cylinder_rig(2, 4), tmp_path / "rig.yaml")
    surfaces = (str(tmp_path / f"{name}.ply") for name in ("anna", "bert"))
    words = ["--rig", tmp_path / "rig.yaml", "--samples", 50, "--record", tmp_path / "runs"]
    words += ["--output", tmp_path / "plan.json"]
    assert cli.main(["plan", *surfaces, *map(str, words)]) == 0
    found = find_sources(tmp_path / "runs")
    run = next((tmp_path / "runs").iterdir()).name
    assert names(found) == [f"{run}/anna.ply", f"{run}/bert.ply"]
    heights = [float(np.ptp(box(unpacked(source)), axis=0)[2]) for source in found.sources]
    np.testing.assert_allclose(heights, [1.6, 1.7], atol=1e-3)


def test_a_run_without_a_surface_is_left_out(tmp_path):
    record_failure(tmp_path, beginning_with(), [], "no surface yet")
    with pytest.raises(InputError, match="expected a run with a surface"):
        find_sources(tmp_path)
