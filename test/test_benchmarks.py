# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The parts of the benchmarks, without running them: they must not fall behind the package."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from benchmarks import attacks, fuzz, tolerance
from benchmarks.attacks.hostile_files import quotes_the_key, write
from benchmarks.attacks.hostile_runs import KINDS
from benchmarks.attacks.table import Seen, attack
from benchmarks.fuzz.damage import altered, damaged
from benchmarks.fuzz.good_files import kinds
from benchmarks.fuzz.random_requests import random_request
from focus_planner.core.rig.layouts import dome_rig
from testing import reference

ROOT = Path(__file__).parents[1]
PARTS = [
    *(f"attacks.{kind}" for kind in attacks._KINDS),
    *(f"fuzz.{kind}" for kind in fuzz._KINDS),
    *("peers", "versus"),
    *(path.stem for path in (ROOT / "benchmarks").glob("*.py") if not path.stem.startswith("_")),
]
HELPERS = {"compact", "guarantees", "options", "processes", "scenes", "timing", "vanishing"}


@pytest.mark.parametrize("part", sorted(set(PARTS) - HELPERS))
def test_every_part_can_be_run(part):
    assert callable(import_module(f"benchmarks.{part}").run)


def test_every_module_of_attacks_with_a_table_is_carried_out():
    folder = ROOT / "benchmarks" / "attacks"
    with_a_table = {path.stem for path in folder.glob("*.py") if "\ndef run(" in path.read_text()}
    assert with_a_table - {"__init__"} == set(attacks._KINDS)


def test_random_requests_and_damage_are_the_same_for_the_same_seed():
    def drawn():
        random = np.random.default_rng(1)
        data = b"cameras: [1.0, 2.0]\n" * 20
        return [
            (random_request(random), damaged(data, random), altered(data, random))
            for _ in range(200)
        ]

    assert repr(drawn()) == repr(drawn())


def test_altered_bytes_are_as_many():
    random = np.random.default_rng(1)
    assert {len(altered(bytes(range(200)), random)) for _ in range(200)} == {200}


def test_every_kind_of_file_is_there(tmp_path):
    names = [kind.name for kind in kinds(tmp_path)]
    assert len(names) == len(set(names)) == 27
    assert all(kind.good for kind in kinds(tmp_path / "again"))


def test_a_quoted_key_is_noticed(tmp_path):
    lines = write("a private key", tmp_path / "key").read_text().splitlines()
    assert quotes_the_key(f"expected a mapping, got {lines[7][4:40]!r}")
    assert not quotes_the_key("expected a mapping, got a text")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if "unpacks" not in kind])
def test_hostile_runs_are_whole_folders(kind, tmp_path):
    folder = tmp_path / "20990102T030405.000001Z-0123abcd"
    folder.mkdir()
    KINDS[kind](folder, "/planner/focus_plan")
    assert {path.name for path in folder.iterdir()} == {f"{folder.name}_0.mcap", "metadata.yaml"}


def test_an_attack_keeps_what_it_is(tmp_path):
    @attack("a", "b")
    def made(folder):
        return Seen(str(folder), held=True)

    assert (made.what, made.asked, made.carry_out(tmp_path).observed) == ("a", "b", str(tmp_path))


def test_errors_of_depth_are_what_the_tolerance_is_measured_against():
    planned = dome_rig(1, 4, 0.6, 30.0, 30.0, 0.0)
    camera = planned.cameras[0]
    _, _, axis = reference.camera_axes(camera)
    random = np.random.default_rng(2)
    errors = []
    for _ in range(4000):
        moved = tolerance.real_rig(planned, random).cameras[0]
        # Of the subject's middle, 0.6 m away, and of a lens that is set to be sharp there.
        depth = np.dot(np.negative(moved.position), axis)
        errors.append(depth - 1 / (1 / 0.6 + random.normal(scale=0.02)))
    expected = tolerance.depth_errors(np.array([0.6]))[0]
    assert expected == pytest.approx(np.sqrt(0.01**2 + 0.005**2 + (0.02 * 0.36) ** 2))
    assert np.std(errors) == pytest.approx(expected, rel=0.05)
    assert abs(np.mean(errors)) < 0.001
