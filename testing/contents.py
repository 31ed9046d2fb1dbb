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
