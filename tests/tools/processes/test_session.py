"""Sessions of commands on the bus."""

from __future__ import annotations

import logging

import pytest

from onemap_shared.config import BusConfig
from onemap_tools.errors import CliError
from onemap_tools.processes.network import any_free_port
from onemap_tools.processes.session import connect, temporary_session
from tests.shared.test_bus import PATIENCE_S, Router, eventually, router

__all__ = ["router"]  # the fixture


def test_without_a_router_the_wait_ends() -> None:
    endpoint = f"tcp/127.0.0.1:{any_free_port()}"
    config = BusConfig(connect=(endpoint,))
    assert connect(config, "status", "a", patience_s=0.1) is None
    with (
        pytest.raises(CliError, match=f"No router at {endpoint}"),
        temporary_session(config, "status", 0.1),
    ):
        pass


def test_a_session_leaves_the_bus_at_its_end(router: Router) -> None:
    config = BusConfig(connect=(router.endpoint,))
    observer = connect(config, "observer", "o", PATIENCE_S)
    assert observer is not None
    with temporary_session(config, "doctor", PATIENCE_S):
        assert eventually(lambda: "doctor" in observer.alive() or None)
    assert eventually(lambda: "doctor" not in observer.alive() or None)
    observer.close()


def test_only_the_wait_is_silent(caplog: pytest.LogCaptureFixture) -> None:
    config = BusConfig(connect=(f"tcp/127.0.0.1:{any_free_port()}",))
    assert connect(config, "status", "a", patience_s=0.1) is None
    assert caplog.text == ""
    logging.getLogger("onemap.bus").warning("the link is slow")
    assert "the link is slow" in caplog.text
