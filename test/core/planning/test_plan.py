from focus_planner import (
    CameraStatus,
)


def test_statuses_are_the_messages_constants():
    assert [(status.name, int(status)) for status in CameraStatus] == [
        ("UNKNOWN", 0),
        ("PLANNED", 1),
        ("UNASSIGNED", 2),
        ("SEES_NOTHING", 3),
    ]
