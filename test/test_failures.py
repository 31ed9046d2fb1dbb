# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a run of tests tells when tests fail or hang, in projects of their own."""

from __future__ import annotations

import subprocess
import sys

import pytest

from testing.pages import ROOT

SETTINGS = """\
[pytest]
addopts = -p no:dash
faulthandler_timeout = 3
faulthandler_exit_on_timeout = true
"""
CONFTEST = """\
from testing.early_failures import EarlyFailures

def pytest_configure(config):
    config.pluginmanager.register(EarlyFailures(config))
"""
STUCK = """\
import ctypes

def test_that_fails():
    cost = 3
    assert cost == 4

def test_that_never_returns():
    libc = ctypes.PyDLL(None)  # it keeps the interpreter to itself
    while True:
        libc.pause()

def test_that_passes():
    pass
"""

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    folder = tmp_path_factory.mktemp("project")
    for name, text in (("pytest.ini", SETTINGS), ("conftest.py", CONFTEST), ("test_it.py", STUCK)):
        (folder / name).write_text(text, "utf-8")
    command = [sys.executable, "-m", "pytest", "-n1", f"--rootdir={folder}", str(folder)]
    ended = subprocess.run(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    assert ended.returncode == 1
    return ended.stdout


def test_a_failure_is_told_while_others_run(told):
    early, _, late = told.partition(" FAILURES ")
    assert "test_it.py::test_that_fails: failed in call" in early
    assert "assert 3 == 4" in early
    assert "assert 3 == 4" in late


def test_a_test_that_hears_no_signal_ends_its_worker_only(told):
    assert "in test_that_never_returns" in told
    assert "2 failed, 1 passed" in told
