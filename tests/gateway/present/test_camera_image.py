"""Boxes on the camera's image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_gateway.present.canvas import BLACK
from onemap_gateway.present.render import BOX, annotate_detections, encode_jpeg
from tests.gateway.fakes import detections, rgbd


def test_without_detections_the_image_is_a_copy() -> None:
    rgb = rgbd().rgb
    image = annotate_detections(rgb, None)
    np.testing.assert_array_equal(image, rgb)
    assert image is not rgb


def test_a_detection_is_framed() -> None:
    rgb = rgbd().rgb
    image = annotate_detections(rgb, detections("sofa"))
    np.testing.assert_array_equal(image[18, 12], BOX)
    assert not (rgb == BOX).all(axis=-1).any()


def test_boxes_beyond_the_image_do_no_harm() -> None:
    wild = replace(detections("sofa"), boxes_px=np.array([[-1e9, -1e9, 1e9, 1e9]], np.float32))
    assert annotate_detections(rgbd().rgb, wild).shape == (24, 32, 3)


def test_a_label_at_the_upper_edge_is_not_cut_off() -> None:
    def label_rows(top: float) -> int:
        box = np.array([[20.0, top, 140.0, 110.0]], np.float32)
        seen = replace(detections("sofa"), boxes_px=box)
        image = annotate_detections(np.zeros((120, 160, 3), np.uint8), seen)
        outline = np.all(image == BLACK, axis=-1)
        return int(outline.any(axis=1).sum())

    assert label_rows(0.0) == label_rows(60.0)


def test_jpeg_is_jpeg() -> None:
    assert encode_jpeg(rgbd().rgb, 80).startswith(b"\xff\xd8")
