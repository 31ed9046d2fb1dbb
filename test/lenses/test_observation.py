# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is seen of a lens behind a driver like camera_ros, in virtual time."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from focus_planner.lenses.calls import Timeouts
from focus_planner.lenses.control import LensControl
from focus_planner.lenses.driver import LensStatus
from focus_planner.lenses.frames import Frame, FrameLog
from focus_planner.lenses.orders import FocusOrder
from focus_planner.lenses.profiles import PROFILES
from focus_planner.lenses.simulated_devices import PerFrameDevice
from focus_planner.lenses.simulation import LensMechanics
from testing.virtual_time import run_in_virtual_time

_, SENT, VERIFIED, DIFFERS, FAILED, ACCEPTED = LensStatus
CAMERA_ROS = PROFILES["camera_ros"]
# One after the other, as the adapter of 0.1 did.
ONE_BY_ONE = replace(CAMERA_ROS, together=False)
ORDER = FocusOrder("a plan", 0.5)
FRAME = 1 / 30
TIMEOUTS = Timeouts(timeout=0.3, verify_timeout=0.5, poll_period=0.02, watch_period=1.0)


def stamp(seconds):
    return int(seconds), int(seconds % 1 * 1e9)


class Camera:
    """A driver like camera_ros 0.7: its parameters, and a lens that only its frames tell of."""

    name = "/cam/camera"

    def __init__(self, name="/cam/camera", frame_id="cam", autofocus=True, **mechanics):
        self.name = name
        self.device = PerFrameDevice(
            CAMERA_ROS, LensMechanics(0.0, 10.0, **mechanics), autofocus, stuck=False
        )
        self.values = dict(self.device.initial) | {"frame_id": frame_id, "camera": 0}
        self.hardware_id = "a sensor"
        self.publishes = True
        self.clock_error = 0.0
        self.calls = 0
        self.drops = 0

    def is_available(self):
        return True

    async def connect(self):
        pass

    def strangeness(self):
        return ""

    async def list_parameters(self, names):
        return [name for name in self.values if name in names]

    async def set_parameters(self, values):
        await asyncio.sleep(0.001)
        self.calls += 1
        self.values.update(values)
        if self.drops:  # another node's call comes before the next frame
            self.drops -= 1
            values = [("ExposureTime", 10_000)]
        self.device.take(list(values), now())

    async def get_parameters(self, names):
        await asyncio.sleep(0.001)
        return {name: self.values.get(name) for name in names}

    async def stream(self, log):
        while True:
            await asyncio.sleep(FRAME)
            self.device.begin_frame(now())
            if self.publishes:
                log.add(self.frame())

    def frame(self):
        return Frame(
            stamp(now() + self.clock_error),
            self.values["frame_id"],
            self.hardware_id,
            round(self.device.position(now()), 6),
            "2" if self.device.has_autofocus else "",
        )


def now():
    return asyncio.get_running_loop().time()


def watched(camera, seconds=3.0, *, profile=CAMERA_ROS, others=(), during=None, **timeouts):
    """Return the reports of one order; ``during`` is called after one second."""

    async def run():
        reports, log = [], FrameLog()
        streams = [asyncio.ensure_future(each.stream(log)) for each in (camera, *others)]
        await asyncio.sleep(5 * FRAME / 2)
        lens = LensControl(
            camera,
            profile,
            reports.append,
            lambda: stamp(now()),
            replace(TIMEOUTS, **timeouts),
            frames=log,
        )
        lens.apply(ORDER)
        await asyncio.sleep(1.0)
        if during:
            during()
        await asyncio.sleep(seconds - 1.0)
        lens.stop()
        for stream in streams:
            stream.cancel()
        return reports

    return run_in_virtual_time(run())


def statuses(reports):
    return [report.status for report in reports]


def test_the_lens_itself_is_verified_by_its_frames():
    camera = Camera()
    sent, verified = watched(camera)
    assert camera.calls == 1
    assert (verified.status, verified.read_value, verified.read_distance) == (VERIFIED, 2.0, 0.5)
    assert sent.sent_at < verified.read_at
    assert verified.message == ""


def test_what_is_set_in_two_calls_is_lost_and_never_verified():
    """Autofocus goes on, all parameters read back as asked, and the lens stays where it was."""
    camera = Camera()
    reports = watched(camera, profile=ONE_BY_ONE)
    assert camera.values["AfMode"] == 0
    assert camera.values["LensPosition"] == 2.0
    assert camera.device.has_autofocus
    assert statuses(reports) == [SENT, SENT, DIFFERS]
    assert reports[-1].read_value == 0.0
    assert reports[-1].message == (
        "/cam/camera: expected autofocus off, its frames say AfState = 2; the driver dropped what"
        " was set, or another node has set it since"
    )


def test_autofocus_that_happens_to_be_where_the_lens_was_sent_is_no_proof():
    camera = Camera()
    camera.device.position = lambda _: 2.0
    assert statuses(watched(camera, profile=ONE_BY_ONE)) == [SENT, SENT, DIFFERS]


def test_what_another_nodes_call_displaced_is_sent_once_more():
    camera = Camera()
    camera.drops = 1
    reports = watched(camera)
    assert statuses(reports) == [SENT, SENT, VERIFIED]
    assert reports[1].message.startswith("sent again: /cam/camera: expected autofocus off")
    assert camera.device.position(99.0) == 2.0


def test_sent_twice_and_displaced_twice_is_reported_and_left_alone():
    camera = Camera()
    camera.drops = 9
    assert statuses(watched(camera, seconds=6.0)) == [SENT, SENT, DIFFERS]
    assert camera.calls == 2


def test_frames_before_the_value_was_taken_do_not_count():
    camera = Camera(autofocus=False)

    def stop():  # the newest frames go on saying that the lens is where it was sent
        camera.publishes = False

    reports = watched(camera, during=stop)
    assert statuses(reports) == [SENT, VERIFIED, ACCEPTED]
    assert reports[-1].message == (
        "/cam/camera: expected 3 frames on /diagnostics that are newer than the value sent, got 0;"
        " camera_ros publishes them from 0.7 on, and the clocks of both machines must agree"
    )


def test_without_frames_it_is_accepted_and_verified_when_they_come():
    camera = Camera()
    camera.publishes = False

    def begin():
        camera.publishes = True

    reports = watched(camera, during=begin)
    assert statuses(reports) == [SENT, ACCEPTED, VERIFIED]
    assert "camera_ros publishes them from 0.7 on" in reports[1].message


def test_frames_of_a_clock_that_is_behind_do_not_verify():
    camera = Camera()
    camera.clock_error = -60.0
    assert statuses(watched(camera)) == [SENT, ACCEPTED]


def test_autofocus_switched_on_later_is_told_and_ended():
    camera = Camera()

    def switch_on():
        camera.device.take([("AfMode", 2)], 0.0)  # not even the parameters say so

    reports = watched(camera, during=switch_on)
    assert statuses(reports) == [SENT, VERIFIED, DIFFERS, SENT, VERIFIED]
    assert "its frames say AfState = 2" in reports[2].message
    assert not camera.device.has_autofocus


def test_a_lens_that_somebody_moves_is_told_and_moved_back():
    camera = Camera()

    def move():
        camera.device.take([("LensPosition", 7.0)], 0.0)

    reports = watched(camera, during=move)
    assert statuses(reports) == [SENT, VERIFIED, DIFFERS, SENT, VERIFIED]
    assert (reports[2].read_value, reports[2].read_distance) == (7.0, pytest.approx(1 / 7))
    assert reports[2].message.startswith(
        "/cam/camera: expected the lens at 2, its frames say LensPosition = 7; the driver dropped"
    )


def test_a_slow_lens_is_waited_for():
    camera = Camera(speed=5.0)
    assert statuses(watched(camera)) == [SENT, VERIFIED]


def beside_another(hardware_id):
    """Return the reports of a lens that is lost, beside another that is where it was sent."""
    camera, other = Camera(), Camera("/other/camera", autofocus=False)
    other.hardware_id = hardware_id
    other.device.position = lambda _: 2.0
    return watched(camera, others=[other], profile=ONE_BY_ONE)


def test_two_sensors_under_one_frame_id_do_not_verify():
    reports = beside_another("another sensor")
    assert statuses(reports) == [SENT, ACCEPTED]
    assert reports[-1].message == (
        "/cam/camera: frame_id: expected a frame_id of its own for each camera driver, got 'cam'"
        " for several; set the drivers' parameter frame_id: frames on /diagnostics are told apart"
        " by it"
    )


def test_frames_of_two_cameras_that_cannot_be_told_apart_alternate_and_do_not_verify():
    assert VERIFIED not in statuses(beside_another("a sensor"))


def test_frames_that_do_not_tell_the_position_do_not_verify():
    camera = Camera()
    camera.device.position = lambda _: float("nan")
    reports = watched(camera)
    assert statuses(reports) == [SENT, ACCEPTED]
    assert "expected frames that tell LensPosition" in reports[-1].message
