"""The simulated robot on ROS 2's formats: what the adapter makes of it is what it said."""

from __future__ import annotations

import numpy as np

from onemap_ros2.cdr import CAMERA_INFO, IMAGE, ODOMETRY, TF, TWIST_STAMPED
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.velocity import twist
from onemap_ros2.robot_input import RobotInput
from onemap_shared import keys
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import Velocity2d, camera_mount, pose_2d
from onemap_shared.messages import Odometry, RgbdFrame, Truth, TruthRequest
from onemap_tools.demo.ros2_robot import COLOR, DEPTH, INFO, Ros2RobotBus, ros2_section
from tests.memory_bus import MemoryRouter
from tests.ros2.fake_network import FakeNetwork

T_BODY_CAMERA = camera_mount(0.1, 1.0, 0.2)
SAID = {
    "tf_static": ("/tf_static", TF),
    "tf": ("/tf", TF),
    "camera_info": (INFO, CAMERA_INFO),
    "odometry": ("/odom", ODOMETRY),
    "color": (COLOR, IMAGE),
    "depth": (DEPTH, IMAGE),
}


def robot() -> tuple[MemoryRouter, FakeNetwork, Ros2RobotBus]:
    router, network = MemoryRouter(), FakeNetwork()
    return router, network, Ros2RobotBus(router.bus("ros2_robot"), network, T_BODY_CAMERA)


def test_the_adapter_makes_the_same_frames_and_odometry_of_it() -> None:
    _, network, bus = robot()
    rng = np.random.default_rng(0)
    pose = pose_2d(1.0, -2.0, 0.7)
    rgb = rng.integers(0, 255, (12, 16, 3)).astype(np.uint8)
    depth = rng.integers(0, 5000, (12, 16)).astype(np.uint16)
    camera = Intrinsics(12.0, 12.0, 8.0, 6.0)
    frame = RgbdFrame(0, 5_000_000_000, rgb, depth, camera, pose @ T_BODY_CAMERA)
    odometry = Odometry(0, 5_000_000_000, pose, 0.3, -0.2)
    bus.publish(keys.ROBOT_ODOMETRY).put(odometry)
    bus.publish(keys.ROBOT_RGBD).put(frame)
    made = RobotInput(Ros2Config.model_validate(ros2_section("tcp/127.0.0.1:1")))
    for kind, key in SAID.items():
        for data in network.writers[key].sent:
            made.add(kind, data, 0.0)
    again, message = made.take_frame(0.0), made.take_odometry(0.0)
    assert again is not None, made.problem
    assert message is not None, made.problem
    np.testing.assert_array_equal(again.rgb, rgb)
    np.testing.assert_array_equal(again.depth_mm, depth)
    assert again.intrinsics == camera
    np.testing.assert_allclose(again.T_map_camera, frame.T_map_camera, atol=1e-9)
    np.testing.assert_allclose(message.T_map_body, pose, atol=1e-9)
    assert (message.linear_mps, message.angular_radps) == (0.3, -0.2)
    assert network.latched == {"/tf_static"}


def test_its_base_hears_velocities_and_takes_the_newest() -> None:
    _, network, bus = robot()
    commands = bus.subscribe(keys.ROBOT_CMD_VEL)
    assert commands.take(0.0) is None
    for speed in (0.1, 0.25):
        network.say("/cmd_vel", twist(Velocity2d(speed, -0.5), TWIST_STAMPED, 1, "base_link"))
    command = commands.take(0.0)
    assert command is not None
    assert (command.linear_mps, command.angular_radps) == (0.25, -0.5)
    assert commands.counters.received == 1


def test_the_rest_goes_over_the_other_bus() -> None:
    router, network, bus = robot()
    bus.serve(keys.ROBOT_TRUTH, lambda _: Truth("flat", 0, 1.0, 2.0, (), "", False))
    asker = router.bus()
    assert asker.call(keys.ROBOT_TRUTH, TruthRequest("sofa", 0.0, 0.0)).scene == "flat"
    assert bus.call(keys.ROBOT_TRUTH, TruthRequest("sofa", 0.0, 0.0)).scene == "flat"
    assert bus.subscribe(keys.MAP_REVISION).take(0.0) is None
    assert ("ros2_robot", bus.instance) in bus.members()
    assert bus.alive() == {"ros2_robot"}
    bus.close()
    assert network.closed
