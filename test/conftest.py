# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Settings for all tests."""

import os
import signal
import sys

from testing.domains import claim_domain

# A graph of their own, on this machine only. They have to be set before rclpy is imported.
os.environ["ROS_DOMAIN_ID"] = str(claim_domain())
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
# As our programs do, before Numba is imported: several workers share the cores.
os.environ["NUMBA_THREADING_LAYER_PRIORITY"] = "omp tbb workqueue"
os.environ["GOMP_SPINCOUNT"] = "1000"

import pytest
from hypothesis import settings

from testing import optional_modules
from testing.early_failures import EarlyFailures
from testing.started_processes import StartedProcesses

# The same examples every time, however busy the machine is.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


def pytest_configure(config):
    # A shell without job control starts programs in the background with these ignored. What tests
    # start would inherit that, and not end when it is told to.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGQUIT, signal.SIG_DFL)
    config.pluginmanager.register(EarlyFailures(config))
    config.pluginmanager.register(StartedProcesses())
    config.pluginmanager.register(optional_modules)


def pytest_xdist_auto_num_workers(config):
    """Return one worker per core, and one more for the time in which tests wait for processes."""
    waiting = "not processes" not in config.option.markexpr
    return len(os.sched_getaffinity(0)) + waiting


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Put modules whose tests start processes first, or one worker ends long after the others."""
    slow = {item.path for item in items if item.get_closest_marker("processes")}
    items.sort(key=lambda item: item.path not in slow)


def pytest_collection_finish(session):
    """Compile what tests run before they begin."""
    if session.config.option.collectonly:
        return
    processes = any(item.get_closest_marker("processes") for item in session.items)
    if processes or "focus_planner.core.kernels" in sys.modules:
        from testing.compiled import compile_kernels  # noqa: PLC0415 - it takes a second

        compile_kernels()


@pytest.fixture(autouse=True)
def one_thread():
    """Threads that wait for each other are slow on small problems; who wants more says so."""
    if "numba" not in sys.modules:
        yield
        return
    from numba import get_num_threads, set_num_threads  # noqa: PLC0415 - where it is loaded anyway

    before = get_num_threads()
    set_num_threads(1)
    yield
    set_num_threads(before)
