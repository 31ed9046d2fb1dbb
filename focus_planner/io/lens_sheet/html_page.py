# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A lens sheet as one HTML page that needs nothing else: for printers, tablets and phones."""

from __future__ import annotations

from html import escape

from focus_planner.io.lens_sheet.content import Cell, Column, Kind, LensSheet, Row

_LONG = 24  # characters: a longer name is broken
_STYLE = """
:root { color-scheme: light; }
body { margin: 1.2rem auto; padding: 0 1rem; max-width: 70rem; color: #111; background: #fff;
  font: 15px/1.4 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.5rem; margin: 0 0 .6rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; margin: .6rem 0; }
dt { color: #555; }
dd { margin: 0; overflow-wrap: anywhere; }
ul { margin: .6rem 0; padding: .5rem 1rem .5rem 2rem; border: 2px solid #111; }
div { overflow-x: auto; margin-top: 1rem; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .5rem; text-align: left; }
thead th { border-bottom: 2px solid #111; font-size: .85em; line-height: 1.2;
  vertical-align: bottom; background: #fff; }
thead small { display: block; font-weight: normal; color: #555; }
tbody tr { border-bottom: 1px solid #bbb; }
tbody tr:nth-child(5n) { border-bottom: 1.5px solid #555; }
.number { text-align: right; }
.box { text-align: center; }
td.number, .name { white-space: nowrap; }
.long { white-space: normal; overflow-wrap: anywhere; min-width: 9em; }
.holds { min-width: 9em; }
td.sensor { font-weight: bold; }
input { width: 1.15em; height: 1.15em; margin: 0; vertical-align: middle; }
.idle { color: #666; font-style: italic; }
.idle .name, .idle td.sensor { font-weight: normal; }
@media screen and (min-width: 60rem) {
  div { overflow-x: visible; }
  thead th { position: sticky; top: 0; }
}
@media screen and (max-width: 40rem) {
  body { font-size: 14px; margin: .6rem auto; padding: 0 .5rem; }
  h1 { font-size: 1.25rem; }
  dl { font-size: 12px; column-gap: .6rem; }
  th, td { padding: .45rem .35rem; }
  input { width: 1.5em; height: 1.5em; }
  .holds { min-width: 13em; }
}
@media print {
  @page { margin: 12mm 11mm 14mm;
    @bottom-right { content: "page " counter(page) " of " counter(pages); font: 8pt sans-serif; } }
  body { margin: 0; padding: 0; max-width: none; font-size: 8pt; line-height: 1.25; }
  h1 { font-size: 15pt; }
  div { overflow-x: visible; }
  thead { display: table-header-group; }
  tr, li { break-inside: avoid; }
  th, td { padding: 1.6pt 3pt; }
  input { width: 8pt; height: 8pt; }
  .holds { min-width: 8.5em; }
}
"""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<h1>{title}</h1>
{facts}
{notes}
{measures}
<div><table>
<thead>
<tr>{headings}</tr>
</thead>
<tbody>
{rows}
</tbody>
</table></div>
</body>
</html>
"""


def sheet_to_html(sheet: LensSheet) -> str:
    """Return the sheet as an HTML page without any link to other files.

    Boxes can be ticked on a screen as well; the browser keeps no record of them.
    """
    return _PAGE.format(
        title=escape(sheet.title),
        style=_STYLE,
        facts=_list(sheet.facts),
        notes=_notes(sheet.notes),
        measures=_list(sheet.measures),
        headings="".join(map(_heading, sheet.columns)),
        rows="\n".join(_row(sheet.columns, row) for row in sheet.rows),
    )


def _list(entries: tuple[tuple[str, str], ...]) -> str:
    lines = (f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in entries)
    return "<dl>\n" + "\n".join(lines) + "\n</dl>"


def _notes(notes: tuple[str, ...]) -> str:
    if not notes:
        return ""
    return "<ul>\n" + "\n".join(f"<li>{escape(note)}</li>" for note in notes) + "\n</ul>"


def _heading(column: Column) -> str:
    unit = f"<small>{escape(column.unit)}</small>" if column.unit else ""
    return f'<th scope="col" class="{column.kind.value}">{escape(column.heading)}{unit}</th>'


def _row(columns: tuple[Column, ...], row: Row) -> str:
    cells = "".join(_cell(column, cell) for column, cell in zip(columns, row.cells, strict=True))
    return f'<tr class="idle">{cells}</tr>' if row.idle else f"<tr>{cells}</tr>"


def _cell(column: Column, cell: Cell) -> str:
    if column.kind is Kind.BOX:
        box = f'<input type="checkbox" aria-label="{escape(column.heading)}">'
        return f'<td class="box">{box}</td>'
    if column.key == "name":
        classes = "name" if len(cell.text) <= _LONG else "name long"
        return f'<th scope="row" class="{classes}">{escape(cell.text)}</th>'
    more = {"from_sensor_m": " sensor", "holds": " holds"}.get(column.key, "")
    return f'<td class="{column.kind.value}{more}">{escape(cell.text)}</td>'
