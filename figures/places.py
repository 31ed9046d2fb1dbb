"""Where pictures are kept."""

from __future__ import annotations

from pathlib import Path

#: The folder of the pages and of the pictures that they show.
DOCS = Path(__file__).parents[1] / "docs"
#: Of the pictures of the gallery.
GALLERY = DOCS / "gallery"
