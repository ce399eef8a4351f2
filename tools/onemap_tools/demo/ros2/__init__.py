"""The simulated robot as a ROS 2 robot: its topics through a router, its base on /cmd_vel."""
