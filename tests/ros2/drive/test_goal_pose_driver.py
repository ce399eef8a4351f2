from __future__ import annotations

from onemap_ros2.cdr import decode
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.driver import GoalPose, PlannerVoice, RobotNow
from onemap_ros2.drive.goal_poses import GoalPoseDriver
from tests.ros2.fake_network import FakeNetwork
from tests.ros2.planner_messages import path_to, status

POSE = "geometry_msgs/msg/PoseStamped"


class Ride:
    def __init__(self) -> None:
        self.network = FakeNetwork()
        self.driver = GoalPoseDriver(self.network, Ros2Config(drive="goal_pose", namespace="/r1"))
        self.voice = PlannerVoice().with_status(status("s1"))
        self.now_s = 10.0

    def step(self, x_m: float | None, *, fresh: bool = True) -> None:
        self.now_s += 0.5
        if x_m is not None:
            self.voice = self.voice.with_path(path_to(x_m, 0.0), self.now_s)
        self.voice = self.voice.with_command(self.now_s)
        robot = RobotNow(self.now_s, 7, fresh, GoalPose(0.5, 0.0, 0.0))
        self.driver.step(robot, None, self.voice)

    @property
    def sent(self) -> list[float]:
        writer = self.network.writers["/r1/goal_pose", POSE]
        return [decode(data, POSE).pose.position.x for data in writer.sent]


def test_goals_are_sent_when_they_move_and_not_too_often() -> None:
    ride = Ride()
    for x_m in (4.0, 4.0, 4.1, 4.1, 8.0, 8.0):
        ride.step(x_m)
    assert ride.sent == [4.0, 8.0]


def test_to_stop_the_robot_gets_where_it_stands_twice() -> None:
    ride = Ride()
    ride.step(4.0)
    for _ in range(20):
        ride.step(4.0, fresh=False)
    assert ride.sent[0] == 4.0
    assert set(ride.sent[1:]) == {0.5}
    assert 2 <= len(ride.sent[1:]) <= 3


def test_the_adapter_that_ends_stops_the_robot() -> None:
    ride = Ride()
    ride.driver.close()
    assert ride.sent == []
    ride.step(4.0)
    ride.driver.close()
    assert ride.sent == [4.0, 0.5]
    assert ride.driver.metrics() == {"goals_sent": 2.0}
    assert "no node subscribes to /r1/goal_pose" in ride.driver.problem()
