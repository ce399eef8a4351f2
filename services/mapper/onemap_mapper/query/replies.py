"""Replies and announcements: messages made from the state of the map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.tiles import AREA
from onemap_mapper.belief.version import MapVersion
from onemap_mapper.query.regions import (
    NO_REGIONS,
    Regions,
    find_regions,
    outline,
    region_bands,
    region_threshold,
    scored_by,
    scoring_at_least,
)
from onemap_mapper.query.scores import KnownScores, MapScores, ScoredChanges, ScoredVersion
from onemap_mapper.query.similarity import CellScores, TextQuery, against, guiding, ranks
from onemap_mapper.query.verdicts import FloorCoverage, frontier_worths, judge
from onemap_mapper.query.whereabouts import NOTHING_KNOWN, Knowledge, middle_m, whereabouts
from onemap_shared.colours import likeness
from onemap_shared.conditions import LIKELY, Surroundings, likeness_of, things_of
from onemap_shared.geometry import F32, U8, Bool
from onemap_shared.grid import area_mask
from onemap_shared.joint_belief import by_rank, joint_belief, place_masks, place_weights
from onemap_shared.messages import (
    NO_DETAIL,
    NO_VIEW,
    RANKS,
    Detail,
    Holds,
    Layer,
    MapPlaces,
    MapRevision,
    MapSummary,
    SearchView,
    SimilarityReply,
    SimilarityRequest,
    ViewChanges,
    ViewChangesRequest,
    ViewKey,
)

NO_GRID: F32 = np.zeros((0, 0), np.float32)
NO_RANKS: U8 = np.zeros((0, 0), np.uint8)
CHECKED = 20  # candidates that are checked, whatever few are asked for: what fails hides nothing
PREFERRED = (Holds.YES, Holds.NOT_KNOWN, Holds.NOT_CHECKED, Holds.NO)  # answers, in this order


@dataclass(frozen=True, slots=True)
class _Asked:
    """The scores of a query: of its text, with which its negatives compete, of the anchors of its
    detail by name, and of the landmarks by name."""

    own: CellScores
    anchors: Mapping[str, CellScores]
    landmarks: Mapping[str, CellScores]

    @classmethod
    def of(
        cls, texts: Sequence[CellScores], request: SimilarityRequest, landmarks: Sequence[str]
    ) -> _Asked:
        named = (*request.detail.anchors, *landmarks)
        own, *others = texts
        count = len(others) - len(named)
        scores = dict(zip(named, others[count:], strict=True))
        return cls(
            against(own, others[:count]) if count else own,
            {name: scores[name] for name in request.detail.anchors},
            {name: scores[name] for name in landmarks if scores[name].query.has_probabilities},
        )


def similarity_reply(
    scored: ScoredVersion,
    *,
    request: SimilarityRequest,
    known: Knowledge = NOTHING_KNOWN,
    landmarks: Sequence[str] = (),
) -> SimilarityReply:
    """Ranked regions that score at least the text's floor, and the grid if requested.

    scored: a map that is not empty, with the scores of the text, then those of its negatives, of
    the anchors of its detail, and of the landmarks. Regions that are as described come first, of
    ``CHECKED`` or more, then those of the colour. The verdict is left to ``judged``.
    """
    version, asked = scored.version, _Asked.of(scored.texts, request, landmarks)
    described = request.detail != NO_DETAIL or bool(request.negatives)
    most = max(request.max_regions, CHECKED) if described else request.max_regions
    sought = replace(request, max_regions=most)
    regions, best_score, grid_scores = _candidates(scored, asked, sought, known.places)
    around = _surroundings(version, asked, request.detail, known) if described else None
    where = whereabouts(
        version,
        request,
        regions.cells,
        around,
        known=known,
        landmarks={name: version.to_grid(text.scores) for name, text in asked.landmarks.items()},
    )

    def rank(index: int) -> tuple[int, bool]:
        coloured = likeness_of(regions.cells[index], around) >= LIKELY
        return PREFERRED.index(where[index].holds), not coloured

    order = sorted(range(len(where)), key=rank)[: request.max_regions]
    regions = regions.taken(order)
    outlines = [outline(cells, version.grid) for cells in regions.cells]
    rows = [version.tiles.rows(cells + version.grid.origin_cell) for cells in regions.cells]
    log = version.view_log
    return SimilarityReply(
        text=request.text,
        revision=version.revision,
        stamp_ns=version.stamp_ns,
        encoder_id=version.encoder_id,
        centres_m=regions.centres_m,
        extents_m=regions.extents_m,
        scores=regions.scores,
        variances=regions.variances,
        grid=version.grid,
        scores_grid=grid_scores if request.include_grid else NO_GRID,
        best_score=best_score,
        floor=scored.floor,
        outline_points_m=np.concatenate([np.zeros((0, 2), np.float32), *outlines]),
        outline_owner=np.repeat(
            np.arange(len(outlines), dtype=np.int32), [len(corners) for corners in outlines]
        ),
        last_seen_ns=np.array([log.last_seen_ns(each) for each in rows], np.int64),
        heights_m=region_bands(version, regions.cells, grid_scores),
        best_views=np.array([log.best_view(each) for each in rows], np.float32).reshape(-1, 3),
        calibrated=asked.own.query.has_probabilities,
        whereabouts=tuple(where[index] for index in order),
    )


def _candidates(
    scored: ScoredVersion, asked: _Asked, request: SimilarityRequest, places: MapPlaces
) -> tuple[Regions, float, F32]:
    """Regions that may be what is asked for, the score of the best, also below the floor, and the
    scores (nx, ny) by which they are ranked.

    A described one is where the joint belief is, scores by its own name, and would be a region of
    that alone: the curtain is no chair, though it is by the window. Where no such thing is, what is
    elsewhere is answered.
    """
    version, detail = scored.version, request.detail
    inside, calibrated = area_mask(version.grid, request.area_m), asked.own.query.calibrated
    own_scores = _within(inside, version.to_grid(asked.own.scores))
    if not (detail.located or detail.colour):
        regions = _regions_of(version, own_scores, request, calibrated=calibrated)
        best_score = min(float(regions.scores.max(initial=0.0)), 1.0)  # rounding
        return scoring_at_least(regions, scored.floor), best_score, own_scores
    joint = joint_belief(
        {name: _similarity(version, scores) for name, scores in asked.anchors.items()},
        detail,
        places=place_weights(detail, place_masks(detail, places, version.grid), version.grid),
        cell_size_m=version.grid.cell_size_m,
        likeness=version.likeness(detail.colour),
    )
    grid_scores = joint.similarity(own_scores)
    regions = _regions_of(version, grid_scores, request, calibrated=calibrated)
    regions = scored_by(regions, own_scores)
    best_score = min(float(regions.scores.max(initial=0.0)), 1.0)
    values = own_scores[np.isfinite(own_scores)]
    least = region_threshold(values, calibrated=calibrated) if values.size else 0.0
    regions = scoring_at_least(regions, max(scored.floor, least))
    if not regions.cells:
        regions = _regions_of(version, own_scores, request, calibrated=calibrated)
        regions = scoring_at_least(regions, scored.floor)
    return regions, best_score, grid_scores


def _surroundings(
    version: MapVersion, asked: _Asked, detail: Detail, known: Knowledge
) -> Surroundings:
    anchors = asked.anchors.items()
    return Surroundings(
        version.grid,
        version.occupancy_grid(),
        (version.layers() & Layer.EXPLORED) > 0,
        _similarity(version, asked.own),
        {name: _similarity(version, scores) for name, scores in anchors},
        known.places,
        place_masks(detail, known.places, version.grid),
        place_masks(detail, known.places, version.grid, settled=True),
        things_of(known.finds, detail.anchors, version.grid),
        version.likeness(detail.colour),
        partial(middle_m, version),
    )


def _within(inside: Bool | None, grid_scores: F32) -> F32:
    """The scores (nx, ny) of an area, NaN beside it; None: of all of the map."""
    if inside is None:
        return grid_scores
    return np.where(inside, grid_scores, np.float32(np.nan)).astype(np.float32)


def _similarity(version: MapVersion, text: CellScores) -> F32:
    """Similarity (nx, ny) to an object, by rank if its scores are no probabilities."""
    if text.query.has_probabilities:
        return version.to_grid(text.scores)
    return by_rank(
        version.to_grid((ranks(guiding(text)) - np.float32(1.0)) / np.float32(RANKS - 1))
    )


def _regions_of(
    version: MapVersion,
    grid_scores: F32,
    request: SimilarityRequest,
    *,
    calibrated: bool,
) -> Regions:
    """The regions of scores (nx, ny), none where they are all NaN."""
    values = grid_scores[np.isfinite(grid_scores)]
    if values.size == 0:
        return NO_REGIONS
    limit = region_threshold(values, calibrated=calibrated)
    return find_regions(
        grid_scores,
        version.to_grid(version.variances),
        version.grid,
        limit=max(limit, float(np.finfo(np.float32).tiny)),
        max_regions=request.max_regions,
    )


def judged(
    reply: SimilarityReply,
    request: SimilarityRequest,
    coverage: FloorCoverage,
    scored: ScoredVersion,
    found_score: float,
) -> SimilarityReply:
    """The reply with its verdict; ``scored`` is what the reply was made of.

    found_score: from which a thing is found, unless the floor was fitted to the map.
    """
    if scored.texts[0].query.fits_floor:
        found_score = scored.floor
    cosines = scored.version.to_grid(scored.texts[0].cosines)
    worths = frontier_worths(coverage, cosines, reply.grid, robot_xy_m=request.robot_xy_m)
    best = dict.fromkeys(Holds, 0.0)
    for where, score in zip(reply.whereabouts, reply.scores.tolist(), strict=True):
        best[where.holds] = max(best[where.holds], score)
    open_score = max(best[Holds.NOT_CHECKED], best[Holds.NOT_KNOWN])
    verdict = judge(
        best[Holds.YES],
        coverage,
        worths=worths,
        found_score=found_score,
        may_be=open_score >= found_score,
    )
    return replace(reply, verdict=verdict)


def search_view(
    scored: ScoredVersion, *, text: str, negatives: int = 0, colour: str = ""
) -> SearchView:
    """All layers over the map's bounding box, with the similarity if the text has scores.

    scored: with the scores of the text, then those of its ``negatives``, which compete with it,
    then those of its rivals; ``rival`` holds each cell's best score over these. colour: of the
    object, with which each cell's is compared.
    """
    version, similarity, rival, guidance = scored.version, NO_GRID, NO_GRID, NO_RANKS
    calibrated = True
    if scored.texts:
        own, others = _competing(scored.texts, negatives)
        calibrated = own.query.has_probabilities
        similarity = version.to_grid(own.scores)
        guidance = np.nan_to_num(version.to_grid(ranks(guiding(own)).astype(np.float32)))
        guidance = guidance.astype(np.uint8)
        if others:
            rival = version.to_grid(np.max([other.scores for other in others], axis=0))
    elif text:  # a map without features: nothing was observed
        similarity = np.full(version.grid.shape, np.nan, np.float32)
    return SearchView(
        text=text,
        revision=version.revision,
        sequence=version.sequence,
        stamp_ns=version.stamp_ns,
        grid=version.grid,
        occupancy=version.occupancy_grid(),
        layers=version.layers(),
        similarity=similarity,
        rival=rival,
        guidance=guidance,
        calibrated=calibrated,
        tops_dm=version.obstacle_tops_dm(),
        likeness=NO_GRID if (fits := version.likeness(colour)) is None else fits,
    )


def revision_of(
    belief: BeliefMap,
    *,
    update_ms: float,
    rate_hz: float,
    objects_version: int,
    robot: int,
) -> MapRevision:
    """The state of the map for a robot, published after every change."""
    history = belief.history(robot)
    return MapRevision(
        revision=belief.revision,
        sequence=history.sequence,
        stamp_ns=history.stamp_ns,
        encoder_id=belief.encoder_id,
        text_space=belief.text_space,
        frames_fused=belief.frames_fused,
        cells_observed=belief.store.count,
        memory_bytes=belief.memory_bytes,
        update_ms=update_ms,
        rate_hz=rate_hz,
        objects_version=objects_version,
        offset_m=history.offset_m,
    )


def summary_of(belief: BeliefMap) -> MapSummary:
    """Size and encoder of the map; the service adds the file's path and size."""
    return MapSummary(
        path="",
        encoder_id=belief.encoder_id,
        text_space=belief.text_space,
        cell_size_m=belief.params.cell_size_m,
        cells_observed=belief.store.count,
        frames_fused=belief.frames_fused,
    )


LAYERS_ONLY = "layers"  # the query of a view without scores


class ViewReplies:
    """Answers one map's requests for changes. It keeps nothing of its callers.

    map_id: of this map in this process; no other one had it.
    """

    def __init__(self, scores: MapScores, map_id: str) -> None:
        self._scores, self.map_id = scores, map_id

    def reply(
        self, request: ViewChangesRequest, queries: Sequence[TextQuery], robot: int = 0
    ) -> ViewChanges:
        """The changes for a robot since the state that its request names, or everything.

        queries: the text, then its negatives, then those of its rivals that are known; none in an
        empty map.
        """
        negatives, colour = len(request.negatives), request.colour
        kind = f"{negatives}{colour}"
        known = self._known(request.have, kind)
        scored = self._scores.changes(queries, known, robot, negatives=negatives)
        cells, query = scored.cells, _query_key(scored.serials, kind)
        tiles, first = np.unique(cells.rows // AREA, return_index=True)
        changed = np.zeros((len(tiles), AREA), bool)
        owner = np.repeat(np.arange(len(tiles)), np.diff(np.append(first, len(cells.rows))))
        changed[owner, cells.rows % AREA] = True
        since = cells.since
        return ViewChanges(
            text=request.text,
            base=NO_VIEW if since is None else ViewKey(self.map_id, query, since),
            key=ViewKey(self.map_id, query, cells.number),
            revision=cells.revision,
            sequence=cells.sequence,
            stamp_ns=cells.stamp_ns,
            grid=cells.grid,
            tiles=cells.places[tiles].astype(np.int32),
            cells=np.packbits(changed, axis=1),
            occupancy=cells.occupancy,
            layers=cells.layers,
            values=_values(scored, negatives, colour),
            rank_limits=scored.rank_limits,
            calibrated=scored.texts[0].query.has_probabilities if scored.texts else True,
            coloured=bool(colour and scored.texts),
        )

    def _known(self, have: ViewKey, kind: str) -> KnownScores:
        """What a caller holds, as this map counts; nothing that fits if it is of another one."""
        serials = _serials(have.query, kind) if have.map_id == self.map_id else None
        return KnownScores((-1,), -1) if serials is None else KnownScores(serials, have.number)


def _query_key(serials: tuple[int, ...], kind: str) -> str:
    """kind: number of negatives, and colour."""
    return ".".join(map(str, (kind, *serials))) if serials else LAYERS_ONLY


def _serials(query: str, kind: str) -> tuple[int, ...] | None:
    """The serials of a query's key, None if it is no such key, or of another kind."""
    if query == LAYERS_ONLY:
        return ()
    known, *parts = query.split(".")
    if known != kind or not all(part.isdecimal() for part in parts):
        return None
    return tuple(map(int, parts))


def _competing(
    texts: Sequence[CellScores], negatives: int
) -> tuple[CellScores, Sequence[CellScores]]:
    """The first text with its negatives against it, and the rivals, which come after these."""
    own, others = texts[0], texts[1:]
    return (against(own, others[:negatives]) if negatives else own), others[negatives:]


def _values(scored: ScoredChanges, negatives: int, colour: str) -> F32:
    """Score, cosine, the best rival's score and the colour's likeness (p, m) of the observed ones
    of the cells."""
    if not scored.texts:
        return np.zeros((0, 0), np.float32)
    own, rivals = _competing(scored.texts, negatives)
    rows = [own.scores, guiding(own)]
    if rivals:
        rows.append(np.max([rival.scores for rival in rivals], axis=0))
    if colour:
        rows.append(likeness(scored.cells.colours, colour))
    return np.stack(rows)
