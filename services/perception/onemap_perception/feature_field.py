"""The message with the features of one frame and their variances."""

from __future__ import annotations

from onemap_perception.backproject import MILLIMETRE_M
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.variance import VarianceParams, observation_variance
from onemap_shared.geometry import F16
from onemap_shared.messages import FeatureField, RgbdFrame


def feature_field(
    frame: RgbdFrame, features: F16, encoder: Encoder, params: VarianceParams
) -> FeatureField:
    """The features (h, w, D) of a frame with depth, pose and the variance of every pixel."""
    return FeatureField(
        sequence=frame.sequence,
        stamp_ns=frame.stamp_ns,
        encoder_id=encoder.encoder_id,
        text_space=encoder.text_space,
        features=features,
        variance=observation_variance(frame.depth_mm * MILLIMETRE_M, frame.intrinsics, params),
        depth_mm=frame.depth_mm,
        intrinsics=frame.intrinsics,
        T_map_camera=frame.T_map_camera,
    )
