# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The gallery: a body, a machine part on a turntable, a statue in a dome."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from rich.console import Console

from figures.browser import Views, picture_report
from figures.places import GALLERY
from figures.program import focus_planner
from focus_planner import Mesh, load_surface
from focus_planner.io.bodies import body
from shapes.files import save
from shapes.gallery import gear, statue

# Pictures of textured surfaces are many times larger as PNG.
_WEBP_QUALITY = 85


@dataclass(frozen=True)
class _Exhibit:
    """A subject before a rig.

    Attributes
    ----------
    name : str
        Of its pictures.
    surface : callable
        Makes the mesh.
    rig : str
        The words that make its rig.
    camera : str
        One that autofocus fails, whose picture is shown.
    """

    name: str
    surface: Callable[[], Mesh]
    rig: str
    camera: str


def _body() -> Mesh:
    mesh = load_surface(body("arms_out"))
    assert isinstance(mesh, Mesh)
    return mesh


_EXHIBITS = (
    _Exhibit("body", _body, "cylinder", "cam_2_15"),
    _Exhibit(
        "gear",
        gear,
        "turntable --cameras 3 --stops 24 --radius 0.6 --lowest 15 --highest 65 --height 0.03"
        " --image 870x580 --fx 1450 --focal-length 0.06 --f-number 8"
        " --circle-of-confusion 2.9e-5",
        "cam_2_21",
    ),
    _Exhibit(
        "statue",
        statue,
        "dome --rings 5 --columns 20 --radius 2.9 --lowest -10 --highest 70 --height 1"
        " --image 580x870 --fx 1208 --focal-length 0.05 --f-number 2.8"
        " --circle-of-confusion 2.9e-5",
        "cam_1_13",
    ),
)


def run(console: Console) -> None:
    """Plan for every exhibit by the command line, and picture its report and a camera's view."""
    GALLERY.mkdir(exist_ok=True)
    for exhibit in _EXHIBITS:
        with TemporaryDirectory() as folder:
            _draw(exhibit, Path(folder))
        console.print(f"{exhibit.name}: drawn")


def _draw(exhibit: _Exhibit, folder: Path) -> None:
    surface, rig, runs = folder / f"{exhibit.name}.ply", folder / "rig.yaml", folder / "runs"
    save(exhibit.surface(), surface)
    rig.write_text(focus_planner("rig", *exhibit.rig.split()))
    focus_planner("plan", surface, "--rig", rig, "--record", runs, "--quiet")
    (recorded,) = runs.iterdir()
    report, preview = folder / "report.html", folder / "preview.png"
    focus_planner("report", recorded, "--no-pictures", "--output", report, "--quiet")
    picture_report(report, Views(), GALLERY / f"{exhibit.name}_report.png")
    camera = ("--camera", exhibit.camera, "--method", "closest")
    focus_planner("preview", recorded, *camera, "--output", preview, "--quiet")
    picture = Image.open(preview).convert("RGB")
    picture.save(GALLERY / f"{exhibit.name}_preview.webp", quality=_WEBP_QUALITY)
