"""Pairs color and depth messages by the stamps in their headers; keeps the newest only."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

KEPT = 10  # of each kind: a third of a second at 30 Hz, more than two streams of a camera differ


@dataclass(frozen=True, slots=True)
class ImagePair:
    """One color and one depth message, still encoded; the stamp is the depth's, in ns."""

    stamp_ns: int
    color: bytes
    depth: bytes


@dataclass(slots=True)
class PairBuffer:
    """Messages that wait for their counterpart.

    tolerance_ns: by how much the stamps of a pair may differ. unpaired: messages that went
    without a counterpart.
    """

    tolerance_ns: int
    unpaired: int = 0
    _color: OrderedDict[int, bytes] = field(default_factory=OrderedDict)
    _depth: OrderedDict[int, bytes] = field(default_factory=OrderedDict)

    def add_color(self, stamp_ns: int, data: bytes) -> None:
        """A color message."""
        self._keep(self._color, stamp_ns, data)

    def add_depth(self, stamp_ns: int, data: bytes) -> None:
        """A depth message."""
        self._keep(self._depth, stamp_ns, data)

    def take(self) -> ImagePair | None:
        """The newest pair, or None; what is not newer than it is dropped."""
        for stamp_ns in sorted(self._depth, reverse=True):
            near = min(self._color, key=lambda other: abs(other - stamp_ns), default=None)
            if near is not None and abs(near - stamp_ns) <= self.tolerance_ns:
                pair = ImagePair(stamp_ns, self._color.pop(near), self._depth.pop(stamp_ns))
                self._drop(self._color, near)
                self._drop(self._depth, stamp_ns)
                return pair
        return None

    def clear(self) -> None:
        """Forget everything: the clock jumped back."""
        self._color.clear()
        self._depth.clear()

    def _keep(self, kept: OrderedDict[int, bytes], stamp_ns: int, data: bytes) -> None:
        kept[stamp_ns] = data
        while len(kept) > KEPT:
            kept.popitem(last=False)
            self.unpaired += 1

    def _drop(self, kept: OrderedDict[int, bytes], until_ns: int) -> None:
        for stamp_ns in [stamp for stamp in kept if stamp <= until_ns]:
            del kept[stamp_ns]
            self.unpaired += 1
