"""A drive to a place over HTTP, with the stop that every search has."""

from __future__ import annotations

import pytest

from tests.end_to_end.system import System

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

PLACE_M = [5.4, 4.0]  # in the hallway of the apartment of seed 1, 3.5 m from the start
DRIVE_S = 120.0  # on shared cores, with waits for the map


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
    system.suspend("mapper")
    system.until(lambda: system.monitor.stands, "the robot stops without a map")
    report = system.http.get(address).json()
    assert (report["kind"], report["active"]) == ("go_to", True)
    assert report["reason"].startswith("waiting: ")
    system.resume("mapper")
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
