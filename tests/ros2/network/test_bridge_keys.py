"""Keys and tokens as zenoh-plugin-ros2dds writes them."""

from __future__ import annotations

import pytest

from onemap_ros2.network import bridge as bridge_keys
from onemap_ros2.network.interface import Endpoint, serves_action

SESSION = "8b20917502ee955ac4476e0266340d5c"
# As its liveliness_mgt.rs formats a publisher: @/<id>/@ros2_lv/MP/<key>/<type>/<qos>
TOKEN = f"@/{SESSION}/@ros2_lv/MP/r1§camera§color/sensor_msgs§msg§Image/:1::0,10"
COLOR = Endpoint("MP", "", "/r1/camera/color", "sensor_msgs/msg/Image", "")


def test_a_topic_key_has_no_type() -> None:
    assert bridge_keys.topic_key("/r1/camera/color") == "r1/camera/color"


def test_tokens_are_those_of_the_plugin() -> None:
    assert bridge_keys.endpoint_token(SESSION, COLOR, bridge_keys.QOS_RELIABLE) == TOKEN
    assert bridge_keys.parse_token(TOKEN) == COLOR
    assert bridge_keys.bridge_token(SESSION) == f"@/{SESSION}/@ros2_lv"
    assert bridge_keys.graph_key() == "@/*/@ros2_lv/**"


def test_a_latched_topic_has_a_cache_below_its_bridge() -> None:
    assert bridge_keys.cache_key("/tf_static", SESSION) == f"@/{SESSION}/@ros2_pub_cache/tf_static"
    assert bridge_keys.cache_key("/tf_static") == "@/*/@ros2_pub_cache/tf_static"


@pytest.mark.parametrize(
    "token",
    ["", f"@/{SESSION}/@ros2_lv", TOKEN.replace("MP", "XX"), TOKEN.replace("@ros2_lv", "@x")],
)
def test_other_tokens_are_no_endpoints(token: str) -> None:
    assert bridge_keys.parse_token(token) is None


def test_an_action_is_one_endpoint() -> None:
    found = bridge_keys.parse_token(
        f"@/{SESSION}/@ros2_lv/AS/navigate_to_pose/nav2_msgs§action§NavigateToPose"
    )
    assert found is not None
    assert serves_action((found,), "/navigate_to_pose")
    assert not serves_action((found,), "/r2/navigate_to_pose")
