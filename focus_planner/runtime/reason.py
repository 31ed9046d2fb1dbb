"""How a request for a plan ended, for programs."""

from enum import IntEnum


class Reason(IntEnum):
    """Why there is no plan, or not the one asked for; equal to the constants of ``PlanFocus``."""

    NONE = 0
    NOT_READY = 1
    BAD_REQUEST = 2
    BUSY = 3
    INACTIVE = 4
    CANCELLED = 5
    PREEMPTED = 6
    SHUTTING_DOWN = 7
    INTERNAL = 8
    TIME_LIMIT = 9
