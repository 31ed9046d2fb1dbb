"""The codec: messages from and to the core's types, as fields and as bytes, without ROS."""
