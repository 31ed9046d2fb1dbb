# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Names of runs, which are also those of their folders and the ids of their plans."""

from __future__ import annotations

import re
from datetime import datetime, timezone
from uuid import uuid4

#: The pattern of all names.
RUN_NAME = re.compile(r"\d{8}T\d{6}\.\d{6}Z-[0-9a-f]{8}")
#: Ends the name of a folder whose run is not whole.
PARTIAL = ".partial"
#: What its MCAP file is, for errors.
A_RUN = "a recorded run (an MCAP file)"
#: The file of a run beside its MCAP file.
METADATA = "metadata.yaml"


def new_run_id() -> str:
    """Return a unique name; names sort by time."""
    return f"{datetime.now(timezone.utc):%Y%m%dT%H%M%S.%fZ}-{uuid4().hex[:8]}"


def mcap_name(run: str) -> str:
    """Return the name of a run's MCAP file."""
    return f"{run}_0.mcap"
