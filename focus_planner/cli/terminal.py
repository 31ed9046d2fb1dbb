# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lines on stderr; stdout is for results.

What is in them may come from files and peers: each is one line, printable and cut.
"""

from __future__ import annotations

import sys

from focus_planner.core.text import printable


def show_note(text: str) -> None:
    """Print a note."""
    print("focus_planner: note:", printable(text), file=sys.stderr)


def show_error(text: str) -> None:
    """Print an error."""
    print("focus_planner: error:", printable(" ".join(text.split())), file=sys.stderr)
