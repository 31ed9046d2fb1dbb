# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Make human bodies to evaluate the planner on.

    python data/make_bodies.py --count 400 --seed 1 --output FOLDER

writes ``body_000.ply`` … ``body_399.ply``: adults who stand in a rig and face −y, in metres, z up,
feet at z = 0, centred on the z axis. It takes the Anny body model, in an environment of its own, as
``data/README.md`` says. A body depends on the seed and its number, whatever the count.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import mean, pstdev
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from body_model import Body

ANNY = "0.6.2"


class BodiesError(Exception):
    """What keeps bodies from being made, and what to do."""


def main(arguments: list[str] | None = None) -> int:
    """Make bodies as the command line asks; return the exit status, 2 if none can be made."""
    options = parser().parse_args(arguments)
    paths = [options.output / name for name in names(options.count)]
    try:
        check_folder(options.output)
        check_model()
        make(paths, options.seed)
    except BodiesError as error:
        print(f"make_bodies.py: error: {error}", file=sys.stderr)
        return 2
    return 0


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="make_bodies.py", description="Make human bodies to evaluate the planner on."
    )
    made.add_argument("--count", type=_at_least(1), required=True, help="how many")
    made.add_argument("--seed", type=_at_least(0), default=0, help="which (default: 0)")
    made.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="where to")
    return made


def _at_least(least: int) -> Callable[[str], int]:
    def integer(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            wanted = f"expected an integer of at least {least}, got '{text}'"
            raise argparse.ArgumentTypeError(wanted)
        return int(text)

    return integer


def names(count: int) -> list[str]:
    """Return the names of files, with as many digits as they need to sort, three at least."""
    digits = max(3, len(str(count - 1)))
    return [f"body_{k:0{digits}}.ply" for k in range(count)]


def check_folder(folder: Path) -> None:
    """Check that a folder is new or empty: nothing is overwritten, and no two sets are mixed.

    Raises
    ------
    BodiesError
        If it is a file, or holds anything.
    """
    if folder.exists() and not folder.is_dir():
        raise BodiesError(f"--output: expected a folder, got the file {folder}")
    if folder.exists() and any(folder.iterdir()):
        raise BodiesError(f"--output: expected a new or empty folder, got {folder}, which is not")


def check_model() -> None:
    """Check that the body model is there, in the version that bodies are made with.

    Raises
    ------
    BodiesError
        If it is missing, or another version.
    """
    try:
        found = version("anny")
    except PackageNotFoundError:
        raise BodiesError(
            f"the Anny body model is missing: pip install anny=={ANNY} "
            "in an environment of its own, see data/README.md"
        ) from None
    if found != ANNY:
        raise BodiesError(f"expected version {ANNY} of anny, got {found}: pip install anny=={ANNY}")


def make(paths: list[Path], seed: int) -> None:
    """Draw as many bodies as there are paths, write each, and tell of them."""
    print("Loading the body model, which takes minutes the first time …", flush=True)
    from body_model import Model, generator

    model = Model()
    paths[0].parent.mkdir(parents=True, exist_ok=True)
    bodies = []
    for k, path in enumerate(paths):
        body = model.draw(generator(seed, k))
        write(body, path)
        bodies.append((body.stature, body.area))
        print(f"{path.name}  {body.pose:10}  {body.stature:.2f} m  {body.area:.2f} m²", flush=True)
    print(f"{len(bodies)} bodies in {paths[0].parent}: {summary(bodies)}")


def write(body: Body, path: Path) -> None:
    """Write a body as binary PLY; a file of the name is complete."""
    part = path.with_suffix(".part")
    part.write_bytes(body.ply())
    part.rename(path)


def summary(bodies: list[tuple[float, float]]) -> str:
    """Return the mean and the standard deviation of statures and areas, in words."""
    statures, areas = zip(*bodies, strict=True)
    return (
        f"stature {mean(statures):.2f} ± {pstdev(statures):.2f} m, "
        f"surface area {mean(areas):.2f} ± {pstdev(areas):.2f} m²"
    )


if __name__ == "__main__":
    sys.exit(main())
