"""Tokens in files and systemd's credentials."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_gateway.config import MAX_TOKEN_CHARS, GatewayConfig, Role, with_token_files
from onemap_shared.runner import StartError


def test_the_content_is_the_token_without_its_line_end(tmp_path: Path) -> None:
    file = tmp_path / "secret"
    file.write_text("0123#\n")
    config = GatewayConfig(host="0.0.0.0", token_file=str(file))
    assert with_token_files(config, {}).tokens()[Role.ADMINISTER] == "0123#"


def test_a_bare_name_is_a_credential(tmp_path: Path) -> None:
    (tmp_path / "look").write_text("abc")
    (tmp_path / "all").write_text("def")
    config = GatewayConfig(token_file="all", look_token_file="look")
    tokens = with_token_files(config, {"CREDENTIALS_DIRECTORY": str(tmp_path)}).tokens()
    assert tokens == {Role.ADMINISTER: "def", Role.SEARCH: "", Role.LOOK: "abc"}


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (None, "No such file"),
        (b"", "must hold"),
        (b"\n", "must hold"),
        (b"x" * (MAX_TOKEN_CHARS + 1), "must hold"),
        (b"hunter2 x", "printable ASCII"),
        (b"hunter2\n\n", "printable ASCII"),
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
        with_token_files(GatewayConfig(token_file=str(file)), {})
    assert "hunter2" not in str(refusal.value)


def test_a_credential_that_systemd_did_not_pass_is_named() -> None:
    with pytest.raises(StartError, match="LoadCredential=secret:FILE"):
        with_token_files(GatewayConfig(token_file="secret"), {})
