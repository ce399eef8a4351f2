"""Traces of frames, off and on, and what a collector gets."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared import tracing
from onemap_shared.config import LogConfig
from onemap_shared.tracing import DRIVE, FrameTracer, frame_ids

pytest.importorskip("opentelemetry.sdk", reason="needs opentelemetry: pip install -e '.[otel]'")

from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

FRAME_NS = 1_700_000_000_000_000_000


@pytest.fixture
def exporter() -> Iterator[InMemorySpanExporter]:
    """Traces of all frames, kept here."""
    made = InMemorySpanExporter()
    tracing.use(FrameTracer("mapper", 1.0, SimpleSpanProcessor(made)))
    yield made
    tracing.use(None)


@given(st.integers(min_value=1, max_value=2**63 - 1))
def test_ids_are_valid_and_those_of_the_frame(frame_ns: int) -> None:
    trace_id, span_id = frame_ids(frame_ns)
    assert 0 < trace_id < 2**128
    assert 0 < span_id < 2**64
    assert frame_ids(frame_ns) == (trace_id, span_id) != frame_ids(frame_ns - 1)


def test_the_stages_of_a_frame_hang_below_its_drive(exporter: InMemorySpanExporter) -> None:
    tracing.stage("encode", FRAME_NS, 0.08)
    tracing.stage("fuse", FRAME_NS, 0.02)
    tracing.drive(FRAME_NS)
    tracing.stage("encode", FRAME_NS + 1, 0.08)
    encode, fuse, drive, other = exporter.get_finished_spans()
    assert drive.name == DRIVE
    assert drive.parent is None
    assert drive.start_time == FRAME_NS
    for span in (encode, fuse):
        assert span.parent is not None
        assert span.context.trace_id == drive.context.trace_id
        assert span.parent.span_id == drive.context.span_id
    assert len({span.context.span_id for span in (encode, fuse, drive, other)}) == 4
    assert other.context.trace_id != drive.context.trace_id
    assert encode.end_time is not None
    assert encode.start_time is not None
    assert encode.end_time - encode.start_time == 80_000_000
    assert encode.resource.attributes["service.name"] == "mapper"


class Collector(HTTPServer):
    """Takes what is posted to it."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), CollectorHandler)
        self.posted: list[tuple[str, bytes]] = []
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def close(self) -> None:
        self.shutdown()
        self.server_close()


class CollectorHandler(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        assert isinstance(self.server, Collector)
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.posted.append((self.path, body))
        self.send_response(200)
        self.end_headers()

    def log_message(self, *arguments: Any) -> None:
        """Nothing to the test's output."""


def test_a_collector_gets_the_spans(monkeypatch: pytest.MonkeyPatch) -> None:
    trace_service = pytest.importorskip(
        "opentelemetry.proto.collector.trace.v1.trace_service_pb2",
        reason="needs the OTLP exporter: pip install -e '.[otel]'",
    )
    collector = Collector()
    url = f"http://127.0.0.1:{collector.server_port}/v1/traces"
    monkeypatch.setattr(tracing, "TRACED_SHARE", 1.0)
    tracing.start(LogConfig(traces=url), "perception")
    tracing.stage("encode", FRAME_NS, 0.08)
    tracing.use(None)  # sends what is left
    collector.close()
    ((path, body),) = collector.posted
    request = trace_service.ExportTraceServiceRequest.FromString(body)
    (span,) = request.resource_spans[0].scope_spans[0].spans
    assert (path, span.name) == ("/v1/traces", "encode")
    assert int.from_bytes(span.trace_id, "big") == frame_ids(FRAME_NS)[0]


def test_off_by_default_and_then_nothing_is_imported() -> None:
    code = (
        "import sys; from onemap_shared import tracing\n"
        "from onemap_shared.config import LogConfig\n"
        "tracing.start(LogConfig(), 'mapper'); tracing.stage('fuse', 1, 0.1); tracing.drive(1)\n"
        "print(any(name.startswith('opentelemetry') for name in sys.modules))"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert result.stdout.strip() == "False"


@pytest.mark.parametrize("traces", ["127.0.0.1:4318", "grpc://host:4317", "http://a b"])
def test_an_address_that_is_none_is_refused(traces: str) -> None:
    with pytest.raises(ValueError, match="traces"):
        LogConfig(traces=traces)
