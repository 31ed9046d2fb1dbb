# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A managed node: transitions one at a time, impossible ones refused, failures logged."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rclpy._rclpy_pybind11 import RCLError
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from focus_planner.core.validation import InputError
from focus_planner.ros.base_node import OwnNode
from focus_planner.runtime.log import log_exception

_INITIAL, _FINAL = "unconfigured", "finalized"


class ManagedNode(OwnNode, LifecycleNode):
    """A managed node, as the ROS 2 design of managed nodes describes it.

    A subclass overrides :meth:`configure`, :meth:`activate`, :meth:`deactivate` and
    :meth:`clean_up`. A transition fails, and the reason is logged, if one of them raises
    ``InputError`` or ``OSError``; any other exception leads to the state errorprocessing, from
    which the node returns to unconfigured.

    Parameters
    ----------
    name : str
    **options
        Those of :class:`rclpy.node.Node`.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self._transition = threading.Lock()
        self._refuse_impossible_transitions()

    def configure(self) -> bool:
        """Create what the node serves; return False if that was interrupted."""
        return True

    def activate(self) -> None:
        """Begin to work."""

    def deactivate(self) -> None:
        """Stop working; also called on shutdown."""

    def clean_up(self) -> None:
        """Undo :meth:`configure`; also called after an unexpected error."""

    @property
    def state(self) -> str:
        """Label of the current state, such as ``"inactive"``."""
        label: str = self._state_machine.current_state[1]
        return label

    @property
    def is_finalized(self) -> bool:
        """Whether it has been shut down."""
        return self.state == _FINAL

    def start_up(self) -> bool:
        """Configure and activate, unless somebody else has begun to; return False on failure."""
        done = TransitionCallbackReturn.SUCCESS
        with self._transition:
            if self.state != _INITIAL:
                return True
            return self.trigger_configure() is done and self.trigger_activate() is done

    def shut_down(self) -> None:
        """Go to the final state."""
        with self._transition:
            if not self.is_finalized:
                self.trigger_shutdown()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call :meth:`configure`."""
        return self._make_transition(self.configure, super().on_configure, state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call :meth:`activate`."""
        return self._make_transition(self.activate, super().on_activate, state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call :meth:`deactivate`."""
        return self._make_transition(self.deactivate, super().on_deactivate, state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call :meth:`clean_up`."""
        return self._make_transition(self.clean_up, super().on_cleanup, state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call :meth:`deactivate`."""
        return self._make_transition(self.deactivate, super().on_shutdown, state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call :meth:`clean_up`."""
        return self._make_transition(self.clean_up, super().on_error, state)

    def _make_transition(
        self,
        step: Callable[[], bool | None],
        base: Callable[[LifecycleState], TransitionCallbackReturn],
        state: LifecycleState,
    ) -> TransitionCallbackReturn:
        """Take a step, then do what rclpy does; log errors, which rclpy swallows."""
        try:
            return TransitionCallbackReturn.FAILURE if step() is False else base(state)
        except (InputError, OSError) as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        except Exception:  # noqa: BLE001 - the state errorprocessing is for these
            log_exception(self.get_logger())
            return TransitionCallbackReturn.ERROR

    def _refuse_impossible_transitions(self) -> None:
        """Answer ``change_state`` in every state: where it is impossible rclpy only raises."""
        change_state = self._service_change_state.callback

        def guarded(request: Any, response: Any) -> Any:
            response.success = False
            if not self._transition.acquire(blocking=False):
                self.get_logger().warning("refused a transition: another one is in progress")
                return response
            try:
                return change_state(request, response)
            except RCLError:
                transition = request.transition
                what = transition.label or f"number {transition.id}"
                self.get_logger().warning(
                    f"refused the transition {what}: not possible in state {self.state}"
                )
                return response
            finally:
                self._transition.release()

        self._service_change_state.callback = guarded
