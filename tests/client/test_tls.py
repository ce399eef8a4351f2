"""What is wrong with an address or a certificate is said, and a private authority can be named."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import closing, suppress
from datetime import datetime, timezone
from pathlib import Path

import httpx
import pytest

from onemap import Client, InvalidSetting, OneMapError, Retry, Unreachable
from onemap_tools.certificates import make_authority, sign

ANSWER = b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


def served(folder: Path, host: str) -> tuple[ssl.SSLContext, Path]:
    """What serves as ``host``, and the file of its authority."""
    now = datetime.now(timezone.utc)
    authority = make_authority(now)
    identity = sign(authority, "gateway", [host], now=now, days=1)
    for name, content in (
        ("ca", authority.certificate),
        ("key", identity.key),
        ("pem", identity.certificate),
    ):
        (folder / name).write_bytes(content)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(folder / "pem", folder / "key")
    return context, folder / "ca"


@pytest.fixture(params=["127.0.0.1"])
def gateway(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[tuple[str, Path]]:
    """Address of a server that answers 404 over TLS, and the file of its authority."""
    context, ca = served(tmp_path, request.param)
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            with suppress(OSError):
                while True:
                    client, _ = listener.accept()
                    with (
                        suppress(OSError),
                        closing(client),
                        context.wrap_socket(client, server_side=True) as secured,
                    ):
                        secured.recv(4096)
                        secured.sendall(ANSWER)

        threading.Thread(target=serve, daemon=True).start()
        yield f"https://127.0.0.1:{listener.getsockname()[1]}", ca
        with suppress(OSError):
            listener.shutdown(socket.SHUT_RDWR)


def test_a_private_authority_is_trusted_once_it_is_named(
    gateway: tuple[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    address, ca = gateway
    with Client(address) as client, pytest.raises(Unreachable, match="ONEMAP_CA") as error:
        client.status()
    assert error.value.misdirected
    monkeypatch.setenv("ONEMAP_CA", str(ca))
    with Client(address) as client, pytest.raises(OneMapError, match="answers 404"):
        client.status()
    monkeypatch.setenv("ONEMAP_CA", str(ca) + "x")
    with pytest.raises(InvalidSetting, match="cannot be read"):
        Client(address)


@pytest.mark.parametrize("gateway", ["robot.local"], indirect=True)
def test_a_certificate_of_another_name_is_told_from_one_not_trusted(
    gateway: tuple[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    address, ca = gateway
    monkeypatch.setenv("ONEMAP_CA", str(ca))
    with Client(address) as client, pytest.raises(Unreachable, match="for another name"):
        client.status()


def test_a_name_that_nobody_knows_is_said() -> None:
    def unknown(request: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("failed", request=request) from socket.gaierror(-2, "unknown")

    with (
        Client("http://robt", transport=httpx.MockTransport(unknown)) as client,
        pytest.raises(Unreachable, match="No address is known for robt"),
    ):
        client.status()


def test_a_stream_that_ends_without_an_event_is_given_up() -> None:
    asked: list[str] = []

    def empty(request: httpx.Request) -> httpx.Response:
        asked.append(request.url.path)
        return httpx.Response(200)

    transport = httpx.MockTransport(empty)
    with (
        Client(retry=Retry(0.0, 0.0, attempts=3), transport=transport) as client,
        pytest.raises(OneMapError, match="without an event"),
    ):
        list(client._connection.follow("/events", "status", dict))
    assert len(asked) == 4
