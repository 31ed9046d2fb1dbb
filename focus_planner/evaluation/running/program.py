# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which program measures: results of one evaluation come from a single one."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from pathlib import Path

from focus_planner.recording.software import software

_PACKAGE = Path(__file__).parents[1]
# What results come from; the others only show them.
_ROOMS = ("core", "io", "evaluation")
# Machines may differ in these.
_OF_THE_MACHINE = {"system", "machine", "processor", "instructions"}


@cache
def program() -> dict[str, str]:
    """Return the versions of the planner and of what it computes with, by name.

    ``sources`` is a digest of the planner's own: two states of it may have the same version.
    """
    versions = {name: text for name, text in software().items() if name not in _OF_THE_MACHINE}
    return {
        **versions,
        "python": ".".join(platform.python_version_tuple()[:2]),
        "sources": _digest_of_sources(),
    }


def version() -> str:
    """Return the planner's version."""
    return program()["focus_planner"]


def _digest_of_sources() -> str:
    digest = hashlib.sha256()
    for path in sorted(path for room in _ROOMS for path in (_PACKAGE / room).rglob("*.py")):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
