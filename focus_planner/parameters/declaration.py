"""One parameter: meaning, unit, range."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any


def _declare(
    name: str, default: Any, description: str, low: float = 0.0, high: float = 1e9
) -> Declaration:
    return Declaration(name, default, description, low=low, high=high, read_only=True)


_FAR = 1e9


@dataclass(frozen=True)
class Declaration:
    """One parameter; ``low`` and ``high`` bound a number that stands alone.

    ``plans`` tells whether plans depend on it.
    """

    name: str
    default: str | int | float | tuple[float, ...]
    description: str
    low: int | float = 0
    high: int | float = _FAR
    read_only: bool = False
    plans: bool = True


def _one_of(choices: Iterable[str]) -> str:
    return "One of: " + ", ".join(choices) + "."


Value = str | int | float | tuple[float, ...]
