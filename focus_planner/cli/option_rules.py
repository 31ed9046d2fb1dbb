# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Options that have an effect only beside others."""

from __future__ import annotations

import argparse

from focus_planner.core.validation import InputError


def check_beside(options: argparse.Namespace, option: str, *others: str) -> None:
    """Raise if an option is given, and none of those without which it has no effect.

    Parameters
    ----------
    options : argparse.Namespace
        What was given; without the option it is None.
    option, *others : str
        As the help has them: ``--markers``, ``SURFACE``.

    Raises
    ------
    InputError
    """
    given = _value(options, option) is not None
    if given and not any(_value(options, other) not in (None, False, []) for other in others):
        raise InputError(option, f"{' or '.join(others)} with it", "none")


def _value(options: argparse.Namespace, option: str) -> object:
    return getattr(options, option.removeprefix("--").replace("-", "_").lower())
