from __future__ import annotations

import pytest

from testing.pages import RECIPES, Reader, lay_out, name_of


@pytest.mark.processes
@pytest.mark.parametrize("page", RECIPES, ids=name_of)
def test_all_code_of_a_recipe_runs(page, tmp_path, monkeypatch):
    lay_out(tmp_path)
    monkeypatch.chdir(tmp_path)
    with Reader(page, tmp_path) as reader:
        assert reader.read()
