"""The deployed routers: what their files say, and who may do what on them, with real ones."""

from __future__ import annotations

import runpy
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from datetime import datetime, timezone
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import json5
import pytest
import yaml

from onemap_shared import bus as bus_module
from onemap_shared import keys
from onemap_shared.access_control import access_control
from onemap_shared.bus import open_bus, run_router
from onemap_shared.config import BusConfig
from onemap_shared.keys import ROLES, Procedure, Topic
from onemap_shared.messages import Heartbeat
from onemap_shared.transport import Bus, CallError
from tests.deploy.deployment import DEPLOY, TLS, TLS_PORT, endpoint_of, secrets_of
from tests.shared.samples import sample
from tests.shared.test_bus import PATIENCE_S, eventually, free_port

FILES = ("router.json5", "router-tls.json5")
OFF = {"enabled": False}
ROUTER = """
import signal, sys, threading
from pathlib import Path
from onemap_shared.bus import run_router
stop = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: stop.set())
run_router(tuple(sys.argv[3:]), stop, Path(sys.argv[1]), namespace=sys.argv[2])
"""
JOIN_S = 90.0  # a router process starts meanwhile
REFUSED_S = 1.0  # a client is refused within milliseconds
ABSENCE_S = 0.3  # what is let through arrives within a few milliseconds
STRANGER = "stranger"  # has a certificate of the authority, but no role
NAMESPACE = "fleet/r1"
TOPICS = [
    value
    for value in vars(keys).values()
    if isinstance(value, Topic) and value is not keys.ALL_HEARTBEATS
]
PROCEDURES = [value for value in vars(keys).values() if isinstance(value, Procedure)]


def document(name: str) -> dict[str, Any]:
    parsed: dict[str, Any] = json5.loads((DEPLOY / name).read_text(encoding="utf-8"))
    return parsed


def test_the_deployed_router_controls_access_as_the_roles_say() -> None:
    renew = runpy.run_path(str(DEPLOY / "router_access.py"))["with_access_control"]
    text = (DEPLOY / "router-tls.json5").read_text(encoding="utf-8")
    assert text == renew(text), "it is out of date: python deploy/router_access.py"
    assert renew(text.replace('"deny"', '"allow"')) == text
    assert document("router-tls.json5")["access_control"] == access_control()


@pytest.mark.parametrize("name", FILES)
def test_nothing_is_discovered_nothing_unguarded_is_open_and_limits_are_the_services(
    name: str,
) -> None:
    router = document(name)
    assert router["mode"] == "router"
    assert router["scouting"] == {"multicast": OFF, "gossip": OFF}
    (default,) = BusConfig().connect  # where services look for it
    assert default in router["listen"]["endpoints"]
    for endpoint in router["listen"]["endpoints"]:
        assert endpoint.startswith(("tcp/127.0.0.1:", "tls/"))
    link = router["transport"]["link"]
    assert link.get("tls", {"enable_mtls": True})["enable_mtls"] is True
    assert link["tx"]["lease"] == bus_module.LEASE_MS
    assert link["tx"]["queue"]["congestion_control"]["drop"] == {
        "max_wait_before_drop_fragments": bus_module.DROP_PATIENCE_US
    }
    assert link["rx"]["max_message_size"] == bus_module.MAX_MESSAGE_BYTES
    assert router["transport"]["shared_memory"]["enabled"] is False


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


def tagged(message: Any, number: int) -> Any:
    """The message with a mark of who sent it."""
    return replace(message, **{stamp_of(message): 1_000 + number})


def stamp_of(message: Any) -> str:
    return "updated_ns" if hasattr(message, "updated_ns") else "stamp_ns"


class Deployment:
    """The TLS router with certificates of the test, and where its clients connect."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, free_port()
        self.local = f"tcp/127.0.0.1:{free_port()}"
        text = (DEPLOY / "router-tls.json5").read_text(encoding="utf-8")
        self.file = folder / "router-tls.json5"
        self.file.write_text(text.replace("/etc/onemap/tls", str(folder)), encoding="utf-8")

    def endpoint(self, role: str, port: int = 0) -> str:
        """Where a client with the certificate of this role connects."""
        options = (
            f"enable_mtls=true;root_ca_certificate_file={self.folder}/ca.pem;"
            f"connect_certificate_file={self.folder}/{role}.pem;"
            f"connect_private_key_file={self.folder}/{role}.key"
        )
        return f"tls/localhost:{port or self.port}#{options}"


@pytest.fixture(scope="module")
def deployment(tmp_path_factory: pytest.TempPathFactory) -> Deployment:
    """An authority's certificates for the router, every role and a stranger."""
    reason = "cryptography is not installed (pip install '.[certs]')"
    certificates = pytest.importorskip("onemap_tools.certificates", reason=reason)
    folder, now = tmp_path_factory.mktemp("tls"), datetime.now(timezone.utc)
    certificates.write_certificates(folder, ["localhost"], now=now, days=2)
    authority = certificates.Identity(
        (folder / "ca.pem").read_bytes(), (folder / "ca.key").read_bytes()
    )
    stranger = certificates.sign(authority, STRANGER, (), now=now, days=2)
    (folder / f"{STRANGER}.pem").write_bytes(stranger.certificate)
    (folder / f"{STRANGER}.key").write_bytes(stranger.key)
    return Deployment(folder)


@pytest.fixture(scope="module")
def connect(deployment: Deployment) -> Iterator[Callable[[str, str], Bus]]:
    """Joins the router with the certificate of a role, under the name of a process."""
    with (
        routing(deployment.file, f"tls/127.0.0.1:{deployment.port}", deployment.local),
        ExitStack() as stack,
    ):

        def connect(role: str, name: str) -> Bus:
            bus = join(deployment.endpoint(role) if role else deployment.local, name)
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


@pytest.mark.slow
def test_a_topic_goes_from_its_publishers_to_its_subscribers(buses: Mapping[str, Bus]) -> None:
    """Everybody sends and hears everything that he can; a session hears itself without a router."""
    senders = {role: number for number, role in enumerate(buses)}
    each = [(topic, role) for topic in TOPICS for role in buses]
    subscriptions = {(t.key, role): buses[role].subscribe(t, 64) for t, role in each}
    publishers = {(t.key, role): (t, buses[role].publish(t)) for t, role in each}
    wanted = {
        (topic.key, role): {senders[s] for s in buses if s != role and may(s, "publishes", topic)}
        for topic, role in each
        if may(role, "subscribes", topic)
    }
    wanted = {place: numbers for place, numbers in wanted.items() if numbers}
    got: dict[tuple[str, str], set[int]] = {}

    def arrived() -> bool | None:
        """Send from everybody; whether everybody has what is meant for him."""
        for (_, role), (topic, publisher) in publishers.items():
            publisher.put(tagged(sample(topic.message), senders[role]))
        subscriptions[TOPICS[0].key, STRANGER].take(ABSENCE_S)
        for (key, role), subscription in subscriptions.items():
            while (message := subscription.take(0.0)) is not None:
                sender = getattr(message, stamp_of(message)) - 1_000
                if sender != senders[role]:
                    got.setdefault((key, role), set()).add(sender)
        return all(got.get(place, set()) >= numbers for place, numbers in wanted.items()) or None

    assert eventually(arrived)
    assert arrived()
    assert got == wanted


@pytest.mark.slow
def test_a_procedure_is_served_and_called_by_its_roles_only(
    buses: Mapping[str, Bus], callers: Mapping[str, Bus]
) -> None:
    forged: list[str] = []

    def replied(procedure: Procedure[Any, Any], genuine: bool, _request: Any) -> Any:
        if not genuine:
            forged.append(procedure.key)
        return sample(procedure.reply)

    def serve(genuine: bool) -> None:
        for procedure, (role, bus) in product(PROCEDURES, buses.items()):
            if may(role, "serves", procedure) is genuine:
                bus.serve(procedure, partial(replied, procedure, genuine))

    def answered() -> set[tuple[str, str]]:
        """Who gets a reply to what."""
        every = [(procedure, role) for procedure in PROCEDURES for role in callers]

        def is_answered(procedure: Procedure[Any, Any], role: str) -> bool:
            with suppress(CallError):
                callers[role].call(procedure, sample(procedure.request), ABSENCE_S)
                return True
            return False

        with ThreadPoolExecutor(32) as pool:
            replies = list(pool.map(lambda each: is_answered(*each), every))
        return {(p.key, role) for (p, role), reply in zip(every, replies, strict=True) if reply}

    serve(genuine=False)
    assert answered() == set()
    serve(genuine=True)
    wanted = {(p.key, r) for p, r in product(PROCEDURES, callers) if may(r, "calls", p)}
    assert eventually(lambda: answered() == wanted or None)
    assert forged == []


@pytest.mark.slow
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
    beat = sample(Heartbeat)
    forged, own = (
        buses["perception"].publish(keys.heartbeat(n)) for n in ("planner", "perception")
    )

    def arrived() -> Any:
        forged.put(replace(beat, service="planner"))
        own.put(replace(beat, service="perception"))
        return heard.take(ABSENCE_S)

    for _ in range(2):
        assert eventually(arrived).service == "perception"


@pytest.mark.slow
def test_this_machine_needs_no_certificate_and_others_do(
    buses: Mapping[str, Bus], connect: Callable[[str, str], Bus], deployment: Deployment
) -> None:
    """The services of the robot itself connect over loopback."""
    received = buses["robot"].subscribe(keys.ROBOT_CMD_VEL)
    publisher = connect("", "planner").publish(keys.ROBOT_CMD_VEL)

    def arrived() -> Any:
        publisher.put(sample(keys.ROBOT_CMD_VEL.message))
        return received.take(ABSENCE_S)

    assert eventually(arrived) is not None
    place = deployment.endpoint("planner").partition("#")[0]
    uncertified = f"{place}#root_ca_certificate_file={deployment.folder / 'ca.pem'}"
    assert join(uncertified, "planner", REFUSED_S) is None


@pytest.mark.slow
def test_the_files_of_a_split_robot_and_of_each_container_get_in(
    connect: Callable[[str, str], Bus], deployment: Deployment
) -> None:
    """With what each holds, over the port and the names of its own deployment."""
    split = yaml.safe_load((DEPLOY / "config" / "split-perception.yaml").read_text("utf-8"))
    (endpoint,) = split["bus"]["connect"]
    endpoint = endpoint.replace("robot.local:7448", f"localhost:{deployment.port}")
    endpoints = {"perception": endpoint.replace("/etc/onemap/tls", str(deployment.folder))}
    for name in set(TLS) - {"router"}:
        endpoint = endpoint_of(name).replace(f"router:{TLS_PORT}", f"localhost:{deployment.port}")
        for place, file in secrets_of(name).items():
            endpoint = endpoint.replace(place, str(deployment.folder / file.name))
        endpoints[f"{name} in a container"] = endpoint
    for name, endpoint in endpoints.items():
        bus = join(endpoint, name.split()[0])
        assert bus is not None, name
        bus.close()


@pytest.mark.slow
def test_the_rules_hold_below_a_namespace(deployment: Deployment) -> None:
    """With ``bus.namespace`` a role does its work below it, and nothing elsewhere."""
    port = free_port()
    listen = f"tls/127.0.0.1:{port}"
    with routing(deployment.file, listen, namespace=NAMESPACE), ExitStack() as stack:

        def joined(role: str, namespace: str) -> Bus:
            bus = join(deployment.endpoint(role, port), role, namespace=namespace)
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


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_the_router_may_ask_itself(name: str, deployment: Deployment) -> None:
    """Its watchdog does; a router that may not would restart for ever."""
    file = deployment.file if name == "router-tls.json5" else DEPLOY / name
    stop, routed = threading.Event(), threading.Event()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = threading.Thread(target=run_router, args=((endpoint,), stop, file, routed.set))
    router.start()
    reached = routed.wait(PATIENCE_S)
    stop.set()
    router.join()
    assert reached


def test_nobody_is_told_of_the_router_or_of_other_clients(deployment: Deployment) -> None:
    """Who asks the admin space hears its own session, of its own link, and nobody else."""
    local = f"tcp/127.0.0.1:{free_port()}"
    with (
        routing(deployment.file, f"tls/localhost:{deployment.port}", local),
        ThreadPoolExecutor() as pool,
    ):

        def told(role: str) -> set[str]:
            bus = join(deployment.endpoint(role), role)
            assert isinstance(bus, bus_module.ZenohBus)
            own = f"@/{bus._session.info.zid()}/session/"
            replies = bus._session.get("@/**", timeout=PATIENCE_S)
            told = {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}
            bus.close()
            return {key for key in told if not key.startswith(own)}

        assert set().union(*pool.map(told, ROLES)) == set()
