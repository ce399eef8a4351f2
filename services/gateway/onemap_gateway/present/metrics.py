"""Prometheus metrics of the gateway and of every service."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import accumulate

from prometheus_client import CollectorRegistry, Counter, generate_latest
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector

from onemap_gateway.bus.live_state import BOUNDS_S, LiveState, newest
from onemap_gateway.present.service_status import DOWN, assess_services
from onemap_shared.transport import Counters

MEDIA_TYPE = "text/plain; version=0.0.4; charset=utf-8"


class RequestCounter:
    """Counts answered requests by method, route and status."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self._requests = Counter(
            "onemap_http_requests",
            "Requests answered.",
            ["method", "route", "status"],
            registry=self.registry,
        )

    def count(self, method: str, route: str, status: int) -> None:
        """Count a request; ``route`` is the path template, not the path."""
        self._requests.labels(method, route, str(status)).inc()


def exposition(
    state: LiveState, counters: Mapping[str, Counters], requests: RequestCounter, now_s: float
) -> bytes:
    """All metrics in the text exposition format."""
    registry = CollectorRegistry()
    registry.register(_Snapshot(list(_families(state, counters, now_s))))
    return generate_latest(registry) + generate_latest(requests.registry)


class _Snapshot(Collector):
    def __init__(self, families: list[Metric]) -> None:
        self._families = families

    def collect(self) -> Iterator[Metric]:
        yield from self._families


def _families(state: LiveState, counters: Mapping[str, Counters], now_s: float) -> Iterator[Metric]:
    up = GaugeMetricFamily("onemap_up", "1 if the service is well.", labels=["service"])
    age = GaugeMetricFamily(
        "onemap_heartbeat_age_seconds", "Since the last heartbeat.", labels=["service"]
    )
    for report in assess_services(state, now_s):
        up.add_metric([report.name], float(report.condition != DOWN))
        if report.heartbeat_age_s is not None:
            age.add_metric([report.name], report.heartbeat_age_s)
    messages = CounterMetricFamily(
        "onemap_bus_messages", "Messages that reached the gateway.", labels=["stream", "outcome"]
    )
    for stream, counter in counters.items():
        for outcome in ("received", "missed", "skipped", "refused"):
            messages.add_metric([stream, outcome], getattr(counter, outcome))
    latencies = HistogramMetricFamily(
        "onemap_frame_latency_seconds",
        "From a frame at the gateway to the result with its stamp.",
        labels=["stage"],
    )
    bounds = [*map(str, BOUNDS_S), "+Inf"]
    for stage, histogram in sorted(state.latencies.stages.items()):
        buckets = list(zip(bounds, accumulate(histogram.counts), strict=True))
        latencies.add_metric([stage], buckets, histogram.total_s)
    yield from (up, age, messages, latencies)
    for name, text, value in _numbers(state, now_s):
        yield GaugeMetricFamily(name, text, value=value)


def _numbers(state: LiveState, now_s: float) -> Iterator[tuple[str, str, float]]:
    """Name, description and value of every metric without labels."""
    if state.last_fused_s is not None:
        idle_s = max(now_s - state.last_fused_s, 0.0)
        text = "Since a frame last went all the way to the map."
        yield "onemap_map_idle_seconds", text, idle_s
    if (revision := newest(state.revision)) is not None:
        yield "onemap_map_frames_fused", "Frames in the map.", revision.frames_fused
        yield "onemap_map_cells_observed", "Cells with features.", revision.cells_observed
    for service, record in sorted(state.heartbeats.items()):
        for name, value in sorted(record.heartbeat.metrics.items()):
            yield metric_name(service, name), f"{name}, as the {service} reports it.", value


def metric_name(service: str, name: str) -> str:
    """The Prometheus name of a metric in a heartbeat."""
    return re.sub(r"[^a-zA-Z0-9_]", "_", f"onemap_{service}_{name}")
