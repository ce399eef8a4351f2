"""A mapper that answers late, in virtual time: how old what moves the robot shows."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest

from onemap_planner.config import PlannerConfig
from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import (
    Detail,
    MapRevision,
    MapSummary,
    Odometry,
    Relation,
    RelationKind,
    SearchId,
    SearchRequest,
    SearchView,
    SearchViewRequest,
)
from onemap_shared.places import NOWHERE
from onemap_tools.virtual.network import VirtualBus, VirtualRouter
from onemap_tools.virtual.scheduler import VirtualWorld
from tests.planner.drawn_maps import search_view_of
from tests.planner.simulated_services import ROOM, embeddings, moves

LAMP = SearchRequest(
    ("lamp",), details=(Detail(relations=(Relation(RelationKind.NEXT_TO, ("bed",)),)),)
)
FRAME_S = 0.25  # at 4 Hz the map may be 1 s old, and what a plan shows 1.5 s
DELIVERY_S = 0.1  # of a command, and of the odometry by which the planner judges
UNTIL_S = 12.0


class LateMapper:
    """Robot, mapper, perception and a user around a planner; each view takes ``late_s``."""

    def __init__(self, late_s: float) -> None:
        self.world = VirtualWorld(1)
        self.router, self.late_s = VirtualRouter(self.world), late_s
        self.moved: list[tuple[float, float]] = []  # speed and age of the frame of each command
        self.frame_ns, self.reason = 1, ""
        for name in ("robot", "mapper", "perception", "planner", "user"):
            bus = self.router.join(self.world.process(name), name, announce=name != "user")
            self.world.spawn(bus.process, "main", partial(getattr(self, name), bus))
        self.world.run(UNTIL_S)
        self.world.close()
        assert self.world.crashes == []

    def robot(self, bus: VirtualBus) -> None:
        odometry, commands = bus.publish(keys.ROBOT_ODOMETRY), bus.subscribe(keys.ROBOT_CMD_VEL)
        for count in range(10**6):
            now_ns = bus.clock.wall_ns()
            odometry.put(Odometry(count, now_ns, pose_2d(2.0, 2.0, 0.0), 0.0, 0.0))
            command = commands.take(0.05)
            if command is not None and moves(command):
                age_s = (bus.clock.wall_ns() - command.frame_ns) * 1e-9
                self.moved.append((command.linear_mps, age_s))
            bus.clock.sleep(0.02)

    def mapper(self, bus: VirtualBus) -> None:
        def view(request: SearchViewRequest) -> SearchView:
            shown = replace(search_view_of(ROOM, request.text), stamp_ns=self.frame_ns)
            bus.clock.sleep(self.late_s)
            return shown

        bus.serve(keys.MAP_SEARCH_VIEW, view)
        bus.serve(keys.MAP_SEARCH_RESET, lambda _: MapSummary("", "mini", "mini", 0.1, 1, 1))
        bus.serve(keys.MAP_PLACES, lambda _: NOWHERE)
        revisions = bus.publish(keys.MAP_REVISION)
        for count in range(1, 10**6):
            taken_ns = bus.clock.wall_ns()
            bus.clock.sleep(FRAME_S)
            self.frame_ns = taken_ns
            revisions.put(
                MapRevision(count, count, taken_ns, "mini", "mini", count, 1, 1, 1.0, 4.0)
            )

    def perception(self, bus: VirtualBus) -> None:
        bus.serve(keys.EMBED_TEXT, embeddings)

    def planner(self, bus: VirtualBus) -> None:
        planner = Planner(bus, PlannerConfig(state_dir=None))
        while True:
            planner.step(0.05)

    def user(self, bus: VirtualBus) -> None:
        bus.clock.sleep(1.0)
        bus.call(keys.SEARCH_START, LAMP)
        bus.clock.sleep(UNTIL_S - 2.0)
        self.reason = bus.call(keys.SEARCH_GET, SearchId()).reason


@pytest.mark.parametrize("late_s", [0.05, 0.3, 0.8])
def test_no_command_rests_on_what_the_camera_saw_too_long_ago(late_s: float) -> None:
    """Not even while it steers by the plan before."""
    seen = LateMapper(late_s)
    assert max((age_s for _, age_s in seen.moved), default=0.0) <= 1.5 + DELIVERY_S
    assert ("waiting for the camera" in seen.reason) == (late_s > 0.5)
    assert (len(seen.moved) > 180) == (late_s < 0.5)  # a usual system never stops for it
