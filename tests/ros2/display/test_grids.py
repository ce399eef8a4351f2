from __future__ import annotations

import struct

from onemap_ros2.display_messages import belief_grid, similarity_grid
from tests.ros2.planner_messages import view


def golden(values: bytes) -> bytes:
    """The message as ``struct`` builds it: 3 columns along x, 2 rows along y."""
    body = struct.pack("<iII4s", 0, 5, 4, b"map\0")
    body += struct.pack("<iIfII", 0, 5, 0.5, 3, 2)
    body += bytes(-len(body) % 8) + struct.pack("<7d", -1.0, 2.0, 0, 0, 0, 0, 1)
    return bytes((0, 1, 0, 0)) + body + struct.pack("<I", len(values)) + values


def test_the_belief_has_its_rows_along_y_lowest_first() -> None:
    values = struct.pack("6b", -1, 0, 30, 30, 100, 30)
    assert belief_grid(view(), "map") == golden(values)


def test_the_similarity_is_in_percent_where_anything_was_observed() -> None:
    values = struct.pack("6b", -1, 100, -1, 25, 0, 50)
    assert similarity_grid(view(), "map") == golden(values)
