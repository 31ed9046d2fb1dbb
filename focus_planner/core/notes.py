# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Notes: what a plan's user should know although nothing failed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Note:
    """Something noticed in the inputs, or assumed about them, that may make a plan worse.

    Attributes
    ----------
    code : str
        What kind of note it is, for programs: ``up_axis``, ``quaternion_order``,
        ``unseen_cameras``, ``winding``, ``default_lens``, ``default_image``, ``importance``,
        ``budget``, ``noise``, ``left_out``, ``tolerance``, ``resolution``, ``subjects``,
        ``held`` or ``replanned``; of an evaluation's subjects also ``unit`` and ``placement``.
    text : str
        One line for people: what was seen, what it probably means, and what to do about it.
    """

    code: str
    text: str
