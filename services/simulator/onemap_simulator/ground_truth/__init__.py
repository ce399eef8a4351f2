"""What counts as finding an object, as in Habitat's ObjectNav; nothing heavy is imported here.

A success place of a category is a place where the robot's disc fits, at most
``SUCCESS_RADIUS_M`` from the outline (seen from above) of an instance, and from which the
camera sees that same instance. A search for an object succeeds if the robot claims to have
found it and stops at most ``SUCCESS_TOLERANCE_M`` along the floor from a success place. The
shortest path of SPL ends at the same places, so that both measure the same thing.
"""

from __future__ import annotations

SUCCESS_RADIUS_M = 1.5  # the paper's

# Habitat's, and two cells of the grid that the places are computed on: a robot on the edge of
# the success places must not fail because its cell's centre lies outside.
SUCCESS_TOLERANCE_M = 0.1
