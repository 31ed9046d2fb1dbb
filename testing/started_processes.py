# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which tests start processes: those with the marker ``processes``, and no others."""

from __future__ import annotations

import sys
from typing import Any

import pytest

from testing.forked import EVENT

_EVENTS = (
    "subprocess.Popen",
    "os.exec",
    "os.fork",
    "os.forkpty",
    "os.posix_spawn",
    "os.spawn",
    "os.system",
    EVENT,
)


class StartedProcesses:
    """A plugin of pytest that fails a test without the marker if it starts a process.

    What a fixture starts counts for every test that asks for the fixture, also where another
    test was the first to do so.
    """

    def __init__(self) -> None:
        self._seen: list[str] = []
        self._of_fixtures: dict[tuple[str, str], str] = {}
        seen, events = self._seen, _EVENTS  # the hook outlives this module's names

        def hear(event: str, arguments: tuple[Any, ...]) -> None:
            if event in events:
                seen.append(f"{event}{arguments[:2]}")

        sys.addaudithook(hear)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[Any]) -> Any:
        before = len(self._seen)
        try:
            return (yield)
        finally:
            if len(self._seen) > before:
                self._of_fixtures[fixturedef.baseid, fixturedef.argname] = self._seen[before]

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Any:
        before = len(self._seen)
        result = yield
        if item.get_closest_marker("processes") is None:
            started = self._seen[before:] or self._by_fixtures(item)
            if started:
                pytest.fail(
                    f"{item.nodeid} starts a process, by {started[0]}: mark it with"
                    " @pytest.mark.processes, or do without",
                    pytrace=False,
                )
        return result

    def _by_fixtures(self, item: pytest.Item) -> list[str]:
        names = getattr(item, "fixturenames", ())
        return [
            what
            for (base, name), what in self._of_fixtures.items()
            if name in names and item.nodeid.startswith(base)
        ]
