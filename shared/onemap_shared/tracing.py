"""Traces of frames by OpenTelemetry, an option: what each stage did with a frame, and when.

No context travels: every stage computes a frame's trace from its capture time, which our own
messages carry, so that neither the bus nor ROS 2 nor HTTP sees anything of it. All spans of a
frame hang below one from the capture to the command. Off until ``start``.
"""
# Talks: reads the clock, sends spans from a thread.

from __future__ import annotations

import threading
import time
from hashlib import blake2b
from typing import TYPE_CHECKING

from onemap_shared.config import ConfigError, LogConfig

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import SpanProcessor

NAMESPACE = b"onemap frame"
# Share of the frames that are traced, the same ones by all services: 1 in 10 is one a second,
# enough for a distribution after a minute.
TRACED_SHARE = 0.1
SEND_S = 1.0  # for a batch, with its repetitions: what a stop waits for a collector that is gone
DRIVE = "image to command"  # the span that holds the others


class FrameTracer:
    """Makes spans; which frames are traced follows from their capture time, alike in all stages."""

    def __init__(self, service: str, share: float, processor: SpanProcessor) -> None:
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.id_generator import RandomIdGenerator
        from opentelemetry.sdk.trace.sampling import TraceIdRatioBased

        class FrameIds(RandomIdGenerator):
            """The ids of a frame for the span that holds the others, random ones for those."""

            frame: tuple[int, int] | None = None

            def generate_trace_id(self) -> int:
                return self.frame[0] if self.frame else super().generate_trace_id()

            def generate_span_id(self) -> int:
                return self.frame[1] if self.frame else super().generate_span_id()

        self._ids = FrameIds()
        self._lock = threading.Lock()
        names = {"service.name": service, "service.namespace": "onemap"}
        self._provider = TracerProvider(
            sampler=TraceIdRatioBased(share),
            resource=Resource.create(names),
            id_generator=self._ids,
            shutdown_on_exit=False,
        )
        self._provider.add_span_processor(processor)
        self._tracer = self._provider.get_tracer("onemap")

    def stage(self, name: str, frame_ns: int, duration_s: float) -> None:
        """A span that ends now, of the frame that was captured at ``frame_ns``."""
        from opentelemetry.trace import (
            NonRecordingSpan,
            SpanContext,
            TraceFlags,
            set_span_in_context,
        )

        trace_id, span_id = frame_ids(frame_ns)
        whole = SpanContext(trace_id, span_id, True, TraceFlags(TraceFlags.SAMPLED))
        context = set_span_in_context(NonRecordingSpan(whole))
        ended_ns = time.time_ns()
        started_ns = ended_ns - int(duration_s * 1e9)
        with self._lock:
            span = self._tracer.start_span(name, context, start_time=started_ns)
        span.end(ended_ns)

    def drive(self, frame_ns: int) -> None:
        """The span from the capture to now, when the first command rests on the frame."""
        from opentelemetry.context import Context

        with self._lock:
            self._ids.frame = frame_ids(frame_ns)
            span = self._tracer.start_span(DRIVE, Context(), start_time=frame_ns)
            self._ids.frame = None
        span.end(time.time_ns())

    def close(self) -> None:
        """Send what is left."""
        self._provider.shutdown()


def frame_ids(frame_ns: int) -> tuple[int, int]:
    """The ids of a frame's trace (128 bits) and of the span that holds the others (64 bits)."""
    digest = blake2b(frame_ns.to_bytes(8, "little", signed=True), key=NAMESPACE, digest_size=24)
    number = int.from_bytes(digest.digest(), "big") | 1 | 1 << 64  # neither id may be 0
    return number >> 64, number & (2**64 - 1)


_tracer: FrameTracer | None = None


def start(config: LogConfig, service: str) -> None:
    """Trace from now on if the configuration says so; ConfigError if the packages are missing."""
    if not config.traces:
        return
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ModuleNotFoundError as missing:
        raise ConfigError(
            f"log.traces is set and needs the package {missing.name!r}: pip install -e '.[otel]'"
        ) from missing
    exporter = OTLPSpanExporter(endpoint=config.traces, timeout=SEND_S)
    use(FrameTracer(service, TRACED_SHARE, BatchSpanProcessor(exporter)))


def use(tracer: FrameTracer | None) -> None:
    """Make spans with this tracer from now on; None ends it."""
    global _tracer  # noqa: PLW0603 - one for a process, as its log
    if _tracer is not None:
        _tracer.close()
    _tracer = tracer


def stage(name: str, frame_ns: int, duration_s: float) -> None:
    """A span of this stage that ends now; nothing unless traces are on."""
    if _tracer is not None and frame_ns > 0:
        _tracer.stage(name, frame_ns, duration_s)


def drive(frame_ns: int) -> None:
    """The span from the capture to now; nothing unless traces are on."""
    if _tracer is not None and frame_ns > 0:
        _tracer.drive(frame_ns)
