"""What is installed beside the package, and whether it fits: launch file, unit, manifest, wheel.

``launch`` is not among the packages that the tests have: the launch file is declarative, and every
name in it is looked up.
"""

from __future__ import annotations

import ast
import configparser
import importlib
import re
import runpy
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from unittest.mock import patch
from xml.etree import ElementTree as ET

import pytest

from focus_planner.parameters.lenses import ADAPTER_DECLARATIONS, SIMULATION_DECLARATIONS
from focus_planner.parameters.planner import DECLARATIONS

REPOSITORY = Path(__file__).parents[1]
LAUNCH = ET.parse(REPOSITORY / "launch" / "focus_planner.launch.xml").getroot()
PARAMETERS = {
    "planner_node": DECLARATIONS,
    "lens_adapter": ADAPTER_DECLARATIONS,
    "simulated_lens": SIMULATION_DECLARATIONS,
}
# What launch_xml and launch_ros read of Jazzy's elements, as far as it is used.
ATTRIBUTES = {
    "launch": set(),
    "arg": {"name", "default", "description"},
    "group": set(),
    "set_env": {"name", "value"},
    "node": {
        *("if", "unless", "pkg", "exec", "name", "namespace", "output"),
        *("respawn", "respawn_delay"),
    },
    "param": {"name", "value", "from"},
}
SUBSTITUTION = re.compile(r"\$\((\S+) ?")


def setup_arguments():
    with patch("setuptools.setup") as setup:
        runpy.run_path(str(REPOSITORY / "setup.py"))
    return setup.call_args.kwargs


@pytest.fixture(scope="module")
def arguments():
    return setup_arguments()


@pytest.fixture(scope="module")
def programs(arguments):
    """Console scripts: the function that each runs, by name."""
    return dict(re.split(r"\s*=\s*", s) for s in arguments["entry_points"]["console_scripts"])


@pytest.fixture(scope="module")
def installed(arguments):
    """Files below share, and where they come from."""
    return {
        f"{folder}/{Path(file).name}".removeprefix("share/"): REPOSITORY / file
        for folder, files in arguments["data_files"]
        for file in files
    }


# --- the launch file -------------------------------------------------------------------------


def texts():
    return [value for element in LAUNCH.iter() for value in element.attrib.values()]


def test_the_launch_file_has_elements_and_attributes_that_launch_knows():
    for element in LAUNCH.iter():
        assert set(element.attrib) <= ATTRIBUTES[element.tag]


def test_every_argument_of_the_launch_file_is_explained_and_used():
    declared = [arg.get("name") for arg in LAUNCH.iter("arg")]
    used = {name for text in texts() for name in re.findall(r"\$\(var (\w+)\)", text)}
    assert len(declared) == len(set(declared))
    assert used == set(declared)
    assert all(len(arg.get("description")) > 20 for arg in LAUNCH.iter("arg"))
    assert all("default" in arg.attrib for arg in LAUNCH.iter("arg"))


def test_every_substitution_of_the_launch_file_is_one_of_launch():
    kinds = {kind for text in texts() for kind in SUBSTITUTION.findall(text)}
    assert kinds == {"var", "env", "find-pkg-share", "equals"}
    assert all(text.count("(") == text.count(")") for text in texts())


def test_every_node_of_the_launch_file_is_there(programs):
    nodes = list(LAUNCH.iter("node"))
    assert {node.get("exec") for node in nodes} == set(PARAMETERS)
    for node in nodes:
        assert node.get("pkg") == "focus_planner"
        module, _, function = programs[node.get("exec")].partition(":")
        assert callable(getattr(importlib.import_module(module), function))
        assert node.get("namespace") == "$(var namespace)"
    named = {node.get("exec"): node.get("name") for node in nodes}
    assert named["planner_node"] == "focus_planner"


def test_every_parameter_of_the_launch_file_is_declared():
    found = []
    for node in LAUNCH.iter("node"):
        declared = {d.name: d.default for d in PARAMETERS[node.get("exec")]}
        for param in node.iter("param"):
            assert ("from" in param.attrib) != ("name" in param.attrib)
            if "name" in param.attrib:
                assert isinstance(declared[param.get("name")], str)
                found.append(param.get("name"))
    assert found == ["record_directory", "planner"]


def test_one_planner_is_launched_whether_it_records_or_not():
    one, other = (node for node in LAUNCH.iter("node") if node.get("exec") == "planner_node")
    (argument,) = (a for a in LAUNCH.iter("arg") if a.get("name") == "record_directory")
    unset = f"$(equals $(var record_directory) {argument.get('default')})"
    assert one.get("if") == other.get("unless") == unset
    same = ("name", "namespace", "output", "respawn", "respawn_delay")
    assert [one.get(name) for name in same] == [other.get(name) for name in same]
    assert [p.attrib for p in one] == [p.attrib for p in other][:1]


def test_a_killed_node_is_started_again_soon():
    for node in LAUNCH.iter("node"):
        assert node.get("respawn") == "$(var respawn)"
        assert 0 < float(node.get("respawn_delay")) <= 1
    (respawn,) = (arg for arg in LAUNCH.iter("arg") if arg.get("name") == "respawn")
    assert respawn.get("default") == "true"


def test_the_file_that_the_launch_file_names_is_installed(installed):
    named = {
        file
        for text in texts()
        for file in re.findall(r"\$\(find-pkg-share focus_planner\)/(\S+)", text)
    }
    assert named == {"config/focus_planner.yaml"}
    assert {f"focus_planner/{file}" for file in named} <= set(installed)


# --- the unit of systemd ---------------------------------------------------------------------


def test_the_unit_runs_the_node_and_restarts_it(programs):
    unit = configparser.ConfigParser(strict=True, interpolation=None)
    unit.optionxform = str
    unit.read(REPOSITORY / "docs" / "focus_planner.service", encoding="utf-8")
    service = unit["Service"]
    program, *rest = service["ExecStart"].split()
    assert Path(program).name in programs
    assert rest[:2] == ["--ros-args", "--params-file"]
    assert service["Restart"] == "always"
    assert float(service["RestartSec"]) <= 1
    assert unit["Unit"]["StartLimitIntervalSec"] == "0"
    assert service["RestartPreventExitStatus"] == "2"


@pytest.mark.processes
@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd here")
def test_systemd_reads_the_unit(tmp_path):
    text = (REPOSITORY / "docs" / "focus_planner.service").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^ExecStart=\S+", f"ExecStart={sys.executable}", text)
    text = re.sub(r"(?m)^User=.*", "User=root", text)
    unit = tmp_path / "focus_planner.service"
    unit.write_text(text, encoding="utf-8")
    command = ["systemd-analyze", "verify", str(unit)]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (found.returncode, found.stderr) == (0, "")


# --- the manifest and the wheel --------------------------------------------------------------


def test_the_manifest_names_every_ros_package_that_is_imported():
    manifest = ET.parse(REPOSITORY / "package.xml").getroot()
    depends = {each.text for each in manifest.iter("exec_depend")}
    ros = re.compile(r"rclpy|\w+_msgs|\w+_interfaces")
    imported = {
        name.partition(".")[0]
        for file in (REPOSITORY / "focus_planner").rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        for name in names_of(node)
    }
    assert {name for name in imported if ros.fullmatch(name)} <= depends
    # ros2 launch, and what reads an XML launch file with nodes.
    assert {"ros2launch", "launch_ros", "launch_xml"} <= depends


def names_of(node):
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module:
        return [node.module]
    return []


def test_every_installed_file_is_there(installed):
    assert all(path.is_file() for path in installed.values())
    for folder in ("config", "launch", "security"):
        prefix = f"focus_planner/{folder}/"
        there = {prefix + path.name for path in (REPOSITORY / folder).iterdir()}
        assert there == {name for name in installed if name.startswith(prefix)}


@pytest.mark.processes
def test_a_wheel_has_what_the_node_needs(tmp_path, installed):
    source = tmp_path / "source"
    skip = shutil.ignore_patterns("__pycache__")
    for name in ("focus_planner", "msg_defs", "config", "launch", "security", "resource"):
        shutil.copytree(REPOSITORY / name, source / name, ignore=skip)
    for name in ("setup.py", "setup.cfg", "pyproject.toml", "package.xml", "README.md", "LICENSE"):
        shutil.copy(REPOSITORY / name, source)
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
    built = subprocess.run(
        [*command, "--no-index", "-w", str(tmp_path), str(source)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    shared = {name.partition(".data/data/share/")[2] for name in names}
    assert set(installed) <= shared
    here = (REPOSITORY / "focus_planner").rglob("*")
    files = {str(f.relative_to(REPOSITORY)) for f in here if f.is_file() and f.suffix != ".pyc"}
    assert {f for f in files if "__pycache__" not in f and not f.endswith("README.md")} <= names
