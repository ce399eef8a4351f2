"""Tell OneMap what SLAM corrected, so that the map follows a loop closure.

Beside the robot's own messages: call ``published`` with every frame that you publish, and
``corrected`` when SLAM has changed the poses of its keyframes by more than a cell (0.1 m).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np

from onemap_shared.geometry import F64
from onemap_shared.keys import ROBOT_POSE_GRAPH
from onemap_shared.messages import MAX_KEYFRAMES, PoseGraph
from onemap_shared.transport import Bus

MAX_FRAMES = 10_000  # since the newest keyframe: 20 minutes at 8 Hz, 2 MB


class CorrectedPoses:
    """Remembers the poses as they were published, and publishes what became of them.

    Before the newest keyframe of SLAM it remembers keyframes, and no other frame.
    """

    def __init__(self, bus: Bus) -> None:
        self._graphs = bus.publish(ROBOT_POSE_GRAPH)
        self._published: dict[int, F64] = {}
        self._recent: deque[int] = deque()  # times since the newest keyframe
        self._sequence = 0
        self.corrected({})  # announces corrections: the mapper keeps what it needs from now on

    def published(self, stamp_ns: int, T_map_body: F64) -> None:
        """A frame of this time went out with this pose."""
        self._published[stamp_ns] = T_map_body
        self._recent.append(stamp_ns)
        if len(self._recent) > MAX_FRAMES:
            self._published.pop(self._recent.popleft(), None)

    def corrected(self, T_map_body: Mapping[int, F64]) -> None:
        """SLAM's keyframes: time of a frame that was published, and its pose now.

        All keyframes since the start, not only those that changed. Frames that are published from
        now on carry corrected poses.
        """
        stamps = sorted(T_map_body.keys() & self._published.keys())
        stamps = stamps[:: 1 + len(stamps) // MAX_KEYFRAMES]
        before = [self._published[stamp] for stamp in stamps]
        now = [T_map_body[stamp] for stamp in stamps]
        newest_ns = max(self._published, default=0)
        while self._recent and stamps and self._recent[0] <= stamps[-1]:
            if (passed := self._recent.popleft()) not in T_map_body:
                del self._published[passed]
        self._sequence += 1
        self._graphs.put(
            PoseGraph(
                self._sequence,
                newest_ns,
                np.array(stamps, np.int64),
                np.array(before, np.float64).reshape(-1, 4, 4),
                np.array(now, np.float64).reshape(-1, 4, 4),
            )
        )
