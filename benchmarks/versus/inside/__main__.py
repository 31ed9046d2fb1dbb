# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Run stages, one at a time, as lines of JSON on standard input ask.

``["stage", number, seed]`` is answered by ``[seconds, result]``, or by what went wrong as a text.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from stages import STAGES, Inputs

import focus_planner


def main() -> None:
    """Answer until there are no more questions."""
    imported = Path(focus_planner.__file__)
    if not imported.is_relative_to(os.environ["PYTHONPATH"]):
        sys.exit(f"focus_planner was imported from {imported.parent}")
    # What is printed meanwhile goes elsewhere.
    with os.fdopen(os.dup(1), "w", buffering=1) as answers, TemporaryDirectory() as folder:
        os.dup2(2, 1)
        inputs = Inputs(Path(sys.argv[1]), Path(folder))
        for line in sys.stdin:
            stage, number, seed = json.loads(line)
            print(json.dumps(_outcome(inputs, stage, number, seed)), file=answers)


def _outcome(inputs: Inputs, stage: str, number: int, seed: int) -> list[float] | str:
    try:
        seconds, result = STAGES[stage](inputs, number, seed)
    except Exception as error:  # noqa: BLE001 - whatever this revision cannot do
        return f"{type(error).__name__}: {error}"
    return [float(seconds), float(result)]


main()
