"""Which frames come late: told by their sequence, because a robot's clock may be set back.

And which may be in another frame of reference: those of a robot that counts anew elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64

# A frame that is older than the map by this and more is no late one: the clock was set back or
# another recording began.
CLOCK_JUMP_NS = 10 * 10**9
# Frames that seem late, each with a higher sequence than the one before, after which they are the
# stream of a robot that began to count anew.
NEW_STREAM_FRAMES = 3
# A robot that was only started again stands where it was, up to what its localisation errs by and
# the way between the last frame that came and its end.
SAME_PLACE_M = 1.0


@dataclass(frozen=True, slots=True)
class FrameStamp:
    """The sequence of a frame and its time of capture."""

    sequence: int
    stamp_ns: int


@dataclass(slots=True)
class FrameOrder:
    """Tells late frames. Holds the last one, and how many came in a row."""

    _last: int = -1
    _run: int = 0

    def is_late(self, frame: FrameStamp, newest: FrameStamp) -> bool:
        """Whether a frame was captured before the newest one of the map, stamp 0 for no frame."""
        back_ns = newest.stamp_ns - frame.stamp_ns
        late = frame.sequence <= newest.sequence and 0 < back_ns < CLOCK_JUMP_NS
        self._run = (self._run if frame.sequence > self._last else 0) + 1 if late else 0
        self._last = frame.sequence if late else -1
        return late and self._run < NEW_STREAM_FRAMES


@dataclass(slots=True)
class OriginCheck:
    """Follows the frames of one robot that shares a map. Holds how far off its stream began.

    A robot whose poses begin anew mostly stands elsewhere, by its poses, than it did. Where it does
    not, or where it was carried, nothing tells.
    """

    _last: int = -1
    _far_m: float = 0.0

    def distance_m(self, sequence: int, camera_m: F64, newest_camera_m: F64 | None) -> float:
        """Metres from the robot's newest frame in the map to where it began to count anew.

        0 if it did not, or within ``SAME_PLACE_M``, or if the map holds none of its frames (None).
        It stays until the robot begins anew in place, or the map does.
        """
        if newest_camera_m is None:
            self._far_m = 0.0
        elif sequence < self._last:
            away_m = float(np.linalg.norm(camera_m - newest_camera_m))
            self._far_m = away_m if away_m > SAME_PLACE_M else 0.0
        self._last = sequence
        return self._far_m
