# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Draw the pictures of README and docs anew: ``python -m figures [PART ...]``, all by default."""

from __future__ import annotations

import sys
from importlib import import_module

from rich.console import Console

#: Modules that draw, in order; the last one takes minutes.
_PARTS = ("figures.plans", "figures.report", "figures.gallery", "benchmarks.growth")


def main() -> int:
    """Draw the parts named on the command line."""
    parts = {part.rpartition(".")[2]: part for part in _PARTS}
    chosen = sys.argv[1:] or list(parts)
    unknown = [name for name in chosen if name not in parts]
    if unknown:
        print(f"figures: expected some of {', '.join(parts)}, got {unknown[0]!r}")
        return 2
    console = Console()
    for name in chosen:
        import_module(parts[name]).run(console)
    return 0


sys.exit(main())
