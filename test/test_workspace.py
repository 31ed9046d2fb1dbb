# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A clone in a colcon workspace: what colcon and rosdep read of it.

Neither is among the packages that the tests have. How colcon's own programs took these files, and
from which version of rosdistro the keys are, is in docs/workspace.md.
"""

from __future__ import annotations

import re
import runpy
from unittest.mock import patch
from xml.etree import ElementTree as ET

import pytest
import yaml
from catkin_pkg.package import parse_package
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from testing.optional_modules import WITHOUT_A_KEY
from testing.pages import ROOT

MANIFESTS = {
    "focus_planner": ROOT / "package.xml",
    "focus_planner_msgs": ROOT / "msg_defs/package.xml",
}
PAGE = (ROOT / "docs/workspace.md").read_text("utf-8")
BASE_PATHS = "src src/focus_planner/msg_defs"
# Each has a rule for Ubuntu 24.04 in the python.yaml of rosdep.
KEYS = {
    "argcomplete": "python3-argcomplete",
    "build": "python3-build",
    "hypothesis": "python3-hypothesis",
    "mapbox-earcut": "python3-mapbox-earcut-pip",
    "matplotlib": "python3-matplotlib",
    "mcap-ros2-support": "mcap-ros2-support",
    "mypy": "python3-mypy",
    "myst-parser": "python3-myst-parser-pip",
    "numba": "python3-numba",
    "numpy": "python3-numpy",
    "open3d-cpu": "python3-open3d-pip",
    "open3d": "python3-open3d-pip",
    "opencv-python-headless": "python3-opencv",
    "packaging": "python3-packaging",
    "pillow": "python3-pil",
    "pytest": "python3-pytest",
    "pytest-timeout": "python3-pytest-timeout",
    "pytest-xdist": "python3-pytest-xdist",
    "pyyaml": "python3-yaml",
    "reportlab": "python3-reportlab",
    "rich": "python3-rich",
    "rosbags": "python3-rosbags-pip",
    "scipy": "python3-scipy",
    "sphinx": "python3-sphinx",
    "sphinx-copybutton": "python3-sphinx-copybutton",
    "trimesh": "python3-trimesh-pip",
}
BROUGHT = {
    "mcap": "mcap-ros2-support",
    "lz4": "mcap-ros2-support",
    "zstandard": "mcap-ros2-support",
}
FORMATS = {"dracopy", "laspy", "lazrs", "openexr", "pye57"}
WITHOUT = FORMATS | {"embreex"}


@pytest.fixture(scope="module")
def arguments():
    with patch("setuptools.setup") as setup:
        runpy.run_path(str(ROOT / "setup.py"))
    return setup.call_args.kwargs


def names(requirements):
    return {canonicalize_name(Requirement(r).name) for r in requirements}


# --- manifests -------------------------------------------------------------------------------


@pytest.mark.parametrize("package", MANIFESTS)
def test_the_manifest_is_as_strict_readers_want_it(package):
    warnings = []
    manifest = parse_package(str(MANIFESTS[package]), warnings=warnings)
    manifest.validate(warnings=warnings)
    assert warnings == []
    assert manifest.name == package
    assert manifest.package_format == 3
    assert [url.type for url in manifest.urls] == ["website"]
    assert manifest.authors
    assert manifest.maintainers


def test_everything_that_is_installed_has_a_key_or_is_named(arguments):
    manifest = parse_package(str(MANIFESTS["focus_planner"]))
    run = {each.name for each in manifest.exec_depends}
    extras = arguments["extras_require"]
    needed = names(arguments["install_requires"])
    needed |= names(r for name in ("formats", "pdf", "picture") for r in extras[name])
    for name in needed - WITHOUT:
        assert KEYS.get(name) in run or BROUGHT.get(name) in run, name
    test = run | {each.name for each in manifest.test_depends}
    assert {KEYS[name] for name in names(extras["test"])} <= test
    rosdep = {name for name in run | test if name.startswith(("python3-", "mcap"))}
    assert rosdep <= set(KEYS.values())
    assert {each.name for each in manifest.doc_depends} <= set(KEYS.values())


def test_what_has_no_key_is_named_with_the_line_that_installs_it(arguments):
    assert names(arguments["extras_require"]["formats"]) == FORMATS
    line = f"pip install {' '.join(sorted(WITHOUT))}"
    assert line in MANIFESTS["focus_planner"].read_text("utf-8")
    assert line in PAGE
    for module in WITHOUT_A_KEY:
        assert f"`{module}`" in PAGE


# --- colcon ----------------------------------------------------------------------------------


def test_colcon_knows_that_the_tests_are_for_pytest(arguments):
    assert "pytest" in names(arguments["extras_require"]["test"])


def test_the_defaults_name_both_packages_for_every_command():
    defaults = yaml.safe_load((ROOT / "tools/colcon_defaults.yaml").read_text("utf-8"))
    assert set(defaults) == {"build", "test", "list", "info", "graph"}
    for settings in defaults.values():
        assert settings == {"base-paths": ["src", "src/*/msg_defs", "src/*/*/msg_defs"]}
    assert "cp src/focus_planner/tools/colcon_defaults.yaml ." in PAGE


def test_the_line_is_the_same_wherever_it_is_told():
    assert f"colcon build --base-paths {BASE_PATHS}" in PAGE
    assert f"rosdep install --from-paths {BASE_PATHS}" in PAGE
    texts = [path.read_text("utf-8") for path in (ROOT / "focus_planner").rglob("*.py")]
    told = [re.sub(r'"\s+"', "", text) for text in texts if "--base-paths" in text]
    assert told
    assert all(f"--base-paths {BASE_PATHS}" in text for text in told)


def test_colcon_may_run_setup_by_a_link_in_another_folder(tmp_path, arguments):
    (tmp_path / "setup.py").symlink_to(ROOT / "setup.py")
    with patch("setuptools.setup") as setup:
        runpy.run_path(str(tmp_path / "setup.py"))
    assert setup.call_args.kwargs["long_description"] == arguments["long_description"]


def test_executables_are_where_ros2_run_looks():
    settings = (ROOT / "setup.cfg").read_text("utf-8")
    assert settings.count("=$base/lib/focus_planner") == 2


def test_a_source_archive_excludes_nothing_that_is_not_there():
    # setuptools warns of it, and colcon shows what a package writes to stderr.
    assert "exclude" not in (ROOT / "MANIFEST.in").read_text("utf-8")


def test_manifests_are_well_formed_for_the_schema():
    for path in MANIFESTS.values():
        text = path.read_text("utf-8")
        assert 'href="http://download.ros.org/schema/package_format3.xsd"' in text
        assert ET.fromstring(text).get("format") == "3"
