# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A field of a request is declared once: options, parameters and messages are derived from it."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from focus_planner.cli.request_options import add_request_options, request_from_options
from focus_planner.core.planning.field_spec import (
    FieldSpec,
    documented,
    specified,
    specified_fields,
)
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.validation import InputError
from focus_planner.messages import requests
from focus_planner.messages.requests import (
    request_from_message,
    request_from_values,
    request_message_fields,
    request_to_fields,
    request_to_values,
)
from focus_planner.parameters.planner import DECLARATIONS, request_declarations
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.run import Run
from focus_planner.recording.run_writing import beginning_of
from focus_planner.recording.what_if import parse_changes, with_changes

REPOSITORY = Path(__file__).parents[2]
FIELDS = {each.name: each for each in specified_fields(PlanRequest)}
#: Of every field another value than its default.
OTHER = PlanRequest(
    *("em", 17, 5, 3, "assigned", "grid", 1.5, 2, 0.25, 9, 0.5),
    bound="tight",
    gap=0.125,
    views=3,
    images=7,
    max_mm_per_pixel=0.75,
    worst=True,
)


@documented
@dataclass(frozen=True)
class WiderRequest(PlanRequest):
    """A request with one more field.

    Notes
    -----
    It is in one line here, and nowhere else.
    """

    reach: float = specified(
        math.inf, FieldSpec("how far to go", "metres", at_least=0, unlimited=True)
    )


def parsed(words: list[str], request_type: type[PlanRequest] = PlanRequest) -> PlanRequest:
    parser = argparse.ArgumentParser()
    add_request_options(parser, request_type)
    return request_from_options(parser.parse_args(words), request_type)


def words_of(request: PlanRequest) -> list[str]:
    words = []
    for name, field in FIELDS.items():
        option, value = f"--{name.replace('_', '-')}", getattr(request, name)
        if isinstance(field.default, bool):
            words += [option] if value else []
        else:
            words += [option, str(value)]
    return words


def test_every_field_is_specified() -> None:
    assert list(FIELDS) == [each.name for each in fields(PlanRequest)]
    assert all(getattr(OTHER, name) != each.default for name, each in FIELDS.items())


def test_every_field_is_an_option() -> None:
    assert parsed([]) == PlanRequest()
    assert parsed(words_of(OTHER)) == OTHER


def test_every_field_is_a_parameter() -> None:
    declared = {each.name: each for each in DECLARATIONS}
    for name, default in request_to_values(PlanRequest()).items():
        assert declared[name].default == default
        assert type(declared[name].default) is type(default)
    values = request_to_values(OTHER)
    assert Settings.from_values(values).request == OTHER == request_from_values(values)
    assert Settings.from_values({}).request == PlanRequest()


@pytest.mark.parametrize("definition", ["msg/PlanRequest.msg", "srv/PlanFocus.srv"])
def test_every_field_that_messages_have_is_converted(definition: str) -> None:
    text = (REPOSITORY / "msg_defs" / definition).read_text(encoding="utf-8").partition("---")[0]
    lines = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    assert request_message_fields() == {name for _, name in lines}
    fields_ = request_to_fields(OTHER)
    assert fields_.keys() == request_message_fields() <= FIELDS.keys()
    read = request_from_message(SimpleNamespace(**fields_), PlanRequest())
    assert read == replace(
        PlanRequest(), **{name: getattr(OTHER, name) for name in request_message_fields()}
    )
    empty = SimpleNamespace(**{name: type(value)() for name, value in fields_.items()})
    assert request_from_message(empty, OTHER) == OTHER


def test_only_what_messages_have_is_said_to_be_overridden_by_requests() -> None:
    overridden = {
        d.name for d in request_declarations() if "Requests can override" in d.description
    }
    assert overridden == request_message_fields()


def test_one_more_line_is_one_more_option() -> None:
    assert parsed(["--reach", "2.5"], WiderRequest) == WiderRequest(reach=2.5)
    assert parsed([], WiderRequest) == WiderRequest()
    parser = argparse.ArgumentParser()
    add_request_options(parser, WiderRequest)
    told = " ".join(parser.format_help().split())
    assert "--reach METRES how far to go; 0 for no limit (default: none)" in told


def test_one_more_line_is_one_more_parameter() -> None:
    *others, reach = request_declarations(WiderRequest)
    assert tuple(others) == request_declarations()
    assert (reach.name, reach.default, reach.low, reach.high) == ("reach", 0.0, 0, 1e9)
    assert reach.description == (
        "How far to go. In metres; 0 for no limit. A change applies from the next request on."
    )


def test_one_more_line_is_converted_where_the_message_has_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    request = WiderRequest(reach=2.5)
    assert "reach" not in request_to_fields(request)
    names = request_message_fields() | {"reach"}
    monkeypatch.setattr(requests, "request_message_fields", lambda: names)
    assert request_to_fields(request)["reach"] == 2.5
    assert request_to_fields(WiderRequest())["reach"] == 0.0
    message = SimpleNamespace(**request_to_fields(request))
    assert request_from_message(message, WiderRequest()) == request


def test_one_more_line_is_checked_and_documented() -> None:
    with pytest.raises(InputError, match=r"^reach: expected a number of at least 0, got -1$"):
        WiderRequest(reach=-1.0)
    assert WiderRequest(reach=0.0).reach == math.inf
    text = WiderRequest.__doc__ or ""
    assert (
        "    reach : float, metres, default inf\n        How far to go; 0 for no limit.\n" in text
    )
    assert text.index("A request with one more field.") < text.index("Parameters")
    assert text.index("reach : float") < text.index("Notes")


def test_the_docstring_explains_every_field() -> None:
    text = PlanRequest.__doc__ or ""
    assert all(f"\n    {name} : " in text for name in FIELDS)
    assert max(map(len, text.splitlines())) <= 100


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (
            {"method": "best"},
            "method: expected one of closest, average, em, greedy, k_view, optimal, got",
        ),
        ({"samples": -1}, "samples: expected a whole number of at least 0, got -1"),
        ({"samples": 1.5}, "samples: expected a whole number of at least 0, got 1.5"),
        ({"samples": 2_000_001}, "samples: expected at most 2000000, got 2000001"),
        ({"fresh_samples": 1}, "fresh_samples: expected a whole number of at least 2, got 1"),
        ({"seed": True}, "seed: expected a whole number of at least 0, got True"),
        ({"k": 4}, "k: expected 2 or 3, got 4"),
        ({"k": True}, "k: expected 2 or 3, got True"),
        ({"k": 2.0}, "k: expected 2 or 3, got 2.0"),
        ({"time_budget": -1}, "time_budget: expected a number of at least 0, got -1"),
        ({"time_budget": math.nan}, "time_budget: expected a number of at least 0, got nan"),
        ({"shots": 17}, "shots: expected at most 16, got 17"),
        ({"images": -1}, "images: expected a whole number of at least 0, got -1"),
        ({"images": 250_001}, "images: expected at most 250000, got 250001"),
        (
            {"depth_tolerance": math.inf},
            "depth_tolerance: expected a number of at least 0, got inf",
        ),
        ({"standard_error": 0.0}, "standard_error: expected a number above 0, got 0"),
        ({"worst": 1}, "worst: expected True or False, got 1"),
        ({"gap": 2.0}, "gap: expected at most 1, the whole cost, got 2"),
        ({"gap": "small"}, "gap: expected a number of at least 0, got 'small'"),
    ],
)
def test_a_value_out_of_range_is_named(change: dict[str, object], error: str) -> None:
    with pytest.raises(InputError) as raised:
        PlanRequest(**change)  # type: ignore[arg-type]
    assert str(raised.value).startswith(error)


# --- no time limit -----------------------------------------------------------------------------


def changed(request: PlanRequest, assignment: str) -> PlanRequest:
    """Return what the replay of a request with a change asks for."""
    beginning = beginning_of("run", "/planner", request, "world", {})
    run = Run(Path(), (), beginning, (), None, "")
    assert run.beginning.request == request
    return with_changes(run, parse_changes([assignment])).run.beginning.request


@pytest.mark.parametrize("nothing", [0, 0.0, -0.0])
def test_a_time_budget_of_0_is_none_wherever_it_is_given(nothing: float) -> None:
    unlimited = PlanRequest()
    assert unlimited.time_budget == math.inf
    assert PlanRequest(time_budget=nothing) == unlimited
    assert replace(PlanRequest(time_budget=3.0), time_budget=nothing) == unlimited
    assert parsed(["--time-budget", str(nothing)]) == unlimited
    values = request_to_values(unlimited)
    assert values["time_budget"] == 0.0
    assert request_from_values(values | {"time_budget": nothing}) == unlimited
    defaults = {each.name: each.default for each in DECLARATIONS}
    assert Settings.from_values(defaults | {"time_budget": nothing}, "").request == unlimited
    assert changed(PlanRequest(time_budget=3.0), f"time_budget={nothing}") == unlimited


def test_a_message_with_0_leaves_it_to_the_parameter_and_infinity_asks_for_none() -> None:
    fields = request_to_fields(PlanRequest())
    assert fields["time_budget"] == 0.0
    for parameter in (math.inf, 3.0):
        defaults = PlanRequest(time_budget=parameter)
        assert request_from_message(SimpleNamespace(**fields), defaults) == defaults
        without = SimpleNamespace(**fields | {"time_budget": math.inf})
        assert request_from_message(without, defaults) == PlanRequest()


def test_help_says_that_0_is_no_limit() -> None:
    parser = argparse.ArgumentParser()
    add_request_options(parser)
    told = " ".join(parser.format_help().split())
    assert "left out; 0 for no limit (default: none)" in told
    assert "0 for no limit" in (PlanRequest.__doc__ or "")
