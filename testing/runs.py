# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Recorded runs of small scenes for tests."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.progress import never_stop
from focus_planner.core.rig.lens import Lens
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.parameters.planner_settings import Recording, Settings
from focus_planner.recording.bag import BagMessage, BagWriter
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.run_writing import beginning_of, inputs_of
from focus_planner.recording.software import software
from testing.messages import Log
from testing.problems import around, torus

PLANNER = "/focus_planner"
TORUS = torus()
# Lenses with a shallow depth of field, so that there is something to choose.
RIG = around(8, 2.5, lens=Lens(0.085, 60.0))
REQUEST = PlanRequest("em", 300, fresh_samples=300)


def cloud(normals=False, importance=False):
    """Points of the torus."""
    samples = Scene(TORUS).sample(2000, 3)
    weights = 1.0 + (samples.points[:, 2] > 0)
    return PointCloud(
        samples.points, samples.normals if normals else None, weights if importance else None
    )


def beginning_with(request=REQUEST, rig=RIG, warm_start=None, **values):
    """The beginning of a run; ``values`` are parameters, with __ for their dots."""
    beginning = beginning_of(new_run_id(), PLANNER, request, rig.frame_id, software())
    given = {name.replace("__", "."): value for name, value in values.items()}
    settings = Settings.from_values({**dict(beginning.settings.values), **given})
    return replace(beginning, settings=settings, warm_start=warm_start)


def solved(beginning, surface=TORUS, rig=RIG, on_progress=never_stop, clock=time.perf_counter):
    """The plan that a run has, made without recording."""
    model = beginning.settings.model
    request, before = beginning.request, beginning.warm_start
    return plan_focus(Scene(surface), rig, request, model, on_progress, before, clock=clock)


def record(
    folder,
    request=REQUEST,
    surface=TORUS,
    rig=RIG,
    *,
    on_progress=never_stop,
    warm_start=None,
    markers=False,
    clock=time.perf_counter,
    **values,
):
    """Plan and record below a folder; return the run's own folder."""
    beginning = beginning_with(request, rig, warm_start, **values)
    log = Log()
    recorder = Recorder(log)
    recording = Recording(folder, markers)
    run = recorder.begin(recording, inputs_of(beginning, surface, rig), beginning)
    plan = solved(beginning, surface, rig, run.wrap_callback(on_progress), clock)
    run.finish(True, plan.summary(), plan, rig)
    assert recorder.close(240)
    assert log.errors == []
    return run.path


def record_failure(folder, beginning, inputs, message):
    """Record a failure to plan; return the run's own folder."""
    log = Log()
    recorder = Recorder(log)
    run = recorder.begin(Recording(folder), inputs, beginning)
    run.finish(False, message)
    assert recorder.close(240)
    assert log.errors == []
    return run.path


def rewritten(path, to, change):
    """Write a run again elsewhere, each message as returned by ``change`` (None: left out)."""
    bag = BagWriter()
    for message in read_bag(path).messages:
        changed = change(message)
        if changed is not None:
            bag.add(changed)
    bag.open(to)
    return bag.close()


def with_payload(message, payload):
    return BagMessage(message.topic, message.type_name, payload, message.at, message.definition)


def partial_copy(path, to):
    """A copy that is truncated, as a killed process leaves it."""
    to = to.with_name(to.name + ".partial")
    shutil.copytree(path, to)
    (to / "metadata.yaml").unlink()
    (file,) = to.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:-40])
    return to
