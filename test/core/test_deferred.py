# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Packages that are loaded when something of them is first asked for."""

from __future__ import annotations

import importlib
import subprocess
import sys
import threading
from types import ModuleType

import pytest

from focus_planner.core.deferred import deferred


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return the name of a package with a module, that counts how often it is loaded."""
    name = f"slow_{tmp_path.name}"
    folder = tmp_path / name
    folder.mkdir()
    loaded = "import sys; sys.loaded = getattr(sys, 'loaded', 0) + 1\n"
    slow = "import time; time.sleep(0.05)\n"
    (folder / "__init__.py").write_text(f"{loaded}{slow}value = 7\n", encoding="utf-8")
    (folder / "inner.py").write_text("value = 8\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "loaded", 0, raising=False)
    yield name
    for each in [each for each in sys.modules if each.partition(".")[0] == name]:
        del sys.modules[each]


def times_loaded():
    return sys.loaded


def test_a_module_within_is_imported_without_its_package(package):
    with deferred(package):
        inner = importlib.import_module(f"{package}.inner")
    assert inner.value == 8
    assert times_loaded() == 0


def test_the_package_is_loaded_by_the_first_who_asks_something_of_it(package):
    with deferred(package):
        importlib.import_module(package)
    module = importlib.import_module(package)
    assert times_loaded() == 0
    assert module.value == 7
    assert type(module) is ModuleType
    assert module.value == 7
    assert times_loaded() == 1
    with pytest.raises(AttributeError, match="nothing"):
        _ = module.nothing


def test_of_several_threads_one_loads_it_and_all_find_what_it_has(package):
    with deferred(package):
        module = importlib.import_module(package)
    found = []
    threads = [threading.Thread(target=lambda: found.append(module.value)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [7] * 8
    assert times_loaded() == 1


def test_who_imports_it_afterwards_or_before_notices_nothing(package):
    module = importlib.import_module(package)
    with deferred(package):
        assert importlib.import_module(package) is module
    assert times_loaded() == 1


@pytest.mark.processes
def test_the_linear_algebra_of_numba_and_scipy_is_as_without():
    program = """
import sys
import focus_planner.core.kernels
assert "scipy.linalg._decomp" not in sys.modules
import numba, numpy as np
@numba.njit
def product(a):
    return np.dot(a, a) + np.linalg.inv(a)
assert np.allclose(product(2 * np.eye(3)), 4.5 * np.eye(3))
import scipy.linalg
from scipy.linalg import svd
assert scipy.linalg.svd is svd and svd(np.eye(2))[1].tolist() == [1, 1]
"""
    subprocess.run([sys.executable, "-c", program], check=True)
