"""The program of simulated lenses."""

from __future__ import annotations

import sys

from focus_planner.runtime.stop_signals import StopSignals


def main(args: list[str] | None = None) -> int:
    """Run the lenses until SIGINT or SIGTERM; return the status the process is to end with."""
    signals = StopSignals()
    from focus_planner.ros.simulated_driver import run_nodes  # noqa: PLC0415 - takes a second

    return run_nodes(signals, args)


if __name__ == "__main__":
    sys.exit(main())
