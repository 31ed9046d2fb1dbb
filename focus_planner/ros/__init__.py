"""The ROS 2 layer: messages to and from the core's types, and the node. It does no mathematics."""
