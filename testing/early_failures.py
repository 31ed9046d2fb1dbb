# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Failures told as they happen: a run that somebody ends names them all the same."""

from __future__ import annotations

import pytest

_LINES = 30


class EarlyFailures:
    """A plugin of pytest that writes the end of every failure at once."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        reporter = self._config.pluginmanager.get_plugin("terminalreporter")
        # Workers have none.
        if reporter is None or not report.failed:
            return
        reporter.ensure_newline()
        reporter.write_line(f"{report.nodeid}: failed in {report.when}", red=True)
        for title, text in [("", report.longreprtext), *report.sections]:
            for line in (title, *text.splitlines()[-_LINES:]):
                reporter.write_line(f"    {line}")
