"""Sends the newest frame of a topic from a thread of its own, as the link allows."""
# Talks: sends from a thread.

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from onemap_shared.clock import Clock
from onemap_shared.compression import Codec, opencv
from onemap_shared.config import LinkParams
from onemap_shared.keys import Topic
from onemap_shared.messages import FeatureField, FrameReceipt, RgbdFrame
from onemap_shared.wire import Packet, WireError, decode, encode

LOG = logging.getLogger("onemap.bus")

M = TypeVar("M")

CLOSING_S = 1.0  # for the frame that is being sent
# A frame whose receipt has not come by then counts as lost: the goal for the age of the map is
# 0.4 s, and 384 kB, an uncompressed frame, take 0.3 s on 10 Mbit/s.
OVERDUE_S = 1.0


def compressions(message: type, how: str) -> Mapping[str, Codec]:
    """The arrays of a message type that ``bus.link.compression`` compresses, by name."""
    delta = Codec.DELTA
    chosen = {
        ("lossless", RgbdFrame): {"rgb": delta, "depth_mm": delta},
        ("lossless", FeatureField): {"depth_mm": delta},
        ("lossy", RgbdFrame): {"rgb": Codec.JPEG, "depth_mm": delta},
        ("lossy", FeatureField): {
            "features": Codec.INT8,
            "variance": Codec.LOG8,
            "depth_mm": delta,
        },
    }
    return chosen.get((how, message), {})


@dataclass(frozen=True, slots=True)
class SendWindow:
    """Which frames are under way. Immutable; times are seconds of one monotonic clock.

    size: frames that may be under way; 0: any number. under_way: sequence and time of sending,
    oldest first. heard: whether any receipt ever came; before, nothing is held back, because the
    receiver may be of a release that sends none. answer_s: from sending to the newest receipt.
    overdue: frames whose receipt did not come in time.
    """

    size: int
    under_way: tuple[tuple[int, float], ...] = ()
    heard: bool = False
    answer_s: float = 0.0
    overdue: int = 0

    def free_at(self) -> float:
        """When the next frame may be sent, if no receipt comes before."""
        if self.size == 0 or not self.heard or len(self.under_way) < self.size:
            return float("-inf")
        return self.under_way[-self.size][1] + OVERDUE_S

    def with_sent(self, sequence: int, now_s: float) -> SendWindow:
        """The window after a frame was sent; those overdue by now are given up."""
        waiting = tuple(each for each in self.under_way if now_s - each[1] < OVERDUE_S)
        lost = len(self.under_way) - len(waiting) if self.heard else 0
        return replace(self, under_way=(*waiting, (sequence, now_s)), overdue=self.overdue + lost)

    def with_receipt(self, sequence: int, now_s: float) -> SendWindow:
        """The window after the receipt of a frame, which is one of all that were sent before.

        The receiver takes the newest frame and skips the others, so they are not under way either.
        A receipt of a frame that is not under way changes nothing but ``heard``.
        """
        places = [i for i, (number, _) in enumerate(self.under_way) if number == sequence]
        if not places:
            return replace(self, heard=True)
        last = places[-1]
        return replace(
            self,
            heard=True,
            under_way=self.under_way[last + 1 :],
            answer_s=now_s - self.under_way[last][1],
        )


class FrameSender(Generic[M]):
    """Keeps one frame waiting; a newer one replaces it. Implements ``transport.Publisher``.

    ``send`` puts a packet on the wire; it is called in this class's thread, which also compresses,
    so that frames that are replaced cost nothing. Raises CompressionError at once if the codecs of
    ``params`` are not installed.
    """

    def __init__(
        self,
        topic: Topic[M],
        params: LinkParams,
        send: Callable[[Packet], None],
        clock: Clock,
    ) -> None:
        self._topic, self._send, self._clock = topic, send, clock
        self._compressions = compressions(topic.message, params.compression)
        if Codec.JPEG in self._compressions.values():
            opencv()
        self._changed = clock.condition()
        self._waiting: M | None = None
        self._window = SendWindow(params.window)
        self._closed = False
        self._frames = self._bytes = self._newest_bytes = self._replaced = 0
        self._thread = clock.thread(f"send {topic.key}", self._run)

    def put(self, message: M) -> None:
        """Send this frame as soon as the link allows, unless a newer one comes before."""
        with self._changed:
            self._replaced += self._waiting is not None
            self._waiting = message
            self._changed.notify()

    def receipt(self, packet: Packet) -> None:
        """Take the receiver's receipt of a frame."""
        try:
            sequence = decode(FrameReceipt, packet).sequence
        except WireError as problem:
            LOG.warning("a receipt of %s is refused: %s", self._topic.key, problem)
            return
        with self._changed:
            self._window = self._window.with_receipt(sequence, self._clock.monotonic_s())
            self._changed.notify()

    def metrics(self) -> dict[str, float]:
        """Counts since the start, bytes of the newest frame, and how long its receipt took."""
        name = f"link_{self._topic.key.split('/')[1]}"
        with self._changed:
            return {
                f"{name}_frames": float(self._frames),
                f"{name}_bytes": float(self._bytes),
                f"{name}_frame_bytes": float(self._newest_bytes),
                f"{name}_replaced": float(self._replaced),
                f"{name}_overdue": float(self._window.overdue),
                f"{name}_receipt_ms": self._window.answer_s * 1e3,
            }

    def close(self) -> None:
        """Send nothing more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(CLOSING_S)

    def _run(self) -> None:
        while (message := self._next()) is not None:
            packet = encode(message, self._compressions)
            try:
                self._send(packet)
            except Exception:
                if self._closed:  # the bus did not wait for a frame that the link holds up
                    return
                raise
            with self._changed:
                self._frames += 1
                self._newest_bytes = len(packet.header) + len(packet.body)
                self._bytes += self._newest_bytes

    def _next(self) -> M | None:
        """The frame to send now, once there is one and the window is open; None at the end."""
        with self._changed:
            while not self._closed:
                now_s = self._clock.monotonic_s()
                if self._waiting is None:
                    self._changed.wait()
                elif (free_s := self._window.free_at()) > now_s:
                    self._changed.wait(free_s - now_s)
                else:
                    message, self._waiting = self._waiting, None
                    sequence: Any = getattr(message, "sequence", 0)
                    self._window = self._window.with_sent(sequence, now_s)
                    return message
        return None
