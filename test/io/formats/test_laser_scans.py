# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Las, laz and e57 files, written by the libraries that read them."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import pye57
import pytest

from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io.formats import contents as formats
from focus_planner.io.surfaces import load_surface

POINTS = np.random.default_rng(4).normal(size=(50, 3)).round(4)


def write_las(path: Path) -> Path:
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales = np.array([0.0001] * 3)
    header.add_extra_dim(laspy.ExtraBytesParams("importance", np.float32))
    for axis in "XYZ":
        header.add_extra_dim(laspy.ExtraBytesParams(f"Normal{axis}", np.float32))
    file = laspy.LasData(header)
    file.xyz = POINTS
    file["importance"] = np.arange(len(POINTS))
    for axis, number in zip("XYZ", (0, 0, 1), strict=True):
        file[f"Normal{axis}"] = np.full(len(POINTS), number)
    file.write(path)
    return path


@pytest.mark.parametrize("kind", ["las", "laz"])
def test_las_has_points_normals_and_importance(tmp_path: Path, kind: str) -> None:
    cloud = load_surface(write_las(tmp_path / f"a.{kind}"))
    assert isinstance(cloud, PointCloud)
    np.testing.assert_allclose(cloud.points, POINTS, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(cloud.normals, [[0, 0, 1]] * len(POINTS))
    np.testing.assert_array_equal(cloud.importance, np.arange(len(POINTS)))


@pytest.mark.parametrize("kind", ["las", "laz"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_las_cut_off_is_refused(tmp_path: Path, kind: str, share: float) -> None:
    path = write_las(tmp_path / f"a.{kind}")
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    with pytest.raises(InputError, match=rf"a\.{kind}: expected a complete {kind} file"):
        load_surface(path)


def write_e57(path: Path) -> Path:
    """Write two scans: as they are, and turned by a quarter around z and lifted."""
    file = pye57.E57(str(path), mode="w")
    half = len(POINTS) // 2
    first = {f"cartesian{axis}": POINTS[:half, i] for i, axis in enumerate("XYZ")}
    first["cartesianInvalidState"] = (np.arange(half) == 3).astype(np.int8)
    file.write_scan_raw(first)
    x, y, z = POINTS[half:].T
    second = {"cartesianX": y, "cartesianY": -x, "cartesianZ": z - 1}
    turn = np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    file.write_scan_raw(second, rotation=turn, translation=np.array([0.0, 0, 1]))
    file.close()
    return path


def test_e57_has_scans_in_one_frame(tmp_path: Path) -> None:
    cloud = load_surface(write_e57(tmp_path / "a.e57"))
    assert isinstance(cloud, PointCloud)
    np.testing.assert_allclose(cloud.points, np.delete(POINTS, 3, axis=0), atol=1e-6)
    (note,) = cloud.notes
    assert note.text.startswith("left out: 1 of 50 points, which are not finite numbers")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_e57_cut_off_is_refused(tmp_path: Path, share: float) -> None:
    path = write_e57(tmp_path / "a.e57")
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    with pytest.raises(InputError, match=r"a\.e57: expected a complete e57 file"):
        load_surface(path)


@pytest.mark.parametrize("kind", ["las", "laz", "e57"])
def test_without_the_libraries_they_are_named(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError(name=name)

    (tmp_path / f"a.{kind}").write_bytes(b"LASF")
    monkeypatch.setattr(formats.importlib, "import_module", missing)
    with pytest.raises(InputError, match=rf"the Python package that reads {kind}, got no module"):
        load_surface(tmp_path / f"a.{kind}")
