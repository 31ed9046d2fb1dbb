import dataclasses

from focus_planner import CameraStatus, PlanRequest, plan_focus
from testing.plans import RIG, SCENE


def test_statuses_are_the_messages_constants():
    assert [(status.name, int(status)) for status in CameraStatus] == [
        ("UNKNOWN", 0),
        ("PLANNED", 1),
        ("UNASSIGNED", 2),
        ("SEES_NOTHING", 3),
    ]


def test_a_plan_that_costs_nothing_is_the_best():
    plan = plan_focus(SCENE, RIG, PlanRequest("em", 100))
    free = dataclasses.replace(plan, cost=0.0, lower_bound=0.0)
    assert free.gap == 0.0
