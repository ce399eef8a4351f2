"""A mapper on a bus in this process, and recordings of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from onemap_mapper.config import MapperConfig
from onemap_mapper.service import Mapper, build
from onemap_shared import keys
from onemap_shared.messages import RgbdFrame
from onemap_tools.recording.bag_file import BagWriter
from onemap_tools.recording.record import BagRecorder, subscribed
from tests.mapper import scenes
from tests.memory_bus import MemoryRouter

SECOND_NS = 10**9


class RecordedRobot:
    """A mapper that is fed with frames of a room, and a recorder of what happens."""

    def __init__(self, folder: Path, *, images: bool = True) -> None:
        self.router = MemoryRouter()
        self.mapper_bus = self.router.bus("mapper")
        self.mapper: Mapper = build(self.mapper_bus, MapperConfig(map_folder=folder))
        self.bus = self.router.bus("robot")
        self.path = folder / "robot.mcap"
        self._frames = self.bus.publish(keys.ROBOT_RGBD)
        self._fields = self.bus.publish(keys.FIELD)
        self._images = images
        self.now_ns = SECOND_NS

    def begin(self) -> None:
        recording = self.router.bus("recorder")
        streams = subscribed(recording, images=self._images)
        self.writer = BagWriter(self.path, {"onemap": {"version": "1"}})
        self.recorder = BagRecorder(streams, self.writer)

    def see(self, *numbers: int, fused: bool = True) -> None:
        """Frames and their fields; the mapper takes the newest unless it is busy."""
        for number in numbers:
            pose = scenes.pose(-0.5 + 0.1 * number, 0.2, 0.5 * number)
            field = scenes.field(number, pose)
            rgb = np.full((*scenes.SIZE, 3), number, np.uint8)
            frame = RgbdFrame(
                number, field.stamp_ns, rgb, field.depth_mm, field.intrinsics, field.T_map_camera
            )
            self._frames.put(frame)
            self._fields.put(field)
            if fused:
                self.mapper.step(0.0)

    def update(self) -> None:
        """Record what came."""
        self.now_ns += SECOND_NS
        self.recorder.update(self.now_ns)

    def end(self) -> Path:
        self.update()
        self.writer.close({"ended": "stopped"})
        return self.path
