"""Frames and their fields for a benchmark: images of a generated apartment, encoded beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from onemap_perception.encoders.params import EncoderParams
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared.config import LinkParams
from onemap_shared.frame_sender import compressions
from onemap_shared.geometry import F16, F32, U8, U16
from onemap_shared.messages import FeatureField, RgbdFrame
from onemap_shared.wire import encode
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.rendering.camera_poses import sample_camera_poses
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm, noisy_depth

APARTMENT = 800  # encoders are trained from 1000 on
IMAGES = 16
DEPTH_NOISE_M = 0.002  # at 1 m, as a stereo camera's: without it depth compresses too well
POSE = np.eye(4)


@dataclass(frozen=True, slots=True)
class Stream:
    """N images and what perception made of them: rgb (N, H, W, 3), depth_mm (N, H, W), features
    (N, h, w, D), variance (N, H, W)."""

    rgb: U8
    depth_mm: U16
    features: F16
    variance: F32

    def frame(self, number: int, stamp_ns: int) -> RgbdFrame:
        """The frame of this sequence number."""
        which = number % len(self.rgb)
        camera = CameraParams(width=self.rgb.shape[2], height=self.rgb.shape[1]).intrinsics
        return RgbdFrame(number, stamp_ns, self.rgb[which], self.depth_mm[which], camera, POSE)

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

    def save(self, path: Path) -> None:
        """Write the stream to an .npz file."""
        np.savez(
            path,
            rgb=self.rgb,
            depth_mm=self.depth_mm,
            features=self.features,
            variance=self.variance,
        )


def load_stream(path: Path) -> Stream:
    """The stream of an .npz file."""
    with np.load(path, allow_pickle=False) as file:
        return Stream(file["rgb"], file["depth_mm"], file["features"], file["variance"])


def make_stream(encoder: EncoderParams, size_px: tuple[int, int], images: int = IMAGES) -> Stream:
    """Images (width, height) of an apartment with noisy depth, encoded; ValueError if it cannot."""
    try:
        network = make_encoder(encoder)
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    rng = np.random.default_rng(APARTMENT)
    scene = generate_apartment(APARTMENT, TRAINING)
    camera = CameraParams(width=size_px[0], height=size_px[1])
    renderer = Renderer(scene)
    frames, fields = [], []
    for number, pose in enumerate(sample_camera_poses(scene, rng, images)):
        view = renderer.render(pose, camera.intrinsics, width=size_px[0], height=size_px[1])
        depth_m = noisy_depth(view.depth_m, DEPTH_NOISE_M, rng)
        depth_mm = measured_mm(depth_m, camera.min_depth_m, camera.max_depth_m)
        frame = RgbdFrame(number, 1, view.rgb, depth_mm, camera.intrinsics, POSE)
        frames.append(frame)
        fields.append(feature_field(frame, network.encode(view.rgb), network, VarianceParams()))
    return Stream(
        np.stack([frame.rgb for frame in frames]),
        np.stack([frame.depth_mm for frame in frames]),
        np.stack([field.features for field in fields]),
        np.stack([field.variance for field in fields]),
    )


def sizes_kb(stream: Stream, params: LinkParams) -> tuple[float, float]:
    """Mean kB of a frame and of a field on the wire."""
    frames = [stream.frame(number, 1) for number in range(len(stream.rgb))]
    fields = [stream.field(frame) for frame in frames]
    return _mean_kb(frames, params), _mean_kb(fields, params)


def _mean_kb(messages: Sequence[RgbdFrame | FeatureField], params: LinkParams) -> float:
    how = compressions(type(messages[0]), params.compression)
    packets = [encode(message, how) for message in messages]
    return float(np.mean([len(each.header) + len(each.body) for each in packets])) / 1e3
