# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Repeat Table 1 of the paper.

python examples/table1.py DATA [SAMPLES [JUDGED]]

DATA is a folder of meshes; the paper's are those of 3DBodyTex.
"""

from __future__ import annotations

import sys
from pathlib import Path

from focus_planner.evaluation import EXPERIMENTS, Conditions, evaluate, find_sources


def main(data: str, samples: str = "1000", judged: str = "65536") -> None:
    """Print what the methods cost, by subject and in all."""
    table1 = EXPERIMENTS["table1"]
    sources = find_sources(Path(data)).sources
    results = evaluate(table1, sources, Conditions(int(samples), int(judged)))
    print(results.rows.pivot_table("cost", "subject", "method", sort=False).round(1))
    print(table1.write_up(results).text)


if __name__ == "__main__":
    main(*sys.argv[1:])
