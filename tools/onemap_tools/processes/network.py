"""TCP ports and endpoints of this machine."""

from __future__ import annotations

import re
import socket

from onemap_tools.errors import CliError

LOOPBACK = "127.0.0.1"
DEFAULT_PORT = 8080  # of the gateway
DEFAULT_URL = f"http://{LOOPBACK}:{DEFAULT_PORT}"
TRIED_PORTS = 100
CONNECT_S = 0.5


def is_free(port: int) -> bool:
    """Whether a server could listen on this TCP port of the loopback address."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((LOOPBACK, port))
        except OSError:
            return False
    return True


def any_free_port() -> int:
    """A TCP port that is free now."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        port: int = probe.getsockname()[1]
    return port


def next_free_port(wanted: int) -> int:
    """The first free TCP port from ``wanted`` on."""
    for port in range(wanted, min(wanted + TRIED_PORTS, 65536)):
        if is_free(port):
            return port
    raise CliError(f"No free TCP port from {wanted} on: give another one with --port.")


def is_local(endpoint: str) -> bool:
    """Whether a Zenoh endpoint such as tcp/127.0.0.1:7447 is on this machine."""
    return re.fullmatch(r"[a-z]+/(127\.\d+\.\d+\.\d+|localhost|\[::1\]):\d+", endpoint) is not None


def accepts_connections(endpoint: str) -> bool:
    """Whether a server accepts connections at a TCP endpoint of this machine."""
    host, _, port = endpoint.partition("/")[2].rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), CONNECT_S):
            return True
    except OSError:
        return False
