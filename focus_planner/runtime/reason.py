# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
