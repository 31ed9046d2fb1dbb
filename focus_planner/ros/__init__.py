"""The ROS 2 layer: the node, its parameters, a client, rclpy's messages. It does no mathematics."""
