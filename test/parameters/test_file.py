# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""config/focus_planner.yaml, and what makes it."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
import yaml

from focus_planner.cli import main as cli
from focus_planner.core.validation import InputError
from focus_planner.parameters.declaration import Declaration
from focus_planner.parameters.file import check_parameter_files, parameters_to_yaml
from focus_planner.parameters.lenses import (
    ADAPTER_DECLARATIONS,
    SIMULATION_DECLARATIONS,
    AdapterSettings,
)
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.planner_settings import Settings

REPOSITORY = Path(__file__).parents[2]
FILE = REPOSITORY / "config" / "focus_planner.yaml"
TEXT = parameters_to_yaml(DECLARATIONS)
FROM_ZERO = [d for d in DECLARATIONS if type(d.default) in {int, float} and d.low == 0]
# A unit, or what makes the number one without.
UNIT = re.compile(
    r"\b(metres|seconds|pixels|mm per pixel|bytes|number of|dioptres|1/m\^2|unit|seed|weight|"
    r"fraction of|hertz|"
    r"focal length over aperture diameter)\b",
    re.IGNORECASE,
)


def flat(values: dict[str, object], prefix: str = "") -> dict[str, object]:
    """Return nested parameters by their dotted names."""
    found: dict[str, object] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            found |= flat(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = tuple(value) if isinstance(value, list) else value
    return found


def values_of(text: str) -> dict[str, object]:
    return flat(yaml.safe_load(text)["/**"]["ros__parameters"])


def comment_above(name: str) -> str:
    """Return the comment of a parameter as one line."""
    lines = TEXT.splitlines()
    group, _, last = name.rpartition(".")
    start = lines.index(f"    {group}:") if group else 0
    indent = "      " if group else "    "
    at = next(i for i in range(start, len(lines)) if lines[i].startswith(f"{indent}{last}:"))
    comment = []
    while lines[at - 1].lstrip().startswith("#"):
        at -= 1
        comment.insert(0, lines[at].strip().removeprefix("# "))
    return " ".join(comment)


def test_the_file_is_what_the_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["parameters"]) == 0
    printed = capsys.readouterr().out
    assert printed == TEXT
    assert FILE.read_text(encoding="utf-8") == printed, (
        "make it again: focus_planner parameters > config/focus_planner.yaml"
    )


LENS_NODES = {"lens_adapter": ADAPTER_DECLARATIONS, "simulated_lens": SIMULATION_DECLARATIONS}


@pytest.mark.parametrize("node", LENS_NODES)
def test_nodes_of_lenses_have_such_a_file_too(
    node: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["parameters", node]) == 0
    printed = capsys.readouterr().out
    assert (FILE.parent / f"{node}.yaml").read_text(encoding="utf-8") == printed, (
        f"make it again: focus_planner parameters {node} > config/{node}.yaml"
    )
    assert max(map(len, printed.splitlines())) <= 100
    values, declarations = values_of(printed), LENS_NODES[node]
    assert values == {d.name: d.default for d in declarations}
    assert [type(values[d.name]) for d in declarations] == [type(d.default) for d in declarations]
    comments = " ".join(line.strip(" #") for line in printed.splitlines())
    for declaration in declarations:
        first = declaration.description.split(". ")[0].rstrip(".")
        assert " ".join(first.split()) in " ".join(comments.split())
    assert comments.count("They can only be set when the node starts.") == 1
    assert "It can only be set" not in comments


def test_the_lens_adapters_file_gives_its_defaults_once_cameras_are_named() -> None:
    text = (FILE.parent / "lens_adapter.yaml").read_text(encoding="utf-8")
    cameras = {"cameras": ["a"]}
    assert AdapterSettings.from_values(values_of(text) | cameras) == AdapterSettings.from_values(
        cameras
    )


def test_it_has_every_parameter_with_its_default_and_no_other() -> None:
    values = values_of(TEXT)
    assert values == {d.name: d.default for d in DECLARATIONS}
    assert [type(values[d.name]) for d in DECLARATIONS] == [type(d.default) for d in DECLARATIONS]


def test_no_line_is_longer_than_a_screen_is_wide() -> None:
    assert max(map(len, TEXT.splitlines())) <= 100


@pytest.mark.parametrize("declaration", DECLARATIONS, ids=lambda d: d.name)
def test_every_parameter_is_explained_above_it(declaration: Declaration) -> None:
    comment = comment_above(declaration.name)
    assert declaration.description.split(". ")[0].rstrip(".") in comment
    if type(declaration.default) in {int, float}:
        low, high = re.search(r"Range: (\S+) to (\S+)\.$", comment).groups()
        assert float(low) == declaration.low
        assert float(high) == pytest.approx(declaration.high)
    else:
        assert "Range" not in comment
    assert ("It can only be set when the node starts" in comment) == declaration.read_only


def test_a_change_that_applies_at_another_time_says_so() -> None:
    for declaration in DECLARATIONS:
        from_next = "A change applies from the next request on." in declaration.description
        if not from_next and not declaration.read_only:
            assert "A change applies" in comment_above(declaration.name), declaration.name


@pytest.mark.parametrize(
    "declaration",
    [d for d in DECLARATIONS if not isinstance(d.default, (str, bool))],
    ids=lambda d: d.name,
)
def test_every_number_says_its_unit(declaration: Declaration) -> None:
    assert UNIT.search(declaration.description), declaration.description


@pytest.mark.parametrize(
    "declaration",
    [d for d in DECLARATIONS if type(d.default) in {int, float}],
    ids=lambda d: d.name,
)
def test_a_default_is_within_its_range(declaration: Declaration) -> None:
    assert declaration.low <= declaration.default <= declaration.high


@pytest.mark.parametrize("declaration", FROM_ZERO, ids=lambda d: d.name)
def test_a_number_that_cannot_be_0_says_so(declaration: Declaration) -> None:
    try:
        Settings.from_values({declaration.name: type(declaration.default)(0)})
        refused = False
    except InputError as error:
        # Others may have to be given then, which is told.
        refused = error.argument.endswith(declaration.name.rpartition(".")[2])
    assert refused == ("above 0" in declaration.description)


@pytest.mark.parametrize(
    "declaration",
    [d for d in DECLARATIONS if isinstance(d.default, str) and "One of:" in d.description],
    ids=lambda d: d.name,
)
def test_a_default_is_among_its_choices(declaration: Declaration) -> None:
    choices = re.search(r"One of: ([^.]*)\.", declaration.description).group(1).split(", ")
    assert declaration.default in choices
    assert f"One of: {', '.join(choices)}." in comment_above(declaration.name)


def test_strings_that_yaml_takes_for_something_else_are_quoted() -> None:
    given = [
        Declaration("tuples", "yes", "A word."),
        Declaration("seed", "12", "Digits."),
        Declaration("gap", 1e-7, "A small number."),
        Declaration("lens.focus_distances", (0.5, 1e20), "Numbers."),
    ]
    values = values_of(parameters_to_yaml(given))
    assert values == {d.name: d.default for d in given}


def test_the_example_of_quality_of_service_holds_once_its_comment_signs_are_gone() -> None:
    without = re.sub(r"^    #(?! \S)", "    ", TEXT, flags=re.MULTILINE)
    assert len(values_of(without)) == len(DECLARATIONS) + 4
    mesh = "qos_overrides./focus_planner/mesh.subscription."
    cloud = "qos_overrides./focus_planner/cloud.subscription."
    assert values_of(without)[f"{mesh}durability"] == "transient_local"
    assert values_of(without)[f"{cloud}reliability"] == "best_effort"


def test_parameter_files_are_looked_at_before_ros_reads_them(tmp_path: Path) -> None:
    arguments = ["--ros-args", "--params-file", str(FILE), "-p", "a:=1", "--params-file"]
    check_parameter_files([*arguments, str(FILE)])
    check_parameter_files(arguments)
    pipe, deep = tmp_path / "pipe", tmp_path / "deep.yaml"
    os.mkfifo(pipe)
    deep.write_text("[" * 100_000)
    text, empty = tmp_path / "text.yaml", tmp_path / "empty.yaml"
    text.write_text("-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n")
    empty.write_text("# nothing yet\n")
    for path, telling in (
        (pipe, "got a pipe"),
        (Path("/dev/zero"), "got a device"),
        (tmp_path / "none", r"none: expected a parameter file \(YAML\), got no such file"),
        (deep, "deep.yaml: expected YAML, got line 1, column 51: more than 50 lists"),
        (
            text,
            r"text.yaml: expected a parameter file \(YAML\) with keys and values, got something",
        ),
        (empty, "empty.yaml: expected a parameter file"),
    ):
        with pytest.raises(InputError, match=telling):
            check_parameter_files([*arguments, str(path)])
