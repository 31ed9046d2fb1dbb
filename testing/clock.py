"""A clock that tests move, so that no test depends on how fast the machine is."""

from __future__ import annotations


class Clock:
    """Stands for ``time.perf_counter``: moves when told, and by ``tick`` whenever it is read."""

    def __init__(self, tick=0.0):
        self.now = 1000.0
        self.tick = tick

    def __call__(self):
        self.now += self.tick
        return self.now


class StoppedTime:
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
