# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The files that open RViz and Foxglove on a plan, beside what the node publishes."""

from __future__ import annotations

import json
import re
import runpy
from unittest.mock import patch

import numpy as np
import pytest
import yaml
from focus_planner_msgs.srv import PlanFocus
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import MarkerArray

from focus_planner import CameraIntrinsics, PlanRequest, Rig
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.surface.scene import Scene
from focus_planner.messages.typestore import message_of
from focus_planner.palette import BLURRED, SHARP
from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.description import describe_plan
from testing.pages import ROOT
from testing.problems import forward, plane
from testing.visuals import cloud_columns

RVIZ = yaml.safe_load((ROOT / "config/focus_planner.rviz").read_text(encoding="utf-8"))
LAYOUT = json.loads((ROOT / "config/foxglove_layout.json").read_text(encoding="utf-8"))
PLANNER = "/focus_planner"
# Classes of RViz that the file may name, with what they receive: of its plugins_description.xml.
DISPLAYS = {
    "rviz_default_plugins/Grid": None,
    "rviz_default_plugins/MarkerArray": f"{PLANNER}/markers",
    "rviz_default_plugins/PointCloud2": f"{PLANNER}/quality_cloud",
}
PANELS = {"rviz_common/Displays", "rviz_common/Selection", "rviz_common/Views"}
TOOLS = {
    f"rviz_default_plugins/{name}" for name in ("MoveCamera", "Select", "FocusCamera", "Measure")
}


@pytest.fixture(scope="module")
def visuals():
    """Of a plan with everything that there may be to see."""
    square = CameraIntrinsics(100, 100, 100.0, 100.0, 49.5, 49.5)
    cameras = [forward(name, (x, 0.0, 0.0), intrinsics=square) for name, x in [("a", 0), ("b", 9)]]
    rig = Rig(tuple(cameras), "world")
    request = PlanRequest("closest", 200, fresh_samples=200)
    plan = plan_focus(Scene(plane(0.5, 0.5, 1.0)), rig, request)
    return describe_plan(plan, rig, (1, 2)).visuals


@pytest.fixture(scope="module")
def namespaces(visuals):
    return {m.ns for m in deserialize_message(visuals.markers, MarkerArray).markers} - {""}


@pytest.fixture(scope="module")
def columns(visuals):
    from sensor_msgs.msg import PointCloud2  # noqa: PLC0415

    return cloud_columns(deserialize_message(visuals.quality_cloud, PointCloud2))


def test_both_files_are_installed():
    with patch("setuptools.setup") as setup:
        runpy.run_path(str(ROOT / "setup.py"))
    folders = dict(setup.call_args.kwargs["data_files"])
    assert {"config/focus_planner.rviz", "config/foxglove_layout.json"} <= {
        *folders["share/focus_planner/config"]
    }


# --- RViz ----------------------------------------------------------------------------------------


def displays(kind):
    found = [d for d in RVIZ["Visualization Manager"]["Displays"] if d["Class"].endswith(kind)]
    assert found
    return found


def test_rviz_knows_all_that_the_file_names():
    manager = RVIZ["Visualization Manager"]
    assert {panel["Class"] for panel in RVIZ["Panels"]} <= PANELS
    assert {tool["Class"] for tool in manager["Tools"]} <= TOOLS
    assert manager["Views"]["Current"]["Class"] == "rviz_default_plugins/Orbit"
    assert manager["Global Options"]["Fixed Frame"] == "world"
    for display in manager["Displays"]:
        assert display["Class"] in DISPLAYS
        assert display["Enabled"] is display["Value"]
    names = [display["Name"] for display in manager["Displays"]]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("kind", ["/MarkerArray", "/PointCloud2"])
def test_displays_receive_what_was_sent_before_they_were_there(kind):
    for display in displays(kind):
        topic = display["Topic"]
        assert topic["Value"] == DISPLAYS[display["Class"]]
        assert topic["Durability Policy"] == "Transient Local"
        assert (topic["Reliability Policy"], topic["History Policy"]) == ("Reliable", "Keep Last")


def test_every_namespace_is_in_one_display(namespaces):
    shown = [
        name
        for display in displays("/MarkerArray")
        for name, enabled in display["Namespaces"].items()
        if enabled
    ]
    assert sorted(shown) == sorted(namespaces)
    for display in displays("/MarkerArray"):
        assert display["Namespaces"].keys() == namespaces


def test_clouds_are_coloured_by_fields_that_they_have(columns):
    by_cost, by_rgb = displays("/PointCloud2")
    assert by_cost["Color Transformer"] == "Intensity"
    assert by_cost["Channel Name"] in columns
    assert (by_cost["Min Intensity"], by_cost["Max Intensity"]) == (0, 1)
    assert by_rgb["Color Transformer"] == "RGB8"
    assert "rgb" in columns


# --- Foxglove ------------------------------------------------------------------------------------


def leaves(node):
    """Yield the panels of a layout, a tree of rows and columns."""
    if isinstance(node, str):
        yield node
        return
    assert node.keys() == {"direction", "first", "second", "splitPercentage"}
    assert node["direction"] in {"row", "column"}
    assert 0 < node["splitPercentage"] < 100
    yield from leaves(node["first"])
    yield from leaves(node["second"])


def panel(kind):
    (name,) = [name for name in LAYOUT["configById"] if name.startswith(f"{kind}!")]
    return LAYOUT["configById"][name]


def test_every_panel_has_its_place():
    assert LAYOUT.keys() == {
        "configById",
        "globalVariables",
        "userNodes",
        "playbackConfig",
        "layout",
    }
    placed = list(leaves(LAYOUT["layout"]))
    assert sorted(placed) == sorted(LAYOUT["configById"])
    kinds = {name.split("!")[0] for name in placed}
    assert kinds == {"3D", "Plot", "Table", "DiagnosticSummary", "CallService"}


def test_the_scene_shows_the_cloud_by_cost_and_hides_no_namespace_unknowingly(namespaces, columns):
    topics = panel("3D")["topics"]
    assert topics.keys() == {f"{PLANNER}/markers", f"{PLANNER}/quality_cloud"}
    assert topics[f"{PLANNER}/markers"]["namespaces"].keys() == namespaces
    cloud = topics[f"{PLANNER}/quality_cloud"]
    assert (cloud["colorMode"], cloud["minValue"], cloud["maxValue"]) == ("gradient", 0, 1)
    assert cloud["colorField"] in columns


TYPES = {
    f"{PLANNER}/run/progress": "focus_planner_msgs/msg/RunProgress",
    f"{PLANNER}/focus_plan": "focus_planner_msgs/msg/FocusPlan",
}


def value_at(path):
    """Return what a path of Foxglove's leads to, in a message in which nothing is set."""
    topic, _, fields = path.partition(".")
    if topic.endswith("/_action/feedback"):
        from focus_planner_msgs.action import PlanFocus as Action  # noqa: PLC0415

        value = Action.Impl.FeedbackMessage()
    else:
        value = message_of(TYPES[topic], {})
    for name in fields.split("."):
        value = getattr(value, re.sub(r"\[:\]$", "", name))
    return value


def test_what_is_plotted_is_a_number_of_a_message():
    for path in panel("Plot")["paths"]:
        assert isinstance(value_at(path["value"]), float), path["value"]


def test_the_table_is_of_the_plan_s_cameras():
    path = panel("Table")["topicPath"]
    assert path.endswith("[:]")
    assert list(value_at(path)) == []


def test_the_call_is_one_that_the_planner_answers():
    call = panel("CallService")
    assert call["serviceName"] == f"{PLANNER}/plan_focus"
    fields = json.loads(call["requestPayload"])
    request = message_to_ros(PlanFocus.Request, fields)
    assert fields.keys() == PlanFocus.Request.get_fields_and_field_types().keys()
    assert request.method == "k_view"
    assert panel("DiagnosticSummary")["topicToRender"] == "/diagnostics"


def test_colours_are_those_of_the_cloud(columns):
    blue, orange = panel("3D")["topics"][f"{PLANNER}/quality_cloud"]["gradient"]
    by_cost = displays("/PointCloud2")[0]
    for code, in_rviz, colour in (
        (blue, by_cost["Min Color"], SHARP),
        (orange, by_cost["Max Color"], BLURRED),
    ):
        assert tuple(bytes.fromhex(code[1:]))[:3] == colour
        assert tuple(map(int, in_rviz.split("; "))) == colour
    packed = np.unique(columns["rgb"].view(np.uint32))
    assert int.from_bytes(bytes(SHARP), "big") in packed
