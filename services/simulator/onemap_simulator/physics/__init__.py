"""The robot's motion and its collisions."""
