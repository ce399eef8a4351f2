"""The listening socket, or the reason why there is none."""

from __future__ import annotations

import socket

import pytest

from onemap_gateway.connections import listen
from onemap_shared.runner import StartError


def test_any_free_port_is_taken() -> None:
    with listen("127.0.0.1", 0) as listener:
        assert listener.getsockname()[1] > 0


def test_connections_do_not_wait_to_send() -> None:
    with listen("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        connection, _ = listener.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_port_in_use_is_refused_with_what_to_do() -> None:
    with listen("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(StartError, match=r"another program uses it.*gateway\.port") as error:
            listen("127.0.0.1", port)
        assert error.value.temporary


def test_an_address_of_another_machine_is_refused_with_what_to_do() -> None:
    with pytest.raises(StartError, match=r"gateway\.host") as error:
        listen("192.0.2.1", 0)
    assert not error.value.temporary
