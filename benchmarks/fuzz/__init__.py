# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is random or damaged, many times each: the node and the command line go on.

``python -m benchmarks fuzz --count 10000`` does all of it, ``fuzz.requests`` one kind.
"""

from __future__ import annotations

from importlib import import_module

from rich.console import Console

_KINDS = ("topics", "requests", "goals", "parameters", "orders", "runs", "files")


def run(console: Console) -> bool:
    """Print the tables; return whether all guarantees held."""
    kinds = [import_module(f"benchmarks.fuzz.{kind}") for kind in _KINDS]
    held = [kind.run(console) for kind in kinds]
    return all(held)
