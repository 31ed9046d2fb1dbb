# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

from typing import Any

import pytest

from focus_planner import (
    Camera,
    CameraIntrinsics,
    InputError,
    Lens,
    LensTable,
    cylinder_rig,
    dome_rig,
    hyperfocal_distance,
    turntable_rig,
)


@pytest.mark.parametrize(
    ("values", "argument", "remedy"),
    [
        ({"focal_length": 50}, "focal_length", "50 is probably in millimetres: write 0.05"),
        ({"focal_length": 4.74}, "focal_length", "4.74 is probably in millimetres: write 0.00474"),
        ({"focal_length": 50_000}, "focal_length", "50000 is probably in micrometres: write 0.05"),
        ({"focal_length": 1e9}, "focal_length", ""),
        ({"circle_of_confusion": 0.03}, "circle_of_confusion", "in millimetres: write 3e-05"),
        ({"circle_of_confusion": 0.0028}, "circle_of_confusion", "millimetres: write 2.8e-06"),
        ({"circle_of_confusion": 20.0}, "circle_of_confusion", "in micrometres: write 2e-05"),
        ({"circle_of_confusion": 1e-8}, "circle_of_confusion", ""),
        ({"hyperfocal_distance": 10_000}, "hyperfocal_distance", "millimetres: write 10"),
        ({"min_focus": 350}, "min_focus", "350 is probably in millimetres: write 0.35"),
        ({"focus_distances": (400, 900)}, "focus_distances (the nearest)", "write 0.4"),
        ({"hiatus": 4}, "hiatus", "4 is probably in millimetres: write 0.004"),
        ({"hiatus": -4}, "hiatus", "-4 is probably in millimetres: write -0.004"),
    ],
)
def test_a_lens_in_other_units_is_told_what_to_write(
    values: dict[str, Any], argument: str, remedy: str
) -> None:
    with pytest.raises(InputError) as caught:
        Lens(**values)
    assert caught.value.argument == f"lens.{argument}"
    assert caught.value.remedy.endswith(remedy)
    assert bool(caught.value.remedy) == bool(remedy)


@pytest.mark.parametrize(
    "values",
    [
        {"focal_length": 0.0015},
        {"focal_length": 0.5},
        {"focal_length": 2.0},
        {"circle_of_confusion": 5e-7},
        {"circle_of_confusion": 2e-4},
        {"hyperfocal_distance": 900.0},
        {"focal_length": 0.5, "hyperfocal_distance": 50_000.0},
        {"min_focus": 25.0},
        {"max_focus": 5000.0},
        {"focus_distances": (0.4, 300.0)},
    ],
)
def test_what_may_be_right_is_not_refused(values: dict[str, Any]) -> None:
    assert Lens(**values) == Lens(**values)


def test_a_table_in_millimetres_is_refused() -> None:
    with pytest.raises(InputError, match=r"^table.distances \(the nearest\): .* write 0.3$"):
        LensTable("steps", distances=(300.0, 3000.0), values=(0, 10))


@pytest.mark.parametrize(
    ("values", "argument", "remedy"),
    [
        ((50, 8, 3e-5), "lens.focal_length", "50 is probably in millimetres: write 0.05"),
        ((0.05, 8, 0.03), "lens.circle_of_confusion", "0.03 is probably in millimetres: write 3e"),
        ((0.05, 0.125, 3e-5), "lens.f_number", "for 1/8 write 8"),
        ((0.05, 2000, 3e-5), "lens.f_number", ""),
    ],
)
def test_what_a_hyperfocal_distance_is_computed_from_is_named(
    values: tuple[float, float, float], argument: str, remedy: str
) -> None:
    with pytest.raises(InputError) as caught:
        hyperfocal_distance(*values)
    assert caught.value.argument == argument
    assert caught.value.remedy.startswith(remedy)


@pytest.mark.parametrize(
    ("values", "size"), [((0.002, 8, 1e-3), "large"), ((0.05, 0.7, 2e-7), "small")]
)
def test_values_that_do_not_go_together_are_named_together(
    values: tuple[float, float, float], size: str
) -> None:
    with pytest.raises(InputError) as caught:
        hyperfocal_distance(*values)
    assert caught.value.argument == "lens.focal_length, lens.f_number, lens.circle_of_confusion"
    assert caught.value.remedy.startswith(f"the circle of confusion is probably too {size}")


def test_a_fisheye_of_a_metre_and_a_half_is_one_of_millimetres() -> None:
    # 1.55 mm and pixels of 3 µm: a sensor of 4 mm, which in metres would be 4 m.
    image = CameraIntrinsics(1280, 800, 516.0, 516.0, 640.0, 400.0)
    with pytest.raises(InputError) as caught:
        Camera("left", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), image, Lens(1.55, 10.0))
    assert caught.value.argument == "camera left: lens.focal_length"
    assert caught.value.remedy == "1.55 is probably in millimetres: write 0.00155"
    tele = CameraIntrinsics(6000, 4000, 200_000.0, 200_000.0, 3000.0, 2000.0)
    Camera("far", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), tele, Lens(1.2, 100.0))


@pytest.mark.parametrize(
    ("make", "values", "argument", "remedy"),
    [
        (cylinder_rig, {"radius": 750}, "radius", "750 is probably in millimetres: write 0.75"),
        (cylinder_rig, {"top": 1700}, "top", "1700 is probably in millimetres: write 1.7"),
        (cylinder_rig, {"bottom": -500}, "bottom", "-500 is probably in millimetres: write -0.5"),
        (dome_rig, {"radius": 1200}, "radius", "write 1.2"),
        (turntable_rig, {"height": 300}, "height", "write 0.3"),
    ],
)
def test_a_rig_in_millimetres_is_refused(
    make: Any, values: dict[str, float], argument: str, remedy: str
) -> None:
    with pytest.raises(InputError) as caught:
        make(**values)
    assert caught.value.argument == argument
    assert caught.value.remedy.endswith(remedy)
