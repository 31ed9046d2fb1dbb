"""Colours that mean the same wherever a plan is shown."""

from __future__ import annotations

#: Red, green, blue, 0 to 255.
Colour = tuple[int, int, int]

#: Of what is sharp in the picture that images it best, blurred there, and seen by no camera. The
#: blue is darker than the orange: they are told apart without colour vision too.
SHARP: Colour = (0x2C, 0x6F, 0xB5)
BLURRED: Colour = (0xF4, 0xB4, 0x5C)
UNSEEN: Colour = (0x9A, 0xA3, 0xAB)
