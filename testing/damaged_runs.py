# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reads runs with damaged messages and definitions, whose checksums are right, in limited memory.

Its argument is a folder to write them to.
"""

from __future__ import annotations

import random
import resource
import sys
from dataclasses import replace
from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import definition_of
from focus_planner.recording.bag import BagWriter
from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.run_reading import read_run
from testing import made_up_runs
from testing.made_up_runs import PLANNER, run_id

# Address space that a process may take besides what it has when it begins.
ROOM = 1200 * 2**20
MUTANTS = 200


def mutants(count=MUTANTS, seed=1):
    """Runs with damaged messages and definitions, whose checksums are right."""
    chance = random.Random(seed)
    messages = made_up_runs.messages()
    for _ in range(count):
        changed = list(messages)
        for _ in range(chance.randint(1, 3)):
            k = chance.randrange(len(changed))
            message = changed[k]
            kind = chance.randrange(3)
            if kind == 0:
                payload = mutated(chance, message.payload)
                changed[k] = replace(message, payload=payload)
            elif kind == 1:
                text = message.definition or definition_of(message.type_name)
                damaged = mutated(chance, text.encode()).decode(errors="ignore") or " "
                changed[k] = replace(message, definition=damaged)
            else:
                changed[k] = chance.choice(messages)
        yield changed


def mutated(chance, data):
    """Some bytes of the data changed, to those that sizes and numbers are sensitive to."""
    data = bytearray(data)
    for _ in range(chance.randint(1, 6)):
        at = chance.randrange(len(data)) if data else 0
        data[at : at + 1] = chance.choice([b"\xff", b"\x00", b"\x7f", b"[9999999]", b"\x80", b""])
    return bytes(data)


def read_all(directory):
    """Read mutants in limited memory; print what became of them."""
    used = (
        int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[0])
        * resource.getpagesize()
    )
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, used + ROOM))
    outcomes = {"read": 0, "refused": 0}
    for messages in mutants():
        folder = directory / run_id(2)
        bag = BagWriter()
        for message in messages:
            bag.add(message)
        bag.open(folder)
        bag.close()
        try:
            read_run(folder)
            outcomes["read"] += 1
        except InputError:
            outcomes["refused"] += 1
        last_plan(directory, PLANNER)
        for file in folder.iterdir():
            file.unlink()
        folder.rmdir()
    print(sum(outcomes.values()), min(outcomes.values()) > 0)


if __name__ == "__main__":
    read_all(Path(sys.argv[1]))
