"""Settings for all tests."""

import os

# A graph of their own, on this machine only. They have to be set before rclpy is imported.
os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

from hypothesis import settings

# How long an example takes depends on who else is on the machine.
settings.register_profile("no deadline", deadline=None)
settings.load_profile("no deadline")
