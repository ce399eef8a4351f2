"""Configuration of the gateway, and the files in which it may keep its tokens."""

from __future__ import annotations

import os
from collections.abc import Mapping
from enum import IntEnum
from ipaddress import ip_address
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import (
    Field,
    SecretStr,
    ValidationError,
    field_validator,
    model_validator,
)

from onemap_shared.keys import NAMESPACE
from onemap_shared.params import Params
from onemap_shared.runner import StartError

RobotName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")]
Namespace = Annotated[str, Field(pattern=NAMESPACE)]


class Role(IntEnum):
    """What a client may do; each role may also do what the ones below it may."""

    NOBODY = 0  # see the page, its documentation, and whether the gateway is well
    LOOK = 1  # read
    SEARCH = 2  # start and stop searches
    ADMINISTER = 3  # change the map, saved maps and objects


TOKENS = {Role.ADMINISTER: "token", Role.SEARCH: "search_token", Role.LOOK: "look_token"}


class GatewayConfig(Params):
    """Section ``gateway`` of the configuration."""

    former_keys: ClassVar[Mapping[str, str]] = {
        "search_token_file": "token_file",
        "look_token_file": "token_file",
    }

    host: str = Field(
        default="127.0.0.1",
        min_length=1,
        description="Address to listen on; loopback, because the page drives a robot.",
    )
    port: int = Field(
        default=8080, ge=0, le=65535, description="TCP port; 0 takes any free one (tests)."
    )
    allowed_hosts: tuple[str, ...] = Field(
        default=(),
        description="Host names under which clients reach the gateway, without port. IP addresses "
        "and localhost always pass: only a name can be rebound to this machine by a web page.",
    )
    token: SecretStr = Field(
        default=SecretStr(""),
        description="If set, every request that shows or changes something needs 'Authorization: "
        "Bearer <token>'. This one may do everything. Printable ASCII without spaces; in quotes.",
    )
    search_token: SecretStr = Field(
        default=SecretStr(""),
        description="A second token, which may start and stop searches and read everything, but "
        "change neither the map nor objects; needs 'token'.",
    )
    look_token: SecretStr = Field(
        default=SecretStr(""),
        description="A third token, which may only read: map, camera, state, queries; needs "
        "'token'.",
    )
    token_file: str = Field(
        default="",
        description="File that holds the tokens, so that they are in no environment: that of "
        "'token', or a line for each role, 'administer TOKEN', 'search TOKEN', 'look TOKEN'. A "
        "name without a folder is that of a systemd credential (LoadCredential=).",
    )
    allow_unauthenticated: bool = Field(
        default=False,
        description="Listen beyond loopback without a token: only on a trusted network, because "
        "whoever reaches the port sees the camera and drives the robot.",
    )
    agent_max_distance_m: float = Field(
        default=100.0,
        gt=0,
        le=1e6,
        description="Metres that one search of an agent over /mcp may drive; it has to name its "
        "own limit, at most this one, and may take 9 s for each. 100 m are several searches of a "
        "flat.",
    )
    robots: dict[RobotName, Namespace] = Field(
        default={},
        max_length=64,
        description="Further robots on the same router, each a name and its bus.namespace, for "
        "example {r1: site/r1}: served under /robots/<name>/, listed by /v1/robots. Each takes "
        "part of the router's link for its camera's frames.",
    )

    @field_validator("token", "search_token", "look_token")
    @classmethod
    def _can_be_sent(cls, token: SecretStr) -> SecretStr:
        if any(not "!" <= character <= "~" for character in token.get_secret_value()):
            raise ValueError("a token may hold only printable ASCII characters and no spaces")
        return token

    @model_validator(mode="after")
    def _tokens_fit_together(self) -> GatewayConfig:
        tokens = [token for token in self.tokens().values() if token]
        if len(set(tokens)) < len(tokens):
            raise ValueError("two roles have the same token: each needs one of its own")
        token = self.token.get_secret_value()
        if token and self.token_file:
            raise ValueError("'token' and 'token_file' are both set: remove one of them")
        if tokens and not (token or self.token_file):
            raise ValueError("a token is set without 'token': set 'token' too")
        return self

    @model_validator(mode="after")
    def _token_beyond_loopback(self) -> GatewayConfig:
        has_token = self.token.get_secret_value() or self.token_file
        if not (is_loopback(self.host) or has_token or self.allow_unauthenticated):
            raise ValueError(
                f"listening on {self.host} lets the whole network drive the robot: set 'token', "
                "listen on 127.0.0.1, or say 'allow_unauthenticated: true' if the network is "
                "trusted"
            )
        return self

    def tokens(self) -> dict[Role, str]:
        """The token of each role; empty if it has none."""
        return {role: getattr(self, name).get_secret_value() for role, name in TOKENS.items()}


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server that listens on ``host``."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


MAX_TOKEN_CHARS = 4096  # longer headers are refused anyway


def with_token_file(
    config: GatewayConfig, environment: Mapping[str, str] = os.environ
) -> GatewayConfig:
    """The configuration with the tokens of its file in it; raises StartError."""
    if not config.token_file:
        return config
    found = {}
    for line in _content(config.token_file, environment).split("\n"):
        role, _, token = line.rpartition(" ")
        name = {"": "token", **{each.name.lower(): name for each, name in TOKENS.items()}}.get(role)
        given = name in found or (name and getattr(config, name).get_secret_value())
        if name is None or given or not 1 <= len(token) <= MAX_TOKEN_CHARS:
            raise StartError(
                f"'gateway.token_file' {config.token_file} must hold one token of 1 to "
                f"{MAX_TOKEN_CHARS} characters, or a line for each role that has none yet, as in "
                "'search TOKEN': write them into it, for example with openssl rand -hex 32"
            )
        found[name] = token
    try:
        return GatewayConfig.model_validate({**config.model_dump(), **found, "token_file": ""})
    except ValidationError as problem:
        reasons = "; ".join(error["msg"] for error in problem.errors(include_input=False))
        raise StartError(f"the tokens of 'gateway' cannot be used: {reasons}") from None


def _content(name: str, environment: Mapping[str, str]) -> str:
    path = Path(name)
    if path.name == name:
        folder = environment.get("CREDENTIALS_DIRECTORY")
        if not folder:
            raise StartError(
                f"'gateway.token_file' names the credential {name!r}, but systemd passed none: add "
                f"LoadCredential={name}:FILE to the unit, or give a path"
            )
        path = Path(folder, name)
    try:
        return path.read_text(encoding="ascii").removesuffix("\n")
    except (OSError, UnicodeDecodeError) as problem:
        reason = getattr(problem, "strerror", None) or "it is not ASCII"
        raise StartError(f"cannot read 'gateway.token_file' {path}: {reason}") from None
