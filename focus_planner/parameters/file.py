"""Parameter files for ROS: every parameter with its default, and what it means as a comment."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence

import yaml

from focus_planner.parameters.declaration import Declaration

_WIDTH = 100
_INDENT = "    "
_HEAD = """\
Parameters of the planner, each with its default: what `focus_planner parameters` prints. Any of \
them may be left out. A change applies from the next request on, unless it is said otherwise.

    focus_planner node --ros-args --params-file focus_planner.yaml

"/**" stands for a node of any name in any namespace.
"""
# The head says the one, the titles the other.
_SAID_ONCE = (
    " A change applies from the next request on.",
    " For cameras that bring none of their own.",
)
_TITLES = {
    "planning": "What is planned, and how",
    "image": "Images, for cameras that bring none of their own",
    "lens": "Lenses, for cameras that bring none of their own",
    "cost": "The cost, Eq. 1 of the paper",
    "records": "Records of runs",
    "serving": "How requests are served, and what is told of it",
}
_QOS_TITLE = "Quality of service of ~/mesh, ~/cloud, ~/camera_poses and ~/rig"
_QOS = """\
Each has history, depth, reliability and durability; reliable, volatile and the last 4 unless said \
otherwise here. They hold from the next configuring on. A topic has its full name: it changes with \
the node's name and namespace. A mesh that was latched before the planner started is received with \
durability transient_local, a sensor that publishes best effort with reliability best_effort:
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
        YAML of all parameters with their defaults, in sections; comments give description and
        range. What may be overridden of the topics' quality of service is an example, commented
        out by a ``#`` without a space.
    """
    head = "\n".join(_comment(_HEAD, ""))
    lines = [head, "", "/**:", "  ros__parameters:"]
    for section in dict.fromkeys(map(_section, declarations)):
        members = [each for each in declarations if _section(each) == section]
        lines += ["", f"{_INDENT}# --- {_TITLES[section]} ---", *_members(section, members)]
    lines += ["", f"{_INDENT}# --- {_QOS_TITLE} ---", "", *_comment(_QOS, _INDENT)]
    lines += [f"{_INDENT}#{line}" for line in _QOS_EXAMPLE.splitlines()]
    return "\n".join(lines) + "\n"


def _section(declaration: Declaration) -> str:
    group, dot, _ = declaration.name.partition(".")
    if dot:
        return group
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
    for known in _SAID_ONCE:
        text = text.replace(known, "")
    return text + " It can be set at the start only." * declaration.read_only + _range(declaration)


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
    # Within a list it is one line, whatever it is.
    text: str = yaml.safe_dump([plain], default_flow_style=True, width=float("inf"))
    return text.strip()[1:-1]
