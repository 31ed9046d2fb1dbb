"""What is in force, whether it fits, and planning on it; without ROS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan import SolvedPlan, WarmStart
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import ProgressCallback, never_stop
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Surface
from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.runtime.inputs import AcceptedInput, Arrival, Input, Log, Said, Value, internal

# Enough to tell whether a surface and a rig fit each other, too little to be noticed.
_TRIAL = PlanRequest(method="closest", samples=500)

AcceptedScene = AcceptedInput[Surface, Scene]
AcceptedRig = AcceptedInput[Rig, Rig]


def internal_error(error: Exception) -> str:
    """Return what a caller is told of what should not have happened."""
    return f"internal error: {error!r}; the planner's log has the details"


class NotReady(Exception):  # noqa: N818 - nothing went wrong here
    """There is nothing to plan with, or not what was sent last; its text is fit for the caller."""


class Planner:
    """Keeps the newest surface and rig that can be planned with, and plans.

    The newest of each replaces the one before it. One that cannot be read, or does not fit the
    other input, is refused: the last good one stays in force, and the next caller, once, is told
    so instead of being given a plan for something else. A surface and a rig that fit only each
    other replace both. Where nothing good is in force the newest is taken, fit or not, and what
    does not fit is reported to whoever wants a plan.

    All but ``surface.receive`` and ``rig.receive`` belongs to one thread.

    Parameters
    ----------
    log : Log
    on_rig : callable
        Told of every rig that comes into force.
    warm_start : WarmStart, optional
        Of a plan made elsewhere, for the first that is to start from one.

    Attributes
    ----------
    surface, rig : Input
        Where messages go in.
    warm_start : WarmStart or None
        What a plan starts from that is to start from the last one.
    """

    def __init__(
        self,
        log: Log,
        on_rig: Callable[[Rig], None] = lambda _: None,
        warm_start: WarmStart | None = None,
    ) -> None:
        self.surface: Input[Surface, Scene] = Input(
            "surface", "a mesh on ~/mesh or a cloud on ~/cloud", Scene, log
        )
        self.rig: Input[Rig, Rig] = Input(
            "rig", "poses on ~/camera_poses or a rig on ~/rig", lambda rig: rig, log
        )
        self._log = log
        self._on_rig = on_rig
        self._optics = Optics()
        self._fits = False
        self.warm_start = warm_start

    def digest(self, optics: Optics) -> None:
        """Take in what was received: read it, build the scene, see whether it fits."""
        before = self.rig.in_force
        if optics != self._optics:
            self._read_rig_again(optics)
        scene, rig = self.surface.newest(optics), self.rig.newest(optics)
        if scene or rig:
            self._settle(scene, rig)
        if self.rig.in_force and self.rig.in_force is not before:
            self._on_rig(self.rig.in_force.value)

    def plan(
        self,
        request: PlanRequest,
        optics: Optics,
        model: CostModel | None = None,
        on_progress: ProgressCallback = never_stop,
        *,
        warm_start: bool = False,
        stop_log: StopLog | None = None,
    ) -> tuple[SolvedPlan, Rig, str]:
        """Return a plan for the newest surface and rig, that rig, and what is not the newest.

        With ``warm_start`` it starts from the last one, if there was one. With ``stop_log`` it is
        made again, as :func:`focus_planner.core.planning.plan_focus` says.

        Raises
        ------
        NotReady
            If one of them is missing, or was refused since the last call.
        InputError
            As :func:`focus_planner.core.planning.plan_focus`.
        """
        self.digest(optics)
        objections = [self.surface.objection(), self.rig.objection()]
        if any(objections):
            raise NotReady(". ".join(text for text in objections if text))
        assert self.surface.in_force is not None
        assert self.rig.in_force is not None
        rig = self.rig.in_force.value
        start = self.warm_start if warm_start else None
        plan = plan_focus(
            self.surface.in_force.value, rig, request, model, on_progress, start, stop_log
        )
        self.warm_start = plan.warm_start if warm_start else None
        reminders = [self.surface.reminder(), self.rig.reminder()]
        return plan, rig, "; ".join(text for text in reminders if text)

    def arrivals(self) -> list[Arrival[Any]]:
        """Return what a plan, or the lack of one, rests on, in the order of arrival."""
        return sorted(self.surface.arrivals() + self.rig.arrivals(), key=lambda each: each.at)

    def _read_rig_again(self, optics: Optics) -> None:
        """Read the rig with other optics, with which it may no longer, or at last, be usable."""
        before, self._optics = self.rig.in_force, optics
        self.rig.read_again(optics)
        self._fits = self._fits and self.rig.in_force is not None
        if before is None and self.rig.in_force:
            self._settle(None, self.rig.in_force)

    def _settle(self, scene: AcceptedScene | None, rig: AcceptedRig | None) -> None:
        """Put newcomers in force, or refuse them if older ones fit each other and they do not."""
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
        """Return the pairs that newcomers can make, the one to prefer first."""
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


def _misfit(scene: AcceptedScene, rig: AcceptedRig) -> InputError | None:
    try:
        formulate_problem(scene.value, rig.value, _TRIAL)
    except InputError as error:
        return error
    except Exception as error:  # noqa: BLE001 - whatever came, the node goes on
        return internal("surface and rig", error)
    return None


def _refuse(
    where: Input[Said, Value], newcomer: AcceptedInput[Said, Value] | None, error: InputError
) -> None:
    """Refuse a newcomer that did not come into force."""
    if newcomer and newcomer is not where.in_force:
        where.misfit = newcomer
        where.refuse(newcomer.arrival, error)
