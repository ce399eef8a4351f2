"""Golden bytes, built with ``struct`` alone, and hashes that ROS 2 has published."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from onemap_ros2 import cdr
from tests.ros2.robot_messages import image, vector

STAMP_NS = 1_700_000_000_123_456_789
PUBLISHED = {
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "sensor_msgs/msg/Image": "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    "geometry_msgs/msg/Twist": "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "geometry_msgs/msg/TwistStamped": (
        "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"
    ),
    "sensor_msgs/msg/PointCloud2": (
        "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"
    ),
    "geometry_msgs/msg/PoseArray": (
        "af0cc36d190e104d546d168d6b39df04fa4b4ccecf59cb4c9ed328d3d5004aa0"
    ),
    "nav2_msgs/msg/CostmapFilterInfo": (
        "61ce391bf7690f76a331c01c9d5ce8ca71e6c99273b9fb75e48380f05c6dfdc8"
    ),
    "nav_msgs/msg/OccupancyGrid": (
        "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7"
    ),
    "diagnostic_msgs/msg/DiagnosticArray": (
        "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"
    ),
    "std_srvs/srv/Trigger": "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
}


@pytest.mark.parametrize("ros_type", PUBLISHED)
def test_hashes_are_those_that_ros_publishes(ros_type: str) -> None:
    assert cdr.type_hash(ros_type) == f"RIHS01_{PUBLISHED[ros_type]}"


def test_a_stamped_twist_aligns_its_doubles() -> None:
    kind = "geometry_msgs/msg/TwistStamped"
    twist = cdr.new("geometry_msgs/msg/Twist", vector(0.5, 0.0, 0.0), vector(0.0, 0.0, 1.0))
    message = cdr.new(kind, cdr.header(STAMP_NS, "base_link"), twist)
    body = struct.pack("<iII10s", 1_700_000_000, 123_456_789, 10, b"base_link\0")
    body += bytes(-len(body) % 8) + struct.pack("<6d", 0.5, 0, 0, 0, 0, 1.0)
    assert cdr.encode(message, kind) == bytes((0, 1, 0, 0)) + body
    assert cdr.decode(bytes((0, 1, 0, 0)) + body, kind).twist.angular.z == 1.0


def test_an_image_is_what_struct_says() -> None:
    kind = "sensor_msgs/msg/Image"
    body = struct.pack("<iII7s", 1_700_000_000, 123_456_789, 7, b"camera\0")
    body += bytes(-len(body) % 4) + struct.pack("<III5s", 1, 2, 5, b"rgb8\0")
    body += struct.pack("<B", 0)
    body += bytes(-len(body) % 4) + struct.pack("<II6s", 6, 6, bytes(range(6)))
    message = cdr.decode(bytes((0, 1, 0, 0)) + body, kind)
    assert (message.height, message.width, message.encoding, message.step) == (1, 2, "rgb8", 6)
    assert bytes(message.data) == bytes(range(6))
    assert cdr.stamp_ns(message.header.stamp) == STAMP_NS
    assert cdr.peek_stamp_ns(bytes((0, 1, 0, 0)) + body) == STAMP_NS
    pixels = np.arange(6, dtype=np.uint8).reshape(1, 2, 3)
    assert image(STAMP_NS, pixels, "rgb8") == bytes((0, 1, 0, 0)) + body


def test_a_stamp_is_read_in_both_byte_orders() -> None:
    assert cdr.peek_stamp_ns(bytes((0, 0, 0, 0)) + struct.pack(">iI", 3, 7)) == 3_000_000_007
    assert cdr.peek_stamp_ns(bytes((0, 1, 0, 0)) + struct.pack("<iI", 3, 7)) == 3_000_000_007


@pytest.mark.parametrize("data", [b"", bytes((0, 1, 0, 0)), bytes((0, 1, 0, 0)) + b"\xff" * 40])
def test_what_is_no_message_is_refused(data: bytes) -> None:
    with pytest.raises(cdr.FormatError, match="bytes are no sensor_msgs/msg/Image"):
        cdr.decode(data, "sensor_msgs/msg/Image")
