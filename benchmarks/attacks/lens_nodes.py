# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lens adapters and simulated lenses in processes of their own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from benchmarks.attacks.victim import kill, until
from testing.ros.lens_processes import LensProcess

_START = 90.0


class LensNode(LensProcess):
    """A lens node that shares nothing with others."""

    def _start(self, module: str, arguments: list[str], **how: Any) -> None:
        super()._start(module, arguments, **{**how, "forked": False})

    @property
    def is_alive(self) -> bool:
        return not self.has_ended()


def _is_ready(node: LensNode) -> bool:
    return "ready" in node.log or not node.is_alive


@contextmanager
def running_lenses(*nodes: LensNode, may_end: bool = False) -> Iterator[None]:
    """Wait until they are ready; kill them in the end."""
    try:
        for node in nodes:
            until(
                lambda node=node: "ready" in node.log or node.has_ended(),
                "it was never ready",
                _START,
            )
            assert node.is_alive, f"it ended: {node.log[-300:]}"
        yield
        for node in nodes:
            # Whoever asked a node to end has waited for that.
            assert node.is_alive or may_end, f"it ended by itself: {node.log[-300:]}"
    finally:
        for node in nodes:
            kill(node)
