"""A find on its whole way: from the planning thread over the map to HTTP, and past restarts."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import ClassVar

import pytest
from starlette.testclient import TestClient

from onemap_mapper.config import MapperConfig
from onemap_mapper.service import build as build_mapper
from onemap_planner.config import PlannerConfig
from onemap_planner.motion.staleness import StalenessParams
from onemap_planner.service import Planner
from onemap_planner.world.candidates import ObjectCandidate, PictureOfObject
from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import Odometry, SearchRequest
from tests.gateway.fakes import client_on
from tests.mapper.test_service import Rig, sofa_ahead
from tests.memory_bus import MemoryBus
from tests.planner.simulated_services import confirm

JPEG = b"\xff\xd8 a JPEG \xff\xd9"
STEPS, PATIENCE_S = 400, 90.0  # every wait ends long before both: steps of a busy machine are slow


# The robot's clock stands still between the frames of a starved process.
class Patient(StalenessParams):
    max_odometry_age_s: ClassVar[float] = PATIENCE_S
    min_map_age_s: ClassVar[float] = PATIENCE_S
    max_map_age_s: ClassVar[float] = PATIENCE_S


SOFA = ObjectCandidate(
    (2.0, 0.0, 0.4),
    frozenset({(19, 0), (20, 0), (20, 1)}),
    4,
    0.9,
    0.8,
    ((0.0, 0.0),),
    best_view=PictureOfObject(0.9, 123, (1.0, 2.0, 3.0, 4.0), JPEG),
)


class Robot:
    """A mapper and a planner with a robot that stands before a sofa, and a client over HTTP."""

    def __init__(self, folder: Path, http: TestClient, rig: Rig) -> None:
        self.folder, self.http, self.rig = folder, http, rig
        config = PlannerConfig(state_dir=folder / "searches", staleness=Patient())
        self.planner = Planner(rig.router.bus("planner"), config)
        self._odometry = rig.client.publish(keys.ROBOT_ODOMETRY)
        self._count = count()

    def frame(self) -> None:
        """One image, one pose, one command."""
        sequence = next(self._count)
        self.rig.feed(sofa_ahead(sequence))
        pose = pose_2d(1.0, 0.0, 0.0)  # in reach of the sofa
        self._odometry.put(Odometry(sequence, sofa_ahead(sequence).stamp_ns, pose, 0.0, 0.0))
        self.planner.step(0.0)
        self.planner.step(0.05)

    def until(self, reached: Callable[[], object]) -> None:
        deadline_s, steps = time.monotonic() + PATIENCE_S, 0
        while not reached():
            late = time.monotonic() > deadline_s and steps > STEPS
            assert not late, f"it did not happen in {steps} steps and {PATIENCE_S:g} s"
            self.frame()
            steps += 1

    def objects(self) -> list[dict[str, object]]:
        listed: list[dict[str, object]] = self.http.get("/v1/objects").json()["objects"]
        return listed


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    rig = Rig(tmp_path / "maps")
    rig.embed()
    with client_on(rig.router) as http:
        made = Robot(tmp_path / "maps", http, rig)
        yield made
        made.planner.close()


def restarted(robot: Robot) -> MemoryBus:
    """The mapper is gone, and another one runs on the same folder."""
    robot.rig.router.servers[keys.MAP_OBJECTS.key][0][0].close()
    assert robot.http.get("/v1/objects").status_code == 503
    bus = robot.rig.router.bus("mapper")
    robot.rig.mapper = build_mapper(bus, MapperConfig(map_folder=robot.folder))
    return bus


def test_a_confirmed_object_is_there_for_clients_and_after_a_restart(robot: Robot) -> None:
    robot.until(lambda: robot.rig.mapper.health().ready)
    robot.rig.client.call(keys.SEARCH_START, SearchRequest(("sofa",)))
    confirm(robot.planner, SOFA)
    robot.until(robot.objects)
    (sofa,) = robot.objects()
    assert (sofa["name"], sofa["position_m"]) == ("sofa", [2.0, 0.0, 0.4])
    assert (sofa["score"], sofa["times_found"]) == (0.8, 1)
    assert sofa["extent_m"] == pytest.approx([1.9, 0.0, 2.1, 0.2])
    assert robot.http.get(str(sofa["picture"])).content == JPEG
    restarted(robot)
    assert robot.objects() == [sofa]
    assert robot.http.get(str(sofa["picture"])).content == JPEG
