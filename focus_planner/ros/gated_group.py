"""A gate before callbacks."""

from __future__ import annotations

from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup


class GatedCallbackGroup(ReentrantCallbackGroup):
    """Executes callbacks only while it is open; messages and calls wait in the middleware."""

    is_open = False

    def can_execute(self, entity: Any) -> bool:
        """Return whether a callback may run now."""
        return self.is_open and bool(super().can_execute(entity))
