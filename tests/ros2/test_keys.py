"""Keys, tokens and attachments as rmw_zenoh's design and zenoh-plugin-ros2dds write them."""

from __future__ import annotations

import struct

import pytest
import xxhash

from onemap_ros2.network import bridge, rmw
from onemap_ros2.network.interface import Endpoint
from onemap_ros2.topic_list import serves_action

HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
SESSION = "8b20917502ee955ac4476e0266340d5c"
# From rmw_zenoh's docs/design.md.
NODE = f"@ros2_lv/2/{SESSION}/0/0/NN/%/%/listener"
TOKEN = f"@ros2_lv/2/{SESSION}/0/10/MS/%/%/listener/%chatter/std_msgs::msg::dds_::String_/{HASH}"
CHATTER = Endpoint("MS", "/listener", "/chatter", "std_msgs/msg/String", HASH)


def test_keys_and_tokens_of_rmw_are_those_of_the_design_document() -> None:
    key = f"2/chatter/std_msgs::msg::dds_::String_/{HASH}"
    assert rmw.topic_key(2, "/chatter", "std_msgs/msg/String", HASH) == key
    assert rmw.topic_key(0, "/a/b", "std_msgs/msg/String").startswith("0/a/b/std_msgs::")
    assert rmw.node_token(2, SESSION, "listener") == NODE
    assert rmw.node_token(2, SESSION, "n", "/a/b") == f"@ros2_lv/2/{SESSION}/0/0/NN/%/%a%b/n"
    token = rmw.endpoint_token(NODE, 10, CHATTER, "::,7:,:,:,,")
    assert token == f"{TOKEN}/::,7:,:,:,,"
    assert rmw.parse_token(token) == CHATTER
    assert token.startswith(rmw.graph_key(2).removesuffix("**"))


def test_a_server_a_namespace_and_buffer_backends() -> None:
    token = TOKEN.replace("/MS/%/%/", "/MP/%/%fleet%r1/") + "/::,7:,:,:,,/backends:cpu:"
    endpoint = rmw.parse_token(token)
    assert endpoint is not None
    assert (endpoint.kind, endpoint.node, endpoint.backends) == ("MP", "/fleet/r1/listener", True)
    token = TOKEN.replace("/MS/", "/SS/").replace("std_msgs::msg", "std_srvs::srv")
    server = rmw.parse_token(f"{token}/::,10:,:,:,,")
    assert server is not None
    assert (server.kind, server.ros_type) == ("SS", "std_srvs/srv/String")


def test_the_attachment_has_33_bytes() -> None:
    gid = rmw.gid_of(TOKEN)
    number = xxhash.xxh3_128_intdigest(TOKEN.encode())
    assert gid == struct.pack("<QQ", number & (2**64 - 1), number >> 64)
    assert rmw.attachment(1, 2, gid) == struct.pack("<qq", 1, 2) + bytes((16,)) + gid


# As the plugin's liveliness_mgt.rs formats a publisher: @/<id>/@ros2_lv/MP/<key>/<type>/<qos>
BRIDGED = f"@/{SESSION}/@ros2_lv/MP/r1§camera§color/sensor_msgs§msg§Image/:1::0,10"
COLOR = Endpoint("MP", "", "/r1/camera/color", "sensor_msgs/msg/Image", "")


def test_keys_and_tokens_of_a_bridge_are_those_of_the_plugin() -> None:
    assert bridge.topic_key("/r1/camera/color") == "r1/camera/color"
    assert bridge.endpoint_token(SESSION, COLOR, bridge.QOS_RELIABLE) == BRIDGED
    assert bridge.parse_token(BRIDGED) == COLOR
    assert bridge.bridge_token(SESSION) == f"@/{SESSION}/@ros2_lv"
    assert bridge.graph_key() == "@/*/@ros2_lv/**"


def test_an_action_of_a_bridge_is_one_endpoint() -> None:
    action = f"@/{SESSION}/@ros2_lv/AS/navigate_to_pose/nav2_msgs§action§NavigateToPose"
    found = bridge.parse_token(action)
    assert found is not None
    assert serves_action((found,), "/navigate_to_pose")
    assert not serves_action((found,), "/r2/navigate_to_pose")


@pytest.mark.parametrize(
    "token",
    [
        "",
        NODE,
        TOKEN.replace("/MS/", "/XX/"),
        "x/" * 20,
        f"@/{SESSION}/@ros2_lv",
        BRIDGED.replace("MP", "XX"),
        BRIDGED.replace("@ros2_lv", "@x"),
    ],
)
def test_other_tokens_are_no_endpoints(token: str) -> None:
    assert rmw.parse_token(token) is None
    assert bridge.parse_token(token) is None
