"""What a map remembers of the frames of one robot.

Several robots may share a map. Each counts its own frames on its own clock, and what one of them
shows says nothing about what another has searched.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from onemap_mapper.frame_update import FrameUpdate
from onemap_mapper.keyframes import Keyframes, Views
from onemap_shared.geometry import F64


@dataclass(frozen=True, slots=True)
class FrameHistory:
    """The frames of one robot in one map.

    sequence and stamp_ns: of the newest one, 0 before the first; frames: how many were fused since
    the map was begun or loaded; start_m and camera_m (3,): the camera's position in the first and
    in the newest one, map frame, None if it is not known.
    """

    sequence: int = 0
    stamp_ns: int = 0
    frames: int = 0
    start_m: F64 | None = None
    camera_m: F64 | None = None
    keyframes: Keyframes = field(default_factory=Keyframes)

    def after(self, update: FrameUpdate, views: Views) -> FrameHistory:
        """The history after a frame that counted for so many views."""
        return FrameHistory(
            sequence=update.sequence,
            stamp_ns=update.stamp_ns,
            frames=self.frames + 1,
            start_m=update.camera_m if self.start_m is None else self.start_m,
            camera_m=update.camera_m,
            keyframes=self.keyframes.after(update.T_map_camera, views),
        )

    def of_new_search(self) -> FrameHistory:
        """What is in view when a search begins was not searched yet."""
        return replace(self, keyframes=self.keyframes.of_new_search())


NO_FRAMES = FrameHistory()
