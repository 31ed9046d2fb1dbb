# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Ray casting by the Embree that comes with the package embreex.

That package's own functions cast one ray after the other and hold Python's lock, so only its
library is taken: Embree's functions are called here (https://www.embree.org, API 4).
"""

from __future__ import annotations

import ctypes
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from threading import Lock
from typing import Any
from weakref import finalize

import numpy as np
from numba import config, types
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import IntArray

# Without it Numba takes no functions as arguments.
import_module("numba.experimental.function_type")

# Constants of Embree's headers.
_TRIANGLES, _INDICES, _VERTICES = 0, 0, 1
_UINT3, _FLOAT3 = 0x5003, 0x9003
_ROBUST = 4
_OUT_OF_MEMORY = 4
# From so many rays on, threads are worth their while.
_PAIRS_PER_RAY = 50

_POINTER, _NUMBER, _SIZE = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t
_SIGNATURES: dict[str, tuple[Any, list[Any]]] = {
    "rtcNewDevice": (_POINTER, [ctypes.c_char_p]),
    "rtcGetDeviceError": (_NUMBER, [_POINTER]),
    "rtcNewScene": (_POINTER, [_POINTER]),
    "rtcSetSceneFlags": (None, [_POINTER, _NUMBER]),
    "rtcCommitScene": (None, [_POINTER]),
    "rtcReleaseScene": (None, [_POINTER]),
    "rtcNewGeometry": (_POINTER, [_POINTER, _NUMBER]),
    "rtcSetNewGeometryBuffer": (_POINTER, [_POINTER, *[_NUMBER] * 3, _SIZE, _SIZE]),
    "rtcCommitGeometry": (None, [_POINTER]),
    "rtcAttachGeometry": (_NUMBER, [_POINTER, _POINTER]),
    "rtcReleaseGeometry": (None, [_POINTER]),
    "rtcOccluded1": (None, [_POINTER] * 3),
    "rtcIntersect1": (None, [_POINTER] * 3),
}


def has_embree() -> bool:
    """Return whether the library is there, and this processor can run it."""
    return _library() is not None and _device() is not None


class EmbreeRays:
    """A ray-casting structure of Embree's; see :class:`~.ray_casting.RayCaster`.

    Parameters
    ----------
    vertices : (V, 3) array of float32
    triangles : (T, 3) array of uint32
    """

    def __init__(self, vertices: NDArray[np.float32], triangles: NDArray[np.uint32]) -> None:
        self._mesh: tuple[NDArray[np.float32], NDArray[np.uint32]] | None = vertices, triangles
        self._building = Lock()
        self._scene = 0

    def occluded(self, rays: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return whether something blocks each ray between its origin and its end."""
        hidden = np.empty(len(rays), dtype=np.bool_)
        with kernels.threads_for(_PAIRS_PER_RAY * len(rays)):
            kernels.occluded(_cast("rtcOccluded1"), self._built(), rays, hidden)
        return hidden

    def first_hits(
        self, rays: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], IntArray, NDArray[np.float32]]:
        """Return the distance, the triangle and the normal of what each ray hits first."""
        distance = np.empty(len(rays), dtype=np.float32)
        triangle = np.empty(len(rays), dtype=np.int32)
        normal = np.empty((len(rays), 3), dtype=np.float32)
        with kernels.threads_for(_PAIRS_PER_RAY * len(rays)):
            cast = _cast("rtcIntersect1")
            kernels.first_hits(cast, self._built(), rays, distance, triangle, normal)
        return distance, triangle, normal

    def _built(self) -> int:
        with self._building:
            if self._mesh is not None:
                self._scene = _scene_of(*self._mesh)
                finalize(self, _embree().rtcReleaseScene, self._scene).atexit = False
                self._mesh = None
        return self._scene


def _scene_of(vertices: NDArray[np.float32], triangles: NDArray[np.uint32]) -> int:
    """Return a scene with a copy of a mesh."""
    embree, device = _embree(), _device()
    geometry = embree.rtcNewGeometry(device, _TRIANGLES)
    buffers = ((_VERTICES, _FLOAT3, vertices), (_INDICES, _UINT3, triangles))
    for kind, layout, values in buffers:
        size = values.strides[0]
        room = embree.rtcSetNewGeometryBuffer(geometry, kind, 0, layout, size, len(values))
        if not room:
            embree.rtcReleaseGeometry(geometry)
            embree.rtcGetDeviceError(device)  # so that the next scene is not told of it
            raise MemoryError
        ctypes.memmove(room, values.ctypes.data, values.nbytes)
    embree.rtcCommitGeometry(geometry)
    scene = embree.rtcNewScene(device)
    embree.rtcSetSceneFlags(scene, _ROBUST)
    embree.rtcAttachGeometry(scene, geometry)
    embree.rtcReleaseGeometry(geometry)
    embree.rtcCommitScene(scene)
    error = embree.rtcGetDeviceError(device)
    if error:
        embree.rtcReleaseScene(scene)
        raise MemoryError if error == _OUT_OF_MEMORY else RuntimeError(f"Embree's error {error}")
    return int(scene)


class _Function(types.WrapperAddressProtocol):  # type: ignore[misc]
    """A function of Embree's that casts a ray, as kernels take functions."""

    def __init__(self, address: int) -> None:
        self._address = address

    def __wrapper_address__(self) -> int:
        return self._address

    def signature(self) -> Any:
        return types.void(types.intp, types.intp, types.intp)


@cache
def _cast(name: str) -> _Function:
    address = ctypes.cast(getattr(_embree(), name), ctypes.c_void_p).value
    assert address is not None
    return _Function(address)


def _embree() -> Any:
    library = _library()
    assert library is not None
    return library


@cache
def _library() -> Any | None:
    """Return the library, its functions with their signatures; None where there is none."""
    package = find_spec("embreex")
    if package is None or package.origin is None:
        return None
    # Where the tools that make wheels put libraries, on Linux and Windows, and on macOS.
    here = Path(package.origin).parent
    places = here.parent / "embreex.libs", here / ".dylibs"
    for path in chain.from_iterable(sorted(place.glob("*embree4*")) for place in places):
        try:
            library = ctypes.CDLL(str(path))
        except OSError:
            continue
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
        return library
    return None


@cache
def _device() -> int | None:
    """Return what builds scenes, with as many threads as kernels may take."""
    device: int | None = _embree().rtcNewDevice(f"threads={config.NUMBA_NUM_THREADS}".encode())
    return device
