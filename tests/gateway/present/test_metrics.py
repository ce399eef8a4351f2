"""The Prometheus text."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from prometheus_client.parser import text_string_to_metric_families

from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.present.metrics import RequestCounter, exposition, metric_name
from onemap_shared.messages import VelocityCommand
from onemap_shared.transport import Counters
from tests.gateway import fakes


def samples(state: LiveState, requests: RequestCounter | None = None) -> dict[str, float]:
    """Every sample by its name and labels, read as Prometheus would."""
    counters = {"rgbd": Counters(received=5, refused=1)}
    text = exposition(state, counters, requests or RequestCounter(), 10.0).decode()
    return {
        " ".join([name, *(f"{key}={value}" for key, value in sorted(labels.items()))]): number
        for family in text_string_to_metric_families(text)
        for name, labels, number, *_ in family.samples
    }


def test_what_runs_and_what_not() -> None:
    state = LiveState().with_alive(frozenset({"mapper"}), 0.0)
    state = state.with_message(fakes.heartbeat("mapper"), 9.0)
    found = samples(state)
    assert found["onemap_up service=mapper"] == 1
    assert found["onemap_up service=planner"] == 0
    assert found["onemap_heartbeat_age_seconds service=mapper"] == 1


def test_a_services_own_metrics_carry_its_name() -> None:
    state = LiveState().with_message(fakes.heartbeat("mapper"), 9.0)
    assert samples(state)["onemap_mapper_frames_per_second"] == 9.5


def test_messages_are_counted_by_what_became_of_them() -> None:
    found = samples(LiveState())
    assert found["onemap_bus_messages_total outcome=received stream=rgbd"] == 5
    assert found["onemap_bus_messages_total outcome=refused stream=rgbd"] == 1


def test_requests_are_counted() -> None:
    requests = RequestCounter()
    requests.count("GET", "/healthz", 200)
    requests.count("GET", "/healthz", 200)
    found = samples(LiveState(), requests)
    assert found["onemap_http_requests_total method=GET route=/healthz status=200"] == 2


def test_the_map_in_numbers() -> None:
    state = LiveState().with_message(fakes.revision(3), 1.0)
    state = state.with_message(fakes.revision(4), 8.0)
    found = samples(state)
    assert found["onemap_map_idle_seconds"] == 2
    assert found["onemap_map_frames_fused"] == 4


def test_latencies_of_frames_are_a_histogram() -> None:
    state = LiveState().with_message(fakes.revision(3), 0.5)
    for message, now_s in ((fakes.rgbd(), 1.0), (fakes.revision(4), 1.25)):
        state = state.with_message(message, now_s)
    state = state.with_message(fakes.detections("sofa"), 1.5)
    for command in (VelocityCommand(1, 2, 0.1, 0.0), fakes.command(), fakes.command()):
        state = state.with_message(command, 1.75)
    found = samples(state)
    assert found["onemap_frame_latency_seconds_sum stage=command"] == 0.75
    assert found["onemap_frame_latency_seconds_count stage=command"] == 1
    assert found["onemap_frame_latency_seconds_bucket le=0.2 stage=map"] == 0
    assert found["onemap_frame_latency_seconds_bucket le=0.3 stage=map"] == 1
    assert found["onemap_frame_latency_seconds_count stage=detections"] == 1
    assert found["onemap_frame_latency_seconds_sum stage=detections"] == 0.5


@given(st.text(min_size=1))
def test_any_name_becomes_one_that_prometheus_takes(name: str) -> None:
    assert metric_name("mapper", name).isascii()
    assert metric_name("mapper", name).replace("_", "a").isalnum()
