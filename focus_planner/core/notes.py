"""Notes: what a plan's user should know although nothing failed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Note:
    """Something noticed in the inputs, or assumed about them, that may make a plan worse.

    Attributes
    ----------
    code : str
        What kind of note it is, for programs: ``up_axis``, ``quaternion_order``,
        ``unseen_cameras``, ``winding``, ``default_lens``, ``default_image``, ``importance``,
        ``budget``, ``noise`` or ``left_out``.
    text : str
        One line for people: what was seen, what it probably means, and what to do about it.
    """

    code: str
    text: str
