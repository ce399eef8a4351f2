"""The gateway's TCP socket."""
# Talks: the socket.

from __future__ import annotations

import errno
import socket

from onemap_shared.runner import StartError

BACKLOG = 128


def listen(host: str, port: int) -> socket.socket:
    """A listening socket; raises ``StartError`` with the reason and what to change."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family, backlog=BACKLOG)
    except OSError as problem:
        reason = {
            errno.EADDRINUSE: "another program uses it; stop that, or choose another port with "
            f"'gateway.port' (ONEMAP__GATEWAY__PORT={port + 1})",
            errno.EACCES: "ports below 1024 need privileges; choose another with 'gateway.port'",
            errno.EADDRNOTAVAIL: "this machine has no such address; correct 'gateway.host'",
        }.get(problem.errno or 0, f"{problem.strerror or problem}; correct 'gateway.host'")
        raise StartError(
            f"cannot listen on {host} port {port}: {reason}",
            temporary=problem.errno == errno.EADDRINUSE,
        ) from problem
    # Its connections inherit this; asyncio sets it only on sockets that name their protocol.
    # Without it a response on a kept connection waits 40 ms for the client's acknowledgement.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener
