"""compose.tls.yaml: each container shows a certificate, and the router controls its access."""

from __future__ import annotations

import json
import re
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import json5
import pytest
import yaml

from onemap_shared import keys
from onemap_shared.access_control import access_control
from onemap_shared.transport import Bus
from onemap_tools.errors import CliError
from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.session import check_service
from tests.deploy.deployment import DEPLOY, ROLES, compose, compose_document, mounts, with_file
from tests.deploy.test_router import join
from tests.shared.samples import SAMPLES
from tests.shared.test_bus import eventually, free_port

TLS = compose("compose.tls.yaml")
SERVICES = {name: with_file(service, TLS[name]) for name, service in compose().items()}
SECRETS = compose_document("compose.tls.yaml")["secrets"]
TLS_PORT, LOCAL_PORT = 7448, 7447
ABSENCE_S = 0.3  # what is let through arrives within a few milliseconds
EACH_ROLE = pytest.mark.parametrize("name", ROLES)


def role_of(name: str) -> str:
    """The certificate that a service needs."""
    return next(role for role, access in keys.ROLES.items() if name in access.names)


def secrets(name: str) -> dict[str, Path]:
    """Path in the container to the file in ``deploy``, of what a container is given to read."""
    entries = [{"source": s} if isinstance(s, str) else s for s in SERVICES[name]["secrets"]]
    return {
        str(Path("/run/secrets") / entry.get("target", entry["source"])): Path(
            SECRETS[entry["source"]]["file"]
        )
        for entry in entries
        if entry["source"] in SECRETS  # the token is in compose.yaml
    }


def endpoint(name: str) -> str:
    """Where the service of a container connects."""
    (connect,) = json.loads(SERVICES[name]["environment"]["ONEMAP__BUS__CONNECT"])
    return str(connect)


def router_file() -> Path:
    router = SERVICES["router"]
    command = router["command"]
    return DEPLOY / mounts(router)[command[command.index("--zenoh-config") + 1]]


def test_access_is_controlled_and_nothing_but_tls_leaves_the_container() -> None:
    assert set(TLS) == {"router", *ROLES}
    router = json5.loads(router_file().read_text(encoding="utf-8"))
    assert router["access_control"] == access_control()
    assert router["transport"]["link"]["tls"]["enable_mtls"] is True
    assert "--listen" not in SERVICES["router"]["command"]  # it would replace the file's endpoints
    assert router["listen"]["endpoints"] == [
        f"tcp/127.0.0.1:{LOCAL_PORT}",
        f"tls/0.0.0.0:{TLS_PORT}",
    ]
    assert SERVICES["router"]["ports"] == [f"127.0.0.1:{TLS_PORT}:{TLS_PORT}"]


@EACH_ROLE
def test_a_container_holds_the_key_of_its_role_alone(name: str) -> None:
    role, held = role_of(name), secrets(name)
    assert held == {
        "/run/secrets/ca.pem": Path("tls/ca.pem"),
        "/run/secrets/role.pem": Path(f"tls/{role}.pem"),
        "/run/secrets/role.key": Path(f"tls/{role}.key"),
    }
    assert set(re.findall(r"=(/[^;]+)", endpoint(name))) == set(held)
    assert endpoint(name).startswith(f"tls/router:{TLS_PORT}#enable_mtls=true;")


def test_the_router_finds_its_certificate_where_its_file_says() -> None:
    tls = json5.loads(router_file().read_text(encoding="utf-8"))["transport"]["link"]["tls"]
    named = {value for value in tls.values() if isinstance(value, str)}
    assert {path: file.name for path, file in secrets("router").items()} == {
        path: Path(path).name for path in named
    }


def test_the_readme_makes_each_key_readable_by_its_service_alone() -> None:
    readme = (DEPLOY / "security.md").read_text(encoding="utf-8")
    owners = dict(re.findall(r"\b(100\d\d):([a-z]+)\b", readme))
    ids = {str(s["build"]["args"]["SERVICE_UID"]): n for n, s in SERVICES.items()}
    assert owners == {uid: n if n == "router" else role_of(n) for uid, n in ids.items()}
    assert "onemap certs deploy/tls --host router" in readme


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``tls`` as the README makes it."""
    pytest.importorskip("cryptography", reason="cryptography is not installed")
    from onemap_tools.certificates import write_certificates

    folder = tmp_path_factory.mktemp("deploy")
    now = datetime.now(timezone.utc)
    write_certificates(folder / "tls", ["router", "localhost"], now=now, days=2)
    return folder


Address = Callable[[str], str]


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[Address]:
    """Runs the router as its container does; the endpoint of a container's service there."""
    text, port = router_file().read_text(encoding="utf-8"), free_port()
    for place, file in secrets("router").items():
        text = text.replace(place, str(folder / file))
    text = text.replace(f"tls/0.0.0.0:{TLS_PORT}", f"tls/127.0.0.1:{port}")
    text = text.replace(f"tcp/127.0.0.1:{LOCAL_PORT}", f"tcp/127.0.0.1:{free_port()}")
    (folder / "router.json5").write_text(text, encoding="utf-8")
    command = SERVICES["router"]["command"]
    router = subprocess.Popen(onemap_command(*command[:-1], str(folder / "router.json5")))

    def address(name: str) -> str:
        connect = endpoint(name).replace(f"router:{TLS_PORT}", f"localhost:{port}")
        for place, file in secrets(name).items():
            connect = connect.replace(place, str(folder / file))
        return connect

    yield address
    router.terminate()
    router.wait()


@pytest.fixture
def enter(address: Address) -> Iterator[Callable[[str], Bus]]:
    """A session with what the container of a service holds, under the service's name."""
    with ExitStack() as stack:

        def enter(name: str) -> Bus:
            bus = join(address(name), name)
            assert bus is not None, name
            stack.callback(bus.close)
            return bus

        yield enter


def sample(kind: type) -> Any:
    return next(message for message in SAMPLES if isinstance(message, kind))


@pytest.mark.slow
@EACH_ROLE
def test_the_health_check_of_a_container_hears_its_service(
    name: str, enter: Callable[[str], Bus], address: Address, tmp_path: Path
) -> None:
    """It connects with the certificate of the service, whose heartbeat it waits for."""
    beats = enter(name).publish(keys.heartbeat(name))
    beat = replace(sample(keys.ALL_HEARTBEATS.message), service=name, ready=True)
    config = tmp_path / "health.yaml"
    config.write_text(yaml.safe_dump({"bus": {"connect": [address(name)]}}), encoding="utf-8")

    def checked() -> bool | None:
        try:
            check_service(name, config)
        except CliError:
            return None
        return True

    stop = threading.Event()

    def publish() -> None:
        while not stop.wait(0.05):
            beats.put(beat)

    publishing = threading.Thread(target=publish)
    publishing.start()
    try:
        assert eventually(checked)
    finally:
        stop.set()
        publishing.join()


@pytest.mark.slow
def test_only_the_planner_container_moves_the_robot(enter: Callable[[str], Bus]) -> None:
    commands = enter("simulator").subscribe(keys.ROBOT_CMD_VEL, 64)
    command = sample(keys.ROBOT_CMD_VEL.message)
    senders = {name: enter(name) for name in ("perception", "mapper", "gateway", "planner")}
    publishers = [bus.publish(keys.ROBOT_CMD_VEL) for bus in senders.values()]

    def arrived() -> set[int] | None:
        for number, publisher in enumerate(publishers):
            publisher.put(replace(command, stamp_ns=1_000 + number))
        heard = set()
        while (message := commands.take(ABSENCE_S)) is not None:
            heard.add(message.stamp_ns - 1_000)
        return heard or None

    planner = list(senders).index("planner")
    assert eventually(arrived) == {planner}
    assert eventually(arrived) == {planner}


@pytest.mark.slow
def test_without_a_certificate_nobody_gets_in(
    enter: Callable[[str], Bus], address: Address, folder: Path
) -> None:
    place = address("planner").partition("#")[0]
    uncertified = f"{place}#root_ca_certificate_file={folder / 'tls' / 'ca.pem'}"
    enter("planner")  # the router is up
    assert join(uncertified, "planner", 2.0) is None
