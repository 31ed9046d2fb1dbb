# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Clouds at and above the node's limit of points."""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console

from benchmarks.guarantees import Outcome, cameras_of, own_graph, report, running
from benchmarks.scenes import body_scenes, rig
from focus_planner import Mesh, PointCloud
from focus_planner.messages.typestore import CLOUD, serialize
from focus_planner.messages.writing import cloud_to_fields
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.client import PlannerClient

_POINTS = int(Settings.from_values({}).limits.max_points)
_MOST_MEMORY = 4096.0
_PATIENCE = 600.0
_REQUEST = {"method": "em", "samples": 200}


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph():
        return report(console, "Large clouds", [_large_cloud])


def _large_cloud() -> Outcome:
    body = next(iter(body_scenes().values()))
    assert isinstance(body.surface, Mesh)
    large = PointCloud(body.sample(_POINTS + 1, 1).points)
    with running("cloud", fresh_samples=4096, service_max_wait=_PATIENCE) as node:
        with PlannerClient(node.name) as client:
            client.wait_for_node(_PATIENCE)
            client.publish_rig(rig())
            client.publish_mesh(body.surface)
            refused, said = _refused(client, large)
            accepted = _accepted(client, PointCloud(large.points[:_POINTS]))
        peak, faults = node.peak, node.faults
    result = (
        f"{_POINTS + 1:,} points refused in {refused:.1f} s ({said});"
        f" {_POINTS:,} points planned for after {accepted:.0f} s;"
        f" peak {peak:.0f} MiB; {len(faults)} errors logged"
    )
    kept = "max_points" in said and peak < _MOST_MEMORY and not faults
    return Outcome("clouds at the limit, and above it", 2, result, kept)


def _refused(client: PlannerClient, cloud: PointCloud) -> tuple[float, str]:
    before = client.plan(_PATIENCE, **_REQUEST).plan
    started = time.perf_counter()
    _publish(client, cloud)
    answer = client.plan(_PATIENCE, **_REQUEST)
    seconds = time.perf_counter() - started
    after = client.plan(_PATIENCE, **_REQUEST).plan
    assert not answer.success
    assert cameras_of(before) == cameras_of(after)
    return seconds, answer.message.split(";")[0]


def _accepted(client: PlannerClient, cloud: PointCloud) -> float:
    started = time.perf_counter()
    _publish(client, cloud)
    answer = client.plan(_PATIENCE, **_REQUEST)
    assert answer.success, answer.message
    assert answer.plan.surface.topic.endswith("/cloud")
    return time.perf_counter() - started


def _publish(client: PlannerClient, cloud: PointCloud) -> None:
    """Publish the points in single precision, as sensors do."""
    fields = cloud_to_fields(cloud, "world")
    data = np.ascontiguousarray(cloud.points, "<f4")
    for i, part in enumerate(fields["fields"]):
        part |= {"offset": 4 * i, "datatype": 7}
    fields |= {"point_step": 12, "row_step": data.nbytes, "data": data.tobytes()}
    client.publish("cloud", serialize(CLOUD, fields))
