"""Joins the network of a robot, and counts what arrives on all of its topics."""
# Talks: counts messages for a while.

from __future__ import annotations

from onemap_ros2.config import NODE, Ros2Config
from onemap_ros2.network.bridge import BridgeNetwork
from onemap_ros2.network.interface import PUBLISHER, RosNetwork
from onemap_ros2.network.rmw import RmwNetwork
from onemap_ros2.topic_list import TopicReport, missing, needs, topic_reports
from onemap_shared.clock import Clock, SystemClock

SETTLE_S = 1.0  # until the tokens of the graph have come
DRAIN_S = 0.1
KEPT = 200  # messages of a topic between two counts: 2 kHz


def survey(config: Ros2Config, seconds: float) -> tuple[list[TopicReport], list[str]]:
    """The robot's topics with their rates, and what is missing; NetworkError without it."""
    clock, network = SystemClock(), join(config, f"{NODE}_topics")
    try:
        deadline_s = clock.monotonic_s() + SETTLE_S
        while clock.monotonic_s() < deadline_s:
            network.wait(SETTLE_S)
        rates_hz = count(network, seconds, clock)
        endpoints = network.endpoints()
    finally:
        network.close()
    reports = topic_reports(endpoints, rates_hz, config.names)
    # What the robot writes and goes on writing; what OneMap writes is silent without a search.
    read = {need.setting for need in needs(config) if need.kind == PUBLISHER} - {"tf_static"}
    silent = [
        f"no message of {each.topic} came in {seconds:g} s, although a node publishes it"
        for each in reports
        if each.rate_hz == 0 and each.setting in read
    ]
    return reports, [*missing(endpoints, config).values(), *silent]


def count(network: RosNetwork, seconds: float, clock: Clock) -> dict[tuple[str, str], float]:
    """Messages per second of every topic that has a publisher, by topic and type."""
    published = {(e.topic, e.ros_type) for e in network.endpoints() if e.kind == PUBLISHER}
    readers = {(topic, kind): network.read(topic, kind, KEPT) for topic, kind in sorted(published)}
    counts = dict.fromkeys(readers, 0)
    began_s = clock.monotonic_s()
    while clock.monotonic_s() - began_s < seconds:
        network.wait(DRAIN_S)
        for name, reader in readers.items():
            counts[name] += len(reader.take())
    lasted_s = clock.monotonic_s() - began_s
    return {name: number / lasted_s for name, number in counts.items()}


def join(config: Ros2Config, node: str = "") -> RosNetwork:
    """A node on the robot's network; NetworkError without its router.

    ``node``: its name, where it is another one than the adapter's.
    """
    if config.middleware == "zenoh-bridge-ros2dds":
        return BridgeNetwork(config.connect)
    return RmwNetwork(config.connect, config.domain, node or NODE, config.namespace)
