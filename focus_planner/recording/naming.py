"""The names of runs, which are those of their folders and their plans."""

from __future__ import annotations

import re
from datetime import datetime, timezone
from uuid import uuid4

#: What all of them match.
RUN_NAME = re.compile(r"\d{8}T\d{6}\.\d{6}Z-[0-9a-f]{8}")


def new_run_id() -> str:
    """Return a name that no other run has, and that sorts by time."""
    return f"{datetime.now(timezone.utc):%Y%m%dT%H%M%S.%fZ}-{uuid4().hex[:8]}"
