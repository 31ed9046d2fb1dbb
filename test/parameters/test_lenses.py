from __future__ import annotations

import math

import pytest

from focus_planner.core.validation import InputError
from focus_planner.lenses.driver import PROFILES, DriverProfile
from focus_planner.parameters.lenses import (
    ADAPTER_DECLARATIONS,
    SIMULATION_DECLARATIONS,
    AdapterSettings,
    SimulationSettings,
)

TWO = {"cameras": ["left", "right"]}


def test_what_is_left_out_has_its_default():
    settings = AdapterSettings.from_values(TWO)
    assert settings.planner == "/focus_planner"
    assert settings.nodes == {"left": "/left/camera", "right": "/right/camera"}
    assert settings.profile == PROFILES["camera_ros"]
    assert settings.tables == {}
    simulation = SimulationSettings.from_values(TWO)
    assert simulation.nodes == settings.nodes
    assert (simulation.mechanics.low, simulation.mechanics.high) == (0.0, 10.0)
    assert simulation.mechanics.speed == math.inf
    assert simulation.reports_position
    assert not simulation.clamps


def test_some_driver_nodes_are_called_otherwise():
    values = TWO | {"driver_node": "/rig/{camera}", "driver_nodes": ["right=/other"]}
    nodes = AdapterSettings.from_values(values).nodes
    assert nodes == {"left": "/rig/left", "right": "/other"}


def test_a_driver_of_ones_own():
    values = TWO | {"driver": "custom", "parameter": "ring", "unit": "m", "whole": True}
    assert AdapterSettings.from_values(values).profile == DriverProfile("ring", "m", True)


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
            {"driver_node": "/camera"},
            (
                "driver_node: expected a node of its own for each camera, got '/camera' for several"
                " cameras; write {camera} where the camera's name belongs"
            ),
        ),
        (
            {"driver_node": "{camera}"},
            "driver_node: expected a node's full name, like /left/camera, got 'left'",
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
            {"driver": "usb_cam"},
            "driver: expected one of camera_ros, v4l2_camera, custom, got 'usb_cam'",
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
            {"planner": "focus_planner"},
            "planner: expected a node's full name, like /left/camera, got 'focus_planner'",
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
        ({"reports": "x"}, "reports: expected one of position, command, got 'x'"),
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
