"""Errors of a real robot, each off by default: odometry, loop closures, the link of the frames."""
