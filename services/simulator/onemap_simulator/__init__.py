"""Simulator service: a robot with an RGB-D camera in an apartment, or a recording."""
