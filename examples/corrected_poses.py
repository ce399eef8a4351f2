"""Tell OneMap what SLAM corrected, so that the map follows a loop closure.

Beside the robot's own messages: call ``published`` with every frame that you publish, and
``corrected`` when SLAM has changed the poses of its keyframes by more than a cell (0.1 m).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onemap_shared.geometry import F64
from onemap_shared.keys import ROBOT_POSE_GRAPH
from onemap_shared.messages import MAX_KEYFRAMES, PoseGraph
from onemap_shared.transport import Bus


class CorrectedPoses:
    """Remembers the poses as they were published, and publishes what became of them."""

    def __init__(self, bus: Bus) -> None:
        self._graphs = bus.publish(ROBOT_POSE_GRAPH)
        self._published: dict[int, F64] = {}
        self._sequence = 0
        self.corrected({})  # announces corrections: the mapper keeps what it needs from now on

    def published(self, stamp_ns: int, T_map_body: F64) -> None:
        """A frame of this time went out with this pose."""
        self._published[stamp_ns] = T_map_body

    def corrected(self, T_map_body: Mapping[int, F64]) -> None:
        """SLAM's keyframes: time of a frame that was published, and its pose now.

        All keyframes since the start, not only those that changed. Frames that are published from
        now on carry corrected poses.
        """
        stamps = sorted(T_map_body.keys() & self._published.keys())
        stamps = stamps[:: 1 + len(stamps) // MAX_KEYFRAMES]
        before = [self._published[stamp] for stamp in stamps]
        now = [T_map_body[stamp] for stamp in stamps]
        self._sequence += 1
        self._graphs.put(
            PoseGraph(
                self._sequence,
                max(self._published, default=0),
                np.array(stamps, np.int64),
                np.array(before, np.float64).reshape(-1, 4, 4),
                np.array(now, np.float64).reshape(-1, 4, 4),
            )
        )
