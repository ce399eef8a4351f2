"""A ROS 2 robot as rmw_zenoh shows it, in a process of its own: ``python fake_robot.py ENDPOINT``.

Written against the formats, with nothing of the adapter's network: keys, tokens and attachments are
spelt out. It prints what its base is told, one JSON line per message of ``/cmd_vel``.
"""

from __future__ import annotations

import json
import struct
import sys
import threading
import time
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


class FakeRobot:
    """A node with its publishers and the subscriber of its base."""

    def __init__(self, endpoint: str) -> None:
        settings: Any = zenoh.Config()
        for key, value in {
            "mode": "peer",
            "connect/endpoints": [endpoint],
            "listen/endpoints": ["tcp/127.0.0.1:0"],
            "scouting/multicast/enabled": False,
            "timestamping/enabled": True,
        }.items():
            settings.insert_json5(key, json.dumps(value))
        self.session = zenoh.open(settings)
        self.declared: list[Any] = []
        self._head = f"@ros2_lv/0/{self.session.info.zid()}/0"
        self.declared.append(
            self.session.liveliness().declare_token(f"{self._head}/0/NN/%/%/fake_robot")
        )
        self.base = self._base()

    def announce(self, kind: str, topic: str, ros_type: str, qos: str) -> bytes:
        """Declare a token; returns the publisher's id."""
        package, _, name = ros_type.split("/")
        token = (
            f"{self._head}/{len(self.declared)}/{kind}/%/%/fake_robot/{topic.replace('/', '%')}/"
            f"{package}::msg::dds_::{name}_/{type_hash(ros_type)}/{qos}"
        )
        self.declared.append(self.session.liveliness().declare_token(token))
        digest = xxhash.xxh3_128_intdigest(token.encode())
        return struct.pack("<QQ", digest & (2**64 - 1), digest >> 64)

    def key(self, topic: str, ros_type: str) -> str:
        package, _, name = ros_type.split("/")
        return f"0{topic}/{package}::msg::dds_::{name}_/{type_hash(ros_type)}"

    def _base(self) -> Any:
        def on_command(sample: zenoh.Sample) -> None:
            note = sample.attachment.to_bytes() if sample.attachment is not None else b""
            sequence = struct.unpack_from("<q", note)[0] if len(note) == 33 else -1
            message = decode(sample.payload.to_bytes(), COMMAND)
            linear, angular = message.twist.linear.x, message.twist.angular.z
            print(json.dumps([sequence, linear, angular]), flush=True)

        self.announce("MS", "/cmd_vel", COMMAND, "::,10:,:,:,,")
        return self.session.declare_subscriber(self.key("/cmd_vel", COMMAND), on_command)

    def publish(self, topic: str, ros_type: str, *, latched: bool = False) -> Publisher:
        """A publisher of a topic."""
        qos = ":1:,1:,:,:,," if latched else "::,10:,:,:,,"
        key = self.key(topic, ros_type)
        publisher: Any = (
            zenoh.ext.declare_advanced_publisher(
                self.session,
                key,
                cache=zenoh.ext.CacheConfig(max_samples=1),
                publisher_detection=True,
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=None, sporadic_heartbeat=0.5
                ),
            )
            if latched
            else self.session.declare_publisher(key)
        )
        return Publisher(publisher, self.announce("MP", topic, ros_type, qos))


class Publisher:
    """Counts its samples, as the attachment wants it."""

    def __init__(self, publisher: Any, gid: bytes) -> None:
        self._publisher, self._gid, self._sequence = publisher, gid, 0

    def put(self, data: bytes) -> None:
        self._sequence += 1
        note = struct.pack("<qqB", self._sequence, time.time_ns(), 16) + self._gid
        self._publisher.put(data, attachment=note)


def main(endpoint: str) -> None:
    """Stand 1 m along the odometry's x axis and look, until standard input ends."""
    robot = FakeRobot(endpoint)
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
    robot.session.close()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main(sys.argv[1])
