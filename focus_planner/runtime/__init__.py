"""What a running planner keeps and tells, without ROS."""
