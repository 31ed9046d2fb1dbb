# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Compare methods and apertures on one surface and rig.

python examples/compare_methods.py SURFACE RIG.YAML
"""

from __future__ import annotations

import sys
from dataclasses import replace

from focus_planner import (
    PlanRequest,
    Rig,
    Scene,
    hyperfocal_distance,
    load_rig,
    load_surface,
    plan_focus,
)

METHODS = ("closest", "em", "k_view")
F_NUMBERS = (4, 8, 16)
CIRCLE_OF_CONFUSION = 20e-6  # metres on the sensor that still count as sharp


def at_aperture(rig: Rig, f_number: float) -> Rig:
    """Return the rig with all lenses at another aperture."""
    cameras = []
    for camera in rig.cameras:
        distance = hyperfocal_distance(camera.lens.focal_length, f_number, CIRCLE_OF_CONFUSION)
        cameras.append(replace(camera, lens=replace(camera.lens, hyperfocal_distance=distance)))
    return replace(rig, cameras=tuple(cameras))


def main(surface: str, rig_file: str) -> None:
    """Print the part of the visible surface that is in focus, by aperture and method."""
    scene, rig = Scene(load_surface(surface)), load_rig(rig_file)
    print("in focus  " + "".join(f"{method:>10}" for method in METHODS))
    for f_number in F_NUMBERS:
        rig_at = at_aperture(rig, f_number)
        plans = [plan_focus(scene, rig_at, PlanRequest(method, samples=2048)) for method in METHODS]
        shares = (f"{plan.in_focus_area / plan.covered_area:>10.0%}" for plan in plans)
        print(f"f/{f_number:<8}" + "".join(shares))


if __name__ == "__main__":
    main(*sys.argv[1:])
