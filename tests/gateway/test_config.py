"""Who may listen where."""

from __future__ import annotations

import pytest
from pydantic import SecretStr, ValidationError

from onemap_gateway.config import GatewayConfig, is_loopback
from onemap_shared.config import ConfigError, section


def test_the_default_listens_on_this_machine_only() -> None:
    assert is_loopback(GatewayConfig().host)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.9.1", "::1", "localhost"])
def test_loopback_needs_no_token(host: str) -> None:
    assert GatewayConfig(host=host).host == host


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "robot.local"])
def test_an_open_address_without_a_token_is_refused_with_what_to_do(host: str) -> None:
    with pytest.raises(ValidationError, match="set 'token'") as refusal:
        GatewayConfig(host=host)
    assert host in str(refusal.value)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7"])
def test_an_open_address_is_fine_with_a_token_or_when_asked_for(host: str) -> None:
    assert GatewayConfig(host=host, token=SecretStr("secret")).host == host
    assert GatewayConfig(host=host, token_file="/run/secret").host == host
    assert GatewayConfig(host=host, allow_unauthenticated=True).host == host


def test_the_token_is_not_printed() -> None:
    assert "secret" not in repr(GatewayConfig(token=SecretStr("secret")))


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"token": "two words"}, "printable ASCII"),
        ({"token": "pässwort"}, "printable ASCII"),
        ({"token": "hunter2", "look_token": "hunter2"}, "the same token"),
        ({"look_token": "hunter2"}, "without 'token'"),
        ({"search_token_file": "/x"}, "without 'token'"),
        ({"token": "hunter2", "token_file": "/x"}, "both set"),
    ],
)
def test_tokens_that_cannot_be_used_are_refused_without_showing_them(
    values: dict[str, str], reason: str
) -> None:
    with pytest.raises(ConfigError, match=reason) as refusal:
        section({"gateway": values}, "gateway", GatewayConfig)
    assert "hunter2" not in str(refusal.value)


def test_a_former_key_is_refused_with_its_new_name() -> None:
    with pytest.raises(ConfigError, match="max_concurrent_calls"):
        section({"gateway": {"calls_at_once": 4}}, "gateway", GatewayConfig)
