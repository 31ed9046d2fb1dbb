"""A lens sheet as CSV, for spreadsheets and programs."""

from __future__ import annotations

import csv
import io

from focus_planner.io.lens_sheet.content import LensSheet


def sheet_to_csv(sheet: LensSheet) -> str:
    """Return the table as CSV: a line of names with units, then one line per row of the sheet.

    Numbers have all their digits; an infinite distance is ``inf``, and what is unknown is empty,
    as are the boxes to tick.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow([column.key for column in sheet.columns])
    writer.writerows([cell.value for cell in row.cells] for row in sheet.rows)
    return text.getvalue()
