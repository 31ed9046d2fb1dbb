# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``python -m benchmarks.fuzz.worker``: runs ``focus_planner`` again and again.

Each line on stdin is a JSON list of arguments; each line on stdout what came of it.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import traceback

from focus_planner.cli.main import main


def _run(argv: list[str]) -> dict[str, object]:
    out, err = io.StringIO(), io.StringIO()
    raised = ""
    status: int | None = None
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main(argv)
        except BaseException:  # noqa: BLE001 - whatever it is, it is what is looked for
            raised = traceback.format_exc()
    return {"status": status, "out": out.getvalue(), "err": err.getvalue(), "raised": raised}


if __name__ == "__main__":
    # What commands print, from C too, must not come between the answers.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        print(json.dumps(_run(json.loads(line))), file=answers, flush=True)
