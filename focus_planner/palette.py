# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Colours that mean the same wherever a plan is shown."""

from __future__ import annotations

#: Red, green, blue, 0 to 255.
Colour = tuple[int, int, int]

#: Of what is sharp in the picture that images it best, blurred there, and seen by no camera. The
#: blue is darker than the orange: they are told apart without colour vision too.
SHARP: Colour = (0x2C, 0x6F, 0xB5)
BLURRED: Colour = (0xF4, 0xB4, 0x5C)
UNSEEN: Colour = (0x9A, 0xA3, 0xAB)
