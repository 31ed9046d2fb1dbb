"""Driving lenses to planned focus distances, without ROS: drivers, control loop, simulation."""
