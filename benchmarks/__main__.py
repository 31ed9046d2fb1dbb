# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``python -m benchmarks [name ...]``; by default all but those that take minutes.

Those that take minutes are in ``_LONG``: of these, ``peers`` compares with other solvers and
``versus`` with the revision that ``REV`` names, and ``report`` takes Chromium.
``load``, ``endurance``, ``fuzz``, ``faults``, ``limits``, ``attacks`` and ``soak`` test the node's
guarantees under load, faults and attacks; the exit status is 1 if one is violated. Of ``fuzz`` and
``attacks`` there are parts, such as ``fuzz.requests`` and ``attacks.race``.
"""

from __future__ import annotations

import sys
from importlib import import_module

from rich.console import Console

from benchmarks.options import options
from focus_planner.runtime.cores import share_cores

_DEFAULT = (
    "speed",
    "rays",
    "memory",
    "start",
    "service",
    "recording",
    "quality",
    "clouds",
)
_LONG = (
    "optimum",
    "proof",
    "deadlines",
    "start_plans",
    "warm",
    "growth",
    "scale",
    "large",
    "cancelling",
    "many_lenses",
    "live",
    "tolerance",
    "subjects",
    "views",
    "budget",
    "preview",
    "evaluation",
    "peers",
    "versus",
    "report",
)
_GUARANTEES = ("load", "endurance", "fuzz", "faults", "limits", "attacks", "soak")
_ALL = _DEFAULT + _LONG + _GUARANTEES


def main() -> int:
    """Run the benchmarks named on the command line."""
    chosen = options().names or _DEFAULT
    unknown = [name for name in chosen if name.partition(".")[0] not in _ALL]
    if unknown:
        print(f"benchmarks: expected some of {', '.join(_ALL)}, got {unknown[0]!r}")
        return 2
    share_cores()  # as nodes and commands do
    console = Console(width=None if sys.stdout.isatty() else 160)
    outcomes = [import_module(f"benchmarks.{name}").run(console) for name in chosen]
    return 1 if False in outcomes else 0


sys.exit(main())
