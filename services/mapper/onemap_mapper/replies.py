"""Replies and announcements: messages made from the state of the map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.coverage import FloorCoverage
from onemap_mapper.height_answers import region_bands
from onemap_mapper.outlines import outline
from onemap_mapper.params import RegionParams, VerdictParams
from onemap_mapper.regions import (
    NO_REGIONS,
    Regions,
    find_regions,
    region_threshold,
    scoring_at_least,
)
from onemap_mapper.similarity import CellScores, ScoreCache, TextQuery, against, ranks
from onemap_mapper.verdicts import area_mask, frontier_worths, judge
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import (
    AnsweredQuery,
    MapRevision,
    MapSummary,
    SearchView,
    SimilarityReply,
    SimilarityRequest,
)

NO_GRID: F32 = np.zeros((0, 0), np.float32)
NO_RANKS: U8 = np.zeros((0, 0), np.uint8)


def similarity_reply(
    belief: BeliefMap,
    cache: ScoreCache,
    *,
    query: TextQuery,
    request: SimilarityRequest,
    params: RegionParams,
    negatives: Sequence[TextQuery] = (),
) -> SimilarityReply:
    """Ranked regions that score at least the query's ``min_score``, and the grid if requested.

    The map must not be empty. The verdict is left to ``judged``.
    """
    values = request_scores(belief, cache, query=query, negatives=negatives)
    grid_scores = belief.to_grid(values.scores)
    if (inside := area_mask(belief.grid, request.area_m)) is not None:
        grid_scores = np.where(inside, grid_scores, np.float32(np.nan))
    regions = _regions_of(belief, grid_scores, request, params, calibrated=query.calibrated)
    best_score = min(float(regions.scores[0]), 1.0) if len(regions.scores) else 0.0  # rounding
    regions = scoring_at_least(regions, query.min_score)
    outlines = [outline(cells, belief.grid) for cells in regions.cells]
    rows = [belief.tiles.rows(cells + belief.grid.origin_cell) for cells in regions.cells]
    log = belief.view_log
    return SimilarityReply(
        text=request.text,
        revision=belief.revision,
        stamp_ns=belief.stamp_ns,
        encoder_id=belief.encoder_id,
        centres_m=regions.centres_m,
        extents_m=regions.extents_m,
        scores=regions.scores,
        variances=regions.variances,
        grid=belief.grid,
        scores_grid=grid_scores if request.include_grid else NO_GRID,
        best_score=best_score,
        floor=query.min_score,
        nearest=query.nearest,
        outline_points_m=np.concatenate([np.zeros((0, 2), np.float32), *outlines]),
        outline_owner=np.repeat(
            np.arange(len(outlines), dtype=np.int32), [len(corners) for corners in outlines]
        ),
        last_seen_ns=np.array([log.last_seen_ns(each) for each in rows], np.int64),
        heights_m=region_bands(belief, regions.cells, grid_scores),
        best_views=np.array([log.best_view(each) for each in rows], np.float32).reshape(-1, 3),
    )


def request_scores(
    belief: BeliefMap, cache: ScoreCache, *, query: TextQuery, negatives: Sequence[TextQuery]
) -> CellScores:
    """Scores and cosines of a text at all slots, with its negatives as competitors."""
    own = cache.cell_scores(query, belief.store, belief.revision)
    others = [cache.cell_scores(each, belief.store, belief.revision) for each in negatives]
    return against(own, others) if others else own


def _regions_of(
    belief: BeliefMap,
    grid_scores: F32,
    request: SimilarityRequest,
    params: RegionParams,
    *,
    calibrated: bool,
) -> Regions:
    """The regions of scores (nx, ny), none where they are all NaN."""
    values = grid_scores[np.isfinite(grid_scores)]
    if values.size == 0:
        return NO_REGIONS
    limit = region_threshold(
        values,
        best_share=params.region_best_share,
        top_share=None if calibrated else params.region_top_share,
    )
    return find_regions(
        grid_scores,
        belief.to_grid(belief.store.confidence.reciprocal().cpu().numpy()),
        belief.grid,
        limit=max(limit, float(np.finfo(np.float32).tiny)),
        max_regions=request.max_regions,
    )


def cosine_grid(belief: BeliefMap, cache: ScoreCache, query: TextQuery) -> F32:
    """Cosines (nx, ny) of a text, NaN where nothing was observed."""
    return belief.to_grid(cache.cell_scores(query, belief.store, belief.revision).cosines)


def judged(
    reply: SimilarityReply,
    request: SimilarityRequest,
    coverage: FloorCoverage,
    cosines: F32,
    params: VerdictParams,
) -> SimilarityReply:
    """The reply with its verdict; needs no map, so it is computed without the map's lock.

    cosines (nx, ny) on the reply's grid: of the text, NaN where nothing was observed.
    """
    worths = frontier_worths(coverage, cosines, reply.grid, robot_xy_m=request.robot_xy_m)
    verdict = judge(reply.best_score, coverage, worths=worths, params=params)
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
    belief: BeliefMap,
    cache: ScoreCache,
    *,
    text: str,
    query: TextQuery | None,
    rivals: Sequence[TextQuery] = (),
) -> SearchView:
    """All layers over the map's bounding box, with the similarity if there is a query.

    ``rival`` holds each cell's best score over the rivals.
    """
    similarity, rival, guidance = NO_GRID, NO_GRID, NO_RANKS
    if query is not None:
        cells, *others = cache.scores_of_all([query, *rivals], belief.store, belief.revision)
        similarity = belief.to_grid(cells.scores)
        guidance = np.nan_to_num(belief.to_grid(ranks(cells.cosines).astype(np.float32)))
        guidance = guidance.astype(np.uint8)
        if others:
            rival = belief.to_grid(np.max([other.scores for other in others], axis=0))
    elif text:  # a map without features: nothing was observed
        similarity = np.full(belief.grid.shape, np.nan, np.float32)
    return SearchView(
        text=text,
        revision=belief.revision,
        sequence=belief.sequence,
        stamp_ns=belief.stamp_ns,
        grid=belief.grid,
        occupancy=belief.occupancy_grid(),
        layers=belief.layers(),
        similarity=similarity,
        rival=rival,
        guidance=guidance,
        calibrated=query is None or query.calibrated,
    )


def revision_of(
    belief: BeliefMap, *, update_ms: float, rate_hz: float, objects_version: int
) -> MapRevision:
    """The state of the map, published after every change."""
    return MapRevision(
        revision=belief.revision,
        sequence=belief.sequence,
        stamp_ns=belief.stamp_ns,
        encoder_id=belief.encoder_id,
        text_space=belief.text_space,
        frames_fused=belief.frames_fused,
        cells_observed=belief.store.count,
        memory_bytes=belief.memory_bytes,
        update_ms=update_ms,
        rate_hz=rate_hz,
        objects_version=objects_version,
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
