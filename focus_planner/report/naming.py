# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where a report can be written."""

from __future__ import annotations

from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.io.files import check_writable

_SUFFIX = ".html"


def check_report(path: Path) -> None:
    """Raise unless a report can be written at ``path``; called before the work, not after it.

    Raises
    ------
    InputError
        If its name does not end in ``.html``, or it cannot be written.
    """
    if path.suffix.lower() != _SUFFIX:
        raise InputError(
            str(path), f"a name that ends in {_SUFFIX} for the report", path.suffix or "no ending"
        )
    check_writable(path)
