"""The robot's ROS 2 network over Zenoh, in the two forms that ROS 2 has on it."""
