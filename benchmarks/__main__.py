"""``python -m benchmarks [name ...]``; by default all but those that take minutes.

The usual ones are ``speed``, ``memory``, ``service``, ``recording``, ``quality`` and ``clouds``;
the long ones ``optimum``, ``deadlines``, ``warm``, ``growth``, ``scale`` and ``cancelling``.
"""

from __future__ import annotations

import sys
from importlib import import_module

from rich.console import Console

_USUAL = ("speed", "memory", "service", "recording", "quality", "clouds")
_LONG = ("optimum", "deadlines", "warm", "growth", "scale", "cancelling")


def main() -> int:
    """Run the benchmarks named on the command line."""
    chosen = sys.argv[1:] or _USUAL
    unknown = [name for name in chosen if name not in _USUAL + _LONG]
    if unknown:
        print(f"benchmarks: expected some of {', '.join(_USUAL + _LONG)}, got {unknown[0]!r}")
        return 2
    console = Console(width=None if sys.stdout.isatty() else 160)
    for name in chosen:
        import_module(f"benchmarks.{name}").run(console)
    return 0


sys.exit(main())
