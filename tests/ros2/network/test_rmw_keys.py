"""Keys, tokens and attachments as rmw_zenoh's design document writes them."""

from __future__ import annotations

import struct

import pytest
import xxhash

from onemap_ros2.network import rmw as rmw_keys
from onemap_ros2.network.interface import Endpoint

HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
SESSION = "8b20917502ee955ac4476e0266340d5c"
# From rmw_zenoh's docs/design.md.
NODE = f"@ros2_lv/2/{SESSION}/0/0/NN/%/%/listener"
TOKEN = f"@ros2_lv/2/{SESSION}/0/10/MS/%/%/listener/%chatter/std_msgs::msg::dds_::String_/{HASH}"
CHATTER = Endpoint("MS", "/listener", "/chatter", "std_msgs/msg/String", HASH)


def test_a_topic_key() -> None:
    assert rmw_keys.topic_key(2, "/chatter", "std_msgs/msg/String", HASH) == (
        f"2/chatter/std_msgs::msg::dds_::String_/{HASH}"
    )
    assert rmw_keys.topic_key(0, "/a/b", "std_msgs/msg/String").startswith("0/a/b/std_msgs::")


def test_tokens_are_those_of_the_design_document() -> None:
    assert rmw_keys.node_token(2, SESSION, "listener") == NODE
    token = rmw_keys.endpoint_token(NODE, 10, CHATTER, "::,7:,:,:,,")
    assert token == f"{TOKEN}/::,7:,:,:,,"
    assert rmw_keys.parse_token(token) == CHATTER
    assert token.startswith(rmw_keys.graph_key(2).removesuffix("**"))


def test_a_namespace_and_buffer_backends() -> None:
    token = TOKEN.replace("/MS/%/%/", "/MP/%/%fleet%r1/") + "/::,7:,:,:,,/backends:cpu:"
    endpoint = rmw_keys.parse_token(token)
    assert endpoint is not None
    assert (endpoint.kind, endpoint.node, endpoint.backends) == ("MP", "/fleet/r1/listener", True)


@pytest.mark.parametrize("token", ["", NODE, TOKEN.replace("/MS/", "/XX/"), "x/" * 20])
def test_other_tokens_are_no_endpoints(token: str) -> None:
    assert rmw_keys.parse_token(token) is None


def test_the_attachment_has_33_bytes() -> None:
    gid = rmw_keys.gid_of(TOKEN)
    number = xxhash.xxh3_128_intdigest(TOKEN.encode())
    assert gid == struct.pack("<QQ", number & (2**64 - 1), number >> 64)
    assert rmw_keys.attachment(1, 2, gid) == struct.pack("<qq", 1, 2) + bytes((16,)) + gid


def test_a_server_and_a_node_in_a_namespace() -> None:
    token = (
        TOKEN.replace("/MS/", "/SS/").replace("std_msgs::msg", "std_srvs::srv") + "/::,10:,:,:,,"
    )
    server = rmw_keys.parse_token(token)
    assert server is not None
    assert (server.kind, server.ros_type) == ("SS", "std_srvs/srv/String")
    assert rmw_keys.node_token(2, SESSION, "n", "/a/b") == f"@ros2_lv/2/{SESSION}/0/0/NN/%/%a%b/n"
