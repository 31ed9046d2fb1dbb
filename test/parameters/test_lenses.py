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

import pytest

from focus_planner.core.validation import InputError
from focus_planner.lenses.profiles import PROFILES, DriverProfile
from focus_planner.parameters.lenses import (
    ADAPTER_DECLARATIONS,
    SIMULATION_DECLARATIONS,
    AdapterSettings,
    SimulationSettings,
)

TWO = {"cameras": ["left", "right"]}


def nodes_of(settings):
    return {camera: lens.node for camera, lens in settings.lenses.items()}


def test_what_is_left_out_has_its_default():
    settings = AdapterSettings.from_values(TWO)
    assert settings.planner == "/focus_planner"
    assert nodes_of(settings) == {"left": "/left/camera", "right": "/right/camera"}
    assert settings.lenses["left"].profile == PROFILES["camera_ros"]
    assert settings.tables == {}
    simulation = SimulationSettings.from_values(TWO)
    assert simulation.lenses == settings.lenses
    assert (simulation.mechanics.low, simulation.mechanics.high) == (0.0, 10.0)
    assert simulation.mechanics.speed == math.inf
    assert not simulation.reports_position
    assert not simulation.clamps


def test_some_driver_nodes_are_called_otherwise():
    values = TWO | {"driver_node": "/rig/{camera}", "driver_nodes": ["right=/other"]}
    nodes = nodes_of(AdapterSettings.from_values(values))
    assert nodes == {"left": "/rig/left", "right": "/other"}


@pytest.mark.parametrize("settings", [AdapterSettings, SimulationSettings])
@pytest.mark.parametrize(
    ("namespace", "name", "node"),
    [
        ("/", "{camera}/camera", "/left/camera"),
        ("/rig_1", "{camera}/camera", "/rig_1/left/camera"),
        ("/rig_1", "", "/rig_1/left/camera"),
        ("/rig_1", "/{camera}/camera", "/left/camera"),
        ("/a/b", "{camera}", "/a/b/left"),
    ],
)
def test_relative_names_are_in_the_nodes_own_namespace(settings, namespace, name, node):
    made = settings.from_values({"cameras": ["left"], "driver_node": name}, namespace)
    assert nodes_of(made) == {"left": node}


@pytest.mark.parametrize(
    ("namespace", "planner"), [("/", "/focus_planner"), ("/rig_1", "/rig_1/focus_planner")]
)
def test_the_planner_is_in_the_adapters_own_namespace(namespace, planner):
    assert AdapterSettings.from_values(TWO, namespace).planner == planner
    elsewhere = AdapterSettings.from_values(TWO | {"planner": "/other"}, namespace)
    assert elsewhere.planner == "/other"


@pytest.mark.parametrize(
    ("driver", "node", "parameter", "first"),
    [
        ("camera_ros", "/left/camera", "LensPosition", {"AfMode": 0}),
        (
            "v4l2_camera",
            "/left/v4l2_camera",
            "focus_absolute",
            {"focus_automatic_continuous": False, "focus_auto": False},
        ),
        ("usb_cam", "/left/usb_cam", "focus", {"autofocus": False}),
        ("depthai", "/left/oak", "rgb.r_focus", {"rgb.r_set_man_focus": True}),
    ],
)
def test_drivers_have_nodes_and_parameters_of_their_own(driver, node, parameter, first):
    lens = AdapterSettings.from_values({"cameras": ["left"], "driver": driver}).lenses["left"]
    assert (lens.node, lens.profile.parameter) == (node, parameter)
    assert dict(lens.profile.first) == first
    # Only of camera_ros is it known that it tells of the lens; of none that it measures.
    assert lens.profile.frames == (driver == "camera_ros")
    assert not lens.profile.measures


def test_several_lenses_of_one_node():
    values = {"driver": "depthai", "driver_node": "/oak", "lens": "{camera}"}
    lenses = AdapterSettings.from_values(
        {"cameras": ["left", "right", "middle"], "lenses": ["middle=rgb"]} | values
    ).lenses
    assert {lens.node for lens in lenses.values()} == {"/oak"}
    assert [lens.profile.parameter for lens in lenses.values()] == [
        "left.r_focus",
        "right.r_focus",
        "rgb.r_focus",
    ]
    assert dict(lenses["middle"].profile.first) == {"rgb.r_set_man_focus": True}


def test_a_driver_of_ones_own():
    values = {
        "driver": "custom",
        "driver_node": "/box",
        "parameter": "{lens}/ring",
        "unit": "m",
        "whole": True,
        "first": ["af_{lens}=false", "mode=3", "speed=0.5", "who=me"],
        "one_by_one": True,
        "measures": True,
        "lenses": ["right=b"],
    }
    lenses = AdapterSettings.from_values(TWO | values).lenses
    first = (("af_left", False), ("mode", 3), ("speed", 0.5), ("who", "me"))
    assert lenses["left"].profile == DriverProfile("left/ring", "m", True, first, False, True)
    assert lenses["right"].profile.parameter == "b/ring"
    assert lenses["right"].profile.first[0] == ("af_b", False)


def test_tables_of_a_file(tmp_path):
    path = tmp_path / "lenses.yaml"
    path.write_text("cameras:\n  left: {unit: dioptres}\n  other: {unit: m}\n")
    settings = AdapterSettings.from_values(TWO | {"lens_tables": str(path)})
    assert {camera: table.unit for camera, table in settings.tables.items()} == {"left": "dioptres"}


def test_simulated_travel_depends_on_the_driver():
    values = TWO | {"driver": "v4l2_camera", "stuck": ["left"], "beyond_limits": "clamp"}
    settings = SimulationSettings.from_values(values)
    assert settings.mechanics.high == 250.0
    assert settings.stuck == {"left"}
    assert settings.clamps


@pytest.mark.parametrize("settings", [AdapterSettings, SimulationSettings])
@pytest.mark.parametrize(
    ("values", "error"),
    [
        (
            {"cameras": [""]},
            (
                "cameras: expected the names of cameras, got none; name them, as in"
                " cameras:=[cam_0, cam_1]"
            ),
        ),
        ({"cameras": ["a", "a"]}, "cameras: expected each name once, got 'a' twice"),
        (
            {"cameras": ["a", "Kamera (1)"]},
            (
                "camera name: expected letters, digits and underscores, starting with a letter (it"
                " names a topic), got 'Kamera (1)'; name it Kamera_1"
            ),
        ),
        (
            {"driver_node": "/camera"},
            (
                "driver_node: expected a node of its own for each camera, or a parameter, got"
                " LensPosition of '/camera' for several cameras; write {camera} where the camera's"
                " name belongs, or tell their lenses"
            ),
        ),
        (
            {"driver_node": "{camera}/"},
            "driver_node: expected a node's name, like left/camera or /left/camera, got 'left/'",
        ),
        (
            {"driver_node": "~/{camera}"},
            "driver_node: expected a node's name, like left/camera or /left/camera, got '~/left'",
        ),
        ({"lenses": ["left"]}, "lenses: expected entries like cam_0=left, got 'left'"),
        ({"lenses": ["middle=a"]}, "lenses: expected names listed in cameras, got 'middle'"),
        (
            {"lens": "rgb"},
            (
                "lens: expected nothing with driver camera_ros, whose parameters do not name"
                " lenses, got 'rgb'"
            ),
        ),
        (
            {"first": ["a=1"]},
            (
                "first: expected nothing with driver camera_ros, which has its own, got ('a=1',);"
                " give driver:=custom, or leave it out"
            ),
        ),
        *(
            (
                {"driver": "custom", "parameter": "a", "unit": "m", "first": [entry]},
                f"first: expected entries like autofocus=false or AfMode=0, got {entry!r}",
            )
            for entry in ("autofocus", "=1", "a=", "a=[1]", "a={")
        ),
        (
            {"driver": "depthai", "driver_node": "/oak"},
            (
                "driver_node: expected a node of its own for each camera, or a parameter, got"
                " rgb.r_focus of '/oak' for several cameras; write {camera} where the camera's name"
                " belongs, or tell their lenses"
            ),
        ),
        (
            {"driver_nodes": ["left"]},
            "driver_nodes: expected entries like cam_0=/left/camera, got 'left'",
        ),
        (
            {"driver_nodes": ["middle=/m"]},
            "driver_nodes: expected names listed in cameras, got 'middle'",
        ),
        (
            {"driver": "realsense"},
            (
                "driver: expected one of camera_ros, v4l2_camera, usb_cam, depthai, custom, got"
                " 'realsense'"
            ),
        ),
        (
            {"parameter": "ring"},
            (
                "parameter: expected nothing with driver camera_ros, which has its own, got 'ring';"
                " give driver:=custom, or leave it out"
            ),
        ),
        (
            {"driver": "custom", "unit": "m"},
            "parameter: expected the name of the driver's parameter, got ''",
        ),
    ],
)
def test_values_that_contradict_each_other(settings, values, error):
    with pytest.raises(InputError) as raised:
        settings.from_values(TWO | values)
    assert str(raised.value) == error


@pytest.mark.parametrize(
    ("values", "error"),
    [
        (
            {"planner": "//focus_planner"},
            (
                "planner: expected a node's name, like left/camera or /left/camera, got"
                " '//focus_planner'"
            ),
        ),
        (
            {"measures": True},
            (
                "measures: expected nothing with driver camera_ros, which has its own, got True;"
                " give driver:=custom, or leave it out"
            ),
        ),
        (
            {"driver": "custom", "parameter": "ring"},
            "unit: expected one of m, dioptres, device, got ''",
        ),
        ({"lens_tables": "/no/such"}, "/no/such: expected lens tables (YAML), got no such file"),
    ],
)
def test_what_the_adapter_cannot_take(values, error):
    with pytest.raises(InputError) as raised:
        AdapterSettings.from_values(TWO | values)
    assert str(raised.value) == error


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"min_value": 10.0}, "max_value: expected more than min_value, 10, got 10"),
        ({"stuck": ["middle"]}, "stuck: expected names listed in cameras, got 'middle'"),
        ({"reports": "x"}, "reports: expected one of command, position, got 'x'"),
        (
            {"reports": "position"},
            (
                "reports: expected nothing with driver camera_ros, which has its own, got"
                " 'position'; give driver:=custom, or leave it out"
            ),
        ),
        ({"beyond_limits": "x"}, "beyond_limits: expected one of refuse, clamp, got 'x'"),
        ({"step": 11.0}, "step: expected less than the lens's travel, got 11"),
    ],
)
def test_what_no_lens_is_like(values, error):
    with pytest.raises(InputError) as raised:
        SimulationSettings.from_values(TWO | values)
    assert str(raised.value) == error


@pytest.mark.parametrize("declarations", [ADAPTER_DECLARATIONS, SIMULATION_DECLARATIONS])
def test_defaults_are_within_their_ranges(declarations):
    for declaration in declarations:
        assert declaration.description.endswith(".")
        if isinstance(declaration.default, (int, float)):
            assert declaration.low <= declaration.default <= declaration.high
