# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A lens sheet as PDF, on A4, for printers."""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from focus_planner.core.validation import InputError
from focus_planner.io.lens_sheet.content import Cell, Column, Kind, LensSheet

try:
    import reportlab
    from reportlab.lib import colors
    from reportlab.lib.pagesizes import A4
    from reportlab.lib.styles import ParagraphStyle
    from reportlab.lib.units import mm
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont
    from reportlab.pdfgen.canvas import Canvas
    from reportlab.platypus import Flowable, LongTable, Paragraph, SimpleDocTemplate, Spacer, Table
except ImportError as error:
    raise InputError(
        "lens sheet",
        "reportlab to write it as PDF with",
        str(error),
        "install it: pip install 'focus_planner[pdf]', or write .html and print that",
    ) from error

_MARGIN, _BELOW = 11 * mm, 15 * mm
_FRAME = 6.0  # points on either side that ReportLab's frames keep clear
_SIZE, _SMALL, _PADDING, _BOX = 8.0, 7.0, 2.8, 7.5  # points
_GREY, _LINE = colors.Color(0.35, 0.35, 0.35), colors.Color(0.7, 0.7, 0.7)
_STRIPES = 5  # rows between two lines that guide the eye
# ReportLab's own copy of Bitstream Vera, which is embedded: every reader shows it alike.
_FONT, _BOLD, _ITALIC = "Vera", "VeraBd", "VeraIt"


def sheet_to_pdf(sheet: LensSheet) -> bytes:
    """Return the sheet as the bytes of a PDF.

    The head of the table is on every page. Characters that the font does not have, of other scripts
    than Latin, become question marks; they may occur in names of files and in notes.
    """
    _register_fonts()
    # How many pages there are is known once they are laid out.
    count, _ = _laid_out(sheet, 0)
    _, content = _laid_out(sheet, count)
    return content


def _laid_out(sheet: LensSheet, count: int) -> tuple[int, bytes]:
    """Return the number of pages and the document, in which each says that there are ``count``."""
    file = io.BytesIO()
    title = _known(sheet.title)
    document = SimpleDocTemplate(
        file,
        pagesize=A4,
        title=title,
        leftMargin=_MARGIN,
        rightMargin=_MARGIN,
        topMargin=_MARGIN,
        bottomMargin=_BELOW,
    )

    def write_below(canvas: Canvas, _: Any) -> None:
        canvas.setFont(_FONT, _SMALL)
        y, left, right = _BELOW - 6 * mm, _MARGIN + _FRAME, A4[0] - _MARGIN - _FRAME
        canvas.drawString(left, y, title)
        canvas.drawRightString(right, y, f"page {canvas.getPageNumber()} of {count}")

    story = _story(sheet, document.width - 2 * _FRAME)
    document.build(story, onFirstPage=write_below, onLaterPages=write_below)
    return document.page, file.getvalue()


def _story(sheet: LensSheet, width: float) -> list[Flowable]:
    story = [
        Paragraph(escape(_known(sheet.title)), _style(15, _BOLD)),
        Spacer(0, 8),
        _entries(sheet.facts, width),
    ]
    if sheet.notes:
        story += [Spacer(0, 6), _notes(sheet.notes, width)]
    return [
        *story,
        Spacer(0, 6),
        _entries(sheet.measures, width),
        Spacer(0, 8),
        _table(sheet, width),
    ]


# --- fonts -------------------------------------------------------------------------------------


@cache
def _register_fonts() -> None:
    folder = Path(reportlab.__file__).parent / "fonts"
    for name in (_FONT, _BOLD, _ITALIC):
        pdfmetrics.registerFont(TTFont(name, str(folder / f"{name}.ttf")))


def _known(text: str) -> str:
    glyphs: Any = pdfmetrics.getFont(_FONT)
    return "".join(c if ord(c) in glyphs.face.charToGlyph else "?" for c in text)


def _style(size: float, font: str = _FONT, **more: Any) -> ParagraphStyle:
    return ParagraphStyle(
        font, fontName=font, fontSize=size, leading=1.25 * size, splitLongWords=True, **more
    )


# --- the head ----------------------------------------------------------------------------------


def _entries(entries: Sequence[tuple[str, str]], width: float) -> Table:
    grey, plain = _style(_SIZE, textColor=_GREY), _style(_SIZE)
    rows = [
        [Paragraph(escape(_known(name)), grey), Paragraph(escape(_known(text)), plain)]
        for name, text in entries
    ]
    style = [
        ("LEFTPADDING", (0, 0), (-1, -1), 0),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("TOPPADDING", (0, 0), (-1, -1), 0.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 0.5),
    ]
    return Table(rows, colWidths=[26 * mm, width - 26 * mm], style=style)


def _notes(notes: Sequence[str], width: float) -> Table:
    style = [("BOX", (0, 0), (-1, -1), 1, colors.black)]
    rows = [[Paragraph(escape(_known(note)), _style(_SIZE))] for note in notes]
    return Table(rows, colWidths=[width], style=style)


# --- the table ---------------------------------------------------------------------------------


class _Box(Flowable):
    """An empty box to tick."""

    def __init__(self) -> None:
        super().__init__()
        self.width = self.height = _BOX

    def draw(self) -> None:
        self.canv.setLineWidth(0.7)
        self.canv.rect(0, 0, _BOX, _BOX)


def _table(sheet: LensSheet, width: float) -> LongTable:
    widths = _widths(sheet, width)
    body = [
        [
            _cell(column, cell, row.idle, available)
            for column, cell, available in zip(sheet.columns, row.cells, widths, strict=True)
        ]
        for row in sheet.rows
    ]
    head = [_heading(column) for column in sheet.columns]
    return LongTable([head, *body], colWidths=widths, repeatRows=1, style=_rules(sheet))


def _rules(sheet: LensSheet) -> list[tuple[Any, ...]]:
    rules: list[tuple[Any, ...]] = [
        ("FONT", (0, 1), (-1, -1), _FONT, _SIZE),
        ("VALIGN", (0, 0), (-1, 0), "BOTTOM"),
        ("VALIGN", (0, 1), (-1, -1), "MIDDLE"),
        ("LEFTPADDING", (0, 0), (-1, -1), _PADDING),
        ("RIGHTPADDING", (0, 0), (-1, -1), _PADDING),
        ("TOPPADDING", (0, 1), (-1, -1), 2.2),
        ("BOTTOMPADDING", (0, 1), (-1, -1), 2.8),
        ("LINEBELOW", (0, 1), (-1, -1), 0.3, _LINE),
        ("LINEBELOW", (0, 0), (-1, 0), 1.2, colors.black),
    ]
    for k, column in enumerate(sheet.columns):
        alignment = {Kind.NUMBER: "RIGHT", Kind.BOX: "CENTER", Kind.TEXT: "LEFT"}[column.kind]
        rules.append(("ALIGN", (k, 0), (k, -1), alignment))
        rules.append(("FONTNAME", (k, 1), (k, -1), _font(column)))
    for k, row in enumerate(sheet.rows, 1):
        if row.idle:
            rules.append(("FONTNAME", (0, k), (-1, k), _ITALIC))
            rules.append(("TEXTCOLOR", (0, k), (-1, k), _GREY))
        if k % _STRIPES == 0:
            rules.append(("LINEBELOW", (0, k), (-1, k), 0.8, _GREY))
    return rules


def _cell(column: Column, cell: Cell, idle: bool, available: float) -> Flowable | str:
    if column.kind is Kind.BOX:
        return _Box()
    text = _known(cell.text)
    if _needed(column, text) <= available:
        return text
    font, colour = (_ITALIC, _GREY) if idle else (_font(column), colors.black)
    return Paragraph(escape(text), _style(_SIZE, font, textColor=colour))


def _heading(column: Column) -> Paragraph:
    alignment = {Kind.NUMBER: 2, Kind.BOX: 1, Kind.TEXT: 0}[column.kind]
    text = escape(_known(column.heading))
    if column.unit:
        text += f'<br/><font name="{_FONT}">{escape(_known(column.unit))}</font>'
    return Paragraph(text, _style(_SMALL, _BOLD, alignment=alignment))


def _widths(sheet: LensSheet, width: float) -> list[float]:
    """Return the columns' widths: what they need, but the longest texts are broken to fit."""
    needed = [
        max(_longest_word(column), *(_needed(column, _known(r.cells[k].text)) for r in sheet.rows))
        for k, column in enumerate(sheet.columns)
    ]
    texts = [k for k, column in enumerate(sheet.columns) if column.kind is Kind.TEXT]
    left = width - sum(needed) + sum(needed[k] for k in texts)
    for count, k in zip(
        range(len(texts), 0, -1), sorted(texts, key=needed.__getitem__), strict=True
    ):
        # The last and longest takes what is left, also where that is more than it needs.
        needed[k] = min(needed[k], left / count) if count > 1 else left
        left -= needed[k]
    return needed


def _longest_word(column: Column) -> float:
    words = f"{column.heading} {column.unit}".split()
    return max(pdfmetrics.stringWidth(_known(w), _BOLD, _SMALL) for w in words) + 2 * _PADDING


def _needed(column: Column, text: str) -> float:
    # What is idle is italic, which is no wider.
    return pdfmetrics.stringWidth(text, _font(column), _SIZE) + 2 * _PADDING + 0.5


def _font(column: Column) -> str:
    return _BOLD if column.key in ("name", "from_sensor_m") else _FONT
