"""Recording the planner's runs; reading, replaying and comparing recorded ones. Without ROS."""
