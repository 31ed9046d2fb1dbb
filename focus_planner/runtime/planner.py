# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The surface and the rig in force, whether they fit each other, and planning with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import check_fit
from focus_planner.core.planning.kept import KEPT
from focus_planner.core.planning.plan import SolvedPlan, WarmStart
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Surface
from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.runtime.inputs import (
    AcceptedInput,
    Arrival,
    Content,
    InputSlot,
    KnownSubject,
    Value,
    internal_input_error,
)
from focus_planner.runtime.log import Log

AcceptedScene = AcceptedInput[Surface, Scene]
AcceptedRig = AcceptedInput[Rig, Rig]


def internal_error(error: Exception) -> str:
    """Return what a caller is told of an error in this program."""
    return f"internal error: {error!r}; the planner's log has the details"


class NotReady(Exception):  # noqa: N818 - nothing went wrong here
    """An input is missing, or the newest one was refused; its text is fit for the caller."""


class Planner:
    """Keeps the newest valid surface and rig, and plans.

    The newest of each replaces the one before it. One that is invalid, or does not fit the other
    input, is refused: the last valid one stays in force, and the next caller, once, is told so
    instead of being given a plan for something else. A surface and a rig that fit only each other
    replace both. While nothing valid is in force the newest is taken, fit or not, and every caller
    is told what does not fit.

    Apart from ``surface.receive`` and ``rig.receive``, it is for one thread only.

    Parameters
    ----------
    log : Log
    on_rig : callable
        Called with every rig that comes into force.
    on_reading : callable
        Called with every message that is about to be parsed.
    on_preparing : callable
        Called with the share that is done, 0 to 1, while a surface is made ready to plan for.
    warm_start : WarmStart, optional
        From a plan made elsewhere, for the first plan that asks for a warm start.

    Attributes
    ----------
    surface, rig : InputSlot
        Receive the messages.
    warm_start : WarmStart or None
        What the last plan left for the next, if both ask for a warm start.
    """

    def __init__(
        self,
        log: Log,
        on_rig: Callable[[Rig], None] = lambda _: None,
        on_reading: Callable[[Arrival[Any]], None] = lambda _: None,
        on_preparing: Callable[[float], object] = lambda _: None,
        warm_start: WarmStart | None = None,
    ) -> None:
        self.surface: InputSlot[Surface, Scene] = InputSlot(
            "surface",
            "a mesh on ~/mesh or a cloud on ~/cloud",
            partial(Scene, on_progress=on_preparing),
            log,
            on_reading,
        )
        self.rig: InputSlot[Rig, Rig] = InputSlot(
            "rig", "poses on ~/camera_poses or a rig on ~/rig", lambda rig: rig, log, on_reading
        )
        self._log = log
        self._on_rig = on_rig
        self._optics = Optics()
        self._fits = False
        self.warm_start = warm_start

    def digest(self, optics: Optics, subjects: int = 1) -> None:
        """Process what was received: parse it, build the scene, check whether it fits.

        Parameters
        ----------
        optics : Optics
        subjects : int
            How many of the newest surfaces are to be in force.
        """
        before = self.rig.in_force
        self.surface.keep(subjects)
        if optics != self._optics:
            self._read_rig_again(optics)
        while True:
            scene, rig = self.surface.newest(optics), self.rig.newest(optics)
            if scene or rig:
                self._accept(scene, rig)
            if not self.surface.has_more:
                break
        if self.rig.in_force and self.rig.in_force is not before:
            if before and before.value != self.rig.in_force.value:
                KEPT.forget()  # problems of a rig that is no more; those of a surface go with it
            self._on_rig(self.rig.in_force.value)

    def plan(
        self,
        request: PlanRequest,
        model: CostModel | None = None,
        on_progress: ProgressCallback = never_stop,
        *,
        warm_start: bool = False,
        min_change: float = 0.0,
        was_asked_for: bool = True,
        stop_log: StopLog | None = None,
        limits: ResourceLimits | None = None,
        known_as: Sequence[KnownSubject] = (),
    ) -> tuple[SolvedPlan, Rig, str]:
        """Return a plan for the surfaces and the rig in force, that rig, and a reminder.

        What has been received since :meth:`digest` does not count. The reminder says which input is
        not the newest, because that was refused. With ``warm_start`` the plan starts from the last
        one, if there was one, and ``min_change`` is as
        :func:`focus_planner.core.planning.plan_focus` says. Who did not ask for the plan is told of
        no refusal, which then still waits for who does. With ``stop_log`` it is made again, as
        :func:`focus_planner.core.planning.plan_focus` says. Of several surfaces, ``known_as`` tells
        what they are called and how much they count; else they are called by topic and number.

        Raises
        ------
        NotReady
            If an input is missing, or was refused since the last call.
        InputError
            As :func:`focus_planner.core.planning.plan_focus`.
        """
        if was_asked_for:
            objections = [self.surface.objection(), self.rig.objection()]
            if any(objections):
                raise NotReady(". ".join(text for text in objections if text))
        assert self.surface.in_force is not None
        assert self.rig.in_force is not None
        rig = self.rig.in_force.value
        start = self.warm_start if warm_start else None
        plan = plan_focus(
            self.subjects(known_as),
            rig,
            request,
            model,
            on_progress,
            start,
            stop_log,
            min_change=min_change,
            limits=limits,
        )
        self.warm_start = plan.warm_start if warm_start else None
        if self.surface.lacks:
            plan = replace(plan, notes=(*plan.notes, self._fewer_subjects()))
        reminders = [self.surface.reminder(), self.rig.reminder()]
        return plan, rig, "; ".join(text for text in reminders if text)

    def subjects(self, known_as: Sequence[KnownSubject] = ()) -> list[Subject]:
        """Return the surfaces in force, the oldest first, each with a name and a weight.

        Parameters
        ----------
        known_as : sequence of KnownSubject
            Of each; by default they count the same and are called by topic and number.
        """
        accepted = self.surface.all_in_force
        if len(known_as) == len(accepted):
            return [
                Subject(each.value, known.name, known.weight)
                for each, known in zip(accepted, known_as, strict=True)
            ]
        return [
            Subject(each.value, f"{each.arrival.topic.rpartition('/')[2]} {number}")
            for number, each in enumerate(accepted, 1)
        ]

    def _fewer_subjects(self) -> Note:
        count = len(self.surface.all_in_force)
        return Note(
            "subjects",
            f"planned for {count} {'surface' if count == 1 else 'surfaces'}, all that were received"
            f" so far, of the {count + self.surface.lacks} of parameter subjects; publish the"
            " others, or lower the parameter",
        )

    def arrivals(self) -> list[Arrival[Any]]:
        """Return the messages that the next answer depends on, in the order of arrival."""
        return sorted(self.surface.arrivals() + self.rig.arrivals(), key=lambda each: each.at)

    def kept(self) -> list[Arrival[Any]]:
        """Return all messages that may matter later on."""
        return [*self.surface.kept(), *self.rig.kept()]

    def _read_rig_again(self, optics: Optics) -> None:
        """Parse the rig with other optics, which may make it invalid, or valid at last."""
        before, self._optics = self.rig.in_force, optics
        self.rig.read_again(optics)
        self._fits = self._fits and self.rig.in_force is not None
        if before is None and self.rig.in_force:
            self._accept(None, self.rig.in_force)

    def _accept(self, scene: AcceptedScene | None, rig: AcceptedRig | None) -> None:
        """Put new inputs in force, or refuse them if they do not fit and older ones do."""
        error = None
        for pair in self._pairs(scene, rig):
            misfit = _misfit(*pair)
            if misfit is None:
                self._put_in_force(*pair)
                self._fits = True
                break
            error = error or misfit
        else:
            if not self._fits:
                self._put_in_force(scene, rig)
                if error:
                    self._log.warning(f"the surface and the rig do not fit each other: {error}")
        if error:
            _refuse(self.surface, scene, error)
            _refuse(self.rig, rig, error)

    def _pairs(
        self, scene: AcceptedScene | None, rig: AcceptedRig | None
    ) -> list[tuple[AcceptedScene, AcceptedRig]]:
        """Return the pairs that include a new input, by preference."""
        if scene and rig:
            pairs = [(scene, rig), (scene, self.rig.in_force), (self.surface.in_force, rig)]
        elif scene:
            pairs = [(scene, self.rig.in_force), (scene, self.rig.misfit)]
        else:
            pairs = [(self.surface.in_force, rig), (self.surface.misfit, rig)]
        return [(a, b) for a, b in pairs if a and b]

    def _put_in_force(self, scene: AcceptedScene | None, rig: AcceptedRig | None) -> None:
        if scene and scene is not self.surface.in_force:
            self.surface.put_in_force(scene)
        if rig and rig is not self.rig.in_force:
            self.rig.put_in_force(rig)
            self._drop_misfits(rig)

    def _drop_misfits(self, rig: AcceptedRig) -> None:
        """Take older surfaces out of force that do not fit a new rig."""
        fitting = []
        for each in self.surface.older:
            error = _misfit(each, rig)
            if error is None:
                fitting.append(each)
            else:
                self._log.warning(f"the surface {each.arrival} does not fit the new rig: {error}")
        self.surface.older = fitting


def _misfit(scene: AcceptedScene, rig: AcceptedRig) -> InputError | None:
    try:
        check_fit(scene.value, rig.value)
    except InputError as error:
        return error
    except Exception as error:  # noqa: BLE001 - no message may end the node
        return internal_input_error("surface and rig", error)
    return None


def _refuse(
    slot: InputSlot[Content, Value], new: AcceptedInput[Content, Value] | None, error: InputError
) -> None:
    """Refuse a new input unless it is in force."""
    if new and new is not slot.in_force:
        slot.misfit = new
        slot.refuse(new.arrival, error)
