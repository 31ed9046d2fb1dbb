# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A kernel that is soon compiled."""

from __future__ import annotations

from typing import Any

from focus_planner.core.kernels.compiling import Kernel


def twice(x: Any) -> Any:
    return 2 * x


def made() -> Kernel:
    """Return the kernel of :func:`twice` as another process would have it."""
    kernel = Kernel(twice, targetoptions={"nopython": True, "nogil": True})
    kernel.enable_caching()
    return kernel
