# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A lens sheet as CSV, for spreadsheets and programs."""

from __future__ import annotations

import csv
import io

from focus_planner.io.lens_sheet.content import CAPTURE, LensSheet, Value

# What formulas begin with in spreadsheets, also in those of East Asia.
_FORMULAS = ("=", "+", "-", "@", "＝", "＋", "－", "＠")


def sheet_to_csv(sheet: LensSheet) -> str:
    """Return the table as CSV: a line of names with units, then one line per row of the sheet.

    After its columns come those that only programs need: ``picture``, ``take`` and the pose
    (:data:`~focus_planner.io.lens_sheet.content.CAPTURE`). Numbers have all their digits; an
    infinite distance is ``inf``, and what is unknown is empty, as are the boxes to tick. A text
    that a spreadsheet would take for a formula has an apostrophe before it; only the names of a
    driver's unit and of the frame can be one.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow([*(column.key for column in sheet.columns), *CAPTURE])
    writer.writerows(
        [_no_formula(value) for value in (*(cell.value for cell in row.cells), *row.capture)]
        for row in sheet.rows
    )
    return text.getvalue()


def _no_formula(value: Value) -> Value:
    is_formula = isinstance(value, str) and value.lstrip().startswith(_FORMULAS)
    return f"'{value}" if is_formula else value
