"""Images of a generated apartment, and what perception makes of them, made before they are sent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared.geometry import F16, F32, F64, U8, U16
from onemap_shared.messages import FeatureField, RgbdFrame
from onemap_simulator.errors import DepthErrorParams
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, RgbdCamera

APARTMENT = 800  # encoders are trained from 1000 on
DEPTH_NOISE_M = 0.002  # at 1 m, as a stereo camera's: without it depth compresses too well


@dataclass(frozen=True)
class Stream:
    """N images and what perception made of them: rgb (N, H, W, 3), depth_mm (N, H, W), features
    (N, h, w, D), variance (N, H, W), T_map_camera (N, 4, 4)."""

    rgb: U8
    depth_mm: U16
    features: F16
    variance: F32
    T_map_camera: F64

    def frame(self, number: int, stamp_ns: int) -> RgbdFrame:
        """The frame of this sequence number."""
        which = number % len(self.rgb)
        camera = CameraParams(width=self.rgb.shape[2], height=self.rgb.shape[1]).intrinsics
        pose = self.T_map_camera[which]
        return RgbdFrame(number, stamp_ns, self.rgb[which], self.depth_mm[which], camera, pose)

    def field(self, frame: RgbdFrame) -> FeatureField:
        """The field of a frame of this stream, with the depth that arrived."""
        which = frame.sequence % len(self.rgb)
        return FeatureField(
            frame.sequence,
            frame.stamp_ns,
            "benchmark",
            "benchmark",
            self.features[which],
            self.variance[which],
            frame.depth_mm,
            frame.intrinsics,
            frame.T_map_camera,
        )


def make_stream(encoder: ImageEncoder, size_px: tuple[int, int], bodies: Sequence[F64]) -> Stream:
    """Images (width, height) of ``APARTMENT`` with noisy depth, encoded.

    bodies: T_map_body (4, 4) of the robot for each image.
    """
    scene = generate_apartment(APARTMENT, TRAINING)
    params = CameraParams(width=size_px[0], height=size_px[1])
    errors = DepthErrorParams(noise_m=DEPTH_NOISE_M)
    camera = RgbdCamera(scene, Renderer(scene), params, np.random.default_rng(APARTMENT), errors)
    frames, fields = [], []
    for number, body in enumerate(bodies):
        image, pose = camera.capture(body), body @ params.mount
        frame = RgbdFrame(number, 1, image.rgb, image.depth_mm, camera.intrinsics, pose)
        frames.append(frame)
        fields.append(feature_field(frame, encoder.encode(frame.rgb), encoder, VarianceParams()))
    return Stream(
        np.stack([frame.rgb for frame in frames]),
        np.stack([frame.depth_mm for frame in frames]),
        np.stack([field.features for field in fields]),
        np.stack([field.variance for field in fields]),
        np.stack([frame.T_map_camera for frame in frames]),
    )
