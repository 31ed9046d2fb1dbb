# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What casts rays: against each triangle in turn, and one library against the other."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading

import numpy as np
import pytest

from focus_planner.core.surface import ray_casting, ray_casting_embree
from focus_planner.core.surface.ray_casting import ray_caster
from focus_planner.core.surface.ray_casting_embree import EmbreeRays, has_embree
from focus_planner.core.surface.ray_casting_open3d import Open3DRays
from testing.problems import body, torus, with_threads
from testing.reference import occluded

MESH = torus(0.4, 0.15)
CORNERS = MESH.vertices.astype(np.float32)
TRIANGLES = MESH.triangles.astype(np.uint32)

needs_embree = pytest.mark.skipif(not has_embree(), reason="embreex has no wheel here")
each_caster = pytest.mark.parametrize(
    "kind", [pytest.param(EmbreeRays, marks=needs_embree), Open3DRays]
)


def rays(count, seed=0, reach=0.8):
    ends = np.random.default_rng(seed).uniform(-reach, reach, (count, 2, 3))
    return np.concatenate([ends[:, 0], ends[:, 1] - ends[:, 0]], axis=1).astype(np.float32)


@each_caster
def test_a_ray_is_blocked_by_a_triangle_in_its_way(kind):
    cast = rays(400)
    hidden = kind(CORNERS, TRIANGLES).occluded(cast)
    # Those that graze an edge may be told either way.
    for ray, is_hidden in zip(cast.astype(np.float64), hidden, strict=True):
        ends = ray[:3], ray[:3] + ray[3:]
        if occluded(MESH, *ends, 0.0, 1e-4) == occluded(MESH, *ends, 0.0, -1e-4):
            assert is_hidden == occluded(MESH, *ends, 0.0)
    assert 100 < hidden.sum() < 300


@each_caster
def test_what_is_hit_first_is_at_that_distance_on_that_triangle(kind):
    cast = rays(2000, 1)
    distance, triangle, normal = kind(CORNERS, TRIANGLES).first_hits(cast)
    hit = np.isfinite(distance)
    assert ((triangle >= 0) == hit).all()
    assert not normal[~hit].any()
    places = cast[hit, :3] + distance[hit, None] * cast[hit, 3:]
    corners = CORNERS[TRIANGLES[triangle[hit]]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    off = ((places - corners[:, 0]) * across).sum(axis=1) / np.linalg.norm(across, axis=1)
    assert np.abs(off).max() < 1e-6
    assert ((normal[hit] * across).sum(axis=1) > 0).all()
    assert 100 < hit.sum() < 1900
    # Nothing blocks the way there; a ray that goes on beyond the hit is blocked.
    short, long = cast[hit].copy(), cast[hit].copy()
    short[:, 3:] *= (distance[hit] * 0.999)[:, None]
    long[:, 3:] *= (distance[hit] * 1.001)[:, None]
    caster = kind(CORNERS, TRIANGLES)
    assert not caster.occluded(short).any()
    assert caster.occluded(long).all()


@needs_embree
@pytest.mark.parametrize("mesh", [MESH, body("arms_down")], ids=["torus", "body"])
def test_both_libraries_find_the_same(mesh):
    corners = (mesh.vertices - mesh.vertices.mean(axis=0)).astype(np.float32)
    triangles = mesh.triangles.astype(np.uint32)
    casters = [kind(corners, triangles) for kind in (EmbreeRays, Open3DRays)]
    cast = rays(50_000, 2)
    hidden, others = (each.occluded(cast) for each in casters)
    assert (hidden == others).all()
    (distance, triangle, normal), (far, met, across) = (each.first_hits(cast) for each in casters)
    assert (triangle == met).all()
    assert np.allclose(distance, far, rtol=5e-7)
    assert (
        np.sign((normal * cast[:, 3:]).sum(axis=1)) == np.sign((across * cast[:, 3:]).sum(axis=1))
    ).all()


@needs_embree
def test_threads_do_not_matter():
    caster, cast = EmbreeRays(CORNERS, TRIANGLES), rays(20_000, 3)
    one, all_ = (with_threads(count, lambda: caster.occluded(cast)) for count in (1, 2))
    assert (one == all_).all()


@each_caster
def test_several_threads_may_ask_from_the_first_on(kind):
    caster, cast = kind(CORNERS, TRIANGLES), rays(20_000, 4)
    found = [np.empty(0)] * 4

    def ask(number):
        found[number] = caster.occluded(cast)

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((each == found[0]).all() for each in found)
    assert found[0].any()


@each_caster
def test_no_rays_find_nothing(kind):
    caster, none = kind(CORNERS, TRIANGLES), np.zeros((0, 6), dtype=np.float32)
    assert len(caster.occluded(none)) == 0
    assert [len(each) for each in caster.first_hits(none)] == [0, 0, 0]


@needs_embree
def test_what_was_built_goes_with_its_caster(monkeypatch):
    released = []
    release = ray_casting_embree._embree().rtcReleaseScene
    monkeypatch.setattr(
        ray_casting_embree._embree(), "rtcReleaseScene", lambda s: (released.append(s), release(s))
    )
    caster = EmbreeRays(CORNERS, TRIANGLES)
    caster.occluded(rays(1))
    built = caster._scene
    assert not released
    del caster
    gc.collect()
    assert released == [built]


@needs_embree
def test_a_scene_that_there_is_no_memory_for_is_a_memory_error(monkeypatch):
    monkeypatch.setattr(
        ray_casting_embree._embree(), "rtcGetDeviceError", lambda _: 4, raising=False
    )
    with pytest.raises(MemoryError):
        EmbreeRays(CORNERS, TRIANGLES).occluded(rays(1))


@needs_embree
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no limits of memory here")
@pytest.mark.processes
def test_after_a_scene_that_was_too_large_a_smaller_one_is_built():
    program = """
import resource
import numpy as np
from focus_planner.core.surface.ray_casting import ray_caster
ray = np.array([[0, 0, -9, 0, 0, 18]], dtype=np.float32)
corners = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
def caster(count):
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return ray_caster(np.tile(corners, (count, 1)), triangles)
assert caster(10).occluded(ray).all()
large = caster(2_000_000)
status = open("/proc/self/status").read()
used = 1024 * int(status.split("VmData:")[1].split()[0])
for room in (20, 120):  # for a part of its mesh, and for that without its structure
    resource.setrlimit(resource.RLIMIT_DATA, (used + room * 2**20, resource.RLIM_INFINITY))
    try:
        large.occluded(ray)
    except MemoryError:
        pass
    else:
        raise AssertionError("there was room")
    assert caster(10).occluded(ray).all()
"""
    subprocess.run([sys.executable, "-c", program], check=True)


def test_open3d_casts_rays_where_there_is_no_embreex(monkeypatch):
    monkeypatch.setattr(ray_casting, "has_embree", lambda: False)
    assert isinstance(ray_caster(MESH.vertices, MESH.triangles), Open3DRays)


@needs_embree
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here")
@pytest.mark.processes
def test_a_forked_process_builds_and_casts_too():
    program = """
import os
import numpy as np
from focus_planner.core.surface.ray_casting import ray_caster
ball = np.random.default_rng(0).standard_normal((60_000, 3))
triangles = np.arange(60_000, dtype=np.int32).reshape(-1, 3)
ray = np.array([[-9, 0, 0, 18, 0, 0]], dtype=np.float32)
def hits(caster):
    return int(caster.first_hits(ray)[1][0])
before = ray_caster(ball, triangles)
first = hits(before)
child = os.fork()
if not child:
    os._exit(0 if hits(before) == hits(ray_caster(ball, triangles)) == first else 7)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
"""
    environment = os.environ | {"NUMBA_THREADING_LAYER": "workqueue"}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)
