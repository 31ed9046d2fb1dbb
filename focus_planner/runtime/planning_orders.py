# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a node and its planning process tell each other.

The node sends an order at a time, and waits for its result; an error is a result too. Meanwhile
the process may send events, and the node :class:`Stop` or :class:`GoOn`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from focus_planner.core.planning.fingerprint import Fingerprint
from focus_planner.core.planning.plan import FocusPlan, WarmStart
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.progress import Progress, Standing
from focus_planner.messages.reading import Optics
from focus_planner.messages.writing import Stamp
from focus_planner.runtime.inputs import Arrival, InputState, Unheard

# --- orders --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Load:
    """Compile or load all kernels that plans run; the result is :class:`Done`."""


@dataclass(frozen=True)
class Digest:
    """Parse inputs, and tell which are in force; the result is :class:`Digested`.

    Attributes
    ----------
    surfaces, rigs : tuple of Arrival
        Those that are new, in the order of arrival.
    unheard : tuple of Unheard
        Publishers of surfaces and of rigs that are not received.
    optics : Optics
    subjects : int
        How many of the newest surfaces are to be in force.
    max_memory : int
        Bytes that this process may take from now on, beyond those it has taken for kernels.
    """

    surfaces: tuple[Arrival[Any], ...]
    rigs: tuple[Arrival[Any], ...]
    unheard: tuple[Unheard, Unheard]
    optics: Optics
    subjects: int
    max_memory: int


@dataclass(frozen=True)
class Plan:
    """Plan on the inputs in force; the result is :class:`Planned`, :class:`NoPlan` or an error.

    Attributes
    ----------
    request : PlanRequest
    model : CostModel
    limits : ResourceLimits
    warm_start : WarmStart or None
        To start from.
    keep_warm : bool
        Whether to return what the next plan can start from.
    is_recorded : bool
        Whether to send every step, and to wait for :class:`GoOn` before solving.
    plan_id : str
        The plan's name, by which it can be described later.
    in_force : str
        The name of the plan in force, which may still be described until the next is; all others
        are forgotten.
    min_change : float
        With a warm start, what a lens moves for: more than this fraction of its depth of field.
    was_asked_for : bool
        Whether somebody waits for the plan who is to be told which input was refused.
    """

    request: PlanRequest
    model: CostModel
    limits: ResourceLimits
    warm_start: WarmStart | None
    keep_warm: bool
    is_recorded: bool
    plan_id: str
    in_force: str
    min_change: float = 0.0
    was_asked_for: bool = True


@dataclass(frozen=True)
class Describe:
    """Describe a plan; the result is :class:`Description`.

    Attributes
    ----------
    plan_id : str
    for_record : bool
        Whether fingerprints are wanted, which only the last plan has, once, if it is recorded.
    visuals_stamp : tuple of int or None
        The stamp of what shows it; None for nothing to show it.
    """

    plan_id: str
    for_record: bool
    visuals_stamp: Stamp | None


# --- during an order -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Stop:
    """End the plan at the next step, with the best found so far."""


@dataclass(frozen=True)
class GoOn:
    """Begin to solve."""


@dataclass(frozen=True)
class Reading:
    """An input is about to be parsed."""

    number: int


@dataclass(frozen=True)
class Compiling:
    """A kernel is about to be compiled, or has been."""

    progress: Progress


@dataclass(frozen=True)
class Compiled:
    """Kernels were compiled, and may be found by the next process."""

    text: str
    is_kept: bool


@dataclass(frozen=True)
class Preparing:
    """A surface is being made ready to plan for; so much of that is done, 0 to 1."""

    share: float


@dataclass(frozen=True)
class Step:
    """A step of a plan that is recorded."""

    progress: Progress


@dataclass(frozen=True)
class Feedback:
    """How far a plan is."""

    standing: Standing


@dataclass(frozen=True)
class Logged:
    """A line for the log."""

    is_error: bool
    text: str


# --- results -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Done:
    """The order has been carried out."""


@dataclass(frozen=True)
class RigInForce:
    """What a node needs of the rig in force.

    Attributes
    ----------
    frame_id : str
    names : tuple of str
        Of its cameras.
    """

    frame_id: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Digested:
    """The inputs as they are now.

    Attributes
    ----------
    surface, rig : InputState
    surfaces : tuple of InputState
        All surfaces in force, the oldest first.
    subjects : tuple of int
        Their numbers.
    in_force : tuple of int or None
        The numbers of the surface and of the rig in force.
    needed : tuple of int
        The numbers of the inputs that the next answer depends on, in the order of arrival.
    kept : tuple of int
        The numbers of all inputs that may matter later on.
    new_rig : RigInForce or None
        The rig, if another has come into force.
    refused_surfaces : tuple of int
        The numbers of the surfaces that were refused meanwhile.
    """

    surface: InputState
    rig: InputState
    surfaces: tuple[InputState, ...]
    subjects: tuple[int, ...]
    in_force: tuple[int | None, int | None]
    needed: tuple[int, ...]
    kept: tuple[int, ...]
    new_rig: RigInForce | None
    refused_surfaces: tuple[int, ...] = ()


@dataclass(frozen=True)
class Planned:
    """A plan.

    Attributes
    ----------
    plan : FocusPlan
    stop_log : StopLog
    warm_start : WarmStart or None
    reminder : str
        Which input is not the newest received.
    """

    plan: FocusPlan
    stop_log: StopLog
    warm_start: WarmStart | None
    reminder: str


@dataclass(frozen=True)
class Visuals:
    """What shows a plan, serialized.

    Attributes
    ----------
    markers : bytes
        ``visualization_msgs/msg/MarkerArray``.
    quality_cloud : bytes
        ``sensor_msgs/msg/PointCloud2``.
    """

    markers: bytes
    quality_cloud: bytes


@dataclass(frozen=True)
class Description:
    """What is told of a plan besides the plan itself.

    Attributes
    ----------
    fingerprints : tuple of Fingerprint
        Empty unless asked for.
    visuals : Visuals or None
        None unless asked for, or if the process does not know the plan.
    """

    fingerprints: tuple[Fingerprint, ...]
    visuals: Visuals | None


@dataclass(frozen=True)
class NotReadyYet:
    """An input is missing, or was refused since the last request."""

    why: str


@dataclass(frozen=True)
class Refused:
    """The request does not fit the inputs, or a limit."""

    why: str


@dataclass(frozen=True)
class Failed:
    """An error of this program.

    Attributes
    ----------
    why : str
        For the caller.
    details : str
        For the log.
    """

    why: str
    details: str


@dataclass(frozen=True)
class OutOfMemory:
    """The order took more memory than the process may; it had better be started anew."""


Result = Done | Digested | Planned | Description | NotReadyYet | Refused | Failed | OutOfMemory
