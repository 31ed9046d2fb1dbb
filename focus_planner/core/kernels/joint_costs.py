# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a sample costs for every set of a tuple's cameras that hold it.

With several views the sum of a sample's least costs counts, and two shots of one view count once.
"""

from __future__ import annotations

from focus_planner.core.kernels.compiling import kernel


@kernel
def held_outside(m, first, last, members, views, cell):
    """Return whether a shot of member m's view outside the tuple is at one of these cells."""
    view = views.number[members[m]]
    for shot in range(views.offsets[view], views.offsets[view + 1]):
        outside = first <= cell[shot] <= last
        for c in members:
            outside &= c != shot
        if outside:
            return True
    return False


@kernel
def costs_of_two(own, sums, values, costs):
    """Fill what a sample costs for every set of two members that hold it.

    ``own`` (k,) are the members' views and ``values`` (k, 2) what they cost out of focus and in it.
    The sum of the least costs of several views, the members' and those beside them (``sums``), is
    the least over which of the members' are taken.
    """
    apart = own[0] != own[1]
    for held in range(4):
        a, b = values[0, held & 1], values[1, held >> 1]
        least = min(sums[0], min(a, b) + sums[1])
        if apart:
            least = min(least, a + b + sums[2])
        costs[held] = least


@kernel
def costs_of_three(own, sums, values, costs):
    """Fill the same for every set of three members."""
    apart = own[0] != own[1], own[0] != own[2], own[1] != own[2]
    for held in range(8):
        a, b, c = values[0, held & 1], values[1, (held >> 1) & 1], values[2, held >> 2]
        least = min(sums[0], min(a, b, c) + sums[1])
        if apart[0]:
            least = min(least, a + b + sums[2])
        if apart[1]:
            least = min(least, a + c + sums[2])
        if apart[2]:
            least = min(least, b + c + sums[2])
        if apart[0] and apart[1] and apart[2]:
            least = min(least, a + b + c + sums[3])
        costs[held] = least
