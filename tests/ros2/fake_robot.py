"""A ROS 2 robot in a process of its own: ``python fake_robot.py ENDPOINT rmw|bridge [NAV2]``.

As rmw_zenoh or as zenoh-bridge-ros2dds shows it. Written against the formats, with nothing of the
adapter's network: keys, tokens and attachments are spelt out. It prints what its base is told, one
JSON line per message of ``/cmd_vel``.
"""

from __future__ import annotations

import itertools
import json
import struct
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import xxhash
import zenoh
import zenoh.ext

from onemap_ros2.cdr import decode, type_hash
from tests.ros2.robot_messages import camera_info, image, odometry, transforms

WIDTH, HEIGHT, FX = 64, 48, 32.0
COMMAND = "geometry_msgs/msg/TwistStamped"
PERIOD_S = 0.05


def open_session(endpoint: str) -> Any:
    """A peer of the router, as ROS 2's nodes are."""
    settings: Any = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "connect/endpoints": [endpoint],
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
    }.items():
        settings.insert_json5(key, json.dumps(value))
    return zenoh.open(settings)


def remembering(session: zenoh.Session, key: str, hear: Callable[[zenoh.Sample], None]) -> Any:
    """A subscriber of a latched topic."""
    history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
    return zenoh.ext.declare_advanced_subscriber(
        session, key, hear, history=history, subscriber_detection=True
    )


def cached_publisher(session: zenoh.Session, key: str) -> Any:
    """A publisher of a latched topic."""
    return zenoh.ext.declare_advanced_publisher(
        session,
        key,
        cache=zenoh.ext.CacheConfig(max_samples=1),
        publisher_detection=True,
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5),
    )


class Fake:
    """What both forms share: a session, tokens, and services that answer in threads."""

    def __init__(self, endpoint: str) -> None:
        self.session = open_session(endpoint)
        self.zid = self.session.info.zid()
        self.declared: list[Any] = []

    def token(self, token: str) -> None:
        self.declared.append(self.session.liveliness().declare_token(token))

    def answer(self, key: str, answer: Callable[[bytes], bytes], *, attached: bool) -> None:
        """Answer questions; ``attached``: they have sequence and id, which the reply echoes."""

        def on_query(query: zenoh.Query) -> None:
            def run() -> None:
                with query:
                    assert query.payload is not None
                    assert (query.attachment is not None) == attached
                    note = query.attachment.to_bytes() if query.attachment is not None else None
                    query.reply(key, answer(query.payload.to_bytes()), attachment=note)

            threading.Thread(target=run, daemon=True).start()

        self.declared.append(self.session.declare_queryable(key, on_query, complete=attached))

    def ask(self, key: str, request: bytes, note: bytes) -> tuple[bytes, bytes]:
        """The one answer of a service and its attachment."""
        replies = self.session.get(key, payload=request, attachment=note, timeout=30.0)
        (answer,) = [reply.ok for reply in replies if reply.ok is not None]
        attached = answer.attachment.to_bytes() if answer.attachment is not None else b""
        return answer.payload.to_bytes(), attached


class FakeRobot(Fake):
    """A node of rmw_zenoh with its publishers, subscribers and servers."""

    def __init__(self, endpoint: str) -> None:
        super().__init__(endpoint)
        self._head = f"@ros2_lv/0/{self.zid}/0"
        self.token(f"{self._head}/0/NN/%/%/fake_robot")

    def announce(self, kind: str, topic: str, ros_type: str, qos: str = "::,10:,:,:,,") -> bytes:
        """Declare a token; returns the publisher's id."""
        package, section, name = ros_type.split("/")
        token = (
            f"{self._head}/{len(self.declared)}/{kind}/%/%/fake_robot/{topic.replace('/', '%')}/"
            f"{package}::{section}::dds_::{name}_/{type_hash(ros_type)}/{qos}"
        )
        self.token(token)
        digest = xxhash.xxh3_128_intdigest(token.encode())
        return struct.pack("<QQ", digest & (2**64 - 1), digest >> 64)

    def key(self, topic: str, ros_type: str) -> str:
        package, section, name = ros_type.split("/")
        return f"0{topic}/{package}::{section}::dds_::{name}_/{type_hash(ros_type)}"

    def subscribe(
        self, topic: str, ros_type: str, hear: Callable[[bytes], None], *, latched: bool = False
    ) -> None:
        """Hear a topic; what ROS 2 would drop for its attachment is dropped."""

        def on_sample(sample: zenoh.Sample) -> None:
            if sample.attachment is not None and len(sample.attachment.to_bytes()) == 33:
                hear(sample.payload.to_bytes())

        self.announce("MS", topic, ros_type, ":1:,1:,:,:,," if latched else "::,10:,:,:,,")
        declare = remembering if latched else zenoh.Session.declare_subscriber
        self.declared.append(declare(self.session, self.key(topic, ros_type), on_sample))

    def serve(self, service: str, ros_type: str, answer: Callable[[bytes], bytes]) -> None:
        """Answer a service."""
        self.announce("SS", service, ros_type)
        self.answer(self.key(service, ros_type), answer, attached=True)

    def call(self, service: str, ros_type: str, request: bytes) -> bytes:
        """Ask a service; an answer that does not echo number and client belongs to nobody."""
        note = struct.pack("<qqB", 41, time.time_ns(), 16) + bytes(range(16))
        answer, echo = self.ask(self.key(service, ros_type), request, note)
        assert (echo[:8], echo[16:]) == (note[:8], note[16:])
        return answer

    def publish(self, topic: str, ros_type: str, *, latched: bool = False) -> Publisher:
        """A publisher of a topic."""
        declare = cached_publisher if latched else zenoh.Session.declare_publisher
        publisher = declare(self.session, self.key(topic, ros_type))
        gid = self.announce("MP", topic, ros_type, ":1:,1:,:,:,," if latched else "::,10:,:,:,,")
        return Publisher(publisher, gid)


class FakeBridge(Fake):
    """The same robot behind a bridge: keys without types, tokens below the session."""

    def __init__(self, endpoint: str) -> None:
        super().__init__(endpoint)
        self._head = f"@/{self.zid}"
        self.token(f"{self._head}/@ros2_lv")

    def _announce(self, kind: str, topic: str, ros_type: str, qos: str = "") -> None:
        key, escaped = topic[1:].replace("/", "§"), ros_type.replace("/", "§")
        self.token(f"{self._head}/@ros2_lv/{kind}/{key}/{escaped}{qos}")

    def subscribe(
        self, topic: str, ros_type: str, hear: Callable[[bytes], None], *, latched: bool = False
    ) -> None:
        """Hear a topic."""
        self._announce("MS", topic, ros_type, "/:1:1:0,1" if latched else "/:1::0,10")

        def on_sample(sample: zenoh.Sample) -> None:
            hear(sample.payload.to_bytes())

        declare = remembering if latched else zenoh.Session.declare_subscriber
        self.declared.append(declare(self.session, topic[1:], on_sample))

    def serve(self, service: str, ros_type: str, answer: Callable[[bytes], bytes]) -> None:
        """Answer a service; an action is announced as one, with its goals' service."""
        if service.endswith("/_action/send_goal"):
            action = service.removesuffix("/_action/send_goal")
            self._announce("AS", action, ros_type.removesuffix("_SendGoal"))
        elif "/_action/" not in service:
            self._announce("SS", service, ros_type)
        self.answer(service[1:], answer, attached=False)

    def call(self, service: str, ros_type: str, request: bytes) -> bytes:
        """Ask a service, once its token is there; before, the bridge does not offer it."""
        key, escaped = service[1:].replace("/", "§"), ros_type.replace("/", "§")
        (_,) = self.session.liveliness().get(f"@/*/@ros2_lv/SS/{key}/{escaped}")
        return self.ask(service[1:], request, bytes(16))[0]

    def publish(self, topic: str, ros_type: str, *, latched: bool = False) -> Publisher:
        """A publisher of a topic."""
        declare = cached_publisher if latched else zenoh.Session.declare_publisher
        made = Publisher(declare(self.session, topic[1:]), b"")
        if topic.startswith("/camera"):  # best effort: DDS gives nothing to a reliable reader
            made.matched = False

            def on_token(sample: zenoh.Sample) -> None:
                made.matched |= "/:0:" in str(sample.key_expr)

            readers = f"@/*/@ros2_lv/MS/{topic[1:].replace('/', '§')}/**"
            liveliness = self.session.liveliness()
            self.declared.append(liveliness.declare_subscriber(readers, on_token, history=True))
        if "/_action/" not in topic:
            qos = "/:1:1:0,1" if latched else "/:1::0,10" if made.matched else "/:0::0,10"
            self._announce("MP", topic, ros_type, qos)
        return made


class Publisher:
    """Counts its samples, as the attachment wants it."""

    def __init__(self, publisher: Any, gid: bytes) -> None:
        self._publisher, self._gid, self._sequence = publisher, gid, 0
        self.matched = True

    def put(self, data: bytes) -> None:
        if not self.matched:
            return
        self._sequence += 1
        if not self._gid:
            self._publisher.put(data)
            return
        note = struct.pack("<qqB", self._sequence, time.time_ns(), 16) + self._gid
        self._publisher.put(data, attachment=note)


FORMS: dict[str, type[FakeRobot] | type[FakeBridge]] = {
    "rmw": FakeRobot,
    "bridge": FakeBridge,
}


def print_commands(robot: FakeRobot | FakeBridge) -> None:
    """Print what the base is told: a count, forward and turning speed."""
    count = itertools.count(1)

    def on_command(data: bytes) -> None:
        message = decode(data, COMMAND)
        linear, angular = message.twist.linear.x, message.twist.angular.z
        sys.stdout.write(json.dumps([next(count), linear, angular]) + "\n")  # as in fake_nav2
        sys.stdout.flush()

    robot.subscribe("/cmd_vel", COMMAND, on_command)


def main(endpoint: str, form: str, nav2: str = "") -> None:
    """Stand 1 m along the odometry's x axis and look, until standard input ends.

    ``nav2``: how its action behaves; empty: it has none.
    """
    robot = FORMS[form](endpoint)
    print_commands(robot)
    if nav2:
        from tests.ros2.fake_nav2 import FakeNav2

        FakeNav2(robot, nav2)
    static = robot.publish("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
    static.put(transforms(0, ("base_link", "camera", 0.2, 0.0)))  # once, long before the adapter
    tf = robot.publish("/tf", "tf2_msgs/msg/TFMessage")
    odom = robot.publish("/odom", "nav_msgs/msg/Odometry")
    color = robot.publish("/camera/color", "sensor_msgs/msg/Image")
    depth = robot.publish("/camera/depth", "sensor_msgs/msg/Image")
    info = robot.publish("/camera/camera_info", "sensor_msgs/msg/CameraInfo")
    ramp = np.arange(HEIGHT * WIDTH * 3, dtype=np.uint32).astype(np.uint8)
    rgb = ramp.reshape(HEIGHT, WIDTH, 3)
    metres = np.full((HEIGHT, WIDTH), 1.5, np.float32)
    metres[0, 0] = np.nan
    ended = threading.Event()

    def end() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=end, daemon=True).start()
    while not ended.wait(PERIOD_S):
        now = time.time_ns()
        tf.put(transforms(now, ("odom", "base_link", 1.0, 0.0)))
        odom.put(odometry(now, 1.0))
        info.put(camera_info(now, WIDTH, HEIGHT, FX))
        color.put(image(now - 3_000_000, rgb, "rgb8"))
        depth.put(image(now - 3_000_000, metres, "32FC1"))
    robot.session.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
