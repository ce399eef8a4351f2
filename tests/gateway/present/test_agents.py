"""What agents are told: what is so, and what a call did."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap.replies import SearchSnapshot
from onemap_gateway.present.agents import (
    map_reply,
    progress_summary,
    seen_object_reply,
    started_summary,
    stopped_summary,
)
from onemap_gateway.present.replies import map_object, map_statistics, search_snapshot
from onemap_shared.messages import SearchKind, SearchOrder, SearchState, SearchStatus
from tests.gateway.fakes import STAMP_NS, find_result, kept_object, search, search_view


def report(status: SearchStatus, seconds: int = 12) -> SearchSnapshot:
    return search_snapshot(status, STAMP_NS + seconds * 10**9)


def test_a_start_says_what_the_robot_does_and_for_how_long() -> None:
    two = replace(search(objects=("sofa", "bed")), order=SearchOrder.ANY)
    said = started_summary(report(two), 40.0, 300.0)
    assert "for 'sofa', 'bed' in the cheapest order: the robot drives now" in said
    assert "at most 40 m and 300 s" in said
    assert "order" not in started_summary(report(search()), 40.0, 300.0)


@pytest.mark.parametrize("state", [SearchState.FOUND, SearchState.FAILED])
def test_a_stop_that_came_too_late_says_so(state: SearchState) -> None:
    late = stopped_summary(report(search(state=state)), had_ended=False)
    assert f"had ended before as {state}: there was nothing to stop" in late
    cancelled = report(search(state=SearchState.CANCELLED))
    assert "nothing to stop" in stopped_summary(cancelled, had_ended=True)


def test_a_stop_keeps_what_was_found() -> None:
    status = replace(search(state=SearchState.CANCELLED), results=(find_result("sofa", 1.0, 2.0),))
    said = stopped_summary(report(status), had_ended=False)
    assert said.endswith("the robot brakes and stands. Found: 'sofa'.")


def test_a_drive_to_a_place_has_progress_too() -> None:
    status = replace(search(), objects=(), kind=SearchKind.GO_TO, place_m=(1.0, -2.0))
    said = progress_summary(report(status))
    assert said == (
        "The search s1 for the place x 1.00 m, y -2.00 m is exploring after 12 s and 0.0 m: "
        "Looking around."
    )


def test_an_object_without_a_picture_says_so() -> None:
    kept = map_object(replace(kept_object(), picture_bytes=0))
    assert seen_object_reply(kept).summary.endswith("there is no picture of it.")


def test_a_map_that_is_updated_has_no_problem() -> None:
    reply = map_reply(map_statistics(search_view(), None, STAMP_NS), None, "")
    assert (reply.ready, reply.problem) == (True, "")
    assert reply.summary.endswith("no pose of the robot is known.")
