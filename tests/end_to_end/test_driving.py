"""What must stop or divert a driving robot, as real processes: a mapper that hangs, a slow
connection, a new zone."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.config import PREFIX
from onemap_shared.geometry import F64
from onemap_simulator.config import SimulatorConfig
from onemap_tools.processes.services import CORE
from tests.end_to_end.conftest import SIMULATOR
from tests.end_to_end.delaying_proxy import DelayingProxy
from tests.end_to_end.system import START_S, System, absent_object

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
AHEAD_M, HALF_M = 1.5, 0.25  # to the middle of the zone along the way, and half its side
LEAST_M = 0.9  # from the robot to the zone: room to stop when it hears of it
AFTERWARDS_M = 1.5  # that the robot still drives
COMMANDS = 60  # three seconds
DELAY_S = 0.6  # each way; longer ones are tried in simulated time
PLACE_M = [5.4, 4.0]  # in the hallway of the apartment of seed 1, 3.5 m from the start
DRIVE_S = 120.0  # on shared cores, with waits for the map


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[System, DelayingProxy]]:
    """Every service, and a simulated robot behind a proxy."""
    with System(tmp_path_factory.mktemp("slow"), CORE, {"simulator": SIMULATOR}) as system:
        host, port = system.endpoint.removeprefix("tcp/").split(":")
        proxy = DelayingProxy((host, int(port)))
        system.environment[f"{PREFIX}BUS__CONNECT"] = json.dumps([proxy.endpoint])
        system.start("simulator")
        del system.environment[f"{PREFIX}BUS__CONNECT"]
        system.until(system.is_ready, "frames go all the way to the map", START_S)
        yield system, proxy
        system.processes["simulator"].terminate()
        proxy.close()


def views(system: System, kind: str) -> float:
    beat = system.monitor.beats.get("planner")
    return 0.0 if beat is None else beat.metrics[f"views_{kind}"]


def test_a_drive_stops_while_the_mapper_hangs_and_arrives_after_it(
    slow: tuple[System, DelayingProxy],
) -> None:
    system, _ = slow
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


def collisions(system: System) -> float:
    return system.monitor.beats["simulator"].metrics["collisions"]


def test_a_connection_that_slows_down_stops_the_robot(slow: tuple[System, DelayingProxy]) -> None:
    system, proxy = slow
    started = system.http.post("/v1/searches", json={"object": absent_object(system)})
    assert started.status_code == 201, started.text
    search = f"/v1/searches/{started.json()['id']}"
    system.monitor.odometry.clear()
    system.until(lambda: system.monitor.moves, "the robot moves", START_S)
    commands = system.monitor.bus.subscribe(keys.ROBOT_CMD_VEL, capacity=1000)
    proxy.delay_s = DELAY_S

    def waits() -> bool:
        return "a command takes " in system.http.get(search).json()["reason"]

    system.until(waits, "the planner says how long a command takes")
    taken: list[m.VelocityCommand] = []
    while commands.take(0.0) is not None:
        pass
    while len(taken) < COMMANDS:
        taken += [command] if (command := commands.take(1.0)) else []
    assert [command for command in taken if command.moves] == []
    system.until(lambda: system.monitor.stands, "the robot stands", 10.0)
    assert collisions(system) == 0.0
    system.http.delete(search)
    proxy.delay_s = 0.0
    system.until(system.is_ready, "the robot is ready again", START_S)


def ahead_of(path: m.PlannedPath, robot_xy: F64) -> F64 | None:
    """A point (2,) on the way that is not too near, metres; None if the way is too short."""
    points = path.points_m.astype(np.float64)
    if path.motion != "drive" or len(points) < 2:
        return None
    along = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    point = np.array([np.interp(AHEAD_M, along, points[:, axis]) for axis in (0, 1)])
    near = np.abs(point - robot_xy).max() - HALF_M < LEAST_M
    return None if along[-1] < AHEAD_M or near else point


def xy_of(message: m.Odometry) -> F64:
    return message.T_map_body[:2, 3]


def outside_m(xy: F64, middle: F64) -> float:
    """Metres from a point to the square around ``middle``."""
    return float(np.linalg.norm(np.maximum(np.abs(xy - middle) - HALF_M, 0.0)))


def test_a_zone_across_the_way_is_not_entered(slow: tuple[System, DelayingProxy]) -> None:
    system, _ = slow
    monitor, paths, driven = system.monitor, list[m.PlannedPath](), list[m.Odometry]()
    monitor._threads += [
        monitor._follow(keys.SEARCH_PATH, paths.append),
        monitor._follow(keys.ROBOT_ODOMETRY, driven.append),
    ]
    place: list[F64] = []

    def drives_far() -> bool:
        if not paths or not driven or abs(driven[-1].linear_mps) < 0.2:
            return False
        point = ahead_of(paths[-1], xy_of(driven[-1]))
        place.extend([] if point is None else [point])
        return point is not None

    monitor.bus.call(
        keys.SEARCH_START, m.SearchRequest(("toilet", "bicycle", "guitar"), patience_s=60.0), 60.0
    )
    system.until(drives_far, "the robot drives along a way of 1.5 m", 240.0)
    x, y = place[0].tolist()
    corners = [(x - HALF_M, y - HALF_M), (x + HALF_M, y - HALF_M), (x + HALF_M, y + HALF_M)]
    corners.append((x - HALF_M, y + HALF_M))
    drawn = m.Place("wet floor", m.PlaceKind.KEEP_OUT, corners_m=tuple(corners))
    monitor.bus.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((drawn,)), 60.0)
    first = len(driven)

    def driven_on() -> bool:
        points = np.array([xy_of(each) for each in driven[first:]]).reshape(-1, 2)
        way_m = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        over = monitor.search is not None and not monitor.search.active
        return bool(way_m >= AFTERWARDS_M) or over

    system.until(driven_on, "the robot drives on, around the zone", 240.0)
    radius_m = SimulatorConfig().robot.radius_m
    nearest_m = min(outside_m(xy_of(each), place[0]) for each in driven)
    assert nearest_m >= radius_m
    monitor.bus.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(forgotten=("wet floor",)), 60.0)
