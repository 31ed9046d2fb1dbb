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

import math
import os
import re
import threading
from pathlib import Path

import pytest
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.parameter import Parameter

from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.planner_settings import (
    Recording,
    Replan,
    Serving,
    Settings,
    lens_tables_of,
)
from focus_planner.ros import node_parameters
from focus_planner.ros.node_parameters import Parameters
from testing.damaged_files import PRIVATE_KEY, SECRET, aliases

HERE = Path(__file__).parent


def started_with(make_node, **values):
    return make_node(parameter_overrides=[Parameter(n, value=v) for n, v in values.items()])


def change(node, **values):
    return node.set_parameters_atomically(
        [Parameter(name.replace("__", "."), value=value) for name, value in values.items()]
    )


def test_the_defaults_are_the_cores(make_node):
    settings = Parameters(make_node()).current
    assert settings == Settings.from_values({})
    expected = ("world", "importance", PlanRequest(), 1, False, 0.0, Optics(), CostModel())
    assert tuple(vars(settings).values())[:8] == expected
    assert settings.recording == Recording()
    assert settings.serving == Serving()
    assert settings.replan == Replan()
    assert dict(settings.values) == {d.name: d.default for d in DECLARATIONS}


def test_every_parameter_is_described(make_node):
    node = make_node()
    Parameters(node)
    for declaration in DECLARATIONS:
        descriptor = node.describe_parameter(declaration.name)
        assert len(descriptor.description) > 20
        ranges = len(descriptor.integer_range) + len(descriptor.floating_point_range)
        assert ranges == (not isinstance(declaration.default, (str, tuple, bool)))


def test_values_given_at_the_start_are_used(make_node):
    node = started_with(make_node, method="em", time_budget=2.0, frame_id="rig")
    settings = Parameters(node).current
    assert settings.request == PlanRequest(method="em", time_budget=2.0)
    assert settings.frame_id == "rig"


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ({"k": 4}, InvalidParameterValueException, "Max: 3, value: 4"),
        ({"k": "two"}, InvalidParameterTypeException, "expecting type"),
        ({"method": "guess"}, InputError, "method: expected one of"),
        ({"frame_id": ""}, InputError, "frame_id: expected the name of a frame"),
        ({"lens.min_focus": 2.0, "lens.max_focus": 1.0}, InputError, "lens.min_focus"),
        ({"lens_tables": "none.yaml"}, InputError, r"none\.yaml: expected lens tables"),
    ],
)
def test_bad_values_at_the_start_are_an_error(make_node, values, error, text):
    with pytest.raises(error, match=text):
        Parameters(started_with(make_node, **values))


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"method": "guess"}, "method: expected one of closest.*'guess'"),
        ({"scope": "some"}, "scope: expected one of"),
        ({"k": 1}, "Min: 2, Max: 3, value: 1"),
        ({"samples": -1}, "out of range"),
        ({"time_budget": -1.0}, "out of range"),
        ({"time_budget": math.nan}, "out of range"),
        ({"samples": 1.5}, "Wrong parameter type"),
        ({"fresh_samples": 1}, "out of range"),
        ({"standard_error": 0.0}, "standard_error: expected a number above 0"),
        ({"frame_id": "base"}, "read-only"),
        ({"lens__focal_length": 0.0}, r"lens\.focal_length: expected a number above 0"),
        ({"lens__hyperfocal_distance": 0.0}, r"lens\.f_number: expected a number above 0"),
        ({"image__fx": 0.0}, r"image\.fx: expected a number above 0"),
        ({"cost__focus_weight": 0.5}, "cost weights: expected a sum of at most 1"),
        ({"lens__focus_steps": 9}, r"lens\.min_focus: expected a number above focal_length"),
        ({"lens__focus_distances": [1.0, 0.0]}, r"lens\.focus_distances\[1\]: .* got 0"),
        ({"lens__focus_distances": 1.0}, "Wrong parameter type"),
        ({"shots": 0}, "Min: 1, Max: 16, value: 0"),
        ({"depth_tolerance": -0.1}, "out of range"),
        ({"bound": "some"}, "bound: expected one of none, quick, tight, got 'some'"),
        ({"bound": 1}, "Wrong parameter type"),
        ({"gap": -1e-9}, "out of range"),
        ({"gap": 1.5}, "Max: 1.0, value: 1.5"),
        ({"gap": 1}, "Wrong parameter type"),
        ({"warm_start": 1}, "Wrong parameter type"),
        ({"warm_start": "yes"}, "Wrong parameter type"),
        ({"lens__min_focus": 2.0, "lens__max_focus": 1.0}, r"lens\.min_focus: expected at most"),
        ({"lens_tables": f"{HERE}/none.yaml"}, r"none\.yaml: expected lens tables .*, got no such"),
        ({"lens_tables": __file__}, r"test_node_parameters\.py: expected YAML, got line"),
        ({"lens_tables": "~nobody9/x"}, "lens_tables: expected a path, got '~nobody9/x', which le"),
        ({"lens_tables": "a\0b"}, "lens_tables: expected a path, got 'a.x00b', which leads now"),
        ({"lens_tables": 1}, "Wrong parameter type"),
    ],
)
def test_a_bad_change_is_refused_with_the_reason(make_node, values, reason):
    node = started_with(make_node, data_directories=str(HERE))
    parameters = Parameters(node)
    before = parameters.current
    result = change(node, **values)
    assert not result.successful
    assert re.search(reason, result.reason)
    assert parameters.current is before


def test_a_good_change_is_applied(make_node):
    node = make_node()
    parameters = Parameters(node)
    wanted = {"seed": 5, "samples": 0, "fresh_samples": 99, "standard_error": 0.5}
    assert change(node, lens__max_focus=3.0, **wanted).successful
    assert parameters.current.optics.lens == Lens(max_focus=3.0)
    assert parameters.current.request == PlanRequest(**wanted)


def test_a_lens_by_f_number(make_node):
    node = make_node()
    parameters = Parameters(node)
    assert change(node, lens__f_number=8.0, lens__circle_of_confusion=3.125e-5).successful
    assert parameters.current.optics.lens.hyperfocal_distance == 10.0
    assert change(node, lens__f_number=16.0, lens__hyperfocal_distance=0.0).successful
    assert parameters.current.optics.lens.hyperfocal_distance == pytest.approx(5.0)


def test_a_lens_of_certain_distances(make_node):
    node = started_with(make_node, **{"lens.focus_distances": [2.0, 0.5]})
    parameters = Parameters(node)
    assert parameters.current.optics.lens == Lens(focus_distances=(0.5, 2.0))
    assert change(node, lens__focus_distances=[3.0]).successful
    assert parameters.current.optics.lens == Lens(focus_distances=(3.0,))
    result = change(node, lens__focus_steps=9, lens__min_focus=0.4)
    assert "either focus_distances or focus_steps, got both" in result.reason
    assert change(
        node, lens__focus_distances=[0.0], lens__focus_steps=9, lens__min_focus=0.4
    ).successful
    assert parameters.current.optics.lens == Lens(min_focus=0.4, focus_steps=9)
    assert change(node, lens__focus_steps=0, lens__min_focus=0.0).successful
    assert parameters.current.optics.lens == Lens()


def test_lens_tables_are_read_when_their_file_is_named(make_node, tmp_path):
    file = tmp_path / "lenses.yaml"
    file.write_text("default: {unit: dioptres}")
    folder = str(tmp_path)
    node = started_with(make_node, lens_tables=str(file), data_directories=folder)
    parameters = Parameters(node)
    assert parameters.current.lens_tables.default == LensTable("dioptres")
    assert parameters.current.optics.tables is parameters.current.lens_tables
    file.unlink()
    # Not when anything else changes.
    assert change(node, seed=3).successful
    assert parameters.current.lens_tables_text == "default: {unit: dioptres}"
    result = change(node, lens_tables=str(file))
    assert not result.successful
    assert re.search(
        r"lenses\.yaml: expected lens tables \(YAML\), got no such file", result.reason
    )
    file.write_text("default: {unit: m}")
    assert change(node, lens_tables=str(file)).successful
    assert parameters.current.lens_tables.default == LensTable("m")
    assert change(node, lens_tables="").successful
    assert parameters.current == Settings.from_values({"seed": 3, "data_directories": folder})


def test_shots_and_depth_tolerance(make_node):
    node = started_with(make_node, shots=3, depth_tolerance=0.01)
    assert Parameters(node).current.request == PlanRequest(shots=3, depth_tolerance=0.01)


def test_bounds_and_warm_starts(make_node):
    node = started_with(make_node, bound="tight", gap=0.01, warm_start=True)
    parameters = Parameters(node)
    assert parameters.current.request == PlanRequest(bound="tight", gap=0.01)
    assert parameters.current.warm_start is True
    assert change(node, bound="none", gap=0.0, warm_start=False).successful
    assert parameters.current.request == PlanRequest(bound="none", gap=0.0)
    assert parameters.current.warm_start is False


def test_parameters_of_others_are_let_through(make_node):
    node = make_node()
    Parameters(node)
    node.declare_parameter("another", 1)
    assert change(node, another=2).successful


# --- paths that anyone on the network may set ----------------------------------------------------


def test_paths_stay_in_the_folders_that_were_named(make_node, tmp_path):
    named, other = tmp_path / "named", tmp_path / "other"
    for folder in (named, other):
        folder.mkdir()
        (folder / "lenses.yaml").write_text("default: {unit: dioptres}")
    (named / "x").mkdir()
    (named / "link").symlink_to(other)
    at_start = str(other / "lenses.yaml")
    folders = os.pathsep.join(map(str, (tmp_path / "none", named)))
    node = started_with(make_node, data_directories=folders, lens_tables=at_start)
    parameters = Parameters(node)
    for allowed in ("", str(named / "lenses.yaml"), at_start, f"{named}/x/../lenses.yaml"):
        assert change(node, lens_tables=allowed).successful, allowed
    for allowed in ("", str(named), str(named / "a" / "b")):
        assert change(node, record_directory=allowed).successful, allowed
    before = parameters.current
    outside = (other, named / ".." / "other", named / "link", "relative", "/etc", f"{named}x")
    for path in outside:
        for name in ("lens_tables", "record_directory"):
            assert not change(node, **{name: f"{path}/other.yaml"}).successful
    assert parameters.current.recording == before.recording
    result = change(node, record_directory="/etc")
    assert result.reason == (
        "record_directory: expected a path in one of the data_directories that the node was"
        f" started with, got '/etc', with {folders}; start the node with this record_directory, or"
        " with its folder in data_directories"
    )
    assert "read-only" in change(node, data_directories="/").reason


def test_where_no_folder_was_named_nothing_is_looked_at(make_node, tmp_path):
    node = started_with(make_node, record_directory=str(tmp_path))
    Parameters(node)
    for path in ("/", str(tmp_path / "below"), "/none"):
        assert "which the node" not in (reason := change(node, record_directory=path).reason)
        assert f"got {path!r}, with none; start the node with this record_directory" in reason
    for path in ("", str(tmp_path), ""):
        assert change(node, record_directory=path).successful


@pytest.mark.parametrize(
    ("make", "telling"),
    [
        (os.mkfifo, "got a pipe"),
        (Path.mkdir, "got a folder"),
        (lambda path: path.symlink_to(path), "got 'PATH', which leads nowhere|symbolic links"),
        (lambda path: path.write_text("[" * 100_000), "more than 50 lists within one another"),
        (lambda path: path.write_bytes(aliases()), "more than 400,000 keys and values"),
        (lambda path: path.write_text(PRIVATE_KEY), "got text$"),
        (lambda path: path.write_text(f"default: {PRIVATE_KEY}"), "expected YAML, got line|text$"),
        (lambda path: path.write_text(f"{SECRET}: 1"), r"\(a key that is no name\)"),
        (
            lambda path: path.write_text("root:$6$salt$x:1:0:9:7:::\nbin:*:1::::::\n"),
            "that is no name",
        ),
    ],
)
def test_whatever_a_path_leads_to_there_is_an_answer(make_node, tmp_path, make, telling):
    path = tmp_path / "lenses.yaml"
    make(path)
    node = started_with(make_node, data_directories=str(tmp_path))
    before = Parameters(node).current
    result = change(node, lens_tables=str(path))
    assert not result.successful
    assert re.search(telling, result.reason.replace(str(path), "PATH"))
    assert SECRET[:10] not in result.reason
    assert "salt" not in result.reason
    assert Settings.from_values({"data_directories": str(tmp_path)}) == before


def test_a_device_is_no_file(make_node):
    node = started_with(make_node, data_directories="/dev")
    Parameters(node)
    for name in ("zero", "null", "random", "tty"):
        assert re.search(
            "got a device|no such file", change(node, lens_tables=f"/dev/{name}").reason
        )


def test_a_disk_that_does_not_answer_costs_nothing_but_this_change(
    make_node, tmp_path, monkeypatch
):
    answers, began = threading.Event(), threading.Event()
    reader = []

    def read(name):
        reader.append(threading.current_thread().name)
        began.set()
        answers.wait()
        return lens_tables_of(name)

    monkeypatch.setattr(node_parameters, "lens_tables_of", read)
    monkeypatch.setattr(node_parameters, "_SECONDS_TO_READ", 0.01)
    file = tmp_path / "lenses.yaml"
    file.write_text("default: {unit: dioptres}")
    parameters = Parameters(node := started_with(make_node, data_directories=str(tmp_path)))
    refused = change(node, lens_tables=str(file))
    assert refused.reason == (
        "lens_tables: expected a file that can be read within 0.01 s, got no answer of its disk"
        " yet; set it again, in case it has answered by then"
    )
    other = change(node, lens_tables=str(tmp_path / "other.yaml"))
    assert "got one that still reads what was named before; try again later" in other.reason
    assert change(node, seed=4).successful
    assert parameters.current.lens_tables is None
    answers.set()
    while not change(node, lens_tables=str(file)).successful:
        pass  # the thread has not come to it yet
    assert parameters.current.lens_tables.default == LensTable("dioptres")
    assert parameters.current.request.seed == 4
    assert set(reader) == {"reading"}
