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

import numpy as np
import pytest

from focus_planner import load_surface
from shapes.command import main
from shapes.parts import part


def test_makes_so_many_of_each_kind_from_a_seed_on(tmp_path, capsys):
    folder = tmp_path / "new" / "subjects"
    words = ["parts", "plants", "--count", "2", "--seed", "6", "--output", str(folder)]
    assert main(words) == 0
    names = ["part_006.ply", "part_007.ply", "plant_006.ply", "plant_007.ply"]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert capsys.readouterr().out.splitlines() == [str(folder / name) for name in names]


def test_a_file_is_the_subject_that_python_makes(tmp_path):
    words = ["parts", "--count", "1", "--seed", "3", "--height", "0.25", "--output", str(tmp_path)]
    assert main(words) == 0
    read, made = load_surface(tmp_path / "part_003.ply"), part(3, 0.25)
    np.testing.assert_array_equal(read.vertices, made.vertices)
    np.testing.assert_array_equal(read.triangles, made.triangles)
    assert read.notes == ()


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["part"], "KIND: expected one of parts, statues, plants, got 'part'; did you mean parts?"),
        (["parts", "--count", "0"], "--count: expected a whole number of at least 1, got 0"),
        (["parts", "--seed", "-1"], "--seed: expected a whole number of at least 0, got -1"),
        (["parts", "--height", "0"], "--height: expected a number of at least 0.001, got 0"),
        (["parts", "--height", "nan"], "--height: expected a number of at least 0.001, got nan"),
    ],
)
def test_bad_input_is_told_in_a_line_before_anything_is_made(tmp_path, capsys, words, reason):
    folder = tmp_path / "subjects"
    assert main([*words, "--output", str(folder)]) == 2
    assert capsys.readouterr().err == f"shapes: error: {reason}\n"
    assert not folder.exists()


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--output", "x"], "the following arguments are required: KIND"),
        (["parts"], "the following arguments are required: --output"),
        (["parts", "--output", "x", "--count", "few"], "--count: invalid int value: 'few'"),
    ],
)
def test_words_that_do_not_parse_are_told_in_a_line(capsys, words, reason):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert reason in error


def test_a_folder_that_cannot_be_made_is_told_in_a_line(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["parts", "--output", str(tmp_path / "file" / "folder")]) == 2
    assert capsys.readouterr().err == f"shapes: error: {tmp_path}/file/folder: Not a directory\n"
