# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Everything that an object holds, as text to compare to the bit."""

from __future__ import annotations

import dataclasses
from typing import Any


def in_full(value: Any) -> str:
    """All compared fields of dataclasses, in depth, with all digits; -0.0 is not 0.0."""
    if dataclasses.is_dataclass(value):
        fields = [field.name for field in dataclasses.fields(value) if field.compare]
        parts = (f"{name}={in_full(getattr(value, name))}" for name in fields)
        return f"{type(value).__name__}({', '.join(parts)})"
    if isinstance(value, (tuple, list)):
        return f"[{', '.join(map(in_full, value))}]"
    return repr(value)
