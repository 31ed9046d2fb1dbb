"""``python -m benchmarks [speed] [memory] [service] [quality] [clouds]``; all by default."""

from __future__ import annotations

import sys
from importlib import import_module

from rich.console import Console

_ALL = ("speed", "memory", "service", "quality", "clouds")


def main() -> int:
    """Run the benchmarks named on the command line."""
    chosen = sys.argv[1:] or _ALL
    unknown = [name for name in chosen if name not in _ALL]
    if unknown:
        print(f"benchmarks: expected some of {', '.join(_ALL)}, got {unknown[0]!r}")
        return 2
    console = Console(width=None if sys.stdout.isatty() else 160)
    for name in chosen:
        import_module(f"benchmarks.{name}").run(console)
    return 0


sys.exit(main())
