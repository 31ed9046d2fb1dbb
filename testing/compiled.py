# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Kernels compiled before any test waits for them."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from focus_planner.core import kernels
from focus_planner.core.planning.precompile import precompile


def compile_kernels() -> None:
    """Compile, or load, all that plans run.

    It takes minutes where nothing is compiled yet: no test's timeout is to contain them, and of
    several processes that begin at once one compiles, and the others load.
    """
    folder = os.open(Path(kernels.__path__[0]), os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        precompile()
    finally:
        os.close(folder)
