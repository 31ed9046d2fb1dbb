"""Recorded runs: written while the planner works, read, planned again and compared, without ROS."""
