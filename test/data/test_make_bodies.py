# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command that makes bodies, without the body model."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError

import body_model
import make_bodies
import numpy as np
import pytest
import trimesh

from testing.pages import ROOT

PAGE = (ROOT / "data" / "README.md").read_text(encoding="utf-8")
MISSING = (
    "make_bodies.py: error: the Anny body model is missing: pip install anny==0.6.2 in an "
    "environment of its own, see data/README.md\n"
)


class Boxes:
    """In place of the body model: boxes of random heights."""

    def draw(self, generator):
        box = trimesh.creation.box((0.3, 0.2, generator.uniform(1.5, 1.9)))
        return body_model.Body(body_model.place(box.vertices), box.faces, "down", 1.7)


@pytest.fixture
def installed(monkeypatch):
    """Pretend that the body model is installed."""
    monkeypatch.setattr(make_bodies, "version", lambda name: make_bodies.ANNY)
    monkeypatch.setattr(body_model, "Model", Boxes)


def make(count, folder, seed=1):
    return make_bodies.main(["--count", str(count), "--seed", str(seed), "--output", str(folder)])


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_bodies_are_numbered_and_told_of(installed, tmp_path, capsys):
    assert make(3, tmp_path / "new" / "bodies") == 0
    assert sorted(contents(tmp_path / "new/bodies")) == [f"body_00{k}.ply" for k in range(3)]
    lines = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"body_000\.ply  down +1\.70 m  \d\.\d\d m²", lines[1])
    areas = [trimesh.load(path).area for path in (tmp_path / "new/bodies").iterdir()]
    assert lines[-1].endswith(
        f"stature 1.70 ± 0.00 m, surface area {np.mean(areas):.2f} ± {np.std(areas):.2f} m²"
    )


@pytest.mark.parametrize(
    ("count", "last"), [(1, "body_000"), (1000, "body_999"), (1001, "body_1000")]
)
def test_names_sort_as_they_are_numbered(count, last):
    names = make_bodies.names(count)
    assert len(set(names)) == count
    assert names == sorted(names)
    assert names[-1] == f"{last}.ply"


def test_a_body_depends_on_the_seed_and_its_number_alone(installed, tmp_path):
    for count, seed in ((2, 1), (4, 1), (2, 2)):
        assert make(count, tmp_path / f"{count}_{seed}", seed) == 0
    few, more, other = (contents(tmp_path / name) for name in ("2_1", "4_1", "2_2"))
    assert few.items() <= more.items()
    assert len(set(more.values())) == 4
    assert not set(few.values()) & set(other.values())


@pytest.mark.parametrize("name", ["body_000.ply", "notes.txt"])
def test_nothing_is_overwritten_or_mixed(installed, tmp_path, capsys, name):
    (tmp_path / name).write_text("mine")
    assert make(2, tmp_path) == 2
    assert capsys.readouterr().err == (
        f"make_bodies.py: error: --output: expected a new or empty folder, got {tmp_path}, "
        "which is not\n"
    )
    assert contents(tmp_path) == {name: b"mine"}


def test_the_output_is_a_folder(installed, tmp_path, capsys):
    (tmp_path / "file").touch()
    assert make(1, tmp_path / "file") == 2
    assert "--output: expected a folder, got the file" in capsys.readouterr().err


def test_an_empty_folder_is_taken(installed, tmp_path):
    assert make(1, tmp_path) == 0


def test_without_the_body_model_it_says_what_to_install(monkeypatch, tmp_path, capsys):
    def missing(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr(make_bodies, "version", missing)
    assert make(1, tmp_path / "bodies") == 2
    assert capsys.readouterr().err == MISSING
    assert not (tmp_path / "bodies").exists()


@pytest.mark.processes
def test_so_it_does_where_no_package_is_installed_at_all(tmp_path):
    program = [sys.executable, "-I", "-S", str(ROOT / "data" / "make_bodies.py")]
    arguments = ["--count", "1", "--output", str(tmp_path / "bodies")]
    done = subprocess.run([*program, *arguments], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", MISSING)


def test_another_version_of_the_body_model_is_refused(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(make_bodies, "version", lambda name: "0.5.0")
    assert make(1, tmp_path / "bodies") == 2
    assert capsys.readouterr().err == (
        "make_bodies.py: error: expected version 0.6.2 of anny, got 0.5.0: "
        "pip install anny==0.6.2\n"
    )


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["--count", "0"], "--count: expected an integer of at least 1, got '0'"),
        (["--count", "many"], "--count: expected an integer of at least 1, got 'many'"),
        (["--count", "1", "--seed", "-1"], "--seed: expected an integer of at least 0, got '-1'"),
        (["--count", "1"], "required: --output"),
        (["--output", "x"], "required: --count"),
    ],
)
def test_arguments_that_cannot_be_are_refused(arguments, why, capsys):
    with pytest.raises(SystemExit, match="2"):
        make_bodies.main(arguments)
    assert why in capsys.readouterr().err


def test_the_page_installs_the_version_that_is_asked_for():
    assert set(re.findall(r"anny==([\d.]+\d)", PAGE)) == {make_bodies.ANNY}
    assert make_bodies.ANNY in (ROOT / "data/bodies/README.md").read_text(encoding="utf-8")
