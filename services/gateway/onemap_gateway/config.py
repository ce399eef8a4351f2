"""Configuration of the gateway."""

from __future__ import annotations

from collections.abc import Mapping
from ipaddress import ip_address
from typing import ClassVar

from pydantic import Field, SecretStr, model_validator

from onemap_shared.params import Params


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
        description="If set, every POST and DELETE needs 'Authorization: Bearer <token>'.",
    )
    allow_unauthenticated: bool = Field(
        default=False,
        description="Listen beyond loopback without a token: for a container whose port is "
        "published on loopback, or on a trusted network.",
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

    @model_validator(mode="after")
    def _token_beyond_loopback(self) -> GatewayConfig:
        protected = bool(self.token.get_secret_value()) or self.allow_unauthenticated
        if not is_loopback(self.host) and not protected:
            raise ValueError(
                f"listening on {self.host} lets the whole network drive the robot: set 'token', "
                "listen on 127.0.0.1, or say 'allow_unauthenticated: true' if the network is "
                "trusted"
            )
        return self


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server that listens on ``host``."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
