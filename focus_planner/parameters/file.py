# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Parameter files for ROS: one with every parameter explained; whether others can be read."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import yaml

from focus_planner.io.yaml_values import check_yaml
from focus_planner.parameters.declaration import Declaration

_WIDTH = 100
_INDENT = "    "
_HEAD = """\
All parameters of the planner with their defaults, as printed by `focus_planner parameters`. Any \
of them may be left out. A change applies from the next request on, unless stated otherwise.

    focus_planner node --ros-args --params-file focus_planner.yaml

"/**" stands for a node of any name in any namespace.
"""
_AT_START = " It can only be set when the node starts."
# Stated once for all parameters: in the head, and in titles.
_STATED_ONCE = (
    " A change applies from the next request on.",
    " Applies to cameras that do not bring their own.",
)
_TITLES = {
    "planning": "What to plan, and how",
    "frames": "A rig from the frames and CameraInfo of a running system",
    "image": "Image, of cameras that do not bring their own",
    "lens": "Lens, of cameras that do not bring their own",
    "cost": "Cost, Eq. 1 of the paper",
    "records": "Recorded runs",
    "serving": "How requests are served, and what is reported",
}
_LENS_HEAD = """\
All parameters of {what} with their defaults, as printed by `focus_planner parameters {node}`. Any \
of them may be left out but cameras. They can only be set when the node starts.

    focus_planner {node} --ros-args --params-file {node}.yaml

"/**" stands for a node of any name in any namespace: the lens adapter and simulated lenses may \
share a file, from which each takes its own. [''] stands for no name at all: of an empty list ROS \
does not know the type.
"""
_LENS_TITLES = {
    "drivers": "Which lenses there are, and how their drivers are told",
    "adapter": "Whose plans they follow, when a lens counts as set, and how long that may take",
    "simulation": "What the simulated lenses are like",
}
_QOS_TITLE = "Quality of service of ~/mesh, ~/cloud, ~/camera_poses and ~/rig"
_QOS = """\
History, depth, reliability and durability can be overridden for each topic; the defaults are \
keep_last with depth 4, reliable and volatile. A change applies when the node is next configured. \
Topics go by their full names, which depend on the node's name and namespace. To receive a mesh \
that was latched before the planner started, set durability to transient_local; to receive from a \
sensor that publishes best effort, set reliability to best_effort:
"""
_QOS_EXAMPLE = """\
qos_overrides:
  /focus_planner/mesh:
    subscription:
      durability: transient_local
  /focus_planner/cloud:
    subscription:
      reliability: best_effort
      history: keep_last
      depth: 1
"""


def parameters_to_yaml(declarations: Sequence[Declaration]) -> str:
    """Return a parameter file for the planner.

    Parameters
    ----------
    declarations : sequence of Declaration

    Returns
    -------
    str
        YAML of all parameters with their defaults, in sections; comments give descriptions and
        ranges. An example overrides the topics' quality of service; it is commented out by a ``#``
        without a space.
    """
    sections = _sections(declarations, _section)
    lines = _lines(_HEAD, {_TITLES[name]: (name, each) for name, each in sections.items()})
    lines += ["", f"{_INDENT}# --- {_QOS_TITLE} ---", "", *_comment(_QOS, _INDENT)]
    lines += [f"{_INDENT}#{line}" for line in _QOS_EXAMPLE.splitlines()]
    return "\n".join(lines) + "\n"


def lens_parameters_to_yaml(
    node: str, what: str, declarations: Sequence[Declaration], drivers: Sequence[Declaration]
) -> str:
    """Return a parameter file for a node of lenses, as :func:`parameters_to_yaml` does.

    Parameters
    ----------
    node : str
        The command that runs it.
    what : str
        What it is called in words.
    declarations : sequence of Declaration
    drivers : sequence of Declaration
        Those among them that are about drivers.
    """
    others = "adapter" if node == "lens_adapter" else "simulation"
    sections = _sections(declarations, lambda each: "drivers" if each in drivers else others)
    head = _LENS_HEAD.format(what=what, node=node)
    titled = {_LENS_TITLES[name]: (name, sections[name]) for name in ("drivers", others)}
    return "\n".join(_lines(head, titled, told=(_AT_START,))) + "\n"


def check_parameter_files(arguments: Sequence[str]) -> None:
    """Raise unless the parameter files among ROS's arguments can be given to ROS to read.

    ROS waits for pipes, and for devices that never end; and it starts a node with nothing but
    defaults where a file is YAML without keys, as any text is.

    Raises
    ------
    InputError
        If one is no regular file, too large, or no valid YAML with keys.
    """
    for flag, path in pairwise(arguments):
        if flag == "--params-file":
            check_yaml(Path(path), "a parameter file (YAML)")


def _sections(
    declarations: Sequence[Declaration], section: Callable[[Declaration], str]
) -> dict[str, list[Declaration]]:
    """Return the parameters by section, in the order in which sections first occur."""
    names = dict.fromkeys(map(section, declarations))
    return {name: [each for each in declarations if section(each) == name] for name in names}


def _lines(
    head: str, sections: Mapping[str, tuple[str, list[Declaration]]], told: Sequence[str] = ()
) -> list[str]:
    """Return the lines of a file: of sections by title, without what the head tells of all."""
    lines = [*_comment(head, ""), "", "/**:", "  ros__parameters:"]
    for title, (name, members) in sections.items():
        lines += ["", f"{_INDENT}# --- {title} ---", *_members(name, members, told)]
    return lines


def _section(declaration: Declaration) -> str:
    group, dot, _ = declaration.name.partition(".")
    if dot:
        return group
    if declaration.name.startswith("camera_"):
        return "frames"
    if declaration.name.startswith("record_"):
        return "records"
    return "planning" if declaration.plans else "serving"


def _members(section: str, members: Iterable[Declaration], told: Sequence[str]) -> Iterator[str]:
    prefix = f"{section}."
    nested = False
    for member in members:
        name = member.name.removeprefix(prefix)
        if name != member.name and not nested:
            nested = True
            yield from ("", f"{_INDENT}{section}:")
        indent = _INDENT + 2 * nested * " "
        yield from ("", *_comment(_explanation(member, told), indent))
        yield f"{indent}{name}: {_value(member)}"


def _explanation(declaration: Declaration, told: Sequence[str]) -> str:
    text = declaration.description + _AT_START * declaration.read_only
    for sentence in (*_STATED_ONCE, *told):
        text = text.replace(sentence, "")
    return text + _range(declaration)


def _range(declaration: Declaration) -> str:
    low, high = declaration.low, declaration.high
    if isinstance(declaration.default, float):
        return f"\nRange: {low:g} to {high:g}."
    if isinstance(declaration.default, int) and not isinstance(declaration.default, bool):
        return f"\nRange: {low} to {high}."
    return ""


def _comment(text: str, indent: str) -> Iterator[str]:
    prefix = f"{indent}# "
    for line in text.splitlines():
        wrapped = textwrap.wrap(
            line,
            _WIDTH,
            initial_indent=prefix,
            subsequent_indent=prefix,
            break_long_words=False,
            break_on_hyphens=False,
        )
        yield from wrapped or [prefix.rstrip()]


def _value(declaration: Declaration) -> str:
    default = declaration.default
    plain = list(default) if isinstance(default, tuple) else default
    # Within a list, any value is dumped on one line.
    text: str = yaml.safe_dump([plain], default_flow_style=True, width=float("inf"))
    return text.strip()[1:-1]
