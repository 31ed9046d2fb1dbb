"""The nodes' parameters, without ROS: declarations, validated settings, parameter files."""
