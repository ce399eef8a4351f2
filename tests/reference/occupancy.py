"""What is known of one cell's occupancy, rule by rule, in plain Python."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from onemap_mapper.occupancy import evidence as e
from onemap_shared.messages import Occupancy


@dataclass(frozen=True)
class Cell:
    """As the rows of ``OccupancyLayers``."""

    levels: int
    evidence: list[int] = field(default_factory=list)
    clear: bool = False
    assumed: bool = False
    upright: bool = False  # in the newest frame
    settled: Occupancy = Occupancy.UNKNOWN

    def __post_init__(self) -> None:
        if not self.evidence:
            object.__setattr__(self, "evidence", [0] * (self.levels + 1))

    @property
    def state(self) -> Occupancy:
        if self.upright or max(self.evidence) >= e.OCCUPIED_THRESHOLD:
            return Occupancy.OCCUPIED
        return Occupancy.FREE if self.clear else Occupancy.UNKNOWN

    @property
    def looks(self) -> tuple[Occupancy, bool, bool, bool]:
        """What a view shows of it."""
        drop = self.evidence[-1] >= e.OCCUPIED_THRESHOLD
        return self.state, self.clear, self.assumed, drop

    def after(self, added: list[int], cleared: bool) -> Cell:
        """The cell after a frame's evidence."""
        *voxels, _ = added
        more = list(added)
        for level, known in enumerate(self.evidence[:-1]):
            above = range(level, self.levels)
            lost = [min(voxels[k], 0) for k in above if self.evidence[k] > 0]
            if known > 0 and voxels[level] == 0 and max(voxels) <= 0:
                more[level] = min(lost)
        summed = [
            min(max(known + change, e.MIN_EVIDENCE), e.MAX_EVIDENCE)
            for known, change in zip(self.evidence, more, strict=True)
        ]
        limit, clear = e.OCCUPIED_THRESHOLD, self.clear or cleared
        unseen = any(
            before >= limit > now and change == 0
            for before, now, change in zip(self.evidence[:-1], summed, added, strict=False)
        )
        seen = replace(
            self,
            evidence=summed,
            clear=clear,
            assumed=(self.assumed or (unseen and clear)) and not cleared,
            upright=sum(value >= e.HIT for value in voxels) >= e.UPRIGHT_LEVELS,
        )
        settled = Occupancy.FREE if seen.state == Occupancy.FREE else self.settled
        if max(summed) >= e.SETTLED_EVIDENCE:
            settled = Occupancy.OCCUPIED
        return replace(seen, settled=settled)

    def with_assumed_floor(self) -> Cell:
        """The cell once its floor is taken for free, unless it was seen."""
        return replace(self, clear=True, assumed=self.assumed or not self.clear, upright=False)
