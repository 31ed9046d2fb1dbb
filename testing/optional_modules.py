# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tests that are skipped, with the reason, where an optional module that they import is not there.

In a workspace ``colcon test`` has what rosdep installs, and the interfaces only if they were built.
Continuous integration has everything, and lets no test be skipped.
"""

from __future__ import annotations

from contextlib import contextmanager

import pytest

#: What tests import that has no key of rosdep by which package.xml could name it.
WITHOUT_A_KEY = {"DracoPy", "laspy", "pye57", "pypdf", "sybil"}
OPTIONAL = {*WITHOUT_A_KEY, "focus_planner_msgs"}


@contextmanager
def skipped_without(**options):
    """Skip what fails since an optional module is missing."""
    try:
        yield
    except (ModuleNotFoundError, pytest.Collector.CollectError) as error:
        missing = error.__cause__ if isinstance(error, pytest.Collector.CollectError) else error
        name = getattr(missing, "name", None) or ""
        if isinstance(missing, ModuleNotFoundError) and name.partition(".")[0] in OPTIONAL:
            pytest.skip(str(missing), **options)
        raise


class ModuleOfTests(pytest.Module):
    """A module of tests that may import something optional."""

    def collect(self):
        with skipped_without(allow_module_level=True):
            return super().collect()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup():
    with skipped_without():
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call():
    with skipped_without():
        return (yield)


def pytest_pycollect_makemodule(module_path, parent):
    return ModuleOfTests.from_parent(parent, path=module_path)
