"""A clock that stands still until a test moves it."""

from __future__ import annotations


class StoppedClock:
    """Stands in for the module ``time``."""

    def __init__(self, now=1000.0):
        self.now = now
        self.slept = []

    def monotonic(self):
        return self.now

    perf_counter = monotonic

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds

    def advance(self, seconds):
        self.now += seconds
