# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is installed, and whether it fits: launch file, unit, manifest, metadata, wheel, types.

``launch`` is not among the packages that the tests have: the launch file is declarative, and every
name in it is looked up.
"""

from __future__ import annotations

import ast
import importlib
import itertools
import os
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
from packaging.requirements import Requirement
from packaging.version import Version

from focus_planner.core.validation import InputError
from focus_planner.parameters.lenses import (
    ADAPTER_DECLARATIONS,
    SIMULATION_DECLARATIONS,
    AdapterSettings,
)
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
    "choice": {"value"},
    "group": {"if", "scoped"},
    "let": {"name", "value"},
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
    # Without a default only where it is needed, in a group with a condition.
    assert [arg.get("name") for arg in LAUNCH.iter("arg") if "default" not in arg.attrib] == [
        arg.get("name")
        for group in LAUNCH.iter("group")
        if group.get("if")
        for arg in group
        if arg.tag == "arg"
    ]


def test_every_substitution_of_the_launch_file_is_one_of_launch():
    kinds = {kind for text in texts() for kind in SUBSTITUTION.findall(text)}
    assert kinds == {"var", "env", "find-pkg-share", "equals", "or", "file-content"}
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
    assert found == ["record_directory"]


@pytest.mark.parametrize("namespace", ["", "/", "rig_1", "/rig_1"])
def test_lens_nodes_find_the_planner_and_drivers_in_any_namespace_that_launch_takes(namespace):
    # What launch_ros passes on: a name with a slash in front, and nothing for none.
    own = f"/{namespace.strip('/')}" if namespace else "/"
    settings = AdapterSettings.from_values({"cameras": ["a"]}, own)
    prefix = own.rstrip("/")
    assert settings.planner == f"{prefix}/focus_planner"
    assert settings.lenses["a"].node == f"{prefix}/a/camera"
    for node in LAUNCH.iter("node"):
        assert "planner" not in [param.get("name") for param in node.iter("param")]


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


INNERMOST = re.compile(r"\$\(([^\s$()]+) ?([^$()]*)\)")


class LaunchEnded(Exception):  # noqa: N818 - named for what happened
    """What ends a launch; its text is what launch logs, as far as it is known from its source."""


class Launch:
    """Does with the launch file what Jazzy's launch and launch_xml do, by their sources.

    Those are ``launch/actions/{declare_launch_argument,set_launch_configuration}.py``, the files of
    ``launch/substitutions`` and, for the conditions of groups, ``launch/action.py``: an exception
    of any of them ends the launch with status 1 (``LaunchService.run_async``).
    """

    def __init__(self, **arguments):
        self.values, self.nodes = dict(arguments), []

    def run(self, element=LAUNCH):
        for each in element:
            if self._applies(each):
                getattr(self, f"_{each.tag}")(each)
        return [node.get("exec") for node in self.nodes]

    _group = run

    def _applies(self, element):
        wanted, unwanted = (self._text(element.get(name)) for name in ("if", "unless"))
        return (wanted or "true").lower() == "true" and (unwanted or "false").lower() == "false"

    def _text(self, text):
        while text and (found := INNERMOST.search(text)):
            value = self._substituted(found[1], found[2].split(" "))
            text = text[: found.start()] + value + text[found.end() :]
        return text

    def _substituted(self, kind, words):
        if kind == "var":
            return self.values[words[0]]
        if kind == "env":
            return os.environ.get(words[0], words[1])
        if kind == "find-pkg-share":
            return str(REPOSITORY)
        if kind == "equals":
            return str(words[0] == words[1]).lower()
        if kind == "or":
            return str(any(word.lower() == "true" for word in words)).lower()
        try:
            return Path(words[0]).read_text(encoding="utf-8").translate({36: None, 40: None})
        except FileNotFoundError:
            raise LaunchEnded(f"File not found: {words[0]}") from None

    def _arg(self, arg):
        name = arg.get("name")
        if name not in self.values:
            if "default" not in arg.attrib:
                raise LaunchEnded(f'Required launch argument "{name}" was not provided.')
            self.values[name] = self._text(arg.get("default"))
        choices = [choice.get("value") for choice in arg]
        if choices and self.values[name] not in choices:
            raise LaunchEnded(f'Argument "{name}" provided value "{self.values[name]}"')

    def _let(self, let):
        self.values[let.get("name")] = self._text(let.get("value"))

    def _set_env(self, element):
        self._text(element.get("value"))

    def _node(self, node):
        self.nodes.append(node)
        for param in node:
            self._text(param.get("from") or param.get("value"))


LENSES = {"lens_params_file": str(REPOSITORY / "config" / "lens_adapter.yaml")}


@pytest.mark.parametrize(
    ("arguments", "nodes"),
    [
        ({}, ["planner_node"]),
        ({"record_directory": "runs"}, ["planner_node"]),
        ({"lens_params_file": "none.yaml"}, ["planner_node"]),
        ({"lens_adapter": "true", **LENSES}, ["planner_node", "lens_adapter"]),
        ({"simulated_lenses": "True", **LENSES}, ["planner_node", "simulated_lens"]),
    ],
)
def test_what_is_launched(arguments, nodes):
    assert Launch(**arguments).run() == nodes


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"params_file": "mine.yml"}, "File not found: mine.yml"),
        ({"lens_adapter": "true"}, 'Required launch argument "lens_params_file"'),
        ({"simulated_lenses": "true"}, 'Required launch argument "lens_params_file"'),
        ({"lens_adapter": "true", "lens_params_file": "x.yml"}, "File not found: x.yml"),
        ({"lens_adapter": "ture"}, 'Argument "lens_adapter" provided value "ture"'),
        ({"simulated_lenses": "1"}, 'Argument "simulated_lenses" provided value "1"'),
        ({"respawn": "no"}, 'Argument "respawn" provided value "no"'),
        ({"discovery_range": "LOCAL"}, 'Argument "discovery_range" provided value "LOCAL"'),
    ],
)
def test_a_mistake_ends_the_launch_before_any_node_is_started(arguments, why):
    launch = Launch(**arguments)
    with pytest.raises(LaunchEnded, match=re.escape(why)):
        launch.run()
    assert launch.nodes == []


def test_the_file_that_the_launch_file_names_is_installed(installed):
    named = {
        file
        for text in texts()
        for file in re.findall(r"\$\(find-pkg-share focus_planner\)/(\S+)", text)
    }
    assert named == {"config/focus_planner.yaml"}
    assert {f"focus_planner/{file}" for file in named} <= set(installed)


# --- the unit of systemd ---------------------------------------------------------------------


def unit_settings():
    """Return the settings of the unit; some are there several times."""
    text = (REPOSITORY / "docs" / "focus_planner.service").read_text(encoding="utf-8")
    settings: dict[str, list[str]] = {}
    for name, value in re.findall(r"(?m)^(\w+)=(.*)$", text):
        settings.setdefault(name, []).append(value)
    return settings


def test_the_unit_runs_the_node_and_restarts_it(programs):
    settings = unit_settings()
    ((program, *rest),) = (line.split() for line in settings["ExecStart"])
    assert Path(program).name in programs
    assert rest[:2] == ["--ros-args", "--params-file"]
    assert settings["Restart"] == ["always"]
    assert float(settings["RestartSec"][0]) <= 1
    assert settings["StartLimitIntervalSec"] == ["0"]
    assert settings["RestartPreventExitStatus"] == ["2"]


@pytest.mark.processes
@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd here")
def test_systemd_reads_the_unit(tmp_path):
    text = (REPOSITORY / "docs" / "focus_planner.service").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^ExecStart=\S+", f"ExecStart={sys.executable}", text)
    text = re.sub(r"(?m)^(User|Group)=.*", r"\1=root", text)
    unit = tmp_path / "focus_planner.service"
    unit.write_text(text, encoding="utf-8")
    command = ["systemd-analyze", "verify", str(unit)]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (found.returncode, found.stderr) == (0, "")


def test_systemd_restarts_a_node_that_hangs():
    settings = unit_settings()
    assert settings["Type"] == ["notify"]
    assert settings["NotifyAccess"] == ["main"]
    assert int(settings["WatchdogSec"][0]) >= 30  # a busy machine may be slow


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("UMask", "0077"),
        ("LimitCORE", "0"),
        ("StateDirectoryMode", "0700"),
        ("CacheDirectoryMode", "0700"),
        ("LogsDirectoryMode", "0700"),
        ("ProtectSystem", "strict"),
        ("ProtectHome", "yes"),
        ("PrivateTmp", "yes"),
        ("PrivateDevices", "yes"),
        ("NoNewPrivileges", "yes"),
        ("CapabilityBoundingSet", ""),
        ("LockPersonality", "yes"),
        ("RestrictNamespaces", "yes"),
        ("RestrictAddressFamilies", "AF_UNIX AF_INET AF_INET6 AF_NETLINK"),
        ("SystemCallArchitectures", "native"),
        ("IPAddressDeny", "any"),
    ],
)
def test_the_unit_keeps_the_node_to_itself(name, value):
    assert unit_settings()[name] == [value]


def test_the_unit_limits_memory_and_calls():
    settings = unit_settings()
    assert settings["MemoryMax"]
    assert settings["SystemCallFilter"] == ["@system-service", "~@privileged @keyring"]
    # Numba compiles into memory, which must be writable and executable.
    assert "MemoryDenyWriteExecute" not in settings


def test_whatever_the_unit_has_written_is_in_folders_of_its_own():
    settings = unit_settings()
    assert settings["User"] != ["root"]
    own = [
        f"/var/{below}/{settings[kind][0]}"
        for kind, below in (
            ("StateDirectory", "lib"),
            ("CacheDirectory", "cache"),
            ("LogsDirectory", "log"),
        )
    ]
    given = dict(each.split("=", 1) for line in settings["Environment"] for each in line.split())
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "ROS_HOME", "ROS_LOG_DIR"):
        assert any(Path(given[name]).is_relative_to(folder) for folder in own), name
    profile = Path(given["FASTRTPS_DEFAULT_PROFILES_FILE"])
    assert settings["AssertPathExists"] == [str(profile)]
    assert (REPOSITORY / "security" / profile.name).exists()


@pytest.mark.processes
@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd here")
def test_systemd_finds_the_unit_little_exposed():
    unit = REPOSITORY / "docs" / "focus_planner.service"
    command = ["systemd-analyze", "security", "--offline=true", "--no-pager", str(unit)]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    if "unrecognized option" in found.stderr:
        pytest.skip("this systemd judges no files")
    level = re.search(r"Overall exposure level for \S+: ([\d.]+)", found.stdout)
    assert level, found.stderr
    assert float(level[1]) <= 3


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


# --- metadata --------------------------------------------------------------------------------


def lowest_locked():
    """The oldest release of every package in requirements.lock, for whatever Python."""
    lock = (REPOSITORY / "requirements.lock").read_text(encoding="utf-8")
    releases = {}
    for name, version in re.findall(r"(?m)^([\w.-]+)==([\w.]+)", lock):
        releases.setdefault(name, []).append(Version(version))
    return {name: min(versions) for name, versions in releases.items()}


def requirements(arguments):
    extras = arguments["extras_require"].values()
    return [Requirement(r) for r in itertools.chain(arguments["install_requires"], *extras)]


def test_the_tests_run_with_the_oldest_releases_that_are_allowed(arguments):
    locked = lowest_locked()
    for requirement in requirements(arguments):
        floors = [Version(s.version) for s in requirement.specifier if s.operator == ">="]
        assert floors, requirement
        assert requirement.specifier.contains(locked[requirement.name]), requirement
        assert floors == [Version(".".join(map(str, locked[requirement.name].release[:2])))]


def test_every_direct_dependency_is_locked():
    text = (REPOSITORY / "requirements.in").read_text(encoding="utf-8")
    names = {
        Requirement(line.partition("#")[0]).name for line in text.splitlines() if line[:1].isalpha()
    }
    locked = {name.lower() for name in lowest_locked()}
    assert {name.lower().replace("_", "-") for name in names} <= locked


def test_the_lock_names_no_place_to_download_from():
    assert "://" not in (REPOSITORY / "requirements.lock").read_text(encoding="utf-8")


def test_all_versions_are_the_same(arguments):
    manifests = [REPOSITORY / "package.xml", REPOSITORY / "msg_defs" / "package.xml"]
    for manifest in manifests:
        assert ET.parse(manifest).getroot().findtext("version") == arguments["version"]
        changes = (manifest.parent / "CHANGELOG.rst").read_text(encoding="utf-8")
        heading = re.search(r"(?m)^(\S+) \(\d{4}-\d\d-\d\d\)$", changes)
        assert heading is not None
        assert heading[1] == arguments["version"]


@pytest.mark.parametrize("folder", [".", "msg_defs"])
def test_changelogs_have_the_form_of_ros(folder):
    changes = (REPOSITORY / folder / "CHANGELOG.rst").read_text(encoding="utf-8")
    name = ET.parse(REPOSITORY / folder / "package.xml").getroot().findtext("name")
    title = f"Changelog for package {name}"
    assert changes.startswith(f"{'^' * len(title)}\n{title}\n{'^' * len(title)}\n\n")
    headings = re.findall(r"(?m)^(.+)\n(-+)$", changes)
    assert [h for h, _ in headings if h != "Forthcoming"]
    for heading, line in headings:
        assert re.fullmatch(r"Forthcoming|\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)", heading)
        assert len(line) == len(heading)


def test_a_picture_without_matplotlib_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "focus_planner.io.picture", raising=False)
    with pytest.raises(InputError, match=re.escape("pip install 'focus_planner[picture]'")):
        importlib.import_module("focus_planner.io.picture")


def test_a_pdf_without_reportlab_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "reportlab", None)
    monkeypatch.delitem(sys.modules, "focus_planner.io.lens_sheet.pdf_pages", raising=False)
    with pytest.raises(InputError, match=re.escape("pip install 'focus_planner[pdf]'")):
        importlib.import_module("focus_planner.io.lens_sheet.pdf_pages")


# --- source distribution, wheel, types -------------------------------------------------------


def run(*command, folder):
    """Run a module of this Python in a folder; its errors are the test's."""
    done = subprocess.run(
        [sys.executable, "-m", *map(str, command)],
        cwd=folder,
        env={k: v for k, v in os.environ.items() if k not in {"PYTHONPATH", "MYPYPATH"}},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The names in a wheel that was built from a source distribution alone."""
    folder = tmp_path_factory.mktemp("build")
    source = folder / "source"
    no_source = (".*", "__pycache__", "*.egg-info", "build", "dist", "install", "log", "bags")
    shutil.copytree(REPOSITORY, source, ignore=shutil.ignore_patterns(*no_source))
    run("build", "--sdist", "--no-isolation", "--outdir", folder, source, folder=folder)
    (archive,) = folder.glob("focus_planner-*.tar.gz")
    options = ("--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", folder)
    run("pip", "wheel", *options, archive, folder=folder)
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as file:
        metadata = next(name for name in file.namelist() if name.endswith("/METADATA"))
        return set(file.namelist()), file.read(metadata).decode("utf-8")


@pytest.mark.processes
def test_a_wheel_from_the_source_distribution_has_what_the_node_needs(wheel, installed):
    names, _ = wheel
    shared = {name.partition(".data/data/share/")[2] for name in names}
    assert set(installed) <= shared
    here = (REPOSITORY / "focus_planner").rglob("*")
    files = {str(f.relative_to(REPOSITORY)) for f in here if f.is_file() and f.suffix != ".pyc"}
    assert {f for f in files if "__pycache__" not in f} <= names


@pytest.mark.processes
def test_the_data_of_the_evaluation_stay_out_of_the_wheel(wheel):
    names, _ = wheel
    files = (REPOSITORY / "data").rglob("*.p[ly]*")
    ours = {path.name for path in files if "__pycache__" not in path.parts}
    assert {"body_00.ply", "make_bodies.py"} <= ours
    assert not ours & {Path(name).name for name in names}


@pytest.mark.processes
def test_the_page_of_the_package_has_a_description_and_names_no_host(wheel):
    _, metadata = wheel
    head, _, description = metadata.partition("\n\n")
    assert "Description-Content-Type: text/markdown" in head
    assert description.strip().startswith("# focus_planner")
    assert "Home-page" not in head
    assert "Project-URL" not in head
    assert "Provides-Extra: pdf" in head
    assert "Provides-Extra: picture" in head
    assert "Provides-Extra: ros" in head


@pytest.mark.processes
def test_mypy_finds_the_types_of_the_installed_package(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from focus_planner.core.rig.lens import Lens\n"
        "reveal_type(Lens)\n"
        "reveal_type(Lens().hyperfocal_distance)\n",
        encoding="utf-8",
    )
    # The types of NumPy and others take a minute to read, and are not in question.
    settings = "[mypy]\nfollow_imports = skip\n[mypy-focus_planner.*]\nfollow_imports = silent\n"
    (tmp_path / "mypy.ini").write_text(settings, encoding="utf-8")
    told = run("mypy", script, folder=tmp_path)
    assert "import-untyped" not in told
    assert "import-not-found" not in told
    assert re.search(r':2: note: .*"def \(.*\) -> focus_planner\.core\.rig\.lens\.Lens"', told)
    assert re.search(r':3: note: Revealed type is "(builtins\.)?float', told)
