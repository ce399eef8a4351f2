"""Plays a recording in place of a robot."""
