"""How the robot is moved: by velocities, or by goals that nav2 drives to."""
