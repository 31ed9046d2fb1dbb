"""The planning problem and its solvers: no ROS, no files, no logging."""
