# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Versions of the software and the kind of machine, which a plan's bits may depend on."""

from __future__ import annotations

import platform
import re
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_PACKAGES = ("focus_planner", "numpy", "numba", "llvmlite", "scipy", "embreex")
# Open3D has these names, and each of its wheels for some systems.
_OPEN3D = ("open3d-cpu", "open3d")
_NOT_INSTALLED = "not installed as a package"
# Instruction sets between which the ray-casting library chooses at run time.
_INSTRUCTIONS = {"sse2", "sse4_2", "avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl"}


@cache
def software() -> dict[str, str]:
    """Return the versions of the planner, Python, libraries and system, and the CPU, by name."""
    versions = {name: _version(name) or _NOT_INSTALLED for name in (*_PACKAGES, _open3d())}
    return {
        **versions,
        "python": platform.python_version(),
        "system": " ".join(filter(None, (platform.system(), *platform.libc_ver()))),
        "machine": platform.machine(),
        "processor": _processor("model name"),
        "instructions": " ".join(sorted(set(_processor("flags").split()) & _INSTRUCTIONS)),
    }


def _open3d() -> str:
    return next(filter(_version, _OPEN3D), _OPEN3D[0])


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _processor(what: str) -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:  # not Linux, and no list of instruction sets either
        return platform.processor() or "unknown"
    found = re.search(rf"^{what}\s*:\s*(.+)$", text, re.MULTILINE)
    return found.group(1) if found else "unknown"
