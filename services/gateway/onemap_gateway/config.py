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
    IPvAnyNetwork,
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

    former_keys: ClassVar[Mapping[str, str]] = {"calls_at_once": "max_concurrent_calls"}

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
        description="File that holds 'token', so that it is in no environment; a name without a "
        "folder is that of a systemd credential (LoadCredential=).",
    )
    search_token_file: str = Field(default="", description="The same for 'search_token'.")
    look_token_file: str = Field(default="", description="The same for 'look_token'.")
    allow_unauthenticated: bool = Field(
        default=False,
        description="Listen beyond loopback without a token: only on a trusted network, because "
        "whoever reaches the port sees the camera and drives the robot.",
    )
    trusted_proxies: tuple[IPvAnyNetwork, ...] = Field(
        default=(),
        description="Addresses or networks of proxies whose header X-Forwarded-For says who the "
        "client is, for the lock-out after wrong tokens. Empty: the header is not read, because "
        "whoever guesses tokens could name another address with each guess.",
    )
    call_timeout_s: float = Field(
        default=3.0,
        gt=0,
        le=30,
        description="Seconds to wait for a service's reply. A healthy service needs under 0.5 s; "
        "mapper and planner themselves wait up to 2 s for perception, then report it missing. A "
        "search whose names took longer to check is not started.",
    )
    max_concurrent_calls: int = Field(
        default=4,
        ge=1,
        le=64,
        description="Concurrent calls to one service, which handles one of a kind at a time "
        "anyway; queries have threads of their own.",
    )
    max_connections: int = Field(
        default=256,
        ge=8,
        le=65535,
        description="Concurrent connections of all clients, sockets included; further "
        "ones get 503. A page has up to 7; each costs a descriptor, of which a process has 1024.",
    )
    agent_max_distance_m: float = Field(
        default=100.0,
        gt=0,
        le=1e6,
        description="Metres that one search of an agent over /mcp may drive; it has to name its "
        "own limit, at most this one. 100 m are several searches of a flat.",
    )
    agent_max_time_s: float = Field(
        default=900.0,
        gt=0,
        le=1e6,
        description="Seconds that one search of an agent over /mcp may take, in the same way.",
    )
    robots: dict[RobotName, Namespace] = Field(
        default={},
        max_length=64,
        description="Further robots on the same router, each a name and its bus.namespace, for "
        "example {r1: site/r1}: served under /robots/<name>/, listed by /v1/robots. Each takes "
        "part of the router's link for its camera's frames.",
    )
    ready_within_s: float = Field(
        default=5.0,
        gt=0,
        description="Seconds since a frame reached the map after which /readyz says 503.",
    )
    live_rate_hz: float = Field(
        default=5.0,
        gt=0,
        le=60,
        description="State messages per second on /v1/live; the page interpolates in between.",
    )
    jpeg_quality: int = Field(
        default=80, ge=1, le=100, description="Camera image, percent; 80 shows no blocks."
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
        for name in TOKENS.values():
            if getattr(self, name).get_secret_value() and getattr(self, f"{name}_file"):
                raise ValueError(f"'{name}' and '{name}_file' are both set: remove one of them")
            if self._is_set(name) and not self._is_set("token"):
                raise ValueError(f"'{name}' is set without 'token', which nobody could use then")
        return self

    @model_validator(mode="after")
    def _token_beyond_loopback(self) -> GatewayConfig:
        protected = self._is_set("token") or self.allow_unauthenticated
        if not is_loopback(self.host) and not protected:
            raise ValueError(
                f"listening on {self.host} lets the whole network drive the robot: set 'token', "
                "listen on 127.0.0.1, or say 'allow_unauthenticated: true' if the network is "
                "trusted"
            )
        return self

    def _is_set(self, name: str) -> bool:
        return bool(getattr(self, name).get_secret_value() or getattr(self, f"{name}_file"))

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
