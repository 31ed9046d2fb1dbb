# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random calls in batches, and the same good plan after each of them."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from benchmarks.attacks.victim import Victim, victim
from benchmarks.guarantees import Outcome
from benchmarks.options import options

_BATCH = 200
# MiB, after the first quarter.
_MOST_GROWTH = 32.0
#: What an answer counts as that no call may get.
LOST, INTERNAL = "unanswered", "internal error"

Fire = Callable[[Victim, np.random.Generator, int], Counter[str]]


def campaign(what: str, folder: Path, fire: Fire, **parameters: object) -> Outcome:
    """Have random calls made of a node, batch by batch, and check its plan in between.

    Parameters
    ----------
    what : str
    folder : Path
        Where the node is started.
    fire : callable
        Makes so many calls, waits for all answers, and counts them by what they say.
    parameters
        Those of the node.
    """
    count, random = options().count, np.random.default_rng(options().seed)
    answers: Counter[str] = Counter()
    memory, began = [], time.perf_counter()
    with victim(folder, clean=False, **parameters) as one:
        one.check_plan()
        for size in batches(count):
            answers += fire(one, random, size)
            one.put_inputs()
            one.check_plan()
            memory.append(one.node.memory)
        lines, faults = len(one.node.log.splitlines()), one.faults
    growth = memory[-1] - memory[len(memory) // 4]
    told = ", ".join(f"{number:,} {name}" for name, number in answers.most_common())
    said = f": {faults[0][-160:]}" if faults else ""
    result = (
        f"{told}; the same plan after each of {len(memory)} batches; {len(faults)} faults in"
        f" {lines:,} lines logged{said}; memory {memory[-1]:.0f} MiB, {growth:+.1f} after the first"
        f" quarter; {(time.perf_counter() - began) / count * 1000:.1f} ms each"
    )
    held = not answers[LOST] and not answers[INTERNAL] and answers.total() == count
    return Outcome(what, count, result, held and not faults and growth < _MOST_GROWTH)


def batches(count: int) -> Iterable[int]:
    """Yield the sizes of batches of so many calls."""
    return (min(_BATCH, count - start) for start in range(0, count, _BATCH))
