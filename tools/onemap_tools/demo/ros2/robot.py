"""The process of the simulated ROS 2 robot: the simulator on the formats of rmw_zenoh.

It joins OneMap's bus too, under a name that is no robot's: the demo asks it for the ground truth.
"""

from __future__ import annotations

import os

from onemap_ros2.network.interface import NetworkError, RosNetwork
from onemap_ros2.network.rmw import RmwNetwork
from onemap_shared.runner import StartError
from onemap_shared.transport import Bus, Health
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.service import SimulatorWorker, check, open_scene
from onemap_tools.demo.ros2.robot_bus import COLOR, DEPTH, INFO, Ros2RobotBus
from onemap_tools.demo.setup import ROS2_ROBOT

__all__ = ["NAME", "ROUTER_VARIABLE", "build", "check", "ros2_section"]
NAME = ROS2_ROBOT
ROUTER_VARIABLE = "ONEMAP_DEMO_ROUTER"  # where the robot's network is; the demo sets it
DOMAIN = 0


class Ros2Robot:
    """Implements ``transport.Worker``: the simulator's worker, and the network that it has."""

    def __init__(self, bus: Bus, network: RosNetwork, config: SimulatorConfig) -> None:
        self._bus = Ros2RobotBus(bus, network, config.camera.mount)
        self._worker = SimulatorWorker(self._bus, open_scene(config), config)

    def step(self, timeout_s: float) -> None:
        """See ``transport.Worker``."""
        self._worker.step(timeout_s)

    def health(self) -> Health:
        """See ``transport.Worker``."""
        return self._worker.health()

    def close(self) -> None:
        """Stop the camera, then leave the robot's network."""
        self._worker.close()
        self._bus.close()


def build(bus: Bus, config: SimulatorConfig) -> Ros2Robot:
    """Join the robot's network and open the scene, or raise StartError."""
    endpoint = os.environ[ROUTER_VARIABLE]
    try:
        network = RmwNetwork((endpoint,), DOMAIN, NAME)
        return Ros2Robot(bus, network, config)
    except NetworkError as problem:
        raise StartError(str(problem), temporary=True) from problem
    except ValueError as problem:
        raise StartError(str(problem)) from problem


def ros2_section(endpoint: str) -> dict[str, object]:
    """The adapter's section for this robot."""
    return {
        "connect": [endpoint],
        "domain": DOMAIN,
        "map_frame": "map",
        "topics": {"color": COLOR, "depth": DEPTH, "camera_info": INFO},
    }
