# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Copyright headers and the files beside them, as ``ament_copyright`` takes them.

That program is on no index. Its rules were read in the source of version 0.17.1, Jazzy's: which
files it looks at, where it looks for the notice, and that white space makes no difference. Beyond
them, a header here is the first thing in its file.
"""

from __future__ import annotations

import re

import pytest

from testing.pages import ROOT

SUFFIXES = {".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp", ".hxx", ".cmake", ".py"}
# What builds, environments and programs leave in a clone.
NO_SOURCE = {"build", "demo_output", "dist", "install", "log", "node_modules"}
# What has to stand before everything else.
FIRST = re.compile(r"(?:#!.*\n|# -\*- coding.*\n|# PYTHON_ARGCOMPLETE_OK\n)*")
NOTICE = re.compile(r"Copyright \d{4}(?:-\d{4})?(?:, \d{4}(?:-\d{4})?)* (?P<holder>\S.*)")
LICENCE = (ROOT / "LICENSE").read_text("utf-8")


def plain(text):
    return " ".join(text.split())


# What the licence says at its end to put into files, and what contributors agree to.
BOILERPLATE = plain(LICENCE[LICENCE.rindex("Licensed under the Apache License") :])
SUBMISSION = plain(LICENCE[LICENCE.index("5. Submission of") : LICENCE.index("6. Trademarks.")])


def sources(folder=ROOT):
    for path in sorted(folder.iterdir()):
        if path.name.startswith((".", "_")) and path.is_dir():
            continue
        if path.is_dir() and path.name not in NO_SOURCE and not path.name.endswith(".egg-info"):
            yield from sources(path)
        elif path.suffix in SUFFIXES and path.stat().st_size:
            yield path


def header_of(text):
    """Return the comment with which a file begins, without its signs."""
    lines = text[FIRST.match(text).end() :].splitlines()
    end = next((n for n, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return "\n".join(line[2:] for line in lines[:end])


def has_header(text):
    notice, _, terms = header_of(text).partition("\n")
    return NOTICE.fullmatch(notice) is not None and plain(terms) == BOILERPLATE


def test_every_source_begins_with_its_header():
    found = list(sources())
    assert len(found) > 600
    assert [path for path in found if not has_header(path.read_text("utf-8"))] == []


def test_all_headers_name_the_same_holder():
    holders = {NOTICE.match(header_of(path.read_text("utf-8")))["holder"] for path in sources()}
    assert holders == {"focus_planner developers"}


GOOD = "# Copyright 2026 A\n#\n" + "".join(f"# {word}\n" for word in BOILERPLATE.split())


@pytest.mark.parametrize(
    ("text", "accepted"),
    [
        (GOOD, True),
        (f"#!/usr/bin/env python3\n{GOOD}\nimport os\n", True),
        (f"# PYTHON_ARGCOMPLETE_OK\n{GOOD}", True),
        (GOOD.replace("2026", "2024-2026, 2028"), True),
        (GOOD.replace("2026 ", ""), False),
        (GOOD.replace("# implied.\n", ""), False),
        (f'"""A module."""\n{GOOD}', False),
        ("import os\n", False),
    ],
)
def test_a_header_is_a_notice_and_the_terms(text, accepted):
    assert has_header(text) is accepted


def test_contributors_are_told_what_they_agree_to():
    contributing = plain((ROOT / "CONTRIBUTING.md").read_text("utf-8"))
    assert SUBMISSION in contributing
    assert (
        "Any contribution that you make to this repository will be under the Apache 2 License, as"
        " dictated by that [license](http://www.apache.org/licenses/LICENSE-2.0.html): ~~~ 5."
    ) in contributing
