from __future__ import annotations

import itertools
import threading
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from onemap_ros2 import service
from onemap_ros2.cdr import DIAGNOSTICS, TWIST, TWIST_STAMPED, decode, stamp_ns, type_hash
from onemap_ros2.config import Ros2Config
from onemap_ros2.display import Display
from onemap_ros2.drive.driver import MAX_COMMAND_AGE_S
from onemap_ros2.frame_images import FrameImages
from onemap_ros2.frame_thread import FrameThread
from onemap_ros2.network.interface import Endpoint, NetworkError, RosNetwork
from onemap_ros2.service import JoiningWorker, Ros2Worker
from onemap_ros2.topic_list import TopicNeed, needs
from onemap_shared import keys
from onemap_shared.camera import Intrinsics
from onemap_shared.clock import SystemClock
from onemap_shared.messages import Heartbeat, RgbdFrame, VelocityCommand
from onemap_shared.transport import Health
from tests.memory_bus import MemoryRouter
from tests.ros2.fake_network import FakeNetwork
from tests.ros2.planner_messages import path_to, status
from tests.ros2.robot_messages import (
    FX,
    HEIGHT,
    WIDTH,
    camera_info,
    image,
    odometry,
    simulated_clock,
    transforms,
)

T0 = 1_700_000_000_000_000_000
CONFIG = Ros2Config.model_validate({"map_frame": "odom", "display": False})
TOPICS = CONFIG.names


def base(ros_type: str) -> Endpoint:
    return Endpoint("MS", "/base", "/cmd_vel", ros_type, type_hash(ros_type))


def endpoint_of(need: TopicNeed) -> Endpoint:
    return Endpoint(need.kind, "/robot", need.topic, need.types[0], type_hash(need.types[0]))


class Clock(SystemClock):
    """The worker's monotonic clock; every look advances it by a microsecond."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic_s(self) -> float:
        self.now_s += 1e-6
        return self.now_s

    def wall_ns(self) -> int:
        return T0


@pytest.fixture
def clock() -> Clock:
    return Clock()


class System:
    """A worker between a robot in memory and a bus in memory."""

    def __init__(self, clock: Clock, *endpoints: Endpoint, config: Ros2Config = CONFIG) -> None:
        router = MemoryRouter(clock)
        self.clock = clock
        self.network = FakeNetwork(*endpoints)
        self.bus = router.bus()
        self.frames = self.bus.subscribe(keys.ROBOT_RGBD, capacity=20)
        self.odometry = self.bus.subscribe(keys.ROBOT_ODOMETRY, capacity=20)
        self.commands = self.bus.publish(keys.ROBOT_CMD_VEL)
        self.paths = self.bus.publish(keys.SEARCH_PATH)
        self.states = self.bus.publish(keys.SEARCH_STATE)
        self.worker = Ros2Worker(router.bus("ros2"), self.network, config)
        self.sequences: Iterator[int] = itertools.count(1)

    def robot_says(self, stamp_ns: int = T0, *, silent: str = "") -> None:
        def say(topic: str, data: bytes) -> None:
            if topic != silent:
                self.network.say(topic, data)

        say(TOPICS.tf_static, transforms(0, ("base_link", "camera", 0.2, 0.0)))
        say(TOPICS.tf, transforms(stamp_ns, ("odom", "base_link", 1.0, 0.0)))
        say(TOPICS.camera_info, camera_info(stamp_ns))
        say(TOPICS.odometry, odometry(stamp_ns, 1.0))
        say(TOPICS.color, image(stamp_ns, np.zeros((HEIGHT, WIDTH, 3), np.uint8), "rgb8"))
        say(TOPICS.depth, image(stamp_ns, np.ones((HEIGHT, WIDTH), np.uint16), "16UC1"))
        self.worker.step(0.1)
        self.worker._making.wait_idle()
        self.worker.step(0.1)

    def command(self, linear_mps: float = 0.25, odometry_ns: int = 0, frame_ns: int = T0) -> None:
        number = next(self.sequences)
        command = VelocityCommand(number, T0, linear_mps, 0.0, planner="p1", frame_ns=frame_ns)
        self.commands.put(replace(command, odometry_stamp_ns=odometry_ns))
        self.worker.step(0.1)

    def sent(self, ros_type: str) -> list[float]:
        """The forward velocities that went to the base."""
        writer = self.network.writers[TOPICS.command, ros_type]
        messages = [decode(data, ros_type) for data in writer.sent]
        return [m.twist.linear.x if ros_type == TWIST_STAMPED else m.linear.x for m in messages]

    def diagnoses(self) -> dict[str, tuple[int, str, dict[str, str]]]:
        """Level, message and values of the newest diagnostics, by name."""
        sent = self.network.writers["/diagnostics", DIAGNOSTICS].sent
        return {
            part.name: (part.level, part.message, {pair.key: pair.value for pair in part.values})
            for part in decode(sent[-1], DIAGNOSTICS).status
        }

    def run(self, duration_s: float) -> None:
        end_s = self.clock.now_s + duration_s
        while self.clock.now_s < end_s:
            self.clock.now_s += 0.02
            self.worker.step(0.1)


def test_frames_and_odometry_reach_the_bus_with_an_echo_of_the_command(clock: Clock) -> None:
    made = System(clock, base(TWIST))
    made.robot_says()
    frame, message = made.frames.take(0.0), made.odometry.take(0.0)
    assert frame is not None
    assert message is not None
    assert frame.stamp_ns == message.stamp_ns == T0
    assert frame.T_map_camera[0, 3] == pytest.approx(1.2)
    assert (message.planner, message.command_sequence) == ("", 0)
    assert TOPICS.tf_static in made.network.latched
    made.command(0.25, T0)
    made.robot_says(T0 + 1)
    message = made.odometry.take(0.0)
    assert message is not None
    assert (message.planner, message.command_sequence) == ("p1", 1)


def test_the_camera_is_that_of_the_image_or_no_frame_is_made(clock: Clock) -> None:
    """Camera information of twice the size would put things aside by half the image."""
    made = System(clock, *(endpoint_of(need) for need in needs(CONFIG)))
    for number, (width, height) in enumerate(((WIDTH, HEIGHT), (2 * WIDTH, 2 * HEIGHT))):
        stamp_ns = T0 + number * 100_000_000
        fx = FX * width / WIDTH
        made.network.say(TOPICS.camera_info, camera_info(stamp_ns, width, height, fx))
        made.robot_says(stamp_ns, silent=TOPICS.camera_info)
        frame = made.frames.take(0.0)
        assert frame is not None
        assert frame.intrinsics == Intrinsics(FX, FX, WIDTH / 2, HEIGHT / 2)
    made.network.say(TOPICS.camera_info, camera_info(T0, 2 * WIDTH, 3 * HEIGHT))
    made.robot_says(T0 + 200_000_000, silent=TOPICS.camera_info)
    assert made.frames.take(0.0) is None
    assert made.worker.health().problem == (
        "/camera/camera/color/camera_info (ros2.topics.camera_info): the camera information is for "
        "16 x 18 pixels, and the image has 8 x 6, which is no resizing of it: publish the camera "
        "information of this image"
    )


def test_a_loop_of_transforms_is_named_and_over_when_nobody_says_it(clock: Clock) -> None:
    """A second localisation that places the odometry's frame below the base."""
    made = System(clock, *(endpoint_of(need) for need in needs(CONFIG)))
    driven = []
    for step in range(100):
        stamp_ns = T0 + step * 100_000_000
        if 20 <= step < 40:
            loop = transforms(stamp_ns, ("base_link", "odom", -1.0, 0.0))
            made.network.say(TOPICS.tf, loop)
        made.clock.now_s += 0.1
        made.robot_says(stamp_ns)
        if step == 39:
            problem = made.worker.health().problem
            assert "the transforms form a loop, 'base_link' in 'odom' in 'base_link'" in problem
            assert not made.worker.health().ready
        while made.odometry.take(0.0) is not None:
            driven.append(step)
    assert [step for step in driven if step < 40 or step > 70] == [*range(20), *range(71, 100)]


def test_an_image_that_takes_long_delays_no_command(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    goes_on = threading.Event()
    slow = FrameImages.frame

    def blocked(images: FrameImages) -> RgbdFrame:
        goes_on.wait()
        return slow(images)

    made = System(clock, base(TWIST))
    made.robot_says()
    monkeypatch.setattr(FrameImages, "frame", blocked)
    monkeypatch.setattr(made.worker._making, "wait_idle", lambda: None)
    for number in range(1, 30):
        clock.now_s += 0.1
        made.robot_says(T0 + number * 10**8)
        made.command(0.25, T0 + number * 10**8)
    assert made.sent(TWIST) == [0.25] * 29
    goes_on.set()
    FrameThread.wait_idle(made.worker._making)
    made.worker.step(0.1)
    stamps = []
    while (frame := made.frames.take(0.0)) is not None:
        stamps.append(frame.stamp_ns)
    assert stamps == [T0, T0 + 29 * 10**8]  # only the newest of those that came meanwhile


@pytest.mark.parametrize("ros_type", [TWIST, TWIST_STAMPED])
def test_velocities_go_out_as_the_base_asks_then_zero_then_silence(
    clock: Clock, ros_type: str
) -> None:
    made = System(clock, base(ros_type))
    made.robot_says()
    made.command(0.25, T0)
    assert made.sent(ros_type) == [0.25]
    made.run(3.0)
    velocities = made.sent(ros_type)
    assert set(velocities[1:]) == {0.0}
    made.run(3.0)
    made.worker.close()
    assert made.sent(ros_type) == velocities
    assert made.network.closed


def test_no_velocity_without_odometry_or_a_base(clock: Clock) -> None:
    made = System(clock, base(TWIST))
    made.command()
    assert made.sent(TWIST) == []
    made.robot_says()
    made.command()
    assert made.sent(TWIST) == [0.25]
    made.clock.now_s += 0.6
    made.command()
    assert made.sent(TWIST) == [0.25, 0.0]
    alone = System(clock)
    alone.robot_says()
    alone.command()
    assert not [topic for topic, _ in alone.network.writers if topic == TOPICS.command]


def test_health_names_the_topic_that_is_missing(clock: Clock) -> None:
    made = System(clock)
    assert "no odometry on /odom" in made.worker.health().problem
    made.network.say(TOPICS.odometry, odometry(T0))
    made.worker.step(0.1)
    assert f"no node publishes {TOPICS.camera_info}" in made.worker.health().problem
    made.network.say(TOPICS.camera_info, camera_info(T0))
    made.worker.step(0.1)
    assert f"no node publishes {TOPICS.color}" in made.worker.health().problem
    made.robot_says(T0 + 1)
    assert "no node subscribes to /cmd_vel" in made.worker.health().problem
    waiting = made.odometry.take(0.0)
    assert waiting is not None
    assert "no node subscribes to /cmd_vel" in waiting.hold  # no search is begun on it
    made.network.known = (base(TWIST),)
    clock.now_s += 1.0
    made.robot_says(T0 + 10**9)
    health = made.worker.health()
    assert (health.ready, health.problem) == (True, "")
    assert health.metrics is not None
    assert health.metrics["frames"] == 2


def test_a_camera_that_falls_silent_is_named_with_its_rate_and_last_stamp(clock: Clock) -> None:
    made = System(clock, *(endpoint_of(need) for need in needs(CONFIG)))
    for step in range(60):
        stamp_ns = T0 + step * 100_000_000
        made.clock.now_s += 0.1
        made.robot_says(stamp_ns, silent=TOPICS.depth if step >= 20 else "")
        if step == 45:  # the last pair is 2.6 s old
            assert made.worker.health().problem == ""
            assert made.diagnoses()["onemap: ros2"][:2] == (0, "ready")
    assert made.worker.health().problem == (
        f"no frame from {TOPICS.color} and {TOPICS.depth} for 4 s: {TOPICS.depth} is silent for "
        "4 s (10.0 Hz before, last stamp 1700000001.900 s)"
    )
    found = made.diagnoses()
    assert found[f"onemap: topic {TOPICS.color}"][:2] == (0, "10.0 Hz")
    level, message, values = found[f"onemap: topic {TOPICS.depth}"]
    assert (level, values["last_stamp_s"], values["messages"]) == (3, "1700000001.900", "20")
    assert "is silent for" in message
    assert found["onemap: ros2"][0] == 2
    assert f"onemap: topic {TOPICS.tf_static}" not in found
    made.network.known = ()  # its driver is gone too
    assert f"no node publishes {TOPICS.color}" in made.worker.health().problem
    assert f"{TOPICS.depth} is silent" in made.worker.health().problem
    made.clock.now_s += 3.1
    problem = made.worker.health().problem
    silent = [TOPICS.odometry, TOPICS.color, TOPICS.depth, TOPICS.tf, TOPICS.camera_info]
    assert all(f"{topic} is silent for" in problem for topic in silent)


def test_diagnostics_have_the_other_services_and_the_search(clock: Clock) -> None:
    made = System(clock)
    beats = made.bus.publish(keys.heartbeat("mapper"))
    beats.put(
        Heartbeat("mapper", "m1", T0, 1, False, "no frame yet", {"ms": 0.1 + 0.2, "n": 4756704.0})
    )
    made.states.put(status("s1"))
    made.run(1.1)
    found = made.diagnoses()
    assert found["onemap: mapper"] == (2, "no frame yet", {"ms": "0.3", "n": "4756704"})
    assert found["onemap: search"][:2] == (0, "exploring: it looks")
    made.run(4.0)
    assert made.diagnoses()["onemap: mapper"][0] == 3
    made.network.writers["/diagnostics", DIAGNOSTICS].has_subscribers = False
    sent = len(made.network.writers["/diagnostics", DIAGNOSTICS].sent)
    made.run(2.0)
    assert len(made.network.writers["/diagnostics", DIAGNOSTICS].sent) == sent


def nav2() -> Endpoint:
    kind = "nav2_msgs/action/NavigateToPose_SendGoal"
    return Endpoint("SS", "/nav2", "/navigate_to_pose/_action/send_goal", kind, type_hash(kind))


def test_what_drives_by_goals_sends_no_velocity_but_zero(clock: Clock) -> None:
    """That one when nav2 answers no cancellation, which the planner is told."""
    config = CONFIG.model_copy(update={"drive": "nav2"})
    made = System(clock, base(TWIST), nav2(), config=config)
    made.states.put(status("s1"))
    for step in range(100):
        if step < 40:
            made.paths.put(path_to(4.0, 0.0))
            made.robot_says(T0 + step * 20_000_000)
        made.clock.now_s += 0.02
        made.command()
    made.odometry.take(0.0)
    for call in made.network.calls:
        call.answer(call.reply)
    made.run(1.5)
    made.robot_says(T0 + 1_000_000_000)
    told = [message for _ in range(20) if (message := made.odometry.take(0.0))][-1]
    assert "has not answered a cancellation" in told.hold
    assert made.worker.health().problem.startswith(told.hold.split(" for ")[0])
    assert set(made.sent(TWIST)) == {0.0}
    made.worker.close()
    assert [call.service.split("/")[-1] for call in made.network.calls][:1] == ["send_goal"]
    assert "cancel_goal" in made.network.calls[-1].service


@pytest.mark.parametrize(
    ("linear_mps", "odometry_ns", "frame_ns", "ends_s"),
    [
        (0.0, 0, 0, 0.02),  # the planner's stop on stale inputs
        (0.25, T0 - 1_000_000_000, T0, MAX_COMMAND_AGE_S),  # made on old odometry: a stop
        (0.0, T0 - 1_000_000_000, T0, MAX_COMMAND_AGE_S),
    ],
)
def test_a_goal_rests_on_commands_that_are_fresh(
    clock: Clock, linear_mps: float, odometry_ns: int, frame_ns: int, ends_s: float
) -> None:
    config = CONFIG.model_copy(update={"drive": "nav2"})
    made = System(clock, base(TWIST), nav2(), config=config)
    made.states.put(status("s1"))
    asked: list[int] = []
    for step in range(100):
        made.paths.put(path_to(4.0, 0.0))
        made.robot_says(T0 + step * 20_000_000)
        made.clock.now_s += 0.02
        if step < 40:
            made.command()
        else:
            made.command(linear_mps, odometry_ns, frame_ns)
        for call in made.network.calls:
            if call.service.endswith("send_goal") and not call.done:
                call.answer(bytes((0, 1, 0, 0, 1)) + bytes(11))
        asked.append(sum(call.service.endswith("cancel_goal") for call in made.network.calls))
    assert asked[39] == 0
    assert asked[40 + round(ends_s / 0.02)] == 1


def test_simulated_time_is_the_stamp_of_velocities(clock: Clock) -> None:
    made = System(
        clock, base(TWIST_STAMPED), config=CONFIG.model_copy(update={"use_sim_time": True})
    )
    assert "/clock" in made.worker.health().problem
    made.network.say("/clock", simulated_clock(7_000_000_123))
    made.robot_says(7_000_000_000)
    made.command(0.25, 7_000_000_000)
    (sent,) = made.network.writers[TOPICS.command, TWIST_STAMPED].sent
    assert stamp_ns(decode(sent, TWIST_STAMPED).header.stamp) == 7_000_000_123


def test_it_waits_for_the_robots_router_and_says_so(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service, "RETRY_S", 0.0)
    router, network = MemoryRouter(), FakeNetwork()
    is_there, tried = threading.Event(), threading.Semaphore(0)

    def join(config: Ros2Config) -> RosNetwork:
        tried.release()
        if not is_there.is_set():
            raise NetworkError("no ROS 2 router answers at tcp/r")
        return network

    worker = JoiningWorker(router.bus("ros2"), CONFIG, join)
    for _ in range(3):  # it goes on trying
        assert tried.acquire(timeout=60)
    worker.step(0.0)
    assert worker.health() == Health(False, "no ROS 2 router answers at tcp/r")
    is_there.set()
    while "no odometry on /odom" not in worker.health().problem:
        worker.step(0.1)
    worker.close()
    assert network.closed


def test_another_adapter_is_another_driver(clock: Clock) -> None:
    """So the search of before a kill ends, and its commands count for nothing."""
    made = System(clock, base(TWIST))
    made.robot_says()
    message = made.odometry.take(0.0)
    assert message is not None
    driver = made.worker._gate.driver
    assert message.driver == driver != System(clock).worker._gate.driver
    command = VelocityCommand(1, T0, 0.25, 0.0, planner="p1", driver="the one before")
    for said in (command, replace(command, sequence=2, linear_mps=0.5, driver=driver)):
        made.commands.put(said)
        made.worker.step(0.1)
    assert made.sent(TWIST) == [0.5]


def test_the_robot_is_stopped_before_anything_that_may_wait(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = Ros2Config.model_validate({"map_frame": "odom"})
    made = System(clock, base(TWIST), config=config)
    made.robot_says()
    made.command(0.25, T0)
    sent: list[list[float]] = []

    def hangs(display: Display) -> None:
        sent.append(made.sent(TWIST))
        stop(display)
        raise RuntimeError("the display is broken")

    stop = Display.close
    monkeypatch.setattr(Display, "close", hangs)
    with pytest.raises(RuntimeError):
        made.worker.close()
    assert sent == [[0.25, 0.0]]
    assert made.network.closed
