"""Answers of the map to "where is it?", as clients get them."""

from __future__ import annotations

from dataclasses import replace
from math import floor, isfinite
from typing import Any

import numpy as np

from onemap import replies
from onemap_gateway.present.formats import finite
from onemap_gateway.present.replies import age_s, reply_of
from onemap_shared.grid import onto
from onemap_shared.messages import (
    Holds,
    SearchView,
    SimilarityReply,
    Verdict,
    Whereabouts,
    evidence_missing,
)

IMAGE_SUBJECT = "what the image shows"  # in sentences, where a text is quoted


def query_result(reply: SimilarityReply, now_ns: int, *, subject: str) -> replies.QueryResult:
    """The verdict, the regions in order of their score, and the reason if there are none.

    subject: of its sentences.
    """
    sentence = verdict_sentence(reply, subject)
    regions = tuple(_region(reply, index) for index in range(len(reply.scores)))
    judged = reply.verdict
    return reply_of(
        replies.QueryResult,
        reply,
        verdict=judged.verdict,
        sentence=sentence[0].upper() + sentence[1:],
        regions=regions,
        looked=reply_of(
            replies.LookedArea,
            judged,
            share=judged.looked_share,
            looked_m2=round(judged.looked_m2, 2),
            not_looked_m2=round(judged.not_looked_m2, 2),
        ),
        age_s=age_s(reply.stamp_ns, now_ns),
        message="" if regions else no_match_message(reply, subject),
    )


def with_scores(view: SearchView, reply: SimilarityReply) -> SearchView:
    """The view with the scores of a reply with a grid, which may be of another revision."""
    similarity = onto(view.grid, reply.grid, reply.scores_grid, np.nan)
    return replace(view, text=reply.text, similarity=similarity)


def _region(reply: SimilarityReply, index: int) -> replies.Region:
    x_m, y_m, yaw_rad = reply.best_views[index].tolist()
    heights_m = reply.heights_m[index].tolist()
    last_seen_ns = int(reply.last_seen_ns[index])
    return replies.Region(
        rank=index + 1,
        centre_m=reply.centres_m[index].tolist(),
        extent_m=reply.extents_m[index].tolist(),
        outline_m=reply.outline_points_m[reply.outline_owner == index].tolist(),
        score=float(reply.scores[index]),
        variance=finite(float(reply.variances[index])),
        height_m=heights_m if isfinite(heights_m[0]) else None,
        last_seen_at=replies.rfc3339(replies.moment(last_seen_ns)) if last_seen_ns else None,
        best_view=replies.MapPose(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad) if isfinite(x_m) else None,
        **_told(reply.whereabouts[index]) if reply.whereabouts else {},
    )


def _told(where: Whereabouts) -> dict[str, Any]:
    """What is said of a region beside its place in metres."""
    return {
        "where": where.in_words,
        "picture": f"/v1/objects/{where.object_id}.jpg" if where.object_id else None,
        "conditions": tuple(reply_of(replies.ConditionReply, each) for each in where.conditions),
    }


def verdict_sentence(reply: SimilarityReply, subject: str) -> str:
    """The verdict in words."""
    judged, percent = reply.verdict, floor(reply.verdict.looked_share * 100)
    if len(reply.centres_m):
        x_m, y_m = reply.centres_m[0]
        best = reply.whereabouts[0] if reply.whereabouts else Whereabouts()
        place = f"{best.in_words}, at" if best.in_words else "at"
        where = f"is {place} ({x_m:.2f}, {y_m:.2f}) m"
        if judged.verdict is Verdict.FOUND:
            return f"{subject} {where}."
        if best.holds is not Holds.YES:
            return f"{reply.text!r} {where}, but {'; '.join(evidence_missing(best.conditions))}."
    if judged.verdict is Verdict.NOT_HERE:
        return f"{subject} is not here: {percent} % of the reachable area was looked at."
    sentence = f"{subject} was not seen, but only {percent} % of the reachable area was looked at"
    if judged.frontier_m:
        x_m, y_m = judged.frontier_m
        sentence += f"; look next beyond the edge of the map at ({x_m:.2f}, {y_m:.2f}) m"
    return sentence + "."


def no_match_message(reply: SimilarityReply, subject: str) -> str:
    """Why the result of a query is empty."""
    best = floor(reply.best_score * 100) / 100  # rounded down: it must not read like the floor
    sentence = f"Nothing on the map looks like {subject}"
    if reply.floor > 0:
        sentence += f": the best score is {best:.2f}, and answers begin at {reply.floor:.2f}"
    return sentence + "."
