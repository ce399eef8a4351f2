"""A map with what is derived from it."""
# Talks: what was looked at is judged by the clock.

from __future__ import annotations

import time
from contextlib import AbstractContextManager
from uuid import uuid4

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.places.rooms import RoomKeeper
from onemap_mapper.query.replies import ViewReplies
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.verdicts import CoverageCache


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
