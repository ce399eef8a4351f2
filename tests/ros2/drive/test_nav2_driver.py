from __future__ import annotations

import struct
from dataclasses import replace

import pytest

from onemap_ros2.cdr import type_hash
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.driver import GoalPose, PlannerVoice, RobotNow
from onemap_ros2.drive.nav2 import Nav2Driver
from onemap_ros2.network.interface import Endpoint
from onemap_shared.messages import SearchState
from tests.ros2.fake_network import FakeCall, FakeNetwork
from tests.ros2.planner_messages import path_to, status

KIND = "nav2_msgs/action/NavigateToPose_SendGoal"
SERVER = Endpoint("SS", "/nav2", "/navigate_to_pose/_action/send_goal", KIND, type_hash(KIND))
HEAD = bytes((0, 1, 0, 0))
ACCEPTED, REFUSED = (HEAD + struct.pack("<?3xiI", yes, 0, 0) for yes in (True, False))
CANCELLING = HEAD + struct.pack("<b3xI", 0, 0)


def result(state: int) -> bytes:
    return HEAD + struct.pack("<bxHIb", state, 0, 1, 0)


class Ride:
    """A driver, a robot at the origin and a planner that speaks at every step."""

    def __init__(self) -> None:
        self.network = FakeNetwork(SERVER)
        self.driver = Nav2Driver(self.network, Ros2Config(drive="nav2"))
        self.now_s = 100.0
        self.fresh = True
        self.voice = PlannerVoice().with_status(status("s1"))

    def step(self, x_m: float | None = 4.0, period_s: float = 0.1) -> None:
        """One step; without ``x_m`` the planner is silent."""
        self.now_s += period_s
        if x_m is not None:
            self.voice = self.voice.with_path(path_to(x_m, 0.0), self.now_s)
            self.voice = self.voice.with_command(self.now_s)
        pose = GoalPose(0.0, 0.0, 0.0)
        self.driver.step(RobotNow(self.now_s, 7, self.fresh, pose), None, self.voice)

    def calls(self, service: str) -> list[FakeCall]:
        return [call for call in self.network.calls if call.service.endswith(service)]

    def drive(self) -> FakeCall:
        """A goal is sent and accepted; returns the question for its result."""
        self.step()
        self.calls("send_goal")[-1].answer(ACCEPTED)
        self.step()
        return self.calls("get_result")[-1]


def test_a_goal_is_sent_accepted_and_reached() -> None:
    ride = Ride()
    asked = ride.drive()
    (sent,) = ride.calls("send_goal")
    assert sent.request[4:20] == asked.request[4:20]  # of one goal
    assert struct.unpack_from("<d", sent.request, 4 + 16 + 16)[0] == 4.0
    asked.answer(result(4))
    ride.step()
    assert ride.driver.metrics()["goals_reached"] == 1
    assert ride.driver.problem() == ""
    assert "goal of /navigate_to_pose was reached" in ride.driver.take_news()


def test_a_refusal_is_named_and_asked_again_later() -> None:
    ride = Ride()
    ride.step()
    ride.calls("send_goal")[0].answer(REFUSED)
    ride.step()
    assert ride.driver.problem() == "/navigate_to_pose refused the goal"
    for _ in range(40):
        ride.step()
    assert len(ride.calls("send_goal")) == 2


@pytest.mark.parametrize("why", ["search", "silence", "odometry", "rest"])
def test_whatever_ends_the_permission_cancels_the_goal(why: str) -> None:
    ride = Ride()
    asked = ride.drive()
    if why == "search":
        ride.voice = ride.voice.with_status(status("s1", SearchState.CANCELLED))
        ride.step(None)
    elif why == "silence":
        for _ in range(16):
            ride.step(None)
    elif why == "odometry":
        ride.fresh = False
        ride.step()
    else:
        ride.voice = replace(ride.voice, path=path_to(0.0, 0.0, "rest"))
        ride.step(None)
    (cancel,) = ride.calls("cancel_goal")
    assert cancel.request[4:20] == asked.request[4:20]
    cancel.answer(CANCELLING)
    asked.answer(result(5))
    ride.step(None)
    assert ride.driver.metrics()["goals_cancelled"] == 1
    assert len(ride.calls("send_goal")) == 1


def test_a_cancellation_without_an_answer_is_repeated() -> None:
    ride = Ride()
    ride.drive()
    ride.fresh = False
    for _ in range(70):
        ride.step()
        if ride.calls("cancel_goal"):
            ride.calls("cancel_goal")[-1].answer(None)
    assert len(ride.calls("cancel_goal")) == 4


def test_the_adapter_that_ends_cancels() -> None:
    ride = Ride()
    ride.drive()
    ride.driver.close()
    assert len(ride.calls("cancel_goal")) == 1
    idle = Ride()
    idle.driver.close()
    assert idle.network.calls == []


def test_a_lost_link_is_named_and_the_goal_cancelled() -> None:
    ride = Ride()
    ride.drive().answer(None)
    ride.step()
    assert "was lost" in ride.driver.problem()
    assert len(ride.calls("cancel_goal")) == 1


def test_a_goal_that_a_killed_adapter_left_is_cancelled() -> None:
    killed, ride = Ride(), Ride()
    left = killed.drive().request[4:20]
    foreign = bytes(range(16))
    entries = b"".join(goal + struct.pack("<iIbxxx", 1, 2, 2) for goal in (left, foreign))
    ride.network.say("/navigate_to_pose/_action/status", HEAD + struct.pack("<I", 2) + entries)
    ride.step(None)
    assert [call.request[4:20] for call in ride.calls("cancel_goal")] == [left]
    own = ride.drive().request[4:20]
    entry = own + struct.pack("<iIbxxx", 1, 2, 2)
    ride.network.say("/navigate_to_pose/_action/status", HEAD + struct.pack("<I", 1) + entry)
    ride.step()
    assert len(ride.calls("cancel_goal")) == 1


def test_feedback_is_in_the_metrics() -> None:
    ride = Ride()
    own = ride.drive().request[4:20]
    pose = struct.pack("<iII4s7d", 3, 7, 4, b"map\0", *range(7))
    body = own + pose + struct.pack("<iIiIhxxf", 4, 0, 5, 0, 1, 2.5)
    ride.network.say("/navigate_to_pose/_action/feedback", HEAD + body)
    ride.step()
    assert ride.driver.metrics()["goal_remaining_m"] == 2.5


def test_answers_that_cannot_be_read_are_named() -> None:
    ride = Ride()
    ride.step()
    ride.calls("send_goal")[0].answer(b"\x00")
    ride.network.say("/navigate_to_pose/_action/feedback", b"\x00")
    ride.step()
    assert "cannot be read" in ride.driver.problem()


def test_without_nav2_nothing_is_sent_and_it_is_named() -> None:
    ride = Ride()
    ride.network.known = ()
    ride.step()
    assert ride.network.calls == []
    assert "no node serves /navigate_to_pose" in ride.driver.problem()
