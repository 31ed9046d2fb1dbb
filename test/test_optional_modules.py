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

import importlib
import sys

import pytest

from testing.optional_modules import OPTIONAL, skipped_without


@pytest.mark.parametrize("module", sorted(OPTIONAL))
def test_what_imports_an_optional_module_is_skipped_where_it_is_missing(module, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(pytest.skip.Exception, match=module), skipped_without():
        importlib.import_module(module)


def test_what_tests_cannot_do_without_is_no_reason_to_skip_them(monkeypatch):
    monkeypatch.setitem(sys.modules, "numpy", None)
    with pytest.raises(ModuleNotFoundError), skipped_without():
        importlib.import_module("numpy")
    with pytest.raises(ImportError), skipped_without():
        raise ImportError("libGL.so.1: cannot open shared object file", name="laspy")


def test_a_module_of_tests_is_skipped_as_a_whole(monkeypatch):
    missing = ModuleNotFoundError("No module named 'laspy'", name="laspy")
    with pytest.raises(pytest.skip.Exception) as caught, skipped_without(allow_module_level=True):
        raise pytest.Collector.CollectError("of test_looks.py") from missing
    assert caught.value.allow_module_level
    with pytest.raises(pytest.Collector.CollectError), skipped_without():
        raise pytest.Collector.CollectError("a syntax error")
