"""The images of one moment, and the frame that is made of them: units and size."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from onemap_ros2.cdr import IMAGE, FormatError, image_type
from onemap_ros2.config import Ros2Config
from onemap_ros2.images import (
    CalibratedCamera,
    color_image,
    compressed_color,
    compressed_depth_mm,
    depth_image_mm,
)
from onemap_shared.geometry import F64
from onemap_shared.messages import RgbdFrame


@dataclass(frozen=True, slots=True)
class FrameImages:
    """A color and a depth image, decoded as messages, with all that places them.

    T_map_camera: (4, 4), of both.
    """

    stamp_ns: int
    color: Any
    depth: Any
    T_map_camera: F64
    camera: CalibratedCamera
    config: Ros2Config

    def frame(self) -> RgbdFrame:
        """The frame, numbered 0. ValueError for what is none."""
        topics = self.config.topics
        raw_color, raw_depth = (image_type(t) == IMAGE for t in (topics.color, topics.depth))
        depth_mm = (depth_image_mm if raw_depth else compressed_depth_mm)(self.depth)
        rgb = (color_image if raw_color else compressed_color)(self.color)
        height, width = rgb.shape[:2]
        with naming(self.config):
            camera = self.camera.of_image(width, height)
        if (height, width) != depth_mm.shape:
            raise FormatError(
                f"the depth image has {depth_mm.shape[1]} x {depth_mm.shape[0]} pixels and the "
                f"color image {width} x {height}: choose a depth topic that is registered to the "
                "color image, or register it with depth_image_proc"
            )
        frame = f"{self.config.namespace}/{self.config.map_frame}".strip("/")
        world = f"frame {frame[-50:]}"  # of the 64 characters of a name
        return RgbdFrame(0, self.stamp_ns, rgb, depth_mm, camera, self.T_map_camera, world)


@contextmanager
def naming(config: Ros2Config) -> Iterator[None]:
    """What is wrong inside names the topic of the camera information."""
    try:
        yield
    except ValueError as problem:
        raise FormatError(
            f"{config.names.camera_info} (ros2.topics.camera_info): {problem}"
        ) from problem
