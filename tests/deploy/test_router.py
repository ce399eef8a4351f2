"""The router's configuration files, read by Zenoh itself."""

from __future__ import annotations

import runpy
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import json5
import pytest
import yaml

from onemap_shared import bus as bus_module
from onemap_shared import keys
from onemap_shared.access_control import access_control
from onemap_shared.bus import open_bus
from onemap_shared.config import BusConfig
from onemap_shared.transport import Bus
from tests.deploy.deployment import DEPLOY
from tests.shared.samples import SAMPLES
from tests.shared.test_bus import eventually, free_port

FILES = ("router.json5", "router-tls.json5")
ROUTER = """
import signal, sys, threading
from pathlib import Path
from onemap_shared.bus import run_router
stop = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: stop.set())
run_router(tuple(sys.argv[3:]), stop, Path(sys.argv[1]), namespace=sys.argv[2])
"""
JOIN_S = 90.0  # a router process starts meanwhile
REFUSED_S = 2.0  # a client is refused within milliseconds


def document(name: str) -> dict[str, Any]:
    parsed: dict[str, Any] = json5.loads((DEPLOY / name).read_text(encoding="utf-8"))
    return parsed


def test_the_deployed_router_controls_access_as_the_roles_say() -> None:
    renew = runpy.run_path(str(DEPLOY / "router_access.py"))["with_access_control"]
    text = (DEPLOY / "router-tls.json5").read_text(encoding="utf-8")
    assert text == renew(text), "it is out of date: python deploy/router_access.py"
    assert renew(text.replace('"deny"', '"allow"')) == text
    assert document("router-tls.json5")["access_control"] == access_control()


@contextmanager
def routing(file: Path, *listen: str, namespace: str = "") -> Iterator[None]:
    """A router process that reads ``file`` as the deployed one does."""
    process = subprocess.Popen([sys.executable, "-c", ROUTER, str(file), namespace, *listen])
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def join(
    endpoint: str, service: str, patience_s: float = JOIN_S, namespace: str = ""
) -> Bus | None:
    """A bus session; None if it was refused for ``patience_s``."""
    stop = threading.Event()
    timer = threading.Timer(patience_s, stop.set)
    timer.start()
    joined = open_bus(BusConfig(connect=(endpoint,), namespace=namespace), service, "test", stop)
    timer.cancel()
    return joined


def receives(listener: Bus, speaker: Bus) -> bool:
    """Whether a frame of one session reaches the other."""
    (sample,) = (message for message in SAMPLES if isinstance(message, keys.ROBOT_RGBD.message))
    publisher, subscription = (
        speaker.publish(keys.ROBOT_RGBD),
        listener.subscribe(keys.ROBOT_RGBD),
    )

    def attempt() -> bool | None:
        publisher.put(sample)
        return subscription.take(0.1) is not None or None

    return eventually(attempt)


@pytest.mark.parametrize("name", FILES)
def test_nothing_is_discovered_and_nothing_unguarded_is_open(name: str) -> None:
    router = document(name)
    assert router["mode"] == "router"
    assert router["scouting"]["multicast"]["enabled"] is False
    assert router["scouting"]["gossip"]["enabled"] is False
    for endpoint in router["listen"]["endpoints"]:
        assert endpoint.startswith(("tcp/127.0.0.1:", "tls/"))
    if "tls" in router["transport"]["link"]:
        assert router["transport"]["link"]["tls"]["enable_mtls"] is True


@pytest.mark.parametrize("name", FILES)
def test_its_limits_are_those_of_the_services(name: str) -> None:
    transport = document(name)["transport"]
    link = transport["link"]
    assert link["tx"]["lease"] == bus_module.LEASE_MS
    assert link["tx"]["queue"]["congestion_control"]["drop"] == {
        "max_wait_before_drop_fragments": bus_module.DROP_PATIENCE_US
    }
    assert link["rx"]["max_message_size"] == bus_module.MAX_MESSAGE_BYTES
    assert transport["shared_memory"]["enabled"] is False


def test_services_find_it_where_they_look_by_default() -> None:
    (default,) = BusConfig().connect
    assert document("router.json5")["listen"]["endpoints"] == [default]
    assert default in document("router-tls.json5")["listen"]["endpoints"]


@pytest.mark.slow
def test_zenoh_reads_it_and_routes() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with routing(DEPLOY / "router.json5", endpoint):
        robot, planner = join(endpoint, "simulator"), join(endpoint, "planner")
        assert robot is not None
        assert planner is not None
        assert receives(planner, robot)
        robot.close()
        planner.close()


def certificates(folder: Path) -> None:
    """An authority, and certificates for the router and each role, as the README makes them."""
    pytest.importorskip("cryptography", reason="cryptography is not installed")
    from onemap_tools.certificates import write_certificates

    write_certificates(folder, ["localhost"], now=datetime.now(timezone.utc), days=2)


@pytest.mark.slow
def test_over_tls_only_the_holder_of_a_certificate_gets_in(tmp_path: Path) -> None:
    certificates(tmp_path)
    port = free_port()
    file = tmp_path / "router-tls.json5"
    text = (DEPLOY / "router-tls.json5").read_text(encoding="utf-8")
    file.write_text(text.replace("/etc/onemap/tls", str(tmp_path)), encoding="utf-8")
    local = f"tcp/127.0.0.1:{free_port()}"
    split = yaml.safe_load((DEPLOY / "config" / "split-perception.yaml").read_text("utf-8"))
    (endpoint,) = split["bus"]["connect"]
    remote = endpoint.replace("/etc/onemap/tls", str(tmp_path)).replace(
        "robot.local:7448", f"localhost:{port}"
    )
    assert remote != endpoint
    with routing(file, local, f"tls/127.0.0.1:{port}"):
        robot, perception = join(local, "simulator"), join(remote, "perception")
        assert robot is not None
        assert perception is not None
        assert receives(perception, robot)
        uncertified = f"tls/localhost:{port}#root_ca_certificate_file={tmp_path / 'ca.pem'}"
        assert join(uncertified, "planner", REFUSED_S) is None
        robot.close()
        perception.close()
