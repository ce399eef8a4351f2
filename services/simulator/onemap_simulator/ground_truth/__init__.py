"""Ground truth of simulated scenes, and the definition of success, as in Habitat's ObjectNav.

A success place of a category is a place where the robot's disc fits, at most
``SUCCESS_RADIUS_M`` from the outline (seen from above) of an instance, and from which the
camera sees that same instance. A search for an object succeeds if the robot claims to have
found it and stops at most ``SUCCESS_TOLERANCE_M`` along the floor from a success place. The
shortest path of SPL ends at the same places, so that both measure the same thing.

This module imports nothing: tools read the two limits where no simulator is installed.
"""

from __future__ import annotations

SUCCESS_RADIUS_M = 1.5  # as in the paper

# As in Habitat, and two cells of the grid of success places: a robot on their edge must not fail
# because its cell's centre lies outside.
SUCCESS_TOLERANCE_M = 0.1
