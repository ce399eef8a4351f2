"""Object candidates: detections with which the map agrees, merged by position.

Detector and map each confuse many things with the object; the consensus test accepts only
detections whose cells are among the most similar of the map (paper, Object Search).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.sentences import Agreement
from onemap_planner.world.map_view import MapView, WorldCells
from onemap_shared.geometry import F32
from onemap_shared.messages import Detections, Occupancy
from onemap_shared.names import same_name

SAME_SIDE_M = 0.8  # views from places nearer to each other are of one side: 45 degrees at 1 m
MOST_SCALES = 3.0  # within which 95 percent of an exponential distribution lie


# Share of the near views in which the detector finds an object that is there: of an open-vocabulary
# detector in homes, roughly.
DETECTED = 0.7
# The same of another thing that it takes for the object for good: its scores lie near the
# threshold, so that it flickers.
MISTAKEN = 0.5
# Such things in a flat, for each object that is there: 130 things, of which the detector takes 0.5
# percent for a given name.
MISTAKEN_THINGS = 0.65
# Share of the objects that the map takes for something else: that of the simulated encoder; mini
# gets 0.09 of the pixels wrong.
LOOKS_DIFFERENT = 0.06
# How far below the most similar cells the rank of such an object lies, as a part of the map, on
# average: what is confused is similar. Any other thing has any rank.
RANK_SCALE = 0.1
# Probability from which it is the object, and its complement from which it is not: one wrong in
# twenty of those that the map does not support.
CERTAIN = 0.95
# Frames from one place that count, 7.5 s at 4 Hz: more show the same again, and the robot looks
# from another side.
VIEWS_PER_VIEWPOINT = 30


@dataclass(frozen=True, slots=True)
class ViewpointTally:
    """Near views from one place, xy metres: frames, and those in which the object was detected."""

    xy: tuple[float, float]
    hits: int
    frames: int


def with_view(
    tallies: tuple[ViewpointTally, ...], xy: tuple[float, float], *, hit: bool
) -> tuple[ViewpointTally, ...]:
    """The tallies with one more near view from ``xy``, metres."""
    for index, tally in enumerate(tallies):
        if np.hypot(tally.xy[0] - xy[0], tally.xy[1] - xy[1]) <= SAME_SIDE_M:
            more = replace(tally, hits=tally.hits + hit, frames=tally.frames + 1)
            return (*tallies[:index], more, *tallies[index + 1 :])
    return (*tallies, ViewpointTally(xy, int(hit), 1))


def probability(tallies: Iterable[ViewpointTally], rank: float) -> float:
    """Probability that it is the object, in [0, 1].

    rank: of its cells' cosine on the map, 1 the most similar; NaN (nothing is known) gives 0, and
    so does a rank lower than that of 95 percent of the objects that look different: a map that
    says clearly that it is something else is not outweighed by any number of views.
    """
    if not 1 - rank <= MOST_SCALES * RANK_SCALE:  # also refuses NaN
        return 0.0
    odds = np.log(LOOKS_DIFFERENT / RANK_SCALE) - (1 - rank) / RANK_SCALE
    odds -= np.log(MISTAKEN_THINGS)
    odds += sum(_evidence(tally) for tally in tallies)
    return float(1 / (1 + np.exp(-odds)))


def _evidence(tally: ViewpointTally) -> float:
    """Logarithm of the likelihood ratio of the views from one place."""
    hit = np.log(DETECTED / MISTAKEN)
    miss = np.log((1 - DETECTED) / (1 - MISTAKEN))
    counted = min(1.0, VIEWS_PER_VIEWPOINT / tally.frames)
    return float(counted * (tally.hits * hit + (tally.frames - tally.hits) * miss))


MAX_CELLS = 2000  # of one candidate: a bed covers about 400 cells of 10 cm
MAX_CANDIDATES = 64  # candidates kept, those with the most sightings
RECENT_SIGHTINGS = 12  # the latest ones, from near, locate the surface: 1.5 s at 8 Hz
SCORE_STEP = 0.1  # the detector's scores of one object tremble by less
SURFACE_SHARE = 0.25  # of the votes of the most seen cell; a stray point of one frame has less
LEAST_DISTANCE_M = 0.7  # nearer, a sighting is not more exact
FORGETTING = 0.9  # of earlier sightings for the mean position: that of the last ten counts


SUPPORT_FRACTION = 0.25  # part of a detection's cells that must agree; boxes hold background too
MERGE_M = 0.5  # metres between two detections of one object; or they share cells
MIN_SIGHTINGS = 3  # agreeing detections before the robot drives up: one frame may err


@dataclass(frozen=True, slots=True)
class PictureOfObject:
    """A frame in which an object was detected.

    score: the detector's, in [0, 1]; stamp_ns: when it was captured; box_px: x0, y0, x1, y1 in
    pixels of the picture; picture: JPEG, empty if the frame came without one.
    """

    score: float
    stamp_ns: int
    box_px: tuple[float, float, float, float]
    picture: bytes = b""

    def is_better_than(self, other: PictureOfObject | None) -> bool:
        """Whether it shows the object better than an earlier one.

        At about the same score it does: the later ones are from near and have it in the middle.
        """
        return other is None or self._quality >= other._quality

    @property
    def _quality(self) -> tuple[bool, int]:
        return bool(self.picture), round(self.score / SCORE_STEP)


@dataclass(frozen=True, slots=True)
class Sighting:
    """One detection.

    xyz metres: middle of its points that the map supports; cells: world cells they cover;
    similarity in [0, 1]: highest among them; seen_from metres: where the robot was; view: the
    frame of the detection. supported: whether the map agrees; if not, the points are those on
    obstacles. independent: whether the detector does not read the map's features.
    """

    xyz: tuple[float, float, float]
    cells: WorldCells
    score: float
    similarity: float
    seen_from: tuple[float, float]
    view: PictureOfObject | None = None
    supported: bool = True
    independent: bool = True

    @property
    def weight(self) -> float:
        """What it counts for the object's place: errors of position grow with the distance."""
        away_m = float(np.hypot(self.xyz[0] - self.seen_from[0], self.xyz[1] - self.seen_from[1]))
        return 1.0 / max(away_m, LEAST_DISTANCE_M) ** 2


@dataclass(frozen=True, slots=True)
class ObjectCandidate:
    """Sightings of one object.

    xyz: their running mean, the near and recent ones first, metres, and its weight; seen_from:
    the latest positions of the robot; contradictions: frames in which another name was detected
    there and this one was not; recent: the last ``RECENT_SIGHTINGS`` sightings; best_view: the
    frame with the highest score of the detector; supported: whether the map agrees; near_views:
    in how many of them it was detected; independent: whether a detector found it that does not
    read the map's features.
    """

    xyz: tuple[float, float, float]
    cells: WorldCells
    sightings: int
    score: float
    similarity: float
    seen_from: tuple[tuple[float, float], ...]
    contradictions: int = 0
    recent: tuple[Sighting, ...] = ()
    best_view: PictureOfObject | None = None
    weight: float = 0.0
    supported: bool = True
    near_views: tuple[ViewpointTally, ...] = ()
    independent: bool = True

    @property
    def agreement(self) -> Agreement:
        """How far the map agrees with the detector."""
        if not self.supported:
            return Agreement.DETECTOR
        return Agreement.MAP if self.independent else Agreement.SAME_FEATURES

    @property
    def surface(self) -> WorldCells:
        """World cells that the recent sightings agree on; all cells where there are too few.

        A stray point, on the floor or on a table before the object, would decide how near the
        robot drives. A cell needs two sightings and its share of the votes, in which one from
        2 m counts as four from 4 m.
        """
        counts: Counter[tuple[int, int]] = Counter()
        votes: dict[tuple[int, int], float] = {}
        for sighting in self.recent:
            counts.update(sighting.cells)
            votes.update({cell: votes.get(cell, 0.0) + sighting.weight for cell in sighting.cells})
        needed = SURFACE_SHARE * max(votes.values(), default=0.0)
        agreed = frozenset(c for c, vote in votes.items() if counts[c] > 1 and vote >= needed)
        return agreed or self.cells

    @property
    def near_frames(self) -> int:
        """Frames that were near views of it."""
        return sum(tally.frames for tally in self.near_views)

    @property
    def exhausted_viewpoints(self) -> list[tuple[float, float]]:
        """Places, in metres, from which more views of it show nothing new."""
        if self.supported:
            return []
        return [tally.xy for tally in self.near_views if tally.frames >= VIEWS_PER_VIEWPOINT]

    def distance_m(self, xyz: tuple[float, float, float]) -> float:
        """Horizontal distance of a point from the mean, metres."""
        return float(np.hypot(self.xyz[0] - xyz[0], self.xyz[1] - xyz[1]))


@dataclass(frozen=True, slots=True)
class Consensus:
    """Cells of a detection must be in the top 5 percent of the map (paper), and have the
    similarity ``floor`` too: every map has a top 5 percent."""

    percentile: float = 95.0
    floor: float = 0.3


CONSENSUS = Consensus()


def similarity_threshold(similarity: F32, consensus: Consensus) -> float:
    """The similarity that a cell must have: the percentile of observed cells, at least the floor.

    similarity (nx, ny), NaN where not observed; infinity if nothing was observed.
    """
    observed = similarity[np.isfinite(similarity)]
    if observed.size == 0:
        return float("inf")
    return max(float(np.percentile(observed, consensus.percentile)), consensus.floor)


def sightings_of(
    name: str,
    detections: Detections,
    map_view: MapView,
    *,
    seen_from: tuple[float, float],
    consensus: Consensus = CONSENSUS,
) -> tuple[Sighting, ...]:
    """The detections of ``name``: those that pass the consensus test are supported.

    One that does not has the cells of obstacles that it covers, and is left out without any.
    """
    threshold = similarity_threshold(map_view.similarity, consensus)
    found = []
    for index, detected in enumerate(detections.names):
        if not same_name(detected, name):
            continue
        points = detections.points_map[detections.point_owner == index].astype(np.float64)
        cells = map_view.grid.cells(points)
        inside = map_view.grid.contains(cells)
        points, cells = points[inside], cells[inside]
        x, y = cells.T
        # NaN compares false. Cells where another name is more similar count for that name.
        backed = (map_view.similarity[x, y] >= threshold) & (map_view.margin[x, y] >= 0)
        covered = len(np.unique(cells, axis=0))
        backing = len(np.unique(cells[backed], axis=0))
        supported = covered > 0 and backing >= max(1.0, SUPPORT_FRACTION * covered)
        own = backed if supported else map_view.occupancy[x, y] == Occupancy.OCCUPIED
        if own.any():
            mx, my, mz = (float(value) for value in points[own].mean(axis=0))
            found.append(
                Sighting(
                    (mx, my, mz),
                    map_view.world_cells(np.unique(cells[own], axis=0)),
                    float(detections.scores[index]),
                    float(np.nan_to_num(map_view.similarity[x[own], y[own]]).max()),
                    seen_from,
                    _view_of(detections, index),
                    supported,
                    detections.independent,
                )
            )
    return tuple(found)


def merge_sightings(
    candidates: tuple[ObjectCandidate, ...], sightings: Iterable[Sighting]
) -> tuple[ObjectCandidate, ...]:
    """Merge each sighting with the candidate of the same object, or start a candidate."""
    known = list(candidates)
    for sighting in sightings:
        for index, candidate in enumerate(known):
            if is_same_object(candidate, sighting):
                known[index] = _merged(candidate, sighting)
                break
        else:
            known.append(
                ObjectCandidate(
                    sighting.xyz,
                    sighting.cells,
                    1,
                    sighting.score,
                    sighting.similarity,
                    (sighting.seen_from,),
                    recent=(sighting,),
                    best_view=sighting.view,
                    weight=sighting.weight,
                    supported=sighting.supported,
                    independent=sighting.independent,
                )
            )
    known.sort(key=lambda candidate: (-candidate.sightings, candidate.xyz))
    return tuple(known[:MAX_CANDIDATES])


def is_same_object(candidate: ObjectCandidate, sighting: Sighting) -> bool:
    """Whether they are one object: within ``MERGE_M``, or on common cells."""
    return candidate.distance_m(sighting.xyz) <= MERGE_M or not candidate.cells.isdisjoint(
        sighting.cells
    )


def _merged(candidate: ObjectCandidate, sighting: Sighting) -> ObjectCandidate:
    best, view = candidate.best_view, sighting.view
    total = FORGETTING * candidate.weight + sighting.weight
    share = sighting.weight / total
    mean = np.asarray(candidate.xyz) * (1 - share) + np.asarray(sighting.xyz) * share
    cells = candidate.cells | sighting.cells
    return replace(
        candidate,
        xyz=(float(mean[0]), float(mean[1]), float(mean[2])),
        cells=cells if len(cells) <= MAX_CELLS else candidate.cells,
        sightings=candidate.sightings + 1,
        weight=total,
        score=max(candidate.score, sighting.score),
        similarity=max(candidate.similarity, sighting.similarity),
        seen_from=(*candidate.seen_from[-4:], sighting.seen_from),
        recent=(*candidate.recent, sighting)[-RECENT_SIGHTINGS:],
        best_view=view if view and view.is_better_than(best) else best,
        independent=candidate.independent or sighting.independent,
    )


def _view_of(detections: Detections, index: int) -> PictureOfObject:
    x0, y0, x1, y1 = (float(side) * detections.picture_scale for side in detections.boxes_px[index])
    return PictureOfObject(
        score=float(detections.scores[index]),
        stamp_ns=detections.stamp_ns,
        box_px=(x0, y0, x1, y1),
        picture=detections.picture,
    )
