"""Names of runs, which are also those of their folders and the ids of their plans."""

from __future__ import annotations

import re
from datetime import datetime, timezone
from uuid import uuid4

#: The pattern of all names.
RUN_NAME = re.compile(r"\d{8}T\d{6}\.\d{6}Z-[0-9a-f]{8}")


def new_run_id() -> str:
    """Return a unique name; names sort by time."""
    return f"{datetime.now(timezone.utc):%Y%m%dT%H%M%S.%fZ}-{uuid4().hex[:8]}"
