"""How long a caller waits for the live node, in another process."""

from __future__ import annotations
