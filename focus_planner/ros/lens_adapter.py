"""The lens adapter's program."""

from __future__ import annotations

import sys

from focus_planner.runtime.stop_signals import StopSignals


def main(args: list[str] | None = None) -> int:
    """Run the adapter until SIGINT or SIGTERM; return the status the process is to end with."""
    signals = StopSignals()
    from focus_planner.ros.lens_adapter_node import run_node  # noqa: PLC0415 - takes a second

    return run_node(signals, args)


if __name__ == "__main__":
    sys.exit(main())
