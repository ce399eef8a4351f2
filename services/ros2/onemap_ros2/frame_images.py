"""The images of one moment, and the frame that is made of them: units, size, registration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from onemap_ros2.cdr import IMAGE, FormatError, image_type
from onemap_ros2.config import Ros2Config
from onemap_ros2.images import (
    CalibratedCamera,
    CameraPair,
    color_image,
    compressed_color,
    compressed_depth_mm,
    depth_image_mm,
    register_depth,
)
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64
from onemap_shared.messages import RgbdFrame


@dataclass(frozen=True, slots=True)
class FrameImages:
    """A color and a depth image, decoded as messages, with all that places them.

    T_map_camera: (4, 4) of the camera that the frame is of. T_color_depth: (4, 4), None where the
    depth image is registered to the color image already. cameras: by the setting of their topic.
    """

    stamp_ns: int
    color: Any
    depth: Any
    T_map_camera: F64
    T_color_depth: F64 | None
    cameras: Mapping[str, CalibratedCamera]
    config: Ros2Config

    def frame(self) -> RgbdFrame:
        """The frame, numbered 0; it takes up to 0.25 s. ValueError for what is none."""
        topics = self.config.topics
        raw_color, raw_depth = (image_type(t) == IMAGE for t in (topics.color, topics.depth))
        depth_mm = (depth_image_mm if raw_depth else compressed_depth_mm)(self.depth)
        rgb = (color_image if raw_color else compressed_color)(self.color)
        camera = self._camera("camera_info", rgb)
        if self.T_color_depth is not None:
            depth_camera = self._camera("depth_camera_info", depth_mm)
            pair = CameraPair(depth_camera, camera, self.T_color_depth)
            depth_mm = register_depth(depth_mm, pair, rgb.shape[:2])
        if rgb.shape[:2] != depth_mm.shape:
            raise FormatError(
                f"the depth image has {depth_mm.shape[1]} x {depth_mm.shape[0]} pixels and the "
                f"color image {rgb.shape[1]} x {rgb.shape[0]}: choose a depth topic that is "
                "registered to the color image, or set ros2.topics.depth_camera_info"
            )
        frame = f"{self.config.namespace}/{self.config.map_frame}".strip("/")
        world = f"frame {frame[-50:]}"  # of the 64 characters of a name
        return RgbdFrame(0, self.stamp_ns, rgb, depth_mm, camera, self.T_map_camera, world)

    def _camera(self, kind: str, image: NDArray) -> Intrinsics:
        """The camera of an image (H, W, ...), by the camera information of this setting."""
        height, width = image.shape[:2]
        with naming(self.config, kind):
            return self.cameras[kind].of_image(width, height)


@contextmanager
def naming(config: Ros2Config, kind: str) -> Iterator[None]:
    """What is wrong inside names the topic of this setting."""
    try:
        yield
    except ValueError as problem:
        topic = getattr(config.names, kind)
        raise FormatError(f"{topic} (ros2.topics.{kind}): {problem}") from problem
