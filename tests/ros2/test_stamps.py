"""Stamps that jump: the robot's clock is set, or one message carries a wrong one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from onemap_ros2.config import Ros2Config
from onemap_ros2.robot_input import RobotInput
from tests.ros2.robot_messages import HEIGHT, WIDTH, camera_info, image, odometry, transforms

T0_NS = 1_700_000_000_000_000_000
PERIOD_S = 0.05
JUMPS_AT, STEPS = 30, 80  # in periods
SPEED_MPS = 2.0
STREAMS = ("localisation", "tf", "odometry", "color", "depth")
DEPTH = np.full((HEIGHT, WIDTH), 1500, np.uint16)


class Message(NamedTuple):
    arrives_s: float
    stream: str
    data: bytes


def message(stream: str, step: int, stamp_ns: int) -> bytes:
    """What a robot that drives along x says; the image shows the number of the step."""
    x_m = SPEED_MPS * step * PERIOD_S
    match stream:
        case "localisation":
            return transforms(stamp_ns, ("map", "odom", 0.0, 0.0))
        case "tf":
            return transforms(stamp_ns, ("odom", "base_link", x_m, 0.0))
        case "odometry":
            return odometry(stamp_ns, x_m)
        case "color":
            return image(stamp_ns, np.full((HEIGHT, WIDTH, 3), step, np.uint8), "rgb8")
        case _:
            return image(stamp_ns, DEPTH, "16UC1")


def run(jump_s: float, lags_s: dict[str, float], wrong: tuple[str, ...]) -> list[Message]:
    """What arrives, in order; all stamps jump, or those of one message of each stream in ``wrong``.

    Localisation speaks at 5 Hz, all others at 20.
    """
    said = []
    for step in range(STEPS):
        for stream in STREAMS:
            if stream == "localisation" and step % 4:
                continue
            jumped = step >= JUMPS_AT if not wrong else step == JUMPS_AT and stream in wrong
            stamp_s = step * PERIOD_S + jump_s * jumped
            data = message(stream, step, T0_NS + round(stamp_s * 1e9))
            said.append(Message(step * PERIOD_S + lags_s[stream], stream, data))
    return sorted(said)


def frames(robot: RobotInput, said: list[Message]) -> Iterator[tuple[float, int, float]]:
    """When each frame is there, the step that it shows, and the camera's x in m."""
    robot.add("tf_static", transforms(0, ("base_link", "camera", 0.0, 0.0)), 0.0)
    robot.add("camera_info", camera_info(T0_NS), 0.0)
    for arrives_s, stream, data in said:
        robot.add("tf" if stream == "localisation" else stream, data, arrives_s)
        while robot.take_odometry(arrives_s) is not None:
            pass
        frame = robot.take_frame(arrives_s)
        if frame is not None:
            yield arrives_s, int(frame.rgb[0, 0, 0]), float(frame.T_map_camera[0, 3])


WRONG = [(), *((stream,) for stream in STREAMS), ("color", "depth")]
LAG_S = st.floats(0.0, 0.09)
NO_LAG = dict.fromkeys(STREAMS, 0.0)


@settings(max_examples=12, deadline=None)
@given(
    st.floats(-3600.0, 3600.0),
    st.fixed_dictionaries(dict.fromkeys(STREAMS, LAG_S)),
    st.sampled_from(WRONG),
)
@example(3600.0, NO_LAG, ("color", "depth"))
@example(-40.0, {**NO_LAG, "color": 0.09, "depth": 0.09}, ())
@example(-5.0, {**NO_LAG, "tf": 0.09}, ())
@example(3600.0, NO_LAG, ("tf",))
def test_frames_come_again_within_a_second_and_where_the_robot_is(
    jump_s: float, lags_s: dict[str, float], wrong: tuple[str, ...]
) -> None:
    robot = RobotInput(Ros2Config())
    made = list(frames(robot, run(jump_s, lags_s, wrong)))
    after = [arrives_s for arrives_s, step, _ in made if step > JUMPS_AT]
    assert after[0] <= JUMPS_AT * PERIOD_S + 1.0
    assert len([each for each in after if each > (STEPS - 20) * PERIOD_S]) >= 4  # in a second
    off_m = [x_m - SPEED_MPS * step * PERIOD_S for _, step, x_m in made if step != JUMPS_AT]
    assert max(map(abs, off_m)) <= SPEED_MPS * PERIOD_S + 1e-6
    if jump_s < -1.0 and not wrong:
        assert robot.counts.clock_jumps > 0
