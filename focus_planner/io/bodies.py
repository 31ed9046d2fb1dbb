"""The human bodies that come with the package; see ``focus_planner/bodies/README.md``."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from focus_planner.core.validation import check_choice


def bodies() -> tuple[Path, ...]:
    """Return the paths of all bodies, sorted by name."""
    folder = Path(str(resources.files("focus_planner") / "bodies"))
    return tuple(sorted(folder.glob("*.ply")))


def body(name: str) -> Path:
    """Return the path of a body's mesh.

    Parameters
    ----------
    name : {"arms_down", "arms_out", "arms_raised"}

    Raises
    ------
    InputError
        If there is no such body.
    """
    paths = {path.stem: path for path in bodies()}
    return paths[check_choice("body", name, tuple(paths))]
