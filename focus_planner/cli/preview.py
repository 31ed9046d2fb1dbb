# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner preview``: what each camera will see, with its blur."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.compiling import compile_first
from focus_planner.cli.option_rules import check_beside
from focus_planner.cli.progress import Tell, show_progress, show_share, shown
from focus_planner.cli.subjects import add_subject_options, load_subject
from focus_planner.cli.terminal import show_note
from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import InputError, check_choice
from focus_planner.io.endings import PIXELS, check_ending, ending_of, is_named_picture, one_of

if TYPE_CHECKING:
    from PIL.Image import Image

    from focus_planner.core.imaging.exposure import PictureCamera
    from focus_planner.core.planning.plan import FocusPlan
    from focus_planner.core.planning.subject import PlannedSubject
    from focus_planner.preview.pictures import Preview


def add(commands: Any) -> None:
    """Add the command."""
    preview = commands.add_parser(
        "preview",
        help="show what each camera will see, with its blur",
        description="Write pictures of what cameras will see, with the blur that focus distance and"
        " aperture give every pixel. Prints the names of the files.",
    )
    preview.set_defaults(command=run)
    add_subject_options(preview)
    option = preview.add_argument
    option(
        "--camera",
        action="append",
        default=[],
        metavar="NAME",
        help="write this camera's picture; may be repeated",
    )
    option(
        "--all",
        action="store_true",
        help="write a contact sheet of all cameras, in the order in which one walks past them; with"
        " --output DIR the single pictures as well",
    )
    option(
        "--method",
        metavar="METHOD",
        help="show beside it what the camera sees in this method's plan, which is made anew",
    )
    option(
        *("-o", "--output"),
        type=Path,
        metavar="FILE.PNG|DIR",
        help="file of the one picture (.png, .jpg or .tif), or folder of several (default: the"
        " folder one is in)",
    )
    option(
        "--scale",
        type=float,
        metavar="S",
        help="of single pictures' sides; those of a contact sheet have their own size (default:"
        " 1, the camera's resolution)",
    )
    option("--quiet", action="store_true", help="show no progress")


def run(options: argparse.Namespace) -> int:
    """Write the pictures; return the exit status."""
    if not options.camera and not options.all:
        raise InputError("preview", "--camera NAME, or --all", "neither")
    if options.all and not (options.camera or (options.output and not _is_file(options.output))):
        # A contact sheet alone.
        check_beside(options, "--scale", "--camera")
    options.scale = 1.0 if options.scale is None else options.scale
    if not (0 < options.scale <= 1):
        raise InputError("--scale", "a number above 0, at most 1", f"{options.scale:g}")
    # First of all, so that nobody waits to learn what to install.
    from focus_planner.core.planning.request import METHODS
    from focus_planner.preview.pictures import note_on_circles

    if options.method is not None:
        check_choice("--method", options.method, METHODS)
    _check_output(options.output)
    with shown(options.quiet) as tell:
        named = load_subject(options, tell)
        chosen = _chosen(named.subject, options.camera)
        for path in _written(options, named.subject, chosen, tell):
            print(path)
    note = note_on_circles(named.subject.rig)
    if note:
        show_note(note)
    return 0


def _is_file(output: Path | None) -> bool:
    return output is not None and ending_of(output) in PIXELS


def _check_output(output: Path | None) -> None:
    """Raise if nothing can be written there; make nothing."""
    from focus_planner.io.files import check_folder_writable, check_writable, is_folder, is_there

    if output is None:
        check_folder_writable(Path())
    elif _is_file(output):
        check_ending("--output", output, PIXELS)
        check_writable(output)
    elif (is_there(output) or is_named_picture(output)) and not is_folder(output):
        raise InputError(
            "--output", f"a name that ends in {one_of(PIXELS)}, or a folder", str(output)
        )
    else:
        check_folder_writable(output)


def _chosen(subject: PlannedSubject, names: Sequence[str]) -> list[int]:
    """Return the indices of the named cameras."""
    known = {camera.name: index for index, camera in enumerate(subject.rig.cameras)}
    for name in names:
        if name not in known:
            raise InputError(
                "--camera",
                f"one of the {len(known)} cameras of the rig",
                repr(name),
                did_you_mean(name, known, 3) or f"they are named like {next(iter(known))}",
            )
        if not subject.plan.cameras[known[name]].shots:
            raise InputError(
                "--camera",
                "a camera that takes a picture",
                repr(name),
                f"the plan takes {subject.plan.pictures} pictures, none of them with it",
            )
    return [known[name] for name in dict.fromkeys(names)]


def _written(
    options: argparse.Namespace, subject: PlannedSubject, chosen: list[int], tell: Tell
) -> Iterator[Path]:
    """Write the pictures, and yield where each is."""
    from focus_planner.core.imaging.exposure import PictureCamera
    from focus_planner.core.planning.work import DEPTHS, PICTURES
    from focus_planner.core.rig.walk import walking_order

    pictures = sum(len(subject.plan.cameras[c].shots) for c in chosen)
    if _is_file(options.output) and not options.all and pictures > 1:
        raise InputError(
            "--output",
            f"a folder for {pictures} pictures",
            str(options.output),
            f"leave out {options.output.suffix}",
        )
    plans: list[FocusPlan] = [subject.plan]
    if options.method is not None:
        tell(f"planning with {options.method}")
        plans.insert(0, subject.with_method(options.method, show_progress(tell)))
    compile_first(tell, (DEPTHS, PICTURES))
    tell("preparing the pictures")
    view = PictureCamera(subject.scene)
    if options.all:
        yield from _write_sheets(options, subject, plans, view, tell)
        walk = walking_order(subject.rig).tolist()
        chosen = walk if options.output is not None and not _is_file(options.output) else chosen
    show = show_share(tell, "drawing pictures")
    for number, index in enumerate(chosen):
        show(number / len(chosen))
        yield from _write_figures(options, subject, plans, view, index)


def _write_figures(
    options: argparse.Namespace,
    subject: PlannedSubject,
    plans: list[FocusPlan],
    view: PictureCamera,
    index: int,
) -> Iterator[Path]:
    """Write one camera's pictures, one per shot: bare, or beside another method's with captions."""
    from PIL import Image

    from focus_planner.core.text import sentence
    from focus_planner.preview.figures import figure
    from focus_planner.preview.pictures import note_on_circles

    for panels in _panels(subject, plans, view, index, options.scale):
        picture = (
            Image.fromarray(panels[0].image)
            if len(panels) == 1
            else figure(panels, sentence(note_on_circles(subject.rig)))
        )
        last = panels[-1]
        name = last.camera + (f"_shot_{last.shot}" if last.shots > 1 else "")
        if len(panels) > 1:
            name += f"_{panels[0].method}_{last.method}"
        alone = _is_file(options.output) and not options.all
        path = options.output if alone else (_folder(options) / f"{name}.png")
        yield _save(picture, path)


def _write_sheets(
    options: argparse.Namespace,
    subject: PlannedSubject,
    plans: list[FocusPlan],
    view: PictureCamera,
    tell: Tell,
) -> Iterator[Path]:
    """Write the contact sheet, in pages if there are many cameras."""
    from focus_planner.core.rig.walk import walking_order
    from focus_planner.core.text import sentence
    from focus_planner.preview.figures import THUMBNAIL, contact_sheets
    from focus_planner.preview.pictures import fitting_scale, note_on_circles

    cells = []
    show = show_share(tell, "drawing the contact sheet")
    for number, index in enumerate(walking_order(subject.rig).tolist()):
        show(number / len(subject.rig))
        scale = fitting_scale(subject.rig.cameras[index], THUMBNAIL)
        cells += list(_panels(subject, plans, view, index, scale))
    methods = " and ".join(plan.method for plan in plans)
    whole, shown = len(subject.rig), len({cell[0].camera for cell in cells})
    which = str(whole) if shown == whole else f"{shown} of {whole}"
    heading = f"What {which} cameras will see, focused by {methods}."
    note = sentence(note_on_circles(subject.rig))
    sheets = contact_sheets(cells, f"{heading} {note}".strip())
    base = options.output if _is_file(options.output) else _folder(options) / "contact_sheet.png"
    for page, sheet in enumerate(sheets, 1):
        path = base.with_stem(f"{base.stem}_{page}") if len(sheets) > 1 else base
        yield _save(sheet, path)


def _panels(
    subject: PlannedSubject,
    plans: list[FocusPlan],
    view: PictureCamera,
    index: int,
    scale: float,
) -> Iterator[tuple[Preview, ...]]:
    """Yield, for each shot of a camera, its picture by each of the plans that take it."""
    from itertools import zip_longest

    from focus_planner.preview.pictures import previews

    camera = subject.rig.cameras[index]
    of_plans = (previews(view, camera, plan, index, scale) for plan in plans)
    for of_shot in zip_longest(*of_plans):
        yield tuple(panel for panel in of_shot if panel is not None)


def _folder(options: argparse.Namespace) -> Path:
    if options.output is None:
        return Path()
    folder: Path = options.output.parent if _is_file(options.output) else options.output
    return folder


def _save(picture: Image, path: Path) -> Path:
    from focus_planner.io.files import atomic_write, made_folder

    made_folder(path.parent)
    kind, how = PIXELS[ending_of(path)]
    with atomic_write(path) as file:
        picture.save(file, kind, **how)
    return path
