"""How long queries take when many clients ask a running gateway at once."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from onemap import Client, OneMapError
from onemap_tools.bench.options import ClientsBench
from onemap_tools.gateway import gateway_client

KNOWN = (
    "sofa", "bed", "television", "refrigerator", "toilet", "bookcase", "dining table", "armchair",
    "sink", "wardrobe", "door", "window", "lamp", "desk", "oven", "bathtub",
)  # fmt: skip
ADJECTIVES = ("purple", "broken", "tiny", "antique", "striped", "wooden", "folded", "shiny")
SEED = 0  # of the texts


@dataclass(frozen=True, slots=True)
class QueryTime:
    """One query. ``refusal``: why it was refused, empty if it was answered."""

    new: bool
    seconds: float
    refusal: str = ""


def run(options: ClientsBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """Ask for ``seconds``; quantiles in ms of known and new texts, refusals and frames fused."""
    with ExitStack() as connections:
        # Connected before the first question: making a client takes longer than a query.
        clients = [
            connections.enter_context(gateway_client(options.url, options.token))
            for _ in range(options.clients)
        ]
        for text in KNOWN:
            clients[0].query(text)
        tell(f"{options.clients} clients ask for {options.seconds:g} s")
        fused_before, began_s = _frames_fused(clients[0]), time.monotonic()
        stop = threading.Event()
        with ThreadPoolExecutor(options.clients) as pool:
            asked = [
                pool.submit(_ask, client, options, number, stop)
                for number, client in enumerate(clients)
            ]
            stop.wait(options.seconds)
            stop.set()
            times = [each for future in asked for each in future.result()]
        took_s = time.monotonic() - began_s
        fused = _frames_fused(clients[0]) - fused_before
    return {
        "benchmark": "clients",
        "clients": options.clients,
        "pause_s": options.pause,
        "fused_hz": round(fused / took_s, 2),
        "queries_per_s": round(len(times) / took_s, 1),
        "known": summarise([each for each in times if not each.new]),
        "new": summarise([each for each in times if each.new]),
    }


def summarise(times: list[QueryTime]) -> dict[str, Any]:
    """Number of queries, refusals with the first reason, and quantiles of the answered in ms."""
    answered = [each.seconds * 1e3 for each in times if not each.refusal]
    refusals = [each.refusal for each in times if each.refusal]
    quantiles = np.quantile(answered, (0.5, 0.99, 1.0)) if answered else (None,) * 3
    names = ("p50_ms", "p99_ms", "max_ms")
    return {
        "queries": len(times),
        "refused": len(refusals),
        "first_refusal": refusals[0] if refusals else "",
        **{
            name: None if value is None else round(float(value))
            for name, value in zip(names, quantiles, strict=True)
        },
    }


def _ask(
    client: Client, options: ClientsBench, number: int, stop: threading.Event
) -> list[QueryTime]:
    """One client: the next question once the last one is answered."""
    rng, times = random.Random(f"{SEED} {number}"), list[QueryTime]()
    stop.wait(rng.random() * options.pause)  # not all at the same instant
    while not stop.is_set():
        new = rng.random() < options.new
        text = _new_text(rng, number, len(times)) if new else rng.choice(KNOWN)
        began_s, refusal = time.perf_counter(), ""
        try:
            client.query(text)
        except OneMapError as problem:
            refusal = problem.detail
        times.append(QueryTime(new, time.perf_counter() - began_s, refusal))
        stop.wait(options.pause)
    return times


def _new_text(rng: random.Random, number: int, count: int) -> str:
    """A text that no run has asked for before, but by rare chance."""
    unique = f"{number}{count}{rng.randrange(10**6)}{time.time_ns() % 10**6}"
    return f"{rng.choice(ADJECTIVES)} {rng.choice(KNOWN)} {unique}"


def _frames_fused(client: Client) -> int:
    services = client.status().document["services"]
    mapper = next(service for service in services if service["name"] == "mapper")
    return int(mapper["metrics"]["frames_fused"])
