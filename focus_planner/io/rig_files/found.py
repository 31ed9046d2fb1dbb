# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From the cameras that another program's file describes to a rig: what all imports share."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.defaults import assumed_values, keys_of
from focus_planner.core.rig.frames import Similarity
from focus_planner.core.rig.geometry import camera_positions
from focus_planner.core.rig.rig import Rig
from focus_planner.core.text import how_many
from focus_planner.core.validation import InputError, check_number, first_few
from focus_planner.io.names import camera_names, matches
from focus_planner.io.rig_files.camera_models import Closest, notes_on_approximations
from focus_planner.io.rigs import lens_from_values
from focus_planner.io.yaml_values import errors_within

_ENDING = re.compile(r"\.[A-Za-z]\w*$")


class FoundCamera(NamedTuple):
    """A camera as a file describes it.

    Attributes
    ----------
    where : str
        Its place in the file, for errors.
    path : str
        Of its image, with slashes: it is chosen by it, and named by it without the ending.
    pose : Similarity
        The optical frame in the file's frame.
    image : callable
        Returns its intrinsics; called for those that are used.
    focal_length : callable
        Returns the focal length of its lens, metres, None if the file does not tell.
    """

    where: str
    path: str
    pose: Similarity
    image: Callable[[], Closest]
    focal_length: Callable[[], float | None] = lambda: None


@dataclass(frozen=True)
class ImportOptions:
    """What a user says of a rig beside the file.

    Attributes
    ----------
    cameras : str
        A pattern for the cameras to use; all by default.
    scale : float, optional
        Metres per unit of the file's poses; 1 if nothing tells it, with a note.
    transform : Similarity, optional
        From the file's frame, scaled, to the rig's; it may scale too.
    frame_id : str
        The frame's name in the rig; by default that of the file, or ``world``.
    intrinsics_of : callable, optional
        A function from a camera's name to its intrinsics, in place of those of the file.
    size : tuple of 2 ints, optional
        Width and height, pixels, of images whose size the file does not tell.
    image_folder : Path, optional
        Where the images are that the file names; beside it by default.
    lens : mapping
        Values of all lenses, as :func:`~focus_planner.io.rigs.lens_from_values` takes them.
    """

    cameras: str = ""
    scale: float | None = None
    transform: Similarity | None = None
    frame_id: str = ""
    intrinsics_of: Callable[[str], CameraIntrinsics] | None = None
    size: tuple[int, int] | None = None
    image_folder: Path | None = None
    lens: Mapping[str, Any] = field(default_factory=dict)

    @property
    def rig_from_file(self) -> Similarity:
        """The transform from the file's frame to the rig's."""
        aligned = self.transform or Similarity()
        if self.scale is None:
            return aligned
        return aligned @ Similarity(scale=check_number("--scale", self.scale, above=0))


def rig_of_found(
    where: str,
    found: Sequence[FoundCamera],
    options: ImportOptions,
    *,
    told_by: str = "the file",
    without_unit: str = "",
    left_out: Iterable[Note] = (),
) -> tuple[Rig, list[str]]:
    """Return the rig of the cameras that are to be used, in their order.

    Parameters
    ----------
    where : str
        What lists them, for errors: ``"rig.xml: cameras"``.
    found : sequence of FoundCamera
    options : ImportOptions
    told_by : str
        What tells focal lengths, for a note.
    without_unit : str
        What has no unit of length, if it has none, as in :func:`on_unit`.
    left_out : iterable of Note
        On what else is in the file.

    Returns
    -------
    rig : Rig
    notes : list of str
        What was taken from elsewhere than the options.

    Raises
    ------
    InputError
        If none matches, two have the same name, or one cannot be represented.
    """
    chosen = [each for each in found if matches(each.path, options.cameras or "*")]
    if not chosen:
        got = f"only {first_few(each.path for each in found)}" if found else "none"
        raise InputError(where, f"some that match {options.cameras or '*'}", got)
    names = camera_names(where, [_ENDING.sub("", each.path) for each in chosen])
    rig_from_file = options.rig_from_file
    cameras, assumed = [], {}
    focal_lengths: Counter[float] = Counter()
    images = []
    for name, each in zip(names, chosen, strict=True):
        at = rig_from_file @ each.pose
        own = _lens_values(each, options)
        focal_lengths.update([own["focal_length"]] if "focal_length" in own else [])
        values = {**own, **options.lens}
        with errors_within(each.where):
            of_name = options.intrinsics_of
            image = Closest(of_name(name)) if of_name else each.image()
            lens = lens_from_values("lens", values, image.intrinsics)
            cameras.append(Camera(name, at.position, at.orientation, image.intrinsics, lens))
        images.append(image)
        assumed[name] = assumed_values(values, {}) & keys_of("lens")
    frame = options.frame_id or "world"
    rig = Rig(tuple(cameras), frame, notes=tuple(left_out), assumed=assumed)
    notes = list(notes_on_approximations(images))
    if without_unit and options.scale is None and options.transform is None:
        notes.insert(0, on_unit(rig, without_unit))
    return rig, [*notes, *_on_focal_lengths(focal_lengths, len(cameras), told_by)]


def _lens_values(found: FoundCamera, options: ImportOptions) -> dict[str, float]:
    """Return what the file tells of a lens, unless it was told otherwise."""
    length = None if "focal_length" in options.lens else found.focal_length()
    return {} if length is None else {"focal_length": length}


def _on_focal_lengths(lengths: Counter[float], cameras: int, told_by: str) -> Iterator[str]:
    if lengths:
        total = sum(lengths.values())
        listed = first_few(f"{1e3 * length:g}" for length in sorted(lengths))
        yield (
            f"focal length {listed} mm for {how_many(total, cameras)}, from {told_by};"
            " --focal-length replaces it"
        )


def left_out(why: str, names: Sequence[str], of: int, remedy: str) -> Iterator[Note]:
    """Yield a note on cameras of a file that are not in the rig, if there are any.

    Parameters
    ----------
    why : str
        As an adjective: ``"not aligned"``.
    names : sequence of str
    of : int
        How many cameras the file has.
    remedy : str
        What to do to have them, as a clause.
    """
    if names:
        told = f"left out {len(names)} of {of} cameras, {why}: {first_few(names)}"
        yield Note("left_out", f"{told}; {remedy}")


def on_unit(rig: Rig, what: str) -> str:
    """Return a note on how far a rig spans if the unit of its poses, which has no name, is metres.

    Parameters
    ----------
    rig : Rig
    what : str
        What has no unit, as the beginning of a sentence: ``"a COLMAP model has no unit"``.
    """
    if len(rig) == 1:
        return f"{what}; metres are assumed; otherwise give the metres per unit with --scale"
    places = camera_positions(rig)
    span = (places.max(axis=0) - places.min(axis=0)).max()
    return (
        f"{what}; if it is metres, the cameras span {span:.3g} m; otherwise give the metres per"
        " unit with --scale"
    )
