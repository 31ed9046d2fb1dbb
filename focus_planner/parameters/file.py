"""Parameter files for ROS: one with every parameter explained; whether others can be read."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence
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
    """Return a parameter file.

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
    head = "\n".join(_comment(_HEAD, ""))
    lines = [head, "", "/**:", "  ros__parameters:"]
    for section in dict.fromkeys(map(_section, declarations)):
        members = [each for each in declarations if _section(each) == section]
        lines += ["", f"{_INDENT}# --- {_TITLES[section]} ---", *_members(section, members)]
    lines += ["", f"{_INDENT}# --- {_QOS_TITLE} ---", "", *_comment(_QOS, _INDENT)]
    lines += [f"{_INDENT}#{line}" for line in _QOS_EXAMPLE.splitlines()]
    return "\n".join(lines) + "\n"


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


def _section(declaration: Declaration) -> str:
    group, dot, _ = declaration.name.partition(".")
    if dot:
        return group
    if declaration.name.startswith("camera_"):
        return "frames"
    if declaration.name.startswith("record_"):
        return "records"
    return "planning" if declaration.plans else "serving"


def _members(section: str, members: Iterable[Declaration]) -> Iterator[str]:
    prefix = f"{section}."
    nested = False
    for member in members:
        name = member.name.removeprefix(prefix)
        if name != member.name and not nested:
            nested = True
            yield from ("", f"{_INDENT}{section}:")
        indent = _INDENT + 2 * nested * " "
        yield from ("", *_comment(_explanation(member), indent))
        yield f"{indent}{name}: {_value(member)}"


def _explanation(declaration: Declaration) -> str:
    text = declaration.description
    for sentence in _STATED_ONCE:
        text = text.replace(sentence, "")
    return (
        text
        + " It can only be set when the node starts." * declaration.read_only
        + _range(declaration)
    )


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
