"""A map with what is derived from it."""
# Talks: what was looked at is judged by the clock.

from __future__ import annotations

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.places.rooms import RoomKeeper
from onemap_mapper.query.replies import ViewReplies
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.verdicts import CoverageCache
from onemap_shared.clock import Clock, Lock


class MapSession:
    """One map, and what answers are made of; another map is another session.

    lock: while it is held, the map changes. resumed: the map is that of a checkpoint, and no frame
    was fused since.
    map_id: no other session, of any mapper, has it. coverages: by the number of the robot.
    """

    def __init__(
        self,
        belief: BeliefMap,
        lock: Lock,
        clock: Clock,
        robots: int,
        *,
        resumed: bool = False,
    ) -> None:
        self.belief, self.resumed = belief, resumed
        self.scores = MapScores(belief, lock, clock)
        self.map_id = clock.random.randbytes(16).hex()
        self.views = ViewReplies(self.scores, self.map_id)
        self.rooms = RoomKeeper(clock.lock())
        self.coverages = [CoverageCache(clock.monotonic_s) for _ in range(robots)]
