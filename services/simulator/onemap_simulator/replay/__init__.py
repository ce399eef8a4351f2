"""Replay service: publishes a recording in place of a robot."""
