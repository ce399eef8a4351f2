"""The link between camera and computer: frames come late, or not at all."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

import numpy as np
from pydantic import Field

from onemap_shared.params import Params

Item = TypeVar("Item")


class FrameLinkParams(Params):
    """Delays and losses of frames; off by default. Stamps and poses stay those of the capture."""

    min_delay_s: float = Field(
        default=0.0,
        ge=0,
        le=10,
        description="Least seconds from a capture to its arrival; 0: none, as on one computer.",
    )
    max_delay_s: float = Field(
        default=0.0,
        ge=0,
        le=10,
        description="Most seconds; each frame's delay is drawn evenly between both. 0.1 to 0.6 "
        "stands for compressed images over a busy wireless network.",
    )
    lost_share: float = Field(
        default=0.0,
        ge=0,
        lt=1,
        description="Share, in [0, 1), of the frames that never arrive; 0: as on one computer.",
    )
    lost_in_a_row: float = Field(
        default=4.0,
        ge=1,
        le=1000,
        description="Mean number of frames lost one after the other: losses of wireless networks "
        "come in bursts (Gilbert, 1960). 4 are a second at 4 Hz.",
    )


class FrameLink(Generic[Item]):
    """Delivers what is sent in its order, late, with losses."""

    def __init__(self, params: FrameLinkParams, rng: np.random.Generator) -> None:
        self._params, self._rng = params, rng
        self._under_way: deque[tuple[float, Item]] = deque()  # when it arrives, what
        self._losing = False
        self.lost = 0

    def send(self, item: Item, now_s: float) -> None:
        """Send a frame that was captured now, in seconds of any monotonic clock."""
        if self._loses():
            self.lost += 1
            return
        params = self._params
        low_s, high_s = sorted((params.min_delay_s, params.max_delay_s))
        delay_s = float(self._rng.uniform(low_s, high_s)) if high_s > 0 else 0.0
        before_s = self._under_way[-1][0] if self._under_way else now_s
        self._under_way.append((max(before_s, now_s + delay_s), item))

    def arrived(self, now_s: float) -> list[Item]:
        """The frames that arrived since the last call, oldest first."""
        items = []
        while self._under_way and self._under_way[0][0] <= now_s:
            items.append(self._under_way.popleft()[1])
        return items

    def next_s(self) -> float | None:
        """When the next frame arrives; None if none is under way."""
        return self._under_way[0][0] if self._under_way else None

    def _loses(self) -> bool:
        """Whether the next frame is lost: a chain of two states, losing and not."""
        params = self._params
        if params.lost_share == 0:
            return False
        ends = 1.0 / params.lost_in_a_row
        begins = min(ends * params.lost_share / (1.0 - params.lost_share), 1.0)
        chance = self._rng.random()
        self._losing = chance >= ends if self._losing else chance < begins
        return self._losing
