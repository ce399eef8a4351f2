"""Ports and endpoints of this machine."""

from __future__ import annotations

import socket

import pytest

from onemap_gateway.config import GatewayConfig
from onemap_tools.errors import CliError
from onemap_tools.processes.network import (
    DEFAULT_PORT,
    LOOPBACK,
    TRIED_PORTS,
    accepts_connections,
    any_free_port,
    is_free,
    is_local,
    next_free_port,
)


@pytest.mark.parametrize(
    ("endpoint", "local"),
    [
        ("tcp/127.0.0.1:7447", True),
        ("tcp/localhost:7447", True),
        ("tcp/[::1]:7447", True),
        ("tcp/192.168.1.7:7447", False),
        ("tls/robot.local:7448", False),
        ("tcp/127.evil.org:7447", False),
    ],
)
def test_a_router_is_started_here_only_for_local_endpoints(endpoint: str, local: bool) -> None:
    assert is_local(endpoint) is local


def test_the_default_port_is_the_gateways() -> None:
    """The command line does not import the gateway's model: it would start slowly."""
    assert GatewayConfig().port == DEFAULT_PORT
    assert GatewayConfig().host == LOOPBACK


def test_a_taken_port_is_not_free_and_accepts_connections() -> None:
    with socket.create_server((LOOPBACK, 0)) as server:
        port = server.getsockname()[1]
        assert not is_free(port)
        assert next_free_port(port) > port
        assert accepts_connections(f"tcp/{LOOPBACK}:{port}")
    assert not accepts_connections(f"tcp/{LOOPBACK}:{any_free_port()}")


def test_without_a_free_port_the_option_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[int] = []
    monkeypatch.setattr("onemap_tools.processes.network.is_free", tried.append)
    with pytest.raises(CliError, match="--port"):
        next_free_port(9000)
    assert tried == list(range(9000, 9000 + TRIED_PORTS))
