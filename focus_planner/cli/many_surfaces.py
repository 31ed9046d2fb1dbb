# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Several surfaces of one command: their options, what they are called, and files of presets."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.option_rules import check_beside
from focus_planner.core.validation import InputError, first_few

if TYPE_CHECKING:
    from focus_planner.core.planning.subjects import Subject
    from focus_planner.runtime.inputs import KnownSubject

#: Stands for stdout, which has no number.
STDOUT = Path("-")


def add_subject_options(plan: Any) -> None:
    """Add the surfaces, and the options on several."""
    option = plan.add_argument
    option(
        "surfaces",
        type=Path,
        nargs="+",
        metavar="SURFACE",
        help="mesh or point-cloud file, in metres; several are subjects of one plan, each alone in"
        " front of the rig",
    )
    option(
        "--subject-weights",
        type=_weights,
        metavar="W,W,...",
        help="how much each SURFACE counts in the mean over several (default: all the same)",
    )
    option(
        "--presets",
        type=int,
        default=1,
        metavar="P",
        help="make so many plans, and find which SURFACE takes which; their files are numbered,"
        " plan_1.json, plan_2.json (default: 1)",
    )


def _weights(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"expected numbers with commas between, got {text!r}"
        ) from None


def names_of(options: argparse.Namespace) -> list[str]:
    """Return what the surfaces are called."""
    from focus_planner.cli.tables import path_names

    return path_names(options.surfaces)


def known_subjects(subjects: Sequence[Subject]) -> tuple[KnownSubject, ...]:
    """Return what a record tells of each of several subjects."""
    from focus_planner.runtime.inputs import KnownSubject

    if len(subjects) == 1:
        return ()
    return tuple(
        KnownSubject(each.name, each.weight, each.scene.surface.notes) for each in subjects
    )


def check_subjects(options: argparse.Namespace) -> None:
    """Raise unless the options fit the number of surfaces."""
    from focus_planner.core.planning.request import MAX_SUBJECTS

    count, names = len(options.surfaces), names_of(options)
    if count > MAX_SUBJECTS:
        raise InputError("SURFACE", f"at most {MAX_SUBJECTS}", str(count))
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise InputError("SURFACE", "a file of its own for each subject", f"{twice} twice")
    if count == 1:
        _check_one(options)
    if not 1 <= options.presets <= count:
        raise InputError("--presets", f"1 to {count}, one per SURFACE", str(options.presets))
    if options.presets > 1 and options.worst:
        raise InputError("--presets", "plans for the mean of those that take them", "--worst")
    weights = options.subject_weights
    if weights is not None and len(weights) != count:
        raise InputError("--subject-weights", f"a number for each of {count}", f"{len(weights)}")
    if weights is not None and options.worst:
        raise InputError(
            "--subject-weights",
            "a plan for the mean over all subjects",
            "--worst, which is for the one that costs most",
            "leave one of them out",
        )
    if options.importance is not None and count > 1:
        raise InputError(
            "--importance",
            "one SURFACE, to whose vertices or points it belongs",
            f"{count} of them",
            "have each bring its own, as its property importance or --importance-property",
        )
    if options.subject is not None and options.subject not in names:
        raise InputError("--subject", f"one of {first_few(names)}", repr(options.subject))
    check_beside(options, "--subject", "--picture", "--report")


def _check_one(options: argparse.Namespace) -> None:
    """Raise if an option is given that has no effect on one surface."""
    only_for_several = {
        "--worst": options.worst,
        "--subject-weights": options.subject_weights,
        "--subject": options.subject,
    }
    for option, given in only_for_several.items():
        if given:
            raise InputError(option, "several SURFACEs with it", "one")


def numbered(path: Path, number: int) -> Path:
    """Return ``plan_1.json`` for ``plan.json``."""
    return path if path == STDOUT else path.with_name(f"{path.stem}_{number}{path.suffix}")


def of_preset(options: argparse.Namespace, number: int, surfaces: list[Path]) -> argparse.Namespace:
    """Return the options of a preset: its surfaces, and its number in the names of files."""
    of_it = argparse.Namespace(**vars(options))
    of_it.surfaces = surfaces
    of_it.output = [numbered(path, number) for path in options.output]
    for option in ("problem", "picture", "report"):
        path = getattr(options, option)
        setattr(of_it, option, None if path is None else numbered(path, number))
    return of_it
