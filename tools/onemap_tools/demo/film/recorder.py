"""Records moments of a search from the bus."""

from __future__ import annotations

import time
from typing import Any

from onemap_gateway.bus.live_state import BusMessage, LiveState
from onemap_gateway.present.live import build_overlay
from onemap_shared import keys
from onemap_shared.geometry import U8
from onemap_shared.keys import Topic
from onemap_shared.messages import RgbdFrame, SearchView, SearchViewRequest
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_tools.demo.film.moment import FilmMoment
from onemap_tools.demo.film.timeline import FIRST_INTERVAL_S, MAX_MOMENTS
from onemap_tools.demo.run_monitor import waiting

RECENT_IMAGES = 16  # detections arrive some frames after theirs
# What is shown, and how many messages of it are held between two updates.
STREAMS: tuple[tuple[Topic[Any], int], ...] = (
    (keys.ROBOT_RGBD, RECENT_IMAGES),
    (keys.ROBOT_ODOMETRY, 1),
    (keys.DETECTIONS, 1),
    (keys.SEARCH_STATE, 16),
    (keys.SEARCH_PATH, 1),
)


class FilmRecorder:
    """Keeps moments at equal intervals; call ``update`` several times a second.

    When there are ``MAX_MOMENTS``, every second one goes and the interval doubles.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._subscriptions: list[Subscription[BusMessage]] = [
            bus.subscribe(topic, capacity) for topic, capacity in STREAMS
        ]
        self._state = LiveState()
        self._images: dict[int, U8] = {}  # by sequence, the newest RECENT_IMAGES
        self._interval_s = FIRST_INTERVAL_S
        self._due_s = 0.0
        self.moments: tuple[FilmMoment, ...] = ()

    def update(self, now_s: float) -> None:
        """Take the messages since the last update; keep a moment if one is due."""
        self._receive(now_s)
        if now_s >= self._due_s and self._keep(now_s):
            self._due_s = now_s + self._interval_s
            if len(self.moments) >= MAX_MOMENTS:
                self.moments = self.moments[::2]
                self._interval_s *= 2

    def end(self, now_s: float) -> None:
        """Keep the moment at the end of the search."""
        self._receive(now_s)
        self._keep(now_s)

    def _receive(self, now_s: float) -> None:
        for subscription in self._subscriptions:
            for message in waiting(subscription):
                self._state = self._state.with_message(message, now_s)
                if isinstance(message, RgbdFrame):
                    kept = [*self._images.items(), (message.sequence, message.rgb)]
                    self._images = dict(kept[-RECENT_IMAGES:])

    def _keep(self, now_s: float) -> bool:
        """Keep this moment; False without search, camera or map."""
        state = self._state
        if state.search is None or state.frame is None:
            return False
        status = state.search.message
        view = self._view(status.target)
        if view is None:
            return False
        detections = state.detections_now(now_s)
        image = self._images.get(detections.sequence) if detections else None
        end_ns = time.time_ns() if status.active else status.updated_ns
        moment = FilmMoment(
            elapsed_s=max(end_ns - status.started_ns, 0) / 1e9,
            view=view,
            overlay=build_overlay(state, now_s),
            camera=state.frame.message.rgb if image is None else image,
            detections=None if image is None else detections,  # boxes of another image mislead
            status=status,
        )
        self.moments = (*self.moments, moment)
        return True

    def _view(self, text: str) -> SearchView | None:
        try:
            return self._bus.call(keys.MAP_SEARCH_VIEW, SearchViewRequest(text))
        except CallError:
            return None
