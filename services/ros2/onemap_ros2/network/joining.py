"""Joins the robot's network in the form that the configuration names."""

from __future__ import annotations

from onemap_ros2.config import Ros2Config
from onemap_ros2.network.bridge import BridgeNetwork
from onemap_ros2.network.interface import RosNetwork
from onemap_ros2.network.rmw import RmwNetwork


def join(config: Ros2Config, node: str = "") -> RosNetwork:
    """A node on the robot's network; NetworkError without its router.

    ``node``: its name, where it is another one than the adapter's.
    """
    if config.middleware == "zenoh-bridge-ros2dds":
        return BridgeNetwork(config.connect)
    return RmwNetwork(config.connect, config.domain, node or config.node, config.namespace)
