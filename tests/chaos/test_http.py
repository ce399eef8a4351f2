"""Requests of any content to a running gateway: answered as documented, and none harms it."""

from __future__ import annotations

import json
import random
import re
import socket
import subprocess
import sys
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import psutil
import pytest

from tests.chaos.report import Attack
from tests.chaos.test_wire import mutated
from tests.end_to_end.system import System, absent_object

pytestmark = pytest.mark.timeout(600)

SECONDS = 150
REQUEST_S = 30.0  # until a reply counts as a hang; minutes of the machine's load included
SEED = 11
RAW = 2_000
STREAMS = 200
MORE = 4  # descriptors of the gateway after the attack: connections that are just closing
# What the documents name; that a value may be refused for its content is not in a schema.
CHECKS = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "unsupported_method",
    "missing_required_header",
)
# 501: without an optional package; 503: a service is away or busy; 507: the disk is full.
SETTINGS = '[checks.not_a_server_error]\nexpected-statuses = ["2xx", "3xx", "4xx", 501, 503, 507]\n'
# Streams end with their search and have a test of their own.
EXCLUDED = r"events"
REQUESTS = (
    b"GET /v1/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n",
    b"GET /v1/map.png?text=sofa&scale=2 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n",
    b"POST /v1/queries HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    b'Connection: close\r\nContent-Length: 15\r\n\r\n{"text":"sofa"}',
    b"POST /v1/queries HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    b"Connection: close\r\nTransfer-Encoding: chunked\r\n\r\n"
    b'f\r\n{"text":"sofa"}\r\n0\r\n\r\n',
    b"GET /v1/live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
)


def test_requests_by_the_document(system: System, attack: Attack, tmp_path: Path) -> None:
    if find_spec("schemathesis") is None:
        pytest.skip("schemathesis is not installed: pip install -e '.[dev]' -c constraints.txt")
    (tmp_path / "settings.toml").write_text(SETTINGS, encoding="utf-8")
    document = without_tuples(system.http.get("/openapi.json", timeout=REQUEST_S).json())
    (tmp_path / "openapi.json").write_text(json.dumps(document), encoding="utf-8")
    command = (sys.executable, "-m", "schemathesis.cli", "--config-file", "settings.toml", "run")
    options = {
        "--url": str(system.http.base_url),
        "--checks": ",".join(CHECKS),
        "--phases": "examples,coverage,fuzzing",
        "--max-time": str(SECONDS),
        "--request-timeout": str(REQUEST_S),
        "--exclude-path-regex": EXCLUDED,
        "--seed": str(SEED),
        "--generation-database": "none",
        "--report-json-path": "report.json",
    }
    ended = subprocess.run(
        [*command, "openapi.json", "--continue-on-failure", "--no-color"]
        + [part for option in options.items() for part in option],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    print(ended.stdout)  # pytest shows it if the limit was not held
    cases = re.search(r"\d+ generated.*", ended.stdout)
    attack.holds(
        f"{SECONDS} s of requests made from the OpenAPI document",
        limit="each answered within 30 s, as documented",
        measured=cases[0] if cases else f"{ended.stdout[-500:]}{ended.stderr[-500:]}",
        held=ended.returncode == 0 and cases is not None,
    )


def without_tuples(schema: Any) -> Any:
    """The same document with ``items`` in place of equal ``prefixItems``, of /v1/map's bounds.

    Schemathesis 4.32 turns ``prefixItems`` into what no schema may hold, and then refuses it.
    """
    if isinstance(schema, list):
        return [without_tuples(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    rest = {key: without_tuples(value) for key, value in schema.items() if key != "prefixItems"}
    parts = schema.get("prefixItems", [])
    if parts:
        assert all(part == parts[0] for part in parts), "of unequal parts: they cannot be merged"
        assert schema["minItems"] == schema["maxItems"] == len(parts)
        rest["items"] = parts[0]
    return rest


def gateway_is_well(system: System, descriptors: int) -> str:
    """Why the gateway is not as before; empty if it is."""
    if system.processes["gateway"].poll() is not None:
        return "the gateway ended"
    if system.http.get("/v1/status", timeout=REQUEST_S).status_code != 200:
        return "the gateway does not answer"
    log = system.log("gateway").read_text(encoding="utf-8", errors="replace")
    if "Traceback" in log:
        return f"the gateway logged {log[log.index('Traceback') :][-300:]}"
    gateway = psutil.Process(system.processes["gateway"].pid)
    try:
        system.until(lambda: gateway.num_fds() <= descriptors + MORE, "connections are closed")
    except AssertionError:
        return f"{gateway.num_fds()} descriptors are open, {descriptors} before"
    return ""


def test_mutated_requests(system: System, attack: Attack) -> None:
    attack_with_requests(system, attack, RAW)


def attack_with_requests(system: System, attack: Attack, count: int) -> None:
    rng, outcomes = random.Random(SEED), Counter[str]()
    address = urlsplit(str(system.http.base_url))
    system.http.get("/v1/status", timeout=REQUEST_S)
    before = psutil.Process(system.processes["gateway"].pid).num_fds()
    for number in range(count):
        request = mutated(REQUESTS[number % len(REQUESTS)], rng)
        outcomes[answer_to(str(address.hostname), address.port or 80, request)] += 1
    problem = gateway_is_well(system, before)
    attack.holds(
        f"{count:,} mutated HTTP requests",
        limit="0 answers of 500, 0 open descriptors more, the gateway as before",
        measured=problem or json.dumps(dict(sorted(outcomes.items()))),
        held=not problem and not outcomes["500"],
    )


def answer_to(host: str, port: int, request: bytes) -> str:
    """The status of the answer; ``closed`` without one, ``waits`` if the rest is awaited."""
    with socket.create_connection((host, port), timeout=REQUEST_S) as connection:
        connection.sendall(request)
        connection.shutdown(socket.SHUT_WR)  # an unfinished request ends here
        try:
            start = connection.recv(64)
        except ConnectionError:
            return "closed"
        except TimeoutError:
            return "waits"
    parts = start.split(b" ", 2)
    return parts[1].decode("latin-1") if len(parts) > 1 else "closed"


def test_event_streams(system: System, attack: Attack) -> None:
    attack_with_streams(system, attack, STREAMS)


def attack_with_streams(system: System, attack: Attack, count: int) -> None:
    """Streams with headers of any content, left after any number of bytes."""
    rng, outcomes = random.Random(SEED), Counter[str]()
    started = system.http.post("/v1/searches", json={"objects": [absent_object(system)]})
    known = started.json().get("id", "current")
    before = psutil.Process(system.processes["gateway"].pid).num_fds()
    for _ in range(count):
        search = rng.choice([known, known, "current", rng.randbytes(6).hex(), "%00", "a" * 300])
        headers = {
            "Last-Event-ID": rng.choice(["", "0", "-1", "9" * 40, "x y"]),
            "Accept": rng.choice(["text/event-stream", "*/*", "application/json", ""]),
        }
        outcomes[stream(system.http, f"/v1/searches/{search}/events", headers, rng)] += 1
    problem = gateway_is_well(system, before)
    attack.holds(
        f"{count} event streams, left after some bytes",
        limit="events or a problem document, 0 open descriptors more, the gateway as before",
        measured=problem or json.dumps(dict(sorted(outcomes.items()))),
        held=not problem and set(outcomes) <= {"events", "404", "422"} and outcomes["events"] > 0,
    )


def stream(http: httpx.Client, path: str, headers: dict[str, str], rng: random.Random) -> str:
    """What an event stream begins with; it is left after up to 400 bytes."""
    wanted = rng.randrange(1, 400)
    with http.stream("GET", path, headers=headers, timeout=REQUEST_S) as answer:
        if answer.status_code != 200:
            return str(answer.status_code)
        text = b""
        for part in answer.iter_raw():
            text += part
            if len(text) >= wanted:
                break
    return "events" if b"event: status" in text else text[:40].decode("latin-1")
