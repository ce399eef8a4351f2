"""Reads the tokens that the configuration keeps in files."""
# Touches files: tokens.

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from pydantic import ValidationError

from onemap_gateway.config import TOKENS, GatewayConfig
from onemap_shared.runner import StartError

MAX_TOKEN_CHARS = 4096  # longer headers are refused anyway


def with_token_files(
    config: GatewayConfig, environment: Mapping[str, str] = os.environ
) -> GatewayConfig:
    """The configuration with the tokens of its files in it; raises StartError.

    A line end after the token is no part of it, everything else is.
    """
    values = config.model_dump()
    for name in TOKENS.values():
        setting = f"{name}_file"
        if values[setting]:
            values[name] = _content(setting, values[setting], environment)
            values[setting] = ""
    try:
        return GatewayConfig.model_validate(values)
    except ValidationError as problem:
        reasons = "; ".join(error["msg"] for error in problem.errors(include_input=False))
        raise StartError(f"the tokens of 'gateway' cannot be used: {reasons}") from None


def _content(setting: str, name: str, environment: Mapping[str, str]) -> str:
    path = Path(name)
    if path.name == name:
        folder = environment.get("CREDENTIALS_DIRECTORY")
        if not folder:
            raise StartError(
                f"'gateway.{setting}' names the credential {name!r}, but systemd passed none: add "
                f"LoadCredential={name}:FILE to the unit, or give a path"
            )
        path = Path(folder, name)
    try:
        token = path.read_text(encoding="ascii").removesuffix("\n")
    except (OSError, UnicodeDecodeError) as problem:
        reason = getattr(problem, "strerror", None) or "it is not ASCII"
        raise StartError(f"cannot read 'gateway.{setting}' {path}: {reason}") from None
    if not token or len(token) > MAX_TOKEN_CHARS:
        raise StartError(
            f"'gateway.{setting}' {path} must hold 1 to {MAX_TOKEN_CHARS} characters: write a "
            "token into it, for example with openssl rand -hex 32"
        )
    return token
