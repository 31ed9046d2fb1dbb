# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How our programs share the cores of a machine with others."""

from __future__ import annotations

import os

_SETTINGS = {
    # Numba takes the first that it finds, and warns of a TBB that is too old, as Ubuntu's is.
    "NUMBA_THREADING_LAYER_PRIORITY": "omp tbb workqueue",
    # GNU's OpenMP: idle threads spin for some 50 µs, then sleep. Spinning longer takes cores from
    # other work on the machine; with less, threads would sleep between the batches of a plan.
    "GOMP_SPINCOUNT": "1000",
}


def share_cores() -> None:
    """Have Numba use OpenMP where there is some, and that spin little; unless the user says else.

    For programs, not for libraries: it sets variables of the environment of this process and of
    those that it starts. To be called before Numba is imported.
    """
    for name, value in _SETTINGS.items():
        os.environ.setdefault(name, value)
