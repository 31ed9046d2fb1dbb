# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import json
from contextlib import ExitStack
from dataclasses import replace

import pytest

from focus_planner.core.validation import InputError
from focus_planner.evaluation.results import store as store_module
from focus_planner.evaluation.results.store import opened
from testing.experiments import CONDITIONS, Box, boxes


@pytest.fixture
def folder(tmp_path):
    with opened(tmp_path / "results", CONDITIONS, boxes(2)):
        pass
    return tmp_path / "results"


def open_it(folder, conditions=CONDITIONS, sources=None):
    with opened(folder, conditions, boxes(2) if sources is None else sources) as store:
        return store


def test_a_folder_says_what_it_holds(folder):
    noted = json.loads((folder / "evaluation.json").read_text())
    assert noted["conditions"] == {"samples": 20, "judged": 20, "seed": 0}
    assert list(noted["subjects"]) == ["box0", "box1"]
    assert {"focus_planner", "python", "numpy", "sources"} <= noted["software"].keys()


def test_more_subjects_are_fine(folder):
    open_it(folder, sources=boxes(4))
    assert len(json.loads((folder / "evaluation.json").read_text())["subjects"]) == 4


def test_other_conditions_are_refused(folder):
    with pytest.raises(InputError, match="with samples 9, seed 7, got one with samples 20, seed 0"):
        open_it(folder, replace(CONDITIONS, samples=9, seed=7))


def test_other_subjects_of_the_same_names_are_refused(folder):
    with pytest.raises(InputError, match="others called box1; give another --output, or remove"):
        open_it(folder, sources=[Box("box0"), Box("box1", 3.0)])


def test_fewer_subjects_are_refused(folder):
    with pytest.raises(InputError, match="those of box1 too; give these as well"):
        open_it(folder, sources=boxes(1))


def test_another_version_is_refused(folder, monkeypatch):
    monkeypatch.setattr(store_module, "version", lambda: "99.0")
    with pytest.raises(InputError, match=r"results of version 99\.0, got those of 0\."):
        open_it(folder)


@pytest.mark.parametrize("content", [b"", b"[]", b'{"conditions": 1}', b"\xff"])
def test_a_damaged_note_is_refused(folder, content):
    (folder / "evaluation.json").write_bytes(content)
    with pytest.raises(InputError, match=r"evaluation\.json"):
        open_it(folder)


def test_two_at_once_are_refused(folder):
    with ExitStack() as stack:
        stack.enter_context(opened(folder, CONDITIONS, boxes(2)))
        with pytest.raises(InputError, match="one to which another evaluation writes; wait"):
            open_it(folder)
    open_it(folder)


def test_two_subjects_of_one_name_are_refused(tmp_path):
    with pytest.raises(InputError, match="a name of its own for each, got several box0"):
        open_it(tmp_path, sources=[Box("box0"), Box("box0", 3.0)])


def test_names_of_several_lines_are_refused(tmp_path):
    with pytest.raises(InputError, match="printable characters"):
        open_it(tmp_path, sources=[Box("a\nb")])
