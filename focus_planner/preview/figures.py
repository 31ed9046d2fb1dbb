# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Figures made of previews: one or two beside each other, and contact sheets of a whole rig."""

from __future__ import annotations

import math
from collections.abc import Sequence

from PIL import Image, ImageDraw, ImageFont

from focus_planner.core.text import printable
from focus_planner.preview.pictures import Preview

_PAPER, _INK, _FAINT = (255, 255, 255), (29, 33, 41), (107, 114, 128)
_MARGIN, _GAP = 24, 16
_LARGE, _SMALL = 22, 16  # of captions, pixels
_NARROWEST = 340  # a picture's place in a figure: room for its caption
# Of contact sheets: a picture's longest side, pixels, and how many there may be on a page.
THUMBNAIL, _PER_PAGE = 190, 240
_CELL_TEXT = 12
_SHAPE = 1.5  # width over height


def figure(panels: Sequence[Preview], footer: str = "") -> Image.Image:
    """Return previews beside each other, each with its caption, on white.

    Parameters
    ----------
    panels : sequence of Preview
        Of one camera and shot, by different methods.
    footer : str
        What to say below them, in one line or more.
    """
    pictures = [Image.fromarray(panel.image) for panel in panels]
    widths = [max(picture.width, _NARROWEST) for picture in pictures]
    width = sum(widths) + _GAP * (len(panels) - 1) + 2 * _MARGIN
    lines = _wrapped(footer, _font(_SMALL), width - 2 * _MARGIN)
    tallest = max(picture.height for picture in pictures)
    caption = 3 * (_SMALL + 8) + _LARGE
    title = _LARGE + 18
    height = _MARGIN + title + tallest + caption + (_SMALL + 6) * len(lines) + _MARGIN
    sheet = Image.new("RGB", (width, height), _PAPER)
    draw = ImageDraw.Draw(sheet)
    draw.text((_MARGIN, _MARGIN - 4), _title(panels[0]), _INK, _font(_LARGE))
    left, top = _MARGIN, _MARGIN + title
    for panel, picture, place in zip(panels, pictures, widths, strict=True):
        sheet.paste(picture, (left, top))
        below = top + picture.height + 10
        draw.text((left, below), printable(panel.method), _INK, _font(_LARGE))
        for row, text in enumerate(_facts(panel)):
            at = below + _LARGE + 8 + row * (_SMALL + 6)
            draw.text((left, at), text, _FAINT, _font(_SMALL))
        left += place + _GAP
    for row, line in enumerate(lines):
        at = height - _MARGIN - (_SMALL + 6) * (len(lines) - row)
        draw.text((_MARGIN, at), line, _FAINT, _font(_SMALL))
    return sheet


def contact_sheets(cells: Sequence[Sequence[Preview]], heading: str) -> list[Image.Image]:
    """Return pages of small previews with names and captions, row by row.

    Parameters
    ----------
    cells : sequence of sequences of Preview
        Of each camera and shot, by one method or more, in the order in which they are to appear.
    heading : str
        What to say above them.
    """
    pages = max(math.ceil(len(cells) / _PER_PAGE), 1)
    each = math.ceil(len(cells) / pages)
    return [
        _contact_sheet(
            cells[page * each : (page + 1) * each],
            heading + (f" Page {page + 1} of {pages}." if pages > 1 else ""),
        )
        for page in range(pages)
    ]


def _contact_sheet(cells: Sequence[Sequence[Preview]], heading: str) -> Image.Image:
    methods = max(len(cell) for cell in cells)
    wide = max(panel.image.shape[1] for cell in cells for panel in cell)
    high = max(panel.image.shape[0] for cell in cells for panel in cell)
    across = max(methods * wide + 2 * (methods - 1), 110)
    down = high + (2 + methods) * (_CELL_TEXT + 3) + 10
    columns = max(round(math.sqrt(len(cells) * _SHAPE * down / across)), 1)
    columns = min(columns, len(cells))
    rows = math.ceil(len(cells) / columns)
    width = max(2 * _MARGIN + columns * (across + _GAP) - _GAP, 640)
    lines = _wrapped(heading, _font(_SMALL), width - 2 * _MARGIN)
    top = _MARGIN + (_SMALL + 6) * len(lines) + 14
    sheet = Image.new("RGB", (width, top + rows * (down + 8) + _MARGIN), _PAPER)
    draw = ImageDraw.Draw(sheet)
    for row, line in enumerate(lines):
        draw.text((_MARGIN, _MARGIN + row * (_SMALL + 6)), line, _INK, _font(_SMALL))
    for number, cell in enumerate(cells):
        left = _MARGIN + number % columns * (across + _GAP)
        at = top + number // columns * (down + 8)
        for place, panel in enumerate(cell):
            picture = Image.fromarray(panel.image)
            sheet.paste(picture, (left + place * (wide + 2), at))
        text = [_title(cell[0]), *(_short_facts(panel, methods > 1) for panel in cell)]
        for row, line in enumerate(text):
            below = at + high + 5 + row * (_CELL_TEXT + 3)
            colour = _FAINT if row else _INK
            draw.text(
                (left, below), _cut(line, _font(_CELL_TEXT), across), colour, _font(_CELL_TEXT)
            )
    return sheet


def _title(panel: Preview) -> str:
    shot = f", shot {panel.shot} of {panel.shots}" if panel.shots > 1 else ""
    return f"{panel.camera}{shot}"


def _facts(panel: Preview) -> tuple[str, str]:
    share = f"{100 * panel.in_focus:.0f} % of the subject's pixels in focus"
    if math.isnan(panel.in_focus):
        share = "sees nothing of the subject"
    return f"focused at {panel.focus_distance:.3f} m", share


def _short_facts(panel: Preview, named: bool) -> str:
    method = f"{panel.method}: " if named else ""
    if math.isnan(panel.in_focus):
        return f"{method}sees nothing"
    return f"{method}{panel.focus_distance:.3f} m, {100 * panel.in_focus:.0f} % sharp"


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _wrapped(
    text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: float
) -> list[str]:
    """Return the lines of a text that is broken between words."""
    lines: list[str] = []
    for word in printable(text).split():
        if lines and font.getlength(f"{lines[-1]} {word}") <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def _cut(text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: float) -> str:
    """Return a text, its end replaced by dots if it is too long."""
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(f"{text}...") > width:
        text = text[:-1]
    return f"{text}..."
