# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command line that makes subjects."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from focus_planner import Mesh
from focus_planner.core.validation import InputError, check_choice, check_number, check_whole
from shapes.files import save
from shapes.parts import part
from shapes.plants import plant
from shapes.solids import HEIGHT
from shapes.statues import statue

#: What makes a subject of each kind, from its seed and its height.
KINDS: dict[str, Callable[[int, float], Mesh]] = {
    "parts": part,
    "statues": statue,
    "plants": plant,
}
_MOST = 2**31 - 1  # what numbers of files and seeds can be


def main(arguments: Sequence[str]) -> int:
    """Make what the arguments say; return the exit status, 2 for bad input."""
    try:
        _make(_Parser().parse_args(arguments))
    except InputError as error:
        print(f"shapes: error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"shapes: error: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    return 0


def _make(options: argparse.Namespace) -> None:
    """Write every subject, and print where it is."""
    makers = [KINDS[check_choice("KIND", kind, tuple(KINDS))] for kind in options.kinds]
    check_whole("--count", options.count, 1, _MOST)
    check_whole("--seed", options.seed, 0, _MOST)
    check_number("--height", options.height, at_least=0.001, at_most=1000)
    options.output.mkdir(parents=True, exist_ok=True)
    for make in makers:
        for seed in range(options.seed, options.seed + options.count):
            path = options.output / f"{make.__name__}_{seed:03d}.ply"
            save(make(seed, options.height), path)
            print(path, flush=True)


class _Parser(argparse.ArgumentParser):
    def __init__(self) -> None:
        super().__init__(
            prog="python -m shapes",
            allow_abbrev=False,
            description="Make subjects that are no bodies, as PLY files, metres, z up. Each is a"
            " matter of its kind, seed and height.",
        )
        names = ", ".join(KINDS)
        self.add_argument("kinds", nargs="+", metavar="KIND", help=f"one or more of {names}")
        self.add_argument("--count", type=int, default=12, metavar="N", help="of each kind (12)")
        self.add_argument(
            "--seed", type=int, default=0, metavar="S", help="of the first; others follow (0)"
        )
        self.add_argument(
            "--height",
            type=float,
            default=HEIGHT,
            metavar="M",
            help=f"metres; what would be wider than 9/16 of it is lower ({HEIGHT})",
        )
        self.add_argument("--output", type=Path, required=True, metavar="FOLDER")

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"shapes: error: {message} (see {self.prog} --help)\n")
