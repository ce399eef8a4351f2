"""ROS 2 robots over Zenoh, without ROS 2 installed: an adapter like any other robot."""
