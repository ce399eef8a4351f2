"""Replies and announcements: messages made from the state of the map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
    scoring_at_least,
)
from onemap_mapper.query.scores import KnownScores, MapScores, ScoredChanges, ScoredVersion
from onemap_mapper.query.similarity import CellScores, TextQuery, against, guiding, ranks
from onemap_mapper.query.verdicts import FloorCoverage, area_mask, frontier_worths, judge
from onemap_shared.colours import likeness
from onemap_shared.geometry import F32, U8
from onemap_shared.joint_belief import Layers, by_rank, joint_belief, place_masks, place_weights
from onemap_shared.messages import (
    NO_VIEW,
    RANKS,
    AnsweredQuery,
    Detail,
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
from onemap_shared.places import NOWHERE

NO_GRID: F32 = np.zeros((0, 0), np.float32)
NO_RANKS: U8 = np.zeros((0, 0), np.uint8)


def similarity_reply(
    scored: ScoredVersion, *, request: SimilarityRequest, places: MapPlaces = NOWHERE
) -> SimilarityReply:
    """Ranked regions that score at least the text's floor, and the grid if requested.

    scored: a map that is not empty, with the scores of the text, then those of its negatives and
    of the anchors of its detail. places: of the map, if the detail names any.
    The verdict is left to ``judged``.
    """
    version, (own, *others) = scored.version, scored.texts
    count = len(others) - len(request.detail.anchors)
    negatives, anchors = others[:count], others[count:]
    query = own.query
    grid_scores = version.to_grid(against(own, negatives).scores if negatives else own.scores)
    if request.detail.located or request.detail.colour:
        grid_scores = _described(
            version, grid_scores, (own, *anchors), detail=request.detail, places=places
        )
    if (inside := area_mask(version.grid, request.area_m)) is not None:
        grid_scores = np.where(inside, grid_scores, np.float32(np.nan))
    regions = _regions_of(version, grid_scores, request, calibrated=query.calibrated)
    best_score = min(float(regions.scores[0]), 1.0) if len(regions.scores) else 0.0  # rounding
    regions = scoring_at_least(regions, scored.floor)
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
        calibrated=query.has_probabilities,
    )


def _described(
    version: MapVersion,
    scores: F32,
    texts: Sequence[CellScores],
    *,
    detail: Detail,
    places: MapPlaces,
) -> F32:
    """The scores (nx, ny) of the first text, joined with the belief in places, anchors, colour."""
    masks = place_masks(detail, places, version.grid)
    target, *others = (_layers(version, text) for text in texts)
    joint = joint_belief(
        target,
        dict(zip(detail.anchors, others, strict=True)),
        detail,
        places=place_weights(detail, masks, version.grid),
        cell_size_m=version.grid.cell_size_m,
        likeness=version.likeness(detail.colour),
    )
    return joint.similarity(scores)


def _layers(version: MapVersion, text: CellScores) -> Layers:
    """What the map says of an object, by rank if its scores are no probabilities."""
    rank = version.to_grid((ranks(guiding(text)) - np.float32(1.0)) / np.float32(RANKS - 1))
    return Layers(
        version.to_grid(text.scores) if text.query.has_probabilities else by_rank(rank), rank
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
    verdict = judge(reply.best_score, coverage, worths=worths, found_score=found_score)
    return replace(reply, verdict=verdict)


def answered(request: SimilarityRequest, reply: SimilarityReply) -> AnsweredQuery:
    """What was asked and answered, for recordings."""
    x_y = tuple(map(float, reply.centres_m[0])) if len(reply.centres_m) else ()
    return AnsweredQuery(
        text=request.text,
        negatives=request.negatives,
        area_m=request.area_m,
        revision=reply.revision,
        stamp_ns=reply.stamp_ns,
        encoder_id=reply.encoder_id,
        verdict=reply.verdict.verdict,
        best_score=reply.best_score,
        centre_m=x_y,
    )


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
