# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What follows from a rig alone is found once: a rig does not change."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from focus_planner.core.rig.rig import Rig

Found = TypeVar("Found")


def remembered(find: Callable[[Rig], Found]) -> Callable[[Rig], Found]:
    """Keep with the rig what is found of it; whoever gets it must not change it."""
    name = f"{find.__module__}.{find.__qualname__}"

    @wraps(find)
    def remembering(rig: Rig) -> Found:
        if name not in rig.__dict__:
            rig.__dict__[name] = find(rig)
        found: Found = rig.__dict__[name]
        return found

    return remembering
