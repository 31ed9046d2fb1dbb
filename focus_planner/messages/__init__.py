"""What messages say, to and from the core's types, without ROS."""
