"""The state of a running planner and what it reports, without ROS."""
