"""Each role may do its work on the bus and nothing else: real routers, sessions, certificates."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from onemap_shared import keys
from onemap_shared.bus import run_router
from onemap_shared.keys import ROLES, Procedure, Topic
from onemap_shared.transport import Bus, CallError
from tests.deploy.deployment import DEPLOY
from tests.deploy.test_router import join, routing
from tests.shared.samples import SAMPLES
from tests.shared.test_bus import PATIENCE_S, eventually, free_port

certificates = pytest.importorskip(
    "onemap_tools.certificates", reason="cryptography is not installed (pip install '.[certs]')"
)

pytestmark = pytest.mark.slow

STRANGER = "stranger"  # has a certificate of the authority, but no role
ABSENCE_S = 0.3  # what is let through arrives within a few milliseconds
TOPICS = [
    value
    for value in vars(keys).values()
    if isinstance(value, Topic) and value is not keys.ALL_HEARTBEATS
]
PROCEDURES = [value for value in vars(keys).values() if isinstance(value, Procedure)]


def sample(kind: type) -> Any:
    return next(message for message in SAMPLES if isinstance(message, kind))


def tagged(message: Any, number: int) -> Any:
    """The message with a mark of who sent it."""
    return replace(message, **{stamp_of(message): 1_000 + number})


def stamp_of(message: Any) -> str:
    return "updated_ns" if hasattr(message, "updated_ns") else "stamp_ns"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An authority's certificates for the router, every role and a stranger."""
    folder, now = tmp_path_factory.mktemp("tls"), datetime.now(timezone.utc)
    authority = certificates.make_authority(now)
    (folder / "ca.pem").write_bytes(authority.certificate)
    for name in ("router", *ROLES, STRANGER):
        hosts = ("localhost",) if name == "router" else ()
        identity = certificates.sign(authority, name, hosts, now=now, days=2)
        (folder / f"{name}.pem").write_bytes(identity.certificate)
        (folder / f"{name}.key").write_bytes(identity.key)
    return folder


@pytest.fixture(scope="module")
def file(folder: Path) -> Path:
    """The deployed router's configuration, with the certificates of the test."""
    file = folder / "router-tls.json5"
    text = (DEPLOY / "router-tls.json5").read_text(encoding="utf-8")
    file.write_text(text.replace("/etc/onemap/tls", str(folder)), encoding="utf-8")
    return file


def tls_endpoint(folder: Path, role: str, port: int) -> str:
    """Where a client with the certificate of this role connects."""
    options = (
        f"enable_mtls=true;root_ca_certificate_file={folder}/ca.pem;"
        f"connect_certificate_file={folder}/{role}.pem;"
        f"connect_private_key_file={folder}/{role}.key"
    )
    return f"tls/localhost:{port}#{options}"


@pytest.fixture(scope="module")
def connect(folder: Path, file: Path) -> Iterator[Callable[[str, str], Bus]]:
    """Joins the deployed router with the certificate of a role, under the name of a process."""
    port = free_port()
    local = f"tcp/127.0.0.1:{free_port()}"
    with routing(file, f"tls/127.0.0.1:{port}", local), ExitStack() as stack:

        def connect(role: str, name: str) -> Bus:
            endpoint = tls_endpoint(folder, role, port) if role else local
            bus = join(endpoint, name)
            assert bus is not None, role
            stack.callback(bus.close)
            return bus

        yield connect


@pytest.fixture(scope="module")
def buses(connect: Callable[[str, str], Bus]) -> Mapping[str, Bus]:
    """One session of each role and of the stranger, over TLS."""
    joined = {role: connect(role, access.names[0]) for role, access in ROLES.items()}
    return {**joined, STRANGER: connect(STRANGER, STRANGER)}


@pytest.fixture(scope="module")
def callers(connect: Callable[[str, str], Bus]) -> Mapping[str, Bus]:
    """A second session of each: one session's call to itself does not pass the router."""
    joined = {role: connect(role, access.names[-1]) for role, access in ROLES.items()}
    return {**joined, STRANGER: connect(STRANGER, STRANGER)}


def may(role: str, kind: str, what: Any) -> bool:
    return role in ROLES and what in getattr(ROLES[role], kind)


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_a_topic_goes_from_its_publisher_to_its_subscribers(
    buses: Mapping[str, Bus], topic: Topic[Any]
) -> None:
    senders = {role: number for number, role in enumerate(buses)}
    subscriptions = {role: bus.subscribe(topic, 64) for role, bus in buses.items()}
    publishers = {role: bus.publish(topic) for role, bus in buses.items()}
    wanted = {
        role: {number for sender, number in senders.items() if may(sender, "publishes", topic)}
        for role in buses
        if may(role, "subscribes", topic)
    }
    got: dict[str, set[int]] = {role: set() for role in buses}

    def arrived() -> bool | None:
        """Send from everybody; whether everybody has what is meant for him."""
        for role, publisher in publishers.items():
            publisher.put(tagged(sample(topic.message), senders[role]))
        for role, subscription in subscriptions.items():
            while (message := subscription.take(ABSENCE_S if role == STRANGER else 0)) is not None:
                sender = getattr(message, stamp_of(message)) - 1_000
                if sender != senders[role]:  # a session hears itself without the router
                    got[role].add(sender)
        return all(got[role] >= numbers for role, numbers in wanted.items()) or None

    assert eventually(arrived)
    assert arrived()
    assert {role: numbers for role, numbers in got.items() if numbers} == wanted


@pytest.mark.parametrize("procedure", PROCEDURES, ids=lambda procedure: procedure.key)
def test_a_procedure_is_served_and_called_by_its_roles_only(
    buses: Mapping[str, Bus], callers: Mapping[str, Bus], procedure: Procedure[Any, Any]
) -> None:
    reply = sample(procedure.reply)
    for role, bus in buses.items():
        if not may(role, "serves", procedure):  # a forged server
            bus.serve(procedure, lambda _request: reply)
    assert answered(callers, procedure) == set()
    for role, bus in buses.items():
        if may(role, "serves", procedure):
            bus.serve(procedure, lambda _request: reply)
    wanted = {role for role in callers if may(role, "calls", procedure)}
    assert eventually(lambda: answered(callers, procedure) == wanted or None)


def answered(callers: Mapping[str, Bus], procedure: Procedure[Any, Any]) -> set[str]:
    """The roles that get a reply."""

    def is_answered(bus: Bus) -> bool:
        try:
            return bus.call(procedure, sample(procedure.request), ABSENCE_S) is not None
        except CallError:
            return False

    with ThreadPoolExecutor(len(callers)) as pool:
        replies = pool.map(is_answered, callers.values())
        return {role for role, success in zip(callers, replies, strict=True) if success}


@pytest.mark.parametrize("topic", [t for t in TOPICS if t.latched], ids=lambda topic: topic.key)
def test_late_joiners_get_the_last_message(
    buses: Mapping[str, Bus], callers: Mapping[str, Bus], topic: Topic[Any]
) -> None:
    for role, bus in buses.items():
        if may(role, "publishes", topic):
            publisher = bus.publish(topic)
            publisher.put(sample(topic.message))
    for role, bus in callers.items():
        if may(role, "subscribes", topic):
            assert eventually(partial(joined_late, bus, topic)) is not None


def joined_late(bus: Bus, topic: Topic[Any]) -> Any:
    return bus.subscribe(topic).take(ABSENCE_S)


def test_nobody_speaks_for_another(
    buses: Mapping[str, Bus], connect: Callable[[str, str], Bus]
) -> None:
    """Tokens and heartbeats: a false planner would make the gateway believe in it."""
    gateway = buses["gateway"]
    assert eventually(lambda: ("planner" in gateway.alive()) or None)
    connect("perception", "simulator.2")
    connect(STRANGER, "planner.2")
    connect("tools", "status")  # what connects later is seen later
    assert eventually(lambda: ("status" in gateway.alive()) or None)
    assert gateway.alive() <= {name for access in ROLES.values() for name in access.names}
    heard = gateway.subscribe(keys.ALL_HEARTBEATS, 64)
    beat = sample(keys.ALL_HEARTBEATS.message)
    forged, own = (
        buses["perception"].publish(keys.heartbeat(n)) for n in ("planner", "perception")
    )

    def arrived() -> Any:
        forged.put(replace(beat, service="planner"))
        own.put(replace(beat, service="perception"))
        return heard.take(ABSENCE_S)

    for _ in range(2):
        assert eventually(arrived).service == "perception"


def test_this_machine_needs_no_certificate(
    buses: Mapping[str, Bus], connect: Callable[[str, str], Bus]
) -> None:
    """The services of the robot itself connect over loopback."""
    received = buses["robot"].subscribe(keys.ROBOT_CMD_VEL)
    publisher = connect("", "planner").publish(keys.ROBOT_CMD_VEL)

    def arrived() -> Any:
        publisher.put(sample(keys.ROBOT_CMD_VEL.message))
        return received.take(ABSENCE_S)

    assert eventually(arrived) is not None


def test_the_router_may_ask_itself(folder: Path) -> None:
    """Its watchdog does; a router that may not would restart for ever."""
    file = folder / "alone.json5"
    text = (DEPLOY / "router-tls.json5").read_text(encoding="utf-8")
    file.write_text(text.replace("/etc/onemap/tls", str(folder)), encoding="utf-8")
    stop, routed = threading.Event(), threading.Event()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = threading.Thread(target=run_router, args=((endpoint,), stop, file, routed.set))
    router.start()
    reached = routed.wait(PATIENCE_S)
    stop.set()
    router.join()
    assert reached


NAMESPACE = "fleet/r1"


def test_the_rules_hold_below_a_namespace(folder: Path, file: Path) -> None:
    """With ``bus.namespace`` a role does its work below it, and nothing elsewhere."""
    port = free_port()
    with routing(file, f"tls/127.0.0.1:{port}", namespace=NAMESPACE), ExitStack() as stack:

        def joined(role: str, namespace: str) -> Bus:
            bus = join(tls_endpoint(folder, role, port), role, namespace=namespace)
            assert bus is not None, role
            stack.callback(bus.close)
            return bus

        gateway, perception = joined("gateway", NAMESPACE), joined("perception", NAMESPACE)
        robot, outside = joined("robot", NAMESPACE), joined("perception", "fleet/r2")
        detections = gateway.subscribe(keys.DETECTIONS, 64)
        commands = robot.subscribe(keys.ROBOT_CMD_VEL, 64)
        elsewhere = joined("gateway", "fleet/r2").subscribe(keys.DETECTIONS, 64)
        work, forged = perception.publish(keys.DETECTIONS), perception.publish(keys.ROBOT_CMD_VEL)
        foreign = outside.publish(keys.DETECTIONS)

        def arrived() -> bool | None:
            forged.put(sample(keys.ROBOT_CMD_VEL.message))
            foreign.put(sample(keys.DETECTIONS.message))
            work.put(sample(keys.DETECTIONS.message))
            return detections.take(ABSENCE_S) is not None or None

        for _ in range(2):
            assert eventually(arrived)
        assert commands.take(ABSENCE_S) is None
        assert elsewhere.take(0.0) is None
