# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What an operator would not accept: forged lines, readable scans, a service without walls."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

from focus_planner_msgs.msg import CameraFocus, LensState
from rclpy.node import Node as RosNode
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rich.console import Console

from benchmarks.attacks.table import Seen, attack, report
from benchmarks.attacks.victim import PATIENCE, Victim, command, parameter_of, peer, until, victim
from focus_planner.io.bodies import body
from focus_planner.messages.typestore import CLOUD, POSES, serialize
from focus_planner.messages.typestore import RIG as RIG_TYPE
from focus_planner.messages.writing import cloud_to_fields, poses_to_fields, rig_to_fields
from testing.malformed import CLOUD as POINTS
from testing.malformed import RIG
from testing.ros.recorded import whole
from testing.runs import rewritten, with_payload

_BAGS = Path(__file__).parents[2] / "bags"
_UNIT = Path(__file__).parents[2] / "docs" / "focus_planner.service"
_MOST_EXPOSED = 3.0
_FORGED = "\x1b[31mred\r\n[ERROR] forged \x07\x9b31m\u202e"
# All of Cc but the newline, and what turns the direction of a text.
_CONTROL = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
_LONGEST_LINE = 10_000
_STATES = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    attacks = [forged_log, forged_terminal, modes, modes_of_commands, unit]
    return report(console, "7. Security that an operator would accept", attacks)


@attack(
    "control characters and forged lines in names, frames, methods, parameters and states,"
    " and 1 MB of each",
    f"escaped in the node's log and answers; no line above {_LONGEST_LINE:,} characters",
)
def forged_log(folder: Path) -> Seen:
    """Send texts that would forge lines of the log, wherever the node takes a text."""
    with victim(folder) as one, peer() as node:
        plan_id = one.check_plan()
        answers = []
        for text in (_FORGED, "y" * 1_000_000):
            answers += list(_answers_to(one, text))
            _publish_state(node, one, text, plan_id)
            one.put_inputs()
            one.check_plan()
        log = one.node.log
    return _judge_text("log", log, answers)


def _answers_to(one: Victim, text: str) -> Iterator[str]:
    header = {"frame_id": text}
    rig, poses = rig_to_fields(RIG), poses_to_fields(RIG)
    first, *others = rig["cameras"]
    messages = {
        "rig": [
            serialize(RIG_TYPE, rig | {"header": header}),
            serialize(RIG_TYPE, rig | {"cameras": [first | {"name": text}, *others]}),
        ],
        "camera_poses": [serialize(POSES, poses | {"header": header})],
        "cloud": [serialize(CLOUD, cloud_to_fields(POINTS, text))],
    }
    for topic, payloads in messages.items():
        for payload in payloads:
            one.client.publish(topic, payload)
            yield one.client.plan(PATIENCE, method="em", samples=200).message
    for name in ("method", "scope", "bound"):
        yield one.client.plan(PATIENCE, **{name: text}).message
    for name in ("method", "importance_field", "overlap", "lens_tables", text[:200]):
        yield parameter_of(one.client, **{name: text})[1]
    for name in ("importance_field", "lens_tables", "record_directory"):
        parameter_of(one.client, **{name: "importance" if "field" in name else ""})


def _publish_state(node: RosNode, one: Victim, text: str, plan_id: str) -> None:
    publisher = node.create_publisher(LensState, f"{one.node.name}/lens_states", _STATES)
    until(publisher.get_subscription_count, "the planner does not listen")
    camera: CameraFocus = one.client.latched_plan().cameras[0]
    for fields in ({"name": text}, {"plan_id": text}, {"unit": text}, {"message": text}):
        full = {"name": camera.name, "plan_id": plan_id, "status": LensState.STATUS_FAILED}
        publisher.publish(LensState(**full | fields))
    one.client.status()
    node.destroy_publisher(publisher)


@attack(
    "the same in a rig.yaml, a surface's name, a run, and the adapter's parameters",
    "escaped on the terminal, one line each",
)
def forged_terminal(folder: Path) -> Seen:
    """Give such texts to the command line."""
    shutil.copy(body("arms_down"), folder / "body.ply")
    quoted = '"\\e[31mred\\r\\n[ERROR] forged \\a"'
    pose = "position: [1, 0, 1], orientation: [-0.5, -0.5, 0.5, 0.5]"
    cameras = f"cameras:\n  - {{{{name: {{0}}, {pose}}}}}\n"
    rigs = (
        cameras.format(quoted),
        f"frame_id: {quoted}\n" + cameras.format("a"),
        f"{quoted}: 1\n" + cameras.format("a"),
    )
    outputs = []
    for number, text in enumerate(rigs):
        path = folder / f"rig{number}.yaml"
        path.write_text(text)
        options = ("--quiet", "--method", "closest", "--samples", "50")
        outputs.append(command("plan", folder / "body.ply", "--rig", path, *options))
    named = folder / "\x1b[31mred\n[ERROR] forged.ply"
    outputs.append(command("plan", named, "--rig", folder / "rig0.yaml"))
    outputs.append(command("plan", folder / "body.ply", "--rig", "x", "--method", _FORGED))
    outputs.append(command("replay", _forged_run(folder), "--quiet"))
    outputs.append(command("lens_adapter", "--ros-args", "-p", f"driver:='{_FORGED}'"))
    text = "\n".join(ran.err + (ran.out if not ran.out.startswith("{") else "") for ran in outputs)
    traced = [ran.told() for ran in outputs if "Traceback" in ran.err or ran.status is None]
    seen = _judge_text("terminal", text, [])
    return Seen("; ".join([seen.observed, *traced]), seen.held and not traced, len(outputs))


def _forged_run(folder: Path) -> Path:
    result = "focus_planner_msgs/msg/RunResult"

    def change(message):
        if message.type_name != result:
            return message
        fields = {"success": False, "message": _FORGED, "answers": [7]}
        return with_payload(message, serialize(result, fields))

    return rewritten(_BAGS / "failed_request", folder / "forged", change)


def _judge_text(where: str, text: str, answers: list[str]) -> Seen:
    controls = sorted({repr(found) for found in _CONTROL.findall(text)})
    forged = [line for line in text.splitlines() if line.startswith("[ERROR] forged")]
    longest = max(map(len, text.splitlines() or [""]))
    answered = max(map(len, answers), default=0)
    raw = sum(bool(_CONTROL.search(answer) or "\n" in answer) for answer in answers)
    observed = (
        f"in the {where}: control characters {controls}, {len(forged)} forged lines, longest line"
        f" {longest:,}; of {len(answers)} answers {raw} have such characters, longest {answered:,}"
    )
    held = not controls and not forged and max(longest, answered) < _LONGEST_LINE
    return Seen(observed, held, max(1, len(answers)))


@attack(
    "reading what a node records, with a umask of 022",
    "folders 0700, files 0600",
)
def modes(folder: Path) -> Seen:
    """Look at the modes of a node's runs."""
    runs = folder / "deep" / "runs"
    with victim(folder, record_directory=runs) as one:
        plan_id = one.check_plan()
        until(lambda: plan_id in whole(runs), "the run was not recorded")
    return _judge_modes(runs)


@attack("reading what plan --record writes, with a umask of 022", "folders 0700, files 0600")
def modes_of_commands(folder: Path) -> Seen:
    """Look at the modes of the command line's runs."""
    rig = folder / "rig.yaml"
    made = command("rig", "cylinder", "--rows", 2, "--columns", 4, "--radius", 1)
    rig.write_text(made.out)
    options = ("--quiet", "--method", "closest", "--samples", "50", "--record", folder / "runs")
    ran = command("plan", body("arms_down"), "--rig", rig, *options)
    assert ran.status == 0, ran.told()
    return _judge_modes(folder / "runs")


def _judge_modes(runs: Path) -> Seen:
    found = {
        ("folder" if path.is_dir() else "file", path.stat().st_mode & 0o777)
        for path in (runs, *runs.rglob("*"))
    }
    wrong = found - {("folder", 0o700), ("file", 0o600)}
    observed = ", ".join(f"{what}s {mode:04o}" for what, mode in sorted(found))
    return Seen(observed, not wrong, len(found))


@attack("systemd-analyze security of the unit", f"an exposure of at most {_MOST_EXPOSED:g}")
def unit(folder: Path) -> Seen:
    """Let systemd judge the unit, as it stands in docs/."""
    analyze = shutil.which("systemd-analyze")
    if analyze is None:
        return Seen("there is no systemd-analyze here: not judged", held=True, times=0)
    copied = folder / _UNIT.name
    text = _UNIT.read_text()
    copied.write_text(re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", text, flags=re.MULTILINE))
    asked = [analyze, "security", "--offline=true", "--no-pager", str(copied)]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)  # noqa: S603
    found = re.search(r"exposure level.*?:\s*([\d.]+)", done.stdout)
    assert found, f"it said {(done.stdout + done.stderr)[-200:]!r}"
    return Seen(f"an exposure of {found[1]}", float(found[1]) <= _MOST_EXPOSED)
