"""Replies and announcements: messages made from the state of the map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.params import RegionParams
from onemap_mapper.regions import find_regions, region_threshold, scoring_at_least
from onemap_mapper.similarity import ScoreCache, TextQuery, ranks
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import (
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
) -> SimilarityReply:
    """Ranked regions that score at least the query's ``min_score``, and the grid if requested.

    The map must not be empty.
    """
    values = cache.scores(query, belief.store, belief.revision)
    grid_scores = belief.to_grid(values)
    limit = region_threshold(
        values,
        best_share=params.region_best_share,
        top_share=None if query.calibrated else params.region_top_share,
    )
    regions = find_regions(
        grid_scores,
        belief.to_grid(belief.store.confidence.reciprocal().cpu().numpy()),
        belief.grid,
        limit=max(limit, float(np.finfo(np.float32).tiny)),
        max_regions=request.max_regions,
    )
    best_score = min(float(regions.scores[0]), 1.0) if len(regions.scores) else 0.0  # rounding
    regions = scoring_at_least(regions, query.min_score)
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
    similarity, guidance = NO_GRID, NO_RANKS
    if query is not None:
        cells = cache.cell_scores(query, belief.store, belief.revision)
        similarity = belief.to_grid(cells.scores)
        guidance = np.nan_to_num(belief.to_grid(ranks(cells.cosines).astype(np.float32)))
        guidance = guidance.astype(np.uint8)
    elif text:  # a map without features: nothing was observed
        similarity = np.full(belief.grid.shape, np.nan, np.float32)
    rival = NO_GRID
    if rivals:
        each = [cache.scores(other, belief.store, belief.revision) for other in rivals]
        rival = belief.to_grid(np.max(each, axis=0))
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
