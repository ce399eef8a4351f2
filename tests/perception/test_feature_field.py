"""The message with the features of one frame."""

from __future__ import annotations

import numpy as np

from onemap_perception.feature_field import VarianceParams, feature_field, observation_variance
from tests.perception.toy import CAMERA, ColourEncoder, frame


def test_it_holds_the_frames_own_data_and_the_variance_of_its_depth() -> None:
    encoder, shown, params = ColourEncoder(), frame(3, depth_mm=1234), VarianceParams()
    features = encoder.encode(shown.rgb)
    field = feature_field(shown, features, encoder, params)
    assert (field.sequence, field.stamp_ns) == (3, shown.stamp_ns)
    assert (field.encoder_id, field.text_space) == ("toy", "colours")
    assert field.features is features
    assert (field.depth_mm is shown.depth_mm, field.intrinsics) == (True, CAMERA)
    expected = observation_variance(np.full((32, 48), 1.234, np.float32), CAMERA, params)
    np.testing.assert_allclose(field.variance, expected, rtol=1e-5)
