"""A map with what is derived from it, and how it follows the corrections of SLAM."""
# Talks: moves submaps for a limited time, and logs.

from __future__ import annotations

import logging
import time
from contextlib import AbstractContextManager
from uuid import uuid4

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.submaps import SubmapParams, SubmapStore
from onemap_mapper.frame.update import FrameUpdate
from onemap_mapper.places.rooms import RoomKeeper
from onemap_mapper.query.replies import ViewReplies
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.verdicts import CoverageCache
from onemap_shared.grid import GridTooLarge
from onemap_shared.messages import PoseGraph

LOG = logging.getLogger("onemap.mapper")


class MapSession:
    """One map, and what answers are made of; another map is another session.

    lock: while it is held, the map changes. resumed: the map is that of a checkpoint, and no frame
    was fused since. learned: perception was asked which words compete with texts.
    map_id: no other session, of any mapper, has it. coverages: by the number of the robot.
    """

    def __init__(
        self,
        belief: BeliefMap,
        lock: AbstractContextManager[object],
        robots: int,
        *,
        resumed: bool = False,
    ) -> None:
        self.belief, self.resumed, self.learned = belief, resumed, False
        self.scores = MapScores(belief, lock)
        self.map_id = uuid4().hex
        self.views = ViewReplies(self.scores, self.map_id)
        self.rooms = RoomKeeper()
        self.coverages = [CoverageCache(time.monotonic) for _ in range(robots)]


SLICE_S = 0.05  # of moving between two frames, which come every 0.1 s or slower


class PoseGraphFollower:
    """Idle, and without memory, until the first pose graph. The caller holds the map's lock."""

    def __init__(self, *, shared: bool, params: SubmapParams | None = None) -> None:
        self._shared, self._params = shared, params
        self._graph: PoseGraph | None = None
        self._submaps: SubmapStore | None = None
        self.busy = False  # submaps remain to be moved

    def receive(self, graph: PoseGraph, belief: BeliefMap) -> None:
        """Follow this graph from now on; the first one makes what the map holds the fixed part."""
        if self._shared:
            LOG.warning(
                "pose graph %d ignored: the map is shared, and a correction would move what other "
                "robots saw; correct the poses before they are published",
                graph.sequence,
            )
            return
        self._graph = graph
        if self._submaps is None:
            self._submaps = SubmapStore(belief, self._params)
        self._submaps.follow(graph)
        self.busy = True

    def replace(self, belief: BeliefMap) -> None:
        """Go on with another map."""
        if self._submaps is not None and self._graph is not None:
            self._submaps = SubmapStore(belief, self._params)
            self._submaps.follow(self._graph)

    def record(self, update: FrameUpdate) -> None:
        """Keep a frame that was just fused; it may be one from before the correction."""
        if self._submaps is not None and self._graph is not None:
            self._submaps.add(update)
            self.busy = self.busy or update.stamp_ns <= self._graph.stamp_ns

    def reset_searched(self) -> None:
        """Reset sigma_E of the submaps."""
        if self._submaps is not None:
            self._submaps.reset_searched()

    def work(self) -> int:
        """Move submaps for about ``SLICE_S``; returns how many."""
        if self._submaps is None or not self.busy:
            return 0
        moved, ends_s = 0, time.monotonic() + SLICE_S
        while time.monotonic() < ends_s:
            try:
                if not self._submaps.move_next():
                    self.busy = False
                    break
                moved += 1
            except GridTooLarge as problem:
                LOG.warning("a correction of the pose graph is ignored: %s", problem)
        return moved

    def metrics(self) -> dict[str, float]:
        """Numbers for the heartbeat, once there was a graph."""
        if self._submaps is None:
            return {}
        return {
            "submaps": float(self._submaps.count),
            "submaps_fixed": float(self._submaps.fixed),
            "submap_bytes": float(self._submaps.nbytes),
        }
