"""Clients that ask a gateway at once, as a process of ``onemap bench system``.

``python -m onemap_tools.bench.clients URL CLIENTS SECONDS`` prints "asking" once all are connected,
and at the end one JSON object. Each client has a connection of its own; it asks, waits for the
answer, and pauses.
"""

from __future__ import annotations

import json
import random
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from onemap import Client, OneMapError
from onemap_tools.gateway import gateway_client

KNOWN = (
    "sofa", "bed", "television", "refrigerator", "toilet", "bookcase", "dining table", "armchair",
    "sink", "wardrobe", "door", "window", "lamp", "desk", "oven", "bathtub",
)  # fmt: skip
ADJECTIVES = ("purple", "broken", "tiny", "antique", "striped", "wooden", "folded", "shiny")
NEW = 0.2  # share of texts that nobody asked for before
PAUSE_S = 1.0  # from a client's answer to its next question


@dataclass(frozen=True, slots=True)
class QueryTime:
    """One query. ``refusal``: why it was refused, empty if it was answered."""

    new: bool
    seconds: float
    refusal: str = ""


def ask_all(url: str, clients: int, seconds: float) -> dict[str, Any]:
    """Ask for so long; queries a second, and quantiles in ms of known and new texts."""
    with ExitStack() as connections:
        # Connected before the first question: making a client takes longer than a query.
        opened = [connections.enter_context(gateway_client(url)) for _ in range(clients)]
        for text in KNOWN:
            opened[0].query(text)
        print("asking", flush=True)
        began_s, stop = time.monotonic(), threading.Event()
        with ThreadPoolExecutor(clients) as pool:
            asked = [pool.submit(_ask, client, n, stop) for n, client in enumerate(opened)]
            stop.wait(seconds)
            stop.set()
            times = [each for future in asked for each in future.result()]
        took_s = time.monotonic() - began_s
    return {
        "queries_per_s": round(len(times) / took_s, 1),
        "known": summarise([each for each in times if not each.new]),
        "new": summarise([each for each in times if each.new]),
    }


def summarise(times: list[QueryTime]) -> dict[str, Any]:
    """Number of queries, refusals with the first reason, and quantiles of the answered in ms."""
    answered = [each.seconds * 1e3 for each in times if not each.refusal]
    refusals = [each.refusal for each in times if each.refusal]
    quantiles = np.quantile(answered, (0.5, 0.99)).round().tolist() if answered else (None, None)
    counts = {"queries": len(times), "refused": len(refusals), "first_refusal": [*refusals, ""][0]}
    return counts | dict(zip(("p50_ms", "p99_ms"), quantiles, strict=True))


def _ask(client: Client, number: int, stop: threading.Event) -> list[QueryTime]:
    """One client: the next question once the last one is answered."""
    rng, times = random.Random(number), list[QueryTime]()
    stop.wait(rng.random() * PAUSE_S)  # not all at the same instant
    while not stop.is_set():
        new, text = rng.random() < NEW, rng.choice(KNOWN)
        if new:
            text = f"{rng.choice(ADJECTIVES)} {text} {number}{len(times)}{time.time_ns() % 10**9}"
        began_s, refusal = time.perf_counter(), ""
        try:
            client.query(text)
        except OneMapError as problem:
            refusal = problem.detail
        times.append(QueryTime(new, time.perf_counter() - began_s, refusal))
        stop.wait(PAUSE_S)
    return times


if __name__ == "__main__":
    print(json.dumps(ask_all(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]))), flush=True)
