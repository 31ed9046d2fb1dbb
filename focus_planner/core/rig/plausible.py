# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What lengths and apertures of lenses and rigs can be, and the unit that others are probably in.

Lenses are sold in millimetres and pixels in micrometres, while everything here is in metres. A
value is refused where nothing that takes pictures has it, and whoever wrote it is told what to
write instead.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from focus_planner.core.validation import InputError, check_number

# Below these, metres, squares and their quotients would underflow.
_SMALLEST = 1e-12
_UNITS = (("millimetres", 1e-3), ("micrometres", 1e-6))

#: No lens in air is faster than f/0.5; beyond the largest there is only a pinhole.
F_NUMBERS = (0.5, 1000.0)
# Metres: the f-number of the fastest lenses ever built times the smallest pixels.
_LEAST_BLUR = 0.7 * 5e-7
# Metres: a hyperfocal distance that may be meant, whatever the lens.
_ANY_HYPERFOCAL = 1000.0


class Length(NamedTuple):
    """What a length can be.

    Attributes
    ----------
    most : float
        The largest that is not refused, metres.
    usual : tuple of 2 floats
        The range of nearly all, metres.
    least : float
        The smallest that is not refused, metres.
    """

    most: float
    usual: tuple[float, float]
    least: float = _SMALLEST

    def check(self, argument: str, value: float) -> None:
        """Raise unless something has this length; the error names the unit it is probably in.

        Raises
        ------
        InputError
        """
        if self.least <= abs(value) <= self.most:
            return
        low, high = self.usual
        limit = f"at most {self.most:g}" if abs(value) > self.most else f"at least {self.least:g}"
        raise InputError(
            argument,
            f"metres, usually {low:g} to {high:g}, {limit}",
            f"{value:g}",
            self.other_unit(value),
        )

    def other_unit(self, value: float) -> str:
        """Return which unit a value is probably in, and what to write instead; "" if in none."""
        low, high = self.usual
        for unit, metres in _UNITS:
            if low <= abs(value) * metres <= high:
                return f"{value:g} is probably in {unit}: write {value * metres:.6g}"
        return ""


#: The longest lenses for cameras have 2 m, but for a few that were built to be the longest.
FOCAL_LENGTH = Length(2.0, (0.001, 1.0))
#: Half a pixel of the smallest, and more than the largest plates are enlarged with.
CIRCLE_OF_CONFUSION = Length(1e-3, (1e-6, 2e-4), 1e-7)
#: The nearest distance of a lens.
NEAREST_FOCUS = Length(100.0, (0.01, 20.0), 0.0)
HYPERFOCAL_DISTANCE = Length(1e7, (0.05, 1000.0))
#: Of a lens of several elements.
HIATUS = Length(1.0, (1e-4, 0.2))
#: Rings of cameras around stadiums are among the largest rigs.
RIG_SIZE = Length(200.0, (0.02, 100.0))
# Metres: no image is larger.
_LARGEST_SENSOR = 1.0


def check_focal_length(argument: str, value: Any) -> float:
    """Return a focal length, metres.

    Raises
    ------
    InputError
        If no lens has it.
    """
    return _checked(FOCAL_LENGTH, argument, value)


def check_circle(argument: str, value: Any) -> float:
    """Return a circle of confusion, metres.

    Raises
    ------
    InputError
        If no sensor has it.
    """
    return _checked(CIRCLE_OF_CONFUSION, argument, value)


def check_f_number(argument: str, value: Any) -> float:
    """Return an f-number.

    Raises
    ------
    InputError
        If no lens has it.
    """
    number = check_number(argument, value, above=0)
    low, high = F_NUMBERS
    if not low <= number <= high:
        raise InputError(
            argument,
            f"focal length over aperture diameter, {low:g} to {high:g}",
            f"{number:g}",
            f"for 1/{1 / number:g} write {1 / number:g}" if low <= 1 / number <= high else "",
        )
    return number


def check_hyperfocal(argument: str, value: Any, focal_length: float) -> float:
    """Return a hyperfocal distance, metres.

    Raises
    ------
    InputError
        If no lens of this focal length has it.
    """
    distance = check_number(argument, value)
    if distance <= focal_length:
        raise InputError(
            argument, f"a number above focal_length ({focal_length:g} m)", f"{distance:g}"
        )
    most = farthest_hyperfocal(focal_length)
    if distance > most:
        raise InputError(
            argument,
            f"metres, at most {most:.3g} with a focal length of {focal_length:g} m",
            f"{distance:g}",
            HYPERFOCAL_DISTANCE.other_unit(distance),
        )
    return distance


def farthest_hyperfocal(focal_length: float) -> float:
    """Return the largest hyperfocal distance that a lens of a focal length can have, metres."""
    physical = focal_length**2 / _LEAST_BLUR
    return min(max(physical, _ANY_HYPERFOCAL), HYPERFOCAL_DISTANCE.most)


def check_sensor(argument: str, focal_length: float, diagonal: float) -> None:
    """Raise if a long focal length makes a sensor larger than any.

    Parameters
    ----------
    argument : str
        What the focal length is called.
    focal_length, diagonal : float
        Metres; the diagonal is that of the sensor, which follows from the focal length in pixels.

    Raises
    ------
    InputError
    """
    if focal_length > 0.5 and diagonal > _LARGEST_SENSOR:
        raise InputError(
            argument,
            f"metres, such that the sensor is smaller than {_LARGEST_SENSOR:g} m",
            f"{focal_length:g}, which makes it {diagonal:.3g} m across",
            FOCAL_LENGTH.other_unit(focal_length),
        )


def _checked(length: Length, argument: str, value: Any) -> float:
    metres = check_number(argument, value, above=0)
    length.check(argument, metres)
    return metres
