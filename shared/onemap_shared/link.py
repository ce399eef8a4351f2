"""How frames and fields travel: compressed or not, and how many may be under way at once.

The settings belong to the process that sends. Receivers need none: a packet says how it is
compressed, and receipts are always sent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from pydantic import Field

from onemap_shared.compression import Codec, Compression
from onemap_shared.messages import FeatureField, RgbdFrame
from onemap_shared.params import Params

# A frame whose receipt has not come by then counts as lost: the goal for the age of the map is
# 0.4 s, and 384 kB, an uncompressed frame, take 0.3 s on 10 Mbit/s.
OVERDUE_S = 1.0


class LinkParams(Params):
    """What this process does to the frames and fields that it sends. All off by default: on
    loopback or a wired network the time for compressing is lost."""

    color: Literal["raw", "lossless", "jpeg"] = Field(
        default="raw",
        description="Images of frames. With jpeg and lossless depth a frame takes a fifth of its "
        "bytes (simulated, noisy depth). jpeg needs OpenCV at both ends, lossless does not.",
    )
    jpeg_quality: int = Field(
        default=95,
        ge=1,
        le=100,
        description="Of color: jpeg. Of all settings here this one costs most: with 95 the best "
        "places of a query stay so in 93 of 100 cases, with 80 in 87 ('onemap bench link-loss').",
    )
    depth: Literal["raw", "lossless"] = Field(
        default="raw",
        description="Depth of frames and fields. lossless changes no value.",
    )
    features: Literal["raw", "int8"] = Field(
        default="raw",
        description="Features of fields. With int8, log8 and lossless depth a field takes a "
        "quarter of its bytes; int8 changes cosines by 0.0003 ('onemap bench link-loss').",
    )
    variance: Literal["raw", "log8"] = Field(
        default="raw",
        description="Variances of fields. log8: 254 steps of their logarithm; they change by 2 % "
        "at most ('onemap bench link-loss').",
    )
    window: int = Field(
        default=0,
        ge=0,
        le=16,
        description="Frames, and fields, that may be under way without the receiver's receipt; "
        "the newest waits for one and replaces older ones, so that no queue grows on a slow link. "
        "1 keeps them freshest, 2 uses a link with a long delay better; 0: no limit.",
    )


def compressions(message: type, params: LinkParams) -> Mapping[str, Compression]:
    """The arrays of a message type that are compressed, by name; none for most types."""
    color = {
        "raw": None,
        "lossless": Compression(Codec.DELTA),
        "jpeg": Compression(Codec.JPEG, params.jpeg_quality),
    }[params.color]
    depth = Compression(Codec.DELTA) if params.depth == "lossless" else None
    features = Compression(Codec.INT8) if params.features == "int8" else None
    variance = Compression(Codec.LOG8) if params.variance == "log8" else None
    chosen: Mapping[type, Mapping[str, Compression | None]] = {
        RgbdFrame: {"rgb": color, "depth_mm": depth},
        FeatureField: {"features": features, "variance": variance, "depth_mm": depth},
    }
    return {name: each for name, each in chosen.get(message, {}).items() if each is not None}


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
