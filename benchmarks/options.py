# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command line of the benchmarks."""

from __future__ import annotations

import argparse
import os
from functools import cache


@cache
def options() -> argparse.Namespace:
    """Return what the command line says."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", allow_abbrev=False)
    parser.add_argument("names", nargs="*", metavar="NAME", help="parts; by default the usual ones")
    parser.add_argument(
        "--count",
        type=int,
        default=int(os.environ.get("MESSAGES", "10000")),
        help="with fuzz: how many of each kind (default: %(default)s)",
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="with fuzz and soak: of what is random (default: 1)"
    )
    parser.add_argument(
        "--minutes", type=float, help="with soak (default: 15) and live (default: 1)"
    )
    parser.add_argument(
        "--rev",
        default=os.environ.get("REV", ""),
        help="with versus: the revision to compare with (default: REV)",
    )
    parser.add_argument(
        "--rounds", type=int, help="with versus: turns of each stage (default: 9, 5 of long ones)"
    )
    parser.add_argument(
        "--samples",
        type=int,
        nargs="+",
        metavar="N",
        help="with versus (default: 1000 65536) and peers (1000 8192)",
    )
    parser.add_argument(
        "--seconds", type=float, default=30.0, help="with peers, of each (default: %(default)g)"
    )
    return parser.parse_args()
