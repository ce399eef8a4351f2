"""What happened to the map, read from the revisions that the mapper announced."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum

from onemap_shared.messages import MapRevision


class StepKind(Enum):
    """What changed the map."""

    NEW_MAP = "an empty map"
    FUSE = "a frame was fused"
    RESET = "a search began"
    GAP = "something that the recording does not hold"


@dataclass(frozen=True, slots=True)
class MapStep:
    """One change. ``after``: the revision that was announced with it."""

    kind: StepKind
    after: MapRevision


def map_steps(revisions: Iterable[MapRevision]) -> Iterator[MapStep]:
    """The changes that lead from each revision to the next, beginning without a map.

    A revision counts every change, ``frames_fused`` the frames: if one was lost, or if a map was
    loaded, they do not fit, which is a gap.
    """
    before: MapRevision | None = None
    for after in revisions:
        for kind in _kinds(before, after):
            yield MapStep(kind, after)
        before = after


def _kinds(before: MapRevision | None, after: MapRevision) -> tuple[StepKind, ...]:
    same = before is not None and before.revision == after.revision
    if same and before is not None and before.frames_fused == after.frames_fused:
        return ()  # the found objects changed
    if after.frames_fused == 0:
        return (StepKind.NEW_MAP,)
    if (after.frames_fused, after.revision) == (1, 1):
        return (StepKind.NEW_MAP, StepKind.FUSE)
    if before is None:
        return (StepKind.GAP,)
    frames = after.frames_fused - before.frames_fused
    if after.revision == before.revision + 1 and frames in (0, 1):
        return (StepKind.FUSE if frames else StepKind.RESET,)
    return (StepKind.GAP, StepKind.FUSE) if frames > 0 else (StepKind.GAP,)
