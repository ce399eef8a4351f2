"""Rates of events, measured. Times are seconds of one monotonic clock, given by the caller."""

from __future__ import annotations

from dataclasses import dataclass

WINDOW_S = 5.0  # long enough for one frame a second, short enough to show a stall
MAX_EVENTS = 100  # five seconds at 20 Hz; of faster streams fewer seconds give the rate as well


@dataclass(frozen=True, slots=True)
class RateMeter:
    """The events of the last ``WINDOW_S``. Immutable: a reader sees old or new.

    times_s: of the newest events in the window, at most ``MAX_EVENTS``, oldest first; the newest
    is kept however old it is.
    """

    times_s: tuple[float, ...] = ()

    def with_event(self, now_s: float) -> RateMeter:
        """The meter after an event at ``now_s``."""
        recent = tuple(at for at in self.times_s if now_s - at <= WINDOW_S)
        return RateMeter((*recent, now_s)[-MAX_EVENTS:])

    def rate_hz(self, now_s: float) -> float:
        """Events per second; falls as soon as they stop; 0 with fewer than two in the window."""
        recent = [at for at in self.times_s if now_s - at <= WINDOW_S]
        if len(recent) < 2:
            return 0.0
        intervals = len(recent) - 1
        usual_s = (recent[-1] - recent[0]) / intervals
        # Until the next event is overdue, the time since the last one does not count.
        overdue_s = max(now_s - recent[-1] - usual_s, 0.0)
        return intervals / max(recent[-1] - recent[0] + overdue_s, 1e-3)

    def silent_s(self, now_s: float, *, since_s: float) -> float:
        """Seconds since the newest event, or since ``since_s`` if there was none yet."""
        return now_s - (self.times_s[-1] if self.times_s else since_s)
