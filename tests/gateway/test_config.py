"""Who may listen where, with which tokens, and the file that may hold them."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import SecretStr, ValidationError

from onemap_gateway.config import MAX_TOKEN_CHARS, GatewayConfig, Role, with_token_file
from onemap_shared.config import ConfigError, section
from onemap_shared.runner import StartError


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "robot.local"])
def test_an_open_address_needs_a_token_or_that_none_is_wanted(host: str) -> None:
    GatewayConfig(host=host, token=SecretStr("secret"))
    GatewayConfig(host=host, token_file="/run/secret")
    GatewayConfig(host=host, allow_unauthenticated=True)
    with pytest.raises(ValidationError, match="set 'token'") as refusal:
        GatewayConfig(host=host)
    assert host in str(refusal.value)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"token": "two words"}, "printable ASCII"),
        ({"token": "pässwort"}, "printable ASCII"),
        ({"token": "hunter2", "look_token": "hunter2"}, "the same token"),
        ({"look_token": "hunter2"}, "without 'token'"),
        ({"token": "hunter2", "token_file": "/x"}, "both set"),
    ],
)
def test_tokens_that_cannot_be_used_are_refused_without_showing_them(
    values: dict[str, str], reason: str
) -> None:
    with pytest.raises(ConfigError, match=reason) as refusal:
        section({"gateway": values}, "gateway", GatewayConfig)
    assert "hunter2" not in str(refusal.value)


def test_the_content_is_the_token_without_its_line_end(tmp_path: Path) -> None:
    file = tmp_path / "secret"
    file.write_text("0123#\n")
    config = GatewayConfig(host="0.0.0.0", token_file=str(file))
    assert with_token_file(config, {}).tokens()[Role.ADMINISTER] == "0123#"


def test_a_bare_name_is_a_credential_which_may_hold_several_roles(tmp_path: Path) -> None:
    (tmp_path / "tokens").write_text("look abc\nadminister def\n")
    config = GatewayConfig(token_file="tokens")
    tokens = with_token_file(config, {"CREDENTIALS_DIRECTORY": str(tmp_path)}).tokens()
    assert tokens == {Role.ADMINISTER: "def", Role.SEARCH: "", Role.LOOK: "abc"}


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (None, "No such file"),
        (b"", "must hold"),
        (b"\n", "must hold"),
        (b"x" * (MAX_TOKEN_CHARS + 1), "must hold"),
        (b"hunter2 x", "must hold"),
        (b"hunter2\n\n", "must hold"),
        (b"search hunter2", "without 'token'"),
        (b"hunter2\t", "printable ASCII"),
        ("hunter2ä".encode(), "not ASCII"),
    ],
)
def test_a_file_that_holds_no_token_is_refused_without_showing_it(
    content: bytes | None, reason: str, tmp_path: Path
) -> None:
    file = tmp_path / "secret"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(StartError, match=reason) as refusal:
        with_token_file(GatewayConfig(token_file=str(file)), {})
    assert "hunter2" not in str(refusal.value)


def test_a_credential_that_systemd_did_not_pass_is_named() -> None:
    with pytest.raises(StartError, match="LoadCredential=secret:FILE"):
        with_token_file(GatewayConfig(token_file="secret"), {})
