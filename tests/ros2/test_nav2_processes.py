"""The adapter's process between a planner and a fake nav2, through a real router."""

from __future__ import annotations

import itertools
import queue
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import pytest
import yaml

from onemap_shared import keys
from onemap_shared.messages import SearchState, VelocityCommand
from onemap_shared.transport import Bus
from tests.ros2.planner_messages import path_to, status
from tests.ros2.test_processes import MIDDLEWARE, TOPICS, RobotProcess
from tests.shared.test_bus import Router, eventually, join, router

__all__ = ["router"]  # the fixture
pytestmark = pytest.mark.slow
T = TypeVar("T")


class Ride:
    """A robot with nav2, the adapter, and a planner that speaks while it waits for something."""

    def __init__(self, router: Router, form: str, behaviour: str, folder: Path) -> None:
        self.robot = RobotProcess(router.endpoint, form, behaviour)
        self.config = folder / "robot.yaml"
        ros2 = {
            "middleware": MIDDLEWARE[form],
            "connect": [router.endpoint],
            "map_frame": "odom",
            "topics": TOPICS,
            "drive": "nav2",
        }
        document = {"bus": {"connect": [router.endpoint]}, "ros2": ros2}
        self.config.write_text(yaml.safe_dump(document))
        self.bus: Bus = join(router, "planner")
        self.states = self.bus.publish(keys.SEARCH_STATE)
        self.paths = self.bus.publish(keys.SEARCH_PATH)
        self.commands = self.bus.publish(keys.ROBOT_CMD_VEL)
        self.health = self.bus.subscribe(keys.heartbeat("ros2"))
        self.numbers = itertools.count(1)
        self.adapter = self.start()

    def start(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen([sys.executable, "-m", "onemap_ros2", "--config", str(self.config)])

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
            self.commands.put(VelocityCommand(number, 1, 0.25, 0.0, 300, "p1"))
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

    def started(form: str, behaviour: str) -> Ride:
        made.append(Ride(router, form, behaviour, tmp_path))
        return made[-1]

    yield started
    for each in made:
        each.close()


@pytest.mark.parametrize("form", ["rmw", "bridge"])
def test_a_goal_is_reached(start: Start, form: str) -> None:
    ride = start(form, "succeed")
    goal, x, y, frame = ride.while_driving(lambda: ride.asked("goal"))
    assert (x, y, frame) == (4.0, 1.0, "odom")
    assert ride.while_driving(lambda: ride.asked("end")) == [goal, 4]
    ride.while_driving(lambda: ride.metric("goals_reached"))
    assert ride.robot.told.empty()  # nothing on the command topic


@pytest.mark.parametrize("form", ["rmw", "bridge"])
def test_the_end_of_the_search_cancels_the_goal(start: Start, form: str) -> None:
    ride = start(form, "wait")
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
