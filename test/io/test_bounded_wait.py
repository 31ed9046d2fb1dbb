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

import threading

import pytest

from focus_planner.core.validation import InputError
from focus_planner.io import bounded_wait
from focus_planner.io.bounded_wait import BoundedWait

LONG = 600.0


def test_what_is_read_is_returned_and_read_again_next_time() -> None:
    wait, calls = BoundedWait(LONG), []
    for i in range(3):
        assert wait.call("file", "a", lambda i=i: calls.append(i) or i) == i
    assert calls == [0, 1, 2]


def test_errors_come_where_it_was_called() -> None:
    def refuse() -> None:
        raise InputError("file", "one", "none")

    wait = BoundedWait(LONG)
    for _ in range(2):
        with pytest.raises(InputError, match="expected one, got none"):
            wait.call("file", "a", refuse)
    assert wait.call("file", "a", lambda: 7) == 7


def test_what_comes_too_late_counts_when_it_is_asked_for_again() -> None:
    answers = threading.Event()
    wait = BoundedWait(0.01)

    def read() -> str:
        answers.wait()
        return "late"

    for _ in range(2):
        with pytest.raises(InputError, match=r"file: .* within 0\.01 s, got no answer of its disk"):
            wait.call("file", "a", read)
    with pytest.raises(InputError, match="got one that still reads what was named before"):
        wait.call("file", "b", lambda: "other")
    (thread,) = [each for each in threading.enumerate() if each.name == "reading"]
    answers.set()
    thread.join()
    assert wait.call("file", "a", lambda: "new") == "late"
    patient = BoundedWait(LONG)
    assert patient.call("file", "a", lambda: "new") == "new"


@pytest.mark.parametrize(("kept", "key"), [(-1.0, "a"), (LONG, "b")])
def test_what_is_old_or_of_another_file_does_not_count(
    monkeypatch: pytest.MonkeyPatch, kept: float, key: str
) -> None:
    monkeypatch.setattr(bounded_wait, "_KEPT", kept)
    answers = threading.Event()
    wait = BoundedWait(0.0)
    with pytest.raises(InputError):
        wait.call("file", "a", answers.wait)
    (thread,) = [each for each in threading.enumerate() if each.name == "reading"]
    answers.set()
    thread.join()
    wait._seconds = LONG
    assert wait.call("file", key, lambda: "new") == "new"
