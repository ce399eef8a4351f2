"""The adapter's process between a fake robot's process and OneMap's bus, through a real router."""

from __future__ import annotations

import itertools
import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
import yaml

from onemap_ros2.cdr import GRID, STRING, TRIGGER, decode, encode, new
from onemap_ros2.config import Ros2Config
from onemap_ros2.display_messages import occupancy_grid
from onemap_ros2.service import join as join_robot
from onemap_shared import keys
from onemap_shared.messages import SearchRequest, SearchState, SearchStatus, VelocityCommand
from onemap_shared.transport import Bus
from tests.ros2 import fake_robot
from tests.ros2.planner_messages import path_to, status, view
from tests.shared.test_bus import Router, eventually, join, running
from tests.structure import ROOT

pytestmark = pytest.mark.slow
T = TypeVar("T")
MIDDLEWARE = {"rmw": "rmw_zenoh", "bridge": "zenoh-bridge-ros2dds"}
TOPICS = {
    "color": "/camera/color",
    "depth": "/camera/depth",
    "camera_info": "/camera/camera_info",
}


class RobotProcess:
    """The fake robot, and what its base was told: sequence, forward and turning speed.

    ``nav2``: how its action behaves, if it has one; ``asked``: what that was asked.
    """

    def __init__(self, endpoint: str, form: str, nav2: str = "") -> None:
        self.told: queue.SimpleQueue[tuple[int, float, float]] = queue.SimpleQueue()
        self.asked: queue.SimpleQueue[list[Any]] = queue.SimpleQueue()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.ros2.fake_robot", endpoint, form, nav2],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            first, *rest = json.loads(line)
            if first == "nav2":
                self.asked.put(rest)
            else:
                self.told.put((first, *rest))

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.wait(timeout=90) == 0


@pytest.fixture(scope="module")
def router() -> Iterator[Router]:
    with running() as router:
        yield router


@pytest.fixture(scope="module", params=["rmw", "bridge"])
def form(request: pytest.FixtureRequest) -> str:
    chosen: str = request.param
    return chosen


@pytest.fixture(scope="module")
def robot(router: Router, form: str) -> Iterator[RobotProcess]:
    made = RobotProcess(router.endpoint, form)
    yield made
    if made.process.poll() is None:
        made.close()


def started(router: Router, form: str, folder: Path, **more: str) -> subprocess.Popen[bytes]:
    """An adapter, with further settings."""
    config = folder / "robot.yaml"
    robot = {"middleware": MIDDLEWARE[form], "connect": [router.endpoint], "topics": TOPICS}
    ros2 = {**robot, "map_frame": "odom", **more}
    config.write_text(yaml.safe_dump({"bus": {"connect": [router.endpoint]}, "ros2": ros2}))
    return subprocess.Popen([sys.executable, "-m", "onemap_ros2", "--config", str(config)])


@pytest.fixture(scope="module")
def adapter(
    router: Router, robot: RobotProcess, form: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[subprocess.Popen[bytes]]:
    process = started(router, form, tmp_path_factory.mktemp("adapter"))
    yield process
    process.terminate()
    assert process.wait(timeout=90) == 0


@pytest.fixture
def planner(router: Router) -> Iterator[Bus]:
    bus = join(router, "planner")
    yield bus
    bus.close()


def drive(planner: Bus, robot: RobotProcess, command: VelocityCommand) -> tuple[int, float, float]:
    """Send the command, again and again as a planner does, until the base drives."""
    commands = planner.publish(keys.ROBOT_CMD_VEL)
    sequence = itertools.count(command.sequence)

    def attempt() -> tuple[int, float, float] | None:
        commands.put(replace(command, sequence=next(sequence)))
        with suppress(queue.Empty):
            told = robot.told.get(timeout=0.05)
            return told if told[1] else None
        return None

    return eventually(attempt)


@pytest.mark.usefixtures("adapter")
def test_a_robot_of_ros_2_is_seen_and_driven(planner: Bus, robot: RobotProcess) -> None:
    frames, odometry = planner.subscribe(keys.ROBOT_RGBD), planner.subscribe(keys.ROBOT_ODOMETRY)
    frame = eventually(lambda: frames.take(0.5))
    assert frame.rgb.shape == (fake_robot.HEIGHT, fake_robot.WIDTH, 3)
    assert frame.rgb[0, 0].tolist() == [0, 1, 2]
    assert (frame.depth_mm[0, 0], frame.depth_mm[1, 1]) == (0, 1500)
    assert (frame.intrinsics.fx, frame.intrinsics.cx) == (fake_robot.FX, fake_robot.WIDTH / 2)
    np.testing.assert_allclose(frame.T_map_camera[:3, 3], (1.2, 0.0, 0.0), atol=1e-9)
    eventually(lambda: odometry.take(0.5))
    first = drive(planner, robot, VelocityCommand(1, 1, 0.25, -0.5, 300, "p1"))
    assert first == (1, 0.25, -0.5)
    eventually(lambda: m if (m := odometry.take(0.5)) and m.planner == "p1" else None)
    told = [robot.told.get(timeout=90)]
    while told[-1][1:] != (0.0, 0.0):
        told.append(robot.told.get(timeout=90))
    told += [robot.told.get(timeout=90) for _ in range(2)]
    assert [velocity for _, *velocity in told[-3:]] == [[0.0, 0.0]] * 3
    assert [sequence for sequence, *_ in told] == list(range(2, 2 + len(told)))


@pytest.mark.usefixtures("adapter", "robot")
def test_who_looks_later_sees_the_map_at_once(router: Router, planner: Bus, form: str) -> None:
    grids: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def newest() -> bytes | None:
        with suppress(queue.Empty):
            return grids.get(timeout=0.05)
        return None

    mapper = join(router, "mapper")
    mapper.serve(keys.MAP_SEARCH_VIEW, lambda _: view())
    viewer = fake_robot.FORMS[form](router.endpoint)
    viewer.subscribe("/onemap/map", GRID, grids.put, latched=True)
    first = eventually(newest)
    assert first == occupancy_grid(view(), "odom")
    mapper.close()
    viewer.session.close()
    while not grids.empty():
        grids.get()
    later = fake_robot.FORMS[form](
        router.endpoint
    )  # nobody computes a grid any more: it is remembered
    later.subscribe("/onemap/map", GRID, grids.put, latched=True)
    assert eventually(newest) == first
    start_and_cancel(planner, later)
    later.session.close()


def start_and_cancel(planner: Bus, viewer: fake_robot.FakeRobot | fake_robot.FakeBridge) -> None:
    """A search of ROS 2: by a topic, followed on another, cancelled by a service."""
    started: queue.SimpleQueue[SearchRequest] = queue.SimpleQueue()

    def start(request: SearchRequest) -> SearchStatus:
        started.put(request)
        return status("s1")

    planner.serve(keys.SEARCH_START, start)
    planner.serve(keys.SEARCH_CANCEL, lambda _: status("s1", SearchState.CANCELLED))
    words, states = viewer.publish("/onemap/search", STRING), planner.publish(keys.SEARCH_STATE)

    def say() -> SearchRequest | None:
        words.put(encode(new(STRING, "sofa"), STRING))
        with suppress(queue.Empty):
            return started.get(timeout=0.05)
        return None

    assert eventually(say).objects == ("sofa",)
    seen: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    viewer.subscribe("/onemap/state", STRING, seen.put, latched=True)
    states.put(status("s1"))
    eventually(lambda: '"id": "s1"' in decode(seen.get(timeout=90), STRING).data or None)
    request = encode(new(f"{TRIGGER}_Request", 0), f"{TRIGGER}_Request")
    answer = viewer.call("/onemap/cancel", TRIGGER, request)
    assert decode(answer, f"{TRIGGER}_Response").success


@pytest.mark.usefixtures("adapter")
def test_the_base_is_stopped_when_the_adapter_ends(
    planner: Bus, robot: RobotProcess, adapter: subprocess.Popen[bytes]
) -> None:
    odometry = planner.subscribe(keys.ROBOT_ODOMETRY)
    eventually(lambda: odometry.take(0.5))
    drive(planner, robot, VelocityCommand(1, 1, 0.25, 0.0, planner="p2"))
    adapter.terminate()
    assert adapter.wait(timeout=90) == 0
    told = robot.told.get(timeout=90)
    while not robot.told.empty():
        told = robot.told.get()
    assert told[1:] == (0.0, 0.0)


@pytest.mark.usefixtures("planner")  # which waits for the router
def test_the_graph_shows_the_robot_and_forgets_it(
    router: Router, robot: RobotProcess, form: str
) -> None:
    network = join_robot(
        Ros2Config.model_validate({"middleware": MIDDLEWARE[form], "connect": [router.endpoint]})
    )
    try:
        network.read("/tf", "tf2_msgs/msg/TFMessage", 5)
        found = eventually(lambda: network.endpoints() if len(network.endpoints()) == 7 else None)
        base = next(each for each in found if each.kind == "MS")
        assert (base.topic, base.ros_type) == ("/cmd_vel", fake_robot.COMMAND)
        assert base.node == ("/fake_robot" if form == "rmw" else "")
        robot.close()
        assert eventually(lambda: None if network.endpoints() else True)
    finally:
        network.close()


class Ride:
    """A robot with nav2, the adapter, and a planner that speaks while it waits for something."""

    def __init__(self, router: Router, form: str, behaviour: str, folder: Path) -> None:
        self.robot = RobotProcess(router.endpoint, form, behaviour)
        self.start = partial(started, router, form, folder, drive="nav2")
        self.bus: Bus = join(router, "planner")
        self.states = self.bus.publish(keys.SEARCH_STATE)
        self.paths = self.bus.publish(keys.SEARCH_PATH)
        self.commands = self.bus.publish(keys.ROBOT_CMD_VEL)
        self.health = self.bus.subscribe(keys.heartbeat("ros2"))
        self.numbers = itertools.count(1)
        self.adapter = self.start()

    def close(self) -> None:
        if self.adapter.poll() is None:
            self.adapter.terminate()
            self.adapter.wait(timeout=90)
        self.robot.close()
        self.bus.close()

    def while_driving(self, attempt: Callable[[], T | None]) -> T:
        """As ``eventually``, with a planner that goes on to have a goal."""

        def speak() -> T | None:
            number = next(self.numbers)
            self.states.put(status("s1"))
            self.paths.put(path_to(4.0, 1.0))
            self.commands.put(VelocityCommand(number, 1, 0.25, 0.0, planner="p1", frame_ns=1))
            return attempt()

        return eventually(speak)

    def asked(self, what: str) -> list[Any] | None:
        """The next thing that nav2 was asked, if it is this."""
        with suppress(queue.Empty):
            found: list[Any] = self.robot.asked.get(timeout=0.05)
            return found[1:] if found[0] == what else None
        return None

    def metric(self, name: str) -> float | None:
        """The newest value of a metric, unless it is 0."""
        beat = self.health.take(0.05)
        return (beat.metrics.get(name) or None) if beat is not None else None


Start = Callable[[str, str], Ride]


@pytest.fixture
def start(router: Router, tmp_path: Path) -> Iterator[Start]:
    """Starts a robot of a form whose nav2 behaves like this."""
    made: list[Ride] = []

    def ride(form: str, behaviour: str) -> Ride:
        made.append(Ride(router, form, behaviour, tmp_path))
        return made[-1]

    yield ride
    for each in made:
        each.close()


def test_a_goal_is_reached(start: Start) -> None:
    ride = start("rmw", "succeed")
    goal, x, y, frame = ride.while_driving(lambda: ride.asked("goal"))
    assert (x, y, frame) == (4.0, 1.0, "odom")
    assert ride.while_driving(lambda: ride.asked("end")) == [goal, 4]
    ride.while_driving(lambda: ride.metric("goals_reached"))
    assert ride.robot.told.empty()  # nothing on the command topic


def test_the_end_of_the_search_cancels_the_goal(start: Start) -> None:
    ride = start("bridge", "wait")
    goal, *_ = ride.while_driving(lambda: ride.asked("goal"))
    ride.states.put(status("s1", SearchState.CANCELLED))
    assert eventually(lambda: ride.asked("cancel")) == [goal]
    assert eventually(lambda: ride.asked("end")) == [goal, 5]
    eventually(lambda: ride.metric("goals_cancelled"))


def test_a_killed_adapter_leaves_a_goal_that_the_next_one_cancels(start: Start) -> None:
    ride = start("rmw", "wait")
    goal, *_ = ride.while_driving(lambda: ride.asked("goal"))
    ride.adapter.kill()
    ride.adapter.wait(timeout=90)
    ride.adapter = ride.start()
    assert eventually(lambda: ride.asked("cancel")) == [goal]
