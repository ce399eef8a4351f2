"""The mapper hangs while the robot drives: it stops, and arrives when the map is back."""

from __future__ import annotations

import time

import pytest

from onemap_shared import keys
from onemap_shared.messages import TruthRequest
from tests.end_to_end.system import PATIENCE_S, System

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PLACE_M = [5.4, 4.0]  # in the hallway of the apartment of seed 1, 3.5 m from the start
DRIVE_S = 120.0  # on shared cores, with waits for the map
RARE = ("guitar", "bicycle", "suitcase", "teddy bear", "washing machine", "piano")


def absent_object(system: System) -> str:
    """An object that the scene does not have: the search goes on through all tests."""
    bus = system.monitor.bus
    categories = bus.call(keys.ROBOT_TRUTH, TruthRequest(RARE[0], 0.0, 0.0), PATIENCE_S).categories
    return next(name for name in RARE if name not in categories)


def views(system: System, kind: str) -> float:
    beat = system.monitor.beats.get("planner")
    return 0.0 if beat is None else beat.metrics[f"views_{kind}"]


def test_a_drive_stops_while_the_mapper_hangs_and_arrives_after_it(system: System) -> None:
    started = system.http.post("/v1/searches", json={"go_to_m": PLACE_M})
    assert started.status_code == 201
    address = started.headers["Location"]
    system.until(lambda: system.monitor.moves, "the robot moves", DRIVE_S)
    system.until(lambda: views(system, "changed") > 0, "views are asked for as what changed")
    whole = views(system, "whole")
    seen = system.monitor.beats["perception"].progress
    system.suspend("mapper")
    system.until(lambda: system.monitor.stands, "the robot stops without a map")
    before = system.monitor.revision
    assert before is not None
    report = system.http.get(address).json()
    assert (report["kind"], report["active"]) == ("go_to", True)
    assert report["reason"].startswith("waiting for ")
    system.until(lambda: system.lacks("mapper"), "/readyz names the mapper")
    assert revision_age_s(system) > 1.0
    system.until(lambda: system.monitor.beats["perception"].progress > seen + 20, "frames go on")
    resumed_ns = time.time_ns()
    system.resume("mapper")
    system.until(lambda: shows_what_was_after(system, resumed_ns), "the map is fresh again")
    after = system.monitor.revision
    assert after is not None
    fused, passed = after.frames_fused - before.frames_fused, after.sequence - before.sequence
    assert fused < passed / 2  # the frames of the pause were skipped
    system.until(lambda: not system.http.get(address).json()["active"], "it arrives", DRIVE_S)
    report = system.http.get(address).json()
    assert (report["state"], report["place_m"]) == ("arrived", PLACE_M), report["reason"]
    (result,) = report["results"]
    x_m, y_m = result["end_xy_m"]
    assert abs(x_m - PLACE_M[0]) + abs(y_m - PLACE_M[1]) < 0.4
    assert (result["name"], result["outcome"]) == ("", "arrived")
    # Replies that the hanging mapper did not send cost no whole view.
    assert views(system, "whole") == whole > 0
    assert views(system, "changed") > 20


def revision_age_s(system: System) -> float:
    """The age of the newest map revision in /v1/status."""
    streams = system.http.get("/v1/status").json()["streams"]
    age_s: float = next(stream["age_s"] for stream in streams if stream["name"] == "revision")
    return age_s


def shows_what_was_after(system: System, stamp_ns: int) -> bool:
    """Whether the map holds a frame of after ``stamp_ns``."""
    newest = system.monitor.revision
    return newest is not None and newest.stamp_ns > stamp_ns
