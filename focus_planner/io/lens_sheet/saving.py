# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Writing lens sheets in the format that a file's name asks for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.io.files import atomic_write
from focus_planner.io.lens_sheet import SUFFIXES
from focus_planner.io.lens_sheet.content import LensSheet
from focus_planner.io.lens_sheet.csv_text import sheet_to_csv
from focus_planner.io.lens_sheet.html_page import sheet_to_html


def save_lens_sheet(sheet: LensSheet, path: Path) -> None:
    """Write a lens sheet atomically, as CSV, HTML or PDF by the end of the file's name.

    Raises
    ------
    InputError
        As :func:`sheet_writer`, or if the file cannot be written.
    """
    content = sheet_writer(path)(sheet)
    with atomic_write(path) as file:
        file.write(content)


def sheet_writer(path: Path) -> Callable[[LensSheet], bytes]:
    """Return what makes a file of this name of a sheet.

    Raises
    ------
    InputError
        If the name ends otherwise, or a library that the format needs is missing.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return lambda sheet: sheet_to_csv(sheet).encode()
    if suffix == ".html":
        return lambda sheet: sheet_to_html(sheet).encode()
    if suffix == ".pdf":
        from focus_planner.io.lens_sheet.pdf_pages import (  # noqa: PLC0415 - needs an extra
            sheet_to_pdf,
        )

        return sheet_to_pdf
    raise InputError(str(path), f"a name that ends in {', '.join(SUFFIXES)}", repr(path.suffix))
