# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Attacks on the node, from this machine's loopback only; the node has to hold.

``python -m benchmarks attacks`` carries out all of them, ``attacks.race`` one kind.
"""

from __future__ import annotations

from importlib import import_module

from rich.console import Console

# From what is recorded and read to who may do what.
_KINDS = (
    "race",
    "disk",
    "recovery",
    "loaders",
    "crowding",
    "claims",
    "exposure",
    "lifecycle",
    "drivers",
    "protocol",
)


def run(console: Console) -> bool:
    """Print the tables; return whether all attacks held."""
    kinds = [import_module(f"benchmarks.attacks.{kind}") for kind in _KINDS]
    held = [kind.run(console) for kind in kinds]
    return all(held)
