from __future__ import annotations

import threading
from functools import partial
from logging import getLogger

from focus_planner_msgs.srv import PlanFocus

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.conversions import fields_from_ros
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.ros.request_planner import PlanningHost
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Request
from testing.planning_workers import ThreadedWorker


def the(content, _):
    return content


def test_what_ends_with_the_node_is_not_published_however_late_the_request_is_ended(body):
    published, answers, answered = [], [], threading.Event()
    planning = PlanningThread(
        PlanningHost(
            "/here",
            getLogger,
            lambda: Settings.from_values({}),
            lambda: (1, 2),
            len,
            published.append,
            ThreadedWorker,
        )
    )
    rig = cylinder_rig()
    planning.receive_surface(Arrival("/mesh", "shape_msgs/msg/Mesh", b"a mesh", partial(the, body)))
    planning.receive_rig(Arrival("/rig", "a rig", b"\0\1\0\0" + bytes(8), partial(the, rig)))
    request = Request(
        fields_from_ros(PlanFocus.Request(samples=500)),
        Settings.from_values({}),
        "a plan",
        lambda outcome: (answers.append(outcome), answered.set()),
        send_feedback=lambda _: planning.stop(),
    )
    planning.plan(request)
    assert answered.wait(240)
    assert planning.finish(60)
    (answer,) = answers
    assert (answer.reason, answer.plan) == (Reason.SHUTTING_DOWN, None)
    assert answer.message == "the node is shutting down"
    assert published == []
