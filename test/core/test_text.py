# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from focus_planner.core.text import MAX_LINE, did_you_mean, printable, sentence

HOSTILE = {
    "a colour": ("\x1b[31mred", r"\x1b[31mred"),
    "a title of the window": ("\x1b]0;owned\x07", r"\x1b]0;owned\x07"),
    "a control of eight bits": ("\x9b2J", r"\x9b2J"),
    "a line of its own": ("a\n[INFO] ready", "a [INFO] ready"),
    "a line over this one": ("a\r \n b", "a b"),
    "an overwritten beginning": ("a\rb", "a b"),
    "a step back": ("a\x08b\x7f", r"a\x08b\x7f"),
    "a turned order": ("\u202egpj.exe\u2066", r"\u202egpj.exe\u2066"),
    "what cannot be seen": ("a\u200bb\ufeff\xad", r"a\u200bb\ufeff\xad"),
    "lines of Unicode": ("a\u2028b\u2029c\x85d", r"a\u2028b\u2029c\x85d"),
    "bytes that are no text": ("a\udcff", r"a\udcff"),
    "an end of C's": ("a\0b", r"a\x00b"),
    "characters to come": ("\U000e0041\ufffe", r"\U000e0041\ufffe"),
}


@pytest.mark.parametrize(("text", "told"), HOSTILE.values(), ids=HOSTILE)
def test_what_does_not_print_is_escaped(text, told):
    assert printable(text) == told


@pytest.mark.parametrize("text", ["", "cam_0", "Zürich 3 µm ± 2 % → ≥ 1", "漢字 😀", r"C:\dir"])
def test_what_prints_stays_as_it_is(text):
    assert printable(text) == text


def test_of_a_long_text_the_beginning_and_the_end_are_told():
    told = printable("a" + "b" * 5_000_000 + "c")
    assert len(told) <= MAX_LINE
    assert told.startswith("ab")
    assert told.endswith("bc")
    assert printable("a" * 100, 100) == "a" * 100
    assert " … " in printable("a" * 101, 100)


def test_escapes_make_it_no_longer_than_allowed():
    assert len(printable("\U000e0041" * 100, 100)) <= 100


@given(st.text(), st.integers(9, 200))
def test_any_text_becomes_one_short_line_without_controls(text, limit):
    told = printable(text, limit)
    assert len(told) <= limit
    assert told.isprintable()
    assert not any(unicodedata.category(c) in {"Cc", "Cf", "Cs", "Zl", "Zp"} for c in told)
    told.encode()


def test_a_phrase_becomes_a_sentence() -> None:
    assert sentence("nothing is told; 3 mm assumed") == "Nothing is told; 3 mm assumed."
    assert sentence("") == ""


@pytest.mark.parametrize(
    ("name", "known", "most", "told"),
    [
        ("f_nmber", ("f_number", "focal_length"), 1, "did you mean f_number?"),
        ("metod", ("method", "mode"), 1, "did you mean method?"),
        ("F-Number", ("f_number",), 1, "did you mean f_number?"),
        ("--metod", ("--method", "--mode"), 1, "did you mean --method?"),
        ("--max_focus", ("--max-focus",), 1, "did you mean --max-focus?"),
        ("Y", ("z", "y", "-z", "-y"), 1, "did you mean y?"),
        ("cam_3", ("cam_1", "cam_2"), 3, "did you mean cam_2 or cam_1?"),
        ("colour", ("width", "height"), 1, ""),
        ("anything", (), 1, ""),
    ],
)
def test_a_misspelt_name_is_told_what_it_resembles(name, known, most, told):
    assert did_you_mean(name, known, most) == told


def test_of_very_many_names_the_first_are_looked_at():
    assert did_you_mean("cam_7", (f"cam_{i}" for i in range(10**9))) == "did you mean cam_7?"
