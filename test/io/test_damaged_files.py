# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Fuzz: whatever a file holds, it is read or refused in words, and nothing of it is given away."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.validation import InputError
from testing.damaged_files import (
    ABSURD,
    KINDS,
    PRIVATE_KEY,
    SECRET,
    Kind,
    aliases,
    damaged,
    read_damaged,
    with_absurd_number,
)

MUTANTS = 100
every_kind = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())


@every_kind
def test_a_good_file_is_good(kind: Kind, tmp_path: Path) -> None:
    assert kind.read(tmp_path, kind.content) is None


@every_kind
def test_a_damaged_file_is_read_or_refused(kind: Kind, tmp_path: Path) -> None:
    outcomes = read_damaged(kind, MUTANTS, tmp_path)
    assert outcomes["refused"] > MUTANTS / 2
    assert sum(outcomes.values()) == MUTANTS


@every_kind
@pytest.mark.filterwarnings("error")
def test_absurd_numbers_are_refused_or_planned_with(kind: Kind, tmp_path: Path) -> None:
    for seed in range(MUTANTS // 3):
        content = with_absurd_number(kind.content, np.random.default_rng(seed))
        reason = kind.read(tmp_path, content)
        assert reason is None or len(reason) < 1000, seed


def test_damage_repeats() -> None:
    content = KINDS["rig"].content
    one, again, other = (damaged(content, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert one == again != other
    assert len(set(ABSURD)) == len(ABSURD)


@every_kind
def test_other_files_are_refused_without_a_word_of_theirs(kind: Kind, tmp_path: Path) -> None:
    words = SECRET[:20], SECRET[20:40]
    foreign = (
        PRIVATE_KEY,
        f"root:$6${SECRET}:19000:0:99999:7:::\nbin:*:19000:0:99999:7:::\n",
        f"password: {SECRET}\n",
        f"{SECRET}: {words[0]}\n",
        f"- {SECRET}\n- {words[1]}\n",
        f"{words[0]} {words[1]}\n{words[1]} {words[0]}\n",
        f'{{"{words[0]}": "{SECRET}"}}',
        f"127.0.0.1 {words[0]} {words[1]} a b c d e f\n",
        f"1 PINHOLE {words[0]} 1 1 1 1 1\n1 {words[0]} 1 1 1\n",
    )
    for text in foreign:
        reason = kind.read(tmp_path, text.encode())
        assert reason is not None
        assert not any(part in reason for part in (SECRET[:12], SECRET[22:32])), reason


@every_kind
def test_short_files_that_stand_for_much_are_refused(kind: Kind, tmp_path: Path) -> None:
    for content in (b"[" * 100_000, b'{"a":' * 100_000, b"- " * 50_000, aliases(), b"\0" * 1000):
        assert kind.read(tmp_path, content) is not None


@every_kind
def test_only_files_are_opened(kind: Kind, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kind.read(tmp_path, kind.content)
    path = tmp_path / kind.name

    def refused(telling: str) -> None:
        with pytest.raises(InputError, match=telling):
            kind.use(path)
        path.unlink()

    path.unlink()
    os.mkfifo(path)
    refused("got a pipe; save its contents in a file, and name that")
    for device in ("zero", "null"):
        path.symlink_to(f"/dev/{device}")
        refused("got a device")
    monkeypatch.chdir(tmp_path)  # a socket's name is short
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(kind.name)
        refused("got a socket")
    path.mkdir()
    with pytest.raises(InputError, match="got a folder"):
        kind.use(path)
    path.rmdir()
    with path.open("wb") as file:  # without a block on the disk
        file.truncate(5 << 30)
    refused("of at most .* bytes, got more")
